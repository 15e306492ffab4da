//! Tables of scattered light over the angles of incidence and exit: bilinear, integrated and sampled exactly.

use std::f64::consts::{FRAC_PI_2, TAU};

/// A BTDF or BRDF per sr over the angles of incidence and exit.
#[derive(Clone, Debug, PartialEq)]
pub struct Distribution {
    /// Angles of incidence in radians, ascending from 0 to pi/2.
    incidence: Vec<f64>,
    rows: Vec<IncidenceRow>,
}

/// Values over the angle of exit at one angle of incidence.
#[derive(Clone, Debug, PartialEq)]
struct IncidenceRow {
    /// Angles of exit in radians, ascending from 0 to pi/2.
    exit: Vec<f64>,
    per_sr: Vec<f64>,
    /// Fraction of the light that leaves within each angle of exit; the last is the directional-hemispherical fraction.
    within: Vec<f64>,
}

impl Distribution {
    /// Builds a table from angles of `incidence` and `exit` in radians and a row of values per sr for each angle of incidence; `None`
    /// unless angles ascend from 0 to pi/2 and there is one value >= 0 for each pair.
    pub fn new(incidence: &[f64], exit: &[f64], table: &[Vec<f64>]) -> Option<Self> {
        let rows: Option<Vec<IncidenceRow>> = table.iter().map(|row| IncidenceRow::new(exit, row)).collect();
        let rows = rows.filter(|rows| rows.len() == incidence.len() && covers(incidence))?;
        Some(Self { incidence: incidence.to_vec(), rows })
    }

    /// Finds the rows around an angle of incidence, and the weight of the second.
    fn around(&self, incidence: f64) -> (&IncidenceRow, &IncidenceRow, f64) {
        let (row, fraction) = place(&self.incidence, incidence);
        (&self.rows[row], &self.rows[row + 1], fraction)
    }

    /// Computes the fraction of the light at an angle of incidence that leaves at any angle.
    pub fn albedo(&self, incidence: f64) -> f64 {
        let (a, b, fraction) = self.around(incidence);
        (1.0 - fraction) * a.total() + fraction * b.total()
    }

    /// Returns the fraction of the light at the angle of incidence of a row that leaves at any angle.
    pub fn total(&self, row: usize) -> f64 {
        self.rows[row].total()
    }

    /// Computes the least value per sr over the angles of exit, at an angle of incidence in radians.
    pub fn least_per_sr(&self, incidence: f64) -> f64 {
        let (a, b, fraction) = self.around(incidence);
        // a row is linear between its angles: its least value is at one of them
        let values = a.per_sr.iter().zip(&b.per_sr).map(|(a, b)| (1.0 - fraction) * a + fraction * b);
        values.fold(f64::INFINITY, f64::min)
    }

    /// True if at some angle of incidence the values at all angles of exit are greater than 0.
    pub fn has_even_part(&self) -> bool {
        // no value is negative: between two rows there is something wherever either has something
        let pairs = self.rows.iter().zip(self.rows.iter().skip(1));
        pairs.into_iter().any(|(one, next)| one.per_sr.iter().zip(&next.per_sr).all(|(a, b)| a + b > 0.0))
    }

    /// Returns a table of the same angles that is zero everywhere.
    pub fn dark(&self) -> Self {
        let mut dark = self.clone();
        for row in &mut dark.rows {
            row.per_sr.fill(0.0);
            row.within.fill(0.0);
        }
        dark
    }

    /// True if nothing leaves at any angle.
    pub fn is_dark(&self) -> bool {
        self.rows.iter().all(|row| row.per_sr.iter().all(|value| *value == 0.0))
    }

    /// Interpolates the value per sr at the angles of incidence and exit in radians.
    pub fn per_sr(&self, [incidence, exit]: [f64; 2]) -> f64 {
        let (a, b, fraction) = self.around(incidence);
        (1.0 - fraction) * a.at(exit) + fraction * b.at(exit)
    }

    /// Samples the angle of exit in radians: chooses a row by its part of the light, then an angle by that row's own distribution.
    pub fn sample(&self, incidence: f64, u: f64) -> f64 {
        let (a, b, fraction) = self.around(incidence);
        let (first, second) = ((1.0 - fraction) * a.total(), fraction * b.total());
        let target = u * (first + second);
        if target < first || second == 0.0 {
            a.exit_within(target / (1.0 - fraction))
        } else {
            b.exit_within((target - first) / fraction)
        }
    }
}

impl IncidenceRow {
    fn new(exit: &[f64], per_sr: &[f64]) -> Option<Self> {
        let good = per_sr.iter().all(|value| *value >= 0.0 && value.is_finite());
        if !good || per_sr.len() != exit.len() || !covers(exit) {
            return None;
        }
        let mut row = Self { exit: exit.to_vec(), per_sr: per_sr.to_vec(), within: vec![0.0] };
        let mut sum = 0.0;
        for (segment, end) in exit.iter().skip(1).enumerate() {
            sum += row.part(segment, *end);
            row.within.push(sum);
        }
        Some(row)
    }

    fn total(&self) -> f64 {
        self.within[self.within.len() - 1]
    }

    fn at(&self, exit: f64) -> f64 {
        let (segment, fraction) = place(&self.exit, exit);
        self.per_sr[segment] + fraction * (self.per_sr[segment + 1] - self.per_sr[segment])
    }

    /// Computes the fraction of the light between the start of a segment and the angle `to` in it: 2 pi int f sin cos, exactly.
    fn part(&self, segment: usize, to: f64) -> f64 {
        let (from, next) = (self.exit[segment], self.exit[segment + 1]);
        let slope = (self.per_sr[segment + 1] - self.per_sr[segment]) / (next - from);
        let width = to - from;
        // int sin cos and int (x - from) sin cos without differences of nearly equal numbers, which would lose all digits of a peak a
        // millionth of a degree wide
        let even = 0.5 * libm::sin(from + to) * libm::sin(width);
        let rising = 0.5 * width * libm::sin(0.5 * from + 1.5 * to) * libm::sin(0.5 * width)
            - 0.25 * libm::cos(from + to) * less_sine(width);
        TAU * (self.per_sr[segment] * even + slope * rising)
    }

    /// Finds the angle within which the fraction `target` of the light leaves.
    fn exit_within(&self, target: f64) -> f64 {
        let last = self.exit.len() - 2;
        let segment = (self.within.partition_point(|sum| *sum <= target).max(1) - 1).min(last);
        let rest = target - self.within[segment];
        let (mut low, mut high) = (self.exit[segment], self.exit[segment + 1]);
        let mut angle = 0.5 * (low + high);
        // Newton's method, kept between bounds that close in on the root
        for _ in 0..60 {
            let excess = self.part(segment, angle) - rest;
            if excess > 0.0 {
                high = angle
            } else {
                low = angle
            }
            let (sin, cos) = libm::sincos(angle);
            let next = angle - excess / (TAU * self.at(angle) * sin * cos);
            let next = if next > low && next < high { next } else { 0.5 * (low + high) };
            if (next - angle).abs() < 1e-14 {
                return next;
            }
            angle = next;
        }
        angle
    }
}

/// Computes x - sin x without cancellation for x within 0..=pi/2.
fn less_sine(x: f64) -> f64 {
    if x > 0.25 {
        return x - libm::sin(x);
    }
    let square = x * x;
    let series = [110.0, 72.0, 42.0, 20.0].into_iter().fold(1.0, |sum, divisor| 1.0 - square / divisor * sum);
    x * square / 6.0 * series
}

fn covers(angles: &[f64]) -> bool {
    angles.len() >= 2
        && angles[0] == 0.0
        && angles[angles.len() - 1] == FRAC_PI_2
        && angles.windows(2).all(|pair| pair[0] < pair[1])
}

/// Finds the interval of ascending `angles` that holds `angle`, and the weight of its end.
fn place(angles: &[f64], angle: f64) -> (usize, f64) {
    let next = angles.partition_point(|other| *other <= angle).clamp(1, angles.len() - 1);
    (next - 1, (angle - angles[next - 1]) / (angles[next] - angles[next - 1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A peak of a billion per sr within a hundred-thousandth of a degree: over so small angles int f sin cos is int f x, a
    /// polynomial.
    #[test]
    fn narrow_peaks_keep_their_light() {
        let exit = [0.0f64, 1e-6, 1e-5, 90.0].map(f64::to_radians);
        let peak = 1e9;
        let table = vec![vec![peak, peak, 0.0, 0.0]; 2];
        let distribution = Distribution::new(&[0.0, FRAC_PI_2], &exit, &table).unwrap();
        let [a, b] = [exit[1], exit[2]];
        let square = (b * b - a * a) / 2.0;
        let cube = (b.powi(3) - a.powi(3)) / 3.0;
        let total = TAU * peak * (0.5 * a * a + square - (cube - a * square) / (b - a));
        let found = distribution.albedo(0.0);
        assert!((found / total - 1.0).abs() < 1e-9, "{found} {total}");
        // and each part of it leaves within the angle that holds it
        for u in [0.01, 0.3, 0.7, 0.99] {
            let exit_angle = distribution.sample(0.0, u);
            let row = &distribution.rows[0];
            let segment = usize::from(exit_angle > a);
            let within = row.within[segment] + row.part(segment, exit_angle);
            assert!((within / total - u).abs() < 1e-6, "{u}: {exit_angle} {within}");
        }
    }
}
