//! Figures: one builder of shapes and text from which SVG, PNG and PDF are written, and the figures that are built with it.
//!
//! Every figure takes plain numbers and returns a [`Drawing`]; this module reads no files, documents or clocks. Coordinates are
//! pixels at single size, x to the right and y down, and may be fractional. Text is drawn as outlines ([`letters`]), so that no
//! viewer needs a font; PNG ([`paint`]) and PDF ([`pdf`]) have the same shapes as SVG ([`svg`]).

pub mod axes;
pub mod colour;
pub mod convergence;
pub mod curves;
pub mod drawing;
pub mod false_colour;
pub mod file;
pub mod heading;
pub mod isolines;
pub mod labels;
pub mod legend;
pub mod letters;
pub mod lumens;
pub mod montage;
pub mod outline;
pub mod paint;
pub mod pdf;
pub mod plan_cells;
pub mod plan_map;
pub mod refined;
pub mod room_plan;
pub mod scale;
pub mod section;
pub mod sheet;
pub mod sky_dome;
mod span;
pub mod svg;
pub mod temporal_map;
pub mod ticks;
pub mod view_picture;
mod words;

pub use drawing::Drawing;
pub use file::FigureFormat;
pub use heading::Heading;
