//! Diffusers: closures of a tube's lower end, in the plane of the ceiling.

use std::sync::Arc;

use super::closure::Sheet;
use super::{Closure, MeasuredDiffuser, SurfaceOptics};

/// The closure of a tube's lower end.
///
/// Coefficients are linear Rec.709 (one number three times in a photopic scene), each in 0..=1, and
/// `transmittance + reflectance <= 1`. A Lambertian sheet scatters to the side away from the light with BTDF
/// `transmittance / pi` and back with BRDF `reflectance / pi`, from either side.
#[derive(Clone, Debug, PartialEq)]
pub enum Diffuser {
    /// No closure: light passes unchanged.
    Open,
    /// A pane that light passes unscattered.
    Clear {
        /// Fraction that passes, at every angle.
        transmittance: [f64; 3],
    },
    /// A Lambertian sheet.
    Lambertian {
        /// Fraction that is scattered to the far side.
        transmittance: [f64; 3],
        /// Fraction that is scattered back.
        reflectance: [f64; 3],
    },
    /// A Lambertian and a clear zone, divided by a circle (HOLIGILM's annular kinds).
    Mixed {
        /// Radius of the dividing circle around the centre of the opening.
        lambertian_radius_m: f64,
        /// The zone within that circle.
        inner: DiffuserZone,
        /// Fraction that the Lambertian zone scatters to the far side.
        lambertian_transmittance: [f64; 3],
        /// Fraction that the Lambertian zone scatters back.
        lambertian_reflectance: [f64; 3],
        /// Fraction that passes the clear zone.
        clear_transmittance: [f64; 3],
    },
    /// A sheet that scatters by a measured table.
    Measured(Arc<MeasuredDiffuser>),
}

/// The zone that lies inside the dividing circle of a mixed diffuser.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DiffuserZone {
    /// The zone that scatters.
    Lambertian,
    /// The zone that light passes unscattered.
    Clear,
}

impl Diffuser {
    /// Returns the closure at `distance_m` from the centre of the opening, level.
    #[inline]
    pub fn at(&self, distance_m: f64) -> Closure<'_> {
        let sheet = match *self {
            Self::Open => Sheet::Specular { transmittance: [1.0; 3] },
            Self::Clear { transmittance } => Sheet::Specular { transmittance },
            Self::Lambertian { transmittance, reflectance } => Sheet::Lambertian { transmittance, reflectance },
            Self::Measured(ref diffuser) => Sheet::Measured(diffuser),
            Self::Mixed {
                lambertian_radius_m,
                inner,
                lambertian_transmittance,
                lambertian_reflectance,
                clear_transmittance,
            } => {
                let inside = distance_m < lambertian_radius_m;
                if inside == (inner == DiffuserZone::Lambertian) {
                    Sheet::Lambertian { transmittance: lambertian_transmittance, reflectance: lambertian_reflectance }
                } else {
                    Sheet::Specular { transmittance: clear_transmittance }
                }
            }
        };
        sheet.into()
    }

    /// Returns the optics of the side that faces the room; `None` of diffusers that do not reflect diffusely and everywhere alike.
    pub fn lower_side(&self) -> Option<SurfaceOptics> {
        match self {
            Self::Lambertian { reflectance, .. } => {
                Some(SurfaceOptics::diffusing(*reflectance)).filter(SurfaceOptics::gathers)
            }
            _ => None,
        }
    }

    /// Returns the inner and outer radius (m) of the zone through which light passes without scattering, within an opening of radius
    /// `opening_radius_m`; `None` when there is none.
    pub fn specular_zone(&self, opening_radius_m: f64) -> Option<(f64, f64)> {
        let zone = match *self {
            Self::Open | Self::Clear { .. } => (0.0, opening_radius_m),
            Self::Lambertian { .. } | Self::Measured(_) => return None,
            Self::Mixed { lambertian_radius_m, inner: DiffuserZone::Lambertian, .. } => {
                (lambertian_radius_m.min(opening_radius_m), opening_radius_m)
            }
            Self::Mixed { lambertian_radius_m, inner: DiffuserZone::Clear, .. } => {
                (0.0, lambertian_radius_m.min(opening_radius_m))
            }
        };
        (zone.1 > zone.0).then_some(zone)
    }

    /// Returns the inner and outer radius (m) of the zone that passes light as a Lambertian sheet, or in part so, within an opening of
    /// radius `opening_radius_m`; `None` when there is none.
    pub fn even_zone(&self, opening_radius_m: f64) -> Option<(f64, f64)> {
        let zone = match *self {
            Self::Open | Self::Clear { .. } => return None,
            Self::Lambertian { .. } => (0.0, opening_radius_m),
            Self::Measured(ref table) => return table.has_even_part().then_some((0.0, opening_radius_m)),
            Self::Mixed { lambertian_radius_m, inner: DiffuserZone::Lambertian, .. } => {
                (0.0, lambertian_radius_m.min(opening_radius_m))
            }
            Self::Mixed { lambertian_radius_m, inner: DiffuserZone::Clear, .. } => {
                (lambertian_radius_m.min(opening_radius_m), opening_radius_m)
            }
        };
        (zone.1 > zone.0).then_some(zone)
    }

    /// Returns a closure that reflects like this one and passes nothing, for light from below that is lost once it has passed.
    pub fn opaque(&self) -> Self {
        let black = [0.0; 3];
        let mut opaque = self.clone();
        match &mut opaque {
            Self::Open => return Self::Clear { transmittance: black },
            Self::Clear { transmittance } | Self::Lambertian { transmittance, .. } => *transmittance = black,
            Self::Mixed { lambertian_transmittance, clear_transmittance, .. } => {
                (*lambertian_transmittance, *clear_transmittance) = (black, black);
            }
            Self::Measured(table) => *table = Arc::new(table.opaque()),
        }
        opaque
    }

    /// Returns the table of a measured diffuser; `None` for others.
    pub fn measured(&self) -> Option<&MeasuredDiffuser> {
        match self {
            Self::Measured(table) => Some(table),
            Self::Open | Self::Clear { .. } | Self::Lambertian { .. } | Self::Mixed { .. } => None,
        }
    }

    /// True if no light passes in any direction.
    pub fn is_opaque(&self) -> bool {
        let nothing = [0.0; 3];
        match *self {
            Self::Open => false,
            Self::Clear { transmittance } | Self::Lambertian { transmittance, .. } => transmittance == nothing,
            Self::Mixed { lambertian_transmittance, clear_transmittance, .. } => {
                lambertian_transmittance == nothing && clear_transmittance == nothing
            }
            Self::Measured(ref table) => table.is_opaque(),
        }
    }

    /// True if a part of an opening of radius `opening_radius_m` scatters.
    pub fn scatters(&self, opening_radius_m: f64) -> bool {
        match *self {
            Self::Open | Self::Clear { .. } => false,
            Self::Lambertian { .. } | Self::Measured(_) => true,
            Self::Mixed { lambertian_radius_m, inner, .. } => match inner {
                DiffuserZone::Lambertian => lambertian_radius_m > 0.0,
                DiffuserZone::Clear => lambertian_radius_m < opening_radius_m,
            },
        }
    }
}
