//! What is simulated and what is not, and why.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::number::finite;
use crate::document::method::settings_json;
use crate::plan::{EffectPlan, GuidePlan, MethodChoice, Plan};

/// Effects, guides and methods of a job, with their reasons.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PlanResult {
    /// Every effect that there is, on or off.
    pub effects: Vec<EffectResult>,
    /// Computation of the guides, one per tube.
    pub guides: Vec<GuideResult>,
    /// Methods that compute grids and views.
    pub methods: MethodsResult,
}

/// An effect of the plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EffectResult {
    /// Name of the effect, as `effects` of a document has it.
    pub name: String,
    /// True if the effect is simulated.
    pub on: bool,
    /// Why it is on or off, for people.
    pub reason: String,
    /// When off: the largest share of light that is left out, 0 where the effect is exactly zero; null when on, and where no
    /// bound below 1 is known. Of sky, sun and luminaires it is a share of the flux that comes into the room, of others of the
    /// flux that falls on its surfaces, all together: at single points it can be more.
    pub bound: Option<f64>,
}

/// Computation of a tube's guide.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct GuideResult {
    /// `closed_form_straight`, `closed_form_bent` or `mesh`.
    pub kind: String,
    /// Why it is computed so, for people.
    pub reason: String,
}

/// Which method computes what; null where the job has no such output.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MethodsResult {
    /// Method of all grids.
    pub grids: Option<MethodResult>,
    /// Method of all views.
    pub views: Option<MethodResult>,
    /// Method that checks the grids, where `cross_check` asks for it; absent where it does not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cross_check: Option<MethodResult>,
}

/// A method with the settings that it runs with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MethodResult {
    /// Name of the method, as `method.kind` of a document has it.
    pub name: String,
    /// The method's own settings.
    #[schema(value_type = Object)]
    pub settings: serde_json::Value,
    /// Why this method was taken, for people.
    pub reason: String,
}

impl From<&Plan> for PlanResult {
    fn from(plan: &Plan) -> Self {
        Self {
            effects: plan.effects.list.iter().map(EffectResult::from).collect(),
            guides: plan.guides.iter().map(GuideResult::from).collect(),
            methods: MethodsResult {
                grids: plan.methods.grids.as_ref().map(MethodResult::from),
                views: plan.methods.views.as_ref().map(MethodResult::from),
                cross_check: plan.methods.check.as_ref().map(MethodResult::from),
            },
        }
    }
}

impl From<&EffectPlan> for EffectResult {
    fn from(effect: &EffectPlan) -> Self {
        Self {
            name: effect.kind.name().to_owned(),
            on: effect.on,
            reason: effect.reason.clone(),
            bound: effect.bound.and_then(finite),
        }
    }
}

impl From<&GuidePlan> for GuideResult {
    fn from(guide: &GuidePlan) -> Self {
        Self { kind: guide.kind.code().to_owned(), reason: guide.reason.clone() }
    }
}

impl From<&MethodChoice> for MethodResult {
    fn from(choice: &MethodChoice) -> Self {
        Self {
            name: choice.method.name().to_owned(),
            settings: settings_json(&choice.method),
            reason: choice.reason.clone(),
        }
    }
}
