//! Legend of a plot: a row of line and mark samples with names, outside of the plot area.

use glam::DVec2;

use super::colour::Colour;
use super::drawing::{Drawing, Line, Type};
use super::letters;
use super::outline::{Outline, Rectangle};

const SIZE: f64 = 12.0;
const ROW_HEIGHT: f64 = 18.0;
const SAMPLE: f64 = 24.0;
const GAP: f64 = 6.0;
const BETWEEN: f64 = 20.0;

/// Radius of marks in plots in pixels.
pub const MARK_RADIUS: f64 = 3.0;

/// Entry of a legend: a sample and its name.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Name of the series or quantity.
    pub name: String,
    /// Style of the line.
    pub line: Option<Line>,
    /// Colour of the marks.
    pub mark: Option<Colour>,
    /// Colour of an area, and its opacity, 0..1.
    pub area: Option<(Colour, f64)>,
}

impl Entry {
    fn width(&self) -> f64 {
        SAMPLE + GAP + letters::width(&self.name, SIZE) + BETWEEN
    }
}

/// Returns the height of the legend in pixels, with its entries in rows of the given width.
pub fn height(entries: &[Entry], width: f64) -> f64 {
    places(entries, width).last().map_or(0.0, |last| last.y + ROW_HEIGHT)
}

/// Draws entries in rows of the given width from the upper left corner `at`.
pub fn draw(drawing: &mut Drawing, entries: &[Entry], at: DVec2, width: f64) {
    for (entry, place) in entries.iter().zip(places(entries, width)) {
        let left = at + place + DVec2::new(0.0, 0.5 * ROW_HEIGHT);
        let right = left + DVec2::new(SAMPLE, 0.0);
        if let Some((colour, opacity)) = entry.area {
            let area = Rectangle { from: left - DVec2::new(0.0, 5.0), to: right + DVec2::new(0.0, 5.0) };
            drawing.fill(Outline::rectangle(area.from, area.to), colour, opacity);
        }
        if let Some(line) = &entry.line {
            drawing.line(Outline::polyline([left, right]), line.clone());
        }
        if let Some(colour) = entry.mark {
            drawing.fill(Outline::circle(left.midpoint(right), MARK_RADIUS), colour, 1.0);
        }
        drawing.text_centred(right + DVec2::new(GAP, 0.0), entry.name.as_str(), Type::new(SIZE, Colour::Ink));
    }
}

/// Returns the upper left corners of entries, relative to that of the legend.
fn places(entries: &[Entry], width: f64) -> Vec<DVec2> {
    let mut at = DVec2::ZERO;
    let place = |entry: &Entry| {
        if at.x > 0.0 && at.x + entry.width() - BETWEEN > width {
            at = DVec2::new(0.0, at.y + ROW_HEIGHT);
        }
        let place = at;
        at.x += entry.width();
        place
    };
    entries.iter().map(place).collect()
}
