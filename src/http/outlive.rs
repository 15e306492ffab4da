//! Requests that are carried out though their client has gone.

use std::convert::Infallible;
use std::pin::Pin;

use axum::http::Method;
use axum::response::{IntoResponse, Response};
use hyper::Request;
use hyper::body::Incoming;
use hyper::service::Service;

use crate::http::problem::Problem;

/// Hands requests on, those that queue a job as tasks of their own. hyper drops a request's future when it reads the end of the
/// connection, before it has polled it once if the client was quick; a posted job must not depend on that.
pub struct Outliving<S>(pub S);

impl<S> Service<Request<Incoming>> for Outliving<S>
where
    S: Service<Request<Incoming>, Response = Response, Error = Infallible>,
    S::Future: Send + 'static,
{
    type Response = Response;
    type Error = Infallible;
    type Future = Pin<Box<dyn Future<Output = Result<Response, Infallible>> + Send>>;

    fn call(&self, request: Request<Incoming>) -> Self::Future {
        let queues = request.method() == Method::POST && request.uri().path() == "/v1/jobs";
        let answer = self.0.call(request);
        if !queues {
            return Box::pin(answer);
        }
        let task = tokio::spawn(answer);
        Box::pin(async move {
            match task.await {
                Ok(answer) => answer,
                Err(error) => {
                    tracing::error!(%error, "queueing a job panicked");
                    Ok(Problem::internal().into_response())
                }
            }
        })
    }
}
