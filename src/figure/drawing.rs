//! Builder of figures: shapes, text and pictures in the order in which they are drawn.

use glam::DVec2;

use super::colour::Colour;
use super::letters;
use super::outline::{Outline, Rectangle};
use crate::output::Raster;

/// Figure: its size, title and items.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    /// Width and height in pixels at single size.
    pub size: DVec2,
    /// Title of the figure, also for screen readers.
    pub title: String,
    /// Program and document that the figure is made by; empty where they are not known. Files have it among their properties.
    pub origin: String,
    /// Items in drawing order: later ones cover earlier ones.
    pub items: Vec<Item>,
}

/// Item of a figure.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// Outline that is filled, drawn as a line, or both.
    Shape(Shape),
    /// Line of text.
    Words(Words),
    /// Raster picture.
    Picture(Picture),
}

/// Outline with a fill, a line along it, or both.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// Outline that is drawn.
    pub outline: Outline,
    /// Colour of the fill, and its opacity, 0..1.
    pub fill: Option<(Colour, f64)>,
    /// Line along the outline.
    pub line: Option<Line>,
}

/// Text at its position; the outlines of its letters are made when the figure is written to a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Words {
    /// Text to be drawn.
    pub text: String,
    /// Position of the left end of the text's base line.
    pub at: DVec2,
    /// Width of the whole text in pixels, along its reading direction.
    pub width: f64,
    /// Size of the type in pixels.
    pub size: f64,
    /// Reading direction of the text.
    pub direction: Direction,
    /// Colour of the letters.
    pub colour: Colour,
    /// Colour of a halo around the letters, which keeps them legible on a picture.
    pub rim: Option<Colour>,
}

/// Style of a line.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Colour of the line.
    pub colour: Colour,
    /// Width in pixels at single size.
    pub width: f64,
    /// Lengths of dashes and gaps in turns, in pixels; empty: a solid line.
    pub dashes: Vec<f64>,
}

/// Raster picture in a figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Rectangle that the picture fills.
    pub place: Rectangle,
    /// Pixels of the picture.
    pub raster: Raster,
    /// Interpolation between the centres of pixels where the picture is enlarged.
    pub between: Between,
}

/// Interpolation between the centres of a picture's pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Between {
    /// No interpolation: pixels are squares.
    Edges,
    /// Blending of neighbouring pixels.
    Blends,
}

/// Alignment of a text relative to its point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// The text begins at the point.
    Start,
    /// The text is centred at the point.
    Middle,
    /// The text ends at the point.
    End,
}

/// Reading direction of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Left to right.
    Level,
    /// Bottom to top, as along a vertical axis.
    Upwards,
}

/// Style of a text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Type {
    /// Size of the type in pixels.
    pub size: f64,
    /// Colour of the letters.
    pub colour: Colour,
    /// Alignment relative to the text's point.
    pub anchor: Anchor,
    /// Reading direction.
    pub direction: Direction,
    /// Colour of a halo around the letters, which keeps them legible on a picture.
    pub rim: Option<Colour>,
}

impl Type {
    /// Creates the style of a horizontal text of a size and colour that begins at its point, without a halo.
    pub fn new(size: f64, colour: Colour) -> Self {
        Self { size, colour, anchor: Anchor::Start, direction: Direction::Level, rim: None }
    }

    /// Returns this style with another alignment.
    pub fn anchored(self, anchor: Anchor) -> Self {
        Self { anchor, ..self }
    }

    /// Returns this style with the text read upwards.
    pub fn upwards(self) -> Self {
        Self { direction: Direction::Upwards, ..self }
    }

    /// Returns this style with a halo of the given colour.
    pub fn rimmed(self, rim: Colour) -> Self {
        Self { rim: Some(rim), ..self }
    }
}

/// Width of the stroke along the letters that makes their halo, in sizes of the type.
pub const RIM_WIDTH: f64 = 0.28;

impl Words {
    /// Returns the outlines of the letters.
    pub fn outline(&self) -> Outline {
        match self.direction {
            Direction::Level => letters::outline(&self.text, self.size, self.at),
            Direction::Upwards => {
                let level = letters::outline(&self.text, self.size, DVec2::ZERO);
                level.mapped(|point| self.at + DVec2::new(point.y, -point.x))
            }
        }
    }

    /// Returns the stroke of the halo around the letters, which is drawn below them.
    pub fn rim(&self) -> Option<Line> {
        self.rim.map(|colour| Line::new(colour, RIM_WIDTH * self.size))
    }
}

impl Line {
    /// Creates a solid line.
    pub fn new(colour: Colour, width: f64) -> Self {
        Self { colour, width, dashes: Vec::new() }
    }

    /// Returns this line with dashes and gaps of the given lengths in pixels.
    pub fn dashed(self, dashes: &[f64]) -> Self {
        Self { dashes: dashes.to_vec(), ..self }
    }
}

impl Drawing {
    /// Creates a figure of paper alone.
    pub fn new(size: DVec2, title: impl Into<String>) -> Self {
        let mut drawing = Self { size, title: title.into(), origin: String::new(), items: Vec::new() };
        drawing.fill(Outline::rectangle(DVec2::ZERO, size), Colour::Paper, 1.0);
        drawing
    }

    /// Fills an outline with a colour of the given opacity, 0..1.
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

    /// Draws a picture of a smooth quantity, whose pixels are blended where it is enlarged.
    pub fn smooth_picture(&mut self, place: Rectangle, raster: Raster) {
        self.items.push(Item::Picture(Picture { place, raster, between: Between::Blends }));
    }

    /// Writes a text with its base line at the height of a point (for upward text: with its base line at the point's x).
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

    /// Writes a text whose capitals are centred vertically on a point.
    pub fn text_centred(&mut self, at: DVec2, text: impl Into<String>, look: Type) {
        self.text(at + DVec2::new(0.0, 0.5 * letters::CAPITAL_HEIGHT * look.size), text, look);
    }

    /// Draws another figure with its upper left corner at a point, scaled by `scale`.
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

    /// Returns all texts in drawing order.
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
