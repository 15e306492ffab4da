//! The plan: what of a scene is simulated and what is not, and why; which method computes what.

pub mod choose;
pub mod cost;
pub mod effects;

pub use choose::{MethodChoice, MethodRequest, Methods, PlanRefusal};
pub use effects::{EffectKind, EffectPlan, EffectRequest, EffectRequests, Effects};

use crate::guide::Guide;
use crate::guide::dome::{Dome, DomedGuide, Pipe};
use crate::integrator::{Kernel, KernelError};
use crate::optics::fresnel::slab_transmittance;
use crate::scene::Scene;

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

/// The scene compiled for tracing with the effects that are on.
pub fn compile(scene: &Scene, effects: &Effects) -> Result<Kernel, KernelError> {
    let mut kernel = Kernel::new(
        scene,
        effects.is_on(EffectKind::Interreflection),
        effects.is_on(EffectKind::GuideReturn),
        effects.is_on(EffectKind::Objects),
    )?;
    if !effects.is_on(EffectKind::Sky) {
        kernel.sky = None;
    }
    if !effects.is_on(EffectKind::Sun) {
        kernel.sun = None;
    }
    Ok(kernel)
}

const STRAIGHT: &str = "straight cylinder: exit point, direction and number of reflections in closed form";
const BENT: &str = "cylinders with mitred elbows: closed form between elbows, stepped through them";

fn domed(guide: &DomedGuide) -> GuidePlan {
    let Dome { inner, outer, index, absorption } = guide.dome;
    let (kind, pipe) = match guide.pipe {
        Pipe::Straight(_) => ("closed_form_straight", STRAIGHT),
        Pipe::Bent(_) => ("closed_form_bent", BENT),
    };
    let axial = slab_transmittance(1.0, index, absorption * (outer - inner));
    let reason = format!(
        "{pipe}; light is traced through the faces of the dome, refractive index {index}, which passes {axial:.4} of \
         axial light"
    );
    GuidePlan { kind, reason }
}

/// How the guides of a compiled scene are computed.
pub fn guides(kernel: &Kernel) -> Vec<GuidePlan> {
    kernel
        .tubes
        .iter()
        .map(|tube| match &tube.guide {
            Guide::Straight(_) => GuidePlan { kind: "closed_form_straight", reason: STRAIGHT.into() },
            Guide::Bent(_) => GuidePlan { kind: "closed_form_bent", reason: BENT.into() },
            Guide::Domed(guide) => domed(guide),
            Guide::Mesh(guide) => GuidePlan {
                kind: "mesh",
                reason: format!("mesh of {} triangles: rays are traced facet by facet", guide.triangle_count()),
            },
        })
        .collect()
}
