//! Benchmarks: what accuracy costs, how cost grows, and what each effect of light costs.
//!
//! - [`performance`]: time to accuracies beside other programs, growth, memory, whole jobs and the service.
//! - [`studied`]: what accuracy costs by each method against references, and how often intervals hold the truth.
//! - [`effects`]: the cost of each effect, off, on by the plan, and forced on.
//!
//! All measure on the machine that they run on, so that their pages differ from run to run. Times are those of processors
//! where nothing else is said, on one thread. What needs other processes or the service ([`whole`], [`service`]) is measured by
//! the command and handed over.

mod accuracy;
mod case;
mod coverage;
pub mod effects;
mod furnished;
mod growth;
mod image;
mod measure;
mod meshes;
pub mod peers;
pub mod performance;
mod rays;
mod reference;
mod rooms;
pub mod scenes;
pub mod service;
mod settings;
pub mod studied;
pub mod whole;

pub use measure::Quartiles;
pub use settings::{Progress, Settings};
