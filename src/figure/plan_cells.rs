//! Values of a grid, its cells in a plan, and the isolines over them.

use glam::DVec2;

use super::axes::Axes;
use super::colour::{BLACK, Colour, WHITE};
use super::drawing::{Drawing, Line, Type};
use super::isolines::Isoline;
use super::labels::Taken;
use super::outline::{Outline, Rectangle};
use super::refined::refined;
use super::scale::ColourScale;
use super::ticks::short;
use crate::output::{OutputError, Raster};

/// Shortest isoline with a label, in pixels.
const LEAST_LABELLED: f64 = 70.0;

/// Smallest width or height of a hatched cell, in pixels.
const LEAST_HATCHED: f64 = 3.0;

/// Colour of cells without a value, which are hatched.
pub(super) const NO_VALUE: [u8; 3] = [232; 3];

/// Values in the cells of a grid, row by row from the south, or at points.
#[derive(Clone, Debug, PartialEq)]
pub struct GridValues {
    /// Number of columns and of rows; points are one row.
    pub cells: [usize; 2],
    /// South-western corner of the first cell in metres.
    pub from_m: DVec2,
    /// North-eastern corner of the last cell in metres.
    pub to_m: DVec2,
    /// Values of the cells or points; not a number where there is none.
    pub values: Vec<f64>,
    /// Places of points in metres; empty for cells.
    pub points: Vec<DVec2>,
    /// True for cells without a value that are outside of the room or too near a wall, not in a solid; empty where there are none.
    pub outside: Vec<bool>,
}

impl GridValues {
    /// True of a cell outside of the room or too near a wall.
    pub(super) fn is_outside(&self, cell: usize) -> bool {
        self.outside.get(cell) == Some(&true)
    }

    /// Places the cells within axes.
    pub(super) fn cells_in(&self, axes: &Axes) -> Cells {
        Cells::new(axes, [self.from_m, self.to_m], self.cells)
    }

    /// Returns the grid with values between the centres of its cells.
    pub(super) fn refined(&self) -> Self {
        let (cells, values) = refined(self.cells, &self.values);
        Self { cells, values, ..self.clone() }
    }

    /// Returns a picture of one pixel per cell, north up, by the colours of a scale; an error if the number of values is not that of the cells.
    pub(super) fn colours(&self, scale: &ColourScale) -> Result<Raster, OutputError> {
        let [columns, rows] = self.cells;
        let values = &self.values;
        if columns == 0 || rows == 0 || columns.checked_mul(rows) != Some(values.len()) {
            return Err(OutputError::Size { values: values.len(), width: columns, height: rows, channels: 1 });
        }
        let mut raster = Raster::filled(columns, rows, [0; 3]);
        for (cell, value) in values.iter().enumerate() {
            let colour = if value.is_finite() { scale.colour(*value) } else { NO_VALUE };
            raster.set(cell % columns, rows - 1 - cell / columns, colour);
        }
        Ok(raster)
    }
}

/// Cells of a grid in a figure.
pub(super) struct Cells {
    /// Rectangle of all cells.
    pub place: Rectangle,
    /// Left end of the axes in pixels.
    pub axes_left: f64,
    count: DVec2,
}

impl Cells {
    /// Places columns and rows of cells between two corners in metres, south-west and north-east.
    pub fn new(axes: &Axes, [from_m, to_m]: [DVec2; 2], [columns, rows]: [usize; 2]) -> Self {
        let (south_west, north_east) = (axes.at(from_m.x, from_m.y), axes.at(to_m.x, to_m.y));
        let place = Rectangle::new(south_west.x, north_east.y, north_east.x, south_west.y);
        Self { place, axes_left: axes.within.from.x, count: DVec2::new(columns as f64, rows as f64) }
    }

    /// Returns the size of a cell in pixels.
    pub fn size(&self) -> DVec2 {
        self.place.size() / self.count
    }

    /// Returns the position in the figure of a point in units of cells from the south-western corner.
    pub fn at(&self, point: DVec2) -> DVec2 {
        let share = point / self.count;
        let size = self.place.size();
        DVec2::new(self.place.from.x + share.x * size.x, self.place.to.y - share.y * size.y)
    }

    /// Returns two opposite corners of each cell that is chosen by its number: row by row from the south.
    fn chosen(&self, choose: impl Fn(usize) -> bool) -> impl Iterator<Item = [DVec2; 2]> {
        let [columns, rows] = [self.count.x, self.count.y].map(|count| count as usize);
        (0..columns * rows).filter(move |cell| choose(*cell)).map(move |cell| {
            let corner = DVec2::new((cell % columns) as f64, (cell / columns) as f64);
            [self.at(corner), self.at(corner + 1.0)]
        })
    }

    /// Draws a diagonal across each cell that is chosen.
    pub fn hatch(&self, drawing: &mut Drawing, choose: impl Fn(usize) -> bool) {
        let mut lines = Outline::default();
        if self.size().min_element() >= LEAST_HATCHED {
            self.chosen(choose).for_each(|ends| lines.add_polyline(ends));
        }
        if !lines.0.is_empty() {
            drawing.line(lines, Line::new(Colour::Muted, 1.0));
        }
    }

    /// Leaves the cells empty that are chosen.
    pub fn clear(&self, drawing: &mut Drawing, choose: impl Fn(usize) -> bool) {
        let mut empty = Outline::default();
        self.chosen(choose).for_each(|[from, to]| empty.0.extend(Outline::rectangle(from, to).0));
        if !empty.0.is_empty() {
            drawing.fill(empty, Colour::Paper, 1.0);
        }
    }
}

/// Draws isolines.
pub(super) fn draw_lines(drawing: &mut Drawing, cells: &Cells, lines: &[Isoline]) {
    for line in lines {
        let mut outline = Outline::default();
        for piece in &line.pieces {
            outline.add_polyline(piece.iter().map(|point| cells.at(*point)));
        }
        drawing.line(outline.clone(), Line::new(WHITE, 2.6));
        drawing.line(outline, Line::new(BLACK, 1.1));
    }
}

/// Labels isolines with their values, each at the point of the line that is farthest from other labels and marks.
pub(super) fn label_lines(drawing: &mut Drawing, cells: &Cells, lines: &[Isoline], taken: &mut Taken) {
    let look = Type::new(11.0, BLACK).rimmed(WHITE);
    for line in lines {
        let text = short((line.level * 1e6).round() / 1e6);
        for piece in &line.pieces {
            let points: Vec<DVec2> = piece.iter().map(|point| cells.at(*point)).collect();
            let length: f64 = points.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
            if length < LEAST_LABELLED {
                continue;
            }
            let step = points.len().div_ceil(48).max(1);
            let mut places: Vec<(f64, DVec2)> =
                points.iter().step_by(step).map(|point| (taken.clearance(*point), *point)).collect();
            places.sort_by(|a, b| b.0.total_cmp(&a.0));
            taken.write(drawing, &cells.place, (&text, look), places.into_iter().map(|(_, place)| place));
        }
    }
}
