//! The walls of the house, and what its comments and pages point to.

mod architecture;
mod citations;
