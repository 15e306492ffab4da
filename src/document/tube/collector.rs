//! What covers the upper end of a tube.

use serde::{Deserialize, Deserializer, Serialize};
use utoipa::ToSchema;

use crate::document::errors::Checks;
use crate::document::limits::{ABSORPTION_PER_M, REFRACTIVE_INDEX, THICKNESS_M};
use crate::document::optics::Coefficient;
use crate::document::read::tagged::{self, Reader, Tagged};
use crate::optics::Collector;

/// Cover of the upper end of a tube; directions are unchanged except by `dielectric_dome`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum CollectorDocument {
    /// Nothing: light enters unchanged.
    Open,
    /// A pane across the end of the tube.
    Flat(FlatCollector),
    /// A thin hemisphere.
    Dome(DomeCollector),
    /// A hemispherical shell that reflects and refracts by Fresnel; its inner radius is the tube's, its rim is black.
    DielectricDome(DielectricDomeCollector),
}

/// Fields of a flat collector.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct FlatCollector {
    /// Share of the light that passes, at every angle.
    pub transmittance: Coefficient,
}

/// Fields of a thin dome.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct DomeCollector {
    /// Share of the light that passes, at every angle.
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
    /// Napierian absorption coefficient of its material: s metres leave exp(-absorption s); 0 when absent.
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
    /// Refuses coefficients and numbers out of their bounds.
    pub(crate) fn check(&self, pointer: &str, checks: &mut Checks) {
        match self {
            Self::Open => {}
            Self::Flat(FlatCollector { transmittance }) | Self::Dome(DomeCollector { transmittance }) => {
                transmittance.check(&format!("{pointer}/transmittance"), checks);
            }
            Self::DielectricDome(dome) => {
                checks.number(&format!("{pointer}/refractive_index"), dome.refractive_index, REFRACTIVE_INDEX);
                checks.number(&format!("{pointer}/thickness_m"), dome.thickness_m, THICKNESS_M);
                checks.number(&format!("{pointer}/absorption_per_m"), dome.absorption_per_m, ABSORPTION_PER_M);
            }
        }
    }

    /// The collector as a scene has it.
    pub fn collector(&self) -> Collector {
        match *self {
            Self::Open => Collector::Open,
            Self::Flat(FlatCollector { transmittance }) => Collector::Flat { transmittance: transmittance.rgb() },
            Self::Dome(DomeCollector { transmittance }) => Collector::Dome { transmittance: transmittance.rgb() },
            Self::DielectricDome(DielectricDomeCollector { refractive_index, thickness_m, absorption_per_m }) => {
                Collector::DielectricDome { refractive_index, thickness_m, absorption_per_m }
            }
        }
    }

    /// Everything that may have a colour.
    pub fn coefficients(&self) -> Option<Coefficient> {
        match *self {
            Self::Open | Self::DielectricDome(_) => None,
            Self::Flat(FlatCollector { transmittance }) | Self::Dome(DomeCollector { transmittance }) => {
                Some(transmittance)
            }
        }
    }
}
