//! Chunk on the render pool: its passes, and their outcome.

use std::time::{Duration, Instant};

use bytes::Bytes;
use tokio::sync::mpsc;

use super::kept::Current;
use super::open_chunks::{AheadOfChunk, OpenChunks};
use crate::engine::ahead::{Outcome, RangeAhead, stored_outcomes};
use crate::engine::cancel::{Stop, StopReason};
use crate::engine::checkpoint;
use crate::engine::convergence::{PREVIEW_PASSES, is_kept};
use crate::engine::passes::{RenderError, SoFar};
use crate::engine::progress::{PassReport, Progress, StoppedBy};
use crate::predict::forecast::Forecast;
use crate::present::reader::ResultFile;
use crate::queue::events::{Pass, Phase, PhaseName};

/// Render time after which the first passes of a job are committed, and after which later ones are, and other jobs have their turn: about
/// this much work is lost when a process ends. A commit takes some milliseconds.
const FIRST_CHUNK: Duration = Duration::from_millis(250);
const CHUNK: Duration = Duration::from_secs(2);

/// Chunk on the render pool: the next passes of a job, as many as fit its time.
pub(super) struct ChunkRun {
    pub current: Current,
    pub ahead: AheadOfChunk,
    pub open: OpenChunks,
    pub stop: Stop,
    pub tell: mpsc::UnboundedSender<News>,
}

/// Reports of the pool while it renders.
pub(super) enum News {
    Pass(Box<Pass>),
    Images { passes: u64, images: Vec<(String, Vec<u8>)> },
    Phase(Phase),
}

/// Outcomes of a chunk.
pub(super) enum Ended {
    Continue {
        state: Bytes,
        ahead: Vec<RangeAhead>,
    },
    Finish {
        stopped_by: StoppedBy,
        summary: Option<serde_json::Value>,
        files: Vec<ResultFile>,
        /// Last pass of the job; `None` when no pass was done.
        last_pass: Option<Box<Pass>>,
    },
}

impl ChunkRun {
    /// Renders the chunk. Returns the job after it, and how the chunk ended: `None` when nothing of it counts.
    pub fn run(self) -> (Current, Result<Option<Ended>, RenderError>) {
        let Self { mut current, ahead, open, stop, tell } = self;
        let ended = render_chunk(&mut current, ahead, open, &stop, &tell);
        (current, ended)
    }
}

fn render_chunk(
    current: &mut Current,
    ahead: AheadOfChunk,
    open: OpenChunks,
    stop: &Stop,
    tell: &mpsc::UnboundedSender<News>,
) -> Result<Option<Ended>, RenderError> {
    if stop.reason() == Some(StopReason::Cancelled) {
        return finish(current, StoppedBy::Cancelled, tell).map(Some);
    }
    let (begun, most) = (Instant::now(), if current.is_loaded { FIRST_CHUNK } else { CHUNK });
    let mut outcomes = ahead.outcomes.into_iter().flat_map(stored_outcomes).peekable();
    loop {
        let outcome = outcomes.next();
        let was_ahead = outcome.is_some();
        let stopped = one_pass(current, outcome, stop, tell)?;
        if stop.reason() == Some(StopReason::Abandoned) {
            return Ok(None);
        }
        if let Some(stopped) = stopped {
            return finish(current, stopped, tell).map(Some);
        }
        // outcomes are taken as they were kept, and those that follow them by the next chunk
        let is_over = outcomes.peek().is_none() && (was_ahead || begun.elapsed() >= most);
        if is_over || ahead.until == Some(current.merged.passes) || stop.reason().is_some() {
            let state = Bytes::from(checkpoint::encode(&current.merged));
            current.bytes = state.len() as u64;
            (current.next_chunk, current.is_loaded) = (current.next_chunk + 1, false);
            let Current { prepared, merged, bytes, .. } = current;
            let ahead = prepared.ranges_ahead(merged, *bytes, open.beside(prepared));
            return Ok(Some(Ended::Continue { state, ahead }));
        }
    }
}

/// Adds a pass, whose outcome may have been computed ahead, to the job and reports it; returns the reason why the job ends with it, if it
/// does.
fn one_pass(
    current: &mut Current,
    outcome: Option<Outcome>,
    stop: &Stop,
    tell: &mpsc::UnboundedSender<News>,
) -> Result<Option<StoppedBy>, RenderError> {
    let Current { prepared, live, merged, spent, forecaster, .. } = current;
    let mut heard = |report: &PassReport, so_far: SoFar<'_>| {
        live.publish(so_far.estimate);
        // other passes are not reported
        let forecast = match is_kept(report.passes) {
            true => forecaster.after(report, so_far.waiting_for),
            false => Forecast::default(),
        };
        // the receiver outlives the render
        let _ = tell.send(News::Pass(Box::new(Pass { report: *report, forecast })));
        if PREVIEW_PASSES.contains(&report.passes) && prepared.has_views() {
            let images = prepared.preview_images(so_far.estimate);
            let _ = tell.send(News::Images { passes: report.passes, images });
        }
    };
    prepared.add_pass((merged, spent), outcome, stop, &mut heard)
}

fn finish(
    current: &mut Current,
    stopped_by: StoppedBy,
    tell: &mpsc::UnboundedSender<News>,
) -> Result<Ended, RenderError> {
    if current.merged.passes == 0 {
        return Ok(Ended::Finish { stopped_by, summary: None, files: Vec::new(), last_pass: None });
    }
    if current.prepared.has_year() {
        let _ = tell.send(News::Phase(Phase { phase: PhaseName::Year, passes: current.merged.passes }));
    }
    let files = current.prepared.results(&current.merged).kept_files()?;
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
