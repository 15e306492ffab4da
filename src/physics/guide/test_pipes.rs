//! Pipes and skies for the tests of several files.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use super::{Guide, StraightGuide};
use crate::optics::mirror::{Mirror, MirrorTable};
use crate::sky::{CieType, Sky, SkyDistribution, direction};

/// Radius of all pipes in m.
pub const RADIUS: f64 = 0.127;

/// Returns a pipe with one reflectance, which has closed forms.
pub fn straight(length: f64, reflectance: f64) -> Guide {
    let reflectance = Mirror::Constant([reflectance; 3]);
    Guide::Straight(StraightGuide { radius: RADIUS, length, reflectance, collector_transmittance: [1.0; 3] })
}

/// Returns a CIE sky of 1000 cd/m2 at the zenith, with the sun 35 degrees high.
pub fn cie_sky(number: u8) -> Sky {
    let distribution = SkyDistribution::new(CieType::new(number).unwrap(), direction(35f64.to_radians(), 2.0));
    Sky::new(distribution, 1000.0)
}

/// Returns a straight pipe with one reflectance given as a table, so that it is traced by rays.
pub fn straight_by_rays(length: f64, reflectance: f64) -> Guide {
    let table = MirrorTable::new(&[(0.0, [reflectance; 3]), (FRAC_PI_2, [reflectance; 3])]).unwrap();
    let reflectance = Mirror::ByAngle(Arc::new(table));
    Guide::Straight(StraightGuide { radius: RADIUS, length, reflectance, collector_transmittance: [1.0; 3] })
}
