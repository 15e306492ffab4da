//! Description of the interface, made from the handlers.

use crate::http::description::{completed, to_yaml};
use crate::http::problem::Problem;
use crate::http::router::api;

/// Returns the description as YAML.
pub fn yaml() -> Result<String, Problem> {
    to_yaml(&description())
}

/// Returns the description of the whole interface.
pub fn description() -> utoipa::openapi::OpenApi {
    completed(api().into_openapi())
}
