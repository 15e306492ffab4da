//! Optics of collectors, mirrors, diffusers and room surfaces.

mod angular_table;
pub mod closure;
pub mod diffuser;
pub mod dome;
pub mod fresnel;
pub mod glossy;
pub mod measured;
pub mod mirror;
pub mod reflection;
pub mod scatter;
pub mod scatterer;
pub mod spectrum;
pub mod surface;

pub use closure::Closure;
pub use diffuser::{Diffuser, DiffuserZone};
pub use dome::Collector;
pub use glossy::Glossy;
pub use measured::MeasuredDiffuser;
pub use mirror::Mirror;
pub use reflection::SurfaceOptics;
pub use scatter::{Kind, Oriented, Scatter, Scattered, SheetSide, Travel};
pub use scatterer::Scatterer;
pub use spectrum::Spectrum;
pub use surface::{Specular, Surface};
