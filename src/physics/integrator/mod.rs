//! Integrators: the methods that compute light, and the three kinds of transport of which they are made.
//!
//! - `photon`: light is followed from its sources.
//! - `backward`: paths are followed from sensors and eyes.
//! - `photon_map`: photons are stored, and their density is estimated.
//!
//! `diffuser_source` cuts paths at Lambertian diffusers: the flux that leaves them is computed once for the whole room.
//!
//! `method` is the interface between a method and the rest of the program, `pass` defines a pass, `pass_words` stores one, `pass_size` says
//! how large one is, `trial` extrapolates from a few small ones, `registry` lists the methods, `deterministic` has the parts shared by
//! those without passes, `components` computes passes in parts of the light, `cross_check` pairs a method with another that checks it,
//! `moments` adds many moments to the passes of a method. Every other module is a method: its settings, which declare what it computes, refuses and
//! costs, its state and its pass.
//!
//! A pass is a pure function of (scene, settings, seed, pass number): it can be computed anywhere, in any order, and has the same bits on
//! any number of threads. Passes are independent replicates; `estimate` adds them up. With statistics per point (`photon_map::progressive`)
//! a pass also depends on the state left by earlier passes, so passes run in order.

pub mod backward;
pub mod bidirectional;
pub mod components;
pub mod cross_check;
pub mod deterministic;
pub mod diffuser_source;
pub mod holigilm;
pub mod jenkins;
pub mod light_tracing;
pub mod method;
pub mod moments;
pub mod pass;
pub mod pass_size;
pub mod pass_words;
pub mod path_tracing;
pub mod photon;
pub mod photon_map;
pub mod photon_mapping;
pub mod ppm;
pub mod radiosity;
mod registry;
pub mod room_matrix;
pub(crate) mod roulette;
pub mod sppm;
pub mod trial;
pub mod two_stage;

pub use pass::{GridPass, Integrator, Pass, PhotonCount, ViewPass};
pub use registry::Method;
