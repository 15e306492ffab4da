//! Requests that are carried out even if their client disconnects.

use std::convert::Infallible;
use std::pin::Pin;

use axum::extract::FromRequestParts;
use axum::http::Method;
use axum::http::request::Parts;
use axum::response::{IntoResponse, Response};
use hyper::Request;
use hyper::body::Incoming;
use hyper::service::Service;
use tokio_util::sync::CancellationToken;

use crate::http::problem::Problem;

/// Service that hands requests on, those that queue a job as tasks of their own. hyper drops a request's future when it reads the
/// end of the connection, before it has polled it once if the client was quick; a posted job must not depend on that.
pub struct Outliving<S>(pub S);

/// Signal to a request that outlives its client that the client has disconnected.
#[derive(Clone, Default)]
pub struct HungUp(CancellationToken);

impl HungUp {
    /// Returns when the client has disconnected.
    pub async fn wait(&self) {
        self.0.cancelled().await;
    }
}

/// Extracts the signal; requests that end with their clients get one that is never given.
impl<S: Sync> FromRequestParts<S> for HungUp {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Infallible> {
        Ok(parts.extensions.get().cloned().unwrap_or_default())
    }
}

impl<S> Service<Request<Incoming>> for Outliving<S>
where
    S: Service<Request<Incoming>, Response = Response, Error = Infallible>,
    S::Future: Send + 'static,
{
    type Response = Response;
    type Error = Infallible;
    type Future = Pin<Box<dyn Future<Output = Result<Response, Infallible>> + Send>>;

    fn call(&self, mut request: Request<Incoming>) -> Self::Future {
        let queues = request.method() == Method::POST && request.uri().path() == "/v1/jobs";
        if !queues {
            return Box::pin(self.0.call(request));
        }
        let hung_up = HungUp::default();
        let told = hung_up.0.clone().drop_guard();
        request.extensions_mut().insert(hung_up);
        let task = tokio::spawn(self.0.call(request));
        Box::pin(async move {
            let _told = told;
            match task.await {
                Ok(answer) => answer,
                Err(error) => Ok(Problem::failed("queueing a job panicked", &error).into_response()),
            }
        })
    }
}
