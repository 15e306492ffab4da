//! Studies: the cost of accuracy for each of several methods on one scene, compared with a reference.
//!
//! `request` and `picture_request` define what is requested and the jobs that follow, `reference` what the runs are compared
//! with, and `compare` how. `run` renders the jobs in this process (the service queues them), `outcome` groups the runs,
//! `verdict` states the conclusions in words, and `files` writes the files. `pictures` are of views, after the same time by each
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
