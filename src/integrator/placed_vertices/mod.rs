//! Placed vertices: a tube is a lamp, and the room is lit by points placed where sensors need them.
//!
//! **Idea.** In each pass photons first find what leaves the diffusers ([`lamp`](super::lamp)), and each is connected to
//! every sensor. Then points are placed on the surfaces of the room, where these are bright and near to sensors
//! (`importance`). One backward path from each tells the luminance that it sends into the room, counting at every surface
//! the light of the diffusers in closed form, or nearly so; the point is connected to every sensor. One pass is one
//! replicate.
//!
//! **Which paths** (docs/physics/measurement_equation.md#placed-vertices).
//!
//! | paths | estimator |
//! | --- | --- |
//! | `(K\|N) t F E` | every photon, connected |
//! | `M E` | Lambert's closed form |
//! | `.. V E` | placed vertices, openings that send light back included; what lights them as in two stages |
//!
//! **Settings.** `photons_per_pass` and `vertices_per_pass` (64 to 16 777 216; by default chosen for the accuracy asked
//! for, so that 8 to some tens of passes reach it): noise of the first stage is common to all sensors of a pass.
//!
//! **Refuses** views, cell averages, closures that pass light unscattered, measured diffusers, glossy surfaces and mirrors,
//! objects, luminaires that something may hide, and sensors very near to surfaces, which `auto` gives another
//! method. Tells no balance of energy; the fluxes of tubes are those of the first stage.
//!
//! **Sources.** Importance for a sum of squared relative errors is derived from Veach 1997, section 2.2
//! (docs/physics/measurement_equation.md#placed-vertices); the cut at diffusers is that of two stages.

mod importance;

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use glam::DVec3;

use crate::guide::{Guide, RayCount};
use crate::integrator::backward::next_event::{NextEvent, Way};
use crate::integrator::backward::walk::{Ray, Walk};
use crate::integrator::lamp::light::DiffuserLight;
use crate::integrator::method::{Computation, Described, Kept, Knows, Load, Refusal, RefusalCode, Task, Work};
use crate::integrator::photon::chunks::{Tally, fold_chunks, sums_at_once};
use crate::integrator::photon::close_points::dishonest_points;
use crate::integrator::photon::connect::{Connection, SensorPlane};
use crate::integrator::photon::emission::Emission;
use crate::integrator::{GridPass, Integrator, Pass};
use crate::optics::{Diffuser, Spectrum};
use crate::sampling::{Key, PathSamples, Stream};
use crate::scene::{Channels, EstimateKind, Grid};
use crate::traceable::{TraceableScene, TraceableTube};
use importance::Importance;

/// Settings of placed vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Settings {
    /// Photons from sky and sun per pass, all tubes together; 64..=16_777_216; `None`: by the accuracy asked for.
    pub photons_per_pass: Option<u64>,
    /// Vertices on the surfaces of the room per pass; 64..=16_777_216; `None`: by the accuracy asked for.
    pub vertices_per_pass: Option<u64>,
}

/// Photons for each tube, and vertices, of a pass of a job that asks for a relative standard error of 1 %; a ray through a straight
/// guide is worth several through bends and facets.
const PHOTONS_FOR_ONE_PERCENT: f64 = 64.0;
const PHOTONS_OF_OTHER_GUIDES: f64 = 256.0;
const VERTICES_FOR_ONE_PERCENT: f64 = 128.0;

/// Power of the standard error by which photons and vertices of a pass grow: even points do better than the square root.
const GROWTH_OF_PHOTONS: f64 = 1.2;
const GROWTH_OF_VERTICES: f64 = 1.6;

/// Fewest and most of either, unless the document says how many.
const LEAST: f64 = 64.0;
const MOST: f64 = 65_536.0;

impl Settings {
    /// Photons and vertices of a pass for a relative standard error `target`.
    fn sizes(&self, target: f64, tubes: &[TraceableTube]) -> [u64; 2] {
        let scale = 0.01 / target;
        // whole rows of small nets
        let size = |number: f64| (number.clamp(LEAST, MOST) / LEAST).round() as u64 * LEAST as u64;
        let of_tube = |tube: &TraceableTube| match tube.guide {
            Guide::Straight(_) => PHOTONS_FOR_ONE_PERCENT,
            _ => PHOTONS_OF_OTHER_GUIDES,
        };
        let photons = size(tubes.iter().map(of_tube).sum::<f64>() * libm::pow(scale, GROWTH_OF_PHOTONS));
        let vertices = size(VERTICES_FOR_ONE_PERCENT * libm::pow(scale, GROWTH_OF_VERTICES));
        [self.photons_per_pass.unwrap_or(photons), self.vertices_per_pass.unwrap_or(vertices)]
    }
}

impl Described for Settings {
    fn name(&self) -> &'static str {
        "placed_vertices"
    }

    fn knows(&self) -> Knows {
        Knows { energy: false, views: false, ..Knows::ALL }
    }

    fn remark(&self) -> Option<&'static str> {
        Some("photons to the diffusers, then points placed on the room's surfaces")
    }

    fn refuses(&self, task: &Task) -> Option<Refusal> {
        refuses_scene(task).or_else(|| dishonest_points(task.traceable, task.grids))
    }

    fn seconds_per_pass(&self, work: &Work) -> f64 {
        let [photons, vertices] = self.sizes(0.01, &[]).map(|number| number as f64);
        photons * work.tubes * (work.seconds_per_path + 1e-9 * work.sensors)
            + vertices * (0.5e-6 + 0.3e-6 * work.tubes + 1e-9 * work.sensors)
    }

    fn working_bytes(&self, load: &Load) -> f64 {
        let photons = self.photons_per_pass.map_or(MOST, |photons| photons as f64);
        photons * load.photon_bytes() * Load::COPIES
    }

    fn kept_of_sensor(&self, grid: &Grid) -> Kept {
        let vertices = self.vertices_per_pass.unwrap_or(MOST as u64);
        let sums_at_once = sums_at_once(grid.len(), vertices) as f64;
        Kept { sums_at_once, ..Kept::MEANS }
    }

    fn build(&self, task: &Task, seed: u64, target: f64) -> Computation {
        let scene = task.traceable.clone();
        let sizes = self.sizes(target, &scene.tubes);
        match task.scene.channels {
            Channels::Photopic => Computation::passes(PlacedVertices::<1>::new(scene, task.grids, sizes, seed)),
            Channels::Rgb => Computation::passes(PlacedVertices::<3>::new(scene, task.grids, sizes, seed)),
        }
    }
}

/// Reason why the method cannot compute a task wherever its sensors are, if it cannot.
pub fn refuses_scene(task: &Task) -> Option<Refusal> {
    let scene = task.traceable;
    let refusal = |code, detail: &str| Some(Refusal::new(code, detail));
    let measured = |tube: &TraceableTube| matches!(tube.diffuser, Diffuser::Measured(_));
    let unscattered = |tube: &TraceableTube| tube.diffuser.specular_zone(tube.opening_radius).is_some();
    if scene.tubes.iter().any(unscattered) {
        refusal(RefusalCode::ClearClosures, "a closure lets light pass unscattered")
    } else if scene.tubes.iter().any(measured) {
        refusal(RefusalCode::MeasuredDiffusers, "light leaves a measured diffuser by its direction of incidence")
    } else if scene.specular_surfaces().next().is_some() {
        refusal(RefusalCode::SpecularSurfaces, "the room's surfaces are not all diffuse")
    } else if scene.meshes.is_some() {
        refusal(RefusalCode::Objects, "vertices are placed on faces of the room and of boxes, not on meshes")
    } else if scene.luminaires_obstructed {
        refusal(RefusalCode::Luminaires, "direct light has a closed form only where no object or luminaire can hide it")
    } else if task.grids.iter().any(|grid| grid.estimate == EstimateKind::CellAverage) {
        let detail = "connections to random points of cells beside walls have no bounded variance";
        refusal(RefusalCode::CellAverages, detail)
    } else {
        None
    }
}

/// Reflections of a path that no roulette decides: it would throw away what even points gain.
const CERTAIN_REFLECTIONS: u32 = 3;

/// Pairs of Sobol coordinates of a vertex and its path.
const SOBOL_PAIRS: u32 = 4;

/// The method on one scene; `C` channels of light.
#[derive(Debug)]
pub struct PlacedVertices<const C: usize> {
    scene: Arc<TraceableScene>,
    emission: Emission,
    /// `None` where no surface sends light to a sensor.
    importance: Option<Importance>,
    planes: Vec<SensorPlane>,
    /// Light straight from luminaires in lx, per sensor.
    direct: Vec<f64>,
    /// True for sensors inside boxes, which are dark.
    buried: Vec<bool>,
    vertices: u64,
    vectors: pulp::Arch,
    seed: Key,
}

/// Illuminance in lx per sensor by some vertices, and the rays that they took.
type Sums = (Vec<f64>, RayCount);

impl Tally for Sums {
    fn is_finite(&self) -> bool {
        self.0.iter().all(|lux| lux.is_finite())
    }
}

impl<const C: usize> PlacedVertices<C> {
    /// `photons` and `vertices` per pass; equal seeds give equal bits.
    pub fn new(scene: Arc<TraceableScene>, grids: &[Grid], [photons, vertices]: [u64; 2], seed: u64) -> Self {
        let emission = Emission::of_daylight(&scene, photons);
        let importance = Some(()).filter(|()| scene.interreflection).and_then(|()| Importance::new(&scene, grids));
        let mut planes = Vec::new();
        let mut first = 0;
        for grid in grids {
            planes.push(SensorPlane::new(grid, first));
            first += grid.len();
        }
        let centres = || grids.iter().flat_map(|grid| (0..grid.len()).map(|sensor| grid.centre(sensor)));
        let direct = centres().map(|sensor| {
            let luminaires = scene.luminaires.iter();
            luminaires.map(|luminaire| luminaire.irradiance::<C>(sensor, DVec3::Z).luminance()).sum()
        });
        let (direct, buried) = (direct.collect(), centres().map(|sensor| scene.is_in_box(sensor)).collect());
        let (vectors, seed) = (pulp::Arch::new(), Key::new(seed));
        Self { emission, importance, planes, direct, buried, vertices, vectors, seed, scene }
    }

    /// Adds what a Lambertian point of this intensity along its normal, in cd, sends straight to all sensors.
    fn connect(&self, position: DVec3, normal: DVec3, intensity: f64, lux: &mut [f64]) {
        for plane in &self.planes {
            let depth = position.z - plane.height;
            if depth <= 0.0 {
                continue;
            }
            let lux = &mut lux[plane.first..plane.first + plane.len()];
            let connection = Connection { vertex: position, normal, depth, per_sr: intensity, near_squared: 0.0 };
            if !self.scene.obstructed {
                connection.add_to(self.vectors, lux, &plane.x, &plane.y);
                continue;
            }
            for (index, lux) in lux.iter_mut().enumerate() {
                let (x, y) = (plane.x[index], plane.y[index]);
                let value = connection.illuminance(x, y);
                let sensor = DVec3::new(x, y, plane.height);
                if value > 0.0 && self.scene.visible(position, None, sensor, None) {
                    *lux += value;
                }
            }
        }
    }

    /// What vertices of these numbers of a pass send to the sensors.
    fn vertices(&self, light: &DiffuserLight<C>, importance: &Importance, stream: Key, numbers: Range<u64>) -> Sums {
        let mut lux = vec![0.0; self.direct.len()];
        let mut rays = RayCount::default();
        let clearance = CLEARANCE * self.scene.coinciding();
        let meeting = NextEvent(light);
        for number in numbers {
            let mut samples = PathSamples::with_pairs(stream, number, SOBOL_PAIRS);
            let placed = importance.place(samples.pair());
            let mut walk = Walk::<C>::new(&self.scene, samples, CERTAIN_REFLECTIONS);
            // seen from just before it, it may be an opening, or hidden
            let origin = placed.position + placed.normal * clearance;
            let (direction, weight, trace) = (-placed.normal, Spectrum::ONE, Way::COUNTED);
            walk.follow(&meeting, Ray { origin, direction, from: None, weight, reflected: true, trace });
            rays += walk.rays;
            let intensity = walk.sum.luminance() * placed.area_m2 / self.vertices as f64;
            if intensity > 0.0 {
                self.connect(origin, placed.normal, intensity, &mut lux);
            }
        }
        (lux, rays)
    }
}

/// Distance at which a vertex stands before its surface, in distances at which surfaces coincide.
const CLEARANCE: f64 = 4.0;

impl<const C: usize> Integrator for PlacedVertices<C> {
    fn pass(&self, pass: u64, cancel: &AtomicBool) -> Option<Pass> {
        let key = self.seed.stream(Stream::Pass, pass);
        let (light, mut account) = DiffuserLight::<C>::trace(&self.scene, &self.emission, key, cancel)?;
        let mut lux = self.direct.clone();
        for tube in light.tubes() {
            for (position, flux) in tube.photons() {
                self.connect(position, DVec3::NEG_Z, flux.luminance() / std::f64::consts::PI, &mut lux);
            }
        }
        if let Some(importance) = &self.importance {
            let stream = key.stream(Stream::PlacedVertices, 0);
            let chunk = |numbers: Range<u64>| self.vertices(&light, importance, stream, numbers);
            let chunk_bytes = 8 * lux.len() as u64;
            let folded = fold_chunks(self.vertices, chunk_bytes, cancel, chunk, |(of_chunk, rays): Sums| {
                lux.iter_mut().zip(&of_chunk).for_each(|(sum, value)| *sum += value);
                account.rays += rays;
            })?;
            account.not_finite = account.not_finite.or(folded.not_finite);
        }
        lux.iter_mut().zip(&self.buried).filter(|(_, buried)| **buried).for_each(|(lux, _)| *lux = 0.0);
        let of_plane = |plane: &SensorPlane| GridPass {
            illuminance: lux[plane.first..plane.first + plane.len()].to_vec(),
            ..GridPass::default()
        };
        let grids = self.planes.iter().map(of_plane).collect();
        Some(Pass { grids, account, photons: self.emission.photons(), ..Pass::default() })
    }
}
