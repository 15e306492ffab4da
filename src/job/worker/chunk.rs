//! A chunk on the render pool: its passes, and what comes of them.

use std::time::{Duration, Instant};

use bytes::Bytes;
use tokio::sync::mpsc;

use super::kept::Current;
use crate::job::cancel::{Stop, StopReason};
use crate::job::checkpoint;
use crate::job::chunk::{RenderError, SoFar};
use crate::job::convergence::{PREVIEW_PASSES, is_kept};
use crate::job::events::Pass;
use crate::job::forecast::Forecast;
use crate::job::progress::{PassReport, Progress, StoppedBy};
use crate::job::results::ResultFile;

/// Render time up to which the next chunk follows without a commit of the one before: first chunks take some milliseconds, a commit as
/// long. The end of a process costs no more than that; the chunks, and so the bits, are the same.
const WITHOUT_COMMIT: Duration = Duration::from_millis(250);

/// A chunk on the render pool, and those after it as long as they take next to no time.
pub(super) struct ChunkRun {
    pub current: Current,
    pub stop: Stop,
    pub tell: mpsc::UnboundedSender<News>,
    pub chunk: u64,
}

/// News of the pool while it renders.
pub(super) enum News {
    Pass(Pass),
    Images { passes: u64, images: Vec<(String, Vec<u8>)> },
}

/// Ways in which a chunk ends.
pub(super) enum Ended {
    Continue {
        state: Bytes,
        next: std::ops::Range<u64>,
    },
    Finish {
        stopped_by: StoppedBy,
        summary: Option<serde_json::Value>,
        files: Vec<ResultFile>,
        /// `None` when no pass was done.
        last_pass: Option<Box<Pass>>,
    },
}

impl ChunkRun {
    /// The job after the chunk, and how the chunk ended: `None` when nothing of it counts.
    pub fn run(self) -> (Current, Result<Option<Ended>, RenderError>) {
        let Self { mut current, stop, tell, chunk } = self;
        let ended = render_chunk(&mut current, &stop, &tell, chunk);
        current.live.publish(SoFar::ended(&current.merged));
        (current, ended)
    }
}

fn render_chunk(
    current: &mut Current,
    stop: &Stop,
    tell: &mpsc::UnboundedSender<News>,
    chunk: u64,
) -> Result<Option<Ended>, RenderError> {
    if stop.reason() == Some(StopReason::Cancelled) {
        return finish(current, StoppedBy::Cancelled).map(Some);
    }
    let begun = Instant::now();
    let mut chunk = chunk;
    loop {
        let Some(stopped) = one_chunk(current, stop, tell, chunk)? else { return Ok(None) };
        let next = match (stopped, current.prepared.chunk(chunk + 1)) {
            (None, Some(next)) => next,
            (stopped, _) => return finish(current, stopped.unwrap_or(StoppedBy::MaxPasses)).map(Some),
        };
        if begun.elapsed() >= WITHOUT_COMMIT || stop.reason().is_some() {
            let state = Bytes::from(checkpoint::encode(&current.merged));
            current.bytes = state.len() as u64;
            return Ok(Some(Ended::Continue { state, next }));
        }
        chunk += 1;
    }
}

/// Adds a chunk to the job: `None` when nothing of it counts, else what stops the job after it, if anything does.
fn one_chunk(
    current: &mut Current,
    stop: &Stop,
    tell: &mpsc::UnboundedSender<News>,
    chunk: u64,
) -> Result<Option<Option<StoppedBy>>, RenderError> {
    let (prepared, live) = (current.prepared.clone(), current.live.clone());
    let mut heard = |report: &PassReport, so_far: SoFar<'_>| {
        live.publish(so_far);
        // the receiver outlives the render
        // nobody hears of the others
        let forecast = match is_kept(report.passes) {
            true => current.forecaster.after(report, so_far.waiting_for()),
            false => Forecast::default(),
        };
        let _ = tell.send(News::Pass(Pass { report: *report, forecast }));
        if PREVIEW_PASSES.contains(&report.passes) && prepared.has_views() {
            let images = prepared.preview_images(&so_far.merged());
            let _ = tell.send(News::Images { passes: report.passes, images });
        }
    };
    let rendered = prepared.render_chunk(chunk, &current.merged, current.spent, stop, &mut heard)?;
    if stop.reason() == Some(StopReason::Abandoned) {
        return Ok(None);
    }
    current.merged.merge(&rendered.estimate);
    current.spent = current.spent.and(rendered.spent);
    current.next_chunk = chunk + 1;
    let ended = rendered.ended.map(StoppedBy::from);
    Ok(Some(ended.or_else(|| prepared.stop_after(chunk, &current.merged))))
}

fn finish(current: &mut Current, stopped_by: StoppedBy) -> Result<Ended, RenderError> {
    if current.merged.passes == 0 {
        return Ok(Ended::Finish { stopped_by, summary: None, files: Vec::new(), last_pass: None });
    }
    let files = current.prepared.kept_files(&current.merged)?;
    let summary = current.prepared.summary_json(&current.merged, current.spent, stopped_by);
    let report = current.prepared.report(&current.merged, current.spent);
    let forecast = current.forecaster.after(&report, None);
    Ok(Ended::Finish {
        stopped_by,
        summary: Some(summary),
        files,
        last_pass: Some(Box::new(Pass { report, forecast })),
    })
}

pub(super) fn progress_of(current: &Current) -> Progress {
    let accuracy = current.prepared.accuracy(&current.merged);
    Progress {
        passes: current.merged.passes,
        photons: current.merged.photons,
        rays: current.merged.rays,
        seconds: current.spent.seconds,
        relative_error: accuracy.grids.filter(|error| error.is_finite()),
        view_relative_error: accuracy.views.filter(|error| error.is_finite()),
        chunks: current.next_chunk,
        cpu_seconds: current.spent.cpu_seconds,
    }
}
