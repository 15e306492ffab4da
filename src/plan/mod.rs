//! The plan: what of a scene is simulated and what is not, and why; which method computes what.

pub mod choose;
pub mod cost;
pub mod effects;
pub mod memory;

pub use choose::{MethodChoice, MethodRequest, Methods, PlanRefusal};
pub use effects::{EffectKind, EffectPlan, EffectRequest, EffectRequests, Effects};
pub use memory::MemoryEstimate;

use crate::guide::dome::{Dome, DomedGuide, Pipe};
use crate::guide::{Guide, Section, recognise};
use crate::optics::Diffuser;
use crate::optics::fresnel::slab_transmittance;
use crate::scene::Scene;
use crate::traceable::TraceableTube;
use crate::traceable::{TraceableScene, TubeError};

/// Everything that will be simulated, with reasons; part of every result.
#[derive(Clone, Debug)]
pub struct Plan {
    pub effects: Effects,
    pub methods: Methods,
    /// Computation of each tube's guide, with the reason.
    pub guides: Vec<GuidePlan>,
}

#[derive(Clone, Debug)]
pub struct GuidePlan {
    /// `closed_form_straight`, `closed_form_bent` or `mesh`.
    pub kind: &'static str,
    pub reason: String,
}

/// The scene compiled for tracing with the effects that are on.
pub fn compile(scene: &Scene, effects: &Effects) -> Result<TraceableScene, TubeError> {
    let mut traceable = TraceableScene::new(
        scene,
        effects.is_on(EffectKind::Interreflection),
        effects.is_on(EffectKind::GuideReturn),
        effects.is_on(EffectKind::Objects),
    )?;
    if !effects.is_on(EffectKind::Sky) {
        traceable.sky = None;
    }
    if !effects.is_on(EffectKind::Sun) {
        traceable.sun = None;
    }
    if !effects.is_on(EffectKind::Luminaires) {
        traceable.luminaires.iter_mut().for_each(|luminaire| luminaire.luminance = [0.0; 3]);
    }
    if !effects.is_on(EffectKind::Glossy) {
        traceable = traceable.without_specular();
    }
    Ok(traceable)
}

const STRAIGHT: &str = "straight cylinder: exit point, direction and number of reflections in closed form";
const BENT: &str = "cylinders with mitred elbows: closed form between elbows, stepped through them";

fn recognised(tube: &TraceableTube) -> GuidePlan {
    let reason = match &tube.section {
        Some(Section::Cylinder(cylinder)) => format!(
            "mesh recognised as a cylinder of radius {} m and length {} m within {:.4} mm; the {} vertices of its rim lie \
             on the cylinder; {STRAIGHT}",
            cylinder.radius,
            cylinder.length,
            1e3 * cylinder.deviation,
            cylinder.sides
        ),
        _ => STRAIGHT.into(),
    };
    GuidePlan { kind: "closed_form_straight", reason }
}

/// Sentence that says why facets are traced, and what they do to a pipe that is meant to be round.
fn facets(triangles: usize, section: Option<&Section>) -> String {
    let mut reason = format!("mesh of {triangles} triangles: rays are traced facet by facet");
    if let Some(Section::Facets { sides, reason: why }) = section {
        reason.push_str(&format!("; not replaced by a cylinder: {why}"));
        if let Some(sides) = sides {
            reason.push_str(&format!(
                "; a regular prism of {sides} sides has {:.5} times the area of the cylinder through its vertices and \
                 {:.5} times its reflections",
                recognise::area_factor(*sides),
                recognise::bounce_factor(*sides)
            ));
        }
    }
    reason
}

/// Sentence on the shares of light that a measured diffuser passes, as its table has them.
fn measured(diffuser: &Diffuser) -> String {
    let Diffuser::Measured(table) = diffuser else { return String::new() };
    let at = |degrees: f64| {
        let [through, back] = table.shares(degrees.to_radians().cos());
        format!("{through:.4} and {back:.4} at {degrees} degrees")
    };
    format!("; measured diffuser: transmits and reflects {}, {}, {}", at(0.0), at(30.0), at(60.0))
}

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

/// Says how the guides of a compiled scene are computed, and why.
pub fn guides(traceable: &TraceableScene) -> Vec<GuidePlan> {
    traceable
        .tubes
        .iter()
        .map(|tube| {
            let mut plan = of_guide(tube);
            plan.reason.push_str(&measured(&tube.diffuser));
            plan
        })
        .collect()
}

fn of_guide(tube: &TraceableTube) -> GuidePlan {
    match &tube.guide {
        Guide::Straight(_) if tube.section.is_some() => recognised(tube),
        Guide::Straight(_) => GuidePlan { kind: "closed_form_straight", reason: STRAIGHT.into() },
        Guide::Bent(_) => GuidePlan { kind: "closed_form_bent", reason: BENT.into() },
        Guide::Domed(guide) => domed(guide),
        Guide::Mesh(guide) => GuidePlan { kind: "mesh", reason: facets(guide.triangle_count(), tube.section.as_ref()) },
    }
}
