//! Plots of curves as SVG.

use plotters::coord::combinators::IntoLogRange;
use plotters::prelude::{
    BLACK, ChartBuilder, Circle, Color, IntoDrawingArea, LineSeries, PathElement, RGBColor, SVGBackend,
    SeriesLabelPosition, WHITE,
};

use super::OutputError;

const SIZE_PX: (u32, u32) = (800, 500);

/// Colours of two series: blue and vermilion of Okabe and Ito, which every eye tells apart.
const GRIDS: RGBColor = RGBColor(0, 114, 178);
const VIEWS: RGBColor = RGBColor(213, 94, 0);
const GUIDE: RGBColor = RGBColor(120, 120, 120);

/// A named set of points of a plot, joined by a line, marked, or both.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Points (x, y) to be joined, in their order; none: no line.
    pub line: Vec<(f64, f64)>,
    /// Points (x, y) to be marked by circles.
    pub marks: Vec<(f64, f64)>,
}

/// Title and range of an axis.
#[derive(Clone, Copy, Debug)]
pub struct Axis<'a> {
    /// Name of the quantity with its unit.
    pub title: &'a str,
    /// Value at the axis' lower or left end.
    pub from: f64,
    /// Value at the other end.
    pub to: f64,
}

/// The colours of Okabe and Ito, apart for every eye.
const COLOURS: [RGBColor; 6] =
    [GRIDS, VIEWS, RGBColor(0, 158, 115), RGBColor(204, 121, 167), RGBColor(86, 180, 233), GUIDE];

/// Series over linear axes, with a legend on the side that `legend_above` says.
pub fn lines(series: &[Series], x: Axis, y: Axis, legend_above: bool) -> Result<String, OutputError> {
    let mut svg = String::new();
    let mut draw = || -> Result<(), Box<dyn std::error::Error + '_>> {
        let area = SVGBackend::with_string(&mut svg, SIZE_PX).into_drawing_area();
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&area)
            .margin(16)
            .x_label_area_size(44)
            .y_label_area_size(60)
            .build_cartesian_2d(x.from..x.to, y.from..y.to)?;
        chart.configure_mesh().x_desc(x.title).y_desc(y.title).x_labels(10).draw()?;
        for (series, colour) in series.iter().zip(COLOURS.into_iter().cycle()) {
            chart
                .draw_series(LineSeries::new(series.line.iter().copied(), colour.stroke_width(2)))?
                .label(&series.name)
                .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 20, y)], colour.stroke_width(2)));
            chart.draw_series(series.marks.iter().map(|point| Circle::new(*point, 3, colour.filled())))?;
        }
        let position = if legend_above { SeriesLabelPosition::UpperRight } else { SeriesLabelPosition::LowerRight };
        chart
            .configure_series_labels()
            .position(position)
            .border_style(BLACK.mix(0.3))
            .background_style(WHITE.mix(0.8))
            .draw()?;
        area.present()?;
        Ok(())
    };
    draw().map_err(|error| OutputError::Plot(error.to_string()))?;
    Ok(svg)
}

/// Series over two logarithmic axes of whole decades, with a legend where falling series leave room. What is not positive and finite is left out.
pub fn logarithmic(series: &[Series], x_title: &str, y_title: &str) -> Result<String, OutputError> {
    let plottable = |(x, y): &&(f64, f64)| x.is_finite() && y.is_finite() && *x > 0.0 && *y > 0.0;
    let all = || series.iter().flat_map(|series| series.line.iter().chain(&series.marks)).filter(plottable);
    let xs = decades(all().map(|point| point.0), 1.0);
    let ys = decades(all().map(|point| point.1), 1.0);
    let mut svg = String::new();
    let mut draw = || -> Result<(), Box<dyn std::error::Error + '_>> {
        let area = SVGBackend::with_string(&mut svg, SIZE_PX).into_drawing_area();
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&area)
            .margin(16)
            .x_label_area_size(44)
            .y_label_area_size(72)
            .build_cartesian_2d((xs.0..xs.1).log_scale(), (ys.0..ys.1).log_scale())?;
        chart
            .configure_mesh()
            .x_desc(x_title)
            .y_desc(y_title)
            .x_label_formatter(&|value| format!("{value}"))
            .y_label_formatter(&|value| format!("{value}"))
            .draw()?;
        for (series, colour) in series.iter().zip(COLOURS.into_iter().cycle()) {
            let line = series.line.iter().filter(plottable).copied();
            chart
                .draw_series(LineSeries::new(line, colour.stroke_width(2)))?
                .label(&series.name)
                .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 20, y)], colour.stroke_width(2)));
            let marks = series.marks.iter().filter(plottable);
            chart.draw_series(marks.map(|point| Circle::new(*point, 3, colour.filled())))?;
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .border_style(BLACK.mix(0.3))
            .background_style(WHITE.mix(0.8))
            .draw()?;
        area.present()?;
        Ok(())
    };
    draw().map_err(|error| OutputError::Plot(error.to_string()))?;
    Ok(svg)
}

/// Transmission, 0..1, against the altitude of the sun in degrees.
pub fn transmission(series: &[Series]) -> Result<String, OutputError> {
    let altitude = Axis { title: "altitude of the sun in degrees", from: 0.0, to: 90.0 };
    let transmission = Axis { title: "transmission of collector and guide", from: 0.0, to: 1.0 };
    lines(series, altitude, transmission, false)
}

/// Whole decades around `values`; a decade around `otherwise` without values.
fn decades(values: impl Iterator<Item = f64>, otherwise: f64) -> (f64, f64) {
    let (low, high) = values.fold((f64::INFINITY, 0.0f64), |(low, high), value| (low.min(value), high.max(value)));
    let (low, high) = if high > 0.0 { (low, high) } else { (otherwise, otherwise) };
    // beyond these exponents the scale itself would overflow
    let from = libm::log10(low).floor().clamp(-100.0, 99.0);
    let to = libm::log10(high).ceil().clamp(from + 1.0, 100.0);
    (libm::pow(10f64, from), libm::pow(10f64, to))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithmic_curves_are_named() {
        let line: Vec<_> = (0..6).map(|k| (f64::from(4i32.pow(k)), 0.5f64.powi(k as i32))).collect();
        let bad = vec![(0.0, 1.0), (1.0, f64::NAN)];
        let svg = logarithmic(&[Series { name: "ppm".to_owned(), line, marks: bad }], "passes", "error").unwrap();
        assert!(svg.contains("ppm") && svg.contains("passes") && !svg.contains("NaN"));
        assert!(logarithmic(&[], "x", "y").is_ok());
    }

    #[test]
    fn curves_are_named() {
        let line: Vec<_> = (1..19).map(|k| (5.0 * f64::from(k), 0.05)).collect();
        let svg = transmission(&[Series { name: "south".to_owned(), marks: line.clone(), line }]).unwrap();
        assert!(svg.contains("south") && svg.contains("altitude of the sun"));
    }
}
