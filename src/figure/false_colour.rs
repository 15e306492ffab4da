//! False colours in pixels, with a labelled scale, for montages of pictures.

use super::span::{Scale, label};
use super::words::{LINE_PX, width_px, write};
use crate::output::{OutputError, Raster, percentile};

const PAPER: [u8; 3] = [255, 255, 255];
const INK: [u8; 3] = [20, 20, 20];
/// Colour of values that are not numbers.
const INVALID: [u8; 3] = [255, 0, 255];

const MARGIN_PX: usize = 12;
const BAR_PX: usize = 24;
const TICK_PX: usize = 6;

/// Smallest height of a picture with a scale in pixels: the unit, and room for the labels of ten ticks.
const LEAST_HEIGHT_PX: usize = 240;

/// Colours on one scale, for one picture, or for several that are compared.
#[derive(Clone, Copy, Debug)]
pub struct FalseColours {
    scale: Scale,
    /// Map from positions 0..1 to colours.
    gradient: fn(f64) -> [u8; 3],
    unit: &'static str,
}

impl FalseColours {
    /// Creates a viridis scale over all of `illuminance_lux`.
    pub fn illuminance(illuminance_lux: &[f64]) -> Self {
        Self { scale: Scale::over(illuminance_lux, 0.0), gradient: viridis, unit: "lux" }
    }

    /// Creates a viridis scale from zero to `highest_lux`; greater values have the colour of its upper end.
    pub fn illuminance_up_to(highest_lux: f64) -> Self {
        Self { scale: Scale { lowest: 0.0, highest: highest_lux, logarithmic: false }, gradient: viridis, unit: "lux" }
    }

    /// Creates a turbo scale over `values` that are not negative, without the fraction `trim` (0..0.5) of lowest and of highest
    /// values.
    pub fn magnitudes(values: &[f64], trim: f64, unit: &'static str) -> Self {
        Self { scale: Scale::over(values, trim), gradient: turbo, unit }
    }

    /// Creates a scale from blue (below zero) over white to red (above); the fraction `trim` of the largest magnitudes is
    /// clipped.
    pub fn differences(values: &[f64], trim: f64, unit: &'static str) -> Self {
        let magnitudes = values.iter().map(|value| value.abs());
        let highest = percentile(magnitudes, 1.0 - trim).filter(|highest| *highest > 0.0).unwrap_or(1.0);
        Self { scale: Scale { lowest: -highest, highest, logarithmic: false }, gradient: blue_red, unit }
    }

    /// Paints one pixel per value, top row first.
    pub fn paint(&self, size_px: [usize; 2], values: &[f64]) -> Result<Raster, OutputError> {
        let [width, height] = size_px;
        if width == 0 || height == 0 || width.checked_mul(height) != Some(values.len()) {
            return Err(OutputError::Size { values: values.len(), width, height, channels: 1 });
        }
        let mut picture = Raster::filled(width, height, PAPER);
        for (pixel, value) in values.iter().enumerate() {
            picture.set(pixel % width, pixel / width, self.colour(*value));
        }
        Ok(picture)
    }

    /// Paints one pixel per sensor of a grid, north up.
    pub fn heat_map(&self, cells: [usize; 2], values: &[f64]) -> Result<Raster, OutputError> {
        let northern_first: Vec<f64> = values.rchunks(cells[0].max(1)).flatten().copied().collect();
        self.paint(cells, &northern_first)
    }

    fn colour(&self, value: f64) -> [u8; 3] {
        if value.is_nan() { INVALID } else { (self.gradient)(self.scale.position(value)) }
    }

    /// Returns the picture with the scale to its right.
    pub fn with_scale(&self, picture: &Raster) -> Result<Raster, OutputError> {
        with_scale(picture, &self.scale, self.gradient, self.unit)
    }
}

fn turbo(position: f64) -> [u8; 3] {
    colorous::TURBO.eval_continuous(position).into_array()
}

fn viridis(position: f64) -> [u8; 3] {
    colorous::VIRIDIS.eval_continuous(position).into_array()
}

fn blue_red(position: f64) -> [u8; 3] {
    colorous::RED_BLUE.eval_continuous(1.0 - position).into_array()
}

/// Returns the picture with the scale to its right.
fn with_scale(
    picture: &Raster,
    scale: &Scale,
    gradient: fn(f64) -> [u8; 3],
    unit: &str,
) -> Result<Raster, OutputError> {
    let ticks = scale.ticks();
    let labels: Vec<String> = ticks.iter().map(|tick| label(*tick)).collect();
    let widest = labels.iter().map(|label| width_px(label)).max().unwrap_or(0);
    let bar_left = picture.width + MARGIN_PX;
    let label_left = bar_left + BAR_PX + TICK_PX + 4;
    let right = (label_left + widest).max(bar_left + width_px(unit));
    let mut whole = Raster::filled(right + MARGIN_PX, picture.height.max(LEAST_HEIGHT_PX), PAPER);
    whole.draw(0, 0, picture);
    write(&mut whole, bar_left, MARGIN_PX, unit)?;
    let top = MARGIN_PX + 2 * LINE_PX;
    let bottom = whole.height - MARGIN_PX - LINE_PX / 2;
    for y in top..bottom {
        let position = (bottom - 1 - y) as f64 / (bottom - 1 - top) as f64;
        whole.fill(bar_left..bar_left + BAR_PX, y..y + 1, gradient(position));
    }
    for (tick, label) in ticks.iter().zip(&labels) {
        let y = bottom - 1 - (scale.position(*tick) * (bottom - 1 - top) as f64).round() as usize;
        whole.fill(bar_left + BAR_PX..bar_left + BAR_PX + TICK_PX, y..y + 1, INK);
        write(&mut whole, label_left, y - LINE_PX / 2, label)?;
    }
    Ok(whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn north_is_up_and_west_is_left() {
        // 2 x 2 cells: south-west dark, north-east bright
        let values = [0.0, 20.0, 30.0, 40.0];
        let map = FalseColours::illuminance_up_to(40.0).heat_map([2, 2], &values).unwrap();
        let expected = |position: f64| colorous::VIRIDIS.eval_continuous(position).into_array();
        assert_eq!([map.get(0, 1), map.get(1, 0), map.get(0, 0)], [0.0, 1.0, 0.75].map(expected));
    }

    #[test]
    fn differences_are_white_at_zero_and_red_above() {
        let values = [-2.0, 0.0, 2.0, 1.0];
        let map = FalseColours::differences(&values, 0.0, "").paint([4, 1], &values).unwrap();
        let [below, zero, above, between] = [0, 1, 2, 3].map(|x| map.get(x, 0));
        assert!(zero.iter().all(|channel| *channel > 235), "{zero:?}");
        assert!(below[2] > below[0] && above[0] > above[2] && between[0] > between[2]);
        assert!(FalseColours::differences(&[], 0.0, "").paint([2, 1], &[0.0, f64::NAN]).is_ok());
    }

    #[test]
    fn a_scale_has_its_labels_beside_the_picture() {
        let values: Vec<f64> = (0..4096).map(|k| 1.01f64.powi(k / 2)).collect();
        let colours = FalseColours::magnitudes(&values, 0.0005, "cd/m2");
        let picture = colours.with_scale(&colours.paint([64, 64], &values).unwrap()).unwrap();
        assert!(picture.width > 64 && picture.height >= LEAST_HEIGHT_PX);
        // the labels are there: dark columns right of the ticks
        let begin = 64 + MARGIN_PX + BAR_PX + TICK_PX + 2;
        let is_dark = |x: usize| (0..picture.height).any(|y| picture.get(x, y)[0] < 128);
        assert!((begin..picture.width).filter(|x| is_dark(*x)).count() > 8);
        assert!(colours.paint([64, 63], &values).is_err());
    }
}
