//! Closures of tubes in the plane of the ceiling.

use serde::{Deserialize, Deserializer, Serialize};
use utoipa::ToSchema;

use crate::document::errors::Checks;
use crate::document::limits::within;
use crate::document::optics::coefficient::{Coefficient, check_scattering};
use crate::document::optics::measured::MeasuredDocument;
use crate::document::read::tagged::{self, Reader, Tagged};
use crate::optics::{Diffuser, DiffuserZone};

/// Closure of a tube in the plane of the ceiling; `transmittance + reflectance <= 1`.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum DiffuserDocument {
    /// No closure: light enters the room unscattered.
    Open,
    /// Specular closure: the direction of light is unchanged.
    Clear(ClearDiffuser),
    /// Lambertian diffuser, which scatters to the far side and back by Lambert's law.
    Lambertian(LambertianDiffuser),
    /// Lambertian and clear zones, separated by a circle.
    Mixed(MixedDiffuser),
    /// Diffuser with a measured scattering table that is isotropic and the same from either side: bilinear in the angles of
    /// incidence and exit, both from the normal.
    ///
    /// For each angle of incidence, 2 pi int f cos sin over the angles of exit, for transmitted and reflected light together, is
    /// at most 1.
    Measured(MeasuredDocument),
}

/// Fields of a clear closure.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ClearDiffuser {
    /// Fraction of the light that is transmitted, at every angle.
    pub transmittance: Coefficient,
}

/// Fields of a Lambertian diffuser.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct LambertianDiffuser {
    /// Fraction of the light that is scattered to the far side.
    pub transmittance: Coefficient,
    /// Fraction of the light that is scattered back; default: 0.
    #[serde(default)]
    pub reflectance: Coefficient,
}

/// Fields of a mixed diffuser.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct MixedDiffuser {
    /// Radius of the dividing circle in metres, at most that of the opening.
    pub lambertian_radius_m: f64,
    /// Zone inside the circle.
    pub inner: ZoneDocument,
    /// Fraction of the light on the Lambertian zone that is scattered to the far side.
    pub lambertian_transmittance: Coefficient,
    /// Fraction of the light on the Lambertian zone that is scattered back; default: 0.
    #[serde(default)]
    pub lambertian_reflectance: Coefficient,
    /// Fraction of the light on the clear zone that is transmitted.
    pub clear_transmittance: Coefficient,
}

/// Zone of a mixed diffuser.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ZoneDocument {
    /// Zone that scatters light.
    Lambertian,
    /// Zone that transmits light unscattered.
    Clear,
}

impl Tagged for DiffuserDocument {
    const TAG: &'static str = "kind";
    const WHAT: &'static str = "a diffuser";
    const KINDS: &'static [(&'static str, Reader<Self>)] = &[
        ("open", |fields, of| fields.none(of).map(|()| Self::Open)),
        ("clear", |fields, of| fields.read(of).map(Self::Clear)),
        ("lambertian", |fields, of| fields.read(of).map(Self::Lambertian)),
        ("mixed", |fields, of| fields.read(of).map(Self::Mixed)),
        ("measured", |fields, of| fields.read(of).map(Self::Measured)),
    ];
}

impl<'de> Deserialize<'de> for DiffuserDocument {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        tagged::deserialize(deserializer)
    }
}

impl DiffuserDocument {
    /// Adds the faults of a closure; `radius_m` is that of the opening, and not positive if it was refused.
    pub(crate) fn check(&self, pointer: &str, radius_m: f64, checks: &mut Checks) {
        match self {
            Self::Open => {}
            Self::Clear(diffuser) => {
                diffuser.transmittance.check(&format!("{pointer}/transmittance"), checks);
            }
            Self::Lambertian(LambertianDiffuser { transmittance, reflectance }) => {
                check_scattering(pointer, ("transmittance", *transmittance), ("reflectance", *reflectance), checks);
            }
            Self::Mixed(diffuser) => diffuser.check(pointer, radius_m, checks),
            Self::Measured(table) => table.check(pointer, checks),
        }
    }

    /// Returns the closure for the scene; a measured table of a wrong shape, which the check refuses, becomes black.
    pub fn diffuser(&self) -> Diffuser {
        match self {
            Self::Open => Diffuser::Open,
            Self::Clear(ClearDiffuser { transmittance }) => Diffuser::Clear { transmittance: transmittance.rgb() },
            Self::Lambertian(LambertianDiffuser { transmittance, reflectance }) => {
                Diffuser::Lambertian { transmittance: transmittance.rgb(), reflectance: reflectance.rgb() }
            }
            Self::Mixed(diffuser) => Diffuser::Mixed {
                lambertian_radius_m: diffuser.lambertian_radius_m,
                inner: match diffuser.inner {
                    ZoneDocument::Lambertian => DiffuserZone::Lambertian,
                    ZoneDocument::Clear => DiffuserZone::Clear,
                },
                lambertian_transmittance: diffuser.lambertian_transmittance.rgb(),
                lambertian_reflectance: diffuser.lambertian_reflectance.rgb(),
                clear_transmittance: diffuser.clear_transmittance.rgb(),
            },
            // the table of a checked document is valid; an invalid one would transmit nothing
            Self::Measured(table) => table
                .diffuser()
                .map_or(Diffuser::Lambertian { transmittance: [0.0; 3], reflectance: [0.0; 3] }, |table| {
                    Diffuser::Measured(table.into())
                }),
        }
    }

    /// Returns all coefficients, which may be coloured.
    pub fn coefficients(&self) -> Vec<Coefficient> {
        match *self {
            Self::Open | Self::Measured(_) => vec![],
            Self::Clear(ClearDiffuser { transmittance }) => vec![transmittance],
            Self::Lambertian(LambertianDiffuser { transmittance, reflectance }) => vec![transmittance, reflectance],
            Self::Mixed(MixedDiffuser {
                lambertian_transmittance,
                lambertian_reflectance,
                clear_transmittance,
                ..
            }) => {
                vec![lambertian_transmittance, lambertian_reflectance, clear_transmittance]
            }
        }
    }
}

impl MixedDiffuser {
    fn check(&self, pointer: &str, radius_m: f64, checks: &mut Checks) {
        // without a valid opening only the sign can be checked
        let range = if radius_m > 0.0 { within(0.0, radius_m) } else { within(0.0, f64::MAX) };
        checks.number(&format!("{pointer}/lambertian_radius_m"), self.lambertian_radius_m, range);
        check_scattering(
            pointer,
            ("lambertian_transmittance", self.lambertian_transmittance),
            ("lambertian_reflectance", self.lambertian_reflectance),
            checks,
        );
        self.clear_transmittance.check(&format!("{pointer}/clear_transmittance"), checks);
    }
}
