//! The job document and the results: serde types, defaults, validation with JSON pointers, conversion to a scene.
//!
//! The types of the document are split as the document is: [`job`] (the whole), [`sky`], [`room`], [`tube`],
//! [`optics`] (coefficients, mirrors, tables), [`outputs`] (grids and views) and [`method`]. [`read`] reads text,
//! [`validate`] checks every bound, [`scene`] builds the scene, [`result`] holds what comes back, [`schema`] completes the
//! description of it all.

pub mod errors;
mod hints;
pub mod job;
pub mod method;
pub mod optics;
pub mod outputs;
pub mod read;
pub mod result;
pub mod room;
pub mod scene;
pub mod schema;
pub mod sky;
pub mod tube;
mod validate;

use std::sync::Arc;

use crate::geometry::TriangleMesh;

pub use job::{EffectSwitch, JobDocument};
pub use method::{MethodDocument, MethodKind, RadiusKind, method_warning};
pub use optics::Coefficient;
pub use scene::{Provenance, to_scene};

/// One thing wrong with a document.
#[derive(Clone, Debug, PartialEq, serde::Serialize, utoipa::ToSchema, thiserror::Error)]
#[error("{}: {detail}", if .pointer.is_empty() { "the document" } else { .pointer })]
pub struct FieldError {
    /// JSON pointer (RFC 6901) of the field; "" is the whole document.
    pub pointer: String,
    /// What is wrong, and the bound that was broken.
    pub detail: String,
}

/// Everything wrong with a document; never empty.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
pub struct DocumentErrors(pub Vec<FieldError>);

/// Where a document's meshes come from: uploads by id, or files beside the job file.
pub trait MeshSource {
    /// The mesh in file units, or one sentence (with the line where it can be named) of why there is none.
    fn load(&self, id: &str) -> Result<Arc<TriangleMesh>, String>;

    /// Whether nobody waits for the document any more; then preparing it ends soon.
    fn is_cancelled(&self) -> bool {
        false
    }
}

/// A note to the user: the result is valid, but not what a reader may expect.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize, utoipa::ToSchema)]
pub struct Warning {
    /// E.g. `sun_below_horizon`.
    pub code: String,
    pub detail: String,
}
