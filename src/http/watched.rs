//! Jobs and sets of jobs whose events are followed live, with one reader for each, for any number of streams.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use axum::response::sse::Event as SseEvent;
use serde::Serialize;
use tokio::sync::broadcast;
use uuid::Uuid;

/// Largest number of events that a stream may be behind the reader; one further behind reads those that it has missed itself.
const BEHIND: usize = 128;

/// Message from a reader to its streams.
pub struct News {
    /// Id of the last event before this one: a stream that has sent that one has missed nothing.
    pub previous: i64,
    pub event: SentEvent,
}

/// An event in the form in which it is sent.
#[derive(Clone)]
pub struct SentEvent {
    /// Id of the event; `None` for one that is sent live only.
    pub id: Option<i64>,
    /// True if no event comes after it.
    pub is_final: bool,
    pub text: SseEvent,
}

impl SentEvent {
    /// Writes an event that is not the last one.
    pub fn new(id: Option<i64>, name: &str, data: &impl Serialize) -> Self {
        let text = id.map_or_else(SseEvent::default, |id| SseEvent::default().id(id.to_string()));
        // our own types always serialise
        let text = text.event(name).data(serde_json::to_string(data).unwrap_or_default());
        Self { id, is_final: false, text }
    }
}

/// Sources that have open streams now, by the ids of their jobs or sets.
pub struct Watched<S> {
    readers: Mutex<HashMap<Uuid, Reader<S>>>,
}

struct Reader<S> {
    source: Arc<S>,
    sender: broadcast::Sender<Arc<News>>,
}

/// Streams of one reader, which is on the list until this is dropped.
pub struct Streams<'a, S> {
    pub watched: &'a Watched<S>,
    pub id: Uuid,
    pub sender: broadcast::Sender<Arc<News>>,
}

impl<S> Default for Watched<S> {
    fn default() -> Self {
        Self { readers: Mutex::default() }
    }
}

impl<S> Watched<S> {
    /// Returns the number of jobs or sets that have a reader.
    pub fn count(&self) -> usize {
        self.lock().len()
    }

    /// Adds a stream of the events of `id`, and returns the reader's source with the channel of all that is new from now on. `begin`
    /// starts a reader of `source` if there is none.
    pub fn subscribe(
        &self,
        id: Uuid,
        source: S,
        begin: impl FnOnce(Arc<S>, broadcast::Sender<Arc<News>>),
    ) -> (Arc<S>, broadcast::Receiver<Arc<News>>) {
        let mut readers = self.lock();
        if let Some(reader) = readers.get(&id) {
            return (reader.source.clone(), reader.sender.subscribe());
        }
        let (source, (sender, receiver)) = (Arc::new(source), broadcast::channel(BEHIND));
        readers.insert(id, Reader { source: source.clone(), sender: sender.clone() });
        begin(source.clone(), sender);
        (source, receiver)
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<Uuid, Reader<S>>> {
        // a map of senders is never left half changed
        self.readers.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<S> Streams<'_, S> {
    /// Sends an event to all streams; `previous` is the id of the last event before it.
    pub fn tell(&self, previous: i64, event: SentEvent) {
        // an error means that nobody listens now
        let _ = self.sender.send(Arc::new(News { previous, event }));
    }

    /// True if streams are open; if none is, takes the reader off the list.
    pub fn is_watched(&self) -> bool {
        let mut readers = self.watched.lock();
        // streams subscribe under the same lock
        let watched = self.sender.receiver_count() > 0;
        if !watched {
            readers.remove(&self.id);
        }
        watched
    }
}

impl<S> Drop for Streams<'_, S> {
    fn drop(&mut self) {
        let mut readers = self.watched.lock();
        // another reader may have begun after this one was taken off for having no streams
        if readers.get(&self.id).is_some_and(|current| current.sender.same_channel(&self.sender)) {
            readers.remove(&self.id);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The streams of a reader that panics close, and the next stream begins another reader.
    #[tokio::test]
    async fn streams_end_with_their_reader() {
        let watched = Arc::new(Watched::default());
        let subscribe = || {
            let list = watched.clone();
            let begin = move |_, sender| {
                tokio::spawn(async move {
                    let _streams = Streams { watched: &list, id: Uuid::nil(), sender };
                    std::panic::resume_unwind(Box::new(()));
                });
            };
            watched.subscribe(Uuid::nil(), (), begin).1
        };
        for _ in 0..2 {
            let mut stream = subscribe();
            assert_eq!(watched.count(), 1);
            assert!(matches!(stream.recv().await, Err(broadcast::error::RecvError::Closed)));
            assert_eq!(watched.count(), 0);
        }
    }
}
