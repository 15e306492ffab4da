//! Light: every estimator against closed forms, tables, references and the other methods.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a failure is what tests are for"
)]

#[path = "../shared/documents.rs"]
mod documents;
#[path = "../shared/judge.rs"]
mod judge;
#[path = "../shared/measured_values.rs"]
mod measured_values;
#[path = "../shared/reference.rs"]
mod reference;
#[path = "../shared/scenes.rs"]
mod scenes;
#[path = "../shared/schema.rs"]
mod schema;

mod analytic_beams;
mod analytic_holigilm;
mod analytic_jobs;
mod analytic_radiosity;
mod annual;
mod annual_coverage;
mod annual_effects;
mod annual_gaps;
mod annual_moments;
mod at_openings;
mod bidirectional;
mod buried_sensors;
mod components;
mod contacts;
mod cut_cells;
mod determinism;
mod dome;
mod dull_pipes;
mod electric_light;
mod energy_balance;
mod few_photons;
mod furnished;
mod horizon;
mod instances;
mod intervals;
mod invariance;
mod left_out;
mod many_tubes;
mod matrix;
mod measured;
mod mesh_objects;
mod meshes;
mod mirrors;
mod moments;
mod outside;
mod partly_lambertian;
mod path_tracing;
mod photon_mapping;
mod point_statistics;
mod predictions;
mod progressive;
mod results;
mod rims;
mod room_matrix;
mod scattering;
mod separate_ends;
mod solids;
mod square_closures;
mod studies;
mod sun_on_gloss;
mod surfaces;
mod tables;
mod tilted_openings;
mod turned_rooms;
mod two_stage;
