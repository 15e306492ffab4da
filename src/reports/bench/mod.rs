//! Benchmarks: the cost of accuracy, the growth of cost, and the cost of each effect of light.
//!
//! - [`performance`]: time to accuracies beside other programs, growth, memory, whole jobs and the service.
//! - [`studied`]: the cost of accuracy by each method against references, and how often confidence intervals contain the truth.
//! - [`effects`]: the cost of each effect, off, on by the plan, and forced on.
//!
//! All benchmarks measure the machine on which they run, so that their pages differ from run to run. Times are processor
//! seconds on one thread unless stated otherwise. Measurements that need other processes or the service ([`whole`],
//! [`service`]) are made by the command and passed in.

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
mod shapes;
pub mod studied;
pub mod whole;

pub use measure::Quartiles;
pub use settings::{Progress, Settings};
