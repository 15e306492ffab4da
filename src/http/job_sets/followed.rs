//! Stream of the events of a set of any kind: starts, passes and ends of its jobs.

use std::collections::HashMap;
use std::time::Duration;

use serde_json::{Value, json};
use tokio::sync::broadcast;
use tokio::time::{Instant, sleep, sleep_until};
use uuid::Uuid;

use super::any_kind::set_of;
use super::set_events::{ENDED, PASS, RESTARTED, STARTED, SetEvents, SetStatus, SetView};
use crate::http::Service;
use crate::http::event_stream::{self, EventSource};
use crate::http::problem::Problem;
use crate::http::watched::{SentEvent, Streams, Watched};
use crate::queue::store::{Change, JobSet, JobStatus, SetKind, SetProgress, StoreError};

/// Shortest time between two reads of a set.
const LOOK_PAUSE: Duration = Duration::from_millis(100);
/// Shortest time between two passes that are reported of a set.
const PASS_PAUSE: Duration = Duration::from_secs(1);

/// View of a kind whose sets can be followed.
pub trait FollowedView: SetView + Sized {
    /// Kind of the sets.
    const KIND: SetKind;

    /// Creates the view on a stored set.
    fn of(set: &JobSet) -> Result<Self, Problem>;

    /// Returns the sets of this kind that have open streams.
    fn watched(service: &Service) -> &Watched<SetEvents<Self>>;
}

/// Lists the names of a stream's events, whose data is the component `data`, for `x-events` of the operation; `last` are those that
/// end the stream.
pub fn names<S: SetStatus>(data: &str, last: &[S]) -> Value {
    let data = json!({ "$ref": format!("#/components/schemas/{data}") });
    let last = last.iter().map(|status| status.name());
    let names = [STARTED, PASS, ENDED, RESTARTED].into_iter().chain(last);
    names.map(|name| json!({ "name": name, "data": data })).collect()
}

impl<V: FollowedView> EventSource for SetEvents<V> {
    async fn open(service: &Service, id: Uuid) -> Result<Self, Problem> {
        let set = set_of(service, V::KIND, id).await?;
        let events = Self::new(id, set.members.iter().map(|member| member.job).collect(), V::of(&set)?);
        events.take(&service.store.set_progress(id).await?);
        Ok(events)
    }

    fn watched(service: &Service) -> &Watched<Self> {
        V::watched(service)
    }

    fn newest(&self) -> (i64, bool) {
        self.newest_event()
    }

    fn restarted(&self, id: i64) -> SentEvent {
        SentEvent::new(Some(id), RESTARTED, &self.as_event())
    }

    async fn missed(&self, _: &Service, after: i64) -> Result<Vec<SentEvent>, StoreError> {
        Ok(self.told_after(after, event_stream::EVENTS_AT_ONCE as usize))
    }

    async fn follow(
        &self,
        service: &Service,
        changes: broadcast::Receiver<Change>,
        streams: &Streams<'_, Self>,
    ) -> Result<(), StoreError> {
        let (passes, next_pass) = (HashMap::new(), Instant::now());
        Reader { service, events: self, streams, changes, passes, next_pass }.run().await
    }
}

/// Reader of a watched set: it reads the set's jobs when they change, and sends the news to all streams.
struct Reader<'a, V: FollowedView> {
    service: &'a Service,
    events: &'a SetEvents<V>,
    streams: &'a Streams<'a, SetEvents<V>>,
    changes: broadcast::Receiver<Change>,
    /// Numbers of passes of the jobs when a pass was reported last.
    passes: HashMap<Uuid, u64>,
    /// Time from which the next pass may be reported.
    next_pass: Instant,
}

impl<V: FollowedView> Reader<'_, V> {
    async fn run(&mut self) -> Result<(), StoreError> {
        // jobs may have changed since the first stream read them
        let mut is_waiting = self.look(None).await?;
        while !self.events.newest().1 {
            let (next_pass, streams) = (self.next_pass, self.streams);
            let heard = tokio::select! {
                change = self.changes.recv() => match change {
                    Ok(Change::Job(id) | Change::Stop(id)) if self.events.has(id) => Some(id),
                    Err(broadcast::error::RecvError::Lagged(_)) => None,
                    Err(broadcast::error::RecvError::Closed) => return Ok(()),
                    Ok(_) => continue,
                },
                () = sleep_until(next_pass), if is_waiting => None,
                () = streams.sender.closed() => None,
            };
            if !streams.is_watched() || self.service.store.job_set(self.events.set).await?.is_none() {
                return Ok(());
            }
            is_waiting = self.look(heard).await?;
            sleep(LOOK_PAUSE).await;
        }
        Ok(())
    }

    /// Sends all news, with a pass if its time has come; true if a pass waits for that. `heard` is the job that has changed.
    async fn look(&mut self, heard: Option<Uuid>) -> Result<bool, StoreError> {
        let progress = self.service.store.set_progress(self.events.set).await?;
        let (before, _) = self.events.newest();
        for (previous, event) in (before..).zip(self.events.take(&progress)) {
            self.streams.tell(previous, event);
        }
        let moved = self.moved(&progress, heard);
        let may_tell = Instant::now() >= self.next_pass;
        if let Some(job) = moved.filter(|_| may_tell) {
            if let Some(pass) = self.events.pass(&progress, job) {
                self.streams.tell(self.events.newest().0, pass);
            }
            self.passes = progress.jobs.iter().map(|head| (head.id, head.progress.passes)).collect();
            self.next_pass = Instant::now() + PASS_PAUSE;
        }
        Ok(moved.is_some() && !may_tell)
    }

    /// Finds a running job with a pass that was not reported: the job `heard` if it has one, else the first one.
    fn moved(&self, progress: &SetProgress, heard: Option<Uuid>) -> Option<Uuid> {
        let before = |id: &Uuid| self.passes.get(id).copied().unwrap_or(0);
        let mut moved = progress
            .jobs
            .iter()
            .filter(|head| head.status == JobStatus::Running && head.progress.passes > before(&head.id))
            .map(|head| head.id);
        let first = moved.clone().next();
        moved.find(|id| Some(*id) == heard).or(first)
    }
}
