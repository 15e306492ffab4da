//! Plots of curves and marks over two axes.

use glam::DVec2;

use super::axes::{self, Axes, Axis, logarithmic_ends};
use super::colour::{Colour, SERIES};
use super::drawing::{Drawing, Line};
use super::heading::{Heading, MARGIN};
use super::legend::{self, Entry, MARK_RADIUS};
use super::outline::{Outline, Rectangle};

const SIZE: DVec2 = DVec2::new(800.0, 500.0);

/// Named series of points of a plot, joined by a line, marked, or both.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Points (x, y) joined in order; empty: no line.
    pub line: Vec<(f64, f64)>,
    /// Points (x, y) marked by circles.
    pub marks: Vec<(f64, f64)>,
    /// Half widths of the marks' intervals along y, drawn as error bars; empty: no bars.
    pub errors: Vec<f64>,
    /// True if the line is dashed, for numbers from other sources.
    pub dashed: bool,
}

impl Series {
    fn look(&self, colour: Colour) -> Line {
        let line = Line::new(colour, 2.0);
        if self.dashed { line.dashed(&[6.0, 4.0]) } else { line }
    }
}

/// Draws series over two axes, with a legend above. Points that are not finite, or outside of the axes, are left out.
pub fn curves(heading: &Heading, series: &[Series], x: Axis, y: Axis) -> Drawing {
    let mut drawing = Drawing::new(SIZE, heading.title.as_str());
    heading.draw(&mut drawing);
    let entries: Vec<Entry> =
        series.iter().zip(SERIES.into_iter().cycle()).map(|(one, colour)| entry(one, colour)).collect();
    let top = heading.height(SIZE.x) + 8.0;
    let width = SIZE.x - axes::LEFT - MARGIN - 8.0;
    legend::draw(&mut drawing, &entries, DVec2::new(axes::LEFT, top), width);
    let above = top + legend::height(&entries, width) + 6.0;
    let within = Rectangle::new(axes::LEFT, above, axes::LEFT + width, SIZE.y - axes::BELOW - 4.0);
    let axes = Axes { within, x, y };
    axes.draw(&mut drawing);
    for (one, colour) in series.iter().zip(SERIES.into_iter().cycle()) {
        drawing.line(axes.line(one.line.iter().copied()), one.look(colour));
        let mut bars = Outline::default();
        for ((x, y), error) in one.marks.iter().zip(&one.errors) {
            bars.add_clipped_line(axes.at(*x, y - error), axes.at(*x, y + error), &within);
        }
        drawing.line(bars, Line::new(colour, 1.0));
        let mut marks = Outline::default();
        for place in axes.places(one.marks.iter().copied()) {
            marks.add_circle(place, MARK_RADIUS);
        }
        drawing.fill(marks, colour, 1.0);
    }
    drawing
}

/// Draws series over two logarithmic axes that contain all of their points.
pub fn logarithmic(heading: &Heading, series: &[Series], x_title: &str, y_title: &str) -> Drawing {
    let points = || series.iter().flat_map(|series| series.line.iter().chain(&series.marks));
    let x = Axis::logarithmic(x_title, logarithmic_ends(points().map(|point| point.0), 1.0), "");
    let y = Axis::logarithmic(y_title, logarithmic_ends(points().map(|point| point.1), 1.0), "");
    curves(heading, series, x, y)
}

fn entry(series: &Series, colour: Colour) -> Entry {
    let line = (!series.line.is_empty()).then(|| series.look(colour));
    let mark = (!series.marks.is_empty()).then_some(colour);
    Entry { name: series.name.clone(), line, mark, area: None }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::svg::svg;
    use crate::figure::ticks::Steps;

    #[test]
    fn curves_are_named_and_have_their_marks() {
        let line: Vec<_> = (1..19).map(|k| (5.0 * f64::from(k), 0.05 * f64::from(k))).collect();
        let marked =
            Series { name: "south".to_owned(), marks: line.clone(), line, errors: vec![0.01; 18], dashed: false };
        let altitude = Axis::linear("altitude of the sun in degrees", [0.0, 90.0], 6, Steps::Sexagesimal);
        let drawing =
            curves(&Heading::of("tube 0"), &[marked], altitude, Axis::linear("T", [0.0, 1.0], 5, Steps::Decimal));
        let texts: Vec<&str> = drawing.texts().collect();
        for text in ["tube 0", "south", "altitude of the sun in degrees", "15", "90", "0.2"] {
            assert!(texts.contains(&text), "{text}: {texts:?}");
        }
    }

    #[test]
    fn lines_from_elsewhere_are_dashed() {
        let one =
            |dashed| Series { name: "a".to_owned(), line: vec![(1.0, 2.0), (3.0, 4.0)], dashed, ..Series::default() };
        let drawn = |dashed| svg(&logarithmic(&Heading::of("t"), &[one(dashed)], "x", "y")).unwrap();
        assert!(drawn(true).contains("stroke-dasharray") && !drawn(false).contains("stroke-dasharray"));
    }

    #[test]
    fn logarithmic_curves_leave_out_what_has_no_logarithm() {
        let line: Vec<_> = (0..6).map(|k| (f64::from(4i32.pow(k)), 0.5f64.powi(k as i32))).collect();
        let bad = vec![(0.0, 1.0), (1.0, f64::NAN)];
        let series = Series { name: "ppm".to_owned(), line, marks: bad, ..Series::default() };
        let svg = svg(&logarithmic(&Heading::of("progress"), &[series], "passes", "error")).unwrap();
        assert!(svg.contains("ppm") && svg.contains("passes") && !svg.contains("NaN"));
        logarithmic(&Heading::default(), &[], "x", "y");
    }
}
