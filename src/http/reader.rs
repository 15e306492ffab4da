//! Reader of a watched job: it reads the job's events once and sends them to all its streams.

use std::sync::Arc;

use metrics::counter;
use tokio::sync::broadcast;
use uuid::Uuid;

use crate::http::Service;
use crate::http::watched::{EVENTS_AT_ONCE, News, SentEvent, WatchedJobs};
use crate::queue::store::{Change, JobHead, StoreError};

/// Largest number of events that a stream may be behind the reader; one further behind reads the store itself.
const BEHIND: usize = 128;

impl WatchedJobs {
    /// Subscribes to everything new of a job after `head` was read; earlier events are in the store. `changes` must begin before
    /// `head` is read, so that no event is missed in between. The channel closes when the job is gone, after its final event, when
    /// the service ends, or when the store fails.
    pub fn watch(
        service: &Arc<Service>,
        head: &JobHead,
        changes: broadcast::Receiver<Change>,
    ) -> broadcast::Receiver<Arc<News>> {
        let mut readers = service.watched.lock();
        if let Some(reader) = readers.get(&head.id) {
            return reader.subscribe();
        }
        let (sender, receiver) = broadcast::channel(BEHIND);
        readers.insert(head.id, sender.clone());
        tokio::spawn(read(service.clone(), head.id, head.last_seq, sender, changes));
        receiver
    }
}

/// Reads a job's events after `last` once and sends them to all its streams, until no stream is open or no more events can come.
async fn read(
    service: Arc<Service>,
    job: Uuid,
    last: i64,
    sender: broadcast::Sender<Arc<News>>,
    mut changes: broadcast::Receiver<Change>,
) {
    let mut reader = Reader { service: &service, job, sender: &sender, last };
    let ended = tokio::select! {
        () = service.shutdown.cancelled() => Ok(()),
        ended = reader.run(&mut changes) => ended,
    };
    if let Err(error) = ended {
        tracing::warn!(%error, %job, "reading events for streams failed");
    }
    let mut readers = service.watched.lock();
    // another reader may have begun after this one was taken off for having no streams
    if readers.get(&job).is_some_and(|current| current.same_channel(&sender)) {
        readers.remove(&job);
    }
}

struct Reader<'a> {
    service: &'a Service,
    job: Uuid,
    sender: &'a broadcast::Sender<Arc<News>>,
    last: i64,
}

impl Reader<'_> {
    async fn run(&mut self, changes: &mut broadcast::Receiver<Change>) -> Result<(), StoreError> {
        self.tell(None);
        loop {
            let is_gone = match changes.recv().await {
                Ok(Change::Job(id)) if id == self.job => false,
                Ok(Change::Stop(id)) if id == self.job => true,
                Err(broadcast::error::RecvError::Lagged(_)) => true,
                Err(broadcast::error::RecvError::Closed) => return Ok(()),
                Ok(_) => continue,
            };
            if self.pass_on().await? || !self.is_watched() {
                return Ok(());
            }
            if is_gone && self.service.store.job_head(self.job).await?.is_none() {
                return Ok(());
            }
        }
    }

    /// Sends all new events; returns true after a final one.
    async fn pass_on(&mut self) -> Result<bool, StoreError> {
        loop {
            let events = self.service.store.events(self.job, self.last, EVENTS_AT_ONCE).await?;
            counter!("skyduct_event_reads_total", "by" => "reader").increment(1);
            let may_be_more = events.len() >= EVENTS_AT_ONCE as usize;
            for event in events {
                let event = SentEvent::new(self.job, &event);
                let (seq, is_final) = (event.seq, event.is_final);
                self.tell(Some(event));
                self.last = seq;
                if is_final {
                    return Ok(true);
                }
            }
            if !may_be_more {
                return Ok(false);
            }
        }
    }

    fn tell(&self, event: Option<SentEvent>) {
        // an error means that nobody listens now
        let _ = self.sender.send(Arc::new(News { previous: self.last, event }));
    }

    /// True if streams watch the job; if none does, takes the job off the list.
    fn is_watched(&self) -> bool {
        let mut readers = self.service.watched.lock();
        // streams subscribe under the same lock
        let watched = self.sender.receiver_count() > 0;
        if !watched {
            readers.remove(&self.job);
        }
        watched
    }
}
