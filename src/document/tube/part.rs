//! Roles of the materials of a mesh tube.

use serde::{Deserialize, Deserializer, Serialize};
use utoipa::ToSchema;

use super::diffuser::DiffuserDocument;
use crate::document::errors::Checks;
use crate::document::optics::coefficient::{Coefficient, check_scattering};
use crate::document::optics::mirror::MirrorDocument;
use crate::document::read::tagged::{self, Reader, Tagged};

/// Role of a material of a mesh tube.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
#[serde(tag = "role", rename_all = "snake_case")]
pub enum PartDocument {
    /// Thin cover that does not change the direction of light; `transmittance + reflectance <= 1`.
    Collector(CollectorPart),
    /// Specular mirror of the guide.
    Pipe(PipePart),
    /// Closure in the plane z = 0.
    Diffuser(DiffuserDocument),
}

/// Fields of a mesh's collector.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct CollectorPart {
    /// Fraction of the light that is transmitted, from either side.
    pub transmittance: Coefficient,
    /// Fraction of the light that is reflected, from either side; default: 0.
    #[serde(default)]
    pub reflectance: Coefficient,
}

/// Fields of a mesh's pipe.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct PipePart {
    /// Specular reflectance per bounce.
    pub reflectance: MirrorDocument,
}

impl Tagged for PartDocument {
    const TAG: &'static str = "role";
    const WHAT: &'static str = "a part";
    const KINDS: &'static [(&'static str, Reader<Self>)] = &[
        ("collector", |fields, of| fields.read(of).map(Self::Collector)),
        ("pipe", |fields, of| fields.read(of).map(Self::Pipe)),
        ("diffuser", |fields, of| fields.read(of).map(Self::Diffuser)),
    ];
}

impl<'de> Deserialize<'de> for PartDocument {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        tagged::deserialize(deserializer)
    }
}

impl PartDocument {
    /// Adds the faults of a part; `radius_m` is that of the opening, and not positive if it was refused.
    pub(crate) fn check(&self, pointer: &str, radius_m: f64, checks: &mut Checks) {
        match self {
            Self::Collector(CollectorPart { transmittance, reflectance }) => {
                check_scattering(pointer, ("transmittance", *transmittance), ("reflectance", *reflectance), checks);
            }
            Self::Pipe(PipePart { reflectance }) => reflectance.check(&format!("{pointer}/reflectance"), checks),
            Self::Diffuser(diffuser) => diffuser.check(pointer, radius_m, checks),
        }
    }

    /// Returns all coefficients, which may be coloured.
    pub fn coefficients(&self) -> Vec<Coefficient> {
        match self {
            Self::Collector(part) => vec![part.transmittance, part.reflectance],
            Self::Pipe(part) => part.reflectance.coefficients(),
            Self::Diffuser(diffuser) => diffuser.coefficients(),
        }
    }
}
