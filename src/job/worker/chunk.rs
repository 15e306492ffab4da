//! A chunk on the render pool: its passes, and what comes of them.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

use bytes::Bytes;
use tokio::sync::mpsc;

use super::PREVIEW_PASSES;
use super::kept::Current;
use crate::estimate::Estimate;
use crate::job::live::LiveJob;
use crate::job::run::{self, Observer, PassReport, Prepared, RenderError, ResultFile, StoppedBy};
use crate::job::store::Progress;

/// Go on: the async side wants nothing of the chunk.
pub(super) const RUN: u8 = 0;
/// Stop within a pass; what was computed counts.
pub(super) const CANCEL: u8 = 1;
/// Stop within a pass; what was computed is dropped.
pub(super) const ABANDON: u8 = 2;

/// A chunk on the render pool.
pub(super) struct ChunkRun {
    pub current: Current,
    pub stop: Arc<AtomicU8>,
    pub tell: mpsc::UnboundedSender<News>,
    pub chunk: u64,
}

pub(super) enum News {
    Pass(PassReport),
    Images { passes: u64, images: Vec<(String, Vec<u8>)> },
}

pub(super) enum Outcome {
    Continue {
        state: Bytes,
        next: std::ops::Range<u64>,
    },
    Finish {
        stopped_by: StoppedBy,
        summary: Option<serde_json::Value>,
        files: Vec<ResultFile>,
        /// `None` when no pass was done.
        last_pass: Option<PassReport>,
    },
}

struct PassObserver<'a> {
    prepared: &'a Prepared,
    live: &'a LiveJob,
    stop: &'a AtomicU8,
    tell: &'a mpsc::UnboundedSender<News>,
}

impl Observer for PassObserver<'_> {
    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::Relaxed) != RUN
    }

    fn pass_done(&self, report: &PassReport, merged: &Estimate) {
        self.live.publish(merged);
        // the receiver outlives the render
        let _ = self.tell.send(News::Pass(*report));
        if PREVIEW_PASSES.contains(&report.passes) {
            let images = self.prepared.preview_images(merged);
            if !images.is_empty() {
                let _ = self.tell.send(News::Images { passes: report.passes, images });
            }
        }
    }
}

impl ChunkRun {
    pub fn run(self, cancel_requested: bool) -> (Current, Result<Outcome, RenderError>) {
        let Self { mut current, stop, tell, chunk } = self;
        let outcome = render_chunk(&mut current, &stop, &tell, chunk, cancel_requested);
        current.live.publish(&current.merged);
        (current, outcome)
    }
}

fn render_chunk(
    current: &mut Current,
    stop: &AtomicU8,
    tell: &mpsc::UnboundedSender<News>,
    chunk: u64,
    cancel_requested: bool,
) -> Result<Outcome, RenderError> {
    let prepared = current.prepared.clone();
    if cancel_requested {
        return finish(current, StoppedBy::Cancelled);
    }
    let observer = PassObserver { prepared: &prepared, live: &current.live, stop, tell };
    let rendered = prepared.render_chunk(chunk, &current.merged, current.seconds, &observer)?;
    if stop.load(Ordering::Relaxed) == ABANDON {
        // not committed: an outcome is not needed
        return Ok(Outcome::Finish {
            stopped_by: StoppedBy::Cancelled,
            summary: None,
            files: Vec::new(),
            last_pass: None,
        });
    }
    run::merge(&mut current.merged, &rendered.estimate);
    current.seconds += rendered.seconds;
    current.next_chunk = chunk + 1;
    let stopped = rendered.ended.or_else(|| prepared.stop_after(chunk, &current.merged));
    match (stopped, prepared.chunk(chunk + 1)) {
        (None, Some(next)) => {
            let state = Bytes::from(run::encode(&current.merged));
            current.bytes = state.len() as u64;
            Ok(Outcome::Continue { state, next })
        }
        (stopped, _) => finish(current, stopped.unwrap_or(StoppedBy::MaxPasses)),
    }
}

fn finish(current: &Current, stopped_by: StoppedBy) -> Result<Outcome, RenderError> {
    if current.merged.passes == 0 {
        return Ok(Outcome::Finish { stopped_by, summary: None, files: Vec::new(), last_pass: None });
    }
    let files = current.prepared.kept_files(&current.merged)?;
    let summary = current.prepared.summary_json(&current.merged, current.seconds);
    let last_pass = Some(current.prepared.report(&current.merged, current.seconds));
    Ok(Outcome::Finish { stopped_by, summary: Some(summary), files, last_pass })
}

pub(super) fn progress_of(current: &Current) -> Progress {
    let accuracy = current.prepared.accuracy(&current.merged);
    Progress {
        passes: current.merged.passes,
        photons: current.merged.photons,
        rays: current.merged.rays,
        seconds: current.seconds,
        relative_error: accuracy.grids.filter(|error| error.is_finite()),
        view_relative_error: accuracy.views.filter(|error| error.is_finite()),
        chunks: current.next_chunk,
    }
}
