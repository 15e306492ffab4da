//! Sunlight straight through the clear zones of straight pipes at point sensors, computed once before the passes.
//!
//! The arcs of an opening that show the sun ([`sun_arcs`](crate::guide::sun_arcs)) are integrated over the zenith angles of the disc by
//! Simpson's rule, which halves the intervals where the integrand has a kink or a jump: where an edge cuts the visible disc, or the number
//! of reflections changes.

use std::f64::consts::FRAC_1_SQRT_2;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::through_opening::Backward;
use super::unscattered::openings;
use crate::guide::sun_arcs::SunDisc;
use crate::integrator::pass_size::PassSize;
use crate::optics::Spectrum;
use crate::scene::Sensor;
use crate::sky::Sun;
use crate::traceable::{TraceableScene, TraceableTube};

/// Number of intervals of zenith angles at first: with fewer, kinks and jumps between all places would stay unseen by more than the tolerated
/// error.
const INTERVALS: PassSize = PassSize { for_one_percent: 8.0, growth: 1.0, fewest: 8.0, most: 64.0 };

/// Largest number of times that an interval is halved.
const MOST_HALVINGS: u32 = 10;

/// Number of times that the position of the steps along the arcs changes by a whole step over the places of the disc: the errors of arcs
/// are those of independent places.
const STEPS_TURNED: f64 = 618.033_988_7;

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

/// Sensor with the openings that may show it the sun.
struct SunlitSensor<'a>(Vec<ShownSun<'a>>);

impl<'a> SunlitSensor<'a> {
    fn new(scene: &'a TraceableScene, sensor: Sensor, intervals: usize, cancel: &AtomicBool) -> Self {
        let may_show = |tube: &TraceableTube| tube.sun.is_some() && !cancel.load(Ordering::Relaxed);
        let shown = |(_, backward): (usize, Backward<'a>)| {
            let sun = backward.tube.sun.as_ref().filter(|sun| backward.may_show(sun))?;
            Some(ShownSun::new(backward, sun, backward.disc(sun)?, intervals))
        };
        Self(openings(scene, sensor, may_show).into_iter().filter_map(shown).collect())
    }

    /// Returns the illuminance in lx by the first intervals.
    fn first(&self) -> f64 {
        self.0.iter().flat_map(|shown| &shown.first).map(Interval::integral).sum()
    }

    /// Computes the illuminance with this error, relative to it or to `least_scale` in lx if that is more.
    fn sunlight(&self, tolerance: f64, least_scale: f64) -> Sunlight {
        let tolerated = tolerance * self.first().max(least_scale);
        let all = || self.0.iter().flat_map(|shown| shown.first.iter().map(move |interval| (shown, *interval)));
        let of_interval = tolerated / (all().count().max(1) as f64).sqrt();
        let mut squared = 0.0;
        let lux = all().map(|(shown, interval)| shown.integral(interval, of_interval, 0, &mut squared)).sum();
        Sunlight { lux, error: squared.sqrt() }
    }
}

/// Sun that an opening may show to a sensor.
struct ShownSun<'a> {
    backward: Backward<'a>,
    sun: &'a Sun,
    disc: SunDisc,
    first: Vec<Interval>,
}

/// Values of the integrand, in lx, at both ends of an interval of places on the disc and in its middle.
#[derive(Clone, Copy)]
struct Interval {
    from: f64,
    width: f64,
    values: [f64; 3],
}

impl Interval {
    /// Returns the integral by Simpson's rule.
    fn integral(&self) -> f64 {
        let [low, middle, high] = self.values;
        self.width / 6.0 * (low + 4.0 * middle + high)
    }
}

impl<'a> ShownSun<'a> {
    fn new(backward: Backward<'a>, sun: &'a Sun, disc: SunDisc, intervals: usize) -> Self {
        let mut shown = Self { backward, sun, disc, first: Vec::new() };
        let width = 1.0 / intervals as f64;
        let values: Vec<f64> = (0..=2 * intervals).map(|number| shown.at(0.5 * width * number as f64)).collect();
        let interval = |number: usize| {
            let values = [0, 1, 2].map(|place| values[2 * number + place]);
            Interval { from: width * number as f64, width, values }
        };
        shown.first = (0..intervals).map(interval).collect();
        shown
    }

    /// Returns the illuminance in lx per place of the disc.
    fn at(&self, place: f64) -> f64 {
        let cosine = |toward| self.backward.at.cosine::<3>(toward);
        let lux: Option<Spectrum<3>> = self
            .disc
            .node(place, 1.0)
            .map(|node| self.backward.sun_of_node(self.sun, &cosine, node, (place * STEPS_TURNED).fract()));
        lux.map_or(0.0, |lux| lux.luminance())
    }

    /// Computes the integral over an interval with about this error in lx, and adds the square of what it estimates the error to be.
    fn integral(&self, interval: Interval, tolerated: f64, halvings: u32, squared: &mut f64) -> f64 {
        let Interval { from, width, values } = interval;
        let half = 0.5 * width;
        let [low, middle, high] = values;
        let halves = [(from, low, middle), (from + half, middle, high)].map(|(from, low, high)| Interval {
            from,
            width: half,
            values: [low, self.at(from + 0.5 * half), high],
        });
        let both = halves.iter().map(Interval::integral).sum::<f64>();
        let changed = both - interval.integral();
        if changed.abs() <= tolerated || halvings == MOST_HALVINGS {
            *squared += changed * changed;
            return both;
        }
        // errors of intervals are independent
        halves.into_iter().map(|half| self.integral(half, FRAC_1_SQRT_2 * tolerated, halvings + 1, squared)).sum()
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, DVec3};

    use super::*;
    use crate::optics::Diffuser;
    use crate::scene::{Daylight, Face};
    use crate::sky::direction;
    use crate::sky::zenith::ZenithFormula;
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
