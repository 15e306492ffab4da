//! Temporal map of a year: the days across, the hours of the day upward, and the value of each hour as a colour.

use glam::DVec2;

use super::axes::{self, Axes, Axis, Spacing};
use super::drawing::Drawing;
use super::heading::Heading;
use super::outline::Rectangle;
use super::scale::{BAR_WIDTH, ColourScale, LABEL_WIDTH};
use super::ticks::Tick;
use crate::output::{OutputError, Raster};

/// Size of the map in pixels: two for a day.
const SIZE: DVec2 = DVec2::new(730.0, 288.0);

/// Colour of hours without a value, such as those of the night.
const NO_VALUE: [u8; 3] = [24, 24, 32];

/// Names of the months.
const MONTHS: [&str; 12] = ["Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"];

/// Temporal map of a year.
#[derive(Clone, Debug, PartialEq)]
pub struct TemporalMap {
    /// Title and lines above the figure.
    pub heading: Heading,
    /// Values, day by day and hour by hour of standard time; not a number where there is none.
    pub values: Vec<f64>,
    /// Number of values of a day, at least 1.
    pub per_day: usize,
    /// Months with the number of their first day in the map, from 0.
    pub months: Vec<(u8, usize)>,
    /// Colour scale of the values.
    pub scale: ColourScale,
    /// Unit of the values.
    pub unit: &'static str,
}

impl TemporalMap {
    /// Draws the figure; an error if the values are not those of whole days.
    pub fn draw(&self) -> Result<Drawing, OutputError> {
        let days = self.values.len() / self.per_day.max(1);
        if days == 0 || days * self.per_day != self.values.len() {
            let (values, height) = (self.values.len(), self.per_day);
            return Err(OutputError::Size { values, width: days, height, channels: 1 });
        }
        let bar_left = axes::LEFT + SIZE.x + 24.0;
        let width = bar_left + BAR_WIDTH + LABEL_WIDTH;
        let top = self.heading.height(width) + 14.0;
        let from = DVec2::new(axes::LEFT, top);
        let within = Rectangle { from, to: from + SIZE };
        let mut drawing = Drawing::new(DVec2::new(width, within.to.y + axes::BELOW + 4.0), self.heading.title.as_str());
        self.heading.draw(&mut drawing);
        let month = |(month, day): &(u8, usize)| {
            let name = MONTHS.get(usize::from(*month).wrapping_sub(1)).map(|name| (*name).to_owned());
            Tick { value: *day as f64, label: name }
        };
        let hour = |hour: u32| Tick { value: f64::from(hour), label: Some(hour.to_string()) };
        let axis = |title: &str, to: f64, ticks: Vec<Tick>| Axis {
            title: title.to_owned(),
            from: 0.0,
            to,
            spacing: Spacing::Linear,
            ticks,
        };
        let x = axis("day of the year", days as f64, self.months.iter().map(month).collect());
        let y = axis("hour, standard time", 24.0, (0..=24).step_by(3).map(hour).collect());
        let axes = Axes { within, x, y };
        axes.draw(&mut drawing);
        drawing.picture(within, self.colours(days));
        self.scale.draw(&mut drawing, Rectangle::new(bar_left, top, bar_left + BAR_WIDTH, within.to.y), self.unit);
        Ok(drawing)
    }

    /// Returns a picture of one pixel per value, midnight below.
    fn colours(&self, days: usize) -> Raster {
        let mut raster = Raster::filled(days, self.per_day, NO_VALUE);
        for (number, value) in self.values.iter().enumerate().filter(|(_, value)| value.is_finite()) {
            raster.set(number / self.per_day, self.per_day - 1 - number % self.per_day, self.scale.colour(*value));
        }
        raster
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::scale::Palette;

    fn map(values: Vec<f64>) -> TemporalMap {
        TemporalMap {
            heading: Heading::of("year"),
            values,
            per_day: 24,
            months: vec![(1, 0), (2, 31)],
            scale: ColourScale::from_zero(100.0, Palette::Viridis),
            unit: "lx",
        }
    }

    /// The first hour of the first day is the lowest pixel on the left, and hours without a value are dark.
    #[test]
    fn days_go_right_and_hours_up() {
        let mut values = vec![f64::NAN; 24 * 60];
        values[0] = 100.0;
        let raster = map(values.clone()).colours(60);
        let pixel = |x: usize, y: usize| &raster.pixels[3 * (y * raster.width + x)..][..3];
        assert_eq!(pixel(0, 23), ColourScale::from_zero(100.0, Palette::Viridis).colour(100.0));
        assert_eq!(pixel(0, 22), NO_VALUE);
        let drawing = map(values.clone()).draw().unwrap();
        assert!(drawing.texts().any(|text| text == "Feb"));
        values.pop();
        assert!(map(values).draw().is_err());
    }
}
