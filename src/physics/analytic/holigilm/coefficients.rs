//! Fractions of the light that mirrors and diffusers transmit and reflect, in the one photopic channel.

use crate::guide::StraightGuide;
use crate::optics::Diffuser;

/// Returns the reflectance of a guide; mirrors whose reflectance depends on the angle are refused.
pub fn reflectance(guide: &StraightGuide) -> f64 {
    guide.reflectance.reflectance(|| 1.0)[0]
}

/// Returns the transmittance of a diffuser's clear zone.
pub fn clear_transmittance(diffuser: &Diffuser) -> f64 {
    match *diffuser {
        Diffuser::Clear { transmittance } => transmittance[0],
        Diffuser::Mixed { clear_transmittance, .. } => clear_transmittance[0],
        _ => 1.0,
    }
}

/// Returns the transmittance and reflectance of a diffuser's Lambertian zone.
pub fn lambertian_coefficients(diffuser: &Diffuser) -> (f64, f64) {
    match *diffuser {
        Diffuser::Lambertian { transmittance, reflectance } => (transmittance[0], reflectance[0]),
        Diffuser::Mixed { lambertian_transmittance, lambertian_reflectance, .. } => {
            (lambertian_transmittance[0], lambertian_reflectance[0])
        }
        _ => (0.0, 0.0),
    }
}
