//! The builder of figures: shapes, text and pictures in the order in which they are drawn.

use glam::DVec2;

use super::colour::Colour;
use super::letters;
use super::outline::{Outline, Rectangle};
use crate::output::Raster;

/// A figure: its size, what it is called, and what is drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    /// Width and height in pixels at single size.
    pub size: DVec2,
    /// Name of the figure, for those who cannot see it.
    pub title: String,
    /// All that is drawn, what comes first below what comes later.
    pub items: Vec<Item>,
}

/// Something drawn.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// Lines and areas.
    Shape(Shape),
    /// A text.
    Words(Words),
    /// A picture of pixels.
    Picture(Picture),
}

/// An outline with a colour within, along it, or both.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// The outline.
    pub outline: Outline,
    /// Colour within, and its opacity, 0..1.
    pub fill: Option<(Colour, f64)>,
    /// The line along the outline.
    pub line: Option<Line>,
}

/// A text that was written; its letters are outlines, which are made when the figure is written as a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Words {
    /// What it says.
    pub text: String,
    /// Where its first letter stands.
    pub at: DVec2,
    /// Width of the whole text in pixels, in the direction in which it is read.
    pub width: f64,
    /// Size of the type in pixels.
    pub size: f64,
    /// Direction in which it is read.
    pub direction: Direction,
    /// Colour of the letters.
    pub colour: Colour,
    /// Colour of a rim around the letters, over what is below.
    pub rim: Option<Colour>,
}

/// A line's look.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Colour of the line.
    pub colour: Colour,
    /// Width in pixels at single size.
    pub width: f64,
    /// Lengths of dashes and gaps in turns, in pixels; empty: no gaps.
    pub dashes: Vec<f64>,
}

/// A picture of pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Where it is drawn.
    pub place: Rectangle,
    /// The pixels.
    pub raster: Raster,
    /// What is between their middles where the picture is made larger.
    pub between: Between,
}

/// What is between the middles of a picture's pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Between {
    /// Pixels are squares: each is a value of its own.
    Edges,
    /// Neighbours are blended.
    Blends,
}

/// Where a text stands about its point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// The text begins at the point.
    Start,
    /// The text is centred at the point.
    Middle,
    /// The text ends at the point.
    End,
}

/// Direction of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// From left to right.
    Level,
    /// From below upwards, as along an axis.
    Upwards,
}

/// The look of a text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Type {
    /// Size of the type in pixels.
    pub size: f64,
    /// Colour of the letters.
    pub colour: Colour,
    /// Where it stands.
    pub anchor: Anchor,
    /// Direction in which it is read.
    pub direction: Direction,
    /// Colour of a rim around the letters, over what is below.
    pub rim: Option<Colour>,
}

impl Type {
    /// Level type of a size and colour that begins at its point.
    pub fn new(size: f64, colour: Colour) -> Self {
        Self { size, colour, anchor: Anchor::Start, direction: Direction::Level, rim: None }
    }

    /// The same type about another place of its point.
    pub fn anchored(self, anchor: Anchor) -> Self {
        Self { anchor, ..self }
    }

    /// The same type read upwards.
    pub fn upwards(self) -> Self {
        Self { direction: Direction::Upwards, ..self }
    }

    /// The same type with a rim.
    pub fn rimmed(self, rim: Colour) -> Self {
        Self { rim: Some(rim), ..self }
    }
}

/// Width of the line along the letters that makes their rim, in sizes of the type.
pub const RIM_WIDTH: f64 = 0.28;

impl Words {
    /// The outlines of the letters.
    pub fn outline(&self) -> Outline {
        match self.direction {
            Direction::Level => letters::outline(&self.text, self.size, self.at),
            Direction::Upwards => {
                let level = letters::outline(&self.text, self.size, DVec2::ZERO);
                level.mapped(|point| self.at + DVec2::new(point.y, -point.x))
            }
        }
    }

    /// The rim around the letters, which is drawn below them.
    pub fn rim(&self) -> Option<Line> {
        self.rim.map(|colour| Line::new(colour, RIM_WIDTH * self.size))
    }
}

impl Line {
    /// A line without gaps.
    pub fn new(colour: Colour, width: f64) -> Self {
        Self { colour, width, dashes: Vec::new() }
    }

    /// The same line with dashes and gaps.
    pub fn dashed(self, dashes: &[f64]) -> Self {
        Self { dashes: dashes.to_vec(), ..self }
    }
}

impl Drawing {
    /// Empty paper.
    pub fn new(size: DVec2, title: impl Into<String>) -> Self {
        let mut drawing = Self { size, title: title.into(), items: Vec::new() };
        drawing.fill(Outline::rectangle(DVec2::ZERO, size), Colour::Paper, 1.0);
        drawing
    }

    /// Fills an outline with a colour of an opacity, 0..1.
    pub fn fill(&mut self, outline: Outline, colour: Colour, opacity: f64) {
        self.add(Shape { outline, fill: Some((colour, opacity)), line: None });
    }

    /// Draws a line along an outline.
    pub fn line(&mut self, outline: Outline, line: Line) {
        self.add(Shape { outline, fill: None, line: Some(line) });
    }

    /// Fills an outline and draws a line along it.
    pub fn filled_line(&mut self, outline: Outline, fill: Colour, line: Line) {
        self.add(Shape { outline, fill: Some((fill, 1.0)), line: Some(line) });
    }

    /// Draws a picture whose pixels are squares.
    pub fn picture(&mut self, place: Rectangle, raster: Raster) {
        self.items.push(Item::Picture(Picture { place, raster, between: Between::Edges }));
    }

    /// Draws a picture of something without edges.
    pub fn smooth_picture(&mut self, place: Rectangle, raster: Raster) {
        self.items.push(Item::Picture(Picture { place, raster, between: Between::Blends }));
    }

    /// Writes a text at a point; the letters stand on the point's height (or left of it, where they are read upwards).
    pub fn text(&mut self, at: DVec2, text: impl Into<String>, look: Type) {
        let text = text.into();
        let width = letters::width(&text, look.size);
        let back = match look.anchor {
            Anchor::Start => 0.0,
            Anchor::Middle => 0.5 * width,
            Anchor::End => width,
        };
        let at = match look.direction {
            Direction::Level => at - DVec2::new(back, 0.0),
            Direction::Upwards => at + DVec2::new(0.0, back),
        };
        if letters::has_ink(&text) {
            let Type { size, colour, direction, rim, .. } = look;
            self.items.push(Item::Words(Words { text, at, width, size, direction, colour, rim }));
        }
    }

    /// Writes a text whose capitals are centred on the height of a point.
    pub fn text_centred(&mut self, at: DVec2, text: impl Into<String>, look: Type) {
        self.text(at + DVec2::new(0.0, 0.5 * letters::CAPITAL_HEIGHT * look.size), text, look);
    }

    /// Draws another figure with its upper left corner at a point, `scale` times as large.
    pub fn place(&mut self, other: &Self, at: DVec2, scale: f64) {
        let place = |point: DVec2| at + scale * point;
        let shape = |shape: &Shape| Shape {
            outline: shape.outline.mapped(place),
            fill: shape.fill,
            line: shape.line.as_ref().map(|line| Line {
                width: scale * line.width,
                dashes: line.dashes.iter().map(|dash| scale * dash).collect(),
                ..*line
            }),
        };
        self.items.extend(other.items.iter().map(|item| match item {
            Item::Shape(other) => Item::Shape(shape(other)),
            Item::Words(words) => Item::Words(Words {
                text: words.text.clone(),
                at: place(words.at),
                width: scale * words.width,
                size: scale * words.size,
                ..*words
            }),
            Item::Picture(Picture { place: within, raster, between }) => Item::Picture(Picture {
                place: Rectangle { from: place(within.from), to: place(within.to) },
                raster: raster.clone(),
                between: *between,
            }),
        }));
    }

    /// All texts, in the order in which they are drawn.
    pub fn texts(&self) -> impl Iterator<Item = &str> {
        self.items.iter().filter_map(|item| match item {
            Item::Words(words) => Some(words.text.as_str()),
            Item::Shape(_) | Item::Picture(_) => None,
        })
    }

    fn add(&mut self, shape: Shape) {
        if !shape.outline.0.is_empty() {
            self.items.push(Item::Shape(shape));
        }
    }
}
