//! Switches of the plan's effects, as a document gives them.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{AdditionalProperties, ObjectBuilder, Ref, Schema};
use utoipa::{PartialSchema, ToSchema};

use super::errors::Checks;
use super::hints;
use super::read::pointer::escape;
use crate::plan::{EffectKind, EffectRequest, EffectRequests};

/// Switch of an effect in a document.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum EffectSwitch {
    /// Simulate the effect, even where the scene does not call for it.
    On,
    /// Leave the effect out, where that is possible.
    Off,
    /// Simulate the effect where the scene calls for it.
    #[default]
    Auto,
}

/// Switches of the plan's effects by name.
pub type Effects = BTreeMap<String, EffectSwitch>;

/// Returns the requests of a document for the effects; skips unknown names, which `check_effects` refuses.
pub fn requests(effects: &Effects) -> EffectRequests {
    let request = |switch: &EffectSwitch| match switch {
        EffectSwitch::On => EffectRequest::On,
        EffectSwitch::Off => EffectRequest::Off,
        EffectSwitch::Auto => EffectRequest::Auto,
    };
    effects.iter().filter_map(|(name, switch)| Some((EffectKind::from_name(name)?, request(switch)))).collect()
}

/// Adds a fault for every name that is not that of an effect.
pub(crate) fn check_effects(effects: &Effects, checks: &mut Checks) {
    for name in effects.keys().filter(|name| EffectKind::from_name(name).is_none()) {
        let known = EffectKind::ALL.map(EffectKind::name);
        let hint = hints::did_you_mean(name, known).map_or(String::new(), |name| format!("; did you mean `{name}`?"));
        let detail = format!("unknown effect; the effects are {}{hint}", known.join(", "));
        checks.refuse(format!("/effects/{}", escape(name)), detail);
    }
}

/// Placeholder type for the schema of [`Effects`].
pub struct EffectSwitches;

impl PartialSchema for EffectSwitches {
    fn schema() -> RefOr<Schema> {
        let description = "Switches of the plan's effects by name; those left out are `auto`. With `glossy` off, \
                           surfaces absorb what they would reflect by `specular`.";
        let switch = || Ref::from_schema_name(EffectSwitch::name());
        EffectKind::ALL
            .iter()
            .fold(ObjectBuilder::new(), |object, kind| object.property(kind.name(), switch()))
            .additional_properties(Some(AdditionalProperties::FreeForm(false)))
            .description(Some(description))
            .into()
    }
}

impl ToSchema for EffectSwitches {}
