//! Weather files: irradiances of a typical or a measured year.
//!
//! [`read`] takes EPW files (EnergyPlus 2024) and WEA files of Radiance, repairs what is usual to be repaired and counts it.

mod closure;
mod complete;
mod epw;
mod header;
mod line;
mod order;
mod read;
mod rows;
mod types;
mod wea;

pub use closure::{Closure, SunOfFile};
pub use line::{Field, WeatherError};
pub use read::read;
pub use rows::{Repair, RepairKind};
pub use types::{FileReport, Format, Record, Represented, Site, Weather};
