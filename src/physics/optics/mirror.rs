//! Mirrors of tubes: specular, with one reflectance or with one that depends on the angle of incidence.

use std::sync::Arc;

use super::Spectrum;

/// Specular reflectance per bounce, linear Rec.709, 0..=1.
#[derive(Clone, Debug, PartialEq)]
pub enum Mirror {
    /// One reflectance at all angles.
    Constant([f64; 3]),
    /// A table over the angle of incidence.
    ByAngle(Arc<MirrorTable>),
}

/// Reflectance over the angle of incidence, measured from the normal: linear in the angle between its rows.
#[derive(Clone, Debug, PartialEq)]
pub struct MirrorTable {
    /// Angles of incidence in radians, ascending from 0 to pi/2.
    angles: Vec<f64>,
    reflectances: Vec<[f64; 3]>,
}

impl MirrorTable {
    /// Builds a table from `rows` of the angle of incidence in radians and the reflectance; `None` unless angles ascend from 0 to pi/2.
    pub fn new(rows: &[(f64, [f64; 3])]) -> Option<Self> {
        let angles: Vec<f64> = rows.iter().map(|(angle, _)| *angle).collect();
        let ascends = angles.windows(2).all(|pair| pair[0] < pair[1]);
        let covers = angles.len() >= 2 && angles[0] == 0.0 && angles[angles.len() - 1] == std::f64::consts::FRAC_PI_2;
        (ascends && covers).then(|| Self { angles, reflectances: rows.iter().map(|(_, value)| *value).collect() })
    }

    /// Interpolates the reflectance at the angle of incidence whose cosine, 0..=1, is given.
    ///
    /// ```
    /// use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
    /// use skyduct_physics::optics::mirror::MirrorTable;
    ///
    /// let table = MirrorTable::new(&[(0.0, [0.9; 3]), (FRAC_PI_2, [0.5; 3])]).unwrap();
    /// assert!((table.at(FRAC_PI_4.cos())[0] - 0.7).abs() < 1e-15);
    /// ```
    #[inline]
    pub fn at(&self, cosine: f64) -> [f64; 3] {
        let angle = libm::acos(cosine.clamp(0.0, 1.0));
        let next = self.angles.partition_point(|row| *row <= angle).clamp(1, self.angles.len() - 1);
        let (from, to) = (self.angles[next - 1], self.angles[next]);
        let fraction = (angle - from) / (to - from);
        let (a, b) = (self.reflectances[next - 1], self.reflectances[next]);
        std::array::from_fn(|channel| a[channel] + fraction * (b[channel] - a[channel]))
    }
}

impl Mirror {
    /// Returns the reflectance at an angle of incidence with the given cosine, which is evaluated only where the reflectance depends on
    /// it.
    #[inline]
    pub fn reflectance(&self, cosine: impl FnOnce() -> f64) -> [f64; 3] {
        match self {
            Self::Constant(reflectance) => *reflectance,
            Self::ByAngle(table) => table.at(cosine()),
        }
    }

    /// Computes the fraction R^n of the light that is left after n bounces at one angle of incidence; `bounces` is a whole number or
    /// infinite, and 0^0 = 1.
    ///
    /// ```
    /// let mirror = skyduct_physics::optics::Mirror::from([0.5, 0.0, 1.0]);
    /// assert_eq!(mirror.power::<3>(|| 1.0, 3.0).0, [0.125, 0.0, 1.0]);
    /// assert_eq!(mirror.power::<3>(|| 1.0, 0.0).0, [1.0; 3]);
    /// ```
    #[inline]
    pub fn power<const C: usize>(&self, cosine: impl FnOnce() -> f64, bounces: f64) -> Spectrum<C> {
        let reflectance = Spectrum::from_rgb(self.reflectance(cosine));
        if bounces <= 64.0 {
            reflectance.map(|r| whole_power(r, bounces as u32))
        } else {
            reflectance.map(|r| libm::pow(r, bounces))
        }
    }

    /// Returns the largest reflectance of any channel at any angle.
    pub fn brightest(&self) -> f64 {
        let largest = |all: &[[f64; 3]]| all.iter().flatten().copied().fold(0.0, f64::max);
        match self {
            Self::Constant(reflectance) => largest(&[*reflectance]),
            Self::ByAngle(table) => largest(&table.reflectances),
        }
    }
}

/// Computes `base` to the power of a whole number up to 64, by squares: like `powi`, but without branches on the bits of the number,
/// which would be mispredicted.
#[inline]
fn whole_power(base: f64, exponent: u32) -> f64 {
    let (mut power, mut square) = (1.0, base);
    for bit in 0..6 {
        power *= [1.0, square][(exponent >> bit & 1) as usize];
        square *= square;
    }
    power * [1.0, square][(exponent >> 6) as usize & 1]
}

impl From<[f64; 3]> for Mirror {
    fn from(reflectance: [f64; 3]) -> Self {
        Self::Constant(reflectance)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    #[test]
    fn tables_are_linear_in_the_angle() {
        let rows = [(0.0, [0.9; 3]), (0.5, [0.8; 3]), (FRAC_PI_2, [1.0, 0.0, 1.0])];
        let table = MirrorTable::new(&rows).unwrap();
        assert_eq!(table.at(1.0), [0.9; 3]);
        assert!((table.at(0.25f64.cos())[0] - 0.85).abs() < 1e-12);
        assert_eq!(table.at(0.0), [1.0, 0.0, 1.0]);
        let middle = 0.5 + 0.5 * (FRAC_PI_2 - 0.5);
        assert!((table.at(middle.cos())[1] - 0.4).abs() < 1e-12);
        assert_eq!(Mirror::ByAngle(Arc::new(table)).brightest(), 1.0);
        for bad in [&rows[..1], &rows[1..], &rows[..2]] {
            assert_eq!(MirrorTable::new(bad), None);
        }
        assert_eq!(MirrorTable::new(&[rows[0], rows[0], rows[2]]), None);
    }

    #[test]
    fn powers() {
        let mirror = Mirror::Constant([0.5, 0.0, 1.0]);
        let power = |n: f64| mirror.power::<3>(|| f64::NAN, n).0;
        assert_eq!(power(0.0), [1.0; 3]);
        assert_eq!(power(3.0), [0.125, 0.0, 1.0]);
        assert_eq!(power(f64::INFINITY), [0.0, 0.0, 1.0]);
        for exponent in 0..=64 {
            for base in [0.98, 0.3, 0.999_999] {
                let expected = libm::pow(base, f64::from(exponent));
                assert!((whole_power(base, exponent) / expected - 1.0).abs() < 1e-14, "{base} {exponent}");
            }
        }
    }
}
