//! Next-event estimation: light that is connected to every vertex of a backward path, and found by its scattered rays too.
//!
//! At every vertex that scatters with a finite distribution the path is connected to each luminaire, in closed form or at a random point.
//! The scattered ray finds luminaires too: where there is no closed form the two share the light by the power heuristic (Veach and Guibas
//! 1995, beta = 2). Daylight depends on the method: [`Daylight`] computes the light that an opening sends to a vertex, and the weight of
//! the sky found by a ray that passes up a guide. Light of the room that a closure reflects, or that comes back down a guide, is found by
//! scattered rays alone.

use std::f64::consts::PI;

use glam::DVec3;

use super::clear_zones::through_clear_zones;
use super::meeting::{Meeting, Ray, Walk};
use super::opening::DaylightWeights;
use super::vertex::Vertex;
use crate::integrator::radiosity::{BrightPatches, Solution, Target};
use crate::optics::Spectrum;
use crate::traceable::luminaire::TraceableLuminaire;
use crate::traceable::{Openings, RoomHit, SurfaceId, SurfacePoint, TraceableScene};

/// Largest number of openings that a vertex is connected to one by one if their fluxes are not computed; otherwise it is connected to one
/// opening, chosen by its estimated contribution.
const MOST_OF_UNCOMPUTED: usize = 4;

/// Estimator of the daylight of openings, which each method chooses.
pub trait Daylight<const C: usize>: Sync {
    /// Adds the light that tube `tube` sends straight to a vertex before its opening, and that is scattered there toward the eye.
    fn connect(&self, walk: &mut Walk<'_, C>, vertex: &Vertex<'_, C>, tube: usize);

    /// True if this estimator counts the light that tube `tube` sends straight to a sensor; false where another one does.
    fn lights_sensor(&self, _tube: usize) -> bool {
        true
    }

    /// Returns the number of rays from a sensor, and the number of connections to each luminaire by another estimator, which share the
    /// light that luminaires send straight to the sensor; `None` where each path is connected to them.
    fn luminaires_at_sensor(&self) -> Option<[f64; 2]> {
        None
    }

    /// True if vertices without narrow lobes are connected to luminaires and openings by mirrors, too.
    fn counts_mirrors(&self) -> bool {
        false
    }

    /// Adds the light that openings send to a vertex by a chain of mirrors.
    fn connect_by_mirrors(&self, _walk: &mut Walk<'_, C>, _vertex: &Vertex<'_, C>, _chain: usize) {}

    /// True if vertices are connected to sky and sun through the clear zones of all closures; sensors have another estimator of these.
    fn counts_clear_zones(&self) -> bool {
        false
    }

    /// Returns the openings with the flux that each sends; `None` where the fluxes are not computed.
    fn openings(&self) -> Option<&Openings> {
        None
    }

    /// Returns the luminance in cd/m2 that a surface reflects diffusely at a point, by a coarse solution; `None` where there is none, and
    /// where the point's patch is too close to the `sensor` from which a ray comes.
    fn reflected(&self, _surface: SurfaceId, _point: DVec3, _sensor: Option<DVec3>) -> Option<Spectrum<C>> {
        None
    }

    /// Returns the coarse solution of the reflected light, at whose bright patches some rays are aimed; `None` where there is none.
    fn coarse_solution(&self) -> Option<&Solution<C>> {
        None
    }

    /// Returns the weight of the sky that is found by a ray through the opening of tube `tube` at `position` without a return to the
    /// opening; sky found after a return down the guide counts fully. `None`: neither counts.
    fn sky_weight(&self, scene: &TraceableScene, tube: usize, state: &PathState, position: DVec3) -> Option<f64>;
}

/// Next-event estimation of luminaires, and of openings by `Daylight`.
#[derive(Debug)]
pub struct NextEvent<'a, D>(pub &'a D);

/// State of a ray: the vertex from which it comes.
#[derive(Clone, Copy, Debug)]
pub struct PathState {
    /// Last vertex, if its connections count some of the light that the ray finds; `None` where there were none.
    pub last: Option<LastVertex>,
    /// True for a ray straight from the eye.
    pub from_eye: bool,
}

impl PathState {
    /// State of a ray straight from the eye.
    pub const FROM_EYE: Self = Self { last: None, from_eye: true };
    /// State of a ray after a vertex without connections.
    const UNCONNECTED: Self = Self { last: None, from_eye: false };
}

/// Connected vertex from which a ray comes.
#[derive(Clone, Copy, Debug)]
pub struct LastVertex {
    pub position: DVec3,
    /// Density of the ray's direction per sr, by the scattering distribution.
    pub density: f64,
    /// True if light straight from luminaires is counted there in closed form.
    closed_form: bool,
    /// True if the vertex has a lobe that connections rarely meet.
    pub narrow: bool,
    /// Chain of mirrors that has reflected the ray since this vertex.
    pub chain: Option<usize>,
    /// True if it is a sensor.
    pub is_sensor: bool,
    /// Choice of the ray's direction, and the fraction of rays that are aimed, where some are aimed at bright patches.
    aim: Option<(Aimed, f64)>,
}

/// Choice of a direction where some rays are aimed at bright patches and images.
#[derive(Clone, Copy, Debug)]
enum Aimed {
    /// Direction toward a point of this patch or image.
    At(Target),
    /// Direction drawn from the scattering distribution.
    Elsewhere,
}

impl<const C: usize, D: Daylight<C>> Meeting<C> for NextEvent<'_, D> {
    type Trace = PathState;
    type Arrival = ();

    #[inline]
    fn reflected(&self, ray: &Ray<C, PathState>, surface: SurfaceId, point: DVec3) -> Option<Spectrum<C>> {
        // what the eye sees straight shows the edges of patches
        if ray.trace.from_eye {
            return None;
        }
        let sensor = ray.trace.last.filter(|last| last.is_sensor).map(|last| last.position);
        self.0.reflected(surface, point, sensor)
    }

    #[inline]
    fn bright_patches(&self) -> Option<&BrightPatches> {
        self.0.coarse_solution()?.bright_patches()
    }

    fn is_aimed(&self, state: PathState, target: Option<Target>, fraction: f64) -> PathState {
        let aim = Some((target.map_or(Aimed::Elsewhere, Aimed::At), fraction));
        PathState { last: state.last.map(|last| LastVertex { aim, ..last }), ..state }
    }

    #[inline]
    fn aim_weight(&self, ray: &Ray<C, PathState>, surface: SurfaceId, hit: &RoomHit) -> f64 {
        let Some(LastVertex { aim: Some((aim, fraction)), position, density, .. }) = ray.trace.last else { return 1.0 };
        let Some(solution) = self.0.coarse_solution() else { return 1.0 };
        let aimed = solution.aimed_density(position, surface, hit);
        match aim {
            Aimed::At(target) if aimed <= 0.0 || !solution.shows(target, surface, hit.position) => 0.0,
            _ if aimed > 0.0 => {
                let scattered = density * (1.0 - fraction);
                scattered / (scattered + fraction * aimed)
            }
            _ => 1.0,
        }
    }

    fn arrives(&self, _: &PathState, _: f64) {}

    fn arrives_at_closure(&self) {}

    fn arrives_at_sensor(&self) {}

    fn connect(&self, walk: &mut Walk<'_, C>, vertex: &Vertex<'_, C>, (): &()) {
        let scene = walk.scene;
        if vertex.is_sensor() {
            for (index, tube) in scene.tubes.iter().enumerate() {
                if tube.frame.depth(vertex.position) > 0.0 && self.0.lights_sensor(index) {
                    self.0.connect(walk, vertex, index);
                }
            }
        } else {
            let computed = self.0.openings();
            let most = if computed.is_some() { 1 } else { MOST_OF_UNCOMPUTED };
            if scene.tubes.len() <= most {
                for (index, tube) in scene.tubes.iter().enumerate() {
                    if tube.frame.depth(vertex.position) > 0.0 {
                        self.0.connect(walk, vertex, index);
                    }
                }
            } else {
                let number = walk.samples.random.uniform();
                let openings = computed.unwrap_or(&scene.openings);
                if let Some((tube, probability)) = openings.choose(vertex.position, vertex.normal, number) {
                    let weight = vertex.weight * (1.0 / probability);
                    self.0.connect(walk, &Vertex { weight, ..*vertex }, tube);
                }
            }
            if self.0.counts_clear_zones() {
                connect_to_clear_zones(walk, vertex);
            }
        }
        if vertex.is_sensor() && self.0.luminaires_at_sensor().is_some() {
            return;
        }
        if self.0.counts_mirrors() && !vertex.is_narrow() {
            self.connect_by_mirrors(walk, vertex);
        }
        let lambertian = vertex.lambertian().filter(|_| !scene.luminaires_obstructed);
        for luminaire in scene.luminaires.iter().filter(|luminaire| luminaire.emits()) {
            if let Some(albedo) = lambertian {
                walk.sum += albedo * luminaire.irradiance(vertex.position, vertex.normal) * (1.0 / PI);
                continue;
            }
            let source = scene.enclosure.clamp(luminaire.point(walk.samples.pair()));
            let to_light = source - vertex.position;
            let connected = luminaire_density(luminaire, to_light);
            if connected > 0.0
                && let Some((response, density)) = walk.respond(vertex, source, Some(luminaire.surface))
            {
                walk.sum += response * luminaire.seen(to_light) * (power_heuristic(connected, density) / connected);
            }
        }
    }

    fn leaves(&self, scene: &TraceableScene, vertex: &Vertex<'_, C>, (): &(), _: DVec3, pdf: f64) -> PathState {
        let closed_form = !scene.luminaires_obstructed && vertex.lambertian().is_some();
        let (position, narrow, is_sensor) = (vertex.position, vertex.is_narrow(), vertex.is_sensor());
        let last = LastVertex { position, density: pdf, closed_form, narrow, chain: None, is_sensor, aim: None };
        PathState { last: Some(last), from_eye: false }
    }

    fn turns(&self, scene: &TraceableScene, state: &PathState, surface: SurfaceId) -> PathState {
        let connected = state.last.filter(|last| self.0.counts_mirrors() && !last.narrow);
        let turned = |last: LastVertex| {
            Some(LastVertex { chain: Some(scene.mirrors.next(last.chain, surface)?), aim: None, ..last })
        };
        connected
            .and_then(turned)
            .map_or(PathState::UNCONNECTED, |last| PathState { last: Some(last), from_eye: false })
    }

    fn passes(&self, _: &PathState) -> PathState {
        PathState::UNCONNECTED
    }

    fn luminaire_weight(&self, scene: &TraceableScene, number: usize, ray: &Ray<C, PathState>, position: DVec3) -> f64 {
        let luminaire = &scene.luminaires[number];
        match ray.trace.last {
            None => 1.0,
            Some(last) if last.closed_form && last.chain.is_none() => 0.0,
            Some(last) => {
                let at_sensor = self.0.luminaires_at_sensor().filter(|_| last.is_sensor);
                let (origin, usual) = match last.chain {
                    None => (last.position, 1.0),
                    Some(chain) => {
                        let (image, _) = scene.mirrors.image(chain, (last.position, DVec3::ZERO));
                        (image, scene.mirrors.probability(chain, last.position))
                    }
                };
                let of_chain = |[rays, most]: [f64; 2]| match last.chain {
                    None => [rays, most],
                    Some(chain) => [rays, scene.mirrors.connections(chain, most)],
                };
                let [rays, connections] = at_sensor.map_or([1.0, usual], of_chain);
                power_heuristic(rays * last.density, connections * luminaire_density(luminaire, position - origin))
            }
        }
    }

    fn meets_opening(
        &self,
        walk: &mut Walk<'_, C>,
        tube: usize,
        ray: &Ray<C, PathState>,
        position: DVec3,
    ) -> Option<DaylightWeights> {
        Some(match self.0.sky_weight(walk.scene, tube, &ray.trace, position) {
            None => DaylightWeights::NONE,
            Some(sky) => DaylightWeights { sky, sky_later: 1.0, sun: 0.0 },
        })
    }
}

impl<D> NextEvent<'_, D> {
    /// Connects a vertex to openings and luminaires by one randomly chosen chain of mirrors.
    fn connect_by_mirrors<const C: usize>(&self, walk: &mut Walk<'_, C>, vertex: &Vertex<'_, C>)
    where
        D: Daylight<C>,
    {
        let scene = walk.scene;
        if scene.mirrors.is_empty() {
            return;
        }
        let number = walk.samples.random.uniform();
        let Some((chain, probability)) = scene.mirrors.choose(vertex.position, number) else { return };
        self.0.connect_by_mirrors(walk, &Vertex { weight: vertex.weight * (1.0 / probability), ..*vertex }, chain);
        for luminaire in scene.luminaires.iter().filter(|luminaire| luminaire.emits()) {
            let source = scene.enclosure.clamp(luminaire.point(walk.samples.random.uniform2()));
            let place = (vertex.position, vertex.surface);
            let Some(path) = scene.mirror_path::<C>((&scene.mirrors, chain), place, (source, Some(luminaire.surface)))
            else {
                continue;
            };
            walk.rays += path.rays;
            let connected = probability * luminaire_density(luminaire, path.unfolded);
            if connected > 0.0 {
                let (response, density) = vertex.response(path.toward);
                let found = response * path.reflectance * luminaire.seen(path.unfolded);
                walk.sum += found * (power_heuristic(connected, density) / connected);
            }
        }
    }
}

/// Adds the light that comes straight through clear zones to a vertex.
fn connect_to_clear_zones<const C: usize>(walk: &mut Walk<'_, C>, vertex: &Vertex<'_, C>) {
    let Vertex { position, normal, surface, .. } = *vertex;
    let at = SurfacePoint { position, normal, surface };
    let numbers = (walk.samples.pair(), &mut walk.samples.random);
    walk.sum += through_clear_zones(walk.scene, at, |toward| vertex.response(toward).0, numbers, &mut walk.rays);
}

/// Returns the density per sr of a connection to a uniform random point of a luminaire along `to_light`; zero from behind it.
pub fn luminaire_density(luminaire: &TraceableLuminaire, to_light: DVec3) -> f64 {
    let cosine = -to_light.dot(luminaire.normal);
    let distance_squared = to_light.length_squared();
    if cosine > 0.0 { distance_squared * distance_squared.sqrt() / (cosine * luminaire.area_m2) } else { 0.0 }
}

/// Returns the weight of light that was found with `density`, and could have been found with density `other`: the power heuristic.
pub fn power_heuristic(density: f64, other: f64) -> f64 {
    if other == 0.0 { 1.0 } else { 1.0 / (1.0 + (other / density).powi(2)) }
}
