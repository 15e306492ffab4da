//! Colour scales: palettes, and the labelled bar that explains them.

use std::sync::OnceLock;

use glam::DVec2;

use super::axes::Spacing;
use super::colour::Colour;
use super::drawing::{Drawing, Line, Type};
use super::outline::{Outline, Rectangle};
use super::ticks::{self, Steps, Tick};
use crate::output::Raster;

/// Colour of values that are not numbers.
const INVALID: [u8; 3] = [255, 0, 255];

/// Number of rows of pixels in a colour bar.
const BAR_STEPS: usize = 256;

/// Number of steps of the look-up table of a palette: its colours differ by at most 2 of 255 from those of any position.
const COLOURS_OF_PALETTE: usize = 1024;

const LABEL_SIZE: f64 = 12.0;

/// Width of a colour bar in pixels.
pub const BAR_WIDTH: f64 = 18.0;

/// Room for the labels beside a colour bar, in pixels.
pub const LABEL_WIDTH: f64 = 62.0;

/// Colours from the low to the high end of a scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Palette {
    /// Dark blue over green to yellow: perceptually uniform, and legible with colour vision deficiencies.
    Viridis,
    /// Blue over green and yellow to red: many hues, as is usual in lighting.
    Turbo,
    /// Black over violet and orange to light yellow.
    Inferno,
    /// Black to white.
    Grey,
    /// Blue over white to red, for differences.
    BlueRed,
}

impl Palette {
    /// Returns the colour at a position 0..1, from a table of 1024 steps.
    pub fn colour(self, position: f64) -> [u8; 3] {
        static COLOURS: [OnceLock<Vec<[u8; 3]>>; 5] = [const { OnceLock::new() }; 5];
        let colours = COLOURS[self as usize].get_or_init(|| {
            (0..=COLOURS_OF_PALETTE).map(|k| self.computed(k as f64 / COLOURS_OF_PALETTE as f64)).collect()
        });
        colours[(position.clamp(0.0, 1.0) * COLOURS_OF_PALETTE as f64).round() as usize]
    }

    /// Computes the colour at a position 0..=1 exactly.
    fn computed(self, position: f64) -> [u8; 3] {
        match self {
            Self::Viridis => colorous::VIRIDIS.eval_continuous(position).into_array(),
            Self::Turbo => colorous::TURBO.eval_continuous(position).into_array(),
            Self::Inferno => colorous::INFERNO.eval_continuous(position).into_array(),
            Self::Grey => [(255.0 * position).round() as u8; 3],
            Self::BlueRed => colorous::RED_BLUE.eval_continuous(1.0 - position).into_array(),
        }
    }
}

/// Map from values to colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColourScale {
    /// Value of the low end; above zero on a logarithmic scale.
    pub from: f64,
    /// Value of the high end, above the low one.
    pub to: f64,
    /// Linear or logarithmic spacing of the values.
    pub spacing: Spacing,
    /// Palette of the scale.
    pub palette: Palette,
}

impl ColourScale {
    /// Creates a linear scale from zero to `to`, or to 1 if this is not finite and above zero.
    pub fn from_zero(to: f64, palette: Palette) -> Self {
        let to = if to.is_finite() && to > 0.0 { to } else { 1.0 };
        Self { from: 0.0, to, spacing: Spacing::Linear, palette }
    }

    /// Creates a linear scale of differences, from minus to plus `magnitude`, or to 1 if this is not finite and above zero.
    pub fn around_zero(magnitude: f64) -> Self {
        let to = if magnitude.is_finite() && magnitude > 0.0 { magnitude } else { 1.0 };
        Self { from: -to, to, spacing: Spacing::Linear, palette: Palette::BlueRed }
    }

    /// Returns the position of a value, clamped to 0..1; 0 for NaN.
    pub fn position(&self, value: f64) -> f64 {
        let position = match self.spacing {
            Spacing::Linear => (value - self.from) / (self.to - self.from),
            Spacing::Logarithmic => libm::log(value / self.from) / libm::log(self.to / self.from),
        };
        if position.is_nan() { 0.0 } else { position.clamp(0.0, 1.0) }
    }

    /// Returns the colour of a value; NaN has a magenta that no palette contains.
    pub fn colour(&self, value: f64) -> [u8; 3] {
        if value.is_nan() { INVALID } else { self.palette.colour(self.position(value)) }
    }

    /// Returns the values with labels along the scale.
    pub fn ticks(&self) -> Vec<Tick> {
        match self.spacing {
            Spacing::Linear => ticks::linear(self.from, self.to, 6, Steps::Decimal),
            Spacing::Logarithmic => ticks::logarithmic(self.from, self.to, ""),
        }
    }

    /// Draws the scale as an upright bar with its unit above; `place` is the bar alone.
    pub fn draw(&self, drawing: &mut Drawing, place: Rectangle, unit: &str) {
        let mut raster = Raster::filled(1, BAR_STEPS, [0; 3]);
        for row in 0..BAR_STEPS {
            let position = 1.0 - (row as f64 + 0.5) / BAR_STEPS as f64;
            raster.set(0, row, self.palette.colour(position));
        }
        drawing.picture(place, raster);
        drawing.line(Outline::rectangle(place.from, place.to), Line::new(Colour::Muted, 1.0));
        let label = Type::new(LABEL_SIZE, Colour::Ink);
        for tick in self.ticks() {
            let Some(text) = tick.label else { continue };
            let y = place.to.y - self.position(tick.value) * place.size().y;
            let at = DVec2::new(place.to.x, y);
            drawing.line(Outline::polyline([at, at + DVec2::new(4.0, 0.0)]), Line::new(Colour::Muted, 1.0));
            drawing.text_centred(at + DVec2::new(8.0, 0.0), text, label);
        }
        drawing.text(place.from - DVec2::new(0.0, 11.0), unit, label);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scale_of_600_lux_has_the_ticks_that_people_write() {
        let labels = |scale: ColourScale| {
            let labels = scale.ticks().into_iter().filter_map(|tick| tick.label);
            labels.collect::<Vec<_>>().join(" ")
        };
        assert_eq!(labels(ColourScale::from_zero(600.0, Palette::Viridis)), "0 100 200 300 400 500 600");
        assert_eq!(labels(ColourScale::around_zero(2.3)), "−2 −1 0 1 2");
    }

    #[test]
    fn colours_that_are_looked_up_are_those_of_the_palette() {
        for palette in [Palette::Viridis, Palette::Turbo, Palette::Inferno, Palette::Grey, Palette::BlueRed] {
            for k in 0..=5000 {
                let position = f64::from(k) / 5000.0;
                let (found, exact) = (palette.colour(position), palette.computed(position));
                assert!(
                    found.iter().zip(exact).all(|(a, b)| a.abs_diff(b) <= 2),
                    "{palette:?} {position}: {found:?} {exact:?}"
                );
            }
        }
    }

    #[test]
    fn differences_are_white_at_zero_and_red_above() {
        let scale = ColourScale::around_zero(2.0);
        let [below, zero, above] = [-2.0, 0.0, 2.0].map(|value| scale.colour(value));
        assert!(zero.iter().all(|channel| *channel > 235), "{zero:?}");
        assert!(below[2] > below[0] && above[0] > above[2]);
        assert_eq!(scale.colour(f64::NAN), INVALID);
        assert_eq!(scale.colour(9.0), above);
    }
}
