//! Studies: what accuracy costs by each of several methods on one scene, against a reference.
//!
//! `request` says what is asked and which jobs that makes, `run` renders them in this process and compares each with the
//! reference, `outcome` puts the runs together, `verdict` says in words what follows, `files` writes it down.

pub mod files;
pub mod outcome;
pub mod request;
pub mod run;
mod verdict;

pub use outcome::Study;
pub use request::StudyRequest;
