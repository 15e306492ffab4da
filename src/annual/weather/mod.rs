//! Weather files: irradiances of a typical or a measured year.
//!
//! [`read`] takes EPW files (EnergyPlus 2024) and WEA files of Radiance, repairs what is usual to be repaired and counts it.

mod closure;
mod complete;
mod epw;
mod file;
mod header;
mod line;
mod order;
mod read;
mod record;
mod rows;
mod wea;

pub use closure::{Closure, SunOfFile};
pub use file::{FileReport, Represented, Weather};
pub use line::{Field, WeatherError};
pub use read::read;
pub use record::{Format, Record, Site};
pub use rows::{Repair, RepairKind};
