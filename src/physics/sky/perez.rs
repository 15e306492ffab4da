//! All-weather sky of Perez: luminance distribution and level of a sky from its irradiances.
//!
//! Clearness, brightness and luminous efficacies are those of Perez et al. (1990), the distribution is that of Perez, Seals and Michalsky
//! (1993), whose formula is that of the CIE general sky with other parameters; docs/physics/sky_and_sun.md#the-all-weather-sky.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec3;

use super::{Sky, SkyDistribution, SkyType};

/// Irradiances of a moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Irradiances {
    /// Direct normal irradiance in W/m2, >= 0.
    pub direct_normal_w_m2: f64,
    /// Diffuse horizontal irradiance in W/m2, >= 0.
    pub diffuse_horizontal_w_m2: f64,
    /// Dew point in degrees Celsius, by which the water in the air is estimated.
    pub dew_point_c: f64,
}

/// State of an all-weather sky: what its distribution and its efficacies follow from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PerezSky {
    /// Clearness epsilon, 1 (overcast) to 12 (clear).
    pub clearness: f64,
    /// Brightness Delta: diffuse irradiance over that outside the atmosphere, 0.01 to 0.6.
    pub brightness: f64,
    sun: DVec3,
    irradiances: Irradiances,
}

/// Solar constant of Perez et al. (1990), in W/m2.
const SOLAR_CONSTANT: f64 = 1367.0;

/// Largest clearness, that of a sky without diffuse light.
const MOST_CLEARNESS: f64 = 12.0;

/// Range of brightness to which states are clamped: with more of it the indicatrix of some states is negative nearly everywhere.
const BRIGHTNESS: [f64; 2] = [0.01, 0.6];

/// Lower bounds of the eight classes of clearness (Perez et al. 1990, table 1).
const CLASSES: [f64; 8] = [1.0, 1.065, 1.230, 1.500, 1.950, 2.800, 4.500, 6.200];

/// Luminous efficacies by class (Perez et al. 1990, table 4): a, b, c, d of the diffuse light, and of the direct light.
const EFFICACIES: [[[f64; 4]; 2]; 8] = [
    [[97.24, -0.46, 12.00, -8.91], [57.20, -4.55, -2.98, 117.12]],
    [[107.22, 1.15, 0.59, -3.95], [98.99, -3.46, -1.21, 12.38]],
    [[104.97, 2.96, -5.53, -8.77], [109.83, -4.90, -1.71, -8.81]],
    [[102.39, 5.59, -13.95, -13.90], [110.34, -5.84, -1.99, -4.56]],
    [[100.71, 5.94, -22.75, -23.74], [106.36, -3.97, -1.75, -6.16]],
    [[106.42, 3.83, -36.15, -28.83], [107.19, -1.25, -1.51, -26.73]],
    [[141.88, 1.90, -53.24, -14.03], [105.75, 0.77, -1.26, -34.44]],
    [[152.23, 0.35, -45.27, -7.98], [101.18, 1.58, -1.10, -8.29]],
];

/// Coefficients x1 to x4 of the parameters a, b, c, d, e by class (Perez, Seals and Michalsky 1993, table 1).
#[rustfmt::skip]
const COEFFICIENTS: [[[f64; 4]; 5]; 8] = [
    [[1.3525, -0.2576, -0.269, -1.4366], [-0.767, 0.0007, 1.2734, -0.1233], [2.8, 0.6004, 1.2375, 1.0], [1.8734, 0.6297, 0.9738, 0.2809], [0.0356, -0.1246, -0.5718, 0.9938]],
    [[-1.2219, -0.773, 1.4148, 1.1016], [-0.2054, 0.0367, -3.9128, 0.9156], [6.975, 0.1774, 6.4477, -0.1239], [-1.5798, -0.5081, -1.7812, 0.108], [0.2624, 0.0672, -0.219, -0.4285]],
    [[-1.1, -0.2515, 0.8952, 0.0156], [0.2782, -0.1812, -4.5, 1.1766], [24.7219, -13.0812, -37.7, 34.8438], [-5.0, 1.5218, 3.9229, -2.6204], [-0.0156, 0.1597, 0.4199, -0.5562]],
    [[-0.5484, -0.6654, -0.2672, 0.7117], [0.7234, -0.6219, -5.6812, 2.6297], [33.3389, -18.3, -62.25, 52.0781], [-3.5, 0.0016, 1.1477, 0.1062], [0.4659, -0.3296, -0.0876, -0.0329]],
    [[-0.6, -0.3566, -2.5, 2.325], [0.2937, 0.0496, -5.6812, 1.8415], [21.0, -4.7656, -21.5906, 7.2492], [-3.5, -0.1554, 1.4062, 0.3988], [0.0032, 0.0766, -0.0656, -0.1294]],
    [[-1.0156, -0.367, 1.0078, 1.4051], [0.2875, -0.5328, -3.85, 3.375], [14.0, -0.9999, -7.1406, 7.5469], [-3.4, -0.1078, -1.075, 1.5702], [-0.0672, 0.4016, 0.3017, -0.4844]],
    [[-1.0, 0.0211, 0.5025, -0.5119], [-0.3, 0.1922, 0.7023, -1.6317], [19.0, -5.0, 1.2438, -1.9094], [-4.0, 0.025, 0.3844, 0.2656], [1.0468, -0.3788, -2.4517, 1.4656]],
    [[-1.05, 0.0289, 0.426, 0.359], [-0.325, 0.1156, 0.7781, 0.0025], [31.0625, -14.5, -46.1148, 55.375], [-7.2312, 0.405, 13.35, 0.6234], [1.5, -0.6426, 1.8564, 0.5636]],
];

impl PerezSky {
    /// Computes the state of a sky from its irradiances, under a sun at the unit vector `sun`, which counts as on the horizon if it is
    /// below; `day_of_year`, from 1, gives the distance of the sun, which is the mean one without it. Without diffuse light the sky is clear.
    ///
    /// ```
    /// use skyduct_physics::sky::{Irradiances, PerezSky, direction};
    ///
    /// let irradiances = Irradiances { direct_normal_w_m2: 0.0, diffuse_horizontal_w_m2: 60.0, dew_point_c: 11.0 };
    /// let overcast = PerezSky::new(irradiances, direction(35f64.to_radians(), 0.0), Some(1));
    /// assert!(overcast.clearness == 1.0 && (overcast.brightness - 0.0737).abs() < 1e-4);
    /// ```
    pub fn new(irradiances: Irradiances, sun: DVec3, day_of_year: Option<u16>) -> Self {
        let Irradiances { direct_normal_w_m2: direct, diffuse_horizontal_w_m2: diffuse, .. } = irradiances;
        let zenith = zenith_angle(sun);
        let k = 1.041 * zenith * zenith * zenith;
        let clearness = if diffuse > 0.0 { ((diffuse + direct) / diffuse + k) / (1.0 + k) } else { MOST_CLEARNESS };
        let outside = SOLAR_CONSTANT * day_of_year.map_or(1.0, eccentricity);
        let [least, most] = BRIGHTNESS;
        Self {
            clearness: clearness.clamp(1.0, MOST_CLEARNESS),
            brightness: (diffuse * air_mass(zenith) / outside).clamp(least, most),
            sun,
            irradiances,
        }
    }

    /// Returns the parameters a, b, c, d, e of Perez, with b at most 0, above which the horizon would be brighter by any factor.
    pub fn parameters(&self) -> [f64; 5] {
        let zenith = zenith_angle(self.sun);
        let class = self.class();
        let delta = match self.clearness {
            // in this range the distribution is not fitted for dark skies
            clearness if clearness > 1.065 && clearness < 2.8 => self.brightness.max(0.2),
            _ => self.brightness,
        };
        let coefficients = &COEFFICIENTS[class];
        let mut of = coefficients.map(|[x1, x2, x3, x4]| x1 + x2 * zenith + delta * (x3 + x4 * zenith));
        if class == 0 {
            let ([x1, x2, x3, x4], [y1, y2, y3, y4]) = (coefficients[2], coefficients[3]);
            of[2] = libm::exp(libm::pow(delta * (x1 + x2 * zenith), x3)) - x4;
            of[3] = -libm::exp(delta * (y1 + y2 * zenith)) + y3 + delta * y4;
        }
        of[1] = of[1].min(0.0);
        of
    }

    /// Returns the sky of the CIE general formula that is proportional to this one: Perez' indicatrix 1 + c exp(d chi) + e cos^2 chi is
    /// 1 + K times that of the CIE, with K = c exp(d pi / 2), and c and e divided by 1 + K.
    pub fn sky_type(&self) -> SkyType {
        let [a, b, c, d, e] = self.parameters();
        let whole = 1.0 + c * libm::exp(d * FRAC_PI_2);
        // a gradation that is the same everywhere counts for nothing; it may be negative
        let a = if b == 0.0 { 0.0 } else { a };
        SkyType::Free([a, b, c / whole, d, e / whole])
    }

    /// Computes the diffuse horizontal illuminance in lux.
    pub fn diffuse_horizontal_illuminance_lux(&self) -> f64 {
        let [a, b, c, d] = EFFICACIES[self.class()][0];
        let efficacy = a + b * self.water_cm() + c * self.sun.z.max(0.0) + d * libm::log(self.brightness);
        self.irradiances.diffuse_horizontal_w_m2 * efficacy.max(0.0)
    }

    /// Computes the direct normal illuminance in lux.
    pub fn direct_normal_illuminance_lux(&self) -> f64 {
        let [a, b, c, d] = EFFICACIES[self.class()][1];
        let low = libm::exp(5.73 * zenith_angle(self.sun) - 5.0);
        let efficacy = a + b * self.water_cm() + c * low + d * self.brightness;
        self.irradiances.direct_normal_w_m2 * efficacy.max(0.0)
    }

    /// Returns the sky with its absolute luminance, which has the diffuse horizontal illuminance of the efficacies.
    pub fn sky(&self) -> Sky {
        let distribution = SkyDistribution::new(self.sky_type(), self.sun);
        let zenith_luminance_cd_m2 = self.diffuse_horizontal_illuminance_lux() / distribution.horizontal_ratio();
        Sky::new(distribution, zenith_luminance_cd_m2)
    }

    /// Returns the number of the class of clearness, from 0.
    fn class(&self) -> usize {
        CLASSES.partition_point(|bound| *bound <= self.clearness).saturating_sub(1)
    }

    /// Estimates the precipitable water in cm (Perez et al. 1990, eq. 3).
    fn water_cm(&self) -> f64 {
        libm::exp(0.07 * self.irradiances.dew_point_c - 0.075)
    }
}

fn zenith_angle(sun: DVec3) -> f64 {
    libm::atan2(sun.truncate().length(), sun.z).min(FRAC_PI_2)
}

/// Computes the factor by which the sun's light outside the atmosphere differs from its mean over the year (Spencer 1971).
fn eccentricity(day_of_year: u16) -> f64 {
    let day = TAU * (f64::from(day_of_year) - 1.0) / 365.0;
    let ((sin, cos), (sin_2, cos_2)) = (libm::sincos(day), libm::sincos(2.0 * day));
    1.00011 + 0.034221 * cos + 0.00128 * sin + 0.000719 * cos_2 + 0.000077 * sin_2
}

/// Computes the relative optical air mass at a zenith angle in radians (Kasten 1966).
fn air_mass(zenith: f64) -> f64 {
    1.0 / (libm::cos(zenith) + 0.15 * libm::pow(93.885 - zenith.to_degrees(), -1.253))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sky::direction;

    /// Returns a state with the given clearness and brightness; its irradiances are not checked.
    fn state(clearness: f64, brightness: f64, altitude_deg: f64) -> PerezSky {
        let irradiances = Irradiances { direct_normal_w_m2: 100.0, diffuse_horizontal_w_m2: 100.0, dew_point_c: 11.0 };
        PerezSky { clearness, brightness, sun: direction(altitude_deg.to_radians(), 0.4), irradiances }
    }

    /// Returns `count` states spread over all classes, brightnesses and suns by multiples of irrational numbers.
    fn states(count: u32) -> impl Iterator<Item = PerezSky> {
        (0..count).map(|k| {
            let part = |step: f64| (step * f64::from(k)).fract();
            let class = CLASSES[k as usize % 8];
            state(class * (1.0 + 0.06 * part(0.754_877)), 0.01 + 0.59 * part(0.569_84), 0.1 + 89.8 * part(0.438_579))
        })
    }

    /// Compares the relative luminance with Perez' own formula.
    #[test]
    fn a_sky_of_perez_is_a_general_sky() {
        let mut compared = 0;
        for sky in states(400) {
            let [a, b, c, d, e] = sky.parameters();
            let distribution = SkyDistribution::new(sky.sky_type(), sky.sun);
            let perez = |toward: DVec3| {
                let cos = sky.sun.dot(toward);
                let chi = libm::atan2(sky.sun.cross(toward).length(), cos);
                (1.0 + a * libm::exp(b / toward.z)) * (1.0 + c * libm::exp(d * chi) + e * cos * cos)
            };
            let reference = direction(0.5, 0.4);
            for k in 1..40 {
                let toward = direction(0.039 * f64::from(k), 0.31 * f64::from(k));
                let (luminance, expected) = (distribution.relative_luminance(toward), perez(toward));
                if expected <= 0.0 || perez(reference) <= 0.0 {
                    continue;
                }
                let ratio = luminance / distribution.relative_luminance(reference) / (expected / perez(reference));
                assert!((ratio - 1.0).abs() < 2e-14 / expected.min(1.0), "{sky:?}: {ratio}");
                compared += 1;
            }
        }
        assert!(compared > 15_000);
    }

    /// Compares the light of a thousand skies, by a midpoint rule around the sun that knows nothing of the exact one, with their level.
    #[test]
    fn a_sky_has_the_illuminance_of_its_efficacy() {
        for perez in states(1000) {
            let (sky, level) = (perez.sky(), perez.diffuse_horizontal_illuminance_lux());
            let (across, along) = sky.distribution.sun().any_orthonormal_pair();
            let mut sum = 0.0;
            let (rings, sectors) = (150, 240);
            for ring in 0..rings {
                // angles crowd at the sun, where the cusp is
                let u = (f64::from(ring) + 0.5) / f64::from(rings);
                let (chi, slope) = (std::f64::consts::PI * u * u, std::f64::consts::TAU * u);
                for sector in 0..sectors {
                    let (sin, cos) = (TAU * (f64::from(sector) + 0.5) / f64::from(sectors)).sin_cos();
                    let toward = perez.sun * chi.cos() + (across * cos + along * sin) * chi.sin();
                    let weight = chi.sin() * slope / f64::from(rings) * TAU / f64::from(sectors);
                    sum += sky.luminance(toward) * toward.z.max(0.0) * weight;
                }
            }
            assert!((sum / level - 1.0).abs() < 3e-4, "{perez:?}: {sum} {level}");
        }
    }

    #[test]
    fn classes_begin_at_their_bounds() {
        for (class, bound) in CLASSES.into_iter().enumerate() {
            assert_eq!(state(bound, 0.1, 40.0).class(), class);
            assert_eq!(state(bound - 1e-9, 0.1, 40.0).class(), class.saturating_sub(1));
        }
        assert_eq!(state(12.0, 0.1, 40.0).class(), 7);
    }

    /// Checks states that the formulas alone would make infinite, negative or undefined.
    #[test]
    fn extreme_states_have_finite_skies() {
        let of = |direct: f64, diffuse: f64, altitude_deg: f64| {
            let irradiances =
                Irradiances { direct_normal_w_m2: direct, diffuse_horizontal_w_m2: diffuse, dew_point_c: 11.0 };
            PerezSky::new(irradiances, direction(f64::to_radians(altitude_deg), 0.0), Some(1))
        };
        let without_diffuse = of(800.0, 0.0, 30.0);
        assert_eq!((without_diffuse.clearness, without_diffuse.brightness), (12.0, 0.01));
        assert_eq!(without_diffuse.sky().luminance(DVec3::Z), 0.0);
        assert_eq!(of(0.0, 0.0, 30.0).sky().luminance(DVec3::X), 0.0);
        let low = [of(850.0, 80.0, 3.0), of(1e-300, 1e-300, 1e-6), of(800.0, 80.0, 0.0), of(0.0, 10.0, -3.0)];
        for perez in low.into_iter().chain([of(900.0, 1.0, 89.9), of(1400.0, 1100.0, 90.0)]) {
            let sky = perez.sky();
            for k in 0..200 {
                let luminance = sky.luminance(direction(0.00785 * f64::from(k), 0.1 * f64::from(k)));
                assert!(luminance.is_finite() && luminance >= 0.0, "{perez:?}: {luminance}");
            }
        }
        // the zenith would be darker than black, and so would be the far side of a high sun
        for (perez, dark) in [(state(3.0, 0.01, 60.0), DVec3::Z), (state(1.6, 0.6, 89.0), direction(1.55, 0.4))] {
            let sky = perez.sky();
            assert_eq!(sky.luminance(dark), 0.0, "{perez:?}");
            assert!(sky.luminance(direction(0.02, 2.0)) > 0.0);
        }
    }
}
