//! Lines of equal value in a grid of cells.

use std::collections::VecDeque;

use contour::ContourBuilder;
use glam::DVec2;

use super::outline::{Outline, Part, Rectangle};
use crate::output::OutputError;

/// Illuminances in lux that are usual in standards and practice, as levels of isolines.
const NAMED_LUX: [f64; 17] =
    [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 150.0, 200.0, 300.0, 500.0, 750.0, 1000.0, 1500.0, 2000.0, 3000.0, 5000.0];

/// Fewest isolines at named values; below this number a map has isolines at round values instead.
const FEWEST: usize = 4;

/// Level and the lines along which a grid has this value.
#[derive(Clone, Debug, PartialEq)]
pub struct Isoline {
    /// Value along the lines.
    pub level: f64,
    /// Lines, each a list of points, in units of a cell: the first cell reaches from 0 to 1, and its centre is at 0.5.
    pub pieces: Vec<Vec<DVec2>>,
}

/// Computes the lines of equal value of a grid of `cells` columns and rows. `values` are those at the centres of the cells, row
/// by row; they are interpolated linearly, and extrapolated to the edge of the grid. No line crosses cells whose values are not
/// finite. An error if the number of values is not that of the cells.
pub fn isolines(cells: [usize; 2], values: &[f64], levels: &[f64]) -> Result<Vec<Isoline>, OutputError> {
    let [columns, rows] = cells;
    if columns == 0 || rows == 0 || columns.checked_mul(rows) != Some(values.len()) {
        return Err(OutputError::Size { values: values.len(), width: columns, height: rows, channels: 1 });
    }
    let known: Vec<bool> = values.iter().map(|value| value.is_finite()).collect();
    let values = &beside_the_unknown(columns, values);
    // the library ends lines half a cell beyond the outer centres, and not always in the right place: with a frame of
    // extrapolated values around the grid, these ends lie outside
    let inner = |index: usize, count: usize| index.saturating_sub(1).min(count - 1);
    let finite = |row: usize, column: usize| Some(values[row * columns + column]).filter(|value| value.is_finite());
    let at = |row: usize, column: usize| {
        let (near_row, near_column) = (inner(row, rows), inner(column, columns));
        let near = finite(near_row, near_column).unwrap_or(0.0);
        // the cell as far inside the edge as the frame is outside
        let mirrored = |index: usize, near: usize, count: usize| (2 * near + 1).saturating_sub(index).min(count - 1);
        let far = finite(mirrored(row, near_row, rows), mirrored(column, near_column, columns)).unwrap_or(near);
        if (row, column) == (near_row + 1, near_column + 1) { near } else { 2.0 * near - far }
    };
    let framed: Vec<f64> = (0..rows + 2)
        .flat_map(|row| (0..columns + 2).map(move |column| (row, column)))
        .map(|(row, column)| at(row, column))
        .collect();
    let builder = ContourBuilder::new(columns + 2, rows + 2, true).x_origin(-1.0).y_origin(-1.0);
    let lines = builder.lines(&framed, levels).map_err(|error| OutputError::Plot(error.to_string()))?;
    let within = Rectangle { from: DVec2::ZERO, to: DVec2::new(columns as f64, rows as f64) };
    let is_known = |point: DVec2| {
        let [column, row] =
            [(point.x, columns), (point.y, rows)].map(|(at, count)| (at.max(0.0) as usize).min(count - 1));
        known[row * columns + column]
    };
    let isolines = lines.iter().map(|line| {
        let rings = line.geometry().iter();
        let pieces = rings.flat_map(|ring| clipped(ring.0.iter().map(|point| DVec2::new(point.x, point.y)), &within));
        let pieces = pieces.flat_map(|piece| cut(piece, is_known));
        Isoline { level: line.threshold(), pieces: pieces.collect() }
    });
    Ok(isolines.collect())
}

/// Returns the values with each that is not finite replaced by that of a nearest finite one (0 if there is none), so that lines reach the edge
/// of the valid cells and do not run along it.
fn beside_the_unknown(columns: usize, values: &[f64]) -> Vec<f64> {
    let mut filled = values.to_vec();
    let mut queue: VecDeque<usize> = (0..values.len()).filter(|cell| values[*cell].is_finite()).collect();
    while let Some(cell) = queue.pop_front() {
        let column = cell % columns;
        let beside = [
            (column > 0).then(|| cell - 1),
            (column + 1 < columns).then_some(cell + 1),
            cell.checked_sub(columns),
            Some(cell + columns).filter(|below| *below < values.len()),
        ];
        for other in beside.into_iter().flatten() {
            if !filled[other].is_finite() {
                filled[other] = filled[cell];
                queue.push_back(other);
            }
        }
    }
    filled.iter().map(|value| if value.is_finite() { *value } else { 0.0 }).collect()
}

/// Returns the pieces of a line whose segments have their midpoints where `is_known` is true.
fn cut(line: Vec<DVec2>, is_known: impl Fn(DVec2) -> bool) -> Vec<Vec<DVec2>> {
    let mut pieces: Vec<Vec<DVec2>> = Vec::new();
    let mut goes_on = false;
    for step in line.windows(2) {
        let shown = is_known(0.5 * (step[0] + step[1]));
        match pieces.last_mut().filter(|_| goes_on) {
            Some(piece) if shown => piece.push(step[1]),
            _ if shown => pieces.push(step.to_vec()),
            _ => {}
        }
        goes_on = shown;
    }
    pieces
}

/// Returns the pieces of a line that are within a rectangle.
fn clipped(points: impl Iterator<Item = DVec2>, within: &Rectangle) -> Vec<Vec<DVec2>> {
    let mut outline = Outline::default();
    outline.add_clipped(points, within);
    let mut pieces: Vec<Vec<DVec2>> = Vec::new();
    for part in outline.0 {
        match (part, pieces.last_mut()) {
            (Part::Line(to), Some(piece)) => piece.push(to),
            (Part::Move(to), _) => pieces.push(vec![to]),
            _ => {}
        }
    }
    pieces
}

/// Returns the levels in lux for isolines of illuminance between `least` and `greatest`: named values from a tenth of the
/// greatest upwards, or round values where fewer than four of these fit.
pub fn levels_lux(least: f64, greatest: f64) -> Vec<f64> {
    // in the dark end lines are close
    let within = |level: &f64| *level > least.max(0.1 * greatest) && *level < greatest;
    let named: Vec<f64> = NAMED_LUX.into_iter().filter(within).collect();
    if named.len() >= FEWEST {
        return named;
    }
    levels(least, greatest)
}

/// Returns round values strictly between two ends.
pub fn levels(least: f64, greatest: f64) -> Vec<f64> {
    let ticks = super::ticks::linear(least, greatest, 6, super::ticks::Steps::Decimal);
    ticks.into_iter().map(|tick| tick.value).filter(|level| *level > least && *level < greatest).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No line runs along the edge of the known cells of an even slope, above, below or beside them.
    #[test]
    fn lines_end_at_unknown_cells() {
        let [columns, rows] = [12, 10];
        let is_known = |cell: usize| (2..9).contains(&(cell % columns)) && (3..8).contains(&(cell / columns));
        let slope = |cell: usize| if is_known(cell) { 10.0 + (cell % columns) as f64 } else { f64::NAN };
        let values: Vec<f64> = (0..columns * rows).map(slope).collect();
        let lines = isolines([columns, rows], &values, &[13.5, 15.5]).unwrap();
        for line in lines {
            let x = line.level - 10.0 + 0.5;
            assert_eq!(line.pieces.len(), 1, "{line:?}");
            assert!(line.pieces[0].iter().all(|point| (point.x - x).abs() < 1e-6 && point.y > 2.0 && point.y < 9.0));
        }
    }

    #[test]
    fn lines_of_a_paraboloid_are_circles() {
        const CELLS: usize = 101;
        let centre = DVec2::splat(50.5);
        let value = |cell: usize| {
            let point = DVec2::new((cell % CELLS) as f64 + 0.5, (cell / CELLS) as f64 + 0.5);
            (point - centre).length_squared()
        };
        let values: Vec<f64> = (0..CELLS * CELLS).map(value).collect();
        let radii = [20.0f64, 33.3, 45.0];
        let lines = isolines([CELLS; 2], &values, &radii.map(|radius| radius * radius)).unwrap();
        for (line, radius) in lines.iter().zip(radii) {
            assert_eq!(line.pieces.len(), 1, "one circle");
            let points = &line.pieces[0];
            assert!(points.len() > 100 && points.first() == points.last());
            for point in points {
                let found = point.distance(centre);
                assert!((found / radius - 1.0).abs() < 1e-3, "{found} instead of {radius}");
            }
        }
    }

    #[test]
    fn lines_of_a_slope_end_at_the_edges() {
        let values: Vec<f64> = (0..20).map(|cell| f64::from(cell % 5)).collect();
        let lines = isolines([5, 4], &values, &[1.25, 9.0]).unwrap();
        let mut ends = lines[0].pieces.concat();
        ends.sort_by(|a, b| a.y.total_cmp(&b.y));
        assert!(ends.iter().all(|point| (point.x - 1.75).abs() < 1e-12), "{ends:?}");
        assert_eq!([ends[0].y, ends[ends.len() - 1].y], [0.0, 4.0]);
        assert_eq!((lines[0].pieces.len(), lines[1].pieces.len()), (1, 0));
        assert!(isolines([5, 4], &values[1..], &[1.0]).is_err());
        assert!(isolines([1, 1], &[f64::NAN], &[1.0]).unwrap()[0].pieces.is_empty());
    }

    #[test]
    fn levels_are_those_that_people_name() {
        assert_eq!(levels_lux(51.0, 484.0), [100.0, 150.0, 200.0, 300.0]);
        assert_eq!(levels_lux(200.0, 260.0), [210.0, 220.0, 230.0, 240.0, 250.0]);
        assert_eq!(levels_lux(0.0, 342.0), [50.0, 100.0, 150.0, 200.0, 300.0]);
        assert_eq!(levels_lux(0.0, 4000.0), [500.0, 750.0, 1000.0, 1500.0, 2000.0, 3000.0]);
        assert_eq!(levels_lux(5.0, 5.0), [0.0; 0]);
    }
}
