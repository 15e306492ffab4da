//! A figure as a file, in the format that is asked for.

use super::drawing::Drawing;
use super::paint::{self, Scale};
use super::pdf::pdf;
use super::svg::svg;
use crate::output::OutputError;

/// How a figure is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FigureFormat {
    /// Outlines, for pages.
    Svg,
    /// Pixels.
    Png(Scale),
    /// Outlines, for print.
    Pdf,
}

impl FigureFormat {
    /// Each format, with pixels at single size.
    pub const ALL: [Self; 3] = [Self::Svg, Self::Png(Scale::Single), Self::Pdf];

    /// The end of a file's name, without a dot.
    pub fn suffix(self) -> &'static str {
        match self {
            Self::Svg => "svg",
            Self::Png(_) => "png",
            Self::Pdf => "pdf",
        }
    }

    /// Type that a file is served as.
    pub fn media_type(self) -> &'static str {
        match self {
            Self::Svg => "image/svg+xml",
            Self::Png(_) => "image/png",
            Self::Pdf => "application/pdf",
        }
    }

    /// The figure as a file.
    pub fn write(self, drawing: &Drawing) -> Result<Vec<u8>, OutputError> {
        match self {
            Self::Svg => svg(drawing).map(String::into_bytes),
            Self::Png(scale) => paint::png(drawing, scale),
            Self::Pdf => pdf(drawing),
        }
    }
}
