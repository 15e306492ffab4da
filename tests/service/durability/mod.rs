//! Faults, crashes and full disks: what they may cost, and what stands after them.

mod ahead;
mod arrivals;
mod backup;
mod folder;
mod panic;
mod process;
mod queue;
mod restart;
mod store;
mod storm;
