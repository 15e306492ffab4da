//! Sunlight straight through the clear zones of straight pipes at point sensors, computed once before the passes.
//!
//! The arcs of an opening that show the sun ([`sun_arcs`](crate::guide::sun_arcs)) are integrated over the zenith angles of the disc
//! ([`OverDisc`]).

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::through_opening::Backward;
use super::unscattered::openings;
use crate::guide::sun_disc::{OverDisc, SunNode};
use crate::integrator::pass_size::PassSize;
use crate::scene::Sensor;
use crate::traceable::{TraceableScene, TraceableTube};

/// Number of intervals of zenith angles at first: with fewer, kinks and jumps between all places would stay unseen by more than the tolerated
/// error.
const INTERVALS: PassSize = PassSize { for_one_percent: 8.0, growth: 1.0, fewest: 8.0, most: 64.0 };

/// Largest number of sensors whose mean is a scale of errors.
const OF_MEAN: usize = 256;

/// Tolerated error of a sensor's value, relative to the requested standard error.
const TOLERANCE: f64 = 0.1;

/// Sunlight at a sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sunlight {
    /// Illuminance in lx.
    pub lux: f64,
    /// Estimate of its error in lx: the change by the last intervals.
    pub error: f64,
}

/// Computes the illuminances of sensors by the sun straight through the clear zones of straight pipes. Their errors are a small fraction
/// of the requested relative standard error `target`; of a sensor with less than the mean sunlight of some of them, relative to this mean.
/// Once `cancel` is raised, values are not used, and may be wrong.
pub fn sunlight(scene: &TraceableScene, sensors: &[Sensor], target: f64, cancel: &AtomicBool) -> Vec<Sunlight> {
    let intervals = INTERVALS.of(target, 1.0).round() as usize;
    let sunlit = |sensor: &Sensor| SunlitSensor::new(scene, *sensor, intervals, cancel);
    let some: Vec<f64> = sensors
        .par_iter()
        .step_by(sensors.len().div_ceil(OF_MEAN).max(1))
        .map(|sensor| sunlit(sensor).first())
        .collect();
    let mean = some.iter().sum::<f64>() / some.len().max(1) as f64;
    sensors.par_iter().map(|sensor| sunlit(sensor).sunlight(TOLERANCE * target, mean)).collect()
}

/// Sensor with the illuminances in lx by the openings that may show it the sun.
struct SunlitSensor<'a>(Vec<OverDisc<OfNode<'a>>>);

/// Illuminance in lx by one zenith angle of the disc.
type OfNode<'a> = Box<dyn Fn(SunNode, f64) -> f64 + 'a>;

impl<'a> SunlitSensor<'a> {
    fn new(scene: &'a TraceableScene, sensor: Sensor, intervals: usize, cancel: &AtomicBool) -> Self {
        let may_show = |tube: &TraceableTube| tube.sun.is_some() && !cancel.load(Ordering::Relaxed);
        let shown = |(_, backward): (usize, Backward<'a>)| {
            let sun = backward.tube.sun.as_ref().filter(|sun| backward.may_show(sun))?;
            let disc = backward.disc(sun)?;
            let of_node = move |node, step| {
                let cosine = |toward| backward.at.cosine::<3>(toward);
                backward.sun_of_node(sun, &cosine, node, step).luminance()
            };
            Some(OverDisc::new(disc, intervals, Box::new(of_node) as OfNode))
        };
        Self(openings(scene, sensor, may_show).into_iter().filter_map(shown).collect())
    }

    /// Returns the illuminance in lx by the first intervals.
    fn first(&self) -> f64 {
        self.0.iter().map(OverDisc::first).sum()
    }

    /// Computes the illuminance with this error, relative to it or to `least_scale` in lx if that is more.
    fn sunlight(&self, tolerance: f64, least_scale: f64) -> Sunlight {
        let tolerated = tolerance * self.first().max(least_scale);
        let intervals: usize = self.0.iter().map(OverDisc::intervals).sum();
        let refined = self.0.iter().map(|shown| shown.refined(tolerated / (intervals.max(1) as f64).sqrt()));
        let (lux, squared) = refined.fold((0.0, 0.0), |(lux, squares), (of, squared)| (lux + of, squares + squared));
        Sunlight { lux, error: squared.sqrt() }
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, DVec3};

    use super::*;
    use crate::optics::Diffuser;
    use crate::scene::{Daylight, Face};
    use crate::sky::zenith::ZenithFormula;
    use crate::sky::{Sun, direction};
    use crate::traceable::test_rooms::{compiled, empty, straight_tube};

    /// Checks sensors below two tubes against two thousand zenith angles: high and low suns with few and many reflections, seen as a whole,
    /// cut by edges, and not at all. The deviations are a small fraction of the requested error, and of the order of those reported.
    #[test]
    fn errors_are_a_small_fraction_of_the_requested_one() {
        for altitude_deg in [45.0, 60.0, 75.0] {
            let tube = |x: f64| {
                let clear = Diffuser::Clear { transmittance: [0.9; 3] };
                straight_tube((Face::Ceiling as usize, DVec2::new(x, 1.3)), [0.95; 3], clear)
            };
            let mut scene = empty(DVec3::new(4.0, 3.0, 2.5), None);
            let up = direction(f64::to_radians(altitude_deg), 2.0);
            let sun = Some(Sun { direction: up, normal_illuminance_lux: 60_000.0 });
            scene.daylight = Some(Daylight { sky: None, sun, formula: ZenithFormula::GivenZenithLuminance });
            scene.tubes = vec![tube(1.1), tube(2.6)];
            let scene = compiled(&scene);
            let place = |number: u32| DVec3::new(0.2 * f64::from(number % 20), 0.2 * f64::from(number / 20), 0.4);
            let sensors: Vec<Sensor> = (0..300)
                .map(|number| Sensor { position: place(number) + DVec3::new(0.11, 0.07, 0.0), normal: DVec3::Z })
                .collect();
            let truth: Vec<f64> = sensors
                .iter()
                .map(|sensor| {
                    let openings = openings(&scene, *sensor, |_| true);
                    let cosine = |backward: &Backward, toward| backward.at.cosine::<3>(toward);
                    // places on the disc and along the arcs differ, so that errors of both cancel
                    let of_opening = |(_, backward): &(usize, Backward)| -> f64 {
                        let sun = backward.tube.sun.as_ref().unwrap();
                        let part = |number: u32| {
                            let at = [(f64::from(number) + 0.5) / 8.0, (f64::from(number) * 0.618).fract()];
                            backward.sun(sun, &|toward| cosine(backward, toward), 250, at).0.luminance()
                        };
                        (0..8).map(part).sum::<f64>() / 8.0
                    };
                    openings.iter().map(of_opening).sum()
                })
                .collect();
            let mean = truth.iter().sum::<f64>() / truth.len() as f64;
            assert!(mean > 1.0 && truth.contains(&0.0), "{altitude_deg}: {mean}");
            for target in [0.03, 0.01, 0.003] {
                let found = sunlight(&scene, &sensors, target, &AtomicBool::new(false));
                let root_mean_square = |of: fn(&Sunlight, f64) -> f64| {
                    let squared = |(found, truth): (&Sunlight, &f64)| (of(found, *truth) / truth.max(mean)).powi(2);
                    (found.iter().zip(&truth).map(squared).sum::<f64>() / truth.len() as f64).sqrt()
                };
                let deviation = root_mean_square(|found, truth| found.lux - truth);
                let reported = root_mean_square(|found, _| found.error);
                assert!(deviation < 0.05 * target, "{altitude_deg} {target}: {deviation}");
                assert!(deviation < 5.0 * reported, "{altitude_deg} {target}: {deviation} {reported}");
            }
        }
    }
}
