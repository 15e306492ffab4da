//! Plan of a job: the effects that are simulated or left out, and the method of each output, with reasons.

mod called_for;
pub mod choose;
pub mod effect_kind;
pub mod effects;
pub mod guides;
pub mod left_out;
pub mod memory;

pub use called_for::Span;
pub use choose::{MethodChoice, MethodRequest, Methods, YearMethod};
pub use effect_kind::EffectKind;
pub use effects::{EffectPlan, EffectRequest, EffectRequests, Effects};
pub use guides::{GuideKind, GuidePlan};
pub use left_out::LeftOut;
pub use memory::MemoryEstimate;

use crate::scene::Scene;
use crate::traceable::{Follow, TraceableScene, TubeError};

/// Plan of everything that will be simulated, with reasons; part of every result.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Effects that are simulated or left out.
    pub effects: Effects,
    /// Methods of the grids and of the views.
    pub methods: Methods,
    /// Computation of each tube's guide, with the reason.
    pub guides: Vec<GuidePlan>,
}

/// Compiles the scene for tracing with the effects that are on. The sky of daylight factors, which the scene of a year has, stays.
pub fn compile(scene: &Scene, effects: &Effects) -> Result<TraceableScene, TubeError> {
    let mut traceable = TraceableScene::new(
        scene,
        Follow {
            interreflection: effects.is_followed(EffectKind::Interreflection),
            guide_return: effects.is_followed(EffectKind::GuideReturn),
            objects: effects.is_followed(EffectKind::Objects),
        },
    )?;
    if !effects.is_on(EffectKind::Sky) && effects.span == Span::Moment {
        traceable.tubes.iter_mut().for_each(|tube| tube.sky = None);
    }
    if !effects.is_on(EffectKind::Sun) {
        traceable.tubes.iter_mut().for_each(|tube| tube.sun = None);
    }
    if !effects.is_on(EffectKind::Luminaires) {
        traceable.luminaires.iter_mut().for_each(|luminaire| luminaire.luminance = [0.0; 3]);
    }
    if !effects.is_followed(EffectKind::Glossy) {
        traceable = traceable.without_specular();
    }
    Ok(traceable)
}
