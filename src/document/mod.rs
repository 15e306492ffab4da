//! The job document and its results: serde types, defaults, checks with JSON pointers, and conversion to a scene.
//!
//! The document is split by noun: [`job`] is the whole, which consists of [`sky`], [`surroundings`], [`room`], [`tube`], [`outputs`] (grids and
//! views), [`method`], [`stop`] and [`effects`]; [`optics`] has the coefficients and tables that several of them use. Each noun
//! has its types, checks its own part and converts it to a part of the scene; [`job`] checks rules that concern two parts.
//!
//! [`read`] converts text to types, [`errors`] collects faults, [`limits`] has each bound once, [`schema`] completes the
//! description of the interface, [`scene`] builds the scene, [`provenance`] explains results and [`result`] has their types.

pub mod annual;
pub mod canonical;
mod covered_openings;
pub mod effects;
pub mod errors;
mod file_source;
mod frame;
pub mod hbjson;
mod hints;
mod horizon;
pub mod job;
pub mod limits;
pub mod method;
pub mod optics;
pub mod outputs;
pub mod provenance;
pub(crate) mod read;
mod refusal_name;
pub mod result;
pub mod room;
mod scene;
pub(crate) mod schema;
pub mod sky;
mod solids;
pub mod stop;
pub mod surroundings;
pub mod tube;
pub mod tube_flux;
mod unit;
pub mod weather;

pub use covered_openings::covered_openings;
pub use effects::EffectSwitch;
pub use errors::{DocumentErrors, FieldError, FieldErrorCode, Warning, WarningCode};
pub use file_source::{FileSource, NoFiles};
pub use job::{JobDocument, ValidJob};
pub use method::{MethodDocument, MethodKind, RadiusKind};
pub use optics::Coefficient;
pub use provenance::Provenance;
pub use refusal_name::RefusalName;
pub use scene::to_scene;
pub use solids::leave_out;
