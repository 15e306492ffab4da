//! Studies: the cost of accuracy for each of several methods on one scene, compared with a reference.
//!
//! `request` and `picture_request` define what is requested, `reference` what the runs are compared with, and `compare` how.
//! `runner` finds the methods that can compute a study, and has its jobs run one after the other: `run` renders them in this
//! process, `queued` collects them for the queue. `outcomes` compares those that have ended, `outcome` groups the runs, `verdict`
//! states the conclusions in words, and `files` writes the files. `pictures` are of views, after the same time by each method and
//! at several accuracies.

pub mod compare;
mod documents;
pub mod files;
pub mod outcome;
pub mod outcomes;
pub mod part;
pub mod picture_request;
pub mod pictures;
pub mod queued;
pub mod reference;
pub mod request;
pub mod run;
pub mod runner;
mod verdict;

pub use outcome::Study;
pub use request::StudyRequest;
