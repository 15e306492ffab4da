//! A coarse radiosity solution of the room, by which paths estimate what surfaces reflect.
//!
//! Surfaces that paths can meet are divided into patches ([`patches`]). Rays from each patch find which others it sees, and connections
//! which openings and luminaires light it ([`exchange`]): all this follows from the room alone. The light of one pass then gives the
//! radiosity of every patch by Gauss and Seidel's sweeps.
//!
//! Cells of surfaces whose straight light changes fast are divided ([`gradients`]), and some rays are aimed at patches that are much
//! brighter than most ([`bright`]).
//!
//! Methods use it as a control variate: a ray counts the radiosity of the patch that it meets, and a share of the rays go on and count
//! what this leaves out, in expectation exactly. How coarse the patches are, and how noisy their values, decides how much work that
//! takes; the mean of the estimate is the same for all.

mod bright;
mod exchange;
mod gradients;
mod patches;

pub use bright::{Aim, Bright};
pub use exchange::{Exchange, Solution, Spot};
