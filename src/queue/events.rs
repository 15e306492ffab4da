//! Data of a job's events; a store keeps them as JSON, readers get them in order.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;
use uuid::Uuid;

use super::records::JobProblem;
use crate::document::Warning;
use crate::document::result::{Known, PlanResult};
use crate::engine::progress::{PassReport, Progress, StoppedBy};
use crate::predict::forecast::Forecast;

/// Data of one kind of event.
pub trait EventData: Serialize {
    /// Name of the kind in the stream of events.
    const NAME: &'static str;
}

/// Event `queued`: the job waits.
#[derive(Clone, Debug, Serialize, ToSchema)]
#[schema(as = QueuedEvent)]
pub struct Queued {
    /// Id of the job.
    pub job: Uuid,
    /// Name of the job, free text from its document.
    pub name: Option<String>,
}

/// Event `planned`: what is simulated and what is not, and what is known before the first pass.
#[derive(Clone, Debug, Serialize, ToSchema)]
#[schema(as = PlannedEvent)]
pub struct Planned {
    /// Effects, guides and methods, with reasons.
    pub plan: PlanResult,
    /// Notes on the document and on its methods.
    pub warnings: Vec<Warning>,
    /// Fields that the summary of the results will have, too.
    #[serde(flatten)]
    pub known: Known,
}

/// Data of [`Planned`] as a store keeps it: without the plan, which is kept with the job.
#[derive(Clone, Debug, Serialize)]
pub struct PlannedBesidePlan<'a> {
    /// Notes on the document and on its methods.
    pub warnings: &'a [Warning],
    /// Fields that the summary of the results will have, too.
    #[serde(flatten)]
    pub known: &'a Known,
}

/// Event `started`: rendering has begun; there are no results yet.
#[derive(Clone, Debug, Serialize, ToSchema)]
#[schema(as = StartedEvent)]
pub struct Started {}

/// Event `pass`: a pass is done. Passes 1 to 64 are reported, then those nearest to powers of 2^(1/8), and the last one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = PassEvent)]
pub struct Pass {
    /// Totals up to this pass.
    #[serde(flatten)]
    pub report: PassReport,
    /// Forecast from the passes so far.
    #[serde(flatten)]
    pub forecast: Forecast,
}

/// Event `image`: there is a new progress image.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct Image {
    /// Name of the view.
    pub view: String,
    /// Number of passes that the image shows.
    pub passes: u64,
}

/// Event `phase`: the passes are done, and something else is computed before the job ends.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[schema(as = PhaseEvent)]
pub struct Phase {
    /// Name of the phase.
    pub phase: PhaseName,
    /// Number of passes of the job.
    pub passes: u64,
}

/// Phase of a job after its passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum PhaseName {
    /// Light of the tubes by the records of the weather files, and the metrics of the grids.
    Year,
}

/// Event `restarted`: passes are rendered again, because their stored state is damaged or missing; they are not reported twice.
#[derive(Clone, Debug, Serialize, ToSchema)]
#[schema(as = RestartedEvent)]
pub struct Restarted {
    /// First pass that is rendered again, from 1.
    pub from_pass: u64,
    /// Description of the damage.
    pub reason: String,
}

/// Event `succeeded`: the job has ended with all results.
#[derive(Clone, Debug, Serialize, ToSchema)]
#[schema(as = SucceededEvent)]
pub struct Succeeded {
    /// Reason why the job ended.
    pub stopped_by: StoppedBy,
    /// Progress up to the last pass.
    pub progress: Progress,
}

/// Event `failed`: the job was ended by a fault that is not its document's.
#[derive(Clone, Debug, Serialize, ToSchema)]
#[schema(as = FailedEvent)]
pub struct Failed {
    /// Description of the failure.
    pub problem: JobProblem,
}

/// Event `cancelled`: the job was stopped; what was computed before stays readable.
#[derive(Clone, Debug, Serialize, ToSchema)]
#[schema(as = CancelledEvent)]
pub struct Cancelled {
    /// Reason why the job ended.
    pub stopped_by: StoppedBy,
    /// Progress up to the last pass.
    pub progress: Progress,
}

impl From<PassReport> for Pass {
    /// Makes an event without a forecast.
    fn from(report: PassReport) -> Self {
        Self { report, forecast: Forecast::default() }
    }
}

/// Gives kinds of events their names.
macro_rules! names {
    ($($data:ty => $name:expr,)*) => {
        $(impl EventData for $data {
            const NAME: &'static str = $name;
        })*
    };
}

names! {
    Queued => "queued",
    PlannedBesidePlan<'_> => Planned::NAME,
    Planned => "planned",
    Started => "started",
    Pass => "pass",
    Image => "image",
    Phase => "phase",
    Restarted => "restarted",
    Succeeded => "succeeded",
    Failed => "failed",
    Cancelled => "cancelled",
}
