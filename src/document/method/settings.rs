//! Traits by which the settings of each method are read, checked and written.

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use utoipa::ToSchema;

use super::bounds::Setting;
use crate::document::errors::Checks;
use crate::document::outputs::{GridDocument, ViewDocument};
use crate::plan::MethodRequest;

/// Settings of one method, as documents write them; implemented in the method's file and registered by one line there.
pub trait MethodSettings: Default + Serialize + DeserializeOwned + ToSchema + Send + Sync + 'static {
    /// Name of the method in documents and results.
    const NAME: &'static str;

    /// Returns the request that the plan receives.
    fn request(&self) -> MethodRequest;

    /// Returns all numeric settings, for the checks and the schema.
    fn numbers(&self) -> Vec<Setting> {
        Vec::new()
    }

    /// Adds faults for outputs that the method cannot compute, or that are too many for it.
    fn check_outputs(&self, _grids: &[GridDocument], _views: &[ViewDocument], _checks: &mut Checks) {}
}

/// Settings of any method: [`MethodSettings`] without its type.
pub trait AnySettings: Send + Sync {
    fn name(&self) -> &'static str;
    fn request(&self) -> MethodRequest;
    fn check(&self, checks: &mut Checks);
    fn check_outputs(&self, grids: &[GridDocument], views: &[ViewDocument], checks: &mut Checks);
    fn json(&self) -> Value;
}

impl<S: MethodSettings> AnySettings for S {
    fn name(&self) -> &'static str {
        S::NAME
    }

    fn request(&self) -> MethodRequest {
        MethodSettings::request(self)
    }

    fn check(&self, checks: &mut Checks) {
        for Setting { name, value, range } in self.numbers() {
            if let Some(value) = value {
                checks.number(&format!("/method/{name}"), value, range);
            }
        }
    }

    fn check_outputs(&self, grids: &[GridDocument], views: &[ViewDocument], checks: &mut Checks) {
        MethodSettings::check_outputs(self, grids, views, checks);
    }

    fn json(&self) -> Value {
        // numbers and names always serialise
        serde_json::to_value(self).unwrap_or_default()
    }
}
