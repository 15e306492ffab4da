//! HOLIGILM on a compiled scene: hollow light guides without random walks (`analytic::holigilm` solves it).
//!
//! **Idea.** Flux at the diffuser by a series or a low-discrepancy rule, the diffuser's exitance in rings and sectors,
//! the room by radiosity. One computation, with its numerical error.
//!
//! **Which paths** (docs/physics/measurement_equation.md#holigilm):
//!
//! | paths | estimator |
//! | --- | --- |
//! | `(K\|N) t F` flux | straight tubes: exact series; bent ones: a Sobol rule |
//! | `.. F E` | rings in closed form, sectors as points |
//! | `K t C E` | points: integral over the clear zone, backward; cells: rays forward |
//! | `N t C E` | points: the arcs of the opening that show the disc; cells: rays forward |
//! | `.. D+ E` | radiosity |
//!
//! **Settings.** None: it adds rays until the job's accuracy is reached, or a cap.
//!
//! **Refuses** views; what all solvers refuse (`deterministic`): colours, mesh tubes, square closures, objects, luminaires, specular
//! surfaces, measured diffusers, mirrors by angle, collectors that bend light, horizons; of its own: the sun at points through clear closures
//! of bent tubes, light that these return to a room with interreflection, and rooms that absorb nothing.
//!
//! **Sources.** Kocifaj, Darula and Kittler 2008, formulated from the physics; Swift and Smith 1995 for the series.

use super::deterministic::{installation, refuses};
use super::method::{Computation, Described, Load, Outputs, Passes, Refusal, RefusalCode, Task, Trial};
use crate::analytic::holigilm::Holigilm;
use crate::analytic::patches::Mesh;
use crate::guide::Guide;

/// Settings of the method: it has none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Settings {}

/// Bytes of the tables of light that leaves the openings.
const TABLES: f64 = 48e6;

/// Bytes of a form factor between two patches of the room, stored as computed and as balanced.
const FACTOR: f64 = 16.0;

/// Bytes of a patch of the room that sunbeams light everywhere: the light of 1024 cells in 8 randomisations, stored as counted and in a
/// tree.
const LIT_PATCH: f64 = 200e3;

impl Described for Settings {
    fn name(&self) -> &'static str {
        "holigilm"
    }

    fn passes(&self) -> Passes {
        Passes::None
    }

    fn outputs(&self) -> Outputs {
        Outputs { views: false, ..Outputs::ALL }
    }

    fn refuses(&self, task: &Task) -> Option<Refusal> {
        refuses(task).or_else(|| refuses_bent_or_lossless(task))
    }

    fn working_bytes(&self, load: &Load) -> f64 {
        let patches = Mesh::fine_count(load.size) as f64;
        let spots = if load.sunbeams { LIT_PATCH * patches } else { 0.0 };
        TABLES + FACTOR * patches.powi(2) + spots
    }

    fn trial(&self, _: &Task, _target: f64) -> Trial {
        Trial::whole(self.clone(), usize::MAX)
    }

    fn build(&self, task: &Task, seed: u64, target: f64) -> Computation {
        Computation::solution(Holigilm::new(installation(task.traceable, task.grids), target, seed))
    }
}

/// Returns the method's own reason for a refusal: light through clear closures of bent tubes, or a room that absorbs nothing.
fn refuses_bent_or_lossless(task: &Task) -> Option<Refusal> {
    let Task { scene, traceable, .. } = task;
    let bent_and_clear =
        traceable.tubes.iter().any(|tube| !matches!(tube.guide, Guide::Straight(_)) && tube.specular_zone().is_some());
    let lossless = scene
        .room
        .enclosure
        .faces()
        .iter()
        .all(|face| face.surface.is_some_and(|surface| surface.reflectance[0] >= 1.0));
    if bent_and_clear && task.has_points() && traceable.has_sun() {
        let detail = "it cannot compute sunlight that reaches points through a clear closure of a bent tube";
        Some(Refusal::new(RefusalCode::ClearClosuresOfBentTubes, detail).or("`estimate` cell_average"))
    } else if bent_and_clear && traceable.guide_return && traceable.interreflection {
        let detail = "it cannot compute light from the room that a bent tube with a clear closure sends back";
        Some(Refusal::new(RefusalCode::ClearClosuresOfBentTubes, detail).or("the effect `guide_return` off"))
    } else if traceable.interreflection && lossless {
        let detail = "the room absorbs no light, so interreflection has no finite solution";
        Some(Refusal::new(RefusalCode::LosslessRoom, detail))
    } else {
        None
    }
}
