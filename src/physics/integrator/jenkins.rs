//! The formula of Jenkins, Muneer and Kubie on a compiled scene (`analytic::jenkins` computes it).
//!
//! **Idea.** E = c Phi cos^4(theta) / V^2 for each tube: a point source of the tube's flux, with a coefficient that was
//! fitted in a room.
//!
//! **Which paths.** None one by one: the coefficient c covers `(K|N) t .. E` and the reflections of an unspecified room
//! (docs/physics/tubes.md#empirical-formula-of-jenkins-muneer-and-kubie).
//!
//! **Settings.** `coefficient` (0.494; above 0, at most 10), `pipe_transmittance` (0 to 1; by default exact, of a pipe
//! as long as wide under the job's daylight), `bend_factor` (0 to 1; no default, needed for bends).
//!
//! **Refuses** views; what all solvers refuse (`deterministic`), bends without a factor, tilted upper ends, and reflecting rooms whose interreflection is
//! switched off. Bad at every room but the one of the fit: it warns that it returns c pi = 1.55 times the flux. It reports neither an error
//! nor an energy balance.
//!
//! **Sources.** Jenkins, Muneer and Kubie 2005.

use std::f64::consts::PI;

use super::deterministic::{cylinders, installation, refuses};
use super::method::{Caveat, CaveatCode, Computation, Described, Outputs, Passes, Refusal, RefusalCode, Task, Trial};
use crate::analytic::jenkins::{Jenkins, Pipe};
use crate::scene::{Scene, StraightOrBent, Tube};

pub use crate::analytic::jenkins::Settings;

impl Described for Settings {
    fn name(&self) -> &'static str {
        "jenkins"
    }

    fn passes(&self) -> Passes {
        Passes::None
    }

    fn outputs(&self) -> Outputs {
        // the formula follows no light to its end
        Outputs { views: false, energy: false, ..Outputs::ALL }
    }

    fn refuses(&self, task: &Task) -> Option<Refusal> {
        refuses(task).or_else(|| {
            let bent = task.scene.tubes.iter().filter_map(|tube| cylinders(&tube.shape)).any(|tube| tube.bends() > 0);
            if bent && self.bend_factor.is_none() {
                let detail = "the loss of a bend must be given, because no published value holds for all tubes";
                Some(Refusal::new(RefusalCode::SettingMissing, detail).or("the setting `bend_factor`"))
            } else if task.scene.tubes.iter().any(is_tilted) {
                let detail = "its formula takes the horizontal illuminance, which is not that of a tilted upper end";
                Some(Refusal::new(RefusalCode::TiltedEnds, detail))
            } else if !task.traceable.interreflection && reflects(task.scene) {
                let detail = "its coefficient includes the reflections of a room, which cannot be switched off";
                Some(Refusal::new(RefusalCode::InterreflectionOff, detail))
            } else {
                None
            }
        })
    }

    fn warns(&self, _: &Task) -> Option<Caveat> {
        let (coefficient, excess) = (self.coefficient, self.coefficient * PI);
        Some(Caveat {
            code: CaveatCode::FluxExcess,
            detail: format!(
                "the formula is semi-empirical: summed over the whole plane it gives {excess:.3} times the flux that \
                 the tube sends into the room; its coefficient {coefficient} includes the reflections of the room \
                 where it was fitted, the reflectances of this room have no influence, and the error is unknown"
            ),
        })
    }

    fn trial(&self, _: &Task, _target: f64) -> Trial {
        Trial::whole(self.clone(), usize::MAX)
    }

    fn build(&self, task: &Task, _seed: u64, _target: f64) -> Computation {
        let tubes = task.scene.tubes.iter();
        // tubes given as meshes are refused
        let pipes = tubes.filter_map(|tube| Some(pipe(cylinders(&tube.shape)?, tube.opening_radius)));
        let room = installation(task.traceable, task.grids);
        Computation::solution(Jenkins::new(room, pipes.collect(), self.clone()))
    }
}

/// True if a face of the room reflects light.
fn reflects(scene: &Scene) -> bool {
    scene.room.enclosure.surfaces().any(|surface| surface.reflectance[0] > 0.0)
}

/// True if the upper end of a tube has a tilted pane, or leans above bright ground.
fn is_tilted(tube: &Tube) -> bool {
    let bright = tube.surroundings.as_ref().is_some_and(|around| around.ground_luminance_cd_m2 > 0.0);
    let leans = |cylinders: &StraightOrBent| cylinders.segments.last().is_some_and(|last| last.tilt != 0.0);
    cylinders(&tube.shape).is_some_and(|cylinders| cylinders.cut.is_some() || (bright && leans(cylinders)))
}

fn pipe(tube: &StraightOrBent, radius: f64) -> Pipe {
    Pipe {
        aspect: tube.segments.iter().map(|segment| segment.length_m).sum::<f64>() / (2.0 * radius),
        bends: tube.bends(),
        reflectance: tube.reflectance.reflectance(|| 1.0)[0],
        collector_transmittance: tube.collector.transmittance()[0],
    }
}
