//! What the events of a job carry, as components of the description: the store keeps them as JSON.

#![expect(dead_code, reason = "only the schemas of these types are used")]

use serde_json::{Value, json};
use utoipa::ToSchema;
use uuid::Uuid;

use crate::document::result::{ExternalIlluminance, PlanResult};
use crate::document::{Provenance, Warning};
use crate::job::progress::{PassReport, Progress, StoppedBy};
use crate::job::store::JobProblem;

/// An event of a job's stream.
#[derive(ToSchema)]
pub struct JobEvent {
    /// 1, 2, 3 ... without gaps; `Last-Event-ID` goes on after it.
    #[schema(pattern = "^[1-9][0-9]*$")]
    pub id: String,
    /// Which component `data` is; see `x-events` of the operation.
    pub event: EventName,
    /// JSON.
    pub data: String,
}

#[derive(serde::Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum EventName {
    Queued,
    Planned,
    Started,
    Pass,
    Image,
    Restarted,
    Succeeded,
    Failed,
    Cancelled,
}

/// The job waits.
#[derive(ToSchema)]
pub struct QueuedEvent {
    pub job: Uuid,
    pub name: Option<String>,
}

/// What is simulated and what is not, and what is known before the first pass.
#[derive(ToSchema)]
pub struct PlannedEvent {
    pub plan: PlanResult,
    pub warnings: Vec<Warning>,
    pub provenance: Provenance,
    /// The same as `provenance` under its former name, which is deprecated.
    pub switches: Provenance,
    pub external_horizontal_illuminance_lux: ExternalIlluminance,
}

/// Rendering has begun; nothing is known yet.
#[derive(ToSchema)]
pub struct StartedEvent {}

/// A pass is done. Passes 1 to 64 are told, then those nearest to powers of 2^(1/8), and the last one.
#[derive(serde::Serialize, ToSchema)]
pub struct PassEvent {
    #[serde(flatten)]
    pub report: PassReport,
}

/// There is a new progress image.
#[derive(ToSchema)]
pub struct ImageEvent {
    pub view: String,
    pub passes: u64,
    /// Path of the image.
    pub url: String,
}

/// Passes are rendered again, because what was stored of them is damaged or missing; they are not told twice.
#[derive(ToSchema)]
pub struct RestartedEvent {
    /// The first pass that is rendered again, from 1.
    pub from_pass: u64,
    pub reason: String,
}

/// The job has ended: all results are there.
#[derive(ToSchema)]
pub struct SucceededEvent {
    pub stopped_by: StoppedBy,
    pub progress: Progress,
}

/// The job was ended by a fault, which is not the document's.
#[derive(ToSchema)]
pub struct FailedEvent {
    pub problem: JobProblem,
}

/// The job was stopped; what was computed before stays readable.
#[derive(ToSchema)]
pub struct CancelledEvent {
    pub stopped_by: StoppedBy,
    /// Null when the job was stopped in its first chunk.
    pub progress: Option<Progress>,
}

/// `x-events` of the operation: the name of each event and the component of its data, in the order in which they come.
pub fn events() -> Value {
    let names = ["queued", "planned", "started", "pass", "image", "restarted", "succeeded", "failed", "cancelled"];
    let component = |name: &str| {
        let (first, rest) = name.split_at(1);
        json!({ "$ref": format!("#/components/schemas/{}{rest}Event", first.to_uppercase()) })
    };
    names.map(|name| json!({ "name": name, "data": component(name) })).into()
}
