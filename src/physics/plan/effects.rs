//! Effects that a scene may call for, each on or off with its reason.

use std::collections::BTreeMap;

use super::called_for::{Remaining, Span};
use super::effect_kind::EffectKind;
use super::left_out::{LeftOut, left_out};
use crate::scene::Scene;
use crate::traceable::TraceableScene;

/// Request of a document about an effect.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EffectRequest {
    /// Simulate the effect, even without result where the scene does not call for it.
    On,
    /// Leave the effect out, where that is allowed.
    Off,
    /// Simulate the effect where the scene calls for it.
    #[default]
    Auto,
}

/// One effect of the plan, on or off, with its reason.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectPlan {
    /// Effect that this entry decides on.
    pub kind: EffectKind,
    /// True if the effect is simulated.
    pub on: bool,
    /// True if the scene calls for the effect, simulated or not.
    pub called_for: bool,
    /// Reason in one sentence, for the reader of a plan.
    pub reason: String,
    /// Largest fraction of the room's light that is left out if the effect is off, 0 if the effect is exactly zero by physics; `None` if
    /// the effect is on, and if no bound below 1 is known. [`LeftOut`] defines the light that it refers to.
    pub bound: Option<f64>,
}

/// All effects, in the order of [`EffectKind::ALL`].
#[derive(Clone, Debug, Default)]
pub struct Effects {
    /// One entry per effect; empty until effects are decided.
    pub list: Vec<EffectPlan>,
    /// Time for which the scene is computed.
    pub span: Span,
}

/// Requests by effect; effects that are absent are `Auto`.
pub type EffectRequests = BTreeMap<EffectKind, EffectRequest>;

impl Effects {
    /// Decides every effect of a moment from what the scene calls for and what the document requests.
    pub fn of(scene: &Scene, requests: &EffectRequests) -> Self {
        Self::over(scene, requests, Span::Moment)
    }

    /// Decides every effect as [`Self::of`] does, for a moment or a year.
    pub fn over(scene: &Scene, requests: &EffectRequests, span: Span) -> Self {
        let wish = |kind: EffectKind| requests.get(&kind).copied().unwrap_or_default();
        let stays = |kind: EffectKind| wish(kind) != EffectRequest::Off;
        let everything = Remaining { scene, objects: true, glossy: true, span };
        let rest = Remaining { objects: stays(EffectKind::Objects), glossy: stays(EffectKind::Glossy), ..everything };
        let decide = |kind: EffectKind| {
            // parts that are left out are no reason for those that stay, but an effect that is left out itself is judged by the whole scene
            let remaining = if stays(kind) { rest } else { everything };
            let (on, called_for, reason) = match (remaining.calls_for(kind), wish(kind)) {
                (Err(reason), EffectRequest::On) if kind.can_be_followed_in_vain() => {
                    (true, false, format!("asked for in the document, but without influence: {reason}"))
                }
                (Err(reason), _) => (false, false, reason),
                (Ok(_), EffectRequest::Off) if kind.can_be_left_out() => (false, true, switched_off(scene, kind, span)),
                (Ok(reason), EffectRequest::Off) => {
                    (true, true, format!("{reason}; it belongs to the scene and cannot be switched off"))
                }
                (Ok(reason), _) => (true, true, reason),
            };
            EffectPlan { kind, on, called_for, reason, bound: (!on && !called_for).then_some(0.0) }
        };
        Self { list: EffectKind::ALL.into_iter().map(decide).collect(), span }
    }

    /// True if the effect is simulated and the scene calls for it.
    pub fn is_on(&self, kind: EffectKind) -> bool {
        self.list.iter().any(|effect| effect.kind == kind && effect.on && effect.called_for)
    }

    /// True if the effect is simulated, even where the scene does not call for it.
    pub fn is_followed(&self, kind: EffectKind) -> bool {
        self.list.iter().any(|effect| effect.kind == kind && effect.on)
    }

    /// Estimates the light that each effect switched off leaves out of `scene`, stores the bounds in the plan, and returns all estimates.
    ///
    /// `traceable` is the scene with the effects that are on; its guides must be built. `outdoors` has the horizontal light of a year's skies
    /// and of its suns, if the scene is computed for a year.
    pub fn weigh(
        &mut self,
        scene: &Scene,
        traceable: &TraceableScene,
        outdoors: Option<[f64; 2]>,
    ) -> Vec<(EffectKind, LeftOut)> {
        let switched_off = self.list.iter_mut().filter(|effect| effect.called_for && !effect.on);
        switched_off
            .map(|effect| {
                let of_year = outdoors.and_then(|outdoors| LeftOut::of_year(outdoors, effect.kind));
                let left_out = of_year.unwrap_or_else(|| left_out(scene, &traceable.tubes, effect.kind));
                effect.bound = left_out.at_most;
                (effect.kind, left_out)
            })
            .collect()
    }
}

/// Returns the reason of an effect that the document leaves out.
fn switched_off(scene: &Scene, kind: EffectKind, span: Span) -> String {
    let what = match kind {
        EffectKind::Sky if span == Span::Year => {
            ": the skies of the year give no light; the grids' own values keep theirs, by which daylight factors are defined".to_owned()
        }
        EffectKind::Sun if span == Span::Year => ": the suns of the year give no light".to_owned(),
        EffectKind::Glossy => ": surfaces absorb the light of their `specular` share".to_owned(),
        EffectKind::Objects => {
            format!(
                ": {} in the room neither block nor reflect light",
                scene.room.boxes.len() + scene.room.meshes.len()
            )
        }
        EffectKind::Interreflection => ": surfaces reflect light to cameras only".to_owned(),
        _ => String::new(),
    };
    format!("switched off in the document{what}")
}
