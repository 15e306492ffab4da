//! Measured diffusers: tables of BTDF and BRDF over the angles of incidence and exit.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::Spectrum;
use super::angular_table::Distribution;
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

/// Fault of a table: it has not one value >= 0 per pair of angles that ascend from 0 to pi/2, or it gives more light than it gets.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TableError {
    /// Angles or values that do not make up a table.
    #[error("the table must have a value >= 0 for each pair of angles from 0 to 90 degrees")]
    Shape,
    /// A row that gives more light than it gets, by more than rounding.
    #[error("row {row} scatters {albedo} times the light that it receives, but at most 1 is possible")]
    Gain {
        /// Number of the row, from 0, counted by angles of incidence.
        row: usize,
        /// Light that the row sends out, over what it gets: above 1.
        albedo: f64,
    },
}

/// Tolerance of the energy check, for the rounding of decimal fractions.
const ROUNDING: f64 = 1e-9;

impl MeasuredDiffuser {
    /// Builds a diffuser; `incidence` and `exit` in radians; tables in 1/sr with a row per angle of incidence, a column per angle of
    /// exit.
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
        // both are linear in the angle between rows: what holds at the rows holds between them; rows are checked by their number, since
        // the cosine of a small angle of incidence rounds to 1
        for row in 0..incidence.len() {
            let total = |distribution: &Distribution| distribution.total(row);
            let albedo = total(&diffuser.transmission) + diffuser.reflection.as_ref().map_or(0.0, total);
            if albedo > 1.0 + ROUNDING {
                return Err(TableError::Gain { row, albedo });
            }
        }
        Ok(diffuser)
    }

    /// Computes the directional-hemispherical transmittance and reflectance at an angle of incidence with the given cosine.
    ///
    /// A BTDF of t / pi is a Lambertian sheet of transmittance t:
    ///
    /// ```
    /// use std::f64::consts::{FRAC_PI_2, PI};
    ///
    /// let angles = [0.0, FRAC_PI_2];
    /// let btdf = vec![vec![0.6 / PI; 2]; 2];
    /// let sheet = skyduct_physics::optics::MeasuredDiffuser::new(&angles, &angles, &btdf, None).unwrap();
    /// let [through, back] = sheet.albedos(0.3);
    /// assert!((through - 0.6).abs() < 1e-15 && back == 0.0);
    /// ```
    pub fn albedos(&self, cosine: f64) -> [f64; 2] {
        let angle = libm::acos(cosine.clamp(0.0, 1.0));
        [self.transmission.albedo(angle), self.reflection.as_ref().map_or(0.0, |reflection| reflection.albedo(angle))]
    }

    /// Computes the fraction of the light at an angle of incidence with the given cosine that passes as through a Lambertian sheet: pi
    /// times the least BTDF over the angles of exit. The rest of the BTDF is nowhere negative.
    pub fn even_fraction(&self, cosine: f64) -> f64 {
        PI * self.transmission.least_per_sr(libm::acos(cosine.clamp(0.0, 1.0)))
    }

    /// True if light at some angle of incidence passes in part as through a Lambertian sheet: [`Self::even_fraction`] is not 0.
    pub fn has_even_part(&self) -> bool {
        self.transmission.has_even_part()
    }

    /// Returns a sheet that reflects like this one and passes nothing, for light from below that is lost once it has passed.
    pub fn opaque(&self) -> Self {
        Self { transmission: self.transmission.dark(), ..self.clone() }
    }

    /// Returns the BTDF, or the BRDF where not `transmitted`, per sr; cosines of the angles of incidence and exit in 0..=1.
    pub fn per_sr(&self, transmitted: bool, incident_cosine: f64, exit_cosine: f64) -> f64 {
        let angles = [incident_cosine, exit_cosine].map(|cosine| libm::acos(cosine.clamp(0.0, 1.0)));
        self.of(transmitted).map_or(0.0, |distribution| distribution.per_sr(angles))
    }

    /// Samples a direction around +z of light that leaves, transmitted or reflected, at an angle of incidence with the given cosine; its
    /// density is [`MeasuredDiffuser::per_sr`] cos(exit) over the fraction that leaves on this side.
    pub fn exit_direction(&self, transmitted: bool, incident_cosine: f64, [u, v]: [f64; 2]) -> DVec3 {
        let incidence = libm::acos(incident_cosine.clamp(0.0, 1.0));
        let exit = self.of(transmitted).map_or(0.0, |distribution| distribution.sample(incidence, u));
        let (sin, cos) = libm::sincos(exit);
        let (y, x) = libm::sincos(TAU * v);
        DVec3::new(sin * x, sin * y, cos.max(0.0))
    }

    /// True if no light passes, at any angle.
    pub fn is_opaque(&self) -> bool {
        self.transmission.is_dark()
    }

    fn of(&self, transmitted: bool) -> Option<&Distribution> {
        if transmitted { Some(&self.transmission) } else { self.reflection.as_ref() }
    }
}

/// Probability with which a direction against the light is chosen by the table, as if it were reciprocal, which is likely; otherwise it
/// is chosen by the cosine, which covers what the table leaves out.
const BY_TABLE: f64 = 0.5;

/// Smallest albedo of a table for a path against the light: where the table is not reciprocal, an eye may see light on a side to which it
/// would send none.
const LEAST_ALBEDO: f64 = 0.05;

impl MeasuredDiffuser {
    /// Returns the density per sr of directions of `exit_cosine` that [`Self::exit_direction`] chooses; 0 where nothing leaves.
    fn density(&self, transmitted: bool, incident_cosine: f64, exit_cosine: f64) -> f64 {
        let albedo = self.albedos(incident_cosine)[usize::from(!transmitted)];
        if albedo > 0.0 { self.per_sr(transmitted, incident_cosine, exit_cosine) * exit_cosine / albedo } else { 0.0 }
    }

    /// Returns the probability with which a direction against the light is chosen by the table.
    fn by_table(&self, transmitted: bool, eye_cosine: f64) -> f64 {
        if self.albedos(eye_cosine)[usize::from(!transmitted)] > 0.0 { BY_TABLE } else { 0.0 }
    }
}

/// Scattering by a sheet in a plane z = const.
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
        Spectrum([self.albedos(from.z.abs())[usize::from(side == SheetSide::Same)]; C])
    }

    fn likely_albedo(&self, from: DVec3, side: SheetSide) -> Spectrum<C> {
        Scatter::<C>::albedo(self, from, side).map(|albedo| albedo.max(LEAST_ALBEDO))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    fn angles(degrees: &[f64]) -> Vec<f64> {
        degrees.iter().map(|angle| angle.to_radians()).collect()
    }

    /// Builds a forward peak that widens with the angle of incidence, over a weak reflection.
    fn prism() -> MeasuredDiffuser {
        let btdf = vec![vec![2.0, 0.5, 0.1, 0.0, 0.0], vec![0.8, 0.5, 0.2, 0.1, 0.1], vec![0.0, 0.1, 0.0, 0.0, 0.3]];
        let brdf = vec![vec![0.05; 5], vec![0.08; 5], vec![0.2; 5]];
        let exit = angles(&[0.0, 15.0, 30.0, 60.0, 90.0]);
        MeasuredDiffuser::new(&angles(&[0.0, 50.0, 90.0]), &exit, &btdf, Some(&brdf)).unwrap()
    }

    /// Integrates 2 pi int f sin cos by the midpoint rule.
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
    fn albedos_are_integrals() {
        let diffuser = prism();
        for incidence in [0.0, 10.0, 50.0, 71.0, 90.0f64] {
            let cosine = incidence.to_radians().cos();
            let [through, back] = diffuser.albedos(cosine);
            assert!((through - quadrature(&diffuser, true, cosine, FRAC_PI_2)).abs() < 1e-9);
            assert!((back - quadrature(&diffuser, false, cosine, FRAC_PI_2)).abs() < 1e-9);
        }
        // BTDF t / pi is a Lambertian sheet of transmittance t
        let flat = vec![vec![0.6 / PI; 2]; 2];
        let ends = [0.0, FRAC_PI_2];
        let lambertian = MeasuredDiffuser::new(&ends, &ends, &flat, None).unwrap();
        assert!((lambertian.albedos(0.3)[0] - 0.6).abs() < 1e-15);
        assert_eq!(lambertian.albedos(0.3)[1], 0.0);
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
            let even = diffuser.even_fraction(cosine) / PI;
            let above = |step: u32| diffuser.per_sr(true, cosine, (f64::from(step) * FRAC_PI_2 / 900.0).cos()) - even;
            let least = (0..=900).map(above).fold(f64::INFINITY, f64::min);
            assert!(least.abs() < 1e-12, "{incidence}: {least}");
            assert_eq!(even > 0.0, incidence < 90.0, "{incidence}: {even}");
        }
        // no row has an even part alone, but between them there is one
        let crossed = vec![vec![0.2, 0.2, 0.0, 0.2], vec![0.0, 0.0, 0.2, 0.2]];
        let crossed = MeasuredDiffuser::new(&angles(&[0.0, 90.0]), &exit, &crossed, None).unwrap();
        assert!(crossed.has_even_part() && crossed.even_fraction(1.0) == 0.0 && crossed.even_fraction(0.7) > 0.1);
        assert!(
            prism().has_even_part()
                != (0..=90).all(|angle| prism().even_fraction(f64::from(angle).to_radians().cos()) == 0.0)
        );
        let opaque = prism().opaque();
        assert_eq!(opaque.albedos(0.6), [0.0, prism().albedos(0.6)[1]]);
    }

    #[test]
    fn tables_give_no_light() {
        let ends = [0.0, FRAC_PI_2];
        let one = |value: f64| vec![vec![0.1; 2], vec![value / PI; 2]];
        assert!(MeasuredDiffuser::new(&ends, &ends, &one(1.0), None).is_ok());
        let gain = MeasuredDiffuser::new(&ends, &ends, &one(1.001), None).unwrap_err();
        assert!(matches!(gain, TableError::Gain { row: 1, albedo } if (albedo - 1.001).abs() < 1e-12), "{gain}");
        assert!(MeasuredDiffuser::new(&ends, &ends, &one(0.7), Some(&one(0.4))).is_err());
        for bad in [vec![vec![0.1; 2]], vec![vec![0.1; 3]; 2], vec![vec![-0.1; 2]; 2], vec![vec![f64::NAN; 2]; 2]] {
            assert_eq!(MeasuredDiffuser::new(&ends, &ends, &bad, None), Err(TableError::Shape));
        }
    }

    /// A row whose angle of incidence has a cosine that rounds to 1 counts all the same: at 30 degrees, halfway in value between such a
    /// row and the next, the table would send out more than it gets.
    #[test]
    fn rows_near_the_normal_give_no_light() {
        let incidence = angles(&[0.0, 1e-9, 60.0, 90.0]);
        let ends = [0.0, FRAC_PI_2];
        let table = |value: f64| vec![vec![0.1; 2], vec![value / PI; 2], vec![0.1; 2], vec![0.1; 2]];
        assert!(MeasuredDiffuser::new(&incidence, &ends, &table(1.0), None).is_ok());
        let gain = MeasuredDiffuser::new(&incidence, &ends, &table(5.0), None).unwrap_err();
        assert!(matches!(gain, TableError::Gain { row: 1, .. }), "{gain}");
    }
}
