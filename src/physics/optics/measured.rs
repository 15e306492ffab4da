//! Measured diffusers: tables of BTDF and BRDF over the angles of incidence and exit.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;

use super::Spectrum;
use super::scatter::{Kind, Scatter, Scattered, SheetSide, Travel, toward_side};
use crate::sampling::{PathSamples, warp};

/// A sheet that scatters alike to all azimuths and from either side.
///
/// The distributions are bilinear in the two angles between their rows and columns, both measured from the normal: that
/// of incidence on the light's side, that of exit on the side on which the light leaves.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredDiffuser {
    transmission: Distribution,
    /// Distribution of the reflected light; `None` for a sheet that reflects nothing.
    reflection: Option<Distribution>,
}

/// A BTDF or BRDF per sr over the angles of incidence and exit.
#[derive(Clone, Debug, PartialEq)]
struct Distribution {
    /// Radians, ascending from 0 to pi/2.
    incidence: Vec<f64>,
    rows: Vec<Row>,
}

/// Values over the angle of exit at one angle of incidence.
#[derive(Clone, Debug, PartialEq)]
struct Row {
    /// Radians, ascending from 0 to pi/2.
    exit: Vec<f64>,
    per_sr: Vec<f64>,
    /// Share of the light that leaves within each angle of exit; the last is the directional-hemispherical share.
    within: Vec<f64>,
}

/// A table is not one value >= 0 per pair of angles that ascend from 0 to pi/2, or gives more light than it gets.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TableError {
    /// Angles or values are not those of a table.
    #[error("the table has no value >= 0 for each pair of angles from 0 to 90 degrees")]
    Shape,
    /// A row gives more light than it gets, by more than rounding.
    #[error("row {row} sends out {share} of the light that it gets")]
    Gain {
        /// Number of the row, from 0, counted by angles of incidence.
        row: usize,
        /// Light that the row sends out, over what it gets: above 1.
        share: f64,
    },
}

/// Slack of the energy check: the rounding of decimal fractions.
const ROUNDING: f64 = 1e-9;

impl MeasuredDiffuser {
    /// `incidence` and `exit` in radians; tables in 1/sr with a row per angle of incidence, a column per angle of exit.
    pub fn new(
        incidence: &[f64],
        exit: &[f64],
        btdf: &[Vec<f64>],
        brdf: Option<&[Vec<f64>]>,
    ) -> Result<Self, TableError> {
        let transmission = Distribution::new(incidence, exit, btdf).ok_or(TableError::Shape)?;
        let reflection = match brdf {
            Some(table) => Some(Distribution::new(incidence, exit, table).ok_or(TableError::Shape)?),
            None => None,
        };
        let diffuser = Self { transmission, reflection };
        // both are linear in the angle between rows: what holds at the rows holds between them; a row is asked itself, since the
        // cosine of a small angle of incidence is that of none
        for row in 0..incidence.len() {
            let total = |distribution: &Distribution| distribution.rows[row].total();
            let share = total(&diffuser.transmission) + diffuser.reflection.as_ref().map_or(0.0, total);
            if share > 1.0 + ROUNDING {
                return Err(TableError::Gain { row, share });
            }
        }
        Ok(diffuser)
    }

    /// Directional-hemispherical transmittance and reflectance at an angle of incidence with the given cosine.
    ///
    /// A BTDF of t / pi is a Lambertian sheet of transmittance t:
    ///
    /// ```
    /// use std::f64::consts::{FRAC_PI_2, PI};
    ///
    /// let angles = [0.0, FRAC_PI_2];
    /// let btdf = vec![vec![0.6 / PI; 2]; 2];
    /// let sheet = skyduct_physics::optics::MeasuredDiffuser::new(&angles, &angles, &btdf, None).unwrap();
    /// let [through, back] = sheet.shares(0.3);
    /// assert!((through - 0.6).abs() < 1e-15 && back == 0.0);
    /// ```
    pub fn shares(&self, cosine: f64) -> [f64; 2] {
        let angle = libm::acos(cosine.clamp(0.0, 1.0));
        [self.transmission.share(angle), self.reflection.as_ref().map_or(0.0, |reflection| reflection.share(angle))]
    }

    /// Share of the light at an angle of incidence with the given cosine that passes as through a Lambertian sheet: pi times the
    /// least BTDF over the angles of exit. What the table has beside it is nowhere negative.
    pub fn even_share(&self, cosine: f64) -> f64 {
        let (a, b, share) = self.transmission.around(libm::acos(cosine.clamp(0.0, 1.0)));
        // a row is linear between its angles: its least value is at one of them
        let values = a.per_sr.iter().zip(&b.per_sr).map(|(a, b)| (1.0 - share) * a + share * b);
        PI * values.fold(f64::INFINITY, f64::min)
    }

    /// True if light at some angle of incidence passes in part as through a Lambertian sheet: [`Self::even_share`] is not 0.
    pub fn has_even_part(&self) -> bool {
        // no value is negative: between two rows there is something wherever either has something
        let pairs = self.transmission.rows.iter().zip(self.transmission.rows.iter().skip(1));
        pairs.into_iter().any(|(one, next)| one.per_sr.iter().zip(&next.per_sr).all(|(a, b)| a + b > 0.0))
    }

    /// The same sheet for light from below that is lost once it has passed: it reflects alike, and passes nothing.
    pub fn opaque(&self) -> Self {
        let mut opaque = self.clone();
        for row in &mut opaque.transmission.rows {
            row.per_sr.fill(0.0);
            row.within.fill(0.0);
        }
        opaque
    }

    /// BTDF, or BRDF where not `transmitted`, per sr; cosines of the angles of incidence and exit in 0..=1.
    pub fn per_sr(&self, transmitted: bool, incident_cosine: f64, exit_cosine: f64) -> f64 {
        let angles = [incident_cosine, exit_cosine].map(|cosine| libm::acos(cosine.clamp(0.0, 1.0)));
        self.of(transmitted).map_or(0.0, |distribution| distribution.per_sr(angles))
    }

    /// A direction around +z of light that leaves, transmitted or reflected, at an angle of incidence with the given
    /// cosine; density [`MeasuredDiffuser::per_sr`] cos(exit) over the share that leaves on this side.
    pub fn exit_direction(&self, transmitted: bool, incident_cosine: f64, [u, v]: [f64; 2]) -> DVec3 {
        let incidence = libm::acos(incident_cosine.clamp(0.0, 1.0));
        let exit = self.of(transmitted).map_or(0.0, |distribution| distribution.sample(incidence, u));
        let (sin, cos) = libm::sincos(exit);
        let (y, x) = libm::sincos(TAU * v);
        DVec3::new(sin * x, sin * y, cos.max(0.0))
    }

    /// True if no light passes, at any angle.
    pub fn is_opaque(&self) -> bool {
        self.transmission.rows.iter().all(|row| row.per_sr.iter().all(|value| *value == 0.0))
    }

    fn of(&self, transmitted: bool) -> Option<&Distribution> {
        if transmitted { Some(&self.transmission) } else { self.reflection.as_ref() }
    }
}

/// Share of the directions against the light that are chosen by the table, as if it were reciprocal, which is likely; the
/// others are chosen by the cosine, which covers what the table leaves out.
const BY_TABLE: f64 = 0.5;

/// Least albedo of a table for a path against the light: where it is not reciprocal, an eye may see light on a side to which
/// it would send none.
const LEAST_ALBEDO: f64 = 0.05;

impl MeasuredDiffuser {
    /// Density per sr of directions of `exit_cosine` that [`Self::exit_direction`] chooses; 0 where nothing leaves.
    fn density(&self, transmitted: bool, incident_cosine: f64, exit_cosine: f64) -> f64 {
        let share = self.shares(incident_cosine)[usize::from(!transmitted)];
        if share > 0.0 { self.per_sr(transmitted, incident_cosine, exit_cosine) * exit_cosine / share } else { 0.0 }
    }

    /// Share of the directions against the light that are chosen by the table.
    fn by_table(&self, transmitted: bool, eye_cosine: f64) -> f64 {
        if self.shares(eye_cosine)[usize::from(!transmitted)] > 0.0 { BY_TABLE } else { 0.0 }
    }
}

/// A sheet in a plane z = const.
impl<const C: usize> Scatter<C> for MeasuredDiffuser {
    fn value(&self, travel: Travel, from: DVec3, toward: DVec3) -> Spectrum<C> {
        let (transmitted, from, toward) = (from.z * toward.z < 0.0, from.z.abs(), toward.z.abs());
        let per_sr = match travel {
            Travel::WithLight => self.per_sr(transmitted, from, toward),
            Travel::AgainstLight => self.per_sr(transmitted, toward, from),
        };
        Spectrum([per_sr * toward; C])
    }

    fn pdf(&self, travel: Travel, from: DVec3, toward: DVec3) -> f64 {
        let (transmitted, from, toward) = (from.z * toward.z < 0.0, from.z.abs(), toward.z.abs());
        let of_table = self.density(transmitted, from, toward);
        match travel {
            Travel::WithLight => of_table,
            Travel::AgainstLight => {
                let by_table = self.by_table(transmitted, from);
                by_table * of_table + (1.0 - by_table) * toward / PI
            }
        }
    }

    fn sample(&self, travel: Travel, from: DVec3, side: SheetSide, samples: &mut PathSamples) -> Option<Scattered<C>> {
        let transmitted = side == SheetSide::Other;
        let cosine = from.z.abs();
        let point = samples.pair();
        let by_table = match travel {
            Travel::WithLight => true,
            Travel::AgainstLight => {
                let by_table = self.by_table(transmitted, cosine);
                by_table > 0.0 && samples.random.uniform() < by_table
            }
        };
        let local =
            if by_table { self.exit_direction(transmitted, cosine, point) } else { warp::cosine_hemisphere(point) };
        let toward = toward_side(local, from, side);
        let (value, pdf): (Spectrum<C>, f64) = self.value_and_pdf(travel, from, toward);
        if pdf <= 0.0 {
            return None;
        }
        let weight = match travel {
            // the table is sampled as it is
            Travel::WithLight => self.albedo(from, side),
            Travel::AgainstLight => value * (1.0 / pdf),
        };
        Some(Scattered { toward, kind: Kind::Diffuse, pdf, weight })
    }

    fn albedo(&self, from: DVec3, side: SheetSide) -> Spectrum<C> {
        Spectrum([self.shares(from.z.abs())[usize::from(side == SheetSide::Same)]; C])
    }

    fn likely_albedo(&self, from: DVec3, side: SheetSide) -> Spectrum<C> {
        Scatter::<C>::albedo(self, from, side).map(|share| share.max(LEAST_ALBEDO))
    }
}

impl Distribution {
    fn new(incidence: &[f64], exit: &[f64], table: &[Vec<f64>]) -> Option<Self> {
        let rows: Option<Vec<Row>> = table.iter().map(|row| Row::new(exit, row)).collect();
        let rows = rows.filter(|rows| rows.len() == incidence.len() && covers(incidence))?;
        Some(Self { incidence: incidence.to_vec(), rows })
    }

    /// The rows around an angle of incidence, and the share of the second.
    fn around(&self, incidence: f64) -> (&Row, &Row, f64) {
        let (row, share) = place(&self.incidence, incidence);
        (&self.rows[row], &self.rows[row + 1], share)
    }

    fn share(&self, incidence: f64) -> f64 {
        let (a, b, share) = self.around(incidence);
        (1.0 - share) * a.total() + share * b.total()
    }

    fn per_sr(&self, [incidence, exit]: [f64; 2]) -> f64 {
        let (a, b, share) = self.around(incidence);
        (1.0 - share) * a.at(exit) + share * b.at(exit)
    }

    /// Angle of exit: a row by its part of the light, then that row's own distribution.
    fn sample(&self, incidence: f64, u: f64) -> f64 {
        let (a, b, share) = self.around(incidence);
        let (first, second) = ((1.0 - share) * a.total(), share * b.total());
        let target = u * (first + second);
        if target < first || second == 0.0 {
            a.exit_within(target / (1.0 - share))
        } else {
            b.exit_within((target - first) / share)
        }
    }
}

impl Row {
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
        let (segment, share) = place(&self.exit, exit);
        self.per_sr[segment] + share * (self.per_sr[segment + 1] - self.per_sr[segment])
    }

    /// Share of the light between the start of a segment and the angle `to` in it: 2 pi int f sin cos, exactly.
    fn part(&self, segment: usize, to: f64) -> f64 {
        let (from, next) = (self.exit[segment], self.exit[segment + 1]);
        let slope = (self.per_sr[segment + 1] - self.per_sr[segment]) / (next - from);
        let width = to - from;
        // int sin cos and int (x - from) sin cos without differences of nearly equal numbers: of a peak a millionth of a degree
        // wide they would leave nothing
        let even = 0.5 * libm::sin(from + to) * libm::sin(width);
        let rising = 0.5 * width * libm::sin(0.5 * from + 1.5 * to) * libm::sin(0.5 * width)
            - 0.25 * libm::cos(from + to) * less_sine(width);
        TAU * (self.per_sr[segment] * even + slope * rising)
    }

    /// The angle within which the share `target` of the light leaves.
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

/// x - sin x for x within 0..=pi/2.
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

/// The interval of ascending `angles` that holds `angle`, and the share of its end.
fn place(angles: &[f64], angle: f64) -> (usize, f64) {
    let next = angles.partition_point(|other| *other <= angle).clamp(1, angles.len() - 1);
    (next - 1, (angle - angles[next - 1]) / (angles[next] - angles[next - 1]))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    fn angles(degrees: &[f64]) -> Vec<f64> {
        degrees.iter().map(|angle| angle.to_radians()).collect()
    }

    /// A forward peak that widens with the angle of incidence, over a weak reflection.
    fn prism() -> MeasuredDiffuser {
        let btdf = vec![vec![2.0, 0.5, 0.1, 0.0, 0.0], vec![0.8, 0.5, 0.2, 0.1, 0.1], vec![0.0, 0.1, 0.0, 0.0, 0.3]];
        let brdf = vec![vec![0.05; 5], vec![0.08; 5], vec![0.2; 5]];
        let exit = angles(&[0.0, 15.0, 30.0, 60.0, 90.0]);
        MeasuredDiffuser::new(&angles(&[0.0, 50.0, 90.0]), &exit, &btdf, Some(&brdf)).unwrap()
    }

    /// 2 pi int f sin cos by the midpoint rule.
    fn quadrature(diffuser: &MeasuredDiffuser, transmitted: bool, incident_cosine: f64, to: f64) -> f64 {
        let n = 200_000;
        let step = to / f64::from(n);
        let at = |k: u32| {
            let (sin, cos) = ((f64::from(k) + 0.5) * step).sin_cos();
            diffuser.per_sr(transmitted, incident_cosine, cos) * sin * cos
        };
        TAU * step * (0..n).map(at).sum::<f64>()
    }

    #[test]
    fn shares_are_integrals() {
        let diffuser = prism();
        for incidence in [0.0, 10.0, 50.0, 71.0, 90.0f64] {
            let cosine = incidence.to_radians().cos();
            let [through, back] = diffuser.shares(cosine);
            assert!((through - quadrature(&diffuser, true, cosine, FRAC_PI_2)).abs() < 1e-9);
            assert!((back - quadrature(&diffuser, false, cosine, FRAC_PI_2)).abs() < 1e-9);
        }
        // BTDF t / pi is a Lambertian sheet of transmittance t
        let flat = vec![vec![0.6 / PI; 2]; 2];
        let ends = [0.0, FRAC_PI_2];
        let lambertian = MeasuredDiffuser::new(&ends, &ends, &flat, None).unwrap();
        assert!((lambertian.shares(0.3)[0] - 0.6).abs() < 1e-15);
        assert_eq!(lambertian.shares(0.3)[1], 0.0);
    }

    /// The even part is the largest Lambertian sheet that a table holds: nowhere above it, and equal to it at one angle of exit.
    #[test]
    fn even_parts_touch_their_tables() {
        let exit = angles(&[0.0, 30.0, 60.0, 90.0]);
        let table = vec![vec![0.4, 0.2, 0.05, 0.06], vec![0.1, 0.2, 0.02, 0.1], vec![0.0, 0.0, 0.0, 0.1]];
        let diffuser = MeasuredDiffuser::new(&angles(&[0.0, 50.0, 90.0]), &exit, &table, None).unwrap();
        assert!(diffuser.has_even_part() && !prism().opaque().has_even_part());
        for incidence in [0.0f64, 20.0, 50.0, 70.0, 90.0] {
            let cosine = incidence.to_radians().cos();
            let even = diffuser.even_share(cosine) / PI;
            let above = |step: u32| diffuser.per_sr(true, cosine, (f64::from(step) * FRAC_PI_2 / 900.0).cos()) - even;
            let least = (0..=900).map(above).fold(f64::INFINITY, f64::min);
            assert!(least.abs() < 1e-12, "{incidence}: {least}");
            assert_eq!(even > 0.0, incidence < 90.0, "{incidence}: {even}");
        }
        // no row has an even part alone, but between them there is one
        let crossed = vec![vec![0.2, 0.2, 0.0, 0.2], vec![0.0, 0.0, 0.2, 0.2]];
        let crossed = MeasuredDiffuser::new(&angles(&[0.0, 90.0]), &exit, &crossed, None).unwrap();
        assert!(crossed.has_even_part() && crossed.even_share(1.0) == 0.0 && crossed.even_share(0.7) > 0.1);
        assert!(
            prism().has_even_part()
                != (0..=90).all(|angle| prism().even_share(f64::from(angle).to_radians().cos()) == 0.0)
        );
        let opaque = prism().opaque();
        assert_eq!(opaque.shares(0.6), [0.0, prism().shares(0.6)[1]]);
    }

    #[test]
    fn tables_give_no_light() {
        let ends = [0.0, FRAC_PI_2];
        let one = |value: f64| vec![vec![0.1; 2], vec![value / PI; 2]];
        assert!(MeasuredDiffuser::new(&ends, &ends, &one(1.0), None).is_ok());
        let gain = MeasuredDiffuser::new(&ends, &ends, &one(1.001), None).unwrap_err();
        assert!(matches!(gain, TableError::Gain { row: 1, share } if (share - 1.001).abs() < 1e-12), "{gain}");
        assert!(MeasuredDiffuser::new(&ends, &ends, &one(0.7), Some(&one(0.4))).is_err());
        for bad in [vec![vec![0.1; 2]], vec![vec![0.1; 3]; 2], vec![vec![-0.1; 2]; 2], vec![vec![f64::NAN; 2]; 2]] {
            assert_eq!(MeasuredDiffuser::new(&ends, &ends, &bad, None), Err(TableError::Shape));
        }
    }
    /// A row whose angle has the cosine of none counts all the same: at 30 degrees, halfway in value between such a row and the
    /// next, the table would send out more than it gets.
    #[test]
    fn rows_near_the_normal_give_no_light() {
        let incidence = angles(&[0.0, 1e-9, 60.0, 90.0]);
        let ends = [0.0, FRAC_PI_2];
        let table = |value: f64| vec![vec![0.1; 2], vec![value / PI; 2], vec![0.1; 2], vec![0.1; 2]];
        assert!(MeasuredDiffuser::new(&incidence, &ends, &table(1.0), None).is_ok());
        let gain = MeasuredDiffuser::new(&incidence, &ends, &table(5.0), None).unwrap_err();
        assert!(matches!(gain, TableError::Gain { row: 1, .. }), "{gain}");
    }

    /// A peak of a billion per sr within a hundred-thousandth of a degree: over so small angles int f sin cos is int f x, a
    /// polynomial.
    #[test]
    fn narrow_peaks_keep_their_light() {
        let exit = angles(&[0.0, 1e-6, 1e-5, 90.0]);
        let peak = 1e9;
        let table = vec![vec![peak, peak, 0.0, 0.0]; 2];
        let diffuser = MeasuredDiffuser::new(&[0.0, FRAC_PI_2], &exit, &table, None).unwrap();
        let [a, b] = [exit[1], exit[2]];
        let square = (b * b - a * a) / 2.0;
        let cube = (b.powi(3) - a.powi(3)) / 3.0;
        let share = TAU * peak * (0.5 * a * a + square - (cube - a * square) / (b - a));
        let [found, _] = diffuser.shares(1.0);
        assert!((found / share - 1.0).abs() < 1e-9, "{found} {share}");
        // and each part of it leaves within the angle that holds it
        for u in [0.01, 0.3, 0.7, 0.99] {
            let exit_angle = diffuser.transmission.sample(0.0, u);
            let row = &diffuser.transmission.rows[0];
            let segment = usize::from(exit_angle > a);
            let within = row.within[segment] + row.part(segment, exit_angle);
            assert!((within / share - u).abs() < 1e-6, "{u}: {exit_angle} {within}");
        }
    }
}
