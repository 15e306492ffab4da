//! Plots as SVG: convergence, curves.

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

/// One pass of a job.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConvergencePoint {
    /// Seconds of rendering until the end of the pass.
    pub seconds: f64,
    /// Relative error of the grids at the asked confidence.
    pub grids: Option<f64>,
    /// Relative error of the views at the asked confidence.
    pub views: Option<f64>,
}

/// Relative error against render time, both logarithmic, with the slope -1/2 of independent passes as a guide.
///
/// What is not positive and finite is left out; without any point there are axes only.
pub fn convergence(points: &[ConvergencePoint]) -> Result<String, OutputError> {
    let series = |value: fn(&ConvergencePoint) -> Option<f64>| {
        let plottable = |x: f64| x.is_finite() && x > 0.0;
        let pairs = points.iter().filter_map(move |point| Some((point.seconds, value(point)?)));
        pairs.filter(|(seconds, error)| plottable(*seconds) && plottable(*error)).collect::<Vec<_>>()
    };
    let grids = series(|point| point.grids);
    let views = series(|point| point.views);
    let all = || grids.iter().chain(&views);
    let seconds = decades(all().map(|point| point.0), 1.0);
    let errors = decades(all().map(|point| point.1), 0.1);

    let mut svg = String::new();
    let mut draw = || -> Result<(), Box<dyn std::error::Error + '_>> {
        let area = SVGBackend::with_string(&mut svg, SIZE_PX).into_drawing_area();
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&area)
            .margin(16)
            .x_label_area_size(44)
            .y_label_area_size(72)
            .build_cartesian_2d((seconds.0..seconds.1).log_scale(), (errors.0..errors.1).log_scale())?;
        chart
            .configure_mesh()
            .x_desc("render time in s")
            .y_desc("relative error")
            .x_label_formatter(&|value| format!("{value}"))
            .y_label_formatter(&|value| format!("{value}"))
            .draw()?;
        if let Some((at, error)) = grids.last().or(views.last()).copied() {
            let on_slope = |seconds: f64| (seconds, error * (at / seconds).sqrt());
            // within the plot: where the line leaves it above, it begins
            let begin = seconds.0.max(at * (error / errors.1).powi(2)).min(seconds.1);
            let end = seconds.1.min(at * (error / errors.0).powi(2)).max(begin);
            chart
                .draw_series(LineSeries::new([on_slope(begin), on_slope(end)], GUIDE.stroke_width(1)))?
                .label("slope -1/2")
                .legend(|(x, y)| PathElement::new(vec![(x, y), (x + 20, y)], GUIDE));
        }
        for (name, colour, points) in [("grids", GRIDS, &grids), ("views", VIEWS, &views)] {
            if points.is_empty() {
                continue;
            }
            chart
                .draw_series(LineSeries::new(points.iter().copied(), colour.stroke_width(2)))?
                .label(name)
                .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 20, y)], colour.stroke_width(2)));
            let marked = thinned(points);
            chart.draw_series(marked.map(|point| Circle::new(point, 3, colour.filled())))?;
        }
        if !(grids.is_empty() && views.is_empty()) {
            chart
                .configure_series_labels()
                .position(SeriesLabelPosition::UpperRight)
                .border_style(BLACK.mix(0.3))
                .background_style(WHITE.mix(0.8))
                .draw()?;
        }
        area.present()?;
        Ok(())
    };
    draw().map_err(|error| OutputError::Plot(error.to_string()))?;
    Ok(svg)
}

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

/// The points of passes 1, 2, 4, 8 and so on, and the last.
fn thinned(points: &[(f64, f64)]) -> impl Iterator<Item = (f64, f64)> {
    let chosen = |index: &usize| (index + 1).is_power_of_two() || index + 1 == points.len();
    (0..points.len()).filter(chosen).map(|index| points[index])
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

    fn point(seconds: f64, error: f64) -> ConvergencePoint {
        ConvergencePoint { seconds, grids: Some(error), views: None }
    }

    #[test]
    fn drawn_for_none_one_and_many() {
        for points in [
            vec![],
            vec![point(0.5, 0.1)],
            vec![point(0.0, f64::NAN), ConvergencePoint { seconds: 1.0, grids: None, views: None }],
            vec![point(1e-300, 1e300), point(1e300, 1e-300)],
            (1..5000).map(|k| point(0.01 * f64::from(k), 0.5 / f64::from(k).sqrt())).collect(),
        ] {
            let svg = convergence(&points).unwrap();
            assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"), "{}", &svg[..100]);
            assert!(!svg.contains("NaN"));
            assert!(svg.contains("relative error"));
        }
    }

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

    #[test]
    fn both_series_and_the_guide_are_named() {
        let points: Vec<_> = (1..100)
            .map(f64::from)
            .map(|k| ConvergencePoint { seconds: k, grids: Some(0.1 / k.sqrt()), views: Some(0.3 / k.sqrt()) })
            .collect();
        let svg = convergence(&points).unwrap();
        for name in ["grids", "views", "slope -1/2"] {
            assert!(svg.contains(name), "{name}");
        }
    }
}
