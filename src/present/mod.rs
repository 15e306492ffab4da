//! Presentation of results: tables, figures and files, from an estimate or from stored files.

pub mod annual;
pub mod cache;
pub mod convergence_files;
pub(crate) mod glb;
pub(crate) mod grid_figure;
pub(crate) mod inputs;
pub(crate) mod light_paths;
mod mesh_outlines;
mod moment_verdicts;
pub mod outputs;
pub(crate) mod phrases;
pub mod prepared;
pub mod reader;
pub(crate) mod report;
pub mod saved_files;
pub(crate) mod scene_model;
pub(crate) mod section_figure;
pub(crate) mod sentences;
pub(crate) mod site_figure;
pub(crate) mod subject;
pub(crate) mod summary;
pub(crate) mod tube_figure;
pub(crate) mod tube_flux;
pub(crate) mod tube_performance;
pub(crate) mod tube_report;
pub(crate) mod verdict_words;
pub(crate) mod view_figure;
