//! Uploaded weather files: received, described, deleted.

use axum::Json;
use axum::extract::Request;
use axum::http::StatusCode;
use axum::response::Response;
use jiff::Timestamp;
use serde::Serialize;
use utoipa::ToSchema;

use crate::document::limits::WEATHER_BYTES;
use crate::document::weather::WeatherReport;
use crate::http::App;
use crate::http::client::Client;
use crate::http::content::Binary;
use crate::http::problem::{Path, Problem};
use crate::http::uploads::{self, Accepted, UploadResource};
use crate::queue::store::{About, UploadKind, UploadedFile};

/// An uploaded weather file.
#[derive(Serialize, ToSchema)]
pub struct WeatherResource {
    /// Id of the content.
    pub id: String,
    pub bytes: u64,
    #[schema(value_type = String, format = DateTime)]
    pub created_at: Option<Timestamp>,
    /// Content and faults of the file.
    pub report: WeatherReport,
}

impl UploadResource for WeatherResource {
    const KIND: UploadKind = UploadKind::Weather;
    const PATH: &'static str = "/v1/weather";
    // a year of minutes has 16 MiB in the shortest form
    const ACCEPTED: Accepted = Accepted {
        media_types: &["text/plain", "application/octet-stream"],
        refusal: "weather must be an EPW or WEA file, sent as text/plain or application/octet-stream",
        most_bytes: WEATHER_BYTES,
    };

    fn of(file: UploadedFile, created_at: Option<Timestamp>) -> Option<Self> {
        let About::Weather(report) = file.about else { return None };
        Some(Self { id: file.id, bytes: file.size, created_at, report: *report })
    }
}

/// Uploads a weather file.
///
/// Files of EnergyPlus (EPW) and of Radiance (WEA) are taken, of at most 16 MiB; the first word tells which one it is. Equal content has the
/// same id, however often it is uploaded. What is usually wrong with such files is repaired and counted in the report.
#[utoipa::path(post, path = "/v1/weather", operation_id = "create_weather", tag = "weather",
    request_body(content = inline(Binary), content_type = "application/octet-stream",
        description = "The EPW or WEA file; the content type text/plain is accepted, too"),
    responses(
        (status = 201, description = "The weather is stored",
            body = WeatherResource, headers(("Location" = String, description = "Path of the weather"))),
        (status = 408, description = "The upload was too slow"),
        (status = 413, description = "The body is too long"),
        (status = 415, description = "The content type is not one of weather files"),
        (status = 422, description = "The weather file is not valid; the detail names line and field"),
        (status = 429, description = "This client has too many uploads in progress"),
        (status = 503, description = "The service is busy reading other files, or its disk is full")))]
pub async fn create(app: App, client: Client, request: Request) -> Result<Response, Problem> {
    uploads::create::<WeatherResource>(&app, client, request).await
}

/// Describes an uploaded weather file.
#[utoipa::path(get, path = "/v1/weather/{id}", operation_id = "get_weather", tag = "weather", params(("id" = String, Path)),
    responses(
        (status = 200, description = "The weather", body = WeatherResource),
        (status = 404, description = "No such weather")))]
pub async fn get(app: App, Path(id): Path<String>) -> Result<Json<WeatherResource>, Problem> {
    uploads::get(&app, &id).await
}

/// Deletes a weather file that no job uses.
#[utoipa::path(delete, path = "/v1/weather/{id}", operation_id = "delete_weather", tag = "weather", params(("id" = String, Path)),
    responses(
        (status = 204, description = "The weather is deleted"),
        (status = 404, description = "No such weather"),
        (status = 409, description = "A job uses the weather")))]
pub async fn delete(app: App, Path(id): Path<String>) -> Result<StatusCode, Problem> {
    uploads::delete(&app, UploadKind::Weather, id).await
}
