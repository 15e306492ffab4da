//! Report on A4 paper: a page of sentences, figures and results, and a page of small print.

use glam::DVec2;

use super::colour::Colour;
use super::drawing::{Drawing, Line, Type};
use super::heading::Heading;
use super::letters;
use super::outline::Outline;

/// Width and height of A4 at 96 pixels per inch.
const PAPER: DVec2 = DVec2::new(793.7, 1122.5);

const MARGIN: f64 = 46.0;
const BETWEEN: f64 = 14.0;

/// Largest height of the first figure, and of those in the row below it, in pixels.
const FIRST_HEIGHT: f64 = 420.0;
const ROW_HEIGHT: f64 = 290.0;

/// Height of the figures of an overview, largest width of those after the first, whose letters would be larger than its own in a long section,
/// and smallest width of all, in pixels.
const OVERVIEW_HEIGHT: f64 = 420.0;
const NEXT_WIDTH: f64 = 700.0;
const LEAST_WIDTH: f64 = 400.0;

const TITLE_SIZE: f64 = 20.0;
const SENTENCE_SIZE: f64 = 14.0;
const SENTENCE_HEIGHT: f64 = 20.0;
const HEAD_SIZE: f64 = 12.5;
const SIZE: f64 = 10.0;
const LINE_HEIGHT: f64 = 14.0;

/// Width of the names of facts in pixels.
const NAME_WIDTH: f64 = 132.0;

/// Space between columns of a table in pixels.
const COLUMN_GAP: f64 = 16.0;

/// Contents of a report.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// Title of the report.
    pub title: String,
    /// Place, time and similar lines, below the title.
    pub lines: Vec<String>,
    /// Sentences that tell the result.
    pub sentences: Vec<(Tone, String)>,
    /// Figures, the first of which is the largest.
    pub figures: Vec<SheetFigure>,
    /// Tables and lists of the first page, from top to bottom.
    pub parts: Vec<SheetPart>,
    /// Tables and lists of the second page.
    pub details: Vec<SheetPart>,
    /// Line at the bottom of both pages: program and source of the report.
    pub footer: String,
}

/// Tone of a sentence of a report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    /// No judgement.
    Plain,
    /// Good news: a target is met.
    Good,
    /// Bad news: a target is not met.
    Bad,
}

impl Tone {
    /// Returns the colour of a mark beside the sentence.
    fn colour(self) -> Colour {
        match self {
            Self::Plain => Colour::Muted,
            Self::Good => Colour::Fixed([0, 128, 84]),
            Self::Bad => Colour::Fixed([200, 60, 30]),
        }
    }
}

/// Figure of a report.
#[derive(Clone, Debug, PartialEq)]
pub struct SheetFigure {
    /// Path below that of the job at which the figure alone is served, without a suffix.
    pub name: String,
    /// Drawing of the figure.
    pub drawing: Drawing,
}

/// Part of a report under its own heading.
#[derive(Clone, Debug, PartialEq)]
pub enum SheetPart {
    /// Rows of cells below the names of the columns.
    Table {
        /// Heading of the table.
        title: String,
        /// Names of the columns.
        head: Vec<String>,
        /// Rows, each with a cell for every column.
        rows: Vec<Vec<String>>,
    },
    /// Names, each with a description.
    Facts {
        /// Heading of the list.
        title: String,
        /// Pairs of name and description.
        facts: Vec<(String, String)>,
    },
}

/// Cell of a table for a value that does not exist, or is not known.
pub const NO_VALUE: &str = "–";

impl SheetPart {
    /// Creates a table without the columns that have a value in no row. Rows may be shorter than the head.
    pub fn table(title: String, head: Vec<String>, mut rows: Vec<Vec<String>>) -> Self {
        let has_value = |column: usize| rows.iter().filter_map(|row| row.get(column)).any(|cell| cell != NO_VALUE);
        let kept: Vec<bool> = (0..head.len()).map(has_value).collect();
        let keep = |cells: Vec<String>| {
            cells.into_iter().zip(&kept).filter(|(_, kept)| **kept).map(|(cell, _)| cell).collect()
        };
        rows = rows.into_iter().map(keep).collect();
        Self::Table { title, head: keep(head), rows }
    }
}

impl Sheet {
    /// Draws the figures alone, side by side below the title and its lines: equally high, but for those that would be too wide.
    pub fn overview(&self) -> Drawing {
        let origin = self.figures.first().map_or_else(String::new, |figure| figure.drawing.origin.clone());
        let heading = Heading { title: self.title.clone(), lines: self.lines.clone(), origin };
        let scaled = self.figures.iter().enumerate().map(|(index, figure)| {
            let widest = if index == 0 { f64::INFINITY } else { NEXT_WIDTH };
            let scale = (OVERVIEW_HEIGHT / figure.drawing.size.y).min(widest / figure.drawing.size.x);
            (&figure.drawing, scale, scale * figure.drawing.size.x)
        });
        let scaled: Vec<_> = scaled.collect();
        let width = scaled.iter().map(|(.., width)| width + BETWEEN).sum::<f64>() + BETWEEN;
        let width = width.max(LEAST_WIDTH);
        let top = heading.height(width) + 6.0;
        let size = DVec2::new(width, top + if scaled.is_empty() { 0.0 } else { OVERVIEW_HEIGHT } + BETWEEN);
        let mut drawing = Drawing::new(size, self.title.as_str());
        heading.draw(&mut drawing);
        let mut left = BETWEEN;
        for (figure, scale, width) in scaled {
            drawing.place(figure, DVec2::new(left, top), scale);
            left += width + BETWEEN;
        }
        drawing
    }

    /// Draws the two pages of the report on A4; longer ones are scaled down to fit.
    pub fn draw(&self) -> Vec<Drawing> {
        let mut first = Page::new(&self.title);
        first.heading(&self.title, &self.lines);
        first.sentences(&self.sentences);
        if let Some((figure, others)) = self.figures.split_first() {
            first.figures(std::slice::from_ref(figure), FIRST_HEIGHT);
            first.figures(others, ROW_HEIGHT);
        }
        self.parts.iter().for_each(|part| first.part(part));
        let mut second = Page::new(&self.title);
        second.heading(&self.title, &[]);
        self.details.iter().for_each(|part| second.part(part));
        let pages = [first, second].into_iter().enumerate();
        pages.map(|(index, page)| page.ended(&format!("{} · page {} of 2", self.footer, index + 1))).collect()
    }
}

/// Page that is filled from the top.
struct Page {
    drawing: Drawing,
    y: f64,
}

impl Page {
    fn new(title: &str) -> Self {
        Self { drawing: Drawing::new(PAPER, title), y: MARGIN }
    }

    /// Ends the page with a footer, and scales it down if it is longer than the paper.
    fn ended(mut self, footer: &str) -> Drawing {
        self.footer(footer);
        let Self { drawing, y } = self;
        let scale = (PAPER.y / (y + MARGIN)).min(1.0);
        if scale == 1.0 {
            return drawing;
        }
        let mut smaller = Drawing::new(PAPER, drawing.title.as_str());
        smaller.place(&drawing, DVec2::new(0.5 * (1.0 - scale) * PAPER.x, 0.0), scale);
        smaller
    }

    /// Writes sentences, each beside a bar in the colour of its tone.
    fn sentences(&mut self, sentences: &[(Tone, String)]) {
        for (tone, sentence) in sentences {
            let top = self.y;
            for line in letters::wrapped(sentence, SENTENCE_SIZE, PAPER.x - 2.0 * MARGIN - BETWEEN) {
                self.write(MARGIN + BETWEEN, &line, Type::new(SENTENCE_SIZE, Colour::Ink));
                self.advance(SENTENCE_HEIGHT);
            }
            let bar = [DVec2::new(MARGIN, top - 3.0), DVec2::new(MARGIN + 4.0, self.y - 5.0)];
            self.drawing.fill(Outline::rectangle(bar[0], bar[1]), tone.colour(), 1.0);
            self.advance(6.0);
        }
    }

    /// Writes a line at the height up to which the page is filled, `x` pixels from the left.
    fn write(&mut self, x: f64, text: &str, look: Type) {
        let at = DVec2::new(x, self.y + letters::CAPITAL_HEIGHT * look.size);
        self.drawing.text(at, text, look);
    }

    fn advance(&mut self, height: f64) {
        self.y += height;
    }

    fn heading(&mut self, title: &str, lines: &[String]) {
        let width = PAPER.x - 2.0 * MARGIN;
        self.write(MARGIN, &letters::fitted(title, TITLE_SIZE, width), Type::new(TITLE_SIZE, Colour::Ink));
        self.advance(TITLE_SIZE + 8.0);
        for line in lines.iter().filter(|line| !line.is_empty()) {
            for line in letters::wrapped(line, SIZE + 1.0, width) {
                self.write(MARGIN, &line, Type::new(SIZE + 1.0, Colour::Muted));
                self.advance(LINE_HEIGHT + 1.0);
            }
        }
        self.advance(6.0);
    }

    /// Draws figures side by side, none higher than `most` pixels.
    fn figures(&mut self, figures: &[SheetFigure], most: f64) {
        let count = figures.len().max(1) as f64;
        let width = (PAPER.x - 2.0 * MARGIN - BETWEEN * (count - 1.0)) / count;
        let mut tallest: f64 = 0.0;
        for (index, SheetFigure { drawing, .. }) in figures.iter().enumerate() {
            let scale = (width / drawing.size.x).min(most / drawing.size.y);
            let aside = 0.5 * (width - scale * drawing.size.x);
            let left = MARGIN + index as f64 * (width + BETWEEN) + aside;
            self.drawing.place(drawing, DVec2::new(left, self.y), scale);
            tallest = tallest.max(scale * drawing.size.y);
        }
        if tallest > 0.0 {
            self.advance(tallest + BETWEEN);
        }
    }

    fn part(&mut self, part: &SheetPart) {
        let (title, is_empty) = match part {
            SheetPart::Table { title, rows, .. } => (title, rows.is_empty()),
            SheetPart::Facts { title, facts } => (title, facts.is_empty()),
        };
        if is_empty {
            return;
        }
        self.write(MARGIN, title, Type::new(HEAD_SIZE, Colour::Ink));
        self.advance(HEAD_SIZE + 3.0);
        self.rule(Colour::Muted);
        match part {
            SheetPart::Table { head, rows, .. } => self.table(head, rows),
            SheetPart::Facts { facts, .. } => self.facts(facts),
        }
        self.advance(BETWEEN);
    }

    fn rule(&mut self, colour: Colour) {
        let [left, right] = [MARGIN, PAPER.x - MARGIN].map(|x| DVec2::new(x, self.y));
        self.drawing.line(Outline::polyline([left, right]), Line::new(colour, 0.8));
        self.advance(6.0);
    }

    /// Writes a table: columns are as wide as their widest cell, and the type shrinks where all columns together are too wide.
    fn table(&mut self, head: &[String], rows: &[Vec<String>]) {
        let widest = |column: usize| {
            let cells = rows.iter().filter_map(|row| row.get(column)).chain(head.get(column));
            cells.map(|cell| letters::width(cell, SIZE)).fold(0.0, f64::max)
        };
        let widths: Vec<f64> = (0..head.len()).map(widest).collect();
        let gaps = COLUMN_GAP * (head.len() as f64 - 1.0);
        let available = PAPER.x - 2.0 * MARGIN - gaps;
        let shrink = (available / widths.iter().sum::<f64>()).min(1.0);
        let look = |colour| Type::new(shrink * SIZE, colour);
        for (row, colour) in [(head, Colour::Muted)].into_iter().chain(rows.iter().map(|row| (&row[..], Colour::Ink))) {
            let mut x = MARGIN;
            for (cell, width) in row.iter().zip(&widths) {
                self.write(x, cell, look(colour));
                x += shrink * width + COLUMN_GAP;
            }
            self.advance(LINE_HEIGHT);
        }
    }

    fn facts(&mut self, facts: &[(String, String)]) {
        let width = PAPER.x - 2.0 * MARGIN - NAME_WIDTH;
        for (name, words) in facts {
            self.write(MARGIN, &letters::fitted(name, SIZE, NAME_WIDTH - 8.0), Type::new(SIZE, Colour::Muted));
            // names of fields stand between backticks, which paper does not need
            for line in letters::wrapped(&words.replace('`', ""), SIZE, width) {
                self.write(MARGIN + NAME_WIDTH, &line, Type::new(SIZE, Colour::Ink));
                self.advance(LINE_HEIGHT);
            }
        }
    }

    fn footer(&mut self, footer: &str) {
        self.rule(Colour::Faint);
        for line in letters::wrapped(footer, SIZE - 1.0, PAPER.x - 2.0 * MARGIN) {
            self.write(MARGIN, &line, Type::new(SIZE - 1.0, Colour::Muted));
            self.advance(LINE_HEIGHT - 1.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::drawing::Item;

    fn sheet(facts: usize) -> Sheet {
        let fact = |index: usize| (format!("fact {index}"), "words that are said of `it` ".repeat(12));
        let table = |title: &str, rows: Vec<Vec<String>>| SheetPart::Table {
            title: title.to_owned(),
            head: vec!["grid".to_owned(), "mean, lx".to_owned()],
            rows,
        };
        Sheet {
            title: "bath".to_owned(),
            lines: vec!["Copenhagen".to_owned(), String::new()],
            sentences: vec![(Tone::Bad, "The target of 300 lx is not met. ".repeat(6))],
            figures: vec![SheetFigure {
                name: "map".to_owned(),
                drawing: Drawing::new(DVec2::new(900.0, 400.0), "map"),
            }],
            parts: vec![
                table("Illuminance", vec![vec!["floor".to_owned(), "211.0 ± 0.3".to_owned()]]),
                table("Tubes", Vec::new()),
            ],
            details: vec![SheetPart::Facts { title: "Simulated".to_owned(), facts: (0..facts).map(fact).collect() }],
            footer: "skyduct".to_owned(),
        }
    }

    #[test]
    fn columns_without_a_value_are_left_out() {
        let texts = |texts: &[&str]| texts.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>();
        let rows = vec![
            texts(&["a", NO_VALUE, "1", NO_VALUE]),
            texts(&["b", NO_VALUE, NO_VALUE, "2"]),
            texts(&["and 3 more"]),
        ];
        let SheetPart::Table { head, rows, .. } =
            SheetPart::table(String::new(), texts(&["grid", "target", "mean", "least"]), rows)
        else {
            panic!("no table")
        };
        assert_eq!(head, ["grid", "mean", "least"]);
        assert_eq!(rows, [texts(&["a", "1", NO_VALUE]), texts(&["b", NO_VALUE, "2"]), texts(&["and 3 more"])]);
    }

    #[test]
    fn an_overview_is_as_wide_as_its_figures() {
        let mut sheet = sheet(0);
        sheet
            .figures
            .push(SheetFigure { name: "view".to_owned(), drawing: Drawing::new(DVec2::new(210.0, 210.0), "") });
        let drawing = sheet.overview();
        assert_eq!(drawing.size.x, 945.0 + 420.0 + 3.0 * BETWEEN);
        let long = SheetFigure { name: "section".to_owned(), drawing: Drawing::new(DVec2::new(900.0, 200.0), "") };
        sheet.figures.insert(1, long);
        assert_eq!(sheet.overview().size.x, 945.0 + NEXT_WIDTH + 420.0 + 4.0 * BETWEEN);
        assert!(drawing.texts().eq(["bath", "Copenhagen"]));
    }

    /// All texts are within the paper, however many facts there are; an empty table is left out.
    #[test]
    fn everything_is_on_two_pages() {
        for facts in [0, 3, 60] {
            let pages = sheet(facts).draw();
            let texts = |page: usize| pages[page].texts().collect::<Vec<_>>();
            assert!(texts(0).contains(&"211.0 ± 0.3") && !texts(0).contains(&"Tubes"), "{:?}", texts(0));
            assert!(texts(0).iter().filter(|text| text.contains("300 lx")).count() > 1, "sentences are wrapped");
            assert_eq!(texts(1).iter().filter(|text| text.starts_with("fact ")).count(), facts);
            assert_eq!(
                (texts(0).last(), texts(1).last()),
                (Some(&"skyduct · page 1 of 2"), Some(&"skyduct · page 2 of 2"))
            );
            for page in pages {
                assert_eq!(page.size, PAPER);
                assert!(page.texts().all(|text| !text.contains('`')), "{:?}", page.texts().collect::<Vec<_>>());
                for item in &page.items {
                    let Item::Words(words) = item else { continue };
                    assert!(words.at.y < PAPER.y && words.at.x + words.width < PAPER.x, "{words:?}");
                }
            }
        }
    }
}
