//! The three skies of the IES recommended practice, which older studies and photometric programs use.
//!
//! Their luminance distributions are members of the family of the CIE general sky: gradation 1 + a exp(b / cos Z),
//! indicatrix 1 + c (exp(d chi) - exp(d pi/2)) + e cos^2 chi. Source: IES, "Recommended Practice for the Calculation of
//! Daylight Availability", J. Illum. Eng. Soc. 13 (1984) 381-392.

/// A sky condition of the IES.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IesSky {
    /// Sky 2.98 times as bright at the zenith as at the horizon, alike at all azimuths, without a beam.
    Overcast,
    /// Sky that is bright around the sun, with a weak beam (extinction 0.80).
    PartlyCloudy,
    /// The CIE clear sky of low turbidity (type 12), with a strong beam (extinction 0.21).
    Clear,
}

/// Extraterrestrial normal illuminance of the IES in lux (without the eccentricity of the Earth's orbit).
pub const IES_EXTRATERRESTRIAL_LUX: f64 = 127_500.0;

impl IesSky {
    /// The three conditions, from overcast to clear.
    pub const ALL: [Self; 3] = [Self::Overcast, Self::PartlyCloudy, Self::Clear];

    /// Returns the name in documents and results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Overcast => "ies_overcast",
            Self::PartlyCloudy => "ies_partly_cloudy",
            Self::Clear => "ies_clear",
        }
    }

    /// Returns gradation a, b and indicatrix c, d, e.
    ///
    /// Overcast: 0.864 exp(-0.52 / cos Z) / exp(-0.52) + 0.136 (1 - exp(-0.52 / cos Z)) / (1 - exp(-0.52)), divided by its
    /// value at the horizon. Partly cloudy: (0.526 + 5 exp(-1.5 chi)) (1 - exp(-0.80 / cos Z)), where 0.526 is
    /// 1 - 5 exp(-1.5 pi/2) to the printed digits. Clear: (0.91 + 10 exp(-3 chi) + 0.45 cos^2 chi) (1 - exp(-0.32 / cos Z)),
    /// the CIE type 12 to 2e-4 of the indicatrix (0.91 there is 1 - 10 exp(-3 pi/2) = 0.91017).
    pub fn parameters(self) -> [f64; 5] {
        match self {
            Self::Overcast => {
                let at_zenith = libm::exp(-0.52f64);
                let horizon = 0.136 / (1.0 - at_zenith);
                [(0.864 / at_zenith - horizon) / horizon, -0.52, 0.0, -1.0, 0.0]
            }
            Self::PartlyCloudy => [-1.0, -0.80, 5.0, -1.5, 0.0],
            Self::Clear => [-1.0, -0.32, 10.0, -3.0, 0.45],
        }
    }

    /// Computes the unobstructed horizontal illuminance of the sky alone in lux, A + B sin^C(altitude); altitude in radians, zero at
    /// and below the horizon.
    ///
    /// ```
    /// use skyduct_physics::sky::IesSky;
    ///
    /// let zenith_sun = std::f64::consts::FRAC_PI_2;
    /// assert_eq!(IesSky::Overcast.diffuse_horizontal_illuminance_lux(zenith_sun), 21_300.0);
    /// assert_eq!(IesSky::Clear.diffuse_horizontal_illuminance_lux(zenith_sun), 16_300.0);
    /// ```
    pub fn diffuse_horizontal_illuminance_lux(self, altitude: f64) -> f64 {
        if altitude <= 0.0 {
            return 0.0;
        }
        let sin = libm::sin(altitude);
        match self {
            Self::Overcast => 300.0 + 21_000.0 * sin,
            Self::PartlyCloudy => 300.0 + 45_000.0 * sin,
            Self::Clear => 800.0 + 15_500.0 * sin.sqrt(),
        }
    }

    /// Returns the extinction of the beam per unit of optical air mass; `None` for the overcast sky, which has no beam.
    pub fn extinction(self) -> Option<f64> {
        match self {
            Self::Overcast => None,
            Self::PartlyCloudy => Some(0.80),
            Self::Clear => Some(0.21),
        }
    }

    /// Computes the normal illuminance of the beam in lux, 127.5 klx exp(-c / sin(altitude)); altitude in radians, zero at and below
    /// the horizon and for the overcast sky.
    ///
    /// ```
    /// use skyduct_physics::sky::IesSky;
    ///
    /// let zenith_sun = std::f64::consts::FRAC_PI_2;
    /// let beam = IesSky::Clear.beam_normal_illuminance_lux(zenith_sun);
    /// assert!((beam - 127_500.0 * (-0.21f64).exp()).abs() < 1e-9);
    /// ```
    pub fn beam_normal_illuminance_lux(self, altitude: f64) -> f64 {
        match self.extinction() {
            Some(extinction) if altitude > 0.0 => {
                IES_EXTRATERRESTRIAL_LUX * libm::exp(-extinction / libm::sin(altitude))
            }
            _ => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::sky::{SkyDistribution, direction};

    /// The formulae as the IES prints them, against the general sky with these parameters; the printed constants 0.526
    /// and 0.91 are rounded, which moves the indicatrix by 5e-4 and 2e-4 at most.
    #[test]
    fn equal_the_printed_formulae() {
        let sun = direction(0.6, 1.0);
        let sun_zenith = FRAC_PI_2 - 0.6;
        for (altitude, azimuth) in [(0.05, 0.3), (0.6, 1.2), (1.2, 4.0), (FRAC_PI_2, 0.0)] {
            let view = direction(altitude, azimuth);
            let chi = view.dot(sun).clamp(-1.0, 1.0).acos();
            let inverse = 1.0 / altitude.sin();
            let relative = |sky: IesSky| SkyDistribution::new(sky, sun).relative_luminance(view);
            let partly = |chi: f64, inverse: f64| (0.526 + 5.0 * (-1.5 * chi).exp()) * (1.0 - (-0.80 * inverse).exp());
            let clear = |chi: f64, inverse: f64| {
                (0.91 + 10.0 * (-3.0 * chi).exp() + 0.45 * chi.cos().powi(2)) * (1.0 - (-0.32 * inverse).exp())
            };
            let overcast = 0.864 * (0.52 - 0.52 * inverse).exp()
                + 0.136 * (1.0 - (-0.52 * inverse).exp()) / (1.0 - (-0.52f64).exp());
            assert!((relative(IesSky::Overcast) / overcast - 1.0).abs() < 1e-12);
            let printed = partly(chi, inverse) / partly(sun_zenith, 1.0);
            assert!((relative(IesSky::PartlyCloudy) / printed - 1.0).abs() < 1e-3, "{altitude}");
            let printed = clear(chi, inverse) / clear(sun_zenith, 1.0);
            assert!((relative(IesSky::Clear) / printed - 1.0).abs() < 4e-4, "{altitude}");
        }
    }

    /// Worked values of the formulae at an altitude of 30 degrees, where the sine is one half.
    #[test]
    fn levels_at_thirty_degrees() {
        let altitude = 30f64.to_radians();
        let diffuse = IesSky::ALL.map(|sky| sky.diffuse_horizontal_illuminance_lux(altitude));
        for (value, expected) in diffuse.into_iter().zip([10_800.0, 22_800.0, 800.0 + 15_500.0 * 0.5f64.sqrt()]) {
            assert!((value - expected).abs() < 1e-9 * expected);
        }
        assert_eq!(IesSky::Overcast.beam_normal_illuminance_lux(altitude), 0.0);
        let beam = IesSky::Clear.beam_normal_illuminance_lux(altitude);
        assert!((beam - 127_500.0 * (-0.42f64).exp()).abs() < 1e-6);
        assert_eq!(IesSky::Clear.beam_normal_illuminance_lux(0.0), 0.0);
        assert_eq!(IesSky::Clear.diffuse_horizontal_illuminance_lux(-0.1), 0.0);
    }
}
