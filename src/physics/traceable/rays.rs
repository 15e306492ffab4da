//! Where a ray through the room ends.

use glam::{DVec2, DVec3};

use super::luminaire::TraceableLuminaire;
use super::mesh_objects::MeshHit;
use super::scene::TraceableScene;
use super::surface_id::SurfaceId;
use crate::scene::Face;

/// Place where a ray in the room ends.
#[derive(Clone, Copy, Debug)]
pub struct RoomHit {
    /// Point that the ray meets, in m.
    pub position: DVec3,
    /// Unit normal on the ray's side.
    pub normal: DVec3,
    /// What the ray meets there.
    pub place: Place,
}

/// What a ray through the room meets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// A face of the room, an object or a luminaire.
    Surface(SurfaceId),
    /// The opening of a tube.
    Opening(usize),
}

impl TraceableScene {
    /// The first thing that a ray from inside the room meets; `from`: the surface it leaves, if any.
    #[inline]
    pub fn intersect(&self, origin: DVec3, direction: DVec3, from: Option<SurfaceId>) -> RoomHit {
        let face = self.way_to_face(origin, direction);
        let on_box = if self.furnished { self.nearest_box(origin, direction, face.0, from) } else { None };
        self.beyond_boxes(origin, direction, face, on_box, from)
    }

    /// The same where it is known which box the ray meets before it comes to a face, whose distance and axis are given.
    #[inline]
    pub(super) fn beyond_boxes(
        &self,
        origin: DVec3,
        direction: DVec3,
        (distance, axis): (f64, usize),
        on_box: Option<RoomHit>,
        from: Option<SurfaceId>,
    ) -> RoomHit {
        if self.furnished
            && let Some(hit) = self.nearest_object(origin, direction, distance, on_box, from)
        {
            return hit;
        }
        let (far, position) = self.on_face(origin, direction, distance, axis);
        let mut normal = DVec3::ZERO;
        normal[axis] = if far { -1.0 } else { 1.0 };
        let face = Face::ALL[2 * axis + usize::from(far)];
        let surface = Place::Surface(SurfaceId::of_face(face));
        let place = if face == Face::Ceiling {
            self.opening_at(position.truncate()).map_or(surface, Place::Opening)
        } else {
            surface
        };
        RoomHit { position, normal, place }
    }

    /// The face of the empty room that a ray from inside meets, by its axis and whether it is the far one, and where.
    #[inline]
    pub fn meet_face(&self, origin: DVec3, direction: DVec3) -> (usize, bool, DVec3) {
        let (distance, axis) = self.way_to_face(origin, direction);
        let (far, position) = self.on_face(origin, direction, distance, axis);
        (axis, far, position)
    }

    /// Distance to the face that a ray meets, and its axis.
    #[inline]
    pub(super) fn way_to_face(&self, origin: DVec3, direction: DVec3) -> (f64, usize) {
        let (mut distance, mut axis) = (f64::INFINITY, 2);
        for k in 0..3 {
            // without branches: which wall a ray heads for is as random as the ray
            let wall = if direction[k] > 0.0 { self.size[k] } else { 0.0 };
            let to_wall = (wall - origin[k]) / direction[k];
            let nearer = direction[k] != 0.0 && to_wall < distance;
            (distance, axis) = if nearer { (to_wall, k) } else { (distance, axis) };
        }
        (distance.max(0.0), axis)
    }

    /// True for the far face of an axis, and the point of it that a ray meets at a distance.
    #[inline]
    fn on_face(&self, origin: DVec3, direction: DVec3, distance: f64, axis: usize) -> (bool, DVec3) {
        let mut position = origin + direction * distance;
        let far = direction[axis] > 0.0;
        // on the plane exactly, so that the next ray starts on it
        position[axis] = if far { self.size[axis] } else { 0.0 };
        (far, position.clamp(DVec3::ZERO, self.size))
    }

    /// The tube whose opening has this point of the ceiling.
    #[inline]
    pub fn opening_at(&self, point: DVec2) -> Option<usize> {
        self.tubes.iter().position(|tube| {
            (point - tube.origin.truncate()).length_squared() < tube.opening_radius * tube.opening_radius
        })
    }

    /// The nearest object, of which the box on the way is known.
    fn nearest_object(
        &self,
        origin: DVec3,
        direction: DVec3,
        within: f64,
        on_box: Option<RoomHit>,
        from: Option<SurfaceId>,
    ) -> Option<RoomHit> {
        let mut hit = on_box;
        let mut within = hit.map_or(within, |hit| (hit.position - origin).dot(direction));
        // what coincides with a wall lies on it
        let on_mesh = self.meshes.as_ref().and_then(|meshes| meshes.intersect(origin, direction));
        if let Some(on_mesh) = on_mesh.filter(|hit| hit.distance <= within + self.coinciding()) {
            within = on_mesh.distance;
            let MeshHit { position, normal, facet, side, .. } = on_mesh;
            let surface = self.numbering.facet_side(facet, side);
            hit = Some(RoomHit { position, normal, place: Place::Surface(surface) });
        }
        if self.luminaires.is_empty() {
            return hit;
        }
        self.nearest_luminaire(origin, direction, within, from).or(hit)
    }

    /// The nearest luminaire; one that coincides with what is hit at distance `within` lies on it. Of two that lie back to
    /// back, the one that faces the ray.
    fn nearest_luminaire(
        &self,
        origin: DVec3,
        direction: DVec3,
        within: f64,
        from: Option<SurfaceId>,
    ) -> Option<RoomHit> {
        let near = self.coinciding();
        let mut nearest: Option<(f64, &TraceableLuminaire)> = None;
        for luminaire in self.luminaires.iter().filter(|luminaire| Some(luminaire.surface) != from) {
            let Some(distance) = luminaire.intersect(origin, direction) else { continue };
            if distance <= near || distance > within + near {
                continue;
            }
            let faces = |luminaire: &TraceableLuminaire| luminaire.normal.dot(direction) < 0.0;
            let closer = nearest.is_none_or(|(other_distance, other)| {
                if (distance - other_distance).abs() <= near {
                    faces(luminaire) && !faces(other)
                } else {
                    distance < other_distance
                }
            });
            if closer {
                nearest = Some((distance, luminaire));
            }
        }
        nearest.map(|(distance, luminaire)| RoomHit {
            position: luminaire.onto_plane(origin + direction * distance).clamp(DVec3::ZERO, self.size),
            normal: if luminaire.normal.dot(direction) < 0.0 { luminaire.normal } else { -luminaire.normal },
            place: Place::Surface(luminaire.surface),
        })
    }

    fn nearest_box(&self, origin: DVec3, direction: DVec3, within: f64, from: Option<SurfaceId>) -> Option<RoomHit> {
        let mut nearest = None;
        let mut distance = within;
        let own = from.and_then(|surface| self.numbering.box_of(surface));
        for index in self.box_bounds.met(origin, direction, within) {
            // a box is convex: no ray that leaves it meets it again
            if Some(index) == own {
                continue;
            }
            if let Some(entry) = self.boxes[index].intersect(origin, direction)
                && entry.0 < distance
            {
                distance = entry.0;
                nearest = Some(self.on_box(index, entry, origin, direction));
            }
        }
        nearest
    }

    /// Where a ray meets a box that it enters at distance `t`, through `face`, of an outward normal.
    #[inline]
    pub(super) fn on_box(
        &self,
        index: usize,
        (t, face, normal): (f64, usize, DVec3),
        origin: DVec3,
        direction: DVec3,
    ) -> RoomHit {
        let place = Place::Surface(self.numbering.box_face(index, face));
        let mut position = origin + direction * t;
        if face / 2 == 2 {
            // on the plane exactly: a grid may lie in it
            let (low, high) = self.boxes[index].span();
            position.z = if face % 2 == 1 { high } else { low };
        }
        RoomHit { position, normal, place }
    }
}
