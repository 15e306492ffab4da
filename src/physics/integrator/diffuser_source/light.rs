//! Light that Lambertian diffusers send into the room: stage one of two.
//!
//! Photons go from sky and sun down each guide to its closure. A Lambertian closure forgets where they came from: the points where they
//! leave, with their fluxes, are all that the room sees of the sky. A vertex that sees all of an opening is connected to one photon, chosen by
//! its flux. Where something may stand between, where the vertex' own horizon cuts the opening, or where it has a lobe, it is connected to two.
//! Connections to points that are very near have too much variance: there the path follows the light itself, as in path tracing.

use std::f64::consts::PI;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use glam::{DVec2, DVec3};

use super::cells::{Emitted, TubeLight};
use super::opening_visibility::{OpeningVisibility, opening_visibility};
use super::room_balance::{self, Unscattered};
use crate::integrator::backward::daylight::ScatteredDaylight;
use crate::integrator::backward::meeting::Walk;
use crate::integrator::backward::next_event::{Daylight, PathState};
use crate::integrator::backward::vertex::Vertex;
use crate::integrator::photon::chunks::{Chunks, Tally, fold_chunks};
use crate::integrator::photon::descent::{Entering, Exit, descend};
use crate::integrator::photon::emission::{Emission, EmittedPhoton, Start};
use crate::integrator::photon::energy_balance::PhotonTotals;
use crate::integrator::radiosity::Solution;
use crate::optics::Spectrum;
use crate::sampling::{Key, PathRandom, PathSamples, Replicate, Stream};
use crate::scene::Sensor;
use crate::traceable::{MirrorPath, Openings, SurfaceId, TraceableScene, TraceableTube};

/// Number of photons that a vertex is connected to where it may not see all of an opening, or has a lobe.
const CONNECTIONS: usize = 2;

/// Smallest flux by which an opening is chosen, as a fraction of the brightest one's.
const LEAST_POWER: f64 = 1e-3;

/// Light that leaves the closures, for some of a pass' photons.
pub struct EmittedSums<const C: usize> {
    /// Photons that leave each tube's closure as from a Lambertian surface; where all light is asked for, the others too.
    pub photons: Vec<Vec<Emitted<C>>>,
    /// Photons that pass clear zones.
    pub unscattered: Vec<Unscattered<C>>,
    /// Fluxes of the tubes, and the energy balance of all but the light that enters the room.
    pub totals: PhotonTotals,
}

impl<const C: usize> EmittedSums<C> {
    fn new(tubes: usize) -> Self {
        Self { photons: vec![Vec::new(); tubes], unscattered: Vec::new(), totals: PhotonTotals::new(tubes) }
    }
}

impl<const C: usize> Tally for EmittedSums<C> {
    fn is_finite(&self) -> bool {
        let is_finite = |photon: &Emitted<C>| photon.position.is_finite() && photon.flux.is_finite();
        let passed = |photon: &Unscattered<C>| photon.flux.is_finite();
        self.photons.iter().flatten().all(is_finite) && self.unscattered.iter().all(passed) && self.totals.is_finite()
    }
}

/// Part of the light that leaves a closure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EmittedPart {
    /// All light that leaves.
    All,
    /// Light that leaves as from a Lambertian surface.
    Evenly,
}

/// Computes the light that leaves the closures in one pass, all or a part of it as [`EmittedSums::photons`]; `None` when cancelled.
pub fn emitted<const C: usize>(
    scene: &TraceableScene,
    emission: &Emission,
    pass: Key,
    part: EmittedPart,
    cancel: &AtomicBool,
) -> Option<EmittedSums<C>> {
    let chunk = |numbers: Range<u64>| {
        let mut sums = EmittedSums::new(scene.tubes.len());
        for number in numbers {
            if let (Some(EmittedPhoton { start: Start::Tube(tube), position, direction, flux, .. }), mut samples) =
                emission.photon(scene, pass, number)
            {
                add_emitted((scene, part, tube), Entering { position, direction, flux }, &mut samples, &mut sums);
            }
        }
        sums
    };
    let mut all = EmittedSums::new(scene.tubes.len());
    let chunks = Chunks::of_short_paths(emission.photons());
    let folded = fold_chunks(chunks, 0, cancel, chunk, |of_chunk: EmittedSums<C>| {
        all.totals.add(&of_chunk.totals);
        all.photons.iter_mut().zip(of_chunk.photons).for_each(|(all, photons)| all.extend(photons));
        all.unscattered.extend(of_chunk.unscattered);
    })?;
    all.totals.not_finite = folded.not_finite;
    Some(all)
}

/// Adds the light that a photon sends from the closure of the tube with number `tube` to the sums.
fn add_emitted<const C: usize>(
    (scene, part, tube): (&TraceableScene, EmittedPart, usize),
    entering: Entering,
    samples: &mut PathSamples,
    sums: &mut EmittedSums<C>,
) {
    let PhotonTotals { tubes: fluxes, rays, energy, .. } = &mut sums.totals;
    let (of_tube, emitted, fluxes) = (&scene.tubes[tube], &mut sums.photons[tube], &mut fluxes[tube]);
    let (mut into_room, mut evenly) = (0.0, 0.0);
    let at_diffuser = |exit: &Exit<'_, C>| {
        let through = exit.into_room();
        into_room += through.luminance();
        evenly += exit.evenly().luminance();
        if part == EmittedPart::Evenly && exit.closure.unscattered::<C>().is_some() {
            let (position, direction) = (exit.position, -exit.from);
            sums.unscattered.push(Unscattered { position, direction, flux: through });
            return;
        }
        let flux = if part == EmittedPart::All { through } else { exit.evenly() };
        emitted.push(Emitted::new(exit.position, flux, &of_tube.frame));
    };
    let descent = descend(scene, of_tube, entering, samples, (rays, energy), at_diffuser);
    fluxes.into_room += into_room;
    fluxes.evenly += evenly;
    fluxes.at_collector += descent.entered.luminance();
    fluxes.at_diffuser += descent.arrived.luminance();
}

/// Light that leaves the diffusers in one pass.
#[derive(Debug)]
pub struct DiffuserLight<const C: usize> {
    tubes: Vec<TubeLight<C>>,
    openings: Openings,
    /// True if vertices are connected to the light through clear zones, too.
    with_clear_zones: bool,
    /// Coarse solution of the reflected light, and the factor by which this light exceeds that of the solution.
    reflected: Option<(Arc<Solution<C>>, f64)>,
}

impl<const C: usize> DiffuserLight<C> {
    /// Computes the Lambertian light of one pass, with the fluxes of the tubes and the whole energy balance; `None` when cancelled. The
    /// rest passes clear zones.
    pub fn trace(
        scene: &TraceableScene,
        emission: &Emission,
        pass: Key,
        cancel: &AtomicBool,
    ) -> Option<(Self, PhotonTotals)> {
        let EmittedSums { photons, unscattered, mut totals } =
            emitted(scene, emission, pass, EmittedPart::Evenly, cancel)?;
        room_balance::add_room_balance(scene, (&photons, &unscattered), pass, &mut totals);
        Some((Self::of(scene, photons, pass), totals))
    }

    /// Makes the light of one pass from the photons that leave each closure evenly.
    pub fn of(scene: &TraceableScene, all: Vec<Vec<Emitted<C>>>, pass: Key) -> Self {
        let light = |(index, (tube, photons)): (usize, (&TraceableTube, Vec<Emitted<C>>))| {
            TubeLight::new(tube, photons, PathRandom::new(pass.stream(Stream::DiffuserChoice, index as u64)).uniform())
        };
        let tubes: Vec<TubeLight<C>> = scene.tubes.iter().zip(all).enumerate().map(light).collect();
        // a tube from which no photon came may send light all the same
        let fluxes: Vec<f64> = tubes.iter().map(|tube| tube.flux().luminance()).collect();
        let least = LEAST_POWER * fluxes.iter().copied().fold(0.0, f64::max);
        let openings = Openings::new(&scene.tubes, fluxes.into_iter().map(|flux| flux.max(least)));
        Self { tubes, openings, with_clear_zones: false, reflected: None }
    }

    /// Returns the flux that leaves each opening, in lm.
    pub fn fluxes(&self) -> Vec<Spectrum<C>> {
        self.tubes.iter().map(TubeLight::flux).collect()
    }

    /// Returns the flux in lm of the light that leaves each opening, and its centroid in m from the centre.
    pub fn fluxes_with_centroids(&self) -> Vec<(Spectrum<C>, DVec2)> {
        self.tubes.iter().map(|tube| (tube.flux(), tube.centroid())).collect()
    }

    /// Connects vertices to the light through clear zones, too.
    pub fn with_clear_zones(self) -> Self {
        Self { with_clear_zones: true, ..self }
    }

    /// Adds a coarse solution of the reflected light, computed for light with about the same distribution among the tubes.
    pub fn reflected_by(mut self, solution: &Arc<Solution<C>>) -> Self {
        let all: f64 = self.tubes.iter().map(|tube| tube.flux().luminance()).sum();
        self.reflected = Some((solution.clone(), solution.times(all)));
        self
    }

    /// Returns the light of each tube, in the order of the scene.
    pub fn tubes(&self) -> &[TubeLight<C>] {
        &self.tubes
    }

    /// Draws an offset in m within a cell of `size` for every photon of every tube, for [`Self::at_sensor`]; the same for all cells.
    pub fn offsets(&self, size: [f64; 2], stream: Key) -> Vec<Vec<DVec2>> {
        let offset = |stream: Key, number: usize| {
            let (replicate, index) = Replicate::of(stream, number as u64);
            let [u, v, ..] = replicate.point(index, 0);
            DVec2::new((u - 0.5) * size[0], (v - 0.5) * size[1])
        };
        let of_tube = |(index, tube): (usize, &TubeLight<C>)| {
            let stream = stream.stream(Stream::CellOffsets, index as u64);
            (0..tube.photons.len()).map(|number| offset(stream, number)).collect()
        };
        self.tubes.iter().enumerate().map(of_tube).collect()
    }

    /// Returns the illuminance in lx of a sensor from which nothing hides a tube's diffuser: every photon is connected to it, or to the
    /// point of a level cell given by its offset. The light of a square at a point has a closed form.
    pub fn at_sensor(&self, tube: usize, Sensor { position, normal }: Sensor, offsets: Option<&[Vec<DVec2>]>) -> f64 {
        let light = &self.tubes[tube];
        let depth = light.frame.depth(position);
        if depth <= 0.0 {
            return 0.0;
        }
        if let (None, Some(lux)) = (offsets, light.of_square(position, normal)) {
            return lux.luminance();
        }
        if normal != DVec3::Z || !light.frame.is_level() {
            let of = |(number, photon): (usize, &Emitted<C>)| {
                let offset = offsets.map_or(DVec2::ZERO, |offsets| offsets[tube][number]);
                photon.flux.luminance() * light.per_lumen(photon, position + offset.extend(0.0), normal).max(0.0)
            };
            return light.photons.iter().enumerate().map(of).sum();
        }
        let mut sum = 0.0;
        for (number, photon) in light.photons.iter().enumerate() {
            let mut away = photon.position - position.truncate();
            if let Some(offsets) = offsets {
                away -= offsets[tube][number];
            }
            let distance_squared = away.length_squared() + depth * depth;
            sum += photon.flux.luminance() / (distance_squared * distance_squared);
        }
        sum * depth * depth / PI
    }

    /// Returns the position of a photon that represents all of a tube's, and the illuminance in lx of a sensor that sees it; `number` in
    /// 0..1 chooses it. `None` for sensors behind the opening's plane, and without light.
    pub fn of_photon(&self, tube: usize, Sensor { position, normal }: Sensor, number: f64) -> Option<(DVec3, f64)> {
        let light = &self.tubes[tube];
        let photon = light.choice(number)?;
        let lux = photon.flux.luminance() * light.per_lumen(photon, position, normal).max(0.0);
        (light.frame.depth(position) > 0.0).then(|| (photon.in_room(&light.frame), lux))
    }

    /// Finds a path from a place, with its normal and surface, by a chain of mirrors to a photon that represents those of all openings, and
    /// its contribution: for a response of one per sr, in lm/sr/m2. Two numbers in 0..1 choose; `None` where the mirrors do not show it.
    pub fn by_mirrors(
        &self,
        scene: &TraceableScene,
        chain: usize,
        (position, normal, surface): (DVec3, DVec3, Option<SurfaceId>),
        [opening, photon]: [f64; 2],
    ) -> Option<(MirrorPath<C>, Spectrum<C>)> {
        let (image, turned) = scene.mirrors.image(chain, (position, normal));
        let (tube, probability) = self.openings.choose(image, turned, opening)?;
        let light = &self.tubes[tube];
        let photon = light.choice(photon)?;
        let source = photon.in_room(&light.frame);
        let path = scene.mirror_path((&scene.mirrors, chain), (position, surface), (source, None))?;
        let squared = path.unfolded.length_squared();
        let per_area = light.frame.up(path.unfolded).max(0.0) / (PI * squared * squared.sqrt());
        Some((path, photon.flux * path.reflectance * (per_area / probability)))
    }
}

/// Number of connections of a vertex very near to an opening, where few paths carry much light.
const CONNECTIONS_BESIDE: u32 = 8;

/// Distance of points of an opening, in its radii, within which a vertex of a surface follows the light instead of being connected to
/// photons.
const FOLLOWED: f64 = 0.25;

/// Estimator that follows the light of a whole opening: for narrow lobes, and for sensors, whose paths share it.
const FOLLOWED_WHOLE: ScatteredDaylight = ScatteredDaylight { connections: 1, within: f64::INFINITY };

impl<const C: usize> TubeLight<C> {
    /// Returns the estimator that follows the light of points of the opening very near to a vertex.
    fn followed(&self) -> ScatteredDaylight {
        ScatteredDaylight { connections: CONNECTIONS_BESIDE, within: FOLLOWED * self.radius }
    }
}

impl<const C: usize> Daylight<C> for DiffuserLight<C> {
    #[inline]
    fn coarse_solution(&self) -> Option<&Solution<C>> {
        self.reflected.as_ref().map(|(solution, _)| &**solution)
    }

    fn counts_clear_zones(&self) -> bool {
        self.with_clear_zones
    }

    fn counts_mirrors(&self) -> bool {
        true
    }

    fn connect_by_mirrors(&self, walk: &mut Walk<'_, C>, vertex: &Vertex<'_, C>, chain: usize) {
        let numbers = walk.samples.random.uniform2();
        let place = (vertex.position, vertex.normal, vertex.surface);
        if let Some((path, light)) = self.by_mirrors(walk.scene, chain, place, numbers) {
            walk.rays += path.rays;
            let (response, _) = vertex.response(path.toward);
            walk.sum += response * light;
        }
    }

    fn openings(&self) -> Option<&Openings> {
        Some(&self.openings)
    }

    #[inline]
    fn reflected(&self, surface: SurfaceId, point: DVec3, sensor: Option<DVec3>) -> Option<Spectrum<C>> {
        let (solution, times) = self.reflected.as_ref()?;
        Some(solution.luminance(surface, point, sensor)? * *times)
    }

    fn connect(&self, walk: &mut Walk<'_, C>, vertex: &Vertex<'_, C>, tube: usize) {
        let light = &self.tubes[tube];
        match opening_visibility(walk.scene, vertex, &light.frame, light.radius) {
            OpeningVisibility::ByRays => return FOLLOWED_WHOLE.connect(walk, vertex, tube),
            OpeningVisibility::Never => return,
            OpeningVisibility::Whole(albedo) => {
                if let Some(photon) = light.choice(walk.samples.random.uniform()) {
                    let per_lumen = light.per_lumen(photon, vertex.position, vertex.normal);
                    walk.sum += albedo * photon.flux * (per_lumen / PI);
                }
                return;
            }
            OpeningVisibility::InPart => {}
        }
        let followed = light.followed();
        Daylight::<C>::connect(&followed, walk, vertex, tube);
        let numbers: [f64; CONNECTIONS] = walk.samples.pair();
        for number in numbers {
            let Some(photon) = light.choice(number) else { continue };
            let source = photon.in_room(&light.frame);
            let to_light = source - vertex.position;
            let distance_squared = to_light.length_squared();
            if distance_squared < followed.within * followed.within {
                continue;
            }
            if let Some((response, _)) = walk.respond(vertex, source, None) {
                let per_area = light.frame.up(to_light) / (PI * distance_squared * distance_squared.sqrt());
                walk.sum += response * photon.flux * (per_area / CONNECTIONS as f64);
            }
        }
    }

    fn sky_weight(&self, scene: &TraceableScene, tube: usize, state: &PathState, position: DVec3) -> Option<f64> {
        match state.last {
            // by mirrors vertices are connected to photons at any distance
            Some(last) if last.chain.is_some() => None,
            Some(last) if last.narrow || (last.is_sensor && !self.tubes[tube].is_far(last.position, 0.0)) => {
                Daylight::<C>::sky_weight(&FOLLOWED_WHOLE, scene, tube, state, position)
            }
            Some(last) if last.is_sensor => None,
            Some(_) => Daylight::<C>::sky_weight(&self.tubes[tube].followed(), scene, tube, state, position),
            // light that passes unscattered is not Lambertian light
            None if scene.tubes[tube].closure_at(position).unscattered::<C>().is_some() => {
                self.with_clear_zones.then_some(1.0)
            }
            // photons are connected to the eye directly, but not by mirrors
            None => (!state.from_eye).then_some(1.0),
        }
    }
}

/// Light at a sensor that already has connections to all openings except near ones.
pub struct SensorLit<'a, const C: usize> {
    /// Light of the pass.
    pub light: &'a DiffuserLight<C>,
    /// Centre of the sensor in m.
    pub centre: DVec3,
    /// Largest distance of the sensor's points from its centre, in m.
    pub reach: f64,
    /// Number of the sensor's rays, and of its connections to each luminaire.
    pub rays_and_connections: [f64; 2],
}

impl<const C: usize> Daylight<C> for SensorLit<'_, C> {
    fn coarse_solution(&self) -> Option<&Solution<C>> {
        Daylight::coarse_solution(self.light)
    }

    fn connect(&self, walk: &mut Walk<'_, C>, vertex: &Vertex<'_, C>, tube: usize) {
        self.light.connect(walk, vertex, tube);
    }

    fn lights_sensor(&self, tube: usize) -> bool {
        !self.light.tubes[tube].is_far(self.centre, self.reach)
    }

    fn counts_clear_zones(&self) -> bool {
        Daylight::counts_clear_zones(self.light)
    }

    fn counts_mirrors(&self) -> bool {
        Daylight::counts_mirrors(self.light)
    }

    fn connect_by_mirrors(&self, walk: &mut Walk<'_, C>, vertex: &Vertex<'_, C>, chain: usize) {
        self.light.connect_by_mirrors(walk, vertex, chain);
    }

    fn luminaires_at_sensor(&self) -> Option<[f64; 2]> {
        Some(self.rays_and_connections)
    }

    fn openings(&self) -> Option<&Openings> {
        Daylight::openings(self.light)
    }

    #[inline]
    fn reflected(&self, surface: SurfaceId, point: DVec3, sensor: Option<DVec3>) -> Option<Spectrum<C>> {
        Daylight::reflected(self.light, surface, point, sensor)
    }

    fn sky_weight(&self, scene: &TraceableScene, tube: usize, state: &PathState, position: DVec3) -> Option<f64> {
        self.light.sky_weight(scene, tube, state, position)
    }
}
