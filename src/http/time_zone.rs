//! Clocks at a place: its time zone, and the offset of a local time from UTC.

use axum::Json;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use crate::document::sky::time::local;
use crate::document::sky::time_zone::{Times, Zone, zone_at};
use crate::http::problem::{Problem, Query};
use crate::http::query_faults::QueryFaults;

/// Place, or time zone by its name, and a local time there. Every field is text, so that a bad value is reported by name.
#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct TimeZoneQuery {
    /// Latitude in degrees, north positive; required without `time_zone`.
    #[param(value_type = Option<f64>, minimum = -90, maximum = 90, example = 55.69)]
    latitude_deg: Option<String>,
    /// Longitude in degrees, east positive; required without `time_zone`.
    #[param(value_type = Option<f64>, minimum = -180, maximum = 180, example = 12.55)]
    longitude_deg: Option<String>,
    /// Name of a time zone of the IANA, in place of the one at the coordinates, which need not be given then.
    #[param(example = "Europe/Copenhagen")]
    time_zone: Option<String>,
    /// Local date and time, without an offset; required.
    #[param(value_type = String, required = true, example = "2026-06-21T12:00")]
    local_time: Option<String>,
}

/// Number of times at which clocks show a local time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Shown {
    /// Exactly one time.
    Once,
    /// Two times: clocks are set back over it.
    Twice,
    /// No time: clocks are set forward over it.
    Never,
}

/// Time zone, and the `time` of a document for a local time there.
#[derive(Debug, Serialize, ToSchema)]
pub struct TimeZoneResource {
    /// Name of the time zone by the IANA.
    #[schema(example = "Europe/Copenhagen")]
    pub time_zone: String,
    /// Number of times at which clocks of the zone show the local time.
    pub shown: Shown,
    /// Local time as a `time` of documents: the first one if clocks show it twice; if they never show it, the time that they show
    /// instead, later by as much as they are set forward.
    #[schema(example = "2026-06-21T12:00:00+02:00")]
    pub time: String,
    /// Second time as a `time` of documents; null unless clocks show the local time twice.
    pub second_time: Option<String>,
    /// Offset of `time` from UTC: sign, hours and minutes.
    #[schema(example = "+02:00")]
    pub utc_offset: String,
}

/// Returns the time zone of a place, and its offset from UTC at a local time.
///
/// Borders of the zones are those of [timezone-boundary-builder](https://github.com/evansiroky/timezone-boundary-builder),
/// simplified by some hundred metres, with data of © OpenStreetMap contributors under the ODbL 1.0; at sea they are nautical time
/// zones. Rules of the clocks are those of the IANA. Both are part of the service.
#[utoipa::path(get, path = "/v1/time_zone", operation_id = "get_time_zone", tag = "skies",
    params(TimeZoneQuery),
    responses(
        (status = 200, description = "The zone and the time", body = TimeZoneResource),
        (status = 422, description = "An unknown parameter or an invalid value; see `errors`")))]
pub async fn time_zone(Query(query): Query<TimeZoneQuery>) -> Result<Json<TimeZoneResource>, Problem> {
    let mut faults = QueryFaults::default();
    let mut degrees = |name: &str, text: &Option<String>, most: f64| match text {
        Some(text) => faults.number(name, text, -most, most),
        None if query.time_zone.is_none() => faults.refuse(name, "required without time_zone"),
        None => None,
    };
    let latitude = degrees("latitude_deg", &query.latitude_deg, 90.0);
    let longitude = degrees("longitude_deg", &query.longitude_deg, 180.0);
    let zone = match &query.time_zone {
        Some(name) => Zone::named(name).or_else(|| {
            faults.refuse("time_zone", format!("must be an IANA time zone, such as Europe/London, but is {name:?}"))
        }),
        None => latitude.zip(longitude).and_then(|(latitude, longitude)| Zone::named(zone_at(latitude, longitude))),
    };
    let local = match query.local_time.as_deref().map(local) {
        Some(read) => read.map_err(|detail| faults.refuse::<()>("local_time", detail)).ok(),
        None => faults.refuse("local_time", "required"),
    };
    let times = zone.as_ref().zip(local).and_then(|(zone, local)| {
        zone.times(local).or_else(|| faults.refuse("local_time", "must be a time of the years -9999 to 9999 in UTC"))
    });
    match (zone, times) {
        (Some(zone), Some(times)) if faults.found.is_empty() => Ok(Json(TimeZoneResource::new(&zone, times))),
        // ours: the table has a zone for every place
        _ if faults.found.is_empty() => Err(Problem::internal()),
        _ => Err(Problem::invalid_parameters(faults.found)),
    }
}

impl TimeZoneResource {
    fn new(zone: &Zone, times: Times) -> Self {
        let (shown, time, second_time) = match times {
            Times::Once(time) => (Shown::Once, time, None),
            Times::Twice { first, second } => (Shown::Twice, first, Some(second)),
            Times::Never { instead } => (Shown::Never, instead, None),
        };
        let utc_offset = time.get(time.len().saturating_sub(6)..).unwrap_or_default().to_owned();
        Self { time_zone: zone.name().to_owned(), shown, time, second_time, utc_offset }
    }
}
