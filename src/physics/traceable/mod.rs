//! The scene as the integrators trace it: guides built, surfaces numbered, boxes in their own frames.

mod block;
mod box_bounds;
mod box_object;
mod cuboids;
pub mod luminaire;
mod mesh_bounds;
pub mod mesh_objects;
pub mod obstacles;
pub mod outlines;
mod source;
mod surface_id;
mod tube;

use std::sync::Arc;

use glam::{DVec2, DVec3};

use crate::optics::SurfaceOptics;
use crate::optics::reflection::Lobes;
use crate::scene::{BoxObject, Face, MeshObject, Room, Scene};
use crate::sky::{Sky, Sun};
use block::ON_TARGET;
use box_bounds::BoxBounds;
use cuboids::boxes_and_meshes;
use luminaire::TraceableLuminaire;
use mesh_objects::{MeshHit, TraceableMeshes};
use obstacles::{DiscView, Obstacles, Shadow};
use outlines::Casters;

pub use box_object::TraceableBox;
pub use source::Source;
pub use surface_id::{Numbering, Side, SurfaceId};
pub use tube::{TraceableTube, TubeError, cylinder_guide};

/// Share of the room's diagonal within which surfaces coincide: a luminaire so near to a surface lies on it and hides it.
const COINCIDING: f64 = 1e-9;

/// A scene compiled for tracing.
#[derive(Clone, Debug)]
pub struct TraceableScene {
    /// The sky, if its light is followed.
    pub sky: Option<Sky>,
    /// The sun, if its beam is followed.
    pub sun: Option<Sun>,
    /// Extent of the room along x, y and z in m.
    pub size: DVec3,
    /// Optics of the surfaces by number; `None` is open.
    surfaces: Vec<Option<SurfaceOptics>>,
    /// Where the numbers of boxes, facets and luminaires begin.
    pub numbering: Numbering,
    /// Boxes in their own frames, in the scene's order.
    pub boxes: Vec<TraceableBox>,
    /// What rays are compared with before boxes.
    box_bounds: BoxBounds,
    /// Triangles of all objects together; `None` without any.
    pub meshes: Option<Arc<TraceableMeshes>>,
    /// Luminaires, in the scene's order.
    pub luminaires: Vec<TraceableLuminaire>,
    /// Tubes, in the scene's order.
    pub tubes: Vec<TraceableTube>,
    /// True if reflected light is followed.
    pub interreflection: bool,
    /// True if light that goes up into a guide is followed for its return.
    pub guide_return: bool,
    /// True if anything but its faces is in the room.
    furnished: bool,
    /// True if anything can stand between two points of the room; luminaires on its faces cannot.
    pub obstructed: bool,
    /// True if anything can stand between a luminaire and a point before it.
    pub luminaires_obstructed: bool,
    /// Bounding volumes of everything that can stand in the way of light from an opening.
    obstacles: Obstacles,
}

/// What of a scene's light is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Follow {
    /// Light that surfaces of the room reflect.
    pub interreflection: bool,
    /// Light that goes up into a guide, for its return.
    pub guide_return: bool,
    /// What boxes and meshes do to light; else they are left out.
    pub objects: bool,
}

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
    /// Builds guides and numbers surfaces; fails where a meshed tube has no guide.
    pub fn new(scene: &Scene, follow: Follow) -> Result<Self, TubeError> {
        let Follow { interreflection, guide_return, objects } = follow;
        let Room { size, surfaces, luminaires, .. } = &scene.room;
        let (boxes, meshes) = if objects { boxes_and_meshes(scene) } else { Default::default() };
        let (boxes, meshes): (&[BoxObject], &[MeshObject]) = (&boxes, &meshes);
        let mut lobes = Lobes::default();
        let mut optics: Vec<_> =
            surfaces.iter().map(|surface| surface.map(|surface| lobes.compile(&surface))).collect();
        for object in boxes {
            optics.extend(std::iter::repeat_n(Some(lobes.compile(&object.surface)), 6));
        }
        let mesh_objects = meshes;
        let meshes = TraceableMeshes::new(meshes, *size).map(|(meshes, of_facets)| {
            for surface in &of_facets {
                let both_sides = lobes.compile(surface);
                optics.extend([Some(both_sides.clone()), Some(both_sides)]);
            }
            Arc::new(meshes)
        });
        let facets = meshes.as_ref().map_or(0, |meshes| meshes.facets.len());
        let numbering = Numbering { boxes: boxes.len(), facets, luminaires: luminaires.len() };
        let luminaires: Vec<_> = luminaires
            .iter()
            .enumerate()
            .map(|(index, luminaire)| TraceableLuminaire::new(luminaire, numbering.luminaire(index)))
            .collect();
        let black = SurfaceOptics::BLACK;
        optics.extend(std::iter::repeat_n(Some(black), luminaires.len()));
        let tubes = scene
            .tubes
            .iter()
            .enumerate()
            .map(|(tube, description)| {
                TraceableTube::new(description, size.z).map_err(|error| TubeError { tube, error })
            })
            .collect::<Result<_, _>>()?;
        let objects = !boxes.is_empty() || meshes.is_some();
        let hanging: Vec<_> =
            luminaires.iter().copied().filter(|luminaire| !lies_on_a_face(luminaire, *size)).collect();
        let boxes: Vec<_> = boxes.iter().map(TraceableBox::new).collect();
        let tubes: Vec<TraceableTube> = tubes;
        let obstacles = Obstacles::new(&boxes, mesh_objects, &hanging).toward_openings(&tubes, *size);
        let box_bounds = BoxBounds::new(&boxes.iter().map(TraceableBox::bounds).collect::<Vec<_>>(), *size);
        let hanging = !hanging.is_empty();
        Ok(Self {
            sky: scene.daylight.as_ref().and_then(|daylight| daylight.sky.clone()),
            sun: scene.daylight.as_ref().and_then(|daylight| daylight.sun),
            size: *size,
            surfaces: optics,
            numbering,
            furnished: objects || !luminaires.is_empty(),
            obstructed: objects || hanging,
            luminaires_obstructed: objects || (hanging && luminaires.len() > 1),
            boxes,
            box_bounds,
            obstacles,
            meshes,
            luminaires,
            tubes,
            interreflection,
            guide_return,
        })
    }

    /// Optics of a surface; `None` where the room is open.
    #[inline]
    pub fn optics(&self, surface: SurfaceId) -> Option<&SurfaceOptics> {
        self.surfaces[surface.index()].as_ref()
    }

    /// Optics of all surfaces that are not open.
    pub fn all_optics(&self) -> impl Iterator<Item = &SurfaceOptics> {
        self.surfaces.iter().flatten()
    }

    /// The luminaire with this surface number.
    #[inline]
    pub fn luminaire(&self, surface: SurfaceId) -> Option<&TraceableLuminaire> {
        self.luminaires.get(self.numbering.luminaire_of(surface)?)
    }

    /// The sources that give light.
    pub fn sources(&self) -> impl Iterator<Item = Source> {
        Source::ALL.into_iter().filter(|source| match source {
            Source::Sky => self.sky.is_some(),
            Source::Sun => self.sun.is_some(),
            Source::Luminaires => self.luminaires.iter().any(TraceableLuminaire::emits),
        })
    }

    /// The same scene where `source` alone gives light, and daylight comes in by the collector of `tube` alone, or by all.
    pub fn lit_by(&self, source: Source, tube: Option<usize>) -> Self {
        let mut scene = self.clone();
        scene.sky = scene.sky.filter(|_| source == Source::Sky);
        scene.sun = scene.sun.filter(|_| source == Source::Sun);
        if source != Source::Luminaires {
            scene.luminaires.iter_mut().for_each(|luminaire| luminaire.luminance = [0.0; 3]);
        }
        for (number, other) in scene.tubes.iter_mut().enumerate() {
            other.daylit &= tube.is_none_or(|tube| tube == number);
        }
        scene
    }

    /// The same scene without light that surfaces of the room reflect.
    pub fn without_interreflection(&self) -> Self {
        Self { interreflection: false, ..self.clone() }
    }

    /// True if no light can come into the room: no tube lets any pass, and nothing in the room shines.
    pub fn is_dark(&self) -> bool {
        self.tubes.iter().all(|tube| tube.diffuser.is_opaque())
            && !self.luminaires.iter().any(TraceableLuminaire::emits)
    }

    /// Surfaces that reflect beside their diffuse part, where that is not left out.
    pub fn specular_surfaces(&self) -> impl Iterator<Item = &SurfaceOptics> {
        self.all_optics().filter(|surface| surface.is_specular())
    }

    /// Leaves specular reflection out: surfaces absorb its share.
    pub fn without_specular(mut self) -> Self {
        for surface in &mut self.surfaces {
            *surface = surface.take().map(SurfaceOptics::without_specular);
        }
        self
    }

    /// The first thing that a ray from inside the room meets; `from`: the surface it leaves, if any.
    #[inline]
    pub fn intersect(&self, origin: DVec3, direction: DVec3, from: Option<SurfaceId>) -> RoomHit {
        let (distance, axis) = self.way_to_face(origin, direction);
        if self.furnished
            && let Some(hit) = self.nearest_object(origin, direction, distance, from)
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
    fn way_to_face(&self, origin: DVec3, direction: DVec3) -> (f64, usize) {
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

    /// True if the room has no objects and no luminaires, and its faces are diffuse and light that they reflect is followed.
    pub fn is_plain(&self) -> bool {
        !self.furnished && self.interreflection && self.specular_surfaces().next().is_none()
    }

    /// True if nothing stands between two points of the room; the surfaces that they lie on do not count.
    #[inline]
    pub fn visible(&self, a: DVec3, from: Option<SurfaceId>, b: DVec3, to: Option<SurfaceId>) -> bool {
        if !self.obstructed {
            return true;
        }
        let own = |surface: Option<SurfaceId>| surface.and_then(|surface| self.numbering.box_of(surface));
        let (own_a, own_b) = (own(from), own(to));
        self.no_luminaire_between(a, from, b, to)
            && self.box_bounds.met(a, b - a, 1.0).into_iter().all(|index| {
                Some(index) == own_a
                    || Some(index) == own_b
                    || self.boxes[index].intersect(a, b - a).is_none_or(|(t, ..)| t >= 1.0 - ON_TARGET)
            })
            && !self.meshes.as_ref().is_some_and(|meshes| meshes.blocks(a, b, 1.0 - ON_TARGET))
    }

    /// True if no mesh and no luminaire stands between two points of the room.
    #[inline]
    pub fn visible_past_boxes(&self, a: DVec3, b: DVec3) -> bool {
        self.no_luminaire_between(a, None, b, None)
            && !self.meshes.as_ref().is_some_and(|meshes| meshes.blocks(a, b, 1.0 - ON_TARGET))
    }

    /// True if certainly nothing stands between any point within `reach` of `position`, at its height, and any point of
    /// a disc of `radius` around `centre` in the ceiling; `from` is the surface of `position`, whose horizon hides
    /// nothing.
    pub fn leaves_clear(
        &self,
        position: DVec3,
        reach: f64,
        from: Option<SurfaceId>,
        centre: DVec3,
        radius: f64,
    ) -> bool {
        if !self.obstructed {
            return true;
        }
        // a box is convex: none of its points hides what another sees
        let own_box = from.filter(|_| reach == 0.0).and_then(|surface| self.numbering.box_of(surface));
        self.obstacles.leave_clear(position, reach, own_box, centre, radius)
    }

    /// True if certainly no object and no luminaire touches the block along the axes between two corners, widened by `near` m; box
    /// `but_for` is left out.
    pub fn leaves_bare(&self, corners: [DVec3; 2], near: f64, but_for: Option<usize>) -> bool {
        // luminaires on faces are no obstacles
        self.luminaires.is_empty() && self.obstacles.leave_bare(corners, near, but_for)
    }

    /// The shadows that light from `position` throws on the horizontal plane at `height`; box `but_for` throws none.
    pub fn shadows(&self, position: DVec3, height: f64, but_for: Option<usize>) -> impl Iterator<Item = Shadow> {
        self.obstacles.shadows(position, height, but_for)
    }

    /// How a point below the ceiling sees the opening of a tube.
    pub fn view_of_opening(&self, position: DVec3, tube: usize) -> DiscView {
        let tube = &self.tubes[tube];
        self.obstacles.view_of_disc(position, tube.origin, tube.opening_radius)
    }

    /// Everything that can stand in the way of light, ready for questions about the outlines of its shadows.
    pub fn casters(&self) -> Casters {
        self.obstacles.casters()
    }

    /// The same of some obstacles by their numbers.
    pub fn casters_of(&self, obstacles: &[usize]) -> Casters {
        self.obstacles.casters_of(obstacles)
    }

    /// True if a point is inside a box, or on the lower side of one.
    #[inline]
    pub fn is_in_box(&self, point: DVec3) -> bool {
        self.boxes.iter().any(|object| object.contains(point))
    }

    fn no_luminaire_between(&self, a: DVec3, from: Option<SurfaceId>, b: DVec3, to: Option<SurfaceId>) -> bool {
        self.luminaires.iter().all(|luminaire| {
            Some(luminaire.surface) == from
                || Some(luminaire.surface) == to
                || luminaire
                    .intersect(a, b - a)
                    .is_none_or(|t| t >= 1.0 - ON_TARGET || t * (b - a).length() <= self.coinciding())
        })
    }

    /// The tube whose opening has this point of the ceiling.
    #[inline]
    pub fn opening_at(&self, point: DVec2) -> Option<usize> {
        self.tubes.iter().position(|tube| {
            (point - tube.origin.truncate()).length_squared() < tube.opening_radius * tube.opening_radius
        })
    }

    /// Height in metres above a plane within which a flight that ends there has reached it: light ends a hair's breadth
    /// before a mesh, and a grid may lie on it.
    pub fn contact(&self) -> f64 {
        self.meshes.as_ref().map_or(0.0, |meshes| 2.0 * meshes.clearance)
    }

    /// Distance in metres within which surfaces coincide.
    pub fn coinciding(&self) -> f64 {
        COINCIDING * self.size.length()
    }

    fn nearest_object(&self, origin: DVec3, direction: DVec3, within: f64, from: Option<SurfaceId>) -> Option<RoomHit> {
        let mut hit = self.nearest_box(origin, direction, within, from);
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
            let object = &self.boxes[index];
            if let Some((t, face, normal)) = object.intersect(origin, direction)
                && t < distance
            {
                distance = t;
                let place = Place::Surface(self.numbering.box_face(index, face));
                let mut position = origin + direction * t;
                if face / 2 == 2 {
                    // on the plane exactly: a grid may lie in it
                    position.z = if face % 2 == 1 { object.span().1 } else { object.span().0 };
                }
                nearest = Some(RoomHit { position, normal, place });
            }
        }
        nearest
    }
}

/// True if a luminaire lies in the plane of a face of the room, where it can stand between nothing.
fn lies_on_a_face(luminaire: &TraceableLuminaire, size: DVec3) -> bool {
    let corners = luminaire.corners();
    (0..3).any(|axis| {
        [0.0, size[axis]]
            .iter()
            .any(|plane| corners.iter().all(|corner| (corner[axis] - plane).abs() <= COINCIDING * size.length()))
    })
}
