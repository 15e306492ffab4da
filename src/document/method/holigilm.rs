//! The method `holigilm` in documents.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::settings::MethodSettings;
use crate::integrator::Method;
use crate::integrator::holigilm::Settings;
use crate::plan::MethodRequest;

/// Deterministic method after Kocifaj, Darula and Kittler, for tubes without meshes in an empty room; grids only.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct HoligilmMethod {}

impl MethodSettings for HoligilmMethod {
    const NAME: &'static str = "holigilm";

    fn request(&self) -> MethodRequest {
        MethodRequest::Method(Method::Holigilm(Settings {}))
    }
}
