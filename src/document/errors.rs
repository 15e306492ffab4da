//! Faults of a document, warnings about its results, and the collector that the checks add faults to.

use std::fmt::{self, Display, Formatter};
use std::ops::RangeInclusive;

use serde::Serialize;

use super::hints;
use super::limits::Range;
use super::refusal_name::RefusalName;
use crate::integrator::method::{CaveatCode, Refusal};

/// A fault of a document or of a query.
#[derive(Clone, Debug, PartialEq, Serialize, serde::Deserialize, utoipa::ToSchema, thiserror::Error)]
#[error("{}: {detail}", self.place())]
pub struct FieldError {
    /// JSON pointer (RFC 6901) to the field at fault; "" is the whole document, or, where `parameter` is given, no field.
    pub pointer: String,
    /// Name of the query parameter at fault; absent where the fault is in the document.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub parameter: Option<String>,
    /// Kind of the fault, for programs.
    pub code: FieldErrorCode,
    /// Sentence that says what is wrong and names the bound that was broken.
    pub detail: String,
    /// Kind of reason for which the requested method refuses the document; absent for every other fault.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refusal: Option<RefusalName>,
}

/// Kind of a fault. Its code never changes; the wording of `detail` may.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, serde::Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum FieldErrorCode {
    /// The field is required.
    Missing,
    /// There is no field of this name.
    UnknownField,
    /// A number is outside its range.
    OutOfRange,
    /// There are more items than allowed.
    TooMany,
    /// The engine does not simulate this.
    NotSupported,
    /// The requested method cannot compute the job: `refusal` has the kind of reason, and `detail` names what can compute it.
    MethodRefuses,
    /// Any other fault: a wrong type, an unknown name, or a contradiction of another field.
    #[default]
    Invalid,
}

impl FieldError {
    /// Returns a fault of the kind [`FieldErrorCode::Invalid`].
    pub fn new(pointer: impl Into<String>, detail: impl Into<String>) -> Self {
        let (pointer, detail) = (pointer.into(), detail.into());
        Self { pointer, parameter: None, code: FieldErrorCode::Invalid, detail, refusal: None }
    }

    /// Returns a fault of a query parameter.
    pub fn of_parameter(name: impl Into<String>, detail: impl Into<String>) -> Self {
        Self { parameter: Some(name.into()), ..Self::new("", detail) }
    }

    /// Returns the parameter's name or the field's pointer, for messages.
    pub fn place(&self) -> &str {
        match &self.parameter {
            Some(parameter) => parameter,
            None if self.pointer.is_empty() => "the document",
            None => &self.pointer,
        }
    }

    /// Returns the fault of a required field that is missing.
    pub fn missing(pointer: impl Into<String>) -> Self {
        Self::new(pointer, "required, but missing").coded(FieldErrorCode::Missing)
    }

    /// Returns the fault of a document that a method refuses.
    pub fn refused(pointer: impl Into<String>, refusal: Refusal) -> Self {
        let error = Self::new(pointer, refusal.detail).coded(FieldErrorCode::MethodRefuses);
        Self { refusal: Some(RefusalName(refusal.code)), ..error }
    }

    /// Returns this fault with another kind.
    pub fn coded(self, code: FieldErrorCode) -> Self {
        Self { code, ..self }
    }
}

impl From<FieldError> for DocumentErrors {
    fn from(error: FieldError) -> Self {
        Self(vec![error])
    }
}

/// All faults of a document; never empty.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
pub struct DocumentErrors(pub Vec<FieldError>);

/// A note to the user: the result is valid, but may not be what a reader expects.
#[derive(Clone, Debug, PartialEq, Serialize, serde::Deserialize, utoipa::ToSchema)]
pub struct Warning {
    /// Kind of the warning, for programs.
    pub code: WarningCode,
    /// Sentence for people, with the numbers of the case.
    pub detail: String,
}

/// Kind of a warning. Its code never changes; the wording of `detail` may.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, serde::Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum WarningCode {
    /// The sun is below the horizon, so that sky and sun give no light.
    SunBelowHorizon,
    /// An illuminance of the sky or the sun is beyond the range that occurs in nature.
    ImplausibleIlluminance,
    /// The level of an overcast sky is the typical one of its type, because the document gives none, and this is less than three
    /// quarters or more than four thirds of the mean of measured overcast skies.
    TypicalOvercastLevel,
    /// A location or time is given but has no effect, because there is no sky.
    PlaceWithoutSky,
    /// The method finds light by way of mirrors only by chance, or some of it by rare paths: expect noise, and errors that are
    /// too small.
    MirrorsByChance,
    /// The formula of Jenkins, Muneer and Kubie returns more flux than enters it.
    JenkinsFluxExcess,
    /// Triangles of a mesh that have no area or repeat another one were left out.
    DroppedTriangles,
    /// An object stands right below the opening of a tube, or above one that hangs.
    OpeningCovered,
    /// A part of the Honeybee model that gives the room is changed or left out.
    ModelChanged,
    /// The room's faces were repaired, as where a corner of a plan repeats the one before it.
    RepairedRoom,
    /// More than a millionth of the rays left a tube through gaps in its mesh; their light is missing in the room.
    LostRays,
    /// Kernels of photon maps are not clipped everywhere at objects that meshes stand on, because a mesh is not closed or there
    /// are too many facets.
    KernelsNotCut,
    /// An effect that the scene calls for is switched off, and the light left out may exceed the requested accuracy.
    EffectLeftOut,
    /// Sensors of a grid lie outside the room: they have no value and count in no statistic.
    PointsOutside,
    /// Sensors of a grid lie inside boxes or closed meshes: they have no value and count in no statistic.
    PointsInsideSolids,
    /// The method of `cross_check` finds values that differ by more than the standard errors of both methods explain.
    MethodsDisagree,
    /// No light at all has reached a grid after many passes.
    NoLight,
    /// The largest number of passes, which the document does not set, ended the job before it was as accurate as requested.
    AccuracyNotReached,
    /// Hours of a weather file without irradiances have those of another day.
    WeatherHoursMissing,
    /// The irradiances of a weather file fit a sun at other moments than those that its records stand for by its kind.
    WeatherSunOffset,
    /// More than half a percent of the light of a weather file is in hours whose sun is down, and is left out.
    WeatherLightWithoutSun,
    /// No record of a weather file has any light.
    WeatherWithoutLight,
}

/// Writes the code as in responses.
impl Display for WarningCode {
    fn fmt(&self, formatter: &mut Formatter) -> fmt::Result {
        self.serialize(formatter)
    }
}

impl From<CaveatCode> for WarningCode {
    fn from(code: CaveatCode) -> Self {
        match code {
            CaveatCode::MirrorsByChance | CaveatCode::MirrorsRarely => Self::MirrorsByChance,
            CaveatCode::FluxExcess => Self::JenkinsFluxExcess,
            CaveatCode::KernelsNotCut => Self::KernelsNotCut,
        }
    }
}

/// Collector of all faults of a document.
#[derive(Default)]
pub(crate) struct Checks {
    /// Faults found so far, in the order of the checks.
    pub errors: Vec<FieldError>,
}

impl Checks {
    /// Adds a fault of the kind [`FieldErrorCode::Invalid`].
    pub fn refuse(&mut self, pointer: impl Into<String>, detail: impl Into<String>) {
        self.refuse_as(FieldErrorCode::Invalid, pointer, detail);
    }

    /// Adds a fault of the kind `code`.
    pub fn refuse_as(&mut self, code: FieldErrorCode, pointer: impl Into<String>, detail: impl Into<String>) {
        self.errors.push(FieldError::new(pointer, detail).coded(code));
    }

    /// Adds a fault for something that the engine cannot compute yet.
    pub fn not_supported(&mut self, pointer: impl Into<String>, what: impl Display) {
        self.refuse_as(FieldErrorCode::NotSupported, pointer, format!("{what}: not supported yet"));
    }

    /// Checks that a number is within its range and adds a fault otherwise, with a hint if it would be within range in another
    /// unit. Returns true if the number is good.
    pub fn number(&mut self, pointer: &str, value: impl Number, range: Range) -> bool {
        let number = value.as_f64();
        let good = range.contains(number);
        if !good {
            let hint = hints::of_number(pointer, number, |meant| range.contains(meant));
            // hundreds of digits help nobody
            let value = if number.abs() < 1e15 { value.to_string() } else { format!("{number:e}") };
            self.refuse_as(FieldErrorCode::OutOfRange, pointer, format!("must be {range}, but is {value}{hint}"));
        }
        good
    }

    /// Checks that every number of `values` is within its range and adds a fault for each that is not, at a pointer that ends
    /// with its index. Returns true if all are good.
    pub fn numbers<T: Number>(&mut self, pointer: &str, values: &[T], range: Range) -> bool {
        let each = values.iter().enumerate();
        each.fold(true, |good, (index, value)| self.number(&format!("{pointer}/{index}"), *value, range) && good)
    }

    /// Checks that there are no more `things` than allowed and adds a fault otherwise. Returns true if their number is good.
    pub fn at_most(&mut self, pointer: &str, number: usize, bounds: &RangeInclusive<usize>, things: &str) -> bool {
        let good = number <= *bounds.end();
        if !good {
            let detail = format!("at most {}{things}, but there are {number}", bounds.end());
            self.refuse_as(FieldErrorCode::TooMany, pointer, detail);
        }
        good
    }
}

/// Rounds a computed length in m to micrometres, for messages.
pub(crate) fn tidy_m(length: f64) -> f64 {
    (length * 1e6).round() / 1e6
}

/// A number of a document, of any numeric type.
pub(crate) trait Number: Copy + Display {
    /// Returns the number as f64.
    fn as_f64(self) -> f64;
}

impl Number for f64 {
    fn as_f64(self) -> f64 {
        self
    }
}

impl Number for u64 {
    /// Returns the number as f64: beyond 2^53 the nearest one, which is outside every range, too.
    fn as_f64(self) -> f64 {
        self as f64
    }
}

impl Number for u32 {
    fn as_f64(self) -> f64 {
        self.into()
    }
}

impl Number for i32 {
    fn as_f64(self) -> f64 {
        self.into()
    }
}

impl Number for u8 {
    fn as_f64(self) -> f64 {
        self.into()
    }
}
