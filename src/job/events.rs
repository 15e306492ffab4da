//! What the events of a job tell; a store keeps them as JSON, readers get them in order.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;
use uuid::Uuid;

use super::forecast::Forecast;
use super::progress::{PassReport, Progress, StoppedBy};
use super::records::JobProblem;
use crate::document::Warning;
use crate::document::result::{Known, PlanResult};

/// Data of one kind of event.
pub trait EventData: Serialize {
    /// Name of the kind, as the stream of events has it.
    const NAME: &'static str;
}

/// The job waits.
#[derive(Clone, Debug, Serialize, ToSchema)]
#[schema(as = QueuedEvent)]
pub struct Queued {
    /// Id of the job.
    pub job: Uuid,
    /// Free text of the document.
    pub name: Option<String>,
}

/// What is simulated and what is not, and what is known before the first pass.
#[derive(Clone, Debug, Serialize, ToSchema)]
#[schema(as = PlannedEvent)]
pub struct Planned {
    /// Effects, guides and methods, with reasons.
    pub plan: PlanResult,
    /// Notes on the document and on its methods.
    pub warnings: Vec<Warning>,
    /// What the summary of the results will have, too.
    #[serde(flatten)]
    pub known: Known,
}

/// [`Planned`] as a store keeps it: the plan is kept with the job.
#[derive(Clone, Debug, Serialize)]
pub struct PlannedBesidePlan<'a> {
    /// Notes on the document and on its methods.
    pub warnings: &'a [Warning],
    /// What the summary of the results will have, too.
    #[serde(flatten)]
    pub known: &'a Known,
}

/// Rendering has begun; nothing is known yet.
#[derive(Clone, Debug, Serialize, ToSchema)]
#[schema(as = StartedEvent)]
pub struct Started {}

/// A pass is done. Passes 1 to 64 are told, then those nearest to powers of 2^(1/8), and the last one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = PassEvent)]
pub struct Pass {
    /// Everything up to this pass.
    #[serde(flatten)]
    pub report: PassReport,
    /// What the passes so far foretell.
    #[serde(flatten)]
    pub forecast: Forecast,
}

/// There is a new progress image.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct Image {
    /// Name of the view.
    pub view: String,
    /// Passes that the image shows.
    pub passes: u64,
}

/// Passes are rendered again, because what was stored of them is damaged or missing; they are not told twice.
#[derive(Clone, Debug, Serialize, ToSchema)]
#[schema(as = RestartedEvent)]
pub struct Restarted {
    /// The first pass that is rendered again, from 1.
    pub from_pass: u64,
    /// What is damaged.
    pub reason: String,
}

/// The job has ended: all results are there.
#[derive(Clone, Debug, Serialize, ToSchema)]
#[schema(as = SucceededEvent)]
pub struct Succeeded {
    /// What ended the job.
    pub stopped_by: StoppedBy,
    /// Everything up to the last pass.
    pub progress: Progress,
}

/// The job was ended by a fault, which is not the document's.
#[derive(Clone, Debug, Serialize, ToSchema)]
#[schema(as = FailedEvent)]
pub struct Failed {
    /// What happened.
    pub problem: JobProblem,
}

/// The job was stopped; what was computed before stays readable.
#[derive(Clone, Debug, Serialize, ToSchema)]
#[schema(as = CancelledEvent)]
pub struct Cancelled {
    /// What ended the job.
    pub stopped_by: StoppedBy,
    /// Everything up to the last pass.
    pub progress: Progress,
}

impl From<PassReport> for Pass {
    /// A pass that foretells nothing.
    fn from(report: PassReport) -> Self {
        Self { report, forecast: Forecast::default() }
    }
}

impl EventData for Queued {
    const NAME: &'static str = "queued";
}

impl EventData for PlannedBesidePlan<'_> {
    const NAME: &'static str = Planned::NAME;
}

impl EventData for Planned {
    const NAME: &'static str = "planned";
}

impl EventData for Started {
    const NAME: &'static str = "started";
}

impl EventData for Pass {
    const NAME: &'static str = "pass";
}

impl EventData for Image {
    const NAME: &'static str = "image";
}

impl EventData for Restarted {
    const NAME: &'static str = "restarted";
}

impl EventData for Succeeded {
    const NAME: &'static str = "succeeded";
}

impl EventData for Failed {
    const NAME: &'static str = "failed";
}

impl EventData for Cancelled {
    const NAME: &'static str = "cancelled";
}
