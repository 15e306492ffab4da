//! Responses of the room: what every sensor gets per lumen of each patch of each opening, and the tubes as lamps before it.
//!
//! **Idea.** In each pass paths go from the sensors through the room and tell what one lumen from each patch of each opening
//! gives there (`room`). Photons, as in two stages ([`lamp`](super::lamp)), tell the lumens of the patches. The light by way
//! of the room's surfaces is the sum over patches of one times the other; the light straight from the openings is that of
//! every photon. The first factor knows nothing of sky, sun, and of what is above the openings: it is kept, so that another
//! sky, hour or length of a tube traces nothing in the room (`kept`). One pass is one replicate of both.
//!
//! **Which paths** (docs/physics/measurement_equation.md#responses).
//!
//! | paths | estimator |
//! | --- | --- |
//! | `(K\|N) t F E`, all openings seen whole | every photon, connected |
//! | `(K\|N) t F E`, else | some photons, connected where nothing is between |
//! | `(K\|N) t F V .. E` | flux of the patch, times the response found by paths from E, the patch lit evenly |
//! | `M ..` | as path tracing, kept with the responses |
//! | `(K\|N) t C ..`, and what a table has beside its Lambertian sheet | as light tracing ([`lamp::beside`](super::lamp::beside)) |
//!
//! **Settings.** `photons_per_pass` (64 to 16 777 216; by default chosen for the accuracy asked for) and `samples_per_sensor`
//! (128; 1 to 65 536): the paths of a sensor.
//!
//! **Refuses** views, closures without a Lambertian part, sensors within a radius of an opening, and below closures that are Lambertian in
//! part what light tracing refuses. Of an opening, patches have the parts that lie in the Lambertian zone.
//! A patch counts as evenly lit for light that the room reflects: how much that may change is part of the error, as a bias.
//! Bad at diffusers that mirrors show (it warns).
//!
//! **Sources.** The matrix of a room that is used again for other skies is that of daylight coefficients (Tregenza and Waters
//! 1983), and the view matrix of its later phases (Ward 2011).

mod kept;
mod patch_light;
mod replicate;
mod room;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use glam::{DVec2, DVec3};

use super::lamp::beside::{Lamps, Lit, add_beside, bytes_beside, most_places, photons_beside, refuses_beside};
use super::lamp::cells::{CELLS, Receiver, TubeLight, cell};
use super::lamp::light::DiffuserLight;
use super::lamp::sizes::photons_for;
use super::lamp::zone::Zone;
use super::{GridPass, Integrator, Pass};
use crate::guide::RayCount;
use crate::integrator::backward::chance;
use crate::integrator::backward::pass::each;
use crate::integrator::method::{Caveat, Computation, Described, Knows, Load, Refusal, RefusalCode, Task, Trial, Work};
use crate::integrator::pass_size::PassSize;
use crate::integrator::trial::{Powers, TrialPasses};
use crate::optics::Spectrum;
use crate::sampling::{Key, PathRandom, PathSamples, Stream};
use crate::scene::{Channels, EstimateKind, Grid, Scene, Sensor};
use crate::traceable::{TraceableScene, TraceableTube};
use replicate::{Response, lit_by};
pub use room::Sizes;
use room::{Place, Room};

pub use kept::forget_all as forget_rooms;

/// Patches of every opening: six sectors of each of four rings of equal area.
pub const PATCHES: usize = CELLS;

/// Settings of responses.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Photons from sky and sun per pass, all tubes together; 64..=16_777_216; `None`: by the accuracy asked for.
    pub photons_per_pass: Option<u64>,
    /// Backward paths per sensor and pass; 1..=65_536.
    pub samples_per_sensor: u32,
    /// False where nothing is kept of the room, nor anything used that was: a trial tells what a new room costs.
    pub keeps_rooms: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { photons_per_pass: None, samples_per_sensor: 128, keeps_rooms: true }
    }
}

/// Fewest and most photons of a pass, unless the document says how many.
const LEAST: f64 = 64.0;
const MOST: f64 = 65_536.0;

/// Photons for each tube of a pass, unless the document says how many, or the flux of the tubes asks for more.
const PHOTONS: PassSize = PassSize { for_one_percent: 256.0, growth: 1.2, fewest: LEAST, most: MOST };

impl Settings {
    /// Photons of a pass for a relative standard error `target` through as many tubes; so many at least.
    fn photons(&self, target: f64, tubes: usize, least: f64) -> u64 {
        // whole rows of small nets
        let rows = PHOTONS.of(target, tubes as f64).max(least).min(MOST) / LEAST;
        let by_accuracy = rows.round() as u64 * LEAST as u64;
        self.photons_per_pass.unwrap_or(by_accuracy)
    }

    /// The same for tubes whose flux, and light beside them as lamps, asks for its own.
    fn photons_through(&self, tubes: &[TraceableTube], target: f64) -> u64 {
        self.photons(target, tubes.len(), photons_for(tubes, target).max(photons_beside(tubes, target)))
    }
}

impl Described for Settings {
    fn name(&self) -> &'static str {
        "lamp_responses"
    }

    fn knows(&self) -> Knows {
        Knows { views: false, ..Knows::ALL }
    }

    fn tells_responses(&self) -> bool {
        true
    }

    fn remark(&self) -> Option<&'static str> {
        Some("photons to the diffusers, and responses of the room, which are kept for other skies")
    }

    fn refuses(&self, task: &Task) -> Option<Refusal> {
        refuses_beside(task).or_else(|| near_openings(task))
    }

    fn warns(&self, task: &Task) -> Option<Caveat> {
        chance::mirrors(self.name(), task.traceable)
    }

    fn seconds_per_pass(&self, work: &Work) -> f64 {
        let paths = f64::from(self.samples_per_sensor) * work.sensors;
        self.photons(work.target, 1, 0.0) as f64 * work.tubes * (work.seconds_per_path + 2e-9 * work.sensors)
            + paths * (1e-6 + 0.5e-6 * work.tubes)
    }

    fn working_bytes(&self, load: &Load) -> f64 {
        let photons = self.photons_per_pass.map_or(MOST, |photons| photons as f64);
        photons * load.photon_bytes() * Load::COPIES + bytes_beside(load, photons)
    }

    fn trial(&self, task: &Task, target: f64) -> Trial {
        let tubes = &task.traceable.tubes;
        let anew = Self { keeps_rooms: false, ..self.clone() };
        let photons = self.photons_through(tubes, target) as f64;
        // the paths are most of the work and all of the noise that sensors have of their own, and as many at every accuracy
        let powers = Powers { work_of_place: 0.0, variance: 0.0, ..Powers::OF_PHOTONS };
        Trial::whole(anew, most_places(tubes, 9)).with(TrialPasses::of_size(photons, powers))
    }

    fn build(&self, task: &Task, seed: u64, target: f64) -> Computation {
        let scene = task.traceable.clone();
        let photons = self.photons_through(&scene.tubes, target);
        let sizes = Sizes { photons, target, paths: self.samples_per_sensor, keeps_rooms: self.keeps_rooms };
        match task.scene.channels {
            Channels::Photopic => {
                Computation::passes(LampResponses::<1>::new(task.scene, scene, task.grids, sizes, seed))
            }
            Channels::Rgb => Computation::passes(LampResponses::<3>::new(task.scene, scene, task.grids, sizes, seed)),
        }
    }
}

/// Reason why connections to openings would have no useful variance, if there is one.
fn near_openings(task: &Task) -> Option<Refusal> {
    let scene = task.traceable;
    let is_near = |grid: &&Grid| {
        let mut places =
            (0..grid.len()).filter(|index| !grid.is_inside(*index)).map(|index| Place::of(scene, grid, index));
        places.any(|place| scene.tubes.iter().any(|tube| !place.is_far(tube)))
    };
    let grid = task.grids.iter().find(is_near)?;
    let detail = format!(
        "light of an opening that is nearer to a sensor than its radius is rare and bright, and a sensor of the grid {:?} lies so \
         near",
        grid.name
    );
    Some(Refusal::new(RefusalCode::PointsNearSurfaces, detail))
}

/// Photons of an opening that a sensor is connected to which may see a part of it only.
const CONNECTIONS_IN_PART: usize = 256;

/// The method on one scene; `C` channels of light.
#[derive(Debug)]
pub struct LampResponses<const C: usize> {
    scene: Arc<TraceableScene>,
    room: Room<C>,
    lamps: Lamps<C>,
    grids: Vec<Grid>,
    seed: Key,
}

impl<const C: usize> LampResponses<C> {
    /// Divides the photons of a pass among sky and sun of the tubes; equal seeds give equal bits.
    pub fn new(description: &Scene, scene: Arc<TraceableScene>, grids: &[Grid], sizes: Sizes, seed: u64) -> Self {
        let lamps = Lamps::new(&scene, grids, (sizes.photons, sizes.target), seed);
        let room = Room::new(description, &scene, grids, sizes, seed);
        Self { room, lamps, grids: grids.to_vec(), seed: Key::new(seed), scene }
    }

    /// True if a replicate of the room is kept, so that nothing is traced in the room for it.
    pub fn keeps(&self, pass: u64) -> bool {
        self.room.keeps(pass)
    }

    /// Light straight from the openings to a sensor, in lx, and the rays that look for what is between.
    fn straight(
        &self,
        light: &DiffuserLight<C>,
        [grid, sensor]: [usize; 2],
        offsets: Option<&[Vec<DVec2>]>,
        stream: Key,
    ) -> (f64, RayCount) {
        let place = Place::of(&self.scene, &self.grids[grid], sensor);
        let mut rays = RayCount::default();
        if self.grids[grid].is_inside(sensor) {
            return (0.0, rays);
        }
        if self.room.sees_all(grid, sensor) {
            let of_tube = |tube| light.at_sensor(tube, Sensor { position: place.centre(), normal: DVec3::Z }, offsets);
            return ((0..light.tubes().len()).map(of_tube).sum(), rays);
        }
        let stream = stream.stream(Stream::Sensor, sensor as u64);
        let mut lux = 0.0;
        for (number, tube) in light.tubes().iter().enumerate() {
            let stream = stream.stream(Stream::PartlySeen, number as u64);
            let start = PathRandom::new(stream).uniform();
            for connection in 0..CONNECTIONS_IN_PART {
                let even = (connection as f64 + start) / CONNECTIONS_IN_PART as f64;
                let Some((photon, _)) = tube.choice(even) else { continue };
                let mut samples = PathSamples::new(stream, connection as u64);
                let position = place.point(|| samples.pair());
                let source = photon.position.extend(tube.origin.z);
                rays += 1;
                if !self.scene.is_in_solid(position) && self.scene.visible(source, None, position, None) {
                    let receiver = Receiver::new(position, DVec3::Z, tube.origin);
                    lux += photon.flux.luminance() * receiver.point(photon.position) / CONNECTIONS_IN_PART as f64;
                }
            }
        }
        (lux, rays)
    }
}

impl<const C: usize> Integrator for LampResponses<C> {
    fn pass(&self, pass: u64, cancel: &AtomicBool) -> Option<Pass> {
        let key = self.seed.stream(Stream::Pass, pass);
        let Lit { lamps: light, beside, account } = self.lamps.pass(&self.scene, key, cancel)?;
        let room = self.room.pass(pass, cancel)?;
        let mut result = Pass { account, photons: self.lamps.photons(), ..Pass::default() };
        result.account.rays += room.rays;
        let zones = self.room.zones();
        let by_patch = |(tube, zone): (&TubeLight<C>, &Zone)| by_patch(tube, zone);
        let (fluxes, offset): (Vec<_>, Vec<_>) = light.tubes().iter().zip(zones).map(by_patch).unzip();
        let fluxes = fluxes.concat();
        for (number, (grid, responses)) in self.grids.iter().zip(&room.grids).enumerate() {
            let stream = key.stream(Stream::Grid, number as u64);
            let average = grid.estimate == EstimateKind::CellAverage;
            let offsets = average.then(|| light.offsets(grid.cell_size_m, stream));
            let straight = |sensor: usize| self.straight(&light, [number, sensor], offsets.as_deref(), stream);
            let straight = each(grid.len(), cancel, straight)?;
            let mut of_grid = GridPass::default();
            for ((lux, rays), response) in straight.iter().zip(responses) {
                let reflected = lit_by(&response.reflected, &fluxes).luminance();
                of_grid.illuminance.push(lux + reflected + response.luminaires);
                of_grid.bias.push(unevenness(&response.reflected, (&self.scene.tubes, zones), &offset));
                result.account.rays += *rays;
            }
            if grid.responses {
                of_grid.beside = self.told(number, responses);
            }
            result.grids.push(of_grid);
        }
        add_beside(&mut result.grids, &beside);
        Some(result)
    }

    fn start(&self) -> Pass {
        let columns = self.scene.tubes.len() * PATCHES;
        let beside = |grid: &Grid| vec![GridPass::default(); if grid.responses { columns } else { 0 }];
        let grids = self.grids.iter().map(|grid| GridPass { beside: beside(grid), ..GridPass::default() }).collect();
        Pass { grids, ..Pass::default() }
    }
}

impl<const C: usize> LampResponses<C> {
    /// The responses of a grid in lx/lm of white light, patch by patch.
    fn told(&self, grid: usize, responses: &[Response]) -> Vec<GridPass> {
        let column = |column: usize| {
            let of_sensor = |(sensor, response): (usize, &Response)| {
                let channels = &response.reflected[column * C..(column + 1) * C];
                let reflected = Spectrum::<C>(std::array::from_fn(|channel| channels[channel])).luminance();
                self.room.straight(grid, sensor, response)[column] + reflected
            };
            let illuminance = responses.iter().enumerate().map(of_sensor).collect();
            GridPass { illuminance, ..GridPass::default() }
        };
        (0..self.scene.tubes.len() * PATCHES).map(column).collect()
    }
}

/// The flux of each patch of a tube, and the moment in lm m by which photons leave beside the middles of their patches.
fn by_patch<const C: usize>(tube: &TubeLight<C>, zone: &Zone) -> (Vec<Spectrum<C>>, Uneven) {
    let mut fluxes = vec![Spectrum::ZERO; PATCHES];
    let mut moment_lm_m = DVec2::ZERO;
    for photon in &tube.photons {
        let away = photon.position - tube.origin.truncate();
        let patch = cell(away, tube.radius);
        fluxes[patch] += photon.flux;
        moment_lm_m += (away - zone.middle(patch) * tube.radius) * photon.flux.luminance();
    }
    (fluxes, Uneven { moment_lm_m })
}

/// How unevenly the patches of an opening are lit.
#[derive(Clone, Copy, Debug)]
struct Uneven {
    /// Sum over the photons of their flux times the way in m from the middle of their patch.
    moment_lm_m: DVec2,
}

/// Bias in lx of what a sensor gets by way of the room, for patches that count as evenly lit: the slope of its response over each
/// opening, in lx/lm per m, times the moment of the light within the patches.
fn unevenness(reflected: &[f64], (tubes, zones): (&[TraceableTube], &[Zone]), uneven: &[Uneven]) -> f64 {
    let channels = reflected.len() / (tubes.len() * PATCHES).max(1);
    let of_tube = |(((tube, zone), uneven), responses): (((&TraceableTube, &Zone), &Uneven), &[f64])| {
        let (mut slope, mut squares) = (DVec2::ZERO, 0.0);
        let held = zone.held();
        let parts = responses.chunks_exact(channels).enumerate();
        for (patch, response) in parts.filter(|(patch, _)| held[*patch] > 0.0) {
            let away = zone.middle(patch) * tube.opening_radius;
            slope += away * (response.iter().sum::<f64>() / channels as f64);
            squares += 0.5 * away.length_squared();
        }
        if squares > 0.0 { (slope / squares).dot(uneven.moment_lm_m) } else { 0.0 }
    };
    let responses = reflected.chunks_exact((PATCHES * channels).max(1));
    tubes.iter().zip(zones).zip(uneven).zip(responses).map(of_tube).sum()
}
