//! Plan of how the guide of each tube is computed, with reasons.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::guide::dome::{Dome, DomedGuide, PipeBelow};
use crate::guide::{Guide, Section, recognise};
use crate::optics::Diffuser;
use crate::optics::fresnel::slab_transmittance;
use crate::scene::{OpeningPlane, OpeningShape, Scene, Tube, TubeShape};
use crate::traceable::{TraceableScene, TraceableTube};

/// Computation of a guide, with the reason.
#[derive(Clone, Debug)]
pub struct GuidePlan {
    /// Method by which rays pass the guide.
    pub kind: GuideKind,
    /// Reason in one sentence, for the reader of a plan.
    pub reason: String,
}

/// Method to follow light through a guide.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GuideKind {
    /// Straight cylinder: one closed form from end to end.
    ClosedFormStraight,
    /// Cylinders with mitred elbows: a closed form between elbows.
    ClosedFormBent,
    /// Mesh: its facets are hit one by one.
    Mesh,
}

impl GuideKind {
    /// Returns the name of the kind in plans and reports.
    pub fn code(self) -> &'static str {
        match self {
            Self::ClosedFormStraight => "closed_form_straight",
            Self::ClosedFormBent => "closed_form_bent",
            Self::Mesh => "mesh",
        }
    }
}

const STRAIGHT: &str = "straight cylinder: exit point, direction and number of reflections in closed form";
const BENT: &str = "cylinders with mitred elbows: closed form from elbow to elbow";

fn recognised(tube: &TraceableTube) -> GuidePlan {
    if let Some(Section::Bend(bend)) = &tube.section {
        let reason = format!(
            "mesh recognised as {} cylinders of radius {} m with mitred elbows within {:.4} mm; the {} vertices of each ring lie \
             on the cylinders; {BENT}",
            bend.segments.len(),
            bend.radius,
            1e3 * bend.deviation,
            bend.sides
        );
        return GuidePlan { kind: GuideKind::ClosedFormBent, reason };
    }
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
    GuidePlan { kind: GuideKind::ClosedFormStraight, reason }
}

/// Returns a sentence on why facets are traced, and how they differ from a pipe that is meant to be round.
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

/// Returns a sentence on the fractions of light that a measured diffuser transmits and reflects, from its table.
fn measured(diffuser: &Diffuser) -> String {
    let Diffuser::Measured(table) = diffuser else { return String::new() };
    let at = |degrees: f64| {
        let [through, back] = table.albedos(libm::cos(degrees.to_radians()));
        format!("{through:.4} and {back:.4} at {degrees} degrees")
    };
    format!("; measured diffuser: transmits and reflects {}, {}, {}", at(0.0), at(30.0), at(60.0))
}

fn domed(guide: &DomedGuide) -> GuidePlan {
    let Dome { inner, outer, index, absorption } = guide.dome;
    let (kind, pipe) = match guide.pipe {
        PipeBelow::Straight(_) => (GuideKind::ClosedFormStraight, STRAIGHT),
        PipeBelow::Bent(_) => (GuideKind::ClosedFormBent, BENT),
    };
    let axial = slab_transmittance(1.0, index, absorption * (outer - inner));
    let reason = format!(
        "{pipe}; light is traced through the faces of the dome, refractive index {index}, which transmits {axial:.4} \
         of axial light"
    );
    GuidePlan { kind, reason }
}

/// Returns how the guides of a scene are computed, and why; `traceable` is the compiled scene.
pub fn guides(scene: &Scene, traceable: &TraceableScene) -> Vec<GuidePlan> {
    let tubes = &traceable.tubes;
    let equal = |a: usize, b: usize| {
        same_guide(&scene.tubes[a], &scene.tubes[b]) && tubes[a].frame.turn() == tubes[b].frame.turn()
    };
    // the first tube with the guide of each tube, and the number of tubes with it
    let mut firsts: Vec<usize> = Vec::new();
    let mut counts = vec![0; tubes.len()];
    let mut distinct: Vec<usize> = Vec::new();
    for index in 0..tubes.len() {
        let first = distinct.iter().copied().find(|first| equal(*first, index)).unwrap_or(index);
        if first == index {
            distinct.push(index);
        }
        firsts.push(first);
        counts[first] += 1;
    }
    let faces: f64 = scene.room.enclosure.faces().iter().map(|face| face.polygon.area_m2()).sum();
    let of_tube = |((tube, first), own): ((&TraceableTube, &usize), &Tube)| {
        let mut plan = of_guide(tube);
        plan.reason.push_str(&measured(&tube.diffuser));
        if let OpeningShape::Square { side, .. } = tube.opening {
            plan.reason.push_str(&format!("; its light is spread evenly over a square of {side} m"));
        }
        plan.reason.push_str(&hanging(own, faces));
        let count = counts[*first];
        if count > 1 {
            plan.reason
                .push_str(&format!("; {count} tubes have this guide, and its transmission is computed once for all"));
        }
        plan
    };
    tubes.iter().zip(&firsts).zip(&scene.tubes).map(of_tube).collect()
}

/// Returns a sentence on what hangs into a room whose faces have an area in m2: the pipe takes part of the reflected light that is near its share
/// of the area, as long as that light comes from all sides.
fn hanging(tube: &Tube, faces: f64) -> String {
    let OpeningPlane::Level { drop_m } = tube.plane else { return String::new() };
    if drop_m <= 0.0 {
        return String::new();
    }
    let share = 100.0 * 2.0 * PI * tube.opening_radius * drop_m / faces;
    format!(
        "; its opening hangs {drop_m} m below the ceiling: the pipe in the room, {share:.2} % of the area of the faces, is not simulated, and \
         the closure absorbs light from behind"
    )
}

/// True if two tubes differ at most in their place, in the plane of their opening and in their closure.
fn same_guide(a: &Tube, b: &Tube) -> bool {
    a.opening_radius == b.opening_radius
        && match (&a.shape, &b.shape) {
            (TubeShape::Cylinders(a), TubeShape::Cylinders(b)) => a == b,
            (TubeShape::Mesh(a), TubeShape::Mesh(b)) => {
                Arc::ptr_eq(&a.mesh, &b.mesh)
                    && a.parts == b.parts
                    && a.rotation == b.rotation
                    && a.section == b.section
            }
            _ => false,
        }
}

fn of_guide(tube: &TraceableTube) -> GuidePlan {
    match &tube.guide {
        Guide::Straight(_) | Guide::Bent(_) if tube.section.is_some() => recognised(tube),
        Guide::Straight(_) => GuidePlan { kind: GuideKind::ClosedFormStraight, reason: STRAIGHT.into() },
        Guide::Bent(guide) => {
            let cut = if guide.is_cut() { "; its upper end lies in the plane of a tilted pane" } else { "" };
            GuidePlan { kind: GuideKind::ClosedFormBent, reason: format!("{BENT}{cut}") }
        }
        Guide::Domed(guide) => domed(guide),
        Guide::Mesh(guide) => {
            GuidePlan { kind: GuideKind::Mesh, reason: facets(guide.triangle_count(), tube.section.as_ref()) }
        }
    }
}
