//! What is wrong with a document, and what a reader of its results must know.

use std::fmt::Display;
use std::ops::RangeInclusive;

use super::hints;
use super::limits::Range;
use super::refusal_name::RefusalName;
use crate::integrator::method::{CaveatCode, Refusal};

/// One thing wrong with a document.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize, utoipa::ToSchema, thiserror::Error)]
#[error("{}: {detail}", self.place())]
pub struct FieldError {
    /// JSON pointer (RFC 6901) of the field; "" is the whole document, or, with `parameter`, not in it.
    pub pointer: String,
    /// Name of the parameter of the query that is wrong; absent where it is the document.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub parameter: Option<String>,
    /// Kind of the fault, for programs.
    pub code: FieldErrorCode,
    /// Sentence that says what is wrong, and the bound that was broken.
    pub detail: String,
    /// Where the method that was asked for refuses: its kind of reason.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refusal: Option<RefusalName>,
}

/// Kind of what is wrong with a field; its code never changes, the words of its detail may.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum FieldErrorCode {
    /// The field is required.
    Missing,
    /// There is no field of this name.
    UnknownField,
    /// A number is out of its range.
    OutOfRange,
    /// There is more of it than there may be.
    TooMany,
    /// The engine does not simulate it.
    NotSupported,
    /// The method that was asked for cannot compute it; `refusal` says why, and `detail` what can.
    MethodRefuses,
    /// Anything else: of a wrong type, not among the known values, or at odds with another field.
    #[default]
    Invalid,
}

impl FieldError {
    /// A fault of a kind without a code of its own.
    pub fn new(pointer: impl Into<String>, detail: impl Into<String>) -> Self {
        let (pointer, detail) = (pointer.into(), detail.into());
        Self { pointer, parameter: None, code: FieldErrorCode::Invalid, detail, refusal: None }
    }

    /// A fault of a parameter of a query.
    pub fn of_parameter(name: impl Into<String>, detail: impl Into<String>) -> Self {
        Self { parameter: Some(name.into()), ..Self::new("", detail) }
    }

    /// The parameter or the field, in words for people.
    pub fn place(&self) -> &str {
        match &self.parameter {
            Some(parameter) => parameter,
            None if self.pointer.is_empty() => "the document",
            None => &self.pointer,
        }
    }

    /// A field that is required, but missing.
    pub fn missing(pointer: impl Into<String>) -> Self {
        Self::new(pointer, "required, but missing").coded(FieldErrorCode::Missing)
    }

    /// A method that refuses the document.
    pub fn refused(pointer: impl Into<String>, refusal: Refusal) -> Self {
        let error = Self::new(pointer, refusal.detail).coded(FieldErrorCode::MethodRefuses);
        Self { refusal: Some(RefusalName(refusal.code)), ..error }
    }

    /// The same fault, of another kind.
    pub fn coded(self, code: FieldErrorCode) -> Self {
        Self { code, ..self }
    }
}

impl From<FieldError> for DocumentErrors {
    fn from(error: FieldError) -> Self {
        Self(vec![error])
    }
}

/// Everything wrong with a document; never empty.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
pub struct DocumentErrors(pub Vec<FieldError>);

/// A note to the user: the result is valid, but not what a reader may expect.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize, utoipa::ToSchema)]
pub struct Warning {
    /// Kind of the warning, for programs.
    pub code: WarningCode,
    /// Sentence for people, with the numbers of the case.
    pub detail: String,
}

/// Kind of a warning; its code never changes, the words of its detail may.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum WarningCode {
    /// The sun is below the horizon: neither sky nor sun give light.
    SunBelowHorizon,
    /// An illuminance of sky or sun is outside of what nature gives.
    ImplausibleIlluminance,
    /// The level of an overcast sky is the typical one of its type, as the document gives none, and that is less than three
    /// quarters or more than four thirds of the mean of measured overcast skies.
    TypicalOvercastLevel,
    /// A place is given, but nothing needs it: there is no sky.
    PlaceWithoutSky,
    /// The method finds light by way of mirrors by chance, or some of it by rare paths: expect noise, and errors that are too
    /// small.
    MirrorsByChance,
    /// The formula of Jenkins, Muneer and Kubie returns more flux than it is given.
    JenkinsFluxExcess,
    /// Triangles of a mesh have no area or stand there twice, and were left out.
    DroppedTriangles,
    /// More than a millionth of the rays left a tube through gaps in its mesh; their light is missing in the room.
    LostRays,
    /// Kernels of photon maps are not clipped everywhere where meshes stand on things: a mesh is not closed, or there are too
    /// many facets.
    KernelsNotCut,
    /// An effect is switched off that the scene calls for, and what is left out may be more than the accuracy asked for.
    EffectLeftOut,
    /// Points of a grid lie inside boxes or closed meshes: they have no value, and are in no statistic.
    PointsInsideSolids,
    /// The method that checks the grids finds other values, further off than its errors and those of the grids explain.
    MethodsDisagree,
    /// Many passes have brought no light at all to a grid.
    NoLight,
}

impl WarningCode {
    /// The code as it stands in answers.
    pub fn code(self) -> &'static str {
        match self {
            Self::SunBelowHorizon => "sun_below_horizon",
            Self::ImplausibleIlluminance => "implausible_illuminance",
            Self::TypicalOvercastLevel => "typical_overcast_level",
            Self::PlaceWithoutSky => "place_without_sky",
            Self::MirrorsByChance => "mirrors_by_chance",
            Self::JenkinsFluxExcess => "jenkins_flux_excess",
            Self::DroppedTriangles => "dropped_triangles",
            Self::LostRays => "lost_rays",
            Self::KernelsNotCut => "kernels_not_cut",
            Self::EffectLeftOut => "effect_left_out",
            Self::PointsInsideSolids => "points_inside_solids",
            Self::MethodsDisagree => "methods_disagree",
            Self::NoLight => "no_light",
        }
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

/// Collects everything that is wrong with a document.
#[derive(Default)]
pub(crate) struct Checks {
    /// What was found so far, in the order of the checks.
    pub errors: Vec<FieldError>,
}

impl Checks {
    /// Adds one fault.
    pub fn refuse(&mut self, pointer: impl Into<String>, detail: impl Into<String>) {
        self.refuse_as(FieldErrorCode::Invalid, pointer, detail);
    }

    /// Adds one fault of a known kind.
    pub fn refuse_as(&mut self, code: FieldErrorCode, pointer: impl Into<String>, detail: impl Into<String>) {
        self.errors.push(FieldError::new(pointer, detail).coded(code));
    }

    /// Refuses what the engine cannot compute yet.
    pub fn not_supported(&mut self, pointer: impl Into<String>, what: impl Display) {
        self.refuse_as(FieldErrorCode::NotSupported, pointer, format!("{what}: not supported yet"));
    }

    /// Refuses a number outside its range, with a hint when it would do in another unit; whether it is good.
    pub fn number(&mut self, pointer: &str, value: impl Number, range: Range) -> bool {
        let number = value.as_f64();
        let good = range.contains(number);
        if !good {
            let hint = hints::of_number(pointer, number, |meant| range.contains(meant));
            self.refuse_as(FieldErrorCode::OutOfRange, pointer, format!("must be {range}, but is {value}{hint}"));
        }
        good
    }

    /// Refuses every number of `values` that is outside their range; their pointers end with their index. Whether all are
    /// good.
    pub fn numbers<T: Number>(&mut self, pointer: &str, values: &[T], range: Range) -> bool {
        let each = values.iter().enumerate();
        each.fold(true, |good, (index, value)| self.number(&format!("{pointer}/{index}"), *value, range) && good)
    }

    /// Refuses more `things` than there may be; whether their number is good.
    pub fn at_most(&mut self, pointer: &str, number: usize, bounds: &RangeInclusive<usize>, things: &str) -> bool {
        let good = number <= *bounds.end();
        if !good {
            let detail = format!("at most {}{things}, but there are {number}", bounds.end());
            self.refuse_as(FieldErrorCode::TooMany, pointer, detail);
        }
        good
    }
}

/// A number of a document, of any type.
pub(crate) trait Number: Copy + Display {
    /// The number as f64.
    fn as_f64(self) -> f64;
}

impl Number for f64 {
    fn as_f64(self) -> f64 {
        self
    }
}

impl Number for u64 {
    /// The number as f64; beyond 2^53 the nearest one, which is beyond every bound, too.
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
