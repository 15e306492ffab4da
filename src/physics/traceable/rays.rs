//! Intersection of rays with the room and everything in it.

use glam::DVec3;

use super::enclosure::FaceAhead;
use super::luminaire::TraceableLuminaire;
use super::mesh_objects::MeshHit;
use super::scene::TraceableScene;
use super::surface_id::SurfaceId;

/// Point at which a ray in the room ends.
#[derive(Clone, Copy, Debug)]
pub struct RoomHit {
    /// Point that the ray meets, in m.
    pub position: DVec3,
    /// Unit normal on the ray's side.
    pub normal: DVec3,
    /// Surface or opening that the ray meets there.
    pub place: Place,
}

/// Surface or opening that a ray through the room meets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// A face of the room, an object or a luminaire.
    Surface(SurfaceId),
    /// The opening of the tube of this number.
    Opening(usize),
}

impl TraceableScene {
    /// Returns the number of the surface at a place: of an opening that of the lower side of its closure.
    #[inline]
    pub fn surface_at(&self, place: Place) -> SurfaceId {
        match place {
            Place::Surface(surface) => surface,
            Place::Opening(tube) => self.numbering.closure(tube),
        }
    }

    /// Finds the first thing that a ray from inside the room meets; `from`: the surface it leaves, if any.
    #[inline]
    pub fn intersect(&self, origin: DVec3, direction: DVec3, from: Option<SurfaceId>) -> RoomHit {
        let ahead = self.enclosure.ahead(origin, direction);
        if self.furnished {
            let on_box = self.nearest_box(origin, direction, ahead.distance, from);
            if let Some(hit) = self.nearest_object(origin, direction, ahead.distance, on_box, from) {
                return hit;
            }
        }
        self.on_face(ahead, origin, direction)
    }

    /// Returns the hit of a ray on a face of the room: on the face itself, or in an opening.
    #[inline]
    fn on_face(&self, ahead: FaceAhead, origin: DVec3, direction: DVec3) -> RoomHit {
        let position = self.enclosure.point_on(ahead, origin, direction);
        let in_opening = if self.faces_with_openings.contains(&ahead.face) {
            self.tubes.iter().position(|tube| !tube.hangs && tube.face == ahead.face && tube.has(position))
        } else {
            None
        };
        let place = in_opening.map_or_else(|| Place::Surface(SurfaceId::numbered(ahead.face)), Place::Opening);
        RoomHit { position, normal: self.enclosure.normal(ahead.face), place }
    }

    /// Finds the nearest object that a ray meets before the distance `within`; `on_box` is the hit on the nearest box, if any.
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
        // a triangle that coincides with a wall lies on it and is met
        let on_mesh = self.meshes.as_ref().and_then(|meshes| meshes.intersect(origin, direction));
        if let Some(on_mesh) = on_mesh.filter(|hit| hit.distance <= within + self.coinciding()) {
            within = on_mesh.distance;
            let MeshHit { position, normal, facet, side, .. } = on_mesh;
            let surface = self.numbering.facet_side(facet, side);
            hit = Some(RoomHit { position, normal, place: Place::Surface(surface) });
        }
        if !self.luminaires.is_empty()
            && let Some(on_luminaire) = self.nearest_luminaire(origin, direction, within, from)
        {
            within = (on_luminaire.position - origin).dot(direction);
            hit = Some(on_luminaire);
        }
        if self.openings_hang { self.hanging_opening(origin, direction, within).or(hit) } else { hit }
    }

    /// Finds the nearest opening that hangs into the room: from below it is met as an opening, from above as a black disc.
    fn hanging_opening(&self, origin: DVec3, direction: DVec3, within: f64) -> Option<RoomHit> {
        let near = self.coinciding();
        let met = self.tubes.iter().enumerate().filter(|(_, tube)| tube.hangs).filter_map(|(number, tube)| {
            let distance = (tube.frame.origin.z - origin.z) / direction.z;
            let ahead = distance > near && distance < within;
            let position = (origin + direction * distance).with_z(tube.frame.origin.z);
            (ahead && tube.has(position)).then_some((distance, number, position))
        });
        let (_, tube, position) = met.min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(match direction.z > 0.0 {
            true => RoomHit { position, normal: DVec3::NEG_Z, place: Place::Opening(tube) },
            false => RoomHit { position, normal: DVec3::Z, place: Place::Surface(self.numbering.above_openings()) },
        })
    }

    /// Finds the nearest luminaire that a ray meets. One that coincides with the surface hit at the distance `within` lies on it and is
    /// met; of two that lie back to back, the one that faces the ray is met.
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
            position: self.enclosure.clamp(luminaire.onto_plane(origin + direction * distance)),
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

    /// Returns the hit of a ray on a box that it enters at distance `t` through `face`, whose outward normal is given.
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
