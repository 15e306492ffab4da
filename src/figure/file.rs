//! Figures as files in several formats.

use super::drawing::Drawing;
use super::paint::{self, Scale};
use super::pdf::pdf;
use super::svg::svg;
use crate::output::OutputError;

/// File format of a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FigureFormat {
    /// SVG: outlines, for web pages.
    Svg,
    /// PNG: pixels.
    Png(Scale),
    /// PDF: outlines, for print.
    Pdf,
}

impl FigureFormat {
    /// Every format, PNG at single size.
    pub const ALL: [Self; 3] = [Self::Svg, Self::Png(Scale::Single), Self::Pdf];

    /// Returns the extension of a file's name, without the dot.
    pub fn suffix(self) -> &'static str {
        match self {
            Self::Svg => "svg",
            Self::Png(_) => "png",
            Self::Pdf => "pdf",
        }
    }

    /// Returns the media type of the format.
    pub fn media_type(self) -> &'static str {
        match self {
            Self::Svg => "image/svg+xml",
            Self::Png(_) => "image/png",
            Self::Pdf => "application/pdf",
        }
    }

    /// Writes the figure as a file of this format.
    pub fn write(self, drawing: &Drawing) -> Result<Vec<u8>, OutputError> {
        match self {
            Self::Svg => svg(drawing).map(String::into_bytes),
            Self::Png(scale) => paint::png(drawing, scale),
            Self::Pdf => pdf(std::slice::from_ref(drawing)),
        }
    }
}
