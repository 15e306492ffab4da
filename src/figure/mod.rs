//! Figures: one builder of shapes and letters, from which SVG, PNG and PDF are made, and the figures that are built by it.
//!
//! Plain numbers in, a [`Drawing`] out; it knows no files, no documents and no clocks. Coordinates are pixels at single size,
//! x to the right and y down, and may lie between pixels. Letters are outlines ([`letters`]), so that no reader needs a
//! font; PNG ([`paint`]) and PDF ([`pdf`]) have the same shapes as SVG ([`svg`]).

pub mod axes;
pub mod colour;
pub mod convergence;
pub mod curves;
pub mod drawing;
pub mod false_colour;
pub mod file;
pub mod heading;
pub mod isolines;
pub mod legend;
pub mod letters;
pub mod lumens;
pub mod montage;
pub mod outline;
pub mod paint;
pub mod pdf;
pub mod plan_map;
pub mod scale;
pub mod section;
pub mod sheet;
pub mod sky_dome;
mod span;
pub mod svg;
pub mod ticks;
pub mod view_picture;
mod words;

pub use drawing::Drawing;
pub use file::FigureFormat;
pub use heading::Heading;
