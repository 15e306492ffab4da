//! Collectors, which cover the upper ends of tubes.

use glam::DVec3;
use serde::{Deserialize, Deserializer, Serialize};
use utoipa::ToSchema;

use crate::document::errors::Checks;
use crate::document::limits::{ABSORPTION_PER_M, PANE_TILT_DEG, REFRACTIVE_INDEX, THICKNESS_M, TURN_DEG};
use crate::document::optics::Coefficient;
use crate::document::read::tagged::{self, Reader, Tagged};
use crate::optics::Collector;
use crate::sky::direction;

/// Cover of the upper end of a tube; only `dielectric_dome` changes the direction of light.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum CollectorDocument {
    /// No cover: light enters unchanged.
    Open,
    /// Flat pane across the end of the tube.
    Flat(FlatCollector),
    /// Thin hemisphere.
    Dome(DomeCollector),
    /// Hemispherical shell that reflects and refracts by Fresnel's equations; its inner radius is the tube's, its rim is black.
    DielectricDome(DielectricDomeCollector),
}

/// Fields of a flat collector.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct FlatCollector {
    /// Fraction of the light that is transmitted, at every angle.
    pub transmittance: Coefficient,
    /// Tilt of the pane from the horizontal in degrees, 0..90, as of a roof: the tube ends in its plane. Default: the pane lies across the
    /// axis of the last segment.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tilt_deg: Option<f64>,
    /// Azimuth in degrees that a tilted pane faces, clockwise from the room's +y axis; default: 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub azimuth_deg: Option<f64>,
}

/// Fields of a thin dome.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct DomeCollector {
    /// Fraction of the light that is transmitted, at every angle.
    pub transmittance: Coefficient,
}

/// Fields of a dielectric dome.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct DielectricDomeCollector {
    /// Refractive index of the shell, 1..4.
    pub refractive_index: f64,
    /// Thickness of the shell in metres, up to 1.
    pub thickness_m: f64,
    /// Napierian absorption coefficient of the shell's material in 1/m: exp(-absorption s) of the light is left after s metres.
    /// Default: 0.
    #[serde(default)]
    #[schema(default = 0.0)]
    pub absorption_per_m: f64,
}

impl Tagged for CollectorDocument {
    const TAG: &'static str = "kind";
    const WHAT: &'static str = "a collector";
    const KINDS: &'static [(&'static str, Reader<Self>)] = &[
        ("open", |fields, of| fields.none(of).map(|()| Self::Open)),
        ("flat", |fields, of| fields.read(of).map(Self::Flat)),
        ("dome", |fields, of| fields.read(of).map(Self::Dome)),
        ("dielectric_dome", |fields, of| fields.read(of).map(Self::DielectricDome)),
    ];
}

impl<'de> Deserialize<'de> for CollectorDocument {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        tagged::deserialize(deserializer)
    }
}

impl CollectorDocument {
    /// Adds faults for coefficients and numbers out of their bounds.
    pub(crate) fn check(&self, pointer: &str, checks: &mut Checks) {
        match self {
            Self::Open => {}
            Self::Flat(FlatCollector { transmittance, tilt_deg, azimuth_deg }) => {
                transmittance.check(&format!("{pointer}/transmittance"), checks);
                if let Some(tilt_deg) = tilt_deg {
                    checks.number(&format!("{pointer}/tilt_deg"), *tilt_deg, PANE_TILT_DEG);
                }
                if let Some(azimuth_deg) = azimuth_deg {
                    checks.number(&format!("{pointer}/azimuth_deg"), *azimuth_deg, TURN_DEG);
                    if tilt_deg.is_none() {
                        checks.refuse(format!("{pointer}/azimuth_deg"), "needs `tilt_deg`, the tilt of the pane");
                    }
                }
            }
            Self::Dome(DomeCollector { transmittance }) => {
                transmittance.check(&format!("{pointer}/transmittance"), checks);
            }
            Self::DielectricDome(dome) => {
                checks.number(&format!("{pointer}/refractive_index"), dome.refractive_index, REFRACTIVE_INDEX);
                checks.number(&format!("{pointer}/thickness_m"), dome.thickness_m, THICKNESS_M);
                checks.number(&format!("{pointer}/absorption_per_m"), dome.absorption_per_m, ABSORPTION_PER_M);
            }
        }
    }

    /// Returns the collector for the scene.
    pub fn collector(&self) -> Collector {
        match *self {
            Self::Open => Collector::Open,
            Self::Flat(FlatCollector { transmittance, .. }) => Collector::Flat { transmittance: transmittance.rgb() },
            Self::Dome(DomeCollector { transmittance }) => Collector::Dome { transmittance: transmittance.rgb() },
            Self::DielectricDome(DielectricDomeCollector { refractive_index, thickness_m, absorption_per_m }) => {
                Collector::DielectricDome { refractive_index, thickness_m, absorption_per_m }
            }
        }
    }

    /// Returns the unit normal of a tilted pane, pointing out; `None` for collectors across the axis, and a tilt out of its bounds.
    pub fn pane(&self) -> Option<DVec3> {
        let Self::Flat(FlatCollector { tilt_deg, azimuth_deg, .. }) = self else { return None };
        let tilt_deg = tilt_deg.filter(|tilt_deg| PANE_TILT_DEG.contains(*tilt_deg))?;
        Some(direction((90.0 - tilt_deg).to_radians(), azimuth_deg.unwrap_or(0.0).to_radians()))
    }

    /// Returns the transmittance, which may be coloured, of a collector that has one.
    pub fn coefficients(&self) -> Option<Coefficient> {
        match *self {
            Self::Open | Self::DielectricDome(_) => None,
            Self::Flat(FlatCollector { transmittance, .. }) | Self::Dome(DomeCollector { transmittance }) => {
                Some(transmittance)
            }
        }
    }
}
