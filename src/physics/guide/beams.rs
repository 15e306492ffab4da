//! Transmission curves of one guide for parallel beams of many altitudes and azimuths.

use std::f64::consts::TAU;

use glam::DVec3;

use super::Guide;
use super::performance::closed_beam;
use super::throughput::{Aim, Effort, Rays, Throughput, Transmission, follow, until_exact};
use crate::sampling::Key;
use crate::sky::direction;

/// Results of beams of 1 lx of one altitude.
#[derive(Clone, Debug)]
pub struct BeamsOfAltitude {
    /// The beam from the first azimuth.
    pub first: Throughput,
    /// Transmission of the beams from all azimuths together.
    pub all: Transmission,
}

/// Beams of 1 lx that a transmission curve is computed from, at evenly spaced azimuths.
#[derive(Clone, Copy, Debug)]
pub struct Beams<'a> {
    /// Guide that the beams go through.
    pub guide: &'a Guide,
    /// First azimuth in rad.
    pub azimuth: f64,
    /// Number of azimuths, at least 1.
    pub azimuths: u32,
    /// Key of the random numbers: the rays of an altitude depend on its index only.
    pub key: Key,
    /// Number of rays per replicate for the azimuths beside the first one, and the largest error: the root mean square over altitudes, of
    /// the first azimuth and of all together.
    pub effort: Effort,
}

/// Factor on the fewest rays for the beam from the first azimuth, whose result is reported separately.
const RAYS_OF_FIRST: u64 = 2;

/// Squared deviations of replicates over the square of their mean below which they are equal but for rounding.
const NO_SPREAD: f64 = 1e-24;

impl Beams<'_> {
    /// Computes the curve over `altitudes` (rad, ascending, in even steps): indices of the altitudes at which it has points, with their
    /// beams. All altitudes are computed if beams have a closed form; else the first one and, from the last one down, every second, and
    /// others where a straight line between these might be farther from the curve than the standard error of its points.
    pub fn curve(&self, altitudes: &[f64]) -> Vec<(usize, BeamsOfAltitude)> {
        let every = || (0..altitudes.len()).collect::<Vec<_>>();
        let coarse: Vec<usize> = match altitudes.first() {
            Some(first) if closed_beam(self.guide, self.toward(*first, 0)).is_none() => {
                let is_coarse = |number: &usize| *number == 0 || (altitudes.len() - number) % 2 == 1;
                every().into_iter().filter(is_coarse).collect()
            }
            _ => every(),
        };
        let mut points: Vec<_> = coarse.iter().copied().zip(self.over(altitudes, &coarse)).collect();
        let between: Vec<usize> = points
            .windows(2)
            .zip(sagittas(&points))
            .filter(|(ends, sagitta)| ends[1].0 - ends[0].0 > 1 && *sagitta > self.effort.standard_error)
            .map(|(ends, _)| ends[0].0 + 1)
            .collect();
        points.extend(between.iter().copied().zip(self.over(altitudes, &between)));
        points.sort_by_key(|(number, _)| *number);
        points
    }

    /// Computes the beams of the `altitudes` (rad) with the given indices, as [`beam`](super::performance::beam) does.
    pub fn over(&self, altitudes: &[f64], numbers: &[usize]) -> Vec<BeamsOfAltitude> {
        let Self { guide, key, effort, .. } = *self;
        let at: Vec<(usize, f64)> =
            numbers.iter().filter_map(|number| Some((*number, *altitudes.get(*number)?))).collect();
        let closed = at.iter().map(|(_, altitude)| closed_beam(guide, self.toward(*altitude, 0)));
        let closed = closed.map(|beam| beam.map(|first| BeamsOfAltitude { all: first.transmission(), first }));
        if let Some(closed) = closed.collect::<Option<Vec<_>>>() {
            return closed;
        }
        let directions = |altitude: f64| (0..self.azimuths).map(move |turn| self.toward(altitude, turn));
        let directions: Vec<Vec<DVec3>> = at.iter().map(|(_, altitude)| directions(*altitude).collect()).collect();
        let rays = |which: u64| -> Vec<Rays<1>> {
            at.iter().map(|(number, _)| Rays::new(key.child(*number as u64).child(which))).collect()
        };
        let mean_square = |errors: &mut dyn Iterator<Item = f64>| {
            (errors.map(|error| error * error).sum::<f64>() / at.len().max(1) as f64).sqrt()
        };
        let mut first = rays(0);
        let of_first = Effort { least: (RAYS_OF_FIRST * effort.least).min(effort.most), ..effort };
        until_exact(of_first, |count| {
            follow(guide, &mut first, count, |beam, [u, v, ..]| Aim {
                point: [u, v],
                toward: directions[beam][0],
                weights: [1.0],
            });
            mean_square(&mut first.iter().map(Rays::standard_error))
        });
        let first: Vec<Throughput> = first.iter().map(Rays::throughputs).map(|[beam]| beam).collect();
        // if some rays may miss the collector, more of them, so that not all of a few miss
        let all_enter = first.iter().all(|beam| beam.entering().m2 <= NO_SPREAD * beam.entering().mean.powi(2));
        let least = if all_enter { effort.least } else { 2 * effort.least };
        let mut others = rays(1);
        let other = f64::from(self.azimuths.saturating_sub(1));
        let mut all = first.iter().map(|first| Transmission::of_all(&[first])).collect();
        if other > 0.0 {
            until_exact(Effort { least: least.min(effort.most), ..effort }, |count| {
                follow(guide, &mut others, count, |beam, [choice, u, v, _]| Aim {
                    point: [u, v],
                    toward: directions[beam][1 + (choice * other) as usize],
                    weights: [other],
                });
                let of = |(first, others): (&Throughput, &Rays<1>)| {
                    let [others] = others.throughputs();
                    Transmission::of_all(&[first, &others])
                };
                all = first.iter().zip(&others).map(of).collect::<Vec<_>>();
                mean_square(&mut all.iter().map(|all| all.standard_error))
            });
        }
        first.into_iter().zip(all).map(|(first, all)| BeamsOfAltitude { first, all }).collect()
    }

    /// Returns the unit vector toward the light for an altitude in rad and the azimuth with the index `turn`.
    fn toward(&self, altitude: f64, turn: u32) -> DVec3 {
        direction(altitude, self.azimuth + TAU * f64::from(turn) / f64::from(self.azimuths))
    }
}

/// Estimates, for each pair of neighbouring points of a curve, how far the straight line between them may be from the curve halfway: an
/// eighth of the second derivative times the squared distance; the larger value of both points, and of the first azimuth and of all.
fn sagittas(points: &[(usize, BeamsOfAltitude)]) -> Vec<f64> {
    let place = |point: usize| points[point].0 as f64;
    let values = points.iter().map(|(_, beams)| [beams.first.transmission().value, beams.all.value]);
    let values: Vec<[f64; 2]> = values.collect();
    // half of the second derivative, from a point and its neighbours
    let bend = |middle: usize| -> f64 {
        if middle == 0 || middle + 1 >= points.len() {
            return 0.0;
        }
        let slope = |from: usize, which: usize| {
            (values[from + 1][which] - values[from][which]) / (place(from + 1) - place(from))
        };
        let of = |which| (slope(middle, which) - slope(middle - 1, which)).abs();
        f64::max(of(0), of(1)) / (place(middle + 1) - place(middle - 1))
    };
    let sagitta = |from: usize| bend(from).max(bend(from + 1)) * (place(from + 1) - place(from)).powi(2) / 4.0;
    (1..points.len()).map(|to| sagitta(to - 1)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::guide::BentGuide;
    use crate::guide::performance::traced_beam;
    use crate::guide::test_pipes::{RADIUS, straight, straight_by_rays};
    use crate::guide::transmittance::beam_transmission;
    use crate::optics::Mirror;

    /// Returns the altitudes of a report's curve in rad.
    fn altitudes() -> Vec<f64> {
        (1..=18).map(|step| f64::from(5 * step).to_radians()).collect()
    }

    /// Returns the transmission of a pipe of 1 m of that reflectance by the exact series.
    fn exact(altitude: f64, reflectance: f64) -> f64 {
        beam_transmission(1.0 / (2.0 * RADIUS), 1.0 / altitude.tan(), reflectance)
    }

    fn beams(guide: &Guide, seed: u64, standard_error: f64, most: u64) -> Beams<'_> {
        let effort = Effort { standard_error, least: 2, most };
        Beams { guide, azimuth: 0.3, azimuths: 8, key: Key::new(seed), effort }
    }

    /// Checks that each altitude is within 4 estimated errors of the exact series, that all altitudes together deviate as much as their
    /// errors say (chi-squared of 18 terms, false alarm rate 1e-4), and that the errors are as requested, with as few rays as these allow.
    #[test]
    fn beams_by_few_rays_are_within_their_errors() {
        let (altitudes, numbers) = (altitudes(), (0..18).collect::<Vec<_>>());
        for (reflectance, asked) in [(0.9, 0.02), (0.98, 0.03), (0.7, 0.01)] {
            let guide = straight_by_rays(1.0, reflectance);
            let found = beams(&guide, 4, asked, 1024).over(&altitudes, &numbers);
            let (mut squares, mut reported) = ([0.0; 2], [0.0; 2]);
            for (altitude, beams) in altitudes.iter().zip(&found) {
                let exact = exact(*altitude, reflectance);
                for (index, found) in [beams.first.transmission(), beams.all].into_iter().enumerate() {
                    let error = found.standard_error;
                    assert!((found.value - exact).abs() < 4.0 * error, "{altitude}: {found:?} {exact}");
                    squares[index] += (found.value - exact).powi(2) / (error * error);
                    reported[index] += error * error / altitudes.len() as f64;
                }
            }
            assert!(squares.iter().all(|sum| *sum < 46.0), "{reflectance}: {squares:?}");
            assert!(reported.iter().all(|reported| reported.sqrt() <= asked), "{reflectance}: {reported:?}");
        }
    }

    /// Checks the coverage of estimated errors when rays are added until the error is small enough: 2 standard errors include the exact
    /// series in 95 % of cases if the errors are exact, in 91 % with eight replicates; of 720 cases each, 88 % are 3 standard errors less.
    #[test]
    fn two_reported_errors_hold_the_exact_series() {
        let (altitudes, numbers) = (altitudes(), (0..18).collect::<Vec<_>>());
        let guide = straight_by_rays(1.0, 0.9);
        let mut held = [0.0; 2];
        for seed in 0..40 {
            let found = beams(&guide, seed, 0.03, 128).over(&altitudes, &numbers);
            for (altitude, beams) in altitudes.iter().zip(&found) {
                let exact = exact(*altitude, 0.9);
                for (held, found) in held.iter_mut().zip([beams.first.transmission(), beams.all]) {
                    *held += f64::from(u8::from((found.value - exact).abs() < 2.0 * found.standard_error)) / 720.0;
                }
            }
        }
        assert!(held.iter().all(|fraction| *fraction > 0.88), "{held:?}");
    }

    /// Compares beams from all azimuths together with rays for each azimuth alone, within 4 combined errors, at a tilted end, which lets
    /// most in from one side and nothing from the other.
    #[test]
    fn all_azimuths_together_agree_with_each_alone() {
        let (sin, cos) = 40f64.to_radians().sin_cos();
        let axes = [(0.5, DVec3::Z), (0.5, DVec3::new(sin, 0.0, cos))];
        let guide = Guide::Bent(BentGuide::new(RADIUS, &axes, Mirror::Constant([0.95; 3]), [0.9; 3]));
        let altitudes = [20.0, 55.0, 80.0].map(f64::to_radians);
        let beams = beams(&guide, 5, 0.004, 8192);
        for (altitude, found) in altitudes.iter().zip(beams.over(&altitudes, &[0, 1, 2])) {
            let alone = |turn: u32| {
                traced_beam(&guide, beams.toward(*altitude, turn), Key::new(9).child(u64::from(turn)), 1024)
            };
            let alone: Vec<Throughput> = (0..8).map(alone).collect();
            assert_eq!(*altitude < 0.5, alone.iter().any(|beam| beam.entering().mean == 0.0));
            let sum = |of: fn(&Throughput) -> f64| alone.iter().map(of).sum::<f64>();
            let entering = sum(|beam| beam.entering().mean);
            let error = sum(|beam| beam.arriving().standard_error().powi(2)).sqrt() / entering;
            let (away, error) =
                (found.all.value - sum(|beam| beam.arriving().mean) / entering, found.all.standard_error.hypot(error));
            assert!(away.abs() < 4.0 * error, "{altitude}: {away} {error}");
            assert!(found.all.standard_error <= 0.008, "{found:?}");
        }
    }

    /// Checks that a straight line between two points of a curve is no farther from it than the errors of points, and 4 standard errors of
    /// the estimated bend, sqrt(6) / 8 of theirs: with few points for large errors, all for small ones, and in between where the curve
    /// bends.
    #[test]
    fn straight_lines_between_points_are_within_the_errors() {
        let altitudes = altitudes();
        let guide = straight_by_rays(1.0, 0.7);
        let mut counts = Vec::new();
        for asked in [0.05, 0.006, 0.0005] {
            let beams = beams(&guide, 3, asked, 4096);
            let curve = beams.curve(&altitudes);
            for ends in curve.windows(2) {
                let ([from, to], middle) = ([ends[0].0, ends[1].0], (ends[0].0 + ends[1].0) / 2);
                let [low, high] = [from, to].map(|number| exact(altitudes[number], 0.7));
                let straight = low + (high - low) * (middle - from) as f64 / (to - from) as f64;
                let away = straight - exact(altitudes[middle], 0.7);
                let judged = 4.0 * 6f64.sqrt() / 8.0 * asked;
                assert!(away.abs() <= asked + judged, "{asked}: {away} at {middle}");
            }
            assert_eq!([curve[0].0, curve[curve.len() - 1].0], [0, 17]);
            counts.push(curve.len());
        }
        assert!(counts[0] == 10 && (11..18).contains(&counts[1]) && counts[2] >= 17, "{counts:?}");
        assert_eq!(beams(&straight(1.0, 0.7), 3, 0.05, 16).curve(&altitudes).len(), 18);
        assert!(beams(&guide, 3, 0.05, 16).curve(&[]).is_empty());
    }

    /// Checks that the rays of an altitude do not depend on the other altitudes requested.
    #[test]
    fn an_altitude_has_the_same_bits_among_others() {
        let guide = straight_by_rays(1.0, 0.9);
        let beams = Beams { effort: Effort::from(8), ..beams(&guide, 3, 0.0, 8) };
        let value = |numbers: &[usize]| beams.over(&altitudes(), numbers)[0].all.value.to_bits();
        assert_eq!(value(&[4]), value(&[4, 7, 12]));
    }
}
