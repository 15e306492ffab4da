//! Integrators: three ways to move light, and the methods made of them.
//!
//! - `photon`: light is followed from its sources.
//! - `backward`: paths are followed from sensors and eyes.
//! - `photon_map`: photons are kept, and their density is estimated.
//!
//! `lamp` cuts paths at Lambertian diffusers: what leaves them is found once for all of the room.
//!
//! `method` says what the rest of the program has to know of a method, `pass` what a pass is, `pass_size` how large one is, `trial` what
//! a few small ones tell, `registry` which methods there are, `deterministic` what those without passes share, `components` passes of parts of
//! the light, `cross_check` a method and its check. Every other entry is a method: its settings, which say what it knows, refuses
//! and costs, its state and its pass.
//!
//! A pass is a pure function of (scene, settings, seed, pass number): it can be computed anywhere, in any order, and has
//! the same bits on any number of threads. Passes are independent replicates; `estimate` adds them up. With statistics per
//! point (`photon_map::progressive`) a pass also depends on the state left by earlier passes, so passes run in order.

pub mod backward;
pub mod bidirectional;
pub mod components;
pub mod cross_check;
pub mod deterministic;
pub mod holigilm;
pub mod jenkins;
pub mod lamp;
pub mod light_tracing;
pub mod method;
mod pass;
pub mod pass_size;
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
