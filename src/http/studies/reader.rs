//! Reader of a watched study: it reads the study's jobs when they change, and sends the news to all streams.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

use tokio::sync::{broadcast, watch};
use tokio::time::{Instant, sleep, sleep_until};
use uuid::Uuid;

use super::watched::{StudyJobs, StudyNow, WatchedStudies};
use crate::http::Service;
use crate::queue::store::{Change, JobStatus, StoreError, StudyProgress};

/// Shortest time between two reads of a study.
const LOOK_PAUSE: Duration = Duration::from_millis(100);
/// Shortest time between two passes that are reported of a study.
const PASS_PAUSE: Duration = Duration::from_secs(1);

impl WatchedStudies {
    /// Subscribes to everything new of a study after `now` was read. `changes` must begin before that, so that nothing is missed in
    /// between. The channel closes when the study has ended or is gone, when the service ends, or when the store fails.
    pub fn watch(
        service: &Arc<Service>,
        jobs: StudyJobs,
        now: StudyNow,
        changes: broadcast::Receiver<Change>,
    ) -> watch::Receiver<Arc<StudyNow>> {
        let mut readers = service.watched_studies.lock();
        if let Some(reader) = readers.get(&jobs.study) {
            return reader.subscribe();
        }
        let (sender, receiver) = watch::channel(Arc::new(now));
        readers.insert(jobs.study, sender.clone());
        tokio::spawn(read(service.clone(), jobs, sender, changes));
        receiver
    }
}

/// Sends the news of a study to its streams, until no stream is open or no more events can come.
async fn read(
    service: Arc<Service>,
    jobs: StudyJobs,
    sender: watch::Sender<Arc<StudyNow>>,
    changes: broadcast::Receiver<Change>,
) {
    let study = jobs.study;
    let mut reader =
        Reader { service: &service, jobs, sender: &sender, changes, passes: HashMap::new(), next_pass: Instant::now() };
    let ended = tokio::select! {
        () = service.shutdown.cancelled() => Ok(()),
        ended = reader.run() => ended,
    };
    if let Err(error) = ended {
        tracing::warn!(%error, %study, "reading a study for streams failed");
    }
    let mut readers = service.watched_studies.lock();
    // another reader may have begun after this one was taken off for having no streams
    if readers.get(&study).is_some_and(|current| current.same_channel(&sender)) {
        readers.remove(&study);
    }
}

struct Reader<'a> {
    service: &'a Service,
    jobs: StudyJobs,
    sender: &'a watch::Sender<Arc<StudyNow>>,
    changes: broadcast::Receiver<Change>,
    /// Numbers of passes of the jobs when a pass was reported last.
    passes: HashMap<Uuid, u64>,
    /// Time from which the next pass may be reported.
    next_pass: Instant,
}

impl Reader<'_> {
    async fn run(&mut self) -> Result<(), StoreError> {
        // jobs may have changed since the first stream read them
        let mut is_waiting = self.look(None).await?;
        while !self.sender.borrow().status.is_final() {
            let (next_pass, sender) = (self.next_pass, self.sender);
            let heard = tokio::select! {
                change = self.changes.recv() => match change {
                    Ok(Change::Job(id) | Change::Stop(id)) if self.is_part(id) => Some(id),
                    Err(broadcast::error::RecvError::Lagged(_)) => None,
                    Err(broadcast::error::RecvError::Closed) => return Ok(()),
                    Ok(_) => continue,
                },
                () = sleep_until(next_pass), if is_waiting => None,
                () = sender.closed() => None,
            };
            if !self.is_watched() || self.service.store.study(self.jobs.study).await?.is_none() {
                return Ok(());
            }
            is_waiting = self.look(heard).await?;
            sleep(LOOK_PAUSE).await;
        }
        Ok(())
    }

    fn is_part(&self, job: Uuid) -> bool {
        self.jobs.parts.iter().any(|(id, _)| *id == job)
    }

    /// Sends all news, with a pass if its time has come; true if a pass waits for that. `heard` is the job that has changed.
    async fn look(&mut self, heard: Option<Uuid>) -> Result<bool, StoreError> {
        let progress = self.service.store.study_progress(self.jobs.study).await?;
        let mut now = StudyNow::clone(&self.sender.borrow());
        let mut is_new = now.take(&self.jobs, &progress);
        let moved = self.moved(&progress, heard);
        let may_tell = Instant::now() >= self.next_pass;
        if let Some(job) = moved.filter(|_| may_tell) {
            now.take_pass(&self.jobs, &progress, job);
            self.passes = passes(&progress);
            self.next_pass = Instant::now() + PASS_PAUSE;
            is_new = true;
        }
        if is_new {
            self.sender.send_replace(Arc::new(now));
        }
        Ok(moved.is_some() && !may_tell)
    }

    /// Finds a running job with a pass that was not reported: the job `heard` if it has one, else the first one.
    fn moved(&self, progress: &StudyProgress, heard: Option<Uuid>) -> Option<Uuid> {
        let before = |id: &Uuid| self.passes.get(id).copied().unwrap_or(0);
        let mut moved = progress
            .jobs
            .iter()
            .filter(|head| head.status == JobStatus::Running && head.progress.passes > before(&head.id))
            .map(|head| head.id);
        let first = moved.clone().next();
        moved.find(|id| Some(*id) == heard).or(first)
    }

    /// True if streams watch the study; if none does, takes the study off the list.
    fn is_watched(&self) -> bool {
        let mut readers = self.service.watched_studies.lock();
        // streams subscribe under the same lock
        let watched = self.sender.receiver_count() > 0;
        if !watched {
            readers.remove(&self.jobs.study);
        }
        watched
    }
}

fn passes(progress: &StudyProgress) -> HashMap<Uuid, u64> {
    progress.jobs.iter().map(|head| (head.id, head.progress.passes)).collect()
}
