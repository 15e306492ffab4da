//! Two stages: the path is cut at Lambertian diffusers, which forget where light came from.
//!
//! **Idea.** In each pass photons first find the flux that leaves the diffusers ([`diffuser_source`](super::diffuser_source)). Then paths
//! go backward from the sensors and the eye (`backward::walk`), and every vertex is connected to some of these photons. A coarse
//! solution of the light that surfaces reflect ([`radiosity`](super::radiosity)) is a control variate: rays count it, and some continue for
//! its residual. The stages are independent, and the second is linear in the first: every pass is unbiased, one replicate. The sensors of a
//! grid share one estimate of the residual as far as they do not differ; their possible differences are part of their errors
//! (`estimate::residual`).
//!
//! **Which paths** (docs/physics/measurement_equation.md#two-stages). A vertex V is *far* beyond one radius from a
//! disc.
//!
//! | paths | estimator |
//! | --- | --- |
//! | `(K\|N) t F E`, far sensors that see all discs, and the eye | every photon, connected |
//! | `(K\|N) t F V`, far, disc above the horizon, nothing between, no lobe | one photon, chosen by its flux, connected |
//! | `(K\|N) t F V`, else | two photons, connected; from within a quarter of the radius as path tracing |
//! | `(K\|N) t F V`, a lobe below a roughness of 0.2 | as path tracing |
//! | `K t F S+ (V\|E)`, `M S+ (V\|E)` by plane mirrors | connections to images |
//! | the same by other mirrors | chance |
//! | `M ..` and interreflection, light sent up and back included | as path tracing, around the coarse solution |
//! | `(K\|N) t C ..` of level grids, below closures that are Lambertian in part | as light tracing ([`closure_source`](super::diffuser_source::closure_source)) |
//! | all light of points close to a surface, below such closures | as bidirectional path tracing ([`close`]) |
//! | `(K\|N) t C V` of other sensors, below straight tubes in diffuse rooms | the sky by a ray through an opening, the sun by arcs |
//!
//! **Settings.** `photons_per_pass` (64 to 16 777 216; with views 8192 to 65 536 by default) against `samples_per_sensor` (1 to 65 536) and
//! `samples_per_pixel` (8; 1 to 4096): noise of the first stage is common to all sensors of a pass, that of the second is each sensor's
//! own. The first two are by default chosen for the requested accuracy, photons without views, and paths by a small trial in the room, so
//! that about 8 passes reach it. Each pass estimates the daylight coefficients of a room from one replicate of its matrix
//! ([`room_matrix`](super::room_matrix)).
//!
//! **Refuses** closures without a Lambertian zone, with views all that pass light unscattered, both except where vertices are connected to
//! clear zones; measured diffusers; and the sun reflected by lobes below a roughness of 0.2, by mirrors of meshes and by long chains of
//! mirrors. Bad at diffusers that mirrors of meshes show (it warns). The fluxes of tubes are those of the first stage; a few photons
//! estimate the energy balance of the room.
//!
//! **Sources.** The cut is derived here (docs/physics/measurement_equation.md#two-stages); Kajiya 1986, Veach and
//! Guibas 1995.

mod close;
mod coarse;
mod passes;
mod responses;
mod sample_counts;
mod settings;
mod sizes;
mod starts;
mod straight;
mod trial;
mod variances;

pub use passes::TwoStage;
pub use settings::Settings;

use std::sync::atomic::Ordering;

use crate::integrator::backward::chance;
use crate::integrator::diffuser_source::closure_source::{
    Beside, ClosureSource, all_lambertian, directional_bytes, of_light_tracing, refuses_all_but_lambertian,
    refuses_directional,
};
use crate::integrator::method::{Caveat, Computation, Described, Load, Outputs, Refusal, Retained, Task, Trial};
use crate::integrator::trial::{Powers, TrialPasses};
use crate::scene::{Channels, Grid, Responses};
use close::{CloseSensors, refuses_close};
use coarse::{Coarse, pixels};
use sample_counts::{PATHS, SampleCounts};
use starts::starts;

impl Described for Settings {
    fn name(&self) -> &'static str {
        "two_stage"
    }

    fn remark(&self) -> Option<&'static str> {
        Some("photons are traced to the diffusers, and paths backward from sensors and cameras in the room")
    }

    fn outputs(&self) -> Outputs {
        Outputs { any_sensors: true, ..Outputs::ALL }
    }

    fn computes_responses(&self) -> bool {
        true
    }

    /// Refuses closures that do not forget directions, and sunlight that paths would find only by chance, reflected by mirrors.
    fn refuses(&self, task: &Task) -> Option<Refusal> {
        refuses_closures(task).or_else(|| chance::sun_by_other_mirrors(task.traceable))
    }

    fn warns(&self, task: &Task) -> Option<Caveat> {
        let has_responses = task.grids.iter().any(|grid| grid.responses.are_reported());
        // paths from sensors to patches find mirrors by chance
        let of_responses = || has_responses.then(|| chance::mirrors(self.name(), task.traceable)).flatten();
        chance::other_mirrors(self.name(), task.traceable).or_else(of_responses)
    }

    fn retained_per_sensor(&self, _: &Grid) -> Retained {
        Retained { contrasts: 1.0, ..Retained::MEANS }
    }

    fn working_bytes(&self, load: &Load) -> f64 {
        // a place on the diffuser, the flux, and an offset for cells
        let photons = self.photons_per_pass.map_or(SampleCounts::most_photons(), |photons| photons as f64);
        photons * load.photon_bytes() * Load::COPIES + directional_bytes(load, photons)
    }

    fn trial(&self, task: &Task, target: f64) -> Trial {
        if task.views.is_empty() && self.samples_per_sensor.is_none() {
            let whole = Trial::whole(self.clone(), Beside::of(task).most_places(49));
            let mut powers = Powers::of_growth(PATHS.growth);
            if task.grids.iter().any(|grid| grid.responses == Responses::ToPatches) {
                // these take most of the time, and as much of it at every accuracy
                powers.work_of_place = 0.0;
            }
            return whole.with(TrialPasses::of_size(PATHS.of(target, 1.0), powers));
        }
        // each place has the noise of its own paths, whose number does not change, and all share the noise of the photons
        let powers = Powers { work_of_place: 0.0, variance: 0.0, ..Powers::OF_PHOTONS };
        let photons = self.photons_per_pass.unwrap_or_else(|| SampleCounts::photons(target, task, Beside::of(task)));
        let tried = TrialPasses::fewer(photons, 0.125);
        let smaller = Self { photons_per_pass: Some(tried), ..self.clone() };
        let most_places = if task.views.is_empty() { 9 } else { 512 };
        Trial::whole(smaller, most_places).with(TrialPasses::of_photons(tried, photons, powers))
    }

    fn build(&self, task: &Task, seed: u64, target: f64) -> Computation {
        match task.scene.channels {
            Channels::Photopic => Computation::passes(TwoStage::<1>::new(task, self, seed, target)),
            Channels::Rgb => Computation::passes(TwoStage::<3>::new(task, self, seed, target)),
        }
    }
}

/// Returns the reason why paths cannot be cut at the closures, if there is one: directional light of closures is computed for
/// level grids only, and near an opening paths would follow all light that a measured closure scatters.
fn refuses_closures(task: &Task) -> Option<Refusal> {
    let tubes = &task.traceable.tubes;
    if Beside::of(task) == Beside::Connected {
        return None;
    }
    let measured = tubes.iter().any(|tube| tube.diffuser.measured().is_some());
    let by_lambertian = measured || !task.views.is_empty() || task.has_placed_sensors();
    if by_lambertian || all_lambertian(tubes) {
        return refuses_all_but_lambertian(tubes);
    }
    refuses_directional(task).or_else(|| refuses_close(task).map(of_light_tracing))
}

/// Initial length of an edge of a patch, as a fraction of the room's shortest edge, and the factor above which shorter edges are not worth
/// another solution.
const EDGE: f64 = 1.0 / 6.0;
const WORTHWHILE: f64 = 0.8;

impl<const C: usize> TwoStage<C> {
    /// Builds the method for a relative standard error `target`; equal seeds give equal bits.
    pub fn new(task: &Task, settings: &Settings, seed: u64, target: f64) -> Self {
        let scene = task.traceable;
        let (starts, beside) = (starts(scene, task.all_grids, task.views), Beside::of(task));
        let mut edge = EDGE * scene.enclosure.shortest_edge_m();
        let by = (seed, target);
        let mut coarse = Coarse::new((task, beside), &starts, edge, by);
        let (mut sizes, variances) = Self::sizes((task, beside), settings, coarse.as_ref(), by);
        if let Some(Coarse { rays, .. }) = coarse {
            let sensors: Vec<usize> = task.all_grids.iter().map(Grid::valued).collect();
            let finer = sizes.finer(target, &variances, rays, (&sensors, pixels(task.views)));
            if finer < WORTHWHILE && !task.cancel.load(Ordering::Relaxed) {
                edge *= finer;
                coarse = Coarse::new((task, beside), &starts, edge, by);
                (sizes, _) = Self::sizes((task, beside), settings, coarse.as_ref(), by);
            }
        }
        let shares = Self::divided((task, beside), settings, coarse.as_ref(), by, &mut sizes);
        let room = Self::responses((task, beside), settings, coarse.as_ref(), by);
        let close = CloseSensors::new((scene, beside), task.grids, seed, target);
        let outputs = (task.grids, task.views);
        let closures = ClosureSource::new((task, beside), task.grids, (sizes.photons, target), seed);
        let made = Self::with_sizes((scene, closures), outputs, sizes, coarse.as_ref(), seed);
        Self { room, close, shares, ..made }
    }
}
