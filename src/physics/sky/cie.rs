//! Relative luminance distribution of the 15 CIE general skies and the traditional overcast sky.
//!
//! Source: CIE S 011/E:2003 / ISO 15469:2004; docs/physics/sky_and_sun.md#relative-luminance.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::{Arc, OnceLock};

use gauss_quad::GaussLegendre;
use glam::DVec3;

use super::SkyType;

/// A CIE sky type: 1..=15 of the general sky, or 16, the traditional overcast sky.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct CieType(u8);

/// Gradation (a, b), indicatrix (c, d, e) and the standard's description of types 1 to 15.
const PARAMETERS: [([f64; 5], &str); 15] = [
    ([4.0, -0.70, 0.0, -1.0, 0.0], "CIE standard overcast sky: steep gradation, azimuthal uniformity"),
    ([4.0, -0.70, 2.0, -1.5, 0.15], "overcast, steep gradation, slight brightening toward the sun"),
    ([1.1, -0.80, 0.0, -1.0, 0.0], "overcast, moderate gradation, azimuthal uniformity"),
    ([1.1, -0.80, 2.0, -1.5, 0.15], "overcast, moderate gradation, slight brightening toward the sun"),
    ([0.0, -1.0, 0.0, -1.0, 0.0], "uniform sky"),
    ([0.0, -1.0, 2.0, -1.5, 0.15], "partly cloudy, no gradation, slight brightening toward the sun"),
    ([0.0, -1.0, 5.0, -2.5, 0.30], "partly cloudy, no gradation, brighter circumsolar region"),
    ([0.0, -1.0, 10.0, -3.0, 0.45], "partly cloudy, no gradation, distinct solar corona"),
    ([-1.0, -0.55, 2.0, -1.5, 0.15], "partly cloudy, obscured sun"),
    ([-1.0, -0.55, 5.0, -2.5, 0.30], "partly cloudy, brighter circumsolar region"),
    ([-1.0, -0.55, 10.0, -3.0, 0.45], "white-blue sky, distinct solar corona"),
    ([-1.0, -0.32, 10.0, -3.0, 0.45], "CIE standard clear sky, low luminance turbidity"),
    ([-1.0, -0.32, 16.0, -3.0, 0.30], "CIE standard clear sky, polluted atmosphere"),
    ([-1.0, -0.15, 16.0, -3.0, 0.30], "cloudless turbid sky, broad solar corona"),
    ([-1.0, -0.15, 24.0, -2.8, 0.15], "white-blue turbid sky, broad solar corona"),
];

impl CieType {
    /// Type 1: the CIE standard overcast sky.
    pub const STANDARD_OVERCAST: Self = Self(1);
    /// Type 5: the same luminance in every direction.
    pub const UNIFORM: Self = Self(5);
    /// Type 16: L/Lz = (1 + 2 cos Z) / 3 at the zenith angle Z, three times as bright at the zenith as at the horizon.
    pub const TRADITIONAL_OVERCAST: Self = Self(16);

    /// Returns the type of a number; `None` unless `number` is 1..=16.
    pub const fn new(number: u8) -> Option<Self> {
        match number {
            1..=16 => Some(Self(number)),
            _ => None,
        }
    }

    /// Lists all sixteen types, in order.
    pub fn all() -> impl Iterator<Item = Self> {
        (1..=16).map(Self)
    }

    /// Returns the number of the type in the standard, 1..=15, or 16 for the traditional overcast sky.
    pub fn number(self) -> u8 {
        self.0
    }

    /// Returns the parameters a, b, c, d, e; `None` for the traditional overcast sky.
    pub fn parameters(self) -> Option<[f64; 5]> {
        PARAMETERS.get(usize::from(self.0) - 1).map(|(parameters, _)| *parameters)
    }

    /// Returns the standard's description of the sky, in short English words without a full stop.
    pub fn description(self) -> &'static str {
        PARAMETERS
            .get(usize::from(self.0) - 1)
            .map_or("traditional overcast sky, L/Lz = (1 + 2 sin gamma) / 3", |(_, description)| description)
    }

    /// True for the overcast skies, whose level can be compared with the mean of measured ones: types 1 to 5 and 16.
    pub fn is_overcast(self) -> bool {
        self.0 <= 5 || self.0 == 16
    }

    /// True for the skies that have no direct beam, under which ratios to the light outside are daylight factors: types 1 to 6 and the
    /// traditional overcast sky.
    pub fn is_sunless(self) -> bool {
        self.0 <= 6 || self.0 == 16
    }
}

/// Luminance relative to the zenith, L/Lz = f(chi) phi(Z) / (f(Zs) phi(0)), for one sky type and sun position; f(chi) phi(Z) itself where
/// free parameters leave the zenith without light.
#[derive(Clone, Debug)]
pub struct SkyDistribution {
    sky_type: SkyType,
    sun: DVec3,
    a: f64,
    b: f64,
    indicatrix: Indicatrix,
    per_zenith: f64,
    horizontal_ratio: Remembered,
}

/// A number that is computed on first use and shared by all clones. It follows from the fields beside it, so that `Debug` shows only
/// these.
#[derive(Clone, Default)]
struct Remembered(Arc<OnceLock<f64>>);

impl std::fmt::Debug for Remembered {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("_")
    }
}

/// Indicatrix f(chi) = 1 + c (exp(d chi) - exp(d pi/2)) + e cos^2 chi, at least 0, chi in radians.
#[derive(Clone, Copy, Debug)]
struct Indicatrix {
    c: f64,
    d: f64,
    e: f64,
    at_right_angle: f64,
}

impl Indicatrix {
    fn new(c: f64, d: f64, e: f64) -> Self {
        Self { c, d, e, at_right_angle: libm::exp(d * FRAC_PI_2) }
    }

    #[inline]
    fn at(&self, chi: f64, cos_chi: f64) -> f64 {
        if self.c == 0.0 && self.e == 0.0 {
            return 1.0;
        }
        // no type of the CIE is negative, a free set of parameters may be
        (1.0 + self.c * (libm::exp(self.d * chi) - self.at_right_angle) + self.e * cos_chi * cos_chi).max(0.0)
    }
}

/// Computes the gradation phi = 1 + a exp(b / cos Z), at least 0, with phi = 1 at the horizon and below.
#[inline]
fn gradation(a: f64, b: f64, cos_zenith: f64) -> f64 {
    if cos_zenith <= 0.0 || a == 0.0 { 1.0 } else { (1.0 + a * libm::exp(b / cos_zenith)).max(0.0) }
}

impl SkyDistribution {
    /// Builds the distribution of a sky type; `sun`: unit vector toward the sun, z up. Only its angle to the viewed direction counts.
    pub fn new(sky_type: impl Into<SkyType>, sun: DVec3) -> Self {
        let sky_type = sky_type.into();
        let Some([a, b, c, d, e]) = sky_type.parameters() else {
            let indicatrix = Indicatrix::new(0.0, -1.0, 0.0);
            let horizontal_ratio = Remembered::default();
            return Self { sky_type, sun, a: 0.0, b: -1.0, indicatrix, per_zenith: 1.0, horizontal_ratio };
        };
        let indicatrix = Indicatrix::new(c, d, e);
        let sun_zenith_angle = libm::atan2(sun.truncate().length(), sun.z);
        let of_zenith = indicatrix.at(sun_zenith_angle, sun.z) * gradation(a, b, 1.0);
        let per_zenith = if of_zenith > 0.0 { 1.0 / of_zenith } else { 1.0 };
        Self { sky_type, sun, a, b, indicatrix, per_zenith, horizontal_ratio: Remembered::default() }
    }

    /// Returns the set of parameters that the distribution was built from.
    pub fn sky_type(&self) -> SkyType {
        self.sky_type
    }

    /// True where the luminance depends on the zenith angle alone: where the indicatrix is 1 everywhere.
    pub fn is_azimuthally_uniform(&self) -> bool {
        self.indicatrix.c == 0.0 && self.indicatrix.e == 0.0
    }

    /// Returns the unit vector toward the sun.
    pub fn sun(&self) -> DVec3 {
        self.sun
    }

    /// Computes L/Lz toward the unit vector `direction`; zero below the horizon.
    ///
    /// Type 12 with the sun 60 degrees high in the north, seen 45 degrees high in the south, as the library colour-science prints
    /// it:
    ///
    /// ```
    /// use skyduct_physics::sky::{CieType, SkyDistribution, direction};
    ///
    /// let degrees = f64::to_radians;
    /// let sky = SkyDistribution::new(CieType::new(12).unwrap(), direction(degrees(60.0), 0.0));
    /// let seen = sky.relative_luminance(direction(degrees(45.0), degrees(180.0)));
    /// assert!((seen - 0.4544524).abs() < 1e-7);
    /// ```
    #[inline]
    pub fn relative_luminance(&self, direction: DVec3) -> f64 {
        if direction.z < 0.0 {
            return 0.0;
        }
        if self.sky_type == SkyType::Cie(CieType::TRADITIONAL_OVERCAST) {
            return (1.0 + 2.0 * direction.z) / 3.0;
        }
        let cos_chi = self.sun.dot(direction);
        // acos loses half the digits near the sun, where the indicatrix has its cusp
        let chi = libm::atan2(self.sun.cross(direction).length(), cos_chi);
        self.indicatrix.at(chi, cos_chi) * gradation(self.a, self.b, direction.z) * self.per_zenith
    }

    /// Computes the factor of L/Lz that depends on the height alone; `z`: cosine of the zenith angle, 0..=1. Its product with
    /// [`Self::of_distance`] is [`Self::relative_luminance`].
    pub fn of_height(&self, z: f64) -> f64 {
        match self.sky_type {
            SkyType::Cie(CieType::TRADITIONAL_OVERCAST) => (1.0 + 2.0 * z) / 3.0,
            _ => gradation(self.a, self.b, z) * self.per_zenith,
        }
    }

    /// Computes the factor of L/Lz that depends on the distance from the sun alone; `chord`: length of the difference of the two unit
    /// vectors, 0..=2.
    pub fn of_distance(&self, chord: f64) -> f64 {
        let chi = 2.0 * libm::asin(0.5 * chord);
        self.indicatrix.at(chi, 1.0 - 0.5 * chord * chord)
    }

    /// Computes I = D/Lz, the horizontal illuminance per zenith luminance, in sr; relative error below 1e-11.
    ///
    /// Integrated in polar coordinates around the sun, where the cusp of f(chi) is at the origin. The rings chi = constant touch the
    /// horizon at chi = gamma and pi - gamma (gamma: solar altitude); a substitution flat at both ends of each interval removes the root
    /// singularities there. Where the luminance depends on the zenith angle alone, the integral runs along that angle, and has the same
    /// bits under any sun.
    ///
    /// A uniform sky has pi, the traditional overcast one 7 pi / 9:
    ///
    /// ```
    /// use std::f64::consts::PI;
    /// use skyduct_physics::sky::{CieType, SkyDistribution, direction};
    ///
    /// let ratio = |cie_type| SkyDistribution::new(cie_type, direction(0.6, 0.0)).horizontal_ratio();
    /// assert!((ratio(CieType::UNIFORM) - PI).abs() < 1e-11);
    /// assert_eq!(ratio(CieType::TRADITIONAL_OVERCAST), 7.0 * PI / 9.0);
    /// ```
    pub fn horizontal_ratio(&self) -> f64 {
        *self.horizontal_ratio.0.get_or_init(|| self.integrated_horizontal_ratio())
    }

    fn integrated_horizontal_ratio(&self) -> f64 {
        if self.sky_type == SkyType::Cie(CieType::TRADITIONAL_OVERCAST) {
            return 7.0 * PI / 9.0;
        }
        // within 1e-13 of the limit for all types, from the horizon to the zenith
        let rule = Flattened::new(64);
        if self.is_azimuthally_uniform() {
            // the sun has no part in it, not even in the rounding: 2 pi int phi cos Z sin Z dZ
            let above_uniform =
                rule.integrate(0.0, 1.0, |cos_zenith| self.a * libm::exp(self.b / cos_zenith) * cos_zenith);
            return PI * (1.0 + 2.0 * above_uniform) * self.per_zenith;
        }
        let sin_gamma = self.sun.z.clamp(-1.0, 1.0);
        let cos_gamma = self.sun.truncate().length();
        let gamma = libm::atan2(sin_gamma, cos_gamma);
        let ring = |chi: f64| {
            let (sin_chi, cos_chi) = libm::sincos(chi);
            // cos Z = p + q cos psi on the ring; psi_end: where the ring goes below the horizon
            let (p, q) = (cos_chi * sin_gamma, sin_chi * cos_gamma);
            let psi_end = if p >= q {
                PI
            } else if p <= -q {
                0.0
            } else {
                libm::acos(-p / q)
            };
            let along = rule.integrate(0.0, psi_end, |psi| {
                let cos_zenith = (p + q * libm::cos(psi)).max(0.0);
                gradation(self.a, self.b, cos_zenith) * cos_zenith
            });
            2.0 * along * sin_chi * self.indicatrix.at(chi, cos_chi)
        };
        let edges = [0.0, gamma.abs(), PI - gamma.abs(), PI];
        let whole: f64 = edges.windows(2).map(|pair| rule.integrate(pair[0], pair[1], ring)).sum();
        whole * self.per_zenith
    }
}

/// Gauss-Legendre rule after the substitution x = u^3 (10 - 15 u + 6 u^2), whose first two derivatives vanish at both ends.
struct Flattened {
    nodes: Vec<(f64, f64)>,
}

impl Flattened {
    fn new(degree: usize) -> Self {
        let degree = std::num::NonZeroUsize::new(degree).unwrap_or(std::num::NonZeroUsize::MIN);
        let rule = GaussLegendre::new(degree);
        let nodes = rule
            .as_node_weight_pairs()
            .iter()
            .map(|(node, weight)| {
                let u = 0.5 * (1.0 + node);
                let x = u * u * u * (10.0 + u * (6.0 * u - 15.0));
                let slope = 30.0 * u * u * (1.0 - u) * (1.0 - u);
                (x, 0.5 * weight * slope)
            })
            .collect();
        Self { nodes }
    }

    fn integrate(&self, from: f64, to: f64, f: impl Fn(f64) -> f64) -> f64 {
        if to <= from {
            return 0.0;
        }
        (to - from) * self.nodes.iter().map(|(x, weight)| weight * f(from + (to - from) * x)).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sky::direction;

    fn sky(number: u8, altitude_deg: f64, azimuth_deg: f64) -> SkyDistribution {
        let sun = direction(altitude_deg.to_radians(), azimuth_deg.to_radians());
        SkyDistribution::new(CieType::new(number).unwrap(), sun)
    }

    /// Check values that the library colour-science prints (docs/physics/sky_and_sun.md#relative-luminance).
    #[test]
    fn published_check_values() {
        let view = direction(45f64.to_radians(), PI);
        assert!((sky(1, 60.0, 0.0).relative_luminance(view) - 0.8325846).abs() < 1e-7);
        assert!((sky(12, 60.0, 0.0).relative_luminance(view) - 0.4544524).abs() < 1e-7);
        assert!(
            (Indicatrix::new(10.0, -3.0, 0.45).at(30f64.to_radians(), 30f64.to_radians().cos()) - 3.3264628).abs()
                < 1e-7
        );
        assert!((gradation(4.0, -0.7, 1.0) - 2.9863412).abs() < 1e-7);
    }

    #[test]
    fn height_and_distance_make_up_the_luminance() {
        for cie_type in CieType::all() {
            let sky = SkyDistribution::new(cie_type, direction(0.6, 1.0));
            for k in 0..200 {
                let view = direction(0.0078 * f64::from(k), 0.31 * f64::from(k));
                let product = sky.of_height(view.z) * sky.of_distance((view - sky.sun()).length());
                let ratio = product / sky.relative_luminance(view);
                assert!((ratio - 1.0).abs() < 1e-12, "type {} {k}: {ratio}", cie_type.number());
            }
        }
    }

    #[test]
    fn horizon_is_finite_for_all_types() {
        for cie_type in CieType::all() {
            let sky = SkyDistribution::new(cie_type, direction(0.6, 1.0));
            for z in [0.0, -0.0, 1e-300, 1e-9, 1e-3] {
                let view = DVec3::new((1.0f64 - z * z).sqrt(), 0.0, z);
                assert!(sky.relative_luminance(view).is_finite(), "type {} z {z}", cie_type.number());
            }
            assert_eq!(sky.relative_luminance(DVec3::NEG_Z), 0.0);
        }
        assert!((sky(1, 35.0, 0.0).relative_luminance(DVec3::X) - 0.334858).abs() < 1e-6);
    }

    #[test]
    fn view_into_the_sun_is_finite() {
        for k in 0..64 {
            let sun = direction(0.3 + 0.01 * f64::from(k), 2.0 + 0.1 * f64::from(k));
            let distribution = SkyDistribution::new(CieType::new(12).unwrap(), sun);
            let f = distribution.relative_luminance(sun) / (gradation(-1.0, -0.32, sun.z) * distribution.per_zenith);
            assert!((f - 11.36017).abs() < 1e-5);
        }
    }

    #[test]
    fn uniform_sky_integrates_to_pi() {
        for altitude in [0.5, 5.0, 35.0, 89.0, 90.0] {
            assert!((sky(5, altitude, 10.0).horizontal_ratio() - PI).abs() < 1e-11, "altitude {altitude}");
        }
    }
}
