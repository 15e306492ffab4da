//! The interface's description, made from the handlers.

use crate::http::description::{completed, to_yaml};
use crate::http::problem::Problem;
use crate::http::router::api;

/// The description as YAML.
pub fn yaml() -> Result<String, Problem> {
    to_yaml(&description())
}

/// The description of the whole interface.
pub fn description() -> utoipa::openapi::OpenApi {
    completed(api().into_openapi())
}
