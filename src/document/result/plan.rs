//! The plan of a job: effects, guides and methods, with their reasons.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::number::finite;
use crate::document::method::settings_json;
use crate::plan::{EffectPlan, GuidePlan, MethodChoice, Plan, YearMethod};

/// Effects, guides and methods of a job, with their reasons.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PlanResult {
    /// All effects, on or off.
    pub effects: Vec<EffectResult>,
    /// Computation of each tube's guide, in the order of the document.
    pub guides: Vec<GuideResult>,
    /// Methods that compute grids and views.
    pub methods: MethodsResult,
}

/// An effect of the plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EffectResult {
    /// Name of the effect, as in `effects` of a document.
    pub name: String,
    /// True if the effect is simulated.
    pub on: bool,
    /// Reason why the effect is on or off, as a sentence.
    pub reason: String,
    /// Largest fraction of light that is left out when the effect is off, 0 if the effect is exactly zero; null when it is on,
    /// and where no bound below 1 can be given. For sky, sun and luminaires it is a fraction of the flux that enters the room,
    /// for other effects of the flux that falls on the room's surfaces in all; at single points it can be larger.
    pub bound: Option<f64>,
}

/// Computation of a tube's guide.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct GuideResult {
    /// Kind of computation: `closed_form_straight`, `closed_form_bent` or `mesh`.
    pub kind: String,
    /// Reason for this kind of computation, as a sentence.
    pub reason: String,
}

/// Methods by output; null where the job has no such output.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MethodsResult {
    /// Method of all grids.
    pub grids: Option<MethodResult>,
    /// Method of all views.
    pub views: Option<MethodResult>,
    /// Method that checks the grids; absent unless the document asks for `cross_check`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cross_check: Option<MethodResult>,
    /// Computation of the year; absent without `annual`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub year: Option<YearMethodResult>,
}

/// Computation of the illuminances of a year.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct YearMethodResult {
    /// Name of the computation: `responses`, `moments`, or `responses_and_moments` where both are added.
    pub name: String,
    /// Reason for this computation, as a sentence.
    pub reason: String,
}

/// A method with the settings that it is run with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MethodResult {
    /// Name of the method, as in `method.kind` of a document.
    pub name: String,
    /// The method's own settings.
    #[schema(value_type = Object)]
    pub settings: serde_json::Value,
    /// Reason why this method was chosen, as a sentence.
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
                year: plan.methods.year.map(YearMethodResult::from),
            },
        }
    }
}

impl From<YearMethod> for YearMethodResult {
    fn from(method: YearMethod) -> Self {
        Self { name: method.name().to_owned(), reason: method.reason().to_owned() }
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
