//! What is seen of the places where vertices are put, from just before them.

use glam::DVec3;

use super::importance::Placed;
use super::targets::facet_of;
use crate::traceable::{SurfaceId, TraceableScene};

/// Distance at which a vertex stands before its surface, in distances at which surfaces coincide.
const CLEARANCE: f64 = 4.0;

/// A point just before a place.
#[derive(Clone, Copy, Debug)]
pub struct Before {
    /// The point in m.
    pub origin: DVec3,
    /// Unit vector to the place.
    pub direction: DVec3,
    /// The surface of the place where it needs no ray to know that this is what is seen; else that may be an opening, or hidden.
    pub at_once: Option<SurfaceId>,
}

impl Before {
    /// The point before a place; `None` where what is seen of that is a mesh that lies on it, whose own places count, or another facet.
    pub fn of(scene: &TraceableScene, placed: &Placed) -> Option<Self> {
        let origin = placed.position + placed.normal * (CLEARANCE * scene.coinciding());
        let direction = -placed.normal;
        let is_opening = || placed.normal.z < 0.0 && scene.opening_at(placed.position.truncate()).is_some();
        // between plain faces that is found out anyway
        let at_once = placed.bare.filter(|_| scene.obstructed && !is_opening());
        let is_outermost = || match (placed.of_facet, &scene.meshes) {
            (_, None) => true,
            (None, Some(meshes)) => !meshes.blocks(origin, placed.position + direction * scene.coinciding(), 1.0),
            (facet, Some(_)) => facet_of(scene, &scene.intersect(origin, direction, None)) == facet,
        };
        (at_once.is_some() || is_outermost()).then_some(Self { origin, direction, at_once })
    }
}
