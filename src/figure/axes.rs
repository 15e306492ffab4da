//! Pair of axes with ticks, titles and grid lines, and the map from values to positions in a figure.

use glam::DVec2;

use super::colour::Colour;
use super::drawing::{Anchor, Drawing, Line, Type};
use super::letters;
use super::outline::{Outline, Rectangle};
use super::ticks::{self, Steps, Tick};

const LABEL_SIZE: f64 = 12.0;
const TITLE_SIZE: f64 = 13.0;

/// Returns the number of intervals between the ticks of an axis with a length in pixels.
pub fn ticks_in(pixels: f64) -> usize {
    let least = if pixels < LEAST_FOR_TWO { 1.0 } else { 2.0 };
    (pixels / 60.0).clamp(least, 10.0) as usize
}

/// Length in pixels of an axis from which on the labels of three ticks have room.
const LEAST_FOR_TWO: f64 = 30.0;

/// Returns the length in pixels by which a title reaches beyond either end of its axis, of a length in pixels.
pub fn beyond_ends(title: &str, pixels: f64) -> f64 {
    0.5 * (letters::width(title, TITLE_SIZE) - pixels).max(0.0)
}

/// Room for labels and title left of the axes, in pixels.
pub const LEFT: f64 = 76.0;

/// Room for labels and title below the axes, in pixels.
pub const BELOW: f64 = 46.0;

/// Spacing of values along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spacing {
    /// Linear: equal differences have equal lengths.
    Linear,
    /// Logarithmic: equal ratios have equal lengths; both ends are above zero.
    Logarithmic,
}

/// Axis of a plot.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Name of the quantity with its unit.
    pub title: String,
    /// Value at the left or lower end.
    pub from: f64,
    /// Value at the right or upper end.
    pub to: f64,
    /// Linear or logarithmic spacing.
    pub spacing: Spacing,
    /// Ticks with grid lines and labels.
    pub ticks: Vec<Tick>,
}

impl Axis {
    /// Creates a linear axis with at most `most` intervals between its ticks.
    pub fn linear(title: impl Into<String>, [from, to]: [f64; 2], most: usize, steps: Steps) -> Self {
        let ticks = ticks::linear(from, to, most, steps);
        Self { title: title.into(), from, to, spacing: Spacing::Linear, ticks }
    }

    /// Creates a logarithmic axis; `unit` follows each number.
    pub fn logarithmic(title: impl Into<String>, [from, to]: [f64; 2], unit: &str) -> Self {
        let ticks = ticks::logarithmic(from, to, unit);
        Self { title: title.into(), from, to, spacing: Spacing::Logarithmic, ticks }
    }

    /// Returns the position of a value along the axis: 0 at the left or lower end, 1 at the other.
    fn share(&self, value: f64) -> f64 {
        match self.spacing {
            Spacing::Linear => (value - self.from) / (self.to - self.from),
            Spacing::Logarithmic => libm::log(value / self.from) / libm::log(self.to / self.from),
        }
    }
}

/// Returns the ends of a logarithmic axis that contains all values: 1, 2 or 5 times a power of ten, at least a factor of 4
/// apart. Values without a logarithm (or beyond 1e-100..1e100) are left out; if none remains, the axis is around `otherwise`.
pub fn logarithmic_ends(values: impl Iterator<Item = f64>, otherwise: f64) -> [f64; 2] {
    // beyond these limits the axis itself would overflow
    let usable = values.filter(|value| (1e-100..1e100).contains(value));
    let [low, high] = usable.fold([f64::INFINITY, 0.0f64], |[low, high], value| [low.min(value), high.max(value)]);
    let [low, high] = if high > 0.0 { [low, high] } else { [otherwise, otherwise] };
    let round = |value: f64, multiples: [f64; 4], fits: fn(f64, f64) -> bool| {
        let decade = libm::pow(10.0, libm::log10(value).floor());
        multiples.into_iter().map(|multiple| multiple * decade).find(|end| fits(*end, value)).unwrap_or(value)
    };
    let mut from = round(low, [5.0, 2.0, 1.0, 0.5], |end, value| end <= value * (1.0 + 1e-9));
    let mut to = round(high, [1.0, 2.0, 5.0, 10.0], |end, value| end >= value * (1.0 - 1e-9));
    while to / from < 4.0 {
        from = round(0.7 * from, [5.0, 2.0, 1.0, 0.5], |end, value| end <= value * (1.0 + 1e-9));
        to = round(1.4 * to, [1.0, 2.0, 5.0, 10.0], |end, value| end >= value * (1.0 - 1e-9));
    }
    [from, to]
}

/// Pair of axes around a rectangle of a figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Axes {
    /// Rectangle of the plot area.
    pub within: Rectangle,
    /// Lower axis.
    pub x: Axis,
    /// Left axis.
    pub y: Axis,
}

impl Axes {
    /// Returns the position of a pair of values, which may be outside of the axes; not finite where the logarithm does not
    /// exist.
    pub fn at(&self, x: f64, y: f64) -> DVec2 {
        let Rectangle { from, to } = self.within;
        DVec2::new(from.x + self.x.share(x) * (to.x - from.x), to.y + self.y.share(y) * (from.y - to.y))
    }

    /// Returns the parts of a polyline through pairs of values that are within the axes.
    pub fn line(&self, points: impl IntoIterator<Item = (f64, f64)>) -> Outline {
        let mut outline = Outline::default();
        outline.add_clipped(points.into_iter().map(|(x, y)| self.at(x, y)), &self.within);
        outline
    }

    /// Returns the positions of those pairs of values that are within the axes.
    pub fn places(&self, points: impl IntoIterator<Item = (f64, f64)>) -> Vec<DVec2> {
        points.into_iter().map(|(x, y)| self.at(x, y)).filter(|place| self.within.contains(*place)).collect()
    }

    /// Draws the frame of the figure again, where something was drawn over it.
    pub fn draw_frame(&self, drawing: &mut Drawing) {
        drawing.line(Outline::rectangle(self.within.from, self.within.to), Line::new(Colour::Muted, 1.0));
    }

    /// Draws grid lines, frame, labels and titles; items drawn later cover them.
    pub fn draw(&self, drawing: &mut Drawing) {
        let Rectangle { from, to } = self.within;
        let mut faint = Outline::default();
        let mut grid = Outline::default();
        for tick in &self.x.ticks {
            let x = self.at(tick.value, self.y.from).x;
            let line = if tick.label.is_some() { &mut grid } else { &mut faint };
            line.add_polyline([DVec2::new(x, from.y), DVec2::new(x, to.y)]);
        }
        for tick in &self.y.ticks {
            let y = self.at(self.x.from, tick.value).y;
            let line = if tick.label.is_some() { &mut grid } else { &mut faint };
            line.add_polyline([DVec2::new(from.x, y), DVec2::new(to.x, y)]);
        }
        drawing.line(faint, Line::new(Colour::Faint, 0.5));
        drawing.line(grid, Line::new(Colour::Faint, 1.0));
        self.draw_frame(drawing);
        let label = Type::new(LABEL_SIZE, Colour::Ink);
        for tick in &self.x.ticks {
            let at = DVec2::new(self.at(tick.value, self.y.from).x, to.y + 18.0);
            if let Some(text) = &tick.label {
                drawing.text(at, text.as_str(), label.anchored(Anchor::Middle));
            }
        }
        for tick in &self.y.ticks {
            let at = DVec2::new(from.x - 8.0, self.at(self.x.from, tick.value).y);
            if let Some(text) = &tick.label {
                drawing.text_centred(at, text.as_str(), label.anchored(Anchor::End));
            }
        }
        let title = Type::new(TITLE_SIZE, Colour::Ink).anchored(Anchor::Middle);
        let middle = from.midpoint(to);
        drawing.text(DVec2::new(middle.x, to.y + 39.0), self.x.title.as_str(), title);
        drawing.text(DVec2::new(from.x - 58.0, middle.y), self.y.title.as_str(), title.upwards());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_of_logarithmic_axes_are_round() {
        for (values, ends) in [
            (vec![0.013, 4.1], [0.01, 5.0]),
            (vec![1.0, 1.0], [0.5, 2.0]),
            (vec![2.0, 2.0, f64::NAN, -1.0], [1.0, 5.0]),
            (vec![], [0.05, 0.2]),
            (vec![0.0, f64::INFINITY], [0.05, 0.2]),
        ] {
            let found = logarithmic_ends(values.iter().copied(), 0.1);
            assert!(found.iter().zip(ends).all(|(a, b)| (a / b - 1.0).abs() < 1e-9), "{values:?}: {found:?}");
        }
    }

    #[test]
    fn values_have_their_places() {
        let x = Axis::linear("x", [0.0, 10.0], 5, Steps::Decimal);
        let y = Axis::logarithmic("y", [0.01, 1.0], "");
        let axes = Axes { within: Rectangle::new(100.0, 50.0, 200.0, 150.0), x, y };
        assert!(axes.at(5.0, 0.1).distance(DVec2::new(150.0, 100.0)) < 1e-9);
        assert!(axes.at(0.0, 1.0).distance(DVec2::new(100.0, 50.0)) < 1e-9);
        assert_eq!(axes.places([(5.0, 0.1), (11.0, 0.1), (5.0, 0.0)]).len(), 1);
        assert_eq!(axes.line([(0.0, 0.0), (1.0, 0.0)]).0, []);
    }
}
