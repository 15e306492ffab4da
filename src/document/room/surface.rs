//! Surfaces of the room and of objects.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::document::errors::Checks;
use crate::document::limits::ROUGHNESS;
use crate::document::optics::Coefficient;
use crate::document::schema::shapes::Albedo;
use crate::optics::glossy::LEAST_ROUGHNESS;
use crate::optics::{Specular, Surface};

/// A surface: `reflectance` with optional `specular`, or `open` for a missing face.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SurfaceDocument {
    /// Diffuse (Lambertian) reflectance of a closed surface; < 1 in every channel.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Albedo>)]
    pub reflectance: Option<Coefficient>,
    /// Specular reflectance (directional to hemispherical), the same at every angle, in addition to the diffuse `reflectance`;
    /// `reflectance + specular` is < 1 in every channel. Default: 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Albedo>)]
    pub specular: Option<Coefficient>,
    /// Roughness of the specular part. 0, the default: an ideal mirror. From 0.02 to 1: a glossy lobe of GGX microfacets with
    /// alpha = roughness^2, height-correlated masking and shadowing, and compensation for multiple scattering, so that `specular`
    /// is its reflectance at every angle. Values between 0 and 0.02 are refused.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub roughness: Option<f64>,
    /// True if the face is missing: light leaves through it, and a camera outside sees into the room.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub open: bool,
}

impl SurfaceDocument {
    /// Returns a Lambertian surface of a photopic reflectance.
    pub fn diffuse(reflectance: f64) -> Self {
        Self { reflectance: Some(Coefficient::Photopic(reflectance)), ..Self::default() }
    }
    /// Returns all coefficients, which may be coloured.
    pub fn coefficients(&self) -> impl Iterator<Item = Coefficient> {
        [self.reflectance, self.specular].into_iter().flatten()
    }

    /// Returns the optics of a closed surface; `None` if it is open.
    pub fn surface(&self) -> Option<Surface> {
        let reflectance = self.reflectance.filter(|_| !self.open)?;
        let specular = self.specular.map(Coefficient::rgb).filter(|rgb| rgb.iter().any(|value| *value > 0.0));
        let roughness = self.roughness.unwrap_or(0.0);
        let specular = specular.map(|reflectance| Specular { reflectance, roughness });
        Some(Surface { reflectance: reflectance.rgb(), specular })
    }
}

/// Owner of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Owner {
    /// A face of the room, which may be open.
    Room,
    /// An object in the room, none of whose surfaces may be open.
    Object,
}

/// Adds faults for coefficients out of their bounds, and for an open surface of an object.
pub(crate) fn check_surface(pointer: &str, surface: &SurfaceDocument, of: Owner, checks: &mut Checks) {
    if surface.open && of == Owner::Object {
        checks.refuse(format!("{pointer}/open"), "only a face of the room can be open");
    }
    match surface.reflectance {
        Some(_) if surface.open => {
            checks.refuse(
                format!("{pointer}/reflectance"),
                "must be left out if the surface is `open`: an open surface reflects nothing",
            );
        }
        None if !surface.open => {
            checks.refuse(format!("{pointer}/reflectance"), "required unless the surface is `open`");
        }
        None => {}
        Some(reflectance) => {
            let pointer = format!("{pointer}/reflectance");
            if reflectance.check(&pointer, checks) {
                for (channel, value) in reflectance.channels() {
                    if value >= 1.0 {
                        checks.refuse(format!("{pointer}{channel}"), format!("albedo must be < 1, but is {value}"));
                    }
                }
            }
        }
    }
    check_specular(pointer, surface, checks);
}

fn check_specular(pointer: &str, surface: &SurfaceDocument, checks: &mut Checks) {
    if let Some(specular) = surface.specular {
        let pointer = format!("{pointer}/specular");
        let some = specular.rgb().into_iter().any(|value| value > 0.0);
        if surface.open && some {
            checks.refuse(&pointer, "must be left out if the surface is `open`: an open surface reflects nothing");
        } else if specular.check(&pointer, checks) && some {
            let diffuse = surface.reflectance.unwrap_or_default().rgb();
            let albedo = specular.rgb().into_iter().zip(diffuse).map(|(s, d)| s + d).fold(0.0, f64::max);
            // an albedo of the reflectance alone has been refused before
            if albedo >= 1.0 && diffuse.into_iter().all(|value| value < 1.0) {
                checks.refuse(&pointer, format!("reflectance + specular must be < 1, but is {albedo}"));
            }
        }
    }
    if let Some(roughness) = surface.roughness {
        let pointer = format!("{pointer}/roughness");
        if checks.number(&pointer, roughness, ROUGHNESS) && roughness > 0.0 && roughness < LEAST_ROUGHNESS {
            let detail = format!("must be 0 (a mirror) or within {LEAST_ROUGHNESS}..1, but is {roughness}");
            checks.refuse(pointer, detail);
        }
    }
}
