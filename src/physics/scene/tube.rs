//! Tubular daylight devices as a scene describes them.

use std::sync::Arc;

use glam::DVec2;

use super::OpeningShape;
use crate::geometry::TriangleMesh;
use crate::geometry::turn::unit_vector;
use crate::guide::Section;
use crate::guide::mesh::Part;
use crate::optics::{Collector, Diffuser, Mirror};

/// One tube above an opening that looks straight down.
#[derive(Clone, Debug)]
pub struct Tube {
    /// Number of the face of the room that the tube comes through.
    pub face: usize,
    /// Height in m, >= 0, by which the opening hangs below that face at its centre.
    pub drop_m: f64,
    /// Centre of the opening in plan, metres.
    pub centre: DVec2,
    /// Radius of the lower end of the guide, metres: that of the opening, unless a transition makes it a square.
    pub opening_radius: f64,
    /// Transition between the guide and a square opening; `None` where the opening is the end of the guide.
    pub transition: Option<Transition>,
    /// Guide and collector above the opening.
    pub shape: TubeShape,
    /// The closure in the opening.
    pub diffuser: Diffuser,
}

/// Transition from the round end of a guide to a square sheet, over which it spreads light evenly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transition {
    /// Length of a side of the square in m, at least the diameter of the guide.
    pub side_m: f64,
    /// Azimuth of two of the sides, clockwise from +y, in radians.
    pub azimuth: f64,
    /// Fraction of the light from the guide that arrives at the sheet, 0..=1.
    pub transmittance: f64,
}

impl Transition {
    /// Returns the square.
    pub fn opening(&self) -> OpeningShape {
        OpeningShape::Square { side: self.side_m, along: unit_vector(-self.azimuth) }
    }
}

impl Tube {
    /// Returns the shape of the opening.
    pub fn opening(&self) -> OpeningShape {
        let disc = OpeningShape::Disc { radius: self.opening_radius };
        self.transition.map_or(disc, |transition| transition.opening())
    }
}

/// Shape of the guide, and its collector.
#[derive(Clone, Debug)]
pub enum TubeShape {
    /// Mirror cylinders, in which paths have a closed form.
    Cylinders(StraightOrBent),
    /// Triangles, or the cylinder that was recognised in them.
    Mesh(MeshTube),
}

/// Equal cylinders that meet in mitred elbows; one segment is a straight tube.
#[derive(Clone, Debug, PartialEq)]
pub struct StraightOrBent {
    /// Reflectance of the wall, per bounce.
    pub reflectance: Mirror,
    /// Straight pieces from the ceiling upward; the first is vertical.
    pub segments: Vec<Segment>,
    /// Cover of the upper end.
    pub collector: Collector,
}

/// A straight segment; its length runs along the axis between mitre centres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Length along the axis in m, > 0.
    pub length_m: f64,
    /// Lean of the axis from the vertical, radians, 0 <= tilt < pi.
    pub tilt: f64,
    /// Azimuth toward which the segment leans, clockwise from +y, in radians.
    pub azimuth: f64,
}

/// A tube given as a triangle mesh; the mesh is in metres with its origin in the centre of the opening, z up.
#[derive(Clone, Debug)]
pub struct MeshTube {
    /// The triangles as they were uploaded, scaled to metres, before `rotation`.
    pub mesh: Arc<TriangleMesh>,
    /// Parts of the tube, one per material of the mesh, in the mesh's order; the optics of diffusers are the tube's `diffuser`.
    pub parts: Vec<Part>,
    /// Rotation, clockwise seen from above, in radians.
    pub rotation: f64,
    /// Cylinder or bend that is computed in the mesh's place, or the reason why its facets are traced.
    pub section: Section,
}
