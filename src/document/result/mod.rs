//! Results as JSON, one file for each kind of result.

pub mod annual;
mod components;
mod cross_check;
mod energy;
mod grid;
mod meshes;
pub(crate) mod number;
mod plan;
mod responses;
mod summary;
mod surfaces;
mod target;
mod timing;
mod tube;
mod tube_flux;
pub mod tube_report;
pub mod weather_files;

pub use components::{GridComponents, GridPart};
pub use cross_check::CrossCheckResult;
pub use energy::EnergyResult;
pub use grid::{AreaAbove, DaylightFactors, ExternalIlluminance, GridResult, GridStatistics};
pub use meshes::{MeshPartResult, MeshResult, MeshRole, MeshesResult};
pub use plan::{EffectResult, GuideResult, MethodResult, MethodsResult, PlanResult, YearMethodResult};
pub use responses::{PatchResponse, TubeResponse};
pub use summary::{GridInShort, JobResults, Known, ViewInShort};
pub use surfaces::{FaceResult, PatchResult, SurfacesResult};
pub use target::{TargetResult, Verdict};
pub use timing::{AccuracyResult, TimingResult};
pub use tube::{FluxResult, TubeResult};
pub use tube_flux::{PatchesResult, SourceFlux, TubeFluxAt, TubeFluxResult};
