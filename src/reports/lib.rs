//! Reports of live runs, written as Markdown: studies with the product, off the service's path, by a program of their own.
//!
//! - [`validation`]: closed forms, tables and references against live runs; its checks must pass.
//! - [`bench`]: what accuracy costs in time beside other programs, how it grows, and what each effect costs.
//! - [`thesis`]: the experiments of A. Schou's thesis repeated, its update rule with and without its faults.
//!
//! The rest is what they share: a page and its parts, jobs run in this process, and how a page is written.

mod bench;
pub mod commands;
pub mod markdown;
mod page;
mod run;
pub mod thesis;
mod validation;
