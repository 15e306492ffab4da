//! What light meets: collectors, mirrors, diffusers and room surfaces.

pub mod bsdf;
pub mod diffuser;
pub mod dome;
pub mod fresnel;
pub mod glossy;
pub mod measured;
pub mod mirror;
pub mod spectrum;
pub mod surface;

pub use bsdf::FiniteBsdf;
pub use diffuser::{Closure, Diffuser, DiffuserZone};
pub use dome::Collector;
pub use glossy::Glossy;
pub use measured::MeasuredDiffuser;
pub use mirror::Mirror;
pub use spectrum::Spectrum;
pub use surface::{Specular, Surface};
