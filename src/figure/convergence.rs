//! Figure of a job's convergence: relative error against render time, the fitted power law, and the time to each accuracy.

use glam::DVec2;

use super::axes::{self, Axes, Axis, logarithmic_ends};
use super::colour::{Colour, SERIES};
use super::drawing::{Anchor, Drawing, Line, Type};
use super::heading::{Heading, MARGIN};
use super::legend::{self, Entry, MARK_RADIUS};
use super::outline::{Outline, Rectangle};
use super::ticks::{duration, fixed, foretold_duration, short};

const SIZE: DVec2 = DVec2::new(800.0, 560.0);
const ROW_HEIGHT: f64 = 20.0;
const TABLE_SIZE: f64 = 12.0;

/// Factor beyond the time of the last pass for which the time axis has room, to show the extrapolated law.
const BEYOND: f64 = 3.0;

/// Half the diagonal of a diamond in pixels.
const DIAMOND: f64 = 2.0 * MARK_RADIUS;

/// Errors of one kind of output.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorSeries {
    /// Kind of output: grids, or views.
    pub name: &'static str,
    /// Seconds and relative error after each pass; points that are not above zero and finite are left out.
    pub points: Vec<(f64, f64)>,
    /// Power law that is extrapolated from the passes.
    pub course: Option<Course>,
    /// Requested relative error, at which the job ends.
    pub asked: Option<f64>,
    /// Time to each of several relative errors.
    pub times: Vec<TimeTo>,
    /// Predictions that were made before the first pass.
    pub foretold: Vec<Foretold>,
}

/// Predicted time to an accuracy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foretold {
    /// Relative error.
    pub error: f64,
    /// Predicted render time in seconds.
    pub seconds: f64,
    /// Lower end of the interval of the predicted seconds.
    pub from: f64,
    /// Upper end of this interval; `None` where it is unbounded.
    pub to: Option<f64>,
}

/// Power law of the error over time, extrapolated from the passes, with its confidence band.
#[derive(Clone, Debug, PartialEq)]
pub struct Course {
    /// Slope in double-logarithmic axes.
    pub exponent: f64,
    /// Half width of the 95 % confidence interval of the slope.
    pub half_interval: f64,
    /// Points of the law, ascending in time.
    pub points: Vec<CoursePoint>,
}

/// Point of the extrapolated law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoursePoint {
    /// Render time in seconds.
    pub seconds: f64,
    /// Relative error.
    pub error: f64,
    /// Lower end of the 95 % confidence interval of the error.
    pub from: f64,
    /// Upper end of this interval.
    pub to: f64,
}

/// Time to an accuracy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeTo {
    /// Relative error.
    pub error: f64,
    /// Render time in seconds; `None` where it cannot be estimated.
    pub seconds: Option<f64>,
    /// Source of the time.
    pub known: Known,
}

/// Source of the time to an accuracy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Known {
    /// Measured: a pass reached this error.
    Met,
    /// Extrapolated from the fitted law.
    Extrapolated,
}

/// Draws error against time in double-logarithmic axes, one colour for each series; only the axes if no series has a point.
pub fn convergence(heading: &Heading, series: &[ErrorSeries]) -> Drawing {
    let mut drawing = Drawing::new(SIZE, heading.title.as_str());
    heading.draw(&mut drawing);
    let is_drawn =
        |(seconds, error): &(f64, f64)| *seconds > 0.0 && *error > 0.0 && seconds.is_finite() && error.is_finite();
    let series: Vec<ErrorSeries> = series
        .iter()
        .map(|one| ErrorSeries { points: one.points.iter().copied().filter(is_drawn).collect(), ..one.clone() })
        .filter(|one| !one.points.is_empty())
        .collect();
    let entries = legend_of(&series);
    let below = axes::BELOW + ROW_HEIGHT * (series.len() + 1) as f64 + MARGIN;
    let top = heading.height(SIZE.x) + 8.0;
    let legend_height = legend::height(&entries, SIZE.x - axes::LEFT - MARGIN);
    let within = Rectangle::new(axes::LEFT, top + legend_height + 6.0, SIZE.x - MARGIN - 8.0, SIZE.y - below);
    legend::draw(&mut drawing, &entries, DVec2::new(axes::LEFT, top), within.size().x);
    let axes = axes_of(&series, within);
    axes.draw(&mut drawing);
    if let Some(last) = series.first().and_then(|first| first.points.last()) {
        let guide = |seconds: f64| (seconds, 100.0 * last.1 * (last.0 / seconds).sqrt());
        drawing
            .line(axes.line([guide(axes.x.from), guide(axes.x.to)]), Line::new(Colour::Muted, 1.0).dashed(&[2.0, 4.0]));
    }
    for (one, colour) in series.iter().zip(SERIES) {
        draw_series(&mut drawing, &axes, one, colour);
    }
    draw_requested(&mut drawing, &axes, &series);
    draw_table(&mut drawing, &series, within);
    drawing
}

fn axes_of(series: &[ErrorSeries], within: Rectangle) -> Axes {
    let points = || series.iter().flat_map(|one| one.points.iter().copied());
    // room for the law beyond the last pass
    let with_course = series.iter().filter(|one| one.course.is_some());
    let beyond = with_course.filter_map(|one| Some(one.points.last()?.0 * BEYOND));
    let foretold = series.iter().flat_map(|one| {
        let asked = one.foretold.iter().filter(|time| Some(time.error) >= one.asked);
        asked.map(|time| time.seconds)
    });
    let times = logarithmic_ends(points().map(|point| point.0).chain(beyond).chain(foretold), 1.0);
    let asked = series.iter().filter_map(|one| one.asked);
    let errors = logarithmic_ends(points().map(|point| point.1).chain(asked), 0.01);
    let x = Axis::logarithmic("render time in seconds", times, "");
    let y = Axis::logarithmic("relative error in percent", errors.map(|error| 100.0 * error), "");
    Axes { within, x, y }
}

fn legend_of(series: &[ErrorSeries]) -> Vec<Entry> {
    let mut entries = Vec::new();
    for (one, colour) in series.iter().zip(SERIES) {
        let line = Some(Line::new(colour, 2.0));
        entries.push(Entry { name: one.name.to_owned(), line, mark: Some(colour), area: None });
        if let Some(course) = &one.course {
            let slope = [course.exponent, course.half_interval].map(|number| fixed(number, 2)).join(" ± ");
            let line = Some(Line::new(colour, 1.0).dashed(&[6.0, 3.0]));
            let name = format!("extrapolated from the passes, slope {slope}, 95 % band");
            entries.push(Entry { name, line, mark: None, area: Some((colour, 0.15)) });
        }
        if !one.foretold.is_empty() {
            let line = Some(Line::new(colour, 3.0).dashed(&[2.0, 2.0]));
            entries.push(Entry { name: "predicted before the start".to_owned(), line, mark: None, area: None });
        }
    }
    if !entries.is_empty() {
        let line = Some(Line::new(Colour::Muted, 1.0).dashed(&[2.0, 4.0]));
        entries.push(Entry { name: "slope −1/2".to_owned(), line, mark: None, area: None });
    }
    entries
}

fn draw_series(drawing: &mut Drawing, axes: &Axes, series: &ErrorSeries, colour: Colour) {
    let percent = |&(seconds, error): &(f64, f64)| (seconds, 100.0 * error);
    if let Some(course) = &series.course {
        let ends =
            |end: fn(&CoursePoint) -> f64| course.points.iter().map(move |point| (point.seconds, 100.0 * end(point)));
        let around = ends(|point| point.from).chain(ends(|point| point.to).rev());
        let around: Vec<DVec2> =
            around.map(|(time, error)| axes.at(time, error).clamp(axes.within.from, axes.within.to)).collect();
        drawing.fill(Outline::polygon(around), colour, 0.15);
        drawing.line(axes.line(ends(|point| point.error)), Line::new(colour, 1.0).dashed(&[6.0, 3.0]));
    }
    if let Some(asked) = series.asked {
        let line = axes.line([(axes.x.from, 100.0 * asked), (axes.x.to, 100.0 * asked)]);
        drawing.line(line, Line::new(colour, 1.0).dashed(&[10.0, 4.0]));
    }
    draw_foretold(drawing, axes, &series.foretold, colour);
    drawing.line(axes.line(series.points.iter().map(percent)), Line::new(colour, 2.0));
    let mut marks = Outline::default();
    for place in axes.places(thinned(&series.points).iter().map(percent)) {
        marks.add_circle(place, MARK_RADIUS);
    }
    drawing.fill(marks, colour, 1.0);
}

/// Writes the requested errors above their lines; series with the same one share its words.
fn draw_requested(drawing: &mut Drawing, axes: &Axes, series: &[ErrorSeries]) {
    for (index, (one, colour)) in series.iter().zip(SERIES).enumerate() {
        let Some(asked) = one.asked else { continue };
        let is_same = |other: &&ErrorSeries| other.asked == Some(asked);
        if series[..index].iter().any(|other| is_same(&other)) {
            continue;
        }
        let names: Vec<&str> = series.iter().filter(is_same).map(|other| other.name).collect();
        let colour = if names.len() > 1 { Colour::Muted } else { colour };
        let at = axes.at(axes.x.to, 100.0 * asked) + DVec2::new(-6.0, -5.0);
        let text = format!("requested for {}: {} %", names.join(" and "), short(rounded(100.0 * asked)));
        drawing.text(at, text, Type::new(11.0, colour).anchored(Anchor::End).rimmed(Colour::Paper));
    }
}

/// Draws predictions: a diamond at each accuracy, on the interval of its seconds.
fn draw_foretold(drawing: &mut Drawing, axes: &Axes, foretold: &[Foretold], colour: Colour) {
    let within = |seconds: f64| seconds.clamp(axes.x.from, axes.x.to);
    for time in foretold {
        let percent = 100.0 * time.error;
        let interval = [within(time.from), within(time.to.unwrap_or(f64::INFINITY))];
        let line = axes.line(interval.map(|seconds| (seconds, percent)));
        drawing.line(line, Line::new(colour, 3.0).dashed(&[2.0, 2.0]));
        for place in axes.places([(time.seconds, percent)]) {
            let corners = [-DVec2::Y, DVec2::X, DVec2::Y, -DVec2::X].map(|corner| place + DIAMOND * corner);
            drawing.fill(Outline::polygon(corners), colour, 1.0);
        }
    }
}

/// Draws the table below the plot: the time to each accuracy.
fn draw_table(drawing: &mut Drawing, series: &[ErrorSeries], within: Rectangle) {
    let Some(first) = series.first() else { return };
    let mut y = within.to.y + axes::BELOW + 0.5 * ROW_HEIGHT + 4.0;
    let column = |index: usize| within.from.x + 120.0 + 110.0 * index as f64;
    let head = Type::new(TABLE_SIZE, Colour::Muted);
    drawing.text_centred(DVec2::new(MARGIN, y), "time to a relative error of", head);
    for (index, time) in first.times.iter().enumerate() {
        let text = format!("{} %", short(rounded(100.0 * time.error)));
        drawing.text_centred(DVec2::new(column(index) + 70.0, y), text, head.anchored(Anchor::End));
    }
    for (one, colour) in series.iter().zip(SERIES) {
        y += ROW_HEIGHT;
        drawing.text_centred(DVec2::new(MARGIN, y), one.name, Type::new(TABLE_SIZE, colour));
        for (index, time) in one.times.iter().enumerate() {
            let (text, ink) = match (time.seconds, time.known) {
                (Some(seconds), Known::Met) => (duration(seconds, 3), Colour::Ink),
                (Some(seconds), Known::Extrapolated) => (foretold_duration(seconds), Colour::Muted),
                (None, _) => ("?".to_owned(), Colour::Muted),
            };
            let look = Type::new(TABLE_SIZE, ink).anchored(Anchor::End);
            drawing.text_centred(DVec2::new(column(index) + 70.0, y), text, look);
        }
    }
}

/// Rounds away the digits that the product with 100 leaves behind.
fn rounded(percent: f64) -> f64 {
    (percent * 1e9).round() / 1e9
}

/// Returns the points of passes 1, 2, 4, 8 and so on, and the last.
fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let chosen = |index: &usize| (index + 1).is_power_of_two() || index + 1 == points.len();
    (0..points.len()).filter(chosen).map(|index| points[index]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::svg::svg;

    fn series(points: Vec<(f64, f64)>) -> ErrorSeries {
        ErrorSeries { name: "grids", points, course: None, asked: None, times: Vec::new(), foretold: Vec::new() }
    }

    #[test]
    fn drawn_for_none_one_and_many() {
        for points in [
            vec![],
            vec![(0.5, 0.1)],
            vec![(0.0, f64::NAN), (1.0, 0.0)],
            vec![(1e-300, 1e300), (1e300, 1e-300)],
            (1..5000).map(|k| (0.01 * f64::from(k), 0.5 / f64::from(k).sqrt())).collect(),
        ] {
            let svg = svg(&convergence(&Heading::of("test"), &[series(points)])).unwrap();
            assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n"));
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        }
    }

    /// Intervals without an upper end, and times beyond the axes, are drawn up to the ends of the axes.
    #[test]
    fn what_was_foretold_is_drawn_and_named() {
        let points: Vec<(f64, f64)> = (2..40).map(|k| (0.1 * f64::from(k), 0.1 / f64::from(k).sqrt())).collect();
        let time = |error, seconds| Foretold { error, seconds, from: 0.5 * seconds, to: None };
        let foretold = vec![time(0.02, 3.0), time(1e-9, 1e12)];
        let one = |foretold| ErrorSeries { asked: Some(0.02), foretold, ..series(points.clone()) };
        let [with, without] =
            [foretold, Vec::new()].map(|foretold| convergence(&Heading::of("test"), &[one(foretold)]));
        assert!(
            with.texts().any(|text| text == "predicted before the start")
                && without.texts().all(|text| text != "predicted before the start")
        );
        let svg = svg(&with).unwrap();
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }

    /// Two series with the same requested error have it once, and not one over the other.
    #[test]
    fn requested_errors_are_written_once() {
        let points: Vec<(f64, f64)> = (2..40).map(|k| (0.1 * f64::from(k), 0.1 / f64::from(k).sqrt())).collect();
        let one = |name, asked| ErrorSeries { name, asked: Some(asked), ..series(points.clone()) };
        let requested = |views| {
            let drawing = convergence(&Heading::of("test"), &[one("grids", 0.05), one("views", views)]);
            drawing.texts().filter(|text| text.starts_with("requested")).map(str::to_owned).collect::<Vec<_>>()
        };
        assert_eq!(requested(0.05), ["requested for grids and views: 5 %"]);
        assert_eq!(requested(0.02), ["requested for grids: 5 %", "requested for views: 2 %"]);
    }

    #[test]
    fn laws_and_times_are_told() {
        let points: Vec<(f64, f64)> = (2..40).map(|k| (0.1 * f64::from(k), 0.1 / f64::from(k).sqrt())).collect();
        let point = |seconds: f64| {
            let error = 0.1 / (10.0 * seconds).sqrt();
            CoursePoint { seconds, error, from: 0.9 * error, to: 1.1 * error }
        };
        let course = Course {
            exponent: -0.498,
            half_interval: 0.0312,
            points: (2..300).map(|k| point(0.1 * f64::from(k))).collect(),
        };
        let times = vec![
            TimeTo { error: 0.05, seconds: Some(0.4), known: Known::Met },
            TimeTo { error: 0.001, seconds: Some(1000.0), known: Known::Extrapolated },
            TimeTo { error: 0.0005, seconds: Some(4e83), known: Known::Extrapolated },
            TimeTo { error: 0.0001, seconds: None, known: Known::Extrapolated },
        ];
        let one = ErrorSeries { course: Some(course), asked: Some(0.02), times, ..series(points) };
        let drawing = convergence(&Heading::of("Convergence"), &[one]);
        let texts: Vec<&str> = drawing.texts().collect();
        for text in [
            "Convergence",
            "slope −1/2",
            "requested for grids: 2 %",
            "0.400 s",
            "about 17 min",
            "> 1 h",
            "?",
            "0.1 %",
            "0.01 %",
        ] {
            assert!(texts.contains(&text), "{text}: {texts:?}");
        }
        assert!(texts.contains(&"extrapolated from the passes, slope −0.50 ± 0.03, 95 % band"), "{texts:?}");
    }
}
