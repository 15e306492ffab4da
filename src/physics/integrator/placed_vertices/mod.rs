//! Placed vertices: a tube is a lamp, and the room is lit by points placed where sensors need them.
//!
//! **Idea.** In each pass photons first find what leaves the diffusers ([`lamp`](super::lamp)), and each is connected to
//! every sensor. Then points are placed on the surfaces of the room, where these are bright and near to sensors
//! (`importance`). One backward path from each tells the luminance that it sends into the room, counting at every surface
//! the light of the diffusers in closed form, or nearly so; the point is connected to every sensor that sees it. Sensors
//! beside surfaces find what comes from very near by themselves (`targets`). One pass is one replicate.
//!
//! **Which paths** (docs/physics/measurement_equation.md#placed-vertices).
//!
//! | paths | estimator |
//! | --- | --- |
//! | `(K\|N) t F E` | every photon, connected |
//! | `M E` | Lambert's closed form |
//! | `.. V E`, V not beside E | placed vertices, openings that send light back included; what lights them as in two stages |
//! | `.. V E`, V beside E | paths followed from the sensor |
//! | `(K\|N) t C ..`, below closures that are lamps in part | as light tracing ([`lamp::beside`](super::lamp::beside)) |
//!
//! **Settings.** `photons_per_pass` and `vertices_per_pass` (64 to 16 777 216; by default chosen for the accuracy asked
//! for, so that 8 to some tens of passes reach it): noise of the first stage is common to all sensors of a pass. A sixteenth
//! as many paths as vertices are followed from a sensor.
//!
//! **Refuses** views, cell averages, closures without a Lambertian zone, clear zones below guides that send light back, measured
//! diffusers, glossy surfaces and mirrors, luminaires that something may hide, and sensors very near to openings; below clear zones
//! also what light tracing refuses. The fluxes of tubes are those of
//! the first stage; a few photons tell for the books where the light of the room ends.
//!
//! **Sources.** Importance for a sum of squared relative errors is derived from Veach 1997, section 2.2
//! (docs/physics/measurement_equation.md#placed-vertices); the cut at diffusers is that of two stages.

mod importance;
mod lines;
mod panels;
mod rough_light;
mod runs;
mod sent;
mod targets;

use std::f64::consts::PI;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use glam::{DVec2, DVec3};

use crate::guide::RayCount;
use crate::integrator::backward::next_event::{NextEvent, Way};
use crate::integrator::backward::walk::{Ray, Walk};
use crate::integrator::lamp::beside::{
    Lamps, Lit, add_beside, bytes_beside, is_lamp, most_places, photons_beside, refuses_beside,
};
use crate::integrator::lamp::light::DiffuserLight;
use crate::integrator::lamp::sizes::{are_straight, photons_for};
use crate::integrator::method::{Computation, Described, Kept, Knows, Load, Refusal, RefusalCode, Task, Trial, Work};
use crate::integrator::pass_size::PassSize;
use crate::integrator::photon::chunks::{Chunks, Tally, fold_chunks, sums_at_once};
use crate::integrator::trial::{Powers, TrialPasses};
use crate::integrator::{GridPass, Integrator, Pass};
use crate::optics::Spectrum;
use crate::sampling::{Key, PathSamples, Stream, power_of_two, warp};
use crate::scene::{Channels, EstimateKind, Grid};
use crate::traceable::{TraceableScene, TraceableTube};
use importance::{Importance, Placed};
use lines::Scratch;
use sent::Target;
use targets::{Following, Sender, Targets, facet_of};

/// Settings of placed vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Settings {
    /// Photons from sky and sun per pass, all tubes together; 64..=16_777_216; `None`: by the accuracy asked for.
    pub photons_per_pass: Option<u64>,
    /// Vertices on the surfaces of the room per pass; 64..=16_777_216; `None`: by the accuracy asked for.
    pub vertices_per_pass: Option<u64>,
}

/// Fewest and most photons, and vertices, of a pass, unless the document says how many.
const LEAST: f64 = 64.0;
const MOST: f64 = 65_536.0;

/// Vertices of a pass, unless the document says how many.
const VERTICES: PassSize = PassSize { for_one_percent: 192.0, growth: 1.4, fewest: LEAST, most: MOST };
/// The same where the flux of a tube has its part in the error.
const BESIDE_NOISY_FLUX: PassSize = PassSize { for_one_percent: 256.0, ..VERTICES };

/// Where obstacles stand, photons and vertices are as many times more as a power of what the spread of vertices
/// ([`Importance::spread`]) has above this, in units of that: their shadows take from even points what these gain elsewhere.
/// Measured in the room of the thesis with 1 to 64 boxes and a chair, so that 8 to 10 passes are enough: spreads of 0.64 to 7.6, and
/// 1 to 17 times as many. Nothing depends on it but how many passes there are.
const SPREAD_OF_NO_EFFECT: f64 = 0.426;
const UNIT_OF_SPREAD: f64 = 0.179;
const GROWTH_BY_SPREAD: f64 = 0.77;
const MOST_BY_SPREAD: f64 = 20.0;

/// As many times more photons and vertices as where nothing stands, by the spread of vertices where something does; a share of the
/// sensors is lit, the others are in boxes.
fn more_by_obstacles(spread: f64, lit_share: f64) -> f64 {
    let above = ((spread * lit_share - SPREAD_OF_NO_EFFECT) / UNIT_OF_SPREAD).max(1.0);
    libm::pow(above, GROWTH_BY_SPREAD).min(MOST_BY_SPREAD)
}

impl Settings {
    /// Photons and vertices of a pass for a relative standard error `target`, where obstacles ask for `more` times as many.
    fn sizes(&self, target: f64, tubes: &[TraceableTube], more: f64) -> [u64; 2] {
        // whole rows of small nets, and whole nets where these are small enough and nothing takes from what they gain
        let size = |number: f64, gains: bool| match (number.clamp(LEAST, MOST) / LEAST).round() as u64 {
            rows if rows < 4 || !gains => rows * LEAST as u64,
            _ => power_of_two(number.min(MOST)),
        };
        let (are_straight, is_free) = (are_straight(tubes), more <= 1.0);
        let photons = (photons_for(tubes, target) * more).max(photons_beside(tubes, target));
        let photons = size(photons, is_free && are_straight);
        let vertices = if are_straight { VERTICES } else { BESIDE_NOISY_FLUX };
        let vertices = size(vertices.of(target, more), is_free);
        [self.photons_per_pass.unwrap_or(photons), self.vertices_per_pass.unwrap_or(vertices)]
    }
}

impl Described for Settings {
    fn name(&self) -> &'static str {
        "placed_vertices"
    }

    fn knows(&self) -> Knows {
        Knows { views: false, ..Knows::ALL }
    }

    fn remark(&self) -> Option<&'static str> {
        Some("photons to the diffusers, then points placed on the room's surfaces")
    }

    fn refuses(&self, task: &Task) -> Option<Refusal> {
        let scene = task.traceable;
        let refusal = |code, detail: &str| Some(Refusal::new(code, detail));
        let closures = refuses_beside(task).or_else(|| refuses_closures(scene));
        if closures.is_some() {
            closures
        } else if scene.specular_surfaces().next().is_some() {
            refusal(RefusalCode::SpecularSurfaces, "the room's surfaces are not all diffuse")
        } else if scene.luminaires_obstructed && scene.luminaires.iter().any(|luminaire| luminaire.emits()) {
            let detail = "light of luminaires has a closed form only where no object or luminaire can hide it";
            refusal(RefusalCode::Luminaires, detail)
        } else if task.grids.iter().any(|grid| grid.estimate == EstimateKind::CellAverage) {
            let detail = "connections to random points of cells beside walls have no bounded variance";
            refusal(RefusalCode::CellAverages, detail)
        } else {
            beside_openings(task)
        }
    }

    fn seconds_per_pass(&self, work: &Work) -> f64 {
        let [photons, vertices] = self.sizes(work.target, &[], 1.0).map(|number| number as f64);
        photons * work.tubes * (work.seconds_per_path + 1e-9 * work.sensors)
            + vertices * (0.5e-6 + 0.3e-6 * work.tubes + 1e-9 * work.sensors)
    }

    fn working_bytes(&self, load: &Load) -> f64 {
        let photons = self.photons_per_pass.map_or(MOST, |photons| photons as f64);
        photons * load.photon_bytes() * Load::COPIES + bytes_beside(load, photons)
    }

    fn kept_of_sensor(&self, grid: &Grid) -> Kept {
        let vertices = self.vertices_per_pass.unwrap_or(MOST as u64);
        let sums_at_once = sums_at_once(grid.len(), vertices) as f64;
        Kept { sums_at_once, ..Kept::MEANS }
    }

    fn trial(&self, task: &Task, target: f64) -> Trial {
        let tubes = &task.traceable.tubes;
        let [_, vertices] = self.sizes(target, tubes, 1.0);
        Trial::whole(self.clone(), most_places(tubes, 49))
            .with(TrialPasses::of_size(vertices as f64, Powers::of_growth(VERTICES.growth)))
    }

    fn build(&self, task: &Task, seed: u64, target: f64) -> Computation {
        let scene = task.traceable.clone();
        let tubes = &task.traceable.tubes;
        let sizes = |more: f64| self.sizes(target, tubes, more);
        match task.scene.channels {
            Channels::Photopic => Computation::passes(PlacedVertices::<1>::sized(scene, task.grids, sizes, seed)),
            Channels::Rgb => Computation::passes(PlacedVertices::<3>::sized(scene, task.grids, sizes, seed)),
        }
    }
}

/// Reason why what closures send into the room would not be found, if so: vertices are placed on openings as on Lambertian surfaces.
fn refuses_closures(scene: &TraceableScene) -> Option<Refusal> {
    let beside = || scene.tubes.iter().filter(|tube| !is_lamp(tube));
    if beside().any(|tube| tube.diffuser.measured().is_some()) {
        let detail = "light leaves a measured closure by its direction of incidence";
        Some(Refusal::new(RefusalCode::MeasuredDiffusers, detail))
    } else if scene.guide_return && beside().any(|tube| tube.guide.returns_light()) {
        let detail = "a bent, domed or meshed tube sends light of the room back unscattered";
        Some(Refusal::new(RefusalCode::ClearClosuresOfBentTubes, detail))
    } else {
        None
    }
}

/// Share of the room's shortest edge within which an opening is too near to a sensor.
const NEAR_OPENING: f64 = 0.01;

/// Reason why the standard errors of sensors beside openings would not tell the truth: photons that leave very near to one are
/// rare and bright.
fn beside_openings(task: &Task) -> Option<Refusal> {
    let scene = task.traceable;
    let near = NEAR_OPENING * scene.size.min_element();
    let distance = |sensor: DVec3, tube: &TraceableTube| {
        let away = sensor - tube.origin;
        let beside = (away.truncate().length() - tube.opening_radius).max(0.0);
        DVec2::new(beside, away.z).length()
    };
    let is_near = |sensor: DVec3| scene.tubes.iter().any(|tube| distance(sensor, tube) < near);
    let grid = task.grids.iter().find(|grid| (0..grid.len()).any(|sensor| is_near(grid.centre(sensor))))?;
    let detail = format!(
        "light of an opening nearer to a sensor than 1 % of the room's shortest edge ({near:.3e} m) is rare and bright, and a \
         sensor of the grid {:?} lies so near",
        grid.name
    );
    Some(Refusal::new(RefusalCode::PointsNearSurfaces, detail))
}

/// Reflections of a path that no roulette decides: it would throw away what even points gain.
const CERTAIN_REFLECTIONS: u32 = 3;

/// Pairs of Sobol coordinates of a vertex and its path.
const SOBOL_PAIRS: u32 = 4;

/// Vertices of a pass for every path that is followed from a sensor.
const VERTICES_PER_PATH: u64 = 16;

/// The method on one scene; `C` channels of light.
#[derive(Debug)]
pub struct PlacedVertices<const C: usize> {
    scene: Arc<TraceableScene>,
    lamps: Lamps<C>,
    /// `None` where no surface sends light to a sensor.
    importance: Option<Arc<Importance>>,
    targets: Targets,
    /// Numbers of sensors of the grids.
    lengths: Vec<usize>,
    /// Light straight from luminaires in lx, per target.
    direct: Vec<f64>,
    /// True for targets inside boxes, which are dark.
    buried: Vec<bool>,
    vertices: u64,
    seed: Key,
}

/// What some vertices, or paths from some sensors, give.
struct Sums {
    /// Illuminance in lx per target.
    lux: Vec<f64>,
    rays: RayCount,
}

impl Tally for Sums {
    fn is_finite(&self) -> bool {
        self.lux.iter().all(|lux| lux.is_finite())
    }
}

impl<const C: usize> PlacedVertices<C> {
    /// `photons_and_vertices` per pass; equal seeds give equal bits.
    pub fn new(scene: Arc<TraceableScene>, grids: &[Grid], photons_and_vertices: [u64; 2], seed: u64) -> Self {
        Self::sized(scene, grids, |_| photons_and_vertices, seed)
    }

    /// `sizes`: photons and vertices per pass, where obstacles ask for so many times more.
    fn sized(scene: Arc<TraceableScene>, grids: &[Grid], sizes: impl FnOnce(f64) -> [u64; 2], seed: u64) -> Self {
        let targets = Targets::new(&scene, grids);
        let all: Vec<_> = targets.all().collect();
        let buried: Vec<bool> = all.iter().map(|target| scene.is_in_box(target.position)).collect();
        // nothing is placed for sensors that stay dark
        let lit: Vec<Target> =
            all.iter().zip(&buried).filter(|(_, buried)| !**buried).map(|(target, _)| *target).collect();
        let importance = Some(()).filter(|()| scene.interreflection).and_then(|()| Importance::new(&scene, &lit));
        let share = lit.len() as f64 / all.len().max(1) as f64;
        let spread = importance.as_deref().filter(|_| scene.obstructed).map_or(0.0, |importance| importance.spread);
        let [photons, vertices] = sizes(more_by_obstacles(spread, share));
        let lamps = Lamps::new(&scene, grids, photons, seed);
        let direct = |sensor: DVec3| {
            let luminaires = scene.luminaires.iter();
            luminaires.map(|luminaire| luminaire.irradiance::<C>(sensor, DVec3::Z).luminance()).sum()
        };
        let direct = all.iter().map(|target| direct(target.position)).collect();
        let lengths = grids.iter().map(Grid::len).collect();
        Self { lamps, importance, targets, lengths, direct, buried, vertices, seed: Key::new(seed), scene }
    }

    /// What vertices of these numbers of a pass send to the targets.
    fn vertices(&self, light: &DiffuserLight<C>, importance: &Importance, stream: Key, numbers: Range<u64>) -> Sums {
        let mut lux = vec![0.0; self.direct.len()];
        let mut rays = RayCount::default();
        let mut scratch = Scratch::default();
        let clearance = CLEARANCE * self.scene.coinciding();
        let meeting = NextEvent(light);
        for number in numbers {
            let mut samples = PathSamples::with_pairs(stream, number, SOBOL_PAIRS);
            let placed = importance.place(&self.scene, samples.pair());
            // seen from just before it, it may be an opening, or hidden
            let (origin, direction) = (placed.position + placed.normal * clearance, -placed.normal);
            let at_once = placed.bare.filter(|_| self.starts_at_once(&placed));
            if at_once.is_none() && !self.is_outermost(&placed, origin, direction) {
                continue;
            }
            let mut walk = Walk::<C>::new(&self.scene, samples, CERTAIN_REFLECTIONS);
            let (weight, trace) = (Spectrum::ONE, Way::COUNTED);
            let ray = Ray { origin, direction, from: None, weight, reflected: true, trace };
            match at_once {
                Some(surface) => walk.follow_from(&meeting, &ray, (surface, &placed.hit(surface))),
                None => walk.follow(&meeting, ray),
            }
            rays += walk.rays;
            let intensity = walk.sum.luminance() * placed.area_m2 / self.vertices as f64;
            if intensity > 0.0 {
                let (position, normal, of_box) = (origin, placed.normal, placed.of_box);
                let sender = Sender { position, normal, intensity, of_box };
                self.targets.connect(&self.scene, &sender, &mut scratch, &mut lux);
            }
        }
        Sums { lux, rays }
    }

    /// True if what is seen of a bare place needs no ray: it is no opening. Between plain faces that is found out anyway.
    fn starts_at_once(&self, placed: &Placed) -> bool {
        let is_opening = || placed.normal.z < 0.0 && self.scene.opening_at(placed.position.truncate()).is_some();
        self.scene.obstructed && !is_opening()
    }

    /// False where what is seen of a place is a mesh that lies on it, whose own places count that, or another facet.
    fn is_outermost(&self, placed: &Placed, origin: DVec3, direction: DVec3) -> bool {
        let scene = &self.scene;
        match (placed.of_facet, &scene.meshes) {
            (_, None) => true,
            (None, Some(meshes)) => !meshes.blocks(origin, placed.position + direction * scene.coinciding(), 1.0),
            (facet, Some(_)) => facet_of(scene, &scene.intersect(origin, direction, None)) == facet,
        }
    }

    /// What paths from some of the followed targets find, in lx, and the rays that they took.
    fn follow(&self, light: &DiffuserLight<C>, pass: Key, followed: Range<u64>) -> Sums {
        let paths = (self.vertices / VERTICES_PER_PATH).max(1);
        let meeting = NextEvent(light);
        let mut rays = RayCount::default();
        let mut of_target = |following: &Following, stream: Key| {
            let position = following.position;
            let mut found = 0.0;
            for number in 0..paths {
                let mut samples = PathSamples::with_pairs(stream, number, SOBOL_PAIRS);
                let direction = warp::cosine_hemisphere(samples.pair());
                rays += 1;
                if following.counts(&self.scene.intersect(position, direction, None)) {
                    let mut walk = Walk::<C>::new(&self.scene, samples, CERTAIN_REFLECTIONS);
                    let (weight, trace) = (Spectrum::ONE, Way::COUNTED);
                    walk.follow(
                        &meeting,
                        Ray { origin: position, direction, from: None, weight, reflected: true, trace },
                    );
                    rays += walk.rays;
                    found += walk.sum.luminance();
                }
            }
            found * PI / paths as f64
        };
        let mut of =
            |index: u64| of_target(&self.targets.followed[index as usize], pass.stream(Stream::FollowedSensor, index));
        let lux = followed.map(&mut of).collect();
        Sums { lux, rays }
    }
}

/// Distance at which a vertex stands before its surface, in distances at which surfaces coincide.
const CLEARANCE: f64 = 4.0;

impl<const C: usize> Integrator for PlacedVertices<C> {
    fn pass(&self, pass: u64, cancel: &AtomicBool) -> Option<Pass> {
        let key = self.seed.stream(Stream::Pass, pass);
        let Lit { lamps: light, beside, mut account } = self.lamps.pass(&self.scene, key, cancel)?;
        let mut lux = self.direct.clone();
        for (number, tube) in light.tubes().iter().enumerate() {
            let photons = tube.photons.iter();
            let photons = photons.map(|photon| (photon.position.extend(tube.origin.z), photon.flux.luminance() / PI));
            self.targets.connect_opening(&self.scene, number, photons, &mut lux);
        }
        if let Some(importance) = &self.importance {
            let stream = key.stream(Stream::PlacedVertices, 0);
            let chunk = |numbers: Range<u64>| self.vertices(&light, importance, stream, numbers);
            let chunk_bytes = 8 * lux.len() as u64;
            let folded = fold_chunks(
                Chunks::of_short_paths(self.vertices),
                chunk_bytes,
                cancel,
                chunk,
                |Sums { lux: of_chunk, rays }| {
                    lux.iter_mut().zip(&of_chunk).for_each(|(sum, value)| *sum += value);
                    account.rays += rays;
                },
            )?;
            account.not_finite = account.not_finite.or(folded.not_finite);
        }
        if self.scene.interreflection {
            let mut places = self.targets.followed.iter().map(|following| following.place);
            let chunk = |numbers: Range<u64>| self.follow(&light, key, numbers);
            let count = self.targets.followed.len() as u64;
            let folded =
                fold_chunks(Chunks::of_short_paths(count), 0, cancel, chunk, |Sums { lux: of_chunk, rays }| {
                    places.by_ref().zip(&of_chunk).for_each(|(place, value)| lux[place] += value);
                    account.rays += rays;
                })?;
            account.not_finite = account.not_finite.or(folded.not_finite);
        }
        lux.iter_mut().zip(&self.buried).filter(|(_, buried)| **buried).for_each(|(lux, _)| *lux = 0.0);
        let mut lux = self.targets.in_order_of_grids(&lux).into_iter();
        let of_grid =
            |length: &usize| GridPass { illuminance: lux.by_ref().take(*length).collect(), ..GridPass::default() };
        let mut grids: Vec<GridPass> = self.lengths.iter().map(of_grid).collect();
        add_beside(&mut grids, &beside);
        Some(Pass { grids, account, photons: self.lamps.photons(), ..Pass::default() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nothing more where nothing stands or vertices spread as without obstacles, the measured power of what is above, of the
    /// sensors that are lit alone, and a bound.
    #[test]
    fn obstacles_ask_for_more_by_their_spread() {
        let more = |units: f64| more_by_obstacles(SPREAD_OF_NO_EFFECT + units * UNIT_OF_SPREAD, 1.0);
        assert_eq!([more_by_obstacles(0.0, 1.0), more_by_obstacles(SPREAD_OF_NO_EFFECT, 1.0), more(1.0)], [1.0; 3]);
        for (units, times) in [(2.0, 1.7053), (10.0, 5.8884), (40.0, 17.1232)] {
            assert!((more(units) / times - 1.0).abs() < 1e-4, "{units}: {}", more(units));
            let spread = SPREAD_OF_NO_EFFECT + units * UNIT_OF_SPREAD;
            assert!((more_by_obstacles(4.0 * spread, 0.25) / more(units) - 1.0).abs() < 1e-12);
        }
        assert_eq!(more(1e6), MOST_BY_SPREAD);
    }

    /// More vertices are whole rows of small nets, and without obstacles whole nets.
    #[test]
    fn passes_grow_with_what_obstacles_ask_for() {
        let settings = Settings::default();
        let [_, none] = settings.sizes(0.01, &[], 1.0);
        for more in [1.7, 5.9, 20.0] {
            let [_, vertices] = settings.sizes(0.01, &[], more);
            assert!(
                vertices.is_multiple_of(64) && (vertices as f64 / (more * none as f64) - 1.0).abs() < 0.1,
                "{vertices}"
            );
        }
        assert!(settings.sizes(0.001, &[], 1.0)[1].is_power_of_two());
        let asked = Settings { photons_per_pass: Some(99), vertices_per_pass: Some(77) };
        assert_eq!(asked.sizes(0.01, &[], 20.0), [99, 77]);
    }
}
