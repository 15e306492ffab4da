//! Conversion of a document's tubes to those of a scene.

use glam::DVec3;

use super::closure_shape::ClosureShapeDocument;
use super::mesh::mesh_tube;
use super::opening::PlacedOpening;
use super::{ParametricTube, TubeDocument};
use crate::document::errors::Checks;
use crate::document::file_source::FileSource;
use crate::document::provenance::GuideProvenance;
use crate::guide::Section;
use crate::scene::{Enclosure, Segment, StraightOrBent, Tube, TubeShape};

/// Distance of unit vectors within which a pane lies across the axis, for rounding.
const ACROSS: f64 = 1e-12;

/// Returns the tube at `pointer` in a room, and the representation of its guide; `None` after an error.
pub(crate) fn tube(
    pointer: &str,
    tube: &TubeDocument,
    enclosure: &Enclosure,
    meshes: &dyn FileSource,
    checks: &mut Checks,
) -> Option<(Tube, GuideProvenance)> {
    let opening = PlacedOpening::of(tube, enclosure)?;
    match tube {
        TubeDocument::Parametric(tube) => Some(cylinders(tube, &opening)),
        TubeDocument::Mesh(document) => {
            let (mesh, diffuser) = mesh_tube(pointer, document, meshes, checks)?;
            let guide = match mesh.section {
                Section::Cylinder(_) => GuideProvenance::ClosedFormStraightRecognised,
                Section::Bend(_) => GuideProvenance::ClosedFormBentRecognised,
                Section::Facets { .. } => GuideProvenance::Mesh,
            };
            let tube = Tube {
                face: opening.face,
                plane: opening.plane(),
                centre: opening.frame.origin.truncate(),
                opening_radius: 0.5 * document.opening_diameter_m,
                transition: None,
                shape: TubeShape::Mesh(mesh),
                diffuser,
                surroundings: None,
            };
            Some((tube, guide))
        }
    }
}

fn cylinders(tube: &ParametricTube, opening: &PlacedOpening) -> (Tube, GuideProvenance) {
    let outward = opening.frame.outward();
    let segments =
        tube.segments.iter().enumerate().map(|(index, segment)| match opening.frame.is_level() || index > 0 {
            true => Segment {
                length_m: segment.length_m,
                tilt: segment.tilt_deg.to_radians(),
                azimuth: segment.azimuth_deg.to_radians(),
            },
            false => Segment {
                length_m: segment.length_m,
                tilt: libm::atan2(outward.truncate().length(), outward.z),
                azimuth: libm::atan2(outward.x, outward.y),
            },
        });
    let shape = StraightOrBent {
        reflectance: tube.reflectance.mirror(),
        segments: segments.collect(),
        collector: tube.collector.collector(),
        cut: None,
    };
    let across = shape.segments.last().map(Segment::axis);
    // a pane across the axis cuts nothing
    let is_oblique = |pane: &DVec3| across.is_some_and(|axis| axis.distance(*pane) > ACROSS);
    let shape = StraightOrBent { cut: tube.collector.pane().filter(is_oblique), ..shape };
    // several vertical segments make one straight tube
    let straight = shape.is_straight();
    let tube = Tube {
        face: opening.face,
        plane: opening.plane(),
        centre: opening.frame.origin.truncate(),
        opening_radius: 0.5 * tube.diameter_m,
        transition: tube.closure_shape.as_ref().map(ClosureShapeDocument::transition),
        shape: TubeShape::Cylinders(shape),
        diffuser: tube.diffuser.diffuser(),
        surroundings: None,
    };
    (tube, if straight { GuideProvenance::ClosedFormStraight } else { GuideProvenance::ClosedFormBent })
}
