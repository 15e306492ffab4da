//! The CIE general sky, the all-weather sky of Perez, and the sun, in absolute luminance, and what hides them.

pub mod cie;
pub mod horizon;
pub mod ies;
pub mod looked_up;
pub mod moment;
pub mod obstruction;
pub mod opening;
pub mod patches;
pub mod perez;
pub mod sampler;
pub mod sun;
pub mod surroundings;
pub mod tabulated;
pub mod zenith;

use std::sync::Arc;

use glam::DVec3;

pub use cie::{CieType, SkyDistribution};
pub use horizon::Horizon;
pub use ies::IesSky;
pub use moment::{Moments, SkyMoment};
pub use obstruction::Obstruction;
pub use perez::{Irradiances, PerezSky};
pub use sun::Sun;
pub use surroundings::{OutsidePart, Surroundings};

/// Type of a sky's luminance distribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SkyType {
    /// A type of the CIE general sky, or the traditional overcast sky.
    Cie(CieType),
    /// A sky condition of the IES: a named set of parameters of the same general formula.
    Ies(IesSky),
    /// Parameters a, b, c, d, e of the general formula that follow from measurements, such as those of [`PerezSky::sky_type`]; where the
    /// formula is negative the sky is black.
    Free([f64; 5]),
}

impl From<CieType> for SkyType {
    fn from(cie_type: CieType) -> Self {
        Self::Cie(cie_type)
    }
}

impl From<IesSky> for SkyType {
    fn from(sky: IesSky) -> Self {
        Self::Ies(sky)
    }
}

impl SkyType {
    /// Returns the parameters a, b, c, d, e; `None` for the traditional overcast sky.
    pub fn parameters(self) -> Option<[f64; 5]> {
        match self {
            Self::Cie(cie_type) => cie_type.parameters(),
            Self::Ies(sky) => Some(sky.parameters()),
            Self::Free(parameters) => Some(parameters),
        }
    }

    /// True if the luminances depend on where the sun is: false without an indicatrix (c = e = 0), as of types 1, 3, 5 and 16 of the CIE and the
    /// overcast sky of the IES.
    ///
    /// ```
    /// use skyduct_physics::sky::{CieType, SkyType};
    ///
    /// let independent = CieType::all().filter(|cie_type| !SkyType::Cie(*cie_type).depends_on_sun());
    /// assert_eq!(independent.map(CieType::number).collect::<Vec<_>>(), [1, 3, 5, 16]);
    /// ```
    pub fn depends_on_sun(self) -> bool {
        self.parameters().is_some_and(|[_, _, c, _, e]| c != 0.0 || e != 0.0)
    }

    /// True for the skies that have no direct beam, under which results have daylight factors: types 1 to 6 and 16 of the CIE, and the
    /// overcast sky of the IES. Free parameters tell nothing of the beam.
    pub fn is_sunless(self) -> bool {
        match self {
            Self::Cie(cie_type) => cie_type.is_sunless(),
            Self::Ies(sky) => sky.extinction().is_none(),
            Self::Free(_) => false,
        }
    }
}

impl std::fmt::Display for SkyType {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Cie(cie_type) => write!(f, "CIE type {}", cie_type.number()),
            Self::Ies(sky) => f.write_str(sky.name()),
            Self::Free(_) => f.write_str("all-weather sky"),
        }
    }
}

/// A CIE general sky of absolute luminance.
#[derive(Clone, Debug)]
pub struct Sky {
    /// Luminance in every direction relative to that of the zenith.
    pub distribution: SkyDistribution,
    /// Luminance in cd/m2, >= 0, where the distribution is 1, which is at the zenith unless that is black.
    pub zenith_luminance_cd_m2: f64,
    /// Surroundings that hide a part of the sky; `None` for an open sky over black ground.
    pub surroundings: Option<Arc<Surroundings>>,
}

impl Sky {
    /// Creates an open sky over black ground.
    pub fn new(distribution: SkyDistribution, zenith_luminance_cd_m2: f64) -> Self {
        Self { distribution, zenith_luminance_cd_m2, surroundings: None }
    }

    /// Computes the luminance in cd/m2 seen toward the unit vector `direction` (z up): that of the surroundings where they are in front,
    /// and without surroundings zero below the horizontal.
    #[inline]
    pub fn luminance(&self, direction: DVec3) -> f64 {
        self.in_front(direction)
            .unwrap_or_else(|| self.zenith_luminance_cd_m2 * self.distribution.relative_luminance(direction))
    }

    /// Returns the luminance in cd/m2 of what is in front of the sky toward a unit vector; `None` where nothing is.
    #[inline]
    pub(crate) fn in_front(&self, direction: DVec3) -> Option<f64> {
        self.surroundings.as_ref()?.luminance(direction)
    }

    /// True if another sky has the very same surroundings.
    pub fn has_surroundings_of(&self, other: &Self) -> bool {
        match (&self.surroundings, &other.surroundings) {
            (Some(of_one), Some(of_other)) => Arc::ptr_eq(of_one, of_other),
            (of_one, of_other) => of_one.is_none() && of_other.is_none(),
        }
    }

    /// Returns the horizon in front of the sky, if a part of it is above 0.
    pub fn horizon(&self) -> Option<&Horizon> {
        self.surroundings.as_ref()?.horizon.as_ref()
    }

    /// Returns the luminance of the ground in cd/m2; zero without surroundings.
    pub fn ground_luminance_cd_m2(&self) -> f64 {
        self.surroundings.as_ref().map_or(0.0, |surroundings| surroundings.ground_luminance_cd_m2)
    }

    /// Returns the sky without its surroundings.
    pub fn open(&self) -> Self {
        Self { surroundings: None, ..self.clone() }
    }

    /// Computes the unobstructed horizontal illuminance in lux.
    pub fn horizontal_illuminance_lux(&self) -> f64 {
        self.zenith_luminance_cd_m2 * self.distribution.horizontal_ratio()
    }
}

/// Returns the unit vector toward `altitude` above the horizon and `azimuth` clockwise from +y (both radians), z up.
///
/// ```
/// let east = skyduct_physics::sky::direction(0.0, 90f64.to_radians());
/// assert!((east - glam::DVec3::X).length() < 1e-15);
/// ```
pub fn direction(altitude: f64, azimuth: f64) -> DVec3 {
    let (sin_altitude, cos_altitude) = libm::sincos(altitude);
    let (sin_azimuth, cos_azimuth) = libm::sincos(azimuth);
    DVec3::new(sin_azimuth * cos_altitude, cos_azimuth * cos_altitude, sin_altitude)
}
