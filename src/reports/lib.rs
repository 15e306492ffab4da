//! Reports of live runs, written as Markdown, for validation and benchmarks: a program of its own, which the service does not use.
//!
//! - [`validation`]: closed forms, tables and references against live runs; its checks must pass.
//! - [`bench`]: the cost of accuracy in time beside other programs, its growth, and the cost of each effect.
//! - [`thesis`]: the experiments of A. Schou's thesis repeated, its update rule with and without its faults.
//!
//! The other modules are shared: a page and its parts, jobs run in this process, and the writer of pages.

mod bench;
pub mod commands;
pub mod markdown;
mod page;
mod run;
pub mod thesis;
mod validation;
