//! The job document and the results: serde types, defaults, checks with JSON pointers, conversion to a scene.
//!
//! The document is split by noun: [`job`] is the whole, of [`sky`], [`room`], [`tube`], [`outputs`] (grids and views),
//! [`method`], [`stop`] and [`effects`]; [`optics`] are the coefficients and tables that several of them have. Each noun has
//! its types, checks its own part and turns into its part of a scene; what concerns two parts is checked in [`job`].
//!
//! [`read`] goes from text to types, [`errors`] collects what is wrong, [`limits`] has every bound once, [`schema`] completes
//! the description, [`scene`] builds the scene, [`provenance`] explains results and [`result`] holds what comes back.

pub mod effects;
pub mod errors;
mod frame;
mod hints;
pub mod job;
pub mod limits;
mod mesh_source;
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
pub mod tube;
pub mod tube_flux;
mod unit;

pub use effects::EffectSwitch;
pub use errors::{DocumentErrors, FieldError, FieldErrorCode, Warning, WarningCode};
pub use job::{JobDocument, ValidJob};
pub use mesh_source::MeshSource;
pub use method::{MethodDocument, MethodKind, RadiusKind};
pub use optics::Coefficient;
pub use provenance::Provenance;
pub use refusal_name::RefusalName;
pub use scene::to_scene;
pub use solids::leave_out_solids;
