//! A scene compiled for tracing.

use std::sync::{Arc, OnceLock};

use super::box_bounds::BoxBounds;
use super::box_object::TraceableBox;
use super::enclosure::TraceableEnclosure;
use super::luminaire::TraceableLuminaire;
use super::mesh_objects::TraceableMeshes;
use super::mirrors::Mirrors;
use super::obstacles::Obstacles;
use super::openings::Openings;
use super::source::Source;
use super::surface_id::{Numbering, RoomObject, SurfaceId};
use super::tube::{TraceableTube, TubeError};
use crate::optics::SurfaceOptics;
use crate::optics::reflection::Lobes;
use crate::scene::{BoxObject, MeshObject, Room, Scene};
use crate::sky::sampler::SkyTable;
use crate::sky::{Sky, Sun};

/// Fraction of the room's scale within which surfaces coincide: a luminaire so near to a surface lies on it and hides it.
const COINCIDING: f64 = 1e-9;

/// A scene compiled for tracing.
#[derive(Clone, Debug)]
pub struct TraceableScene {
    /// Table of the open sky's luminances at points, computed on first use.
    pub(super) sky_table: Arc<OnceLock<Arc<SkyTable>>>,
    /// The faces of the room.
    pub enclosure: TraceableEnclosure,
    /// Optics of the surfaces by number, each material once; `None` where the room is open.
    pub(super) surfaces: Vec<Option<Arc<SurfaceOptics>>>,
    /// Layout of surface numbers: where those of boxes, facets and luminaires begin.
    pub numbering: Numbering,
    /// Boxes in their own frames, in the scene's order.
    pub boxes: Vec<TraceableBox>,
    /// Bounding volumes against which rays are tested before the boxes themselves.
    pub(super) box_bounds: BoxBounds,
    /// Triangles of all mesh objects together; `None` without any.
    pub meshes: Option<Arc<TraceableMeshes>>,
    /// Luminaires, in the scene's order.
    pub luminaires: Vec<TraceableLuminaire>,
    /// Tubes, in the scene's order.
    pub tubes: Vec<TraceableTube>,
    /// True if an opening hangs below its face.
    pub(super) openings_hang: bool,
    /// Numbers of the faces that have openings.
    pub(super) faces_with_openings: Vec<usize>,
    /// Openings of the tubes, weighted by area, of which one is chosen for a connection.
    pub openings: Openings,
    /// Plane mirrors and their chains; empty where interreflection is not followed.
    pub mirrors: Mirrors,
    /// True if interreflection is followed.
    pub interreflection: bool,
    /// True if light that enters a guide from the room is followed for its return.
    pub guide_return: bool,
    /// True if the room holds anything but its faces: objects, luminaires, or openings that hang.
    pub(super) furnished: bool,
    /// True if anything can stand between two points of the room, its own faces among them; luminaires on its faces cannot.
    pub obstructed: bool,
    /// True if anything can stand between a luminaire and a point before it.
    pub luminaires_obstructed: bool,
    /// Bounding volumes of everything that can occlude an opening.
    pub(super) obstacles: Obstacles,
}

/// Parts of light transport that are followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Follow {
    /// Light that surfaces of the room reflect (interreflection).
    pub interreflection: bool,
    /// Light that enters a guide from the room, for its return.
    pub guide_return: bool,
    /// Light that boxes and meshes occlude and reflect; if false, they are left out of the scene.
    pub objects: bool,
}

impl TraceableScene {
    /// Replaces sky and sun of all tubes, and forgets the table of the sky before.
    pub fn set_daylight(&mut self, sky: Option<Sky>, sun: Option<Sun>) {
        self.tubes.iter_mut().for_each(|tube| (tube.sky, tube.sun) = (sky.clone(), sun));
        self.sky_table = Arc::default();
    }

    /// True if light of the sky or of surroundings is followed through a tube.
    pub fn has_sky(&self) -> bool {
        self.tubes.iter().any(|tube| tube.sky.is_some())
    }

    /// True if the sun's beam is followed through a tube.
    pub fn has_sun(&self) -> bool {
        self.tubes.iter().any(|tube| tube.sun.is_some())
    }

    /// Returns the table of the open sky's luminances, computed on first use; `None` if the sky's light is not followed.
    pub fn sky_table(&self) -> Option<Arc<SkyTable>> {
        let sky = self.tubes.iter().find_map(|tube| tube.sky.as_ref())?;
        Some(self.sky_table.get_or_init(|| Arc::new(SkyTable::new(sky))).clone())
    }

    /// Compiles a scene: builds guides and numbers surfaces. Fails where a mesh tube forms no guide.
    pub fn new(scene: &Scene, follow: Follow) -> Result<Self, TubeError> {
        let Follow { interreflection, guide_return, objects } = follow;
        let Room { enclosure, luminaires, .. } = &scene.room;
        let scale = enclosure.scale_m();
        let (boxes, meshes): (&[BoxObject], &[MeshObject]) = match objects {
            true => (&scene.room.boxes, &scene.room.meshes),
            false => (&[], &[]),
        };
        let mut lobes = Lobes::default();
        let mut optics: Vec<_> = enclosure
            .faces()
            .iter()
            .map(|face| face.surface.map(|surface| Arc::new(lobes.compile(&surface))))
            .collect();
        for object in boxes {
            optics.extend(std::iter::repeat_n(Some(Arc::new(lobes.compile(&object.surface))), 6));
        }
        let mesh_objects = meshes;
        let meshes = TraceableMeshes::new(meshes, scale).map(|(meshes, of_facets)| {
            let materials = mesh_objects.iter().flat_map(|object| &object.surfaces);
            let materials: Vec<_> = materials.map(|surface| Arc::new(lobes.compile(surface))).collect();
            optics.extend(of_facets.iter().flatten().map(|side| Some(materials[*side as usize].clone())));
            Arc::new(meshes)
        });
        let facets = meshes.as_ref().map_or(0, |meshes| meshes.facet_count());
        let faces = enclosure.faces().len();
        let numbering =
            Numbering { faces, boxes: boxes.len(), facets, luminaires: luminaires.len(), tubes: scene.tubes.len() };
        let luminaires: Vec<_> = luminaires
            .iter()
            .enumerate()
            .map(|(index, luminaire)| TraceableLuminaire::new(luminaire, numbering.luminaire(index)))
            .collect();
        let black = Arc::new(SurfaceOptics::BLACK);
        // luminaires, and openings that hang, from above
        optics.extend(std::iter::repeat_n(Some(black), luminaires.len() + 1));
        optics.extend(scene.tubes.iter().map(|tube| tube.diffuser.lower_side().map(Arc::new)));
        let tubes = scene
            .tubes
            .iter()
            .enumerate()
            .map(|(tube, description)| {
                TraceableTube::new(description, enclosure, scene.daylight.as_ref())
                    .map_err(|error| TubeError { tube, error })
            })
            .collect::<Result<_, _>>()?;
        let objects = !boxes.is_empty() || meshes.is_some();
        let enclosure = TraceableEnclosure::new(enclosure);
        let near = COINCIDING * scale;
        let on_a_face = |luminaire: &TraceableLuminaire| enclosure.is_on_a_face(&luminaire.corners(), near);
        // on a face, a luminaire can stand between nothing
        let hanging: Vec<_> = luminaires.iter().copied().filter(|luminaire| !on_a_face(luminaire)).collect();
        let boxes: Vec<_> = boxes.iter().map(TraceableBox::new).collect();
        let tubes: Vec<TraceableTube> = tubes;
        let obstacles = Obstacles::new(&boxes, mesh_objects, &hanging, &enclosure, &tubes);
        let openings = Openings::by_area(&tubes);
        let box_bounds = BoxBounds::new(&boxes.iter().map(TraceableBox::bounds).collect::<Vec<_>>(), scale);
        let hanging = !hanging.is_empty();
        let openings_hang = tubes.iter().any(|tube| tube.hangs);
        let in_between = objects || openings_hang || !enclosure.is_convex();
        let mut faces_with_openings: Vec<usize> =
            tubes.iter().filter(|tube| !tube.hangs).map(|tube| tube.face).collect();
        faces_with_openings.sort_unstable();
        faces_with_openings.dedup();
        let mirrors = match interreflection {
            true => Mirrors::new(&enclosure, &boxes, numbering, &optics, SurfaceOptics::is_mirror),
            false => Mirrors::default(),
        };
        Ok(Self {
            sky_table: Arc::default(),
            surfaces: optics,
            numbering,
            furnished: objects || openings_hang || !luminaires.is_empty(),
            obstructed: in_between || hanging,
            luminaires_obstructed: in_between || (hanging && luminaires.len() > 1),
            enclosure,
            openings_hang,
            faces_with_openings,
            boxes,
            box_bounds,
            obstacles,
            meshes,
            luminaires,
            tubes,
            openings,
            mirrors,
            interreflection,
            guide_return,
        })
    }

    /// Returns the optics of a surface; `None` where the room is open, and of closures that do not reflect diffusely and everywhere alike.
    #[inline]
    pub fn optics(&self, surface: SurfaceId) -> Option<&SurfaceOptics> {
        self.surfaces[surface.index()].as_deref()
    }

    /// Returns the number of all surfaces, open ones included.
    pub fn surfaces_count(&self) -> usize {
        self.surfaces.len()
    }

    /// Lists the optics of all surfaces that are not open, but not those of closures.
    pub fn all_optics(&self) -> impl Iterator<Item = &SurfaceOptics> {
        self.surfaces[..self.numbering.closure(0).index()].iter().flatten().map(Arc::as_ref)
    }

    /// Returns the object that has this surface.
    pub fn object_of(&self, surface: SurfaceId) -> Option<RoomObject> {
        let of_box = self.numbering.box_of(surface).map(RoomObject::Box);
        of_box.or_else(|| Some(RoomObject::Mesh(self.meshes.as_ref()?.object_of(self.numbering.facet_of(surface)?))))
    }

    /// Returns the luminaire with this surface number.
    #[inline]
    pub fn luminaire(&self, surface: SurfaceId) -> Option<&TraceableLuminaire> {
        self.luminaires.get(self.numbering.luminaire_of(surface)?)
    }

    /// Lists the sources that give light.
    pub fn sources(&self) -> impl Iterator<Item = Source> {
        Source::ALL.into_iter().filter(|source| match source {
            Source::Sky => self.has_sky(),
            Source::Sun => self.has_sun(),
            Source::Luminaires => self.luminaires.iter().any(TraceableLuminaire::emits),
        })
    }

    /// Returns a copy of the scene in which `source` alone gives light, and daylight enters by the collector of `tube` alone, or by all
    /// for `None`.
    pub fn lit_by(&self, source: Source, tube: Option<usize>) -> Self {
        let mut scene = self.clone();
        if source != Source::Luminaires {
            scene.luminaires.iter_mut().for_each(|luminaire| luminaire.luminance = [0.0; 3]);
        }
        for (number, other) in scene.tubes.iter_mut().enumerate() {
            let is_lit = tube.is_none_or(|tube| tube == number);
            other.sky = other.sky.take().filter(|_| is_lit && source == Source::Sky);
            other.sun = other.sun.filter(|_| is_lit && source == Source::Sun);
        }
        scene
    }

    /// Returns a copy of the scene without interreflection.
    pub fn without_interreflection(&self) -> Self {
        Self { interreflection: false, mirrors: Mirrors::default(), ..self.clone() }
    }

    /// True if no light can come into the room: no tube lets any pass, and no luminaire emits.
    pub fn is_dark(&self) -> bool {
        self.tubes.iter().all(|tube| tube.diffuser.is_opaque())
            && !self.luminaires.iter().any(TraceableLuminaire::emits)
    }

    /// Finds the plane mirrors, and the planes with a narrow lobe as if they were mirrors.
    pub fn mirrors_and_narrow_lobes(&self) -> Mirrors {
        Mirrors::new(&self.enclosure, &self.boxes, self.numbering, &self.surfaces, SurfaceOptics::is_narrow)
    }

    /// Lists the surfaces that reflect specularly; none after [`Self::without_specular`].
    pub fn specular_surfaces(&self) -> impl Iterator<Item = &SurfaceOptics> {
        self.all_optics().filter(|surface| surface.is_specular())
    }

    /// Leaves specular reflection out: surfaces absorb the specular part.
    pub fn without_specular(mut self) -> Self {
        for surface in self.surfaces.iter_mut().flatten().filter(|surface| surface.is_specular()) {
            *surface = Arc::new(SurfaceOptics::clone(surface).without_specular());
        }
        self.mirrors = Mirrors::default();
        self
    }

    /// True if no object stands in the room, and its faces are diffuse.
    pub fn is_bare(&self) -> bool {
        self.boxes.is_empty() && self.meshes.is_none() && self.specular_surfaces().next().is_none()
    }

    /// Returns the height in m above a plane within which a segment that ends there has reached it: hits on a mesh lie slightly before
    /// it, and a grid may lie on the mesh.
    pub fn contact(&self) -> f64 {
        self.meshes.as_ref().map_or(0.0, |meshes| 2.0 * meshes.clearance)
    }

    /// Returns the distance in m within which surfaces coincide.
    pub fn coinciding(&self) -> f64 {
        COINCIDING * self.enclosure.scale_m()
    }
}
