//! Coarse radiosity solution of the room, by which paths estimate the light that surfaces reflect.
//!
//! Surfaces that paths can meet are divided into patches ([`patches`]). Rays from each patch find the others that it sees, and connections
//! find the openings that light it ([`patch_rays`]). All this depends on the room alone ([`exchange`]), and methods that compute the same room
//! in other light share it ([`shared`]). The light of openings, and other light ([`other_light`]), then gives the radiosity of every patch by Gauss and
//! Seidel's sweeps.
//!
//! Cells of surfaces on which direct light has a steep gradient are divided ([`gradients`]), and some rays, of patches as of sensors, are
//! aimed at patches that are much brighter than most ([`bright_patches`]), and at images of openings and luminaires in plane surfaces with a
//! lobe ([`source_images`]).
//!
//! The light of each opening by itself has solutions of its own ([`tube_solutions`]).
//!
//! The error of each patch tells how much sensors that see different patches may differ ([`spread`]).
//!
//! Methods use the solution as a control variate: a ray counts the radiosity of the patch that it meets, and a fraction of the rays
//! continue and count its residual, so that the sum is exact in expectation. Coarse patches and noisy radiosities increase the variance,
//! but not the mean of the estimate.

mod area;
mod bright_patches;
mod exchange;
mod gradients;
mod met_patches;
mod other_light;
mod patch_rays;
mod patches;
mod shared;
mod source_images;
mod spread;
mod tube_solutions;

pub use bright_patches::{Aim, BrightPatches, Target};
pub use exchange::{Exchange, Solution};
pub use shared::SharedExchanges;
pub use spread::ExpectedSpreads;
pub use tube_solutions::{MOMENTS, TubeSolutions, bytes_of_solutions};
