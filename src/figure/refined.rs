//! Smooth map of a grid: values between the centres of its cells.

/// Number of cells along the longer side from which on a map looks smooth.
const FINE: usize = 160;

/// Largest number of parts of a cell along one axis.
const MOST_PARTS: usize = 16;

/// Rings of cells around the known ones that are extrapolated: as far as an interpolation reaches.
const RINGS: usize = 3;

/// Interpolates a grid of `cells` columns and rows to a finer one, each cell of which lies within one of the grid, by cubic convolution
/// (Keys 1981, a = -1/2) between the centres. Cells whose value is not finite stay so; they do not count. No value leaves the range of the
/// sixteen around it.
pub fn refined([columns, rows]: [usize; 2], values: &[f64]) -> ([usize; 2], Vec<f64>) {
    let parts = FINE.div_ceil(columns.max(rows).max(1)).clamp(1, MOST_PARTS);
    if parts == 1 || columns * rows != values.len() {
        return ([columns, rows], values.to_vec());
    }
    let filled = extrapolated(columns, rows, values);
    let at = |column: isize, row: isize| {
        let along_row = |row: usize| beyond(column, columns, |column| filled[row * columns + column]);
        beyond(row, rows, along_row)
    };
    // place of a part's centre: the cell whose centre is before it, and the fraction of the way to the next centre
    let place = |part: usize| {
        let place = (part as f64 + 0.5) / parts as f64 - 0.5;
        (place.floor() as isize, place - place.floor())
    };
    let mut fine = Vec::with_capacity(columns * rows * parts * parts);
    for row in 0..rows * parts {
        let (before_y, y) = place(row);
        for column in 0..columns * parts {
            if !values[row / parts * columns + column / parts].is_finite() {
                fine.push(f64::NAN);
                continue;
            }
            let (before_x, x) = place(column);
            let (mut sum, mut low, mut high) = (0.0, f64::INFINITY, f64::NEG_INFINITY);
            for (j, of_row) in weights(y).into_iter().enumerate() {
                for (i, of_column) in weights(x).into_iter().enumerate() {
                    let value = at(before_x + i as isize - 1, before_y + j as isize - 1);
                    sum += of_row * of_column * value;
                    (low, high) = (low.min(value), high.max(value));
                }
            }
            fine.push(sum.clamp(low.min(high), high));
        }
    }
    ([columns * parts, rows * parts], fine)
}

/// Returns the weights of the values at -1, 0, 1 and 2 for a place between 0 and 1 (Keys 1981).
fn weights(t: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [-0.5 * t + t2 - 0.5 * t3, 1.0 - 2.5 * t2 + 1.5 * t3, 0.5 * t + 2.0 * t2 - 1.5 * t3, -0.5 * t2 + 0.5 * t3]
}

/// Returns the value at an index of a row of `count` values, extrapolated linearly beyond its ends.
fn beyond(index: isize, count: usize, value: impl Fn(usize) -> f64) -> f64 {
    let last = count - 1;
    let (end, over) = match index {
        _ if index < 0 => (0, index.unsigned_abs()),
        _ if index as usize > last => (last, index as usize - last),
        _ => return value(index as usize),
    };
    let inner = if end == 0 { 1.min(last) } else { last.saturating_sub(1) };
    value(end) + over as f64 * (value(end) - value(inner))
}

/// Returns the values with those around the finite ones extrapolated: each is the mean of its neighbours that are known.
fn extrapolated(columns: usize, rows: usize, values: &[f64]) -> Vec<f64> {
    let mut filled = values.to_vec();
    for _ in 0..RINGS {
        let known = filled.clone();
        for cell in (0..filled.len()).filter(|cell| !known[*cell].is_finite()) {
            let (column, row) = (cell % columns, cell / columns);
            let near = |place: usize, count: usize| place.saturating_sub(1)..(place + 2).min(count);
            let around =
                near(row, rows).flat_map(|row| near(column, columns).map(move |column| row * columns + column));
            let (sum, count) = around
                .map(|other| known[other])
                .filter(|value| value.is_finite())
                .fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
            if count > 0 {
                filled[cell] = sum / f64::from(count);
            }
        }
    }
    // farther ones are read by no cell with a value
    filled.iter().map(|value| if value.is_finite() { *value } else { 0.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plane is interpolated exactly, up to the edge, and a parabola between inner centres.
    #[test]
    fn planes_and_parabolas_are_exact() {
        let (columns, rows) = (9, 6);
        let centre = |cell: usize| ((cell % columns) as f64 + 0.5, (cell / columns) as f64 + 0.5);
        for square in [0.0, 0.3] {
            let function = |x: f64, y: f64| 20.0 + 2.0 * x - y + square * x * x;
            let values: Vec<f64> = (0..columns * rows).map(|cell| function(centre(cell).0, centre(cell).1)).collect();
            let ([fine_columns, fine_rows], fine) = refined([columns, rows], &values);
            assert_eq!((fine_columns, fine_rows, fine.len()), (144, 96, 144 * 96));
            for (place, value) in fine.iter().enumerate() {
                let (x, y) = ((place % 144) as f64 + 0.5, (place / 144) as f64 + 0.5);
                let (x, y) = (x / 16.0, y / 16.0);
                let inner = square == 0.0 || (1.5..7.5).contains(&x);
                assert!(!inner || (value - function(x, y)).abs() < 1e-9, "({x}, {y}): {value}");
            }
        }
    }

    /// Cells without a value stay so, change no value that is equal around them, and no value is new.
    #[test]
    fn unknown_cells_stay_unknown() {
        let mut values = vec![5.0; 20];
        values[7] = f64::NAN;
        values[19] = f64::NAN;
        let ([columns, _], fine) = refined([5, 4], &values);
        let parts = columns / 5;
        for (place, value) in fine.iter().enumerate() {
            let cell = place / columns / parts * 5 + place % columns / parts;
            assert_eq!(value.is_nan(), cell == 7 || cell == 19);
            assert!(value.is_nan() || (value - 5.0).abs() < 1e-12);
        }
        let (cells, one) = refined([1, 1], &[3.0]);
        assert!(cells == [16, 16] && one.iter().all(|value| (value - 3.0).abs() < 1e-12));
        let (_, step) = refined([4, 1], &[0.0, 0.0, 100.0, 100.0]);
        assert!(step.iter().all(|value| (0.0..=100.0).contains(value)));
    }
}
