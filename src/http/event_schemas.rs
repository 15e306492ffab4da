//! Events of a job as its stream sends them, and as the description tells of them.

use serde_json::{Value, json};
use utoipa::ToSchema;
use uuid::Uuid;

use crate::job::events::{Cancelled, EventData, Failed, Image, Pass, Planned, Queued, Restarted, Started, Succeeded};

/// An event of a job's stream.
#[derive(ToSchema)]
#[expect(dead_code, reason = "only its schema is used: the library for server-sent events writes them")]
pub struct JobEvent {
    /// 1, 2, 3 ... without gaps; `Last-Event-ID` goes on after it. `restarted` has the id that it goes on after, which may be
    /// 0.
    #[schema(pattern = "^(0|[1-9][0-9]*)$")]
    pub id: String,
    /// Which component `data` is; see `x-events` of the operation.
    pub event: EventName,
    /// JSON.
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
    Restarted,
    Succeeded,
    Failed,
    Cancelled,
}

/// There is a new progress image.
#[derive(serde::Serialize, ToSchema)]
pub struct ImageEvent {
    #[serde(flatten)]
    pub image: Image,
    /// Path of the image.
    pub url: String,
}

impl ImageEvent {
    /// An image of this job.
    pub fn new(job: Uuid, image: Image) -> Self {
        let url = format!("/v1/jobs/{job}/views/{}.png?pass={}", image.view, image.passes);
        Self { image, url }
    }
}

/// `x-events` of the operation: the name of each event and the component of its data, in the order in which they come.
pub fn events() -> Value {
    let names = [
        Queued::NAME,
        Planned::NAME,
        Started::NAME,
        Pass::NAME,
        Image::NAME,
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
