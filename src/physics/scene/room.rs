//! The room, with the objects and luminaires in it.

use glam::DVec3;

use super::{Enclosure, Luminaire, MeshObject};
use crate::optics::Surface;

/// A room.
#[derive(Clone, Debug)]
pub struct Room {
    /// Faces around the room.
    pub enclosure: Enclosure,
    /// Boxes, in the document's order.
    pub boxes: Vec<BoxObject>,
    /// Objects of triangles, in the document's order.
    pub meshes: Vec<MeshObject>,
    /// Electric luminaires, in the document's order.
    pub luminaires: Vec<Luminaire>,
}

/// A box that stands in the room with vertical sides.
#[derive(Clone, Copy, Debug)]
pub struct BoxObject {
    /// Extent along its own x, y, z in metres.
    pub size: DVec3,
    /// Centre of its base in metres.
    pub base: DVec3,
    /// Rotation about the vertical, clockwise seen from above, in radians.
    pub rotation: f64,
    /// Optics of all six faces.
    pub surface: Surface,
}
