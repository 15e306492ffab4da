//! What stands above a figure: its title, and lines that say of what, where, when and how it was computed.

use glam::DVec2;

use super::colour::Colour;
use super::drawing::{Drawing, Type};
use super::letters;

/// Distance of a heading from the edges of a figure.
pub const MARGIN: f64 = 16.0;

const TITLE_SIZE: f64 = 17.0;
const LINE_SIZE: f64 = 12.0;
const LINE_HEIGHT: f64 = 17.0;

/// Title and lines of a figure.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Heading {
    /// What the figure shows.
    pub title: String,
    /// Job, place, time, sky, method and error, in lines of less weight; empty ones are left out.
    pub lines: Vec<String>,
}

impl Heading {
    /// A heading without lines.
    pub fn of(title: impl Into<String>) -> Self {
        Self { title: title.into(), lines: Vec::new() }
    }

    /// Lower end of the heading.
    pub fn height(&self) -> f64 {
        let lines = self.lines.iter().filter(|line| !line.is_empty()).count() as f64;
        let title = if self.title.is_empty() { 0.0 } else { TITLE_SIZE + 4.0 };
        MARGIN + title + LINE_HEIGHT * lines
    }

    /// Writes the heading into the upper left of a figure; what is too long for it is cut.
    pub fn draw(&self, drawing: &mut Drawing) {
        let most = drawing.size.x - 2.0 * MARGIN;
        let mut at = DVec2::new(MARGIN, MARGIN);
        if !self.title.is_empty() {
            at.y += letters::CAPITAL_HEIGHT * TITLE_SIZE;
            drawing.text(at, letters::fitted(&self.title, TITLE_SIZE, most), Type::new(TITLE_SIZE, Colour::Ink));
            at.y += 4.0 + (1.0 - letters::CAPITAL_HEIGHT) * TITLE_SIZE;
        }
        for line in self.lines.iter().filter(|line| !line.is_empty()) {
            let base = at + DVec2::new(0.0, letters::CAPITAL_HEIGHT * LINE_SIZE + 2.0);
            drawing.text(base, letters::fitted(line, LINE_SIZE, most), Type::new(LINE_SIZE, Colour::Muted));
            at.y += LINE_HEIGHT;
        }
    }
}
