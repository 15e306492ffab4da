//! The rows of the matrix, by what they are made of.

pub mod documents;
pub mod effects;
pub mod electric;
pub mod furnished;
pub mod images;
pub mod plain;
pub mod radiosity;
pub mod rooms;
pub mod sheets;
pub mod sun;
pub mod views;
