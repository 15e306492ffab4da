//! Heading of a figure: its title, and lines that name the job, place, time, sky, method and error.

use glam::DVec2;

use super::colour::Colour;
use super::drawing::{Drawing, Type};
use super::letters;

/// Distance of a heading from the edges of a figure in pixels.
pub const MARGIN: f64 = 16.0;

const TITLE_SIZE: f64 = 17.0;
const LINE_SIZE: f64 = 12.0;
const LINE_HEIGHT: f64 = 17.0;

/// Separator between the pieces of a line; long lines are broken at it.
pub const SEPARATOR: &str = " · ";

/// Title and lines of a figure.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Heading {
    /// Title of the figure.
    pub title: String,
    /// Job, place, time, sky, method and error, in muted type below the title; empty lines are left out.
    pub lines: Vec<String>,
    /// Program and document that the figure is made by, which is not printed; empty where they are not known.
    pub origin: String,
}

impl Heading {
    /// Creates a heading without lines.
    pub fn of(title: impl Into<String>) -> Self {
        Self { title: title.into(), ..Self::default() }
    }

    /// Returns the y coordinate of the lower end of the heading in a figure of the given width, in pixels.
    pub fn height(&self, width: f64) -> f64 {
        let title = if self.title.is_empty() { 0.0 } else { TITLE_SIZE + 4.0 };
        MARGIN + title + LINE_HEIGHT * self.broken(width).len() as f64
    }

    /// Returns the lines, broken at their separators where they are too long for a figure of the given width.
    fn broken(&self, width: f64) -> Vec<String> {
        let most = width - 2.0 * MARGIN;
        let mut lines: Vec<String> = Vec::new();
        for line in self.lines.iter().filter(|line| !line.is_empty()) {
            let mut begun = String::new();
            for piece in line.split(SEPARATOR) {
                let longer = if begun.is_empty() { piece.to_owned() } else { format!("{begun}{SEPARATOR}{piece}") };
                if !begun.is_empty() && letters::width(&longer, LINE_SIZE) > most {
                    lines.push(std::mem::replace(&mut begun, piece.to_owned()));
                } else {
                    begun = longer;
                }
            }
            lines.push(begun);
        }
        lines
    }

    /// Writes the heading into the upper left of a figure; lines that are too long are broken at a separator, or cut.
    pub fn draw(&self, drawing: &mut Drawing) {
        drawing.origin.clone_from(&self.origin);
        let most = drawing.size.x - 2.0 * MARGIN;
        let mut at = DVec2::new(MARGIN, MARGIN);
        if !self.title.is_empty() {
            at.y += letters::CAPITAL_HEIGHT * TITLE_SIZE;
            drawing.text(at, letters::fitted(&self.title, TITLE_SIZE, most), Type::new(TITLE_SIZE, Colour::Ink));
            at.y += 4.0 + (1.0 - letters::CAPITAL_HEIGHT) * TITLE_SIZE;
        }
        for line in self.broken(drawing.size.x) {
            let base = at + DVec2::new(0.0, letters::CAPITAL_HEIGHT * LINE_SIZE + 2.0);
            drawing.text(base, letters::fitted(&line, LINE_SIZE, most), Type::new(LINE_SIZE, Colour::Muted));
            at.y += LINE_HEIGHT;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::FigureFormat;

    #[test]
    fn long_lines_are_broken_at_their_dots() {
        let line = ["55.68° N, 12.57° E", "2026-03-21 12:00 +01:00", "overcast"].join(SEPARATOR);
        let heading = Heading { title: "a title".to_owned(), lines: vec![line, String::new()], origin: String::new() };
        assert_eq!(heading.height(800.0), heading.height(2000.0));
        assert!(heading.height(200.0) > heading.height(800.0));
        let mut narrow = Drawing::new(DVec2::new(200.0, 100.0), "");
        heading.draw(&mut narrow);
        let texts: Vec<&str> = narrow.texts().collect();
        assert_eq!(narrow.origin, "");
        assert_eq!(texts, ["a title", "55.68° N, 12.57° E", "2026-03-21 12:00 +01:00", "overcast"]);
    }

    /// Program and document are among the properties of the files of a figure, and its own alone.
    #[test]
    fn files_name_program_and_document() {
        let origin = "skyduct 1.2.3 · document 0123abcd";
        let mut drawing = Drawing::new(DVec2::new(80.0, 60.0), "a title");
        Heading { origin: origin.to_owned(), ..Heading::of("a title") }.draw(&mut drawing);
        let plain = Drawing::new(DVec2::new(80.0, 60.0), "a title");
        for format in FigureFormat::ALL {
            let [found, without] = [&drawing, &plain].map(|drawing| format.write(drawing).unwrap());
            // PDF has text beyond ASCII as hexadecimal digits of UTF-16
            let wanted = match format {
                FigureFormat::Pdf => "0123abcd".encode_utf16().map(|unit| format!("{unit:04X}")).collect(),
                _ => origin.to_owned(),
            };
            let has = |bytes: &[u8]| bytes.windows(wanted.len()).any(|window| window == wanted.as_bytes());
            assert!(has(&found) && !has(&without), "{format:?}");
        }
    }
}
