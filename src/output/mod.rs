//! 
pub mod plots;
