//! False-colour pictures of luminance and illuminance, with a labelled scale.

use colorous::Gradient;

use super::raster::LETTER_PX;
use super::scale::{Scale, label};
use super::{Image, OutputError, Raster};

const PAPER: [u8; 3] = [255, 255, 255];
const INK: [u8; 3] = [20, 20, 20];
/// What is not a number.
const INVALID: [u8; 3] = [255, 0, 255];

const MARGIN_PX: usize = 12;
const BAR_PX: usize = 24;
const TICK_PX: usize = 6;

/// Height that a scale needs: its unit, and room for the labels of ten ticks.
const LEAST_HEIGHT_PX: usize = 240;

/// About the longer side of a heat map.
const HEAT_MAP_PX: usize = 480;

/// A luminance image in false colours (turbo) with a scale in cd/m2, logarithmic when it spans more than 100 : 1.
///
/// One pixel in two thousand at either end is beyond the scale, so that no single one stretches it.
pub fn luminance(image: Image) -> Result<Raster, OutputError> {
    image.check()?;
    let luminances = image.luminances();
    let scale = Scale::over(&luminances, 0.0005);
    let [width, height] = image.size_px;
    let mut picture = Raster::filled(width, height, PAPER);
    for (pixel, y) in luminances.iter().enumerate() {
        picture.set(pixel % width, pixel / width, colour(colorous::TURBO, &scale, *y));
    }
    Ok(with_scale(&picture, &scale, colorous::TURBO, "cd/m2"))
}

/// A heat map (viridis) of the illuminance of a grid of `cells` along x and y, north up, with a scale in lux.
pub fn illuminance(cells: [usize; 2], illuminance_lux: &[f64]) -> Result<Raster, OutputError> {
    let [columns, rows] = cells;
    if columns == 0 || rows == 0 || columns.checked_mul(rows) != Some(illuminance_lux.len()) {
        return Err(OutputError::Size { values: illuminance_lux.len(), width: columns, height: rows, channels: 1 });
    }
    let scale = Scale::over(illuminance_lux, 0.0);
    let cell = (HEAT_MAP_PX / columns.max(rows)).max(1);
    let mut picture = Raster::filled(columns * cell, rows * cell, PAPER);
    for (sensor, value) in illuminance_lux.iter().enumerate() {
        let (column, row) = (sensor % columns, rows - 1 - sensor / columns);
        let colour = colour(colorous::VIRIDIS, &scale, *value);
        picture.fill(column * cell..(column + 1) * cell, row * cell..(row + 1) * cell, colour);
    }
    Ok(with_scale(&picture, &scale, colorous::VIRIDIS, "lux"))
}

fn colour(gradient: Gradient, scale: &Scale, value: f64) -> [u8; 3] {
    if value.is_nan() {
        return INVALID;
    }
    gradient.eval_continuous(scale.position(value)).into_array()
}

/// The picture with the scale to its right.
fn with_scale(picture: &Raster, scale: &Scale, gradient: Gradient, unit: &str) -> Raster {
    let ticks = scale.ticks();
    let labels: Vec<String> = ticks.iter().map(|tick| label(*tick)).collect();
    let letters = labels.iter().map(String::len).max().unwrap_or(0);
    let bar_left = picture.width + MARGIN_PX;
    let label_left = bar_left + BAR_PX + TICK_PX + 4;
    let right = (label_left + letters * LETTER_PX).max(bar_left + unit.len() * LETTER_PX);
    let mut whole = Raster::filled(right + MARGIN_PX, picture.height.max(LEAST_HEIGHT_PX), PAPER);
    for y in 0..picture.height {
        for x in 0..picture.width {
            whole.set(x, y, picture.get(x, y));
        }
    }
    whole.write(bar_left, MARGIN_PX, unit, INK);
    let top = MARGIN_PX + 2 * LETTER_PX;
    let bottom = whole.height - MARGIN_PX - LETTER_PX / 2;
    for y in top..bottom {
        let position = (bottom - 1 - y) as f64 / (bottom - 1 - top) as f64;
        let colour = gradient.eval_continuous(position).into_array();
        whole.fill(bar_left..bar_left + BAR_PX, y..y + 1, colour);
    }
    for (tick, label) in ticks.iter().zip(&labels) {
        let y = bottom - 1 - (scale.position(*tick) * (bottom - 1 - top) as f64).round() as usize;
        whole.fill(bar_left + BAR_PX..bar_left + BAR_PX + TICK_PX, y..y + 1, INK);
        whole.write(label_left, y - LETTER_PX / 2, label, INK);
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn north_is_up_and_west_is_left() {
        // 2 x 2 cells: south-west dark, north-east bright
        let map = illuminance([2, 2], &[10.0, 20.0, 30.0, 40.0]).unwrap();
        let at = |x: usize, y: usize| map.get(x, y);
        let expected = |position: f64| colorous::VIRIDIS.eval_continuous(position).into_array();
        assert_eq!(at(10, 470), expected(0.0));
        assert_eq!(at(470, 10), expected(1.0));
        assert_eq!(at(10, 10), expected(2.0 / 3.0));
    }

    #[test]
    fn drawn_for_every_size_and_number() {
        for cells in [[1, 1], [1, 1000], [300, 1], [9, 9]] {
            assert!(illuminance(cells, &vec![1.0; cells[0] * cells[1]]).is_ok());
        }
        assert!(illuminance([2, 2], &[0.0; 4]).is_ok());
        assert!(illuminance([2, 2], &[f64::NAN, f64::INFINITY, -1.0, 1e300]).is_ok());
        assert!(illuminance([2, 2], &[0.0; 3]).is_err());
        let values: Vec<f64> = (0..4096).map(|k| 1.01f64.powi(k / 2)).collect();
        let image = Image { size_px: [64, 64], channels: 1, values: &values };
        let picture = luminance(image).unwrap();
        assert!(picture.width > 64 && picture.height >= LEAST_HEIGHT_PX);
        // the labels are there: ink right of the bar
        let ink = (64..picture.width).filter(|x| (0..picture.height).any(|y| picture.get(*x, y) == INK)).count();
        assert!(ink > 3 * LETTER_PX / 2);
    }
}
