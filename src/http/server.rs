//! Connections: accepted, limited, ended.

use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::extract::Request;
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::server::graceful::GracefulShutdown;
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio_io_timeout::TimeoutStream;
use tokio_util::sync::CancellationToken;
use tower::util::MapRequest;

use crate::http::Limits;
use crate::http::client::Client;
use crate::http::outlive::Outliving;
use crate::http::places::{Full, Place, Places, Whose, count_refusal};
use crate::http::problem::Problem;

/// Grace period for open requests after a shutdown begins.
const GRACE: Duration = Duration::from_secs(5);

/// Number of connections beyond the limit of all that are answered: health as always, everything else that the service is busy. As
/// many are answered beyond the limits of clients.
const KEPT_BACK: usize = 16;

/// Seconds within which the head of a request must arrive on a connection beyond the limit.
const HEADER_SECONDS_BEYOND: u64 = 2;

/// Limit that the connection of a request exceeds.
#[derive(Clone, Copy)]
enum Beyond {
    OfAll,
    OfClient(Full),
}

/// Serves until `shutdown`, then ends open requests.
///
/// It does not use `axum::serve`, which limits neither the time that a request's head may take, nor the time within which a client
/// must accept some of its answer, so that idle connections would collect.
pub async fn serve(listener: TcpListener, router: Router, limits: &Limits, shutdown: CancellationToken) {
    let graceful = GracefulShutdown::new();
    let places = |count: usize| Arc::new(Semaphore::new(count));
    let slots = Slots {
        within: places(limits.connections),
        beyond: places(KEPT_BACK),
        of_clients: Places::new("connections", "connections", limits.connections, limits.connections_per_client),
        beyond_of_clients: places(KEPT_BACK),
    };
    let builder = |header_seconds: u64| {
        let mut builder = http1::Builder::new();
        builder.timer(TokioTimer::new()).header_read_timeout(Duration::from_secs(header_seconds));
        builder
    };
    let within = builder(limits.header_seconds);
    let mut beyond = builder(limits.header_seconds.min(HEADER_SECONDS_BEYOND));
    beyond.keep_alive(false);
    loop {
        let accepted = tokio::select! {
            () = shutdown.cancelled() => break,
            accepted = accept(&listener, &slots) => accepted,
        };
        let Some((stream, client, slot)) = accepted else { continue };
        let mut stream = TimeoutStream::new(stream);
        stream.set_write_timeout(Some(Duration::from_secs(limits.write_seconds)));
        let (builder, is_beyond) = match slot {
            Slot::Within(..) => (&within, None),
            Slot::Beyond(_, limit) => (&beyond, Some(limit)),
        };
        let service = MapRequest::new(router.clone(), move |mut request: hyper::Request<Incoming>| {
            request.extensions_mut().insert(client);
            if let Some(limit) = is_beyond {
                request.extensions_mut().insert(limit);
            }
            request
        });
        let service = Outliving(TowerToHyperService::new(service));
        let connection = builder.serve_connection(TokioIo::new(Box::pin(stream)), service);
        let connection = graceful.watch(connection);
        tokio::spawn(async move {
            if let Err(error) = connection.await {
                tracing::debug!(%error, "a connection ended with an error");
            }
            drop(slot);
        });
    }
    drop(listener);
    if tokio::time::timeout(GRACE, graceful.shutdown()).await.is_err() {
        tracing::warn!("requests were still open at the end of the grace period");
    }
}

/// Limits on open connections.
struct Slots {
    within: Arc<Semaphore>,
    beyond: Arc<Semaphore>,
    of_clients: Arc<Places>,
    beyond_of_clients: Arc<Semaphore>,
}

/// Place of an open connection, freed when it is dropped.
#[expect(dead_code, reason = "held, not read")]
enum Slot {
    Within(OwnedSemaphorePermit, Place),
    Beyond(OwnedSemaphorePermit, Beyond),
}

/// Accepts the next connection; `None` if it failed, or exceeds the limits too far to be answered at all.
async fn accept(listener: &TcpListener, slots: &Slots) -> Option<(TcpStream, Client, Slot)> {
    let (permit, is_within) = tokio::select! {
        biased;
        permit = slots.within.clone().acquire_owned() => (permit.ok()?, true),
        permit = slots.beyond.clone().acquire_owned() => (permit.ok()?, false),
    };
    match listener.accept().await {
        Ok((stream, peer)) => {
            // events are small and shall not wait for more
            let _ = stream.set_nodelay(true);
            let client = Client::at(peer);
            let slot = match slots.of_clients.take(client) {
                Ok(place) if is_within => Slot::Within(permit, place),
                Ok(_) => Slot::Beyond(permit, Beyond::OfAll),
                // this permit is left to other clients: connections beyond the limit of a client have permits of their own
                Err(full) => {
                    Slot::Beyond(slots.beyond_of_clients.clone().try_acquire_owned().ok()?, Beyond::OfClient(full))
                }
            };
            Some((stream, client, slot))
        }
        Err(error) => {
            // too many open files, or the client has gone: neither ends the service
            tracing::warn!(%error, "accepting a connection failed");
            tokio::time::sleep(Duration::from_millis(100)).await;
            None
        }
    }
}

/// Answers only health checks and metrics on connections beyond a limit, and refuses everything else.
pub async fn answer_health_only_beyond(request: Request, next: Next) -> Response {
    let beyond = request.extensions().get::<Beyond>().copied();
    match beyond.filter(|_| !matches!(request.uri().path(), "/livez" | "/readyz" | "/metrics")) {
        None => next.run(request).await,
        Some(Beyond::OfAll) => {
            count_refusal("connections", Whose::Service);
            Problem::unavailable("the service has reached its limit of connections; try again later").into_response()
        }
        Some(Beyond::OfClient(full)) => Problem::from(full).into_response(),
    }
}
