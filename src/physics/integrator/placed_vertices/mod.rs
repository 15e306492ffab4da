//! Placed vertices: a tube is a lamp, and the room is lit by points placed where sensors need them.
//!
//! **Idea.** In each pass photons first find what leaves the diffusers ([`lamp`](super::lamp)), and each is connected to
//! every sensor. Then points are placed on the surfaces of the room, where these are bright and near to sensors
//! (`importance`). One backward path from each tells the luminance that it sends into the room, counting at every surface
//! the light of the diffusers in closed form, or nearly so; the point is connected to every sensor that sees it. Sensors
//! beside surfaces find what comes from very near by themselves (`targets`). One pass is one replicate.
//!
//! Where boxes stand in the room and openings alone give light, sensors see few of these points. There each gathers what surfaces
//! reflect by rays of its own, from a coarse radiosity solution on patches of the surfaces (`by_patches`), and the points send the
//! residual: the difference between the light of a surface and what its patch has for it (`gathered`). The sum is unbiased, however
//! coarse the patches are.
//!
//! **Which paths** (docs/physics/measurement_equation.md#placed-vertices).
//!
//! | paths | estimator |
//! | --- | --- |
//! | `(K\|N) t F E` | every photon, connected |
//! | `M E` | Lambert's closed form |
//! | `.. V E`, V not beside E | placed vertices, openings that send light back included; what lights them as in two stages |
//! | `.. V E`, V beside E | paths followed from the sensor |
//! | `.. V E`, where sensors gather | what patches have for V by rays from E, the residual by placed vertices, or from E where V is beside it; all by paths from E where V is in or beside an opening |
//! | `(K\|N) t C ..`, below closures that are lamps in part | as light tracing ([`lamp::beside`](super::lamp::beside)) |
//!
//! **Settings.** `photons_per_pass` and `vertices_per_pass` (64 to 16 777 216; by default chosen for the accuracy asked
//! for, so that 8 to some tens of passes reach it): noise of the first stage is common to all sensors of a pass. A sixteenth
//! as many paths as vertices are followed from a sensor; where sensors gather, the accuracy decides about their rays.
//!
//! **Refuses** views, cell averages, closures without a Lambertian zone, clear zones below guides that send light back, measured
//! diffusers, glossy surfaces and mirrors, luminaires that something may hide, and sensors very near to openings; below clear zones
//! also what light tracing refuses. The fluxes of tubes are those of
//! the first stage; a few photons tell for the books where the light of the room ends.
//!
//! **Sources.** Importance for a sum of squared relative errors is derived from Veach 1997, section 2.2
//! (docs/physics/measurement_equation.md#placed-vertices, which also has the equation by which patches are put right); the cut at
//! diffusers is that of two stages.

mod by_patches;
mod gathered;
mod importance;
mod lines;
mod outermost;
mod panels;
mod penumbra;
mod rough_light;
mod runs;
mod sent;
mod sizes;
mod targets;

use std::f64::consts::PI;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use glam::DVec3;

use crate::guide::RayCount;
use crate::integrator::backward::next_event::{NextEvent, Way};
use crate::integrator::backward::walk::{Ray, Walk};
use crate::integrator::lamp::beside::{Lamps, Lit, add_beside, bytes_beside, is_lamp, most_places, refuses_beside};
use crate::integrator::lamp::light::DiffuserLight;
use crate::integrator::method::{Computation, Described, Kept, Knows, Load, Refusal, RefusalCode, Task, Trial, Work};
use crate::integrator::photon::chunks::{Chunks, fold_chunks, sums_at_once};
use crate::integrator::photon::close_points::points_at_openings;
use crate::integrator::photon::ledger::Account;
use crate::integrator::trial::{Powers, TrialPasses};
use crate::integrator::{GridPass, Integrator, Pass};
use crate::optics::Spectrum;
use crate::sampling::{Key, PathSamples, Stream, warp};
use crate::scene::{Channels, EstimateKind, Grid};
use crate::traceable::TraceableScene;
use gathered::{Around, Gatherers};
use importance::Importance;
use lines::Scratch;
use outermost::Before;
pub use rough_light::gathers;
use sent::Target;
use sizes::{By, GATHERED_RAYS, MOST, Sizes, VERTICES, more_by_obstacles, sizes};
use targets::{Following, Sender, Sums, Targets};

/// Settings of placed vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Settings {
    /// Photons from sky and sun per pass, all tubes together; 64..=16_777_216; `None`: by the accuracy asked for.
    pub photons_per_pass: Option<u64>,
    /// Vertices on the surfaces of the room per pass; 64..=16_777_216; `None`: by the accuracy asked for.
    pub vertices_per_pass: Option<u64>,
}

impl Settings {
    /// Photons and vertices of a pass where they are given.
    fn numbers(&self) -> [Option<u64>; 2] {
        [self.photons_per_pass, self.vertices_per_pass]
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
            points_at_openings(scene, task.grids)
        }
    }

    fn seconds_per_pass(&self, work: &Work) -> f64 {
        let Sizes { photons, vertices, .. } = sizes(self.numbers(), work.target, &[], By::Vertices(1.0));
        let [photons, vertices] = [photons, vertices].map(|number| number as f64);
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
        let (size, law) = if gathers(task.traceable) {
            (sizes(self.numbers(), target, tubes, By::Gathering).rays, GATHERED_RAYS)
        } else {
            (sizes(self.numbers(), target, tubes, By::Vertices(1.0)).vertices, VERTICES)
        };
        Trial::whole(self.clone(), most_places(tubes, 49))
            .with(TrialPasses::of_size(size as f64, Powers::of_growth(law.growth)))
    }

    fn build(&self, task: &Task, seed: u64, target: f64) -> Computation {
        let scene = task.traceable.clone();
        let tubes = &task.traceable.tubes;
        let sizes = |by: By| sizes(self.numbers(), target, tubes, by);
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
    /// `None` where vertices send all light.
    gatherers: Option<Gatherers<C>>,
    targets: Targets,
    /// Numbers of sensors of the grids.
    lengths: Vec<usize>,
    /// Light straight from luminaires in lx, per target.
    direct: Vec<f64>,
    /// True for targets inside solids, which are dark.
    buried: Vec<bool>,
    vertices: u64,
    seed: Key,
}

impl<const C: usize> PlacedVertices<C> {
    /// `photons_and_vertices` per pass; equal seeds give equal bits.
    pub fn new(scene: Arc<TraceableScene>, grids: &[Grid], photons_and_vertices: [u64; 2], seed: u64) -> Self {
        Self::sized(scene, grids, |by| sizes(photons_and_vertices.map(Some), 0.01, &[], by), seed)
    }

    /// `sizes`: numbers of a pass by what is sized.
    fn sized(scene: Arc<TraceableScene>, grids: &[Grid], sizes: impl FnOnce(By) -> Sizes, seed: u64) -> Self {
        let targets = Targets::new(&scene, grids);
        let all: Vec<_> = targets.all().collect();
        let inside = targets.are_inside(grids);
        let is_buried = |(target, inside): (&Target, bool)| inside || scene.is_in_box(target.position);
        let buried: Vec<bool> = all.iter().zip(inside).map(is_buried).collect();
        // nothing is placed for sensors that stay dark
        let lit: Vec<Target> =
            all.iter().zip(&buried).filter(|(_, buried)| !**buried).map(|(target, _)| *target).collect();
        let importance = if scene.interreflection { Importance::new(&scene, &lit) } else { None };
        let by = if gathers(&scene) {
            By::Gathering
        } else {
            let share = lit.len() as f64 / all.len().max(1) as f64;
            let spread = importance.as_deref().filter(|_| scene.obstructed).map_or(0.0, |importance| importance.spread);
            By::Vertices(more_by_obstacles(spread, share))
        };
        let Sizes { photons, vertices, rays } = sizes(by);
        let gatherers = (by == By::Gathering).then(|| Gatherers::new(&scene, &targets, &buried, rays));
        let lamps = Lamps::new(&scene, grids, photons, seed);
        let direct = |sensor: DVec3| {
            let luminaires = scene.luminaires.iter();
            luminaires.map(|luminaire| luminaire.irradiance::<C>(sensor, DVec3::Z).luminance()).sum()
        };
        let direct = all.iter().map(|target| direct(target.position)).collect();
        let lengths = grids.iter().map(Grid::len).collect();
        Self { lamps, importance, gatherers, targets, lengths, direct, buried, vertices, seed: Key::new(seed), scene }
    }

    /// Adds what vertices send to the targets in a pass, and what paths from these find, in lx; `None` when cancelled.
    fn send(
        &self,
        light: &DiffuserLight<C>,
        key: Key,
        cancel: &AtomicBool,
        (lux, account): (&mut [f64], &mut Account),
    ) -> Option<()> {
        if let Some(importance) = &self.importance {
            let stream = key.stream(Stream::PlacedVertices, 0);
            let chunk = |numbers: Range<u64>| self.vertices(light, importance, stream, numbers);
            let chunks = Chunks::of_short_paths(self.vertices);
            let folded = fold_chunks(chunks, 8 * lux.len() as u64, cancel, chunk, |Sums { lux: of_chunk, rays }| {
                lux.iter_mut().zip(&of_chunk).for_each(|(sum, value)| *sum += value);
                account.rays += rays;
            })?;
            account.not_finite = account.not_finite.or(folded.not_finite);
        }
        if self.scene.interreflection {
            let mut places = self.targets.followed.iter().map(|following| following.place);
            let chunk = |numbers: Range<u64>| self.follow(light, key, numbers);
            let chunks = Chunks::of_short_paths(self.targets.followed.len() as u64);
            let folded = fold_chunks(chunks, 0, cancel, chunk, |Sums { lux: of_chunk, rays }| {
                // places last: none of them is taken for a value that is not there
                of_chunk.iter().zip(&mut places).for_each(|(value, place)| lux[place] += value);
                account.rays += rays;
            })?;
            account.not_finite = account.not_finite.or(folded.not_finite);
        }
        Some(())
    }

    /// What vertices of these numbers of a pass send to the targets.
    fn vertices(&self, light: &DiffuserLight<C>, importance: &Importance, stream: Key, numbers: Range<u64>) -> Sums {
        let mut lux = vec![0.0; self.direct.len()];
        let mut rays = RayCount::default();
        let mut scratch = Scratch::default();
        let meeting = NextEvent(light);
        for number in numbers {
            let mut samples = PathSamples::with_pairs(stream, number, SOBOL_PAIRS);
            let placed = importance.place(&self.scene, samples.pair());
            let Some(Before { origin, direction, at_once }) = Before::of(&self.scene, &placed) else { continue };
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
        match &self.gatherers {
            Some(gatherers) => {
                let (importance, vertices) = (self.importance.as_deref(), self.vertices);
                let around = Around { scene: &self.scene, targets: &self.targets, importance, vertices };
                gatherers.pass(&around, &light, key, cancel, (&mut lux, &mut account))?;
            }
            None => self.send(&light, key, cancel, (&mut lux, &mut account))?,
        }
        lux.iter_mut().zip(&self.buried).filter(|(_, buried)| **buried).for_each(|(lux, _)| *lux = 0.0);
        let mut lux = self.targets.in_order_of_grids(&lux).into_iter();
        let of_grid = |length: &usize| {
            let illuminance = lux.by_ref().take(*length).collect();
            GridPass { illuminance, ..GridPass::default() }
        };
        let mut grids: Vec<GridPass> = self.lengths.iter().map(of_grid).collect();
        add_beside(&mut grids, &beside);
        Some(Pass { grids, account, photons: self.lamps.photons(), ..Pass::default() })
    }
}

#[cfg(test)]
mod tests {
    use super::panels::panels;
    use super::*;
    use crate::optics::{Collector, Diffuser, Surface};
    use crate::scene::{
        BoxObject, Channels, Daylight, EstimateKind, Grid, Room, Scene, Segment, StraightOrBent, Tube, TubeShape,
    };
    use crate::sky::zenith::ZenithFormula;
    use crate::sky::{CieType, Sky, SkyDistribution, direction};
    use crate::statistics::Moments;
    use crate::traceable::Follow;
    use glam::DVec2;

    /// Two tubes, one of whose closures reflects, over three boxes, one of them turned and two with a grid beside; the floor is red.
    fn scene() -> Scene {
        let tube = |x: f64, reflectance: f64| Tube {
            centre: DVec2::new(x, 1.1),
            opening_radius: 0.15,
            shape: TubeShape::Cylinders(StraightOrBent {
                reflectance: [0.95; 3].into(),
                segments: vec![Segment { length_m: 0.8, tilt: 0.0, azimuth: 0.0 }],
                collector: Collector::Open,
            }),
            diffuser: Diffuser::Lambertian { transmittance: [0.5, 0.4, 0.3], reflectance: [reflectance; 3] },
        };
        let distribution = SkyDistribution::new(CieType::new(12).unwrap(), direction(0.6, 2.0));
        let sky = Some(Sky { distribution, zenith_luminance_cd_m2: 4000.0 });
        let object = |x: f64, y: f64, height: f64, rotation: f64| BoxObject {
            base: DVec3::new(x, y, 0.0),
            size: DVec3::new(0.5, 0.4, height),
            rotation,
            surface: Surface::diffuse([0.6; 3]),
        };
        let surfaces = [0.5, 0.4, 0.6, 0.3, 0.4, 0.8].map(|red| Some(Surface::diffuse([red, 0.5, 0.5])));
        Scene {
            daylight: Some(Daylight { sky, sun: None, formula: ZenithFormula::GivenZenithLuminance }),
            room: Room {
                size: DVec3::new(3.0, 2.2, 2.5),
                surfaces,
                boxes: vec![object(1.0, 0.6, 1.2, 0.0), object(2.2, 1.4, 0.7, 0.5), object(0.6, 1.7, 2.3, 0.0)],
                meshes: Vec::new(),
                luminaires: Vec::new(),
            },
            tubes: vec![tube(0.5, 0.0), tube(2.1, 0.3)],
            grids: vec![Grid::new("low".into(), 0.3, [5, 4], 0.05, [3.0, 2.2], EstimateKind::Point)],
            views: Vec::new(),
            channels: Channels::Rgb,
        }
    }

    /// Patches decide how much noise there is, never what comes out: where they are black, vertices send everything
    /// but what is followed, and all sensors get the same, within four standard errors of differences.
    #[test]
    fn patches_that_know_nothing_change_no_result() {
        let scene = scene();
        let follow = Follow { interreflection: true, guide_return: true, objects: true };
        let traceable = Arc::new(TraceableScene::new(&scene, follow).unwrap());
        let method =
            |seed: u64, vertices: u64| PlacedVertices::<3>::new(traceable.clone(), &scene.grids, [256, vertices], seed);
        let (knowing, mut unknowing) = (method(1, 256), method(2, 256));
        unknowing.gatherers.as_mut().unwrap().forget(&traceable, &panels(&traceable));
        let moments = |method: &PlacedVertices<3>| {
            let mut moments = vec![Moments::default(); scene.grids[0].len()];
            for pass in 0..150 {
                let pass = method.pass(pass, &AtomicBool::new(false)).unwrap();
                moments.iter_mut().zip(&pass.grids[0].illuminance).for_each(|(moments, lux)| moments.push(*lux));
            }
            moments
        };
        let (knowing, unknowing) = (moments(&knowing), moments(&unknowing));
        let (mut lit, mut variances) = (0, 0.0);
        for (one, other) in knowing.iter().zip(&unknowing) {
            let error = one.standard_error().hypot(other.standard_error());
            assert!((one.mean - other.mean).abs() <= 4.0 * error, "{one:?} {other:?}");
            // one sensor is in a box
            if one.mean > 20.0 * error {
                lit += 1;
                variances += (one.standard_error() / other.standard_error()).powi(2);
            }
        }
        assert!(lit == 19 && variances < 0.5 * f64::from(lit), "{lit} {variances}");
    }
}
