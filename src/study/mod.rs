//! Studies: what accuracy costs by each of several methods on one scene, against a reference.
//!
//! `request` and `picture_request` say what is asked and which jobs that makes, `reference` what they are compared with, and
//! `compare` how far they are from it. `run` renders the jobs in this process (the service queues them), `outcome` puts the runs
//! together, `verdict` says in words what follows, `files` writes it down. `pictures` are of views, after the same time by each
//! method and at several accuracies; `views` renders them in this process.

pub mod compare;
mod documents;
pub mod files;
pub mod outcome;
pub mod picture_request;
pub mod pictures;
pub mod reference;
pub mod request;
pub mod run;
mod verdict;
pub mod views;

pub use outcome::Study;
pub use request::StudyRequest;
