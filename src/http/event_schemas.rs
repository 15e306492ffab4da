//! Events of a job as its stream sends them, and their schemas in the description.

use serde::Deserialize;
use serde_json::{Value, json};
use utoipa::ToSchema;
use uuid::Uuid;

use crate::http::watched::SentEvent;
use crate::queue::events::{
    Cancelled, EventData, Failed, Image, Pass, Phase, Planned, Queued, Restarted, Started, Succeeded,
};
use crate::queue::store::{Event, JobHead, is_final_event};

/// Events of a job, which a store keeps.
pub struct JobEvents {
    /// State of the job before its events were followed.
    pub head: JobHead,
}

/// Writes a stored event of a job.
pub fn sent(job: Uuid, event: &Event) -> SentEvent {
    let id = Some(event.seq);
    let image = (event.name == Image::NAME).then(|| Image::deserialize(&event.data).ok()).flatten();
    let sent = match image {
        Some(image) => SentEvent::new(id, Image::NAME, &ImageEvent::new(job, image)),
        None => SentEvent::new(id, &event.name, &event.data),
    };
    SentEvent { is_final: is_final_event(&event.name), ..sent }
}

/// An event of a job's stream.
#[derive(ToSchema)]
#[expect(dead_code, reason = "only its schema is used: the library for server-sent events writes them")]
pub struct JobEvent {
    /// Number of the event: 1, 2, 3 ... without gaps. Sent back as `Last-Event-ID`, it makes the stream continue after it.
    /// `restarted` has the id after which the stream continues, which may be 0.
    #[schema(pattern = "^(0|[1-9][0-9]*)$")]
    pub id: String,
    /// Name of the event, which determines the component of `data`; see `x-events` of the operation.
    pub event: EventName,
    /// Data of the event as JSON.
    pub data: String,
}

#[derive(serde::Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
#[expect(dead_code, reason = "only its schema is used: each kind of event has its own name")]
pub enum EventName {
    Queued,
    Planned,
    Started,
    Pass,
    Image,
    Phase,
    Restarted,
    Succeeded,
    Failed,
    Cancelled,
}

/// Event of a new progress image.
#[derive(serde::Serialize, ToSchema)]
pub struct ImageEvent {
    #[serde(flatten)]
    pub image: Image,
    /// Path of the image.
    pub url: String,
}

impl ImageEvent {
    /// Creates the event of an image of this job.
    pub fn new(job: Uuid, image: Image) -> Self {
        let url = format!("/v1/jobs/{job}/views/{}.png?pass={}", image.view, image.passes);
        Self { image, url }
    }
}

/// Lists the name of each event and the component of its data in the order in which they come, for `x-events` of the operation.
pub fn events() -> Value {
    let names = [
        Queued::NAME,
        Planned::NAME,
        Started::NAME,
        Pass::NAME,
        Image::NAME,
        Phase::NAME,
        Restarted::NAME,
        Succeeded::NAME,
        Failed::NAME,
        Cancelled::NAME,
    ];
    let component = |name: &str| {
        let (first, rest) = name.split_at(1);
        json!({ "$ref": format!("#/components/schemas/{}{rest}Event", first.to_uppercase()) })
    };
    names.map(|name| json!({ "name": name, "data": component(name) })).into()
}
