//! Reflectances, transmittances and luminances: one photopic number or linear Rec.709.

use serde::{Deserialize, Deserializer, Serialize};
use utoipa::openapi::RefOr;
use utoipa::openapi::schema::Schema;
use utoipa::{PartialSchema, ToSchema};

use crate::document::errors::Checks;
use crate::document::limits::RATIO;
use crate::document::read::one_or_three::OneOrThree;
use crate::document::schema::shapes::{number, one_or_rgb};

/// One photopic number, or linear Rec.709 `[r, g, b]` with Y = 0.2126 R + 0.7152 G + 0.0722 B.
///
/// Reflectances and transmittances are within 0..1 in every channel. A scene with numbers only is computed in one
/// photopic channel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Coefficient {
    /// One photopic number for all light.
    Photopic(f64),
    /// Linear Rec.709 red, green and blue.
    Rgb([f64; 3]),
}

impl Coefficient {
    /// Coefficient of zero in every channel.
    pub const ZERO: Self = Self::Photopic(0.0);

    /// Returns the coefficient as linear Rec.709; a photopic number stands for all three channels.
    pub fn rgb(self) -> [f64; 3] {
        match self {
            Self::Photopic(value) => [value; 3],
            Self::Rgb(rgb) => rgb,
        }
    }

    /// True if the document gives three channels, equal or not.
    pub fn is_coloured(self) -> bool {
        matches!(self, Self::Rgb(_))
    }

    /// Returns the channels as written in the document, each with the suffix that names it in a JSON pointer.
    pub fn channels(self) -> Vec<(&'static str, f64)> {
        match self {
            Self::Photopic(value) => vec![("", value)],
            Self::Rgb([r, g, b]) => vec![("/0", r), ("/1", g), ("/2", b)],
        }
    }

    /// Adds a fault for each channel outside 0..1; true if all are good.
    pub(crate) fn check(self, pointer: &str, checks: &mut Checks) -> bool {
        let channels = self.channels().into_iter();
        channels
            .fold(true, |good, (channel, value)| checks.number(&format!("{pointer}{channel}"), value, RATIO) && good)
    }
}

/// Checks the transmittance and reflectance of one surface, each given with the name of its field: both must be within 0..1, and
/// their sum at most 1 in every channel.
pub(crate) fn check_scattering(
    pointer: &str,
    (transmittance_name, transmittance): (&str, Coefficient),
    (reflectance_name, reflectance): (&str, Coefficient),
    checks: &mut Checks,
) {
    let transmittance_pointer = format!("{pointer}/{transmittance_name}");
    let transmittance_ok = transmittance.check(&transmittance_pointer, checks);
    if !reflectance.check(&format!("{pointer}/{reflectance_name}"), checks) || !transmittance_ok {
        return;
    }
    let sums = transmittance.rgb().into_iter().zip(reflectance.rgb()).map(|(t, r)| t + r);
    let largest = sums.fold(0.0, f64::max);
    // the slack is the rounding of decimal fractions
    if largest > 1.0 + 4.0 * f64::EPSILON {
        checks.refuse(transmittance_pointer, format!("transmittance + reflectance must be <= 1, but is {largest}"));
    }
}

impl PartialSchema for Coefficient {
    fn schema() -> RefOr<Schema> {
        let description = "A reflectance or transmittance, 0..1: one photopic number, or linear Rec.709 `[r, g, b]` with Y = \
                           0.2126 R + 0.7152 G + 0.0722 B. A scene with numbers only is computed in one photopic channel.";
        one_or_rgb(|| number(RATIO)).description(Some(description)).into()
    }
}

impl ToSchema for Coefficient {}

impl Default for Coefficient {
    fn default() -> Self {
        Self::ZERO
    }
}

impl<'de> Deserialize<'de> for Coefficient {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        OneOrThree::read(deserializer, "a number or [r, g, b]").map(|value| match value {
            OneOrThree::One(value) => Self::Photopic(value),
            OneOrThree::Three(rgb) => Self::Rgb(rgb),
        })
    }
}
