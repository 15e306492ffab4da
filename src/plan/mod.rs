//! The plan: what of a scene is simulated and what is not, and why; which method computes what.

pub mod choose;
pub mod effects;

pub use choose::{MethodChoice, Methods};
pub use effects::{EffectKind, EffectPlan, EffectRequest, Effects};

/// What will be simulated; part of every result.
#[derive(Clone, Debug)]
pub struct Plan {
    pub effects: Effects,
    pub methods: Methods,
    /// How each tube's guide is computed, with the reason.
    pub guides: Vec<GuidePlan>,
}

#[derive(Clone, Debug)]
pub struct GuidePlan {
    /// `closed_form_straight`, `closed_form_bent` or `mesh`.
    pub kind: &'static str,
    pub reason: String,
}
