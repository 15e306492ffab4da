//! Bidirectional path tracing as the plan knows it: what it refuses, its memory, its trial.

use super::light::LightVertex;
use super::settings::MOST;
use super::{Bidirectional, Settings, refusals};
use crate::integrator::backward::chance;
use crate::integrator::method::{Caveat, Computation, Described, Load, Refusal, Retained, Task, Trial};
use crate::integrator::photon::chunks::concurrent_sums;
use crate::integrator::trial::{Powers, TrialPasses};
use crate::scene::{Channels, Grid};

impl Described for Settings {
    fn name(&self) -> &'static str {
        "bidirectional_path_tracing"
    }

    fn refuses(&self, task: &Task) -> Option<Refusal> {
        refusals::refuses(task)
    }

    fn warns(&self, task: &Task) -> Option<Caveat> {
        // cells count the light that a mirror shows them where it crosses them
        let mirrors = match (task.grids.is_empty(), task.has_points()) {
            (true, _) => chance::mirrors_in_views,
            (false, true) => chance::mirrors,
            (false, false) => chance::mirrors_at_cells,
        };
        mirrors(self.name(), task.traceable)
    }

    fn working_bytes(&self, load: &Load) -> f64 {
        let vertex = if load.channels == 1 { size_of::<LightVertex<1>>() } else { size_of::<LightVertex<3>>() };
        self.photons_per_pass.map_or(MOST, |photons| photons as f64)
            * (1.0 + load.events)
            * vertex as f64
            * Load::COPIES
    }

    fn retained_per_sensor(&self, grid: &Grid) -> Retained {
        let photons = self.photons_per_pass.unwrap_or(MOST as u64);
        Retained { concurrent_sums: concurrent_sums(grid.len(), photons) as f64, ..Retained::MEANS }
    }

    fn trial(&self, task: &Task, target: f64) -> Trial {
        let counts = self.path_counts(target, !task.views.is_empty());
        let (fraction, most_places, powers) = if task.views.is_empty() {
            (0.5, 36, Powers::OF_PHOTONS)
        } else {
            // the noise is that of the eye paths, each of which is connected to one photon
            (0.0625, 1024, Powers { work_of_place: 0.0, variance: 0.0, shared_variance: 0.0, ..Powers::OF_PHOTONS })
        };
        let tried = TrialPasses::fewer(counts.photons, fraction);
        let samples = f64::from(counts.per_sensor) * tried as f64 / counts.photons as f64;
        let samples_per_sensor = Some((samples as u32).max(1));
        let smaller = Self { photons_per_pass: Some(tried), samples_per_sensor, ..self.clone() };
        Trial::whole(smaller, most_places).with(TrialPasses::of_photons(tried, counts.photons, powers))
    }

    fn build(&self, task: &Task, seed: u64, target: f64) -> Computation {
        let scene = task.traceable.clone();
        let counts = self.path_counts(target, !task.views.is_empty());
        match task.scene.channels {
            Channels::Photopic => {
                Computation::passes(Bidirectional::<1>::new(scene, task.grids, task.views, counts, seed))
            }
            Channels::Rgb => Computation::passes(Bidirectional::<3>::new(scene, task.grids, task.views, counts, seed)),
        }
    }
}
