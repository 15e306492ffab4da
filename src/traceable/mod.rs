//! The scene as the integrators trace it: guides built, surfaces numbered, boxes in their own frames.

pub mod luminaire;
pub mod mesh_objects;
pub mod obstacles;

use std::sync::Arc;

use glam::{DMat2, DVec2, DVec3};

use crate::guide::{BentGuide, DomedGuide, Guide, MeshGuide, MeshGuideError, Section, StraightGuide, dome::Pipe};
use crate::optics::{Closure, Collector, Diffuser, Glossy, Surface};
use crate::sampling::PathRandom;
use crate::scene::{BoxObject, Face, MeshObject, MeshTube, Room, Scene, StraightOrBent, Tube, TubeShape};
use crate::sky::{Sky, Sun, direction};
use luminaire::TraceableLuminaire;
use mesh_objects::{MeshHit, TraceableMeshes};
use obstacles::Obstacles;

/// Number of a surface: 0..6 the faces of the room, then six for each box, then two for each facet of a mesh (its front
/// and its back), then one for each luminaire.
pub type SurfaceId = u32;

/// Stands for no surface, e.g. where light comes out of an opening.
pub const NO_SURFACE: SurfaceId = SurfaceId::MAX;

/// Share of a segment's end within which a box counts as touched, not as in between: a sensor on a table sees the room.
const ON_TARGET: f64 = 1e-9;

/// Share of the room's diagonal within which surfaces coincide: a luminaire so near to a surface lies on it and hides it.
const COINCIDING: f64 = 1e-9;

/// A scene compiled for tracing.
#[derive(Debug)]
pub struct TraceableScene {
    pub sky: Option<Sky>,
    pub sun: Option<Sun>,
    pub size: DVec3,
    /// By number; `None` is open.
    pub surfaces: Vec<Option<SurfaceOptics>>,
    pub boxes: Vec<TraceableBox>,
    pub meshes: Option<TraceableMeshes>,
    pub luminaires: Vec<TraceableLuminaire>,
    pub tubes: Vec<TraceableTube>,
    /// Whether reflected light is followed.
    pub interreflection: bool,
    /// Whether light that goes up into a guide is followed for its return.
    pub guide_return: bool,
    /// Whether anything but its faces is in the room.
    furnished: bool,
    /// Whether anything can stand between two points of the room; luminaires on its faces cannot.
    pub obstructed: bool,
    /// Whether anything can stand between a luminaire and a point before it.
    pub luminaires_obstructed: bool,
    /// Where that is.
    pub obstacles: Obstacles,
}

/// From this roughness on a ray in a direction of a lobe meets the sun's disc in less than one of a hundred cases.
const WIDE_ROUGHNESS: f64 = 0.15;

/// The optics of a surface.
#[derive(Clone, Debug)]
pub struct SurfaceOptics {
    /// Diffuse.
    pub reflectance: [f64; 3],
    pub specular: Option<SpecularOptics>,
}

impl SurfaceOptics {
    /// Whether any light is reflected diffusely, so that photons are worth gathering.
    #[inline]
    pub fn gathers(&self) -> bool {
        self.reflectance.iter().any(|reflectance| *reflectance > 0.0)
    }

    /// Whether photons are worth gathering for sunbeams in its lobe: a ray in a wide lobe finds the sun's disc rarely.
    #[inline]
    pub fn gathers_beams(&self) -> bool {
        self.specular.as_ref().is_some_and(|specular| specular.lobe.is_some() && specular.roughness >= WIDE_ROUGHNESS)
    }
}

/// Reflection about the mirror direction.
#[derive(Clone, Debug)]
pub struct SpecularOptics {
    pub reflectance: [f64; 3],
    pub roughness: f64,
    /// `None`: an ideal mirror.
    pub lobe: Option<Arc<Glossy>>,
}

impl SpecularOptics {
    /// Where light goes on that comes from `from`, a unit vector away from the surface; the weight is `reflectance`.
    #[inline]
    pub fn reflect(&self, normal: DVec3, from: DVec3, point: [f64; 2], random: &mut PathRandom) -> DVec3 {
        match &self.lobe {
            None => (normal * (2.0 * from.dot(normal)) - from).normalize(),
            Some(lobe) => lobe.sample(normal, from, point, random),
        }
    }
}

/// A box in its own frame: rotated about its base's centre.
#[derive(Debug)]
pub struct TraceableBox {
    base: DVec3,
    half: DVec2,
    height: f64,
    /// Room to box frame.
    turn: DMat2,
}

#[derive(Debug)]
pub struct TraceableTube {
    /// Centre of the opening, in the ceiling plane.
    pub origin: DVec3,
    pub opening_radius: f64,
    pub guide: Guide,
    /// What a mesh was found to be; `None` for tubes that are no meshes.
    pub section: Option<Section>,
    pub diffuser: Diffuser,
}

/// What a ray in the room meets.
#[derive(Clone, Copy, Debug)]
pub struct RoomHit {
    pub position: DVec3,
    /// Unit normal on the ray's side.
    pub normal: DVec3,
    pub place: Place,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    Surface(SurfaceId),
    /// The opening of a tube.
    Opening(usize),
}

impl TraceableScene {
    /// `objects` false leaves boxes and meshes out.
    pub fn new(scene: &Scene, interreflection: bool, guide_return: bool, objects: bool) -> Result<Self, TubeError> {
        let Room { size, surfaces, boxes, meshes, luminaires } = &scene.room;
        let (boxes, meshes): (&[BoxObject], &[MeshObject]) = if objects { (boxes, meshes) } else { (&[], &[]) };
        let mut lobes = Lobes::default();
        let mut optics: Vec<_> =
            surfaces.iter().map(|surface| surface.map(|surface| lobes.surface(&surface))).collect();
        for object in boxes {
            optics.extend(std::iter::repeat_n(Some(lobes.surface(&object.surface)), 6));
        }
        let mesh_objects = meshes;
        let meshes = TraceableMeshes::new(meshes, *size, optics.len() as SurfaceId).map(|(meshes, of_surfaces)| {
            optics.extend(of_surfaces.iter().map(|surface| Some(lobes.surface(surface))));
            meshes
        });
        let first = optics.len() as SurfaceId;
        let luminaires: Vec<_> =
            (first..).zip(luminaires).map(|(surface, luminaire)| TraceableLuminaire::new(luminaire, surface)).collect();
        let black = SurfaceOptics { reflectance: [0.0; 3], specular: None };
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
        let obstacles = Obstacles::new(&boxes, mesh_objects, &hanging);
        let hanging = !hanging.is_empty();
        Ok(Self {
            sky: scene.daylight.as_ref().and_then(|daylight| daylight.sky.clone()),
            sun: scene.daylight.as_ref().and_then(|daylight| daylight.sun),
            size: *size,
            surfaces: optics,
            furnished: objects || !luminaires.is_empty(),
            obstructed: objects || hanging,
            luminaires_obstructed: objects || (hanging && luminaires.len() > 1),
            boxes,
            obstacles,
            meshes,
            luminaires,
            tubes,
            interreflection,
            guide_return,
        })
    }

    /// The luminaire with this surface number.
    #[inline]
    pub fn luminaire(&self, surface: SurfaceId) -> Option<&TraceableLuminaire> {
        self.luminaires.get((surface as usize).checked_sub(self.surfaces.len() - self.luminaires.len())?)
    }

    /// Specular reflection where it is not left out.
    pub fn specular(&self) -> impl Iterator<Item = &SpecularOptics> {
        self.surfaces.iter().flatten().filter_map(|surface| surface.specular.as_ref())
    }

    /// Leaves specular reflection out: surfaces absorb its share.
    pub fn without_specular(mut self) -> Self {
        for surface in self.surfaces.iter_mut().flatten() {
            surface.specular = None;
        }
        self
    }

    /// The first thing that a ray from inside the room meets; `from`: the surface it leaves.
    #[inline]
    pub fn intersect(&self, origin: DVec3, direction: DVec3, from: SurfaceId) -> RoomHit {
        let (mut distance, mut axis) = (f64::INFINITY, 2);
        for k in 0..3 {
            // without branches: which wall a ray heads for is as random as the ray
            let wall = if direction[k] > 0.0 { self.size[k] } else { 0.0 };
            let to_wall = (wall - origin[k]) / direction[k];
            let nearer = direction[k] != 0.0 && to_wall < distance;
            (distance, axis) = if nearer { (to_wall, k) } else { (distance, axis) };
        }
        let distance = distance.max(0.0);
        if self.furnished
            && let Some(hit) = self.nearest_object(origin, direction, distance, from)
        {
            return hit;
        }
        let mut position = origin + direction * distance;
        let far = direction[axis] > 0.0;
        // on the plane exactly, so that the next ray starts on it
        position[axis] = if far { self.size[axis] } else { 0.0 };
        position = position.clamp(DVec3::ZERO, self.size);
        let mut normal = DVec3::ZERO;
        normal[axis] = if far { -1.0 } else { 1.0 };
        let face = 2 * axis + usize::from(far);
        let place = if face == Face::Ceiling as usize {
            self.opening_at(position.truncate()).map_or(Place::Surface(face as SurfaceId), Place::Opening)
        } else {
            Place::Surface(face as SurfaceId)
        };
        RoomHit { position, normal, place }
    }

    /// Whether nothing stands between two points of the room; the surfaces that they lie on do not count.
    #[inline]
    pub fn visible(&self, a: DVec3, from: SurfaceId, b: DVec3, to: SurfaceId) -> bool {
        if !self.obstructed {
            return true;
        }
        if self.meshes.as_ref().is_some_and(|meshes| meshes.blocks(a, b, 1.0 - ON_TARGET)) {
            return false;
        }
        let own = |surface: SurfaceId| (surface >= 6 && surface != NO_SURFACE).then(|| (surface as usize - 6) / 6);
        let (own_a, own_b) = (own(from), own(to));
        self.luminaires.iter().all(|luminaire| {
            luminaire.surface == from
                || luminaire.surface == to
                || luminaire
                    .intersect(a, b - a)
                    .is_none_or(|t| t >= 1.0 - ON_TARGET || t * (b - a).length() <= self.coinciding())
        }) && self.boxes.iter().enumerate().all(|(index, object)| {
            Some(index) == own_a
                || Some(index) == own_b
                || object.intersect(a, b - a).is_none_or(|(t, ..)| t >= 1.0 - ON_TARGET)
        })
    }

    fn opening_at(&self, point: DVec2) -> Option<usize> {
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

    fn nearest_object(&self, origin: DVec3, direction: DVec3, within: f64, from: SurfaceId) -> Option<RoomHit> {
        let mut hit = self.nearest_box(origin, direction, within, from);
        let mut within = hit.map_or(within, |hit| (hit.position - origin).dot(direction));
        // what coincides with a wall lies on it
        let on_mesh = self.meshes.as_ref().and_then(|meshes| meshes.intersect(origin, direction));
        if let Some(on_mesh) = on_mesh.filter(|hit| hit.distance <= within + self.coinciding()) {
            within = on_mesh.distance;
            let MeshHit { position, normal, surface, .. } = on_mesh;
            hit = Some(RoomHit { position, normal, place: Place::Surface(surface) });
        }
        if self.luminaires.is_empty() {
            return hit;
        }
        self.nearest_luminaire(origin, direction, within, from).or(hit)
    }

    /// The nearest luminaire; one that coincides with what is hit at distance `within` lies on it. Of two that lie back to
    /// back, the one that faces the ray.
    fn nearest_luminaire(&self, origin: DVec3, direction: DVec3, within: f64, from: SurfaceId) -> Option<RoomHit> {
        let near = self.coinciding();
        let mut nearest: Option<(f64, &TraceableLuminaire)> = None;
        for luminaire in self.luminaires.iter().filter(|luminaire| luminaire.surface != from) {
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

    fn nearest_box(&self, origin: DVec3, direction: DVec3, within: f64, from: SurfaceId) -> Option<RoomHit> {
        let mut nearest = None;
        let mut distance = within;
        for (index, object) in self.boxes.iter().enumerate() {
            let first = 6 + 6 * index as SurfaceId;
            // a box is convex: no ray that leaves it meets it again
            if (first..first + 6).contains(&from) {
                continue;
            }
            if let Some((t, face, normal)) = object.intersect(origin, direction)
                && t < distance
            {
                distance = t;
                let place = Place::Surface(first + face as SurfaceId);
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

/// One lobe per roughness: their tables take time and room.
#[derive(Default)]
struct Lobes(Vec<(f64, Arc<Glossy>)>);

impl Lobes {
    fn surface(&mut self, surface: &Surface) -> SurfaceOptics {
        let specular = surface.specular.map(|specular| SpecularOptics {
            reflectance: specular.reflectance,
            roughness: specular.roughness,
            lobe: (specular.roughness > 0.0).then(|| self.lobe(specular.roughness)),
        });
        SurfaceOptics { reflectance: surface.reflectance, specular }
    }

    fn lobe(&mut self, roughness: f64) -> Arc<Glossy> {
        if let Some((_, lobe)) = self.0.iter().find(|(of, _)| *of == roughness) {
            return lobe.clone();
        }
        let lobe = Arc::new(Glossy::new(roughness));
        self.0.push((roughness, lobe.clone()));
        lobe
    }
}

impl TraceableBox {
    fn new(object: &BoxObject) -> Self {
        Self {
            base: object.base,
            half: 0.5 * object.size.truncate(),
            height: object.size.z,
            // clockwise seen from above turns the box by -rotation in x-y
            turn: DMat2::from_angle(object.rotation),
        }
    }

    /// Where `origin + t direction` enters the box (t >= 0), the face and its outward normal.
    #[inline]
    fn intersect(&self, origin: DVec3, direction: DVec3) -> Option<(f64, usize, DVec3)> {
        let to_local = |v: DVec3| (self.turn * v.truncate()).extend(v.z);
        let (p, d) = (to_local(origin - self.base), to_local(direction));
        let low = DVec3::new(-self.half.x, -self.half.y, 0.0);
        let high = DVec3::new(self.half.x, self.half.y, self.height);
        let (mut enter, mut leave, mut axis) = (f64::NEG_INFINITY, f64::INFINITY, 0);
        for k in 0..3 {
            if d[k] == 0.0 {
                if p[k] <= low[k] || p[k] >= high[k] {
                    return None;
                }
                continue;
            }
            let (a, b) = ((low[k] - p[k]) / d[k], (high[k] - p[k]) / d[k]);
            let (near, far) = if a < b { (a, b) } else { (b, a) };
            if near > enter {
                (enter, axis) = (near, k);
            }
            leave = leave.min(far);
        }
        if enter < 0.0 || enter >= leave {
            return None;
        }
        let toward_high = d[axis] < 0.0;
        let mut normal = DVec3::ZERO;
        normal[axis] = if toward_high { 1.0 } else { -1.0 };
        let normal = (self.turn.transpose() * normal.truncate()).extend(normal.z);
        Some((enter, 2 * axis + usize::from(toward_high), normal))
    }

    /// The four corners of its outline seen from above, counter-clockwise.
    pub fn outline(&self) -> [DVec2; 4] {
        let back = self.turn.transpose();
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| self.base.truncate() + back * DVec2::new(x * self.half.x, y * self.half.y))
    }

    /// Whether a point is inside, or on the lower side: a box covers what it stands on.
    pub fn contains(&self, point: DVec3) -> bool {
        let local = self.turn * (point - self.base).truncate();
        let (low, high) = self.span();
        local.abs().cmplt(self.half).all() && point.z >= low && point.z < high
    }

    /// Distance in metres of a point outside to a side or the underside; infinite at and above the height of the top.
    pub fn distance_beside(&self, point: DVec3) -> f64 {
        let (low, high) = self.span();
        if point.z >= high {
            return f64::INFINITY;
        }
        let across = (self.turn * (point - self.base).truncate()).abs() - self.half;
        across.extend(low - point.z).max(DVec3::ZERO).length()
    }

    /// Lower and upper height in metres.
    pub fn span(&self) -> (f64, f64) {
        (self.base.z, self.base.z + self.height)
    }

    /// A corner, two edges that span the face, in the room frame; the face's number as in [`SurfaceId`].
    pub fn face(&self, face: usize) -> [DVec3; 3] {
        let back = self.turn.transpose();
        let world = |v: DVec3| (back * v.truncate()).extend(v.z);
        let low = DVec3::new(-self.half.x, -self.half.y, 0.0);
        let extent = DVec3::new(2.0 * self.half.x, 2.0 * self.half.y, self.height);
        let axis = face / 2;
        let mut corner = low;
        if face % 2 == 1 {
            corner[axis] += extent[axis];
        }
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let edge = |k: usize| world(DVec3::AXES[k] * extent[k]);
        [self.base + world(corner), edge(u), edge(v)]
    }
}

impl TraceableTube {
    fn new(tube: &Tube, ceiling: f64) -> Result<Self, MeshGuideError> {
        let guide = match &tube.shape {
            TubeShape::Cylinders(description) => cylinder_guide(description, tube.opening_radius),
            TubeShape::Mesh(description) => match &description.section {
                Section::Cylinder(cylinder) => Guide::Straight(StraightGuide {
                    radius: cylinder.radius,
                    length: cylinder.length,
                    reflectance: cylinder.reflectance.clone(),
                    collector_transmittance: cylinder.collector_transmittance,
                }),
                Section::Facets { .. } => Guide::Mesh(mesh(description, tube.opening_radius)?),
            },
        };
        let section = match &tube.shape {
            TubeShape::Cylinders(_) => None,
            TubeShape::Mesh(description) => Some(description.section.clone()),
        };
        Ok(Self {
            origin: tube.centre.extend(ceiling),
            opening_radius: tube.opening_radius,
            guide,
            section,
            diffuser: tube.diffuser.clone(),
        })
    }

    /// The closure at a point of the ceiling plane.
    #[inline]
    pub fn closure_at(&self, position: DVec3) -> Closure<'_> {
        self.diffuser.at((position - self.origin).truncate().length())
    }
}

/// Whether a luminaire lies in the plane of a face of the room, where it can stand between nothing.
fn lies_on_a_face(luminaire: &TraceableLuminaire, size: DVec3) -> bool {
    let corners = luminaire.corners();
    (0..3).any(|axis| {
        [0.0, size[axis]]
            .iter()
            .any(|plane| corners.iter().all(|corner| (corner[axis] - plane).abs() <= COINCIDING * size.length()))
    })
}

/// The guide of cylinders of `radius` in metres.
pub fn cylinder_guide(tube: &StraightOrBent, radius: f64) -> Guide {
    let pipe = pipe(tube, radius);
    if let Collector::DielectricDome { refractive_index, thickness_m, absorption_per_m } = tube.collector {
        return Guide::Domed(Box::new(DomedGuide::new(pipe, refractive_index, thickness_m, absorption_per_m)));
    }
    match pipe {
        Pipe::Straight(guide) => Guide::Straight(guide),
        Pipe::Bent(guide) => Guide::Bent(guide),
    }
}

fn pipe(tube: &StraightOrBent, radius: f64) -> Pipe {
    let reflectance = tube.reflectance.clone();
    let collector_transmittance = tube.collector.transmittance();
    if tube.segments.iter().all(|segment| segment.tilt == 0.0) {
        let length = tube.segments.iter().map(|segment| segment.length_m).sum();
        return Pipe::Straight(StraightGuide { radius, length, reflectance, collector_transmittance });
    }
    let axis = |tilt: f64, azimuth: f64| direction(std::f64::consts::FRAC_PI_2 - tilt, azimuth);
    let segments: Vec<_> =
        tube.segments.iter().map(|segment| (segment.length_m, axis(segment.tilt, segment.azimuth))).collect();
    Pipe::Bent(BentGuide::new(radius, &segments, reflectance, collector_transmittance))
}

fn mesh(tube: &MeshTube, opening_radius: f64) -> Result<MeshGuide, MeshGuideError> {
    let mut mesh = tube.mesh.as_ref().clone();
    let turn = DVec2::from_angle(-tube.rotation);
    for position in &mut mesh.positions {
        *position = turn.rotate(position.truncate()).extend(position.z);
    }
    MeshGuide::new(&mesh, &tube.parts, opening_radius)
}

/// A tube whose guide cannot be built.
#[derive(Clone, Debug, thiserror::Error)]
#[error("tube {tube}: {error}")]
pub struct TubeError {
    pub tube: usize,
    pub error: MeshGuideError,
}
