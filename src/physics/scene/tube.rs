//! Tubular daylight devices as a scene describes them.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::{Enclosure, OpeningShape};
use crate::geometry::turn::unit_vector;
use crate::geometry::{OpeningFrame, TriangleMesh};
use crate::guide::Section;
use crate::guide::mesh::Part;
use crate::optics::{Collector, Diffuser, Mirror};
use crate::sky::{Surroundings, direction};

/// Height within which vertices of a mesh are level, relative to the height of its top.
const LEVEL: f64 = 1e-6;

/// One tube, from its opening up to its collector.
#[derive(Clone, Debug)]
pub struct Tube {
    /// Number of the face of the room that the tube comes through.
    pub face: usize,
    /// Plane of the opening.
    pub plane: OpeningPlane,
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
    /// Surroundings of the upper end; `None` under an open sky over black ground.
    pub surroundings: Option<Arc<Surroundings>>,
}

impl Tube {
    /// Returns the frame of the opening in a room.
    pub fn frame(&self, enclosure: &Enclosure) -> OpeningFrame {
        match self.plane {
            OpeningPlane::Level { drop_m } => {
                OpeningFrame::level(self.centre.extend(enclosure.height_at(self.face, self.centre) - drop_m))
            }
            OpeningPlane::OfFace { height_m } => {
                let outward = -enclosure.faces()[self.face].polygon.normal();
                OpeningFrame::facing_from(self.centre.extend(height_m), outward)
            }
        }
    }

    /// True if the opening hangs below the face that the tube comes through.
    pub fn hangs(&self) -> bool {
        matches!(self.plane, OpeningPlane::Level { drop_m } if drop_m > 0.0)
    }

    /// Returns the largest distance in m of the rim of the upper end from its centre: of the ellipse of a tilted pane, or of the top of a
    /// mesh.
    pub fn upper_radius(&self) -> f64 {
        match &self.shape {
            TubeShape::Cylinders(tube) => {
                let cut = tube.cut.zip(tube.segments.last()).map_or(1.0, |(pane, last)| pane.dot(last.axis()));
                self.opening_radius / cut
            }
            TubeShape::Mesh(tube) => {
                let (rim, centre) = tube.top();
                rim.iter().map(|position| position.truncate().distance(centre.truncate())).fold(0.0, f64::max)
            }
        }
    }

    /// Returns the centre of the upper end in a room, relative to that of the opening, in m: the top of a mesh.
    pub fn upper_end(&self, enclosure: &Enclosure) -> DVec3 {
        match &self.shape {
            TubeShape::Cylinders(tube) => tube.segments.iter().map(|segment| segment.length_m * segment.axis()).sum(),
            TubeShape::Mesh(tube) => {
                let turn = unit_vector(-tube.rotation);
                let (_, centre) = tube.top();
                self.frame(enclosure).direction_in_room(turn.rotate(centre.truncate()).extend(centre.z))
            }
        }
    }
}

/// Plane of an opening.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OpeningPlane {
    /// A level plane, from which the opening faces straight down.
    Level {
        /// Height in m, >= 0, by which the opening hangs below its face at its centre.
        drop_m: f64,
    },
    /// Plane of the face that the tube comes through.
    OfFace {
        /// Height of the opening's centre above the floor in m.
        height_m: f64,
    },
}

/// Transition from the round end of a guide to a square sheet, over which it spreads light evenly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transition {
    /// Length of a side of the square in m, at least the diameter of the guide.
    pub side_m: f64,
    /// Azimuth of two of the sides, clockwise from +y of the opening's levelled frame, in radians.
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
    /// Straight pieces from the opening outward; the first is across the opening, vertical above a level one.
    pub segments: Vec<Segment>,
    /// Cover of the upper end.
    pub collector: Collector,
    /// Unit normal, pointing out, of the plane that cuts the upper end; `None` for an end across the axis.
    pub cut: Option<DVec3>,
}

impl StraightOrBent {
    /// True if all segments are vertical and the upper end is level.
    pub fn is_straight(&self) -> bool {
        self.cut.is_none() && self.segments.iter().all(|segment| segment.tilt == 0.0)
    }

    /// Counts the elbows: places where the axis changes its direction.
    pub fn bends(&self) -> u32 {
        let turned = self
            .segments
            .windows(2)
            .filter(|pair| pair[0].tilt != pair[1].tilt || (pair[0].tilt != 0.0 && pair[0].azimuth != pair[1].azimuth));
        turned.count() as u32
    }
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

impl Segment {
    /// Returns the unit vector along the axis, upward along the guide.
    pub fn axis(&self) -> DVec3 {
        direction(FRAC_PI_2 - self.tilt, self.azimuth)
    }
}

/// A tube given as a triangle mesh; the mesh is in metres with its origin in the centre of the opening, and its axes are those of the opening's
/// levelled frame.
#[derive(Clone, Debug)]
pub struct MeshTube {
    /// The triangles as they were uploaded, scaled to metres, before `rotation`.
    pub mesh: Arc<TriangleMesh>,
    /// Parts of the tube, one per material of the mesh, in the mesh's order; the optics of diffusers are the tube's `diffuser`.
    pub parts: Vec<Part>,
    /// Rotation, clockwise seen from above, or from outside above an opening that is not level, in radians.
    pub rotation: f64,
    /// Cylinder or bend that is computed in the mesh's place, or the reason why its facets are traced.
    pub section: Section,
}

impl MeshTube {
    /// Returns the corners of the collector, or of the whole mesh without one, that are farthest from the opening, and the mean of them, in the
    /// mesh's frame before `rotation`. A level rim has many.
    fn top(&self) -> (Vec<DVec3>, DVec3) {
        let mesh = &self.mesh;
        let is_cover = |material: &u32| matches!(self.parts[*material as usize], Part::Collector { .. });
        let of_cover = mesh.triangles.iter().zip(&mesh.triangle_materials).filter(|(_, material)| is_cover(material));
        let mut corners: Vec<u32> = of_cover.flat_map(|(corners, _)| *corners).collect();
        corners.sort_unstable();
        corners.dedup();
        let mut rim: Vec<DVec3> = corners.iter().map(|corner| mesh.positions[*corner as usize]).collect();
        if rim.is_empty() {
            rim.clone_from(&mesh.positions);
        }
        let top = rim.iter().map(|position| position.z).fold(0.0, f64::max);
        rim.retain(|position| top - position.z <= LEVEL * top);
        let mean = rim.iter().sum::<DVec3>() / f64::max(rim.len() as f64, 1.0);
        (rim, mean)
    }
}
