//! The method `auto` in documents.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::settings::MethodSettings;
use crate::plan::MethodRequest;

/// Automatic choice of the method by the plan, which states its reasons.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct AutoMethod {}

impl MethodSettings for AutoMethod {
    const NAME: &'static str = "auto";

    fn request(&self) -> MethodRequest {
        MethodRequest::Auto
    }
}
