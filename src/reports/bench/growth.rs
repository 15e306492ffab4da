//! Growth of cost with the size of the problem.

use serde_json::{Value, json};

use super::case::{Case, all_met, passes, set_up};
use super::measure::time;
use super::settings::{Progress, Settings};
use super::{meshes, scenes};
use crate::page::{Figure, ReportError, Section, Table};
use crate::thesis::distance::logarithmic_slope;
use skyduct::figure::Heading;
use skyduct::figure::curves::{Series, logarithmic};
use skyduct::figure::svg::svg;
use skyduct::figure::ticks::{short, significant};

/// Standard error to which most jobs run.
const ASKED: f64 = 0.01;

/// Number of passes of the jobs that do not run to an accuracy.
const PASSES: u64 = 8;

/// Variation of one quantity.
struct Study {
    file: &'static str,
    title: &'static str,
    axis: &'static str,
    /// Names of the curves, each with the case for a value of the quantity.
    curves: Vec<(&'static str, Of)>,
    /// Values in the whole benchmark.
    values: Vec<f64>,
    /// Number of values, from the first, that a trial measures.
    quick: usize,
    /// True if the time before the passes has a curve, too.
    set_up: bool,
}

/// Function that returns the case for a value of the quantity.
type Of = fn(&Settings, f64) -> Result<Case, ReportError>;

/// Measured curve.
struct Curve {
    name: String,
    /// Values of the quantity, each with the processor seconds.
    points: Vec<(f64, f64)>,
}

fn studies() -> Vec<Study> {
    let powers = |base: f64, exponents: std::ops::RangeInclusive<i32>| -> Vec<f64> {
        exponents.map(|exponent| libm::pow(base, f64::from(exponent)).round()).collect()
    };
    let study =
        |file, title, axis, curves, values, quick| Study { file, title, axis, curves, values, quick, set_up: false };
    vec![
        study(
            "growth_photons.svg",
            "Photons: S1 by light tracing, 8 passes",
            "photons in each pass",
            vec![("S1", photons)],
            powers(4.0, 4..=9),
            4,
        ),
        Study {
            set_up: true,
            ..study(
                "growth_triangles.svg",
                "Triangles: S1 with a bent mesh tube, to 1 %",
                "triangles",
                vec![("passes", |settings, number| elbow(settings, 1.0, number))],
                powers(10.0, 3..=6),
                2,
            )
        },
        study(
            "growth_length.svg",
            "Length: S1 with other tubes, to 1 %",
            "length in diameters",
            vec![
                ("straight", |settings, diameters| segments(settings, &[(diameters, 0.0)])),
                ("one bend of 45 degrees, closed form", |settings, diameters| {
                    segments(settings, &[(0.5 * diameters, 0.0), (0.5 * diameters, 45.0)])
                }),
                ("the same as a mesh of 10 000 triangles", |settings, diameters| {
                    elbow(settings, scenes::DIAMETER_M * diameters, 1e4)
                }),
            ],
            vec![1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0],
            3,
        ),
        study(
            "growth_sensors.svg",
            "Sensors: S1 with points on its floor, to 1 %",
            "points",
            vec![("S1", |settings, number| scenes::points(settings, number.sqrt().round() as u32))],
            [3.0, 9.0, 32.0, 100.0, 316.0].map(|side: f64| side * side).into(),
            3,
        ),
        study(
            "growth_pixels.svg",
            "Pixels: S4, 8 passes by the method that `auto` takes",
            "pixels",
            vec![("S4", pixels)],
            [64.0, 128.0, 256.0, 512.0].map(|side: f64| side * side).into(),
            2,
        ),
        study(
            "growth_tubes.svg",
            "Tubes: a hall with tubes of S1 and 16 x 16 points, to 1 %",
            "tubes",
            vec![("hall", |settings, number| scenes::tubes(settings, number.sqrt().round() as u32))],
            vec![1.0, 4.0, 16.0, 64.0],
            3,
        ),
        study(
            "growth_boxes.svg",
            "Boxes: S1 with boxes on its floor, to 1 %",
            "boxes",
            vec![("S1", |settings, number| scenes::boxes(settings, number as usize))],
            vec![1.0, 4.0, 16.0, 64.0],
            3,
        ),
    ]
}

fn photons(settings: &Settings, number: f64) -> Result<Case, ReportError> {
    let mut case = scenes::stored(settings, "S1")?;
    case.document["method"] = json!({ "kind": "light_tracing", "photons_per_pass": number as u64 });
    Ok(case.passes(PASSES, 600.0))
}

fn pixels(settings: &Settings, number: f64) -> Result<Case, ReportError> {
    let mut case = scenes::stored(settings, "S4")?;
    let side = number.sqrt().round() as u32;
    case.document["views"][0]["size_px"] = json!([side, side]);
    Ok(case.passes(PASSES, 600.0))
}

fn segments(settings: &Settings, segments: &[(f64, f64)]) -> Result<Case, ReportError> {
    let segment = |(diameters, tilt_deg): &(f64, f64)| {
        let mut segment = json!({ "length_m": scenes::DIAMETER_M * diameters });
        if *tilt_deg > 0.0 {
            segment["tilt_deg"] = (*tilt_deg).into();
            segment["azimuth_deg"] = 90.into();
        }
        segment
    };
    scenes::with_tube(settings, scenes::tube(segments.iter().map(segment).collect::<Vec<Value>>().into()))
}

fn elbow(settings: &Settings, length_m: f64, triangles: f64) -> Result<Case, ReportError> {
    let case = scenes::with_tube(settings, scenes::mesh_tube())?;
    Ok(Case::with(case.document, meshes::elbow(length_m, triangles as usize)))
}

pub fn section(settings: &Settings, progress: Progress) -> Result<Section, ReportError> {
    let studies = studies();
    let (mut rows, mut figures) = (Vec::new(), Vec::new());
    let number = studies.len();
    for (index, study) in studies.into_iter().enumerate() {
        let part = progress.part(index as f64 / number as f64, (index + 1) as f64 / number as f64);
        let curves = measure(settings, &study, part)?;
        rows.extend(curves.iter().map(|curve| row(&study, curve)));
        figures.push(figure(&study, curves)?);
    }
    Ok(Section {
        title: "How cost grows".to_owned(),
        text: "Processor seconds of one thread, medians; everything but the named quantity stays the same. The \
               exponent is the slope of the logarithms over the upper half of the values: 0 is no growth at all, 1 is \
               growth in proportion. Meshes are made in memory, so that no file is read; where a job did not reach \
               the requested accuracy in time, its point is missing."
            .to_owned(),
        tables: vec![Table {
            caption: "Growth".to_owned(),
            head: ["quantity", "curve", "from", "time", "to", "time", "exponent"].map(str::to_owned).into(),
            rows,
        }],
        figures,
        ..Section::default()
    })
}

fn measure(settings: &Settings, study: &Study, progress: Progress) -> Result<Vec<Curve>, ReportError> {
    let values = &study.values[..settings.either(study.values.len(), study.quick)];
    let mut curves = Vec::new();
    for (number, (name, of)) in study.curves.iter().enumerate() {
        let curve = |name: &str| Curve { name: name.to_owned(), points: Vec::new() };
        let (mut of_passes, mut of_set_up) = (curve(name), curve("before the passes"));
        for (index, value) in values.iter().enumerate() {
            let step = format!("{}: {name}, {}", study.axis, short(*value));
            progress.step(number * values.len() + index, study.curves.len() * values.len(), &step);
            let mut case = of(settings, *value)?;
            let by_passes = case.document["stop"]["max_passes"] == PASSES;
            if !by_passes {
                case = case.to(ASKED, settings.longest_job());
            }
            let runs = case.runs(settings.repeats())?;
            of_set_up.points.push((*value, set_up(&runs).median));
            if by_passes || all_met(&runs) {
                of_passes.points.push((*value, passes(&runs).median));
            }
        }
        curves.push(of_passes);
        if study.set_up {
            curves.push(of_set_up);
        }
    }
    Ok(curves)
}

fn row(study: &Study, curve: &Curve) -> Vec<String> {
    let end = |point: Option<&(f64, f64)>| match point {
        Some((value, seconds)) => [short(*value), time(*seconds)],
        None => ["".to_owned(), "not reached".to_owned()],
    };
    let [from, from_seconds] = end(curve.points.first());
    let [to, to_seconds] = end(curve.points.last());
    let exponent = exponent(&curve.points).map_or_else(String::new, |exponent| significant(exponent, 2));
    vec![study.axis.to_owned(), curve.name.clone(), from, from_seconds, to, to_seconds, exponent]
}

/// Fits the slope in double logarithms over the upper half of the points, at least two of them; `None` with fewer.
fn exponent(points: &[(f64, f64)]) -> Option<f64> {
    let upper = &points[points.len() - points.len().div_ceil(2).max(2).min(points.len())..];
    (upper.len() >= 2).then(|| logarithmic_slope(upper))
}

fn figure(study: &Study, curves: Vec<Curve>) -> Result<Figure, ReportError> {
    let series = |curve: Curve| Series {
        name: curve.name,
        marks: curve.points.clone(),
        line: curve.points,
        ..Series::default()
    };
    let series: Vec<_> = curves.into_iter().map(series).collect();
    let drawing = logarithmic(&Heading::of(study.title), &series, study.axis, "processor seconds of one core");
    let caption = format!("{}.", study.title.replace('`', ""));
    Ok(Figure { file: study.file, caption, bytes: svg(&drawing)?.into_bytes() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponents_are_those_of_the_upper_half() {
        let of = |f: fn(f64) -> f64| exponent(&[1.0, 4.0, 16.0, 64.0].map(|x| (x, f(x))));
        assert!((of(|x| 3.0 * x).unwrap() - 1.0).abs() < 1e-12);
        assert!((of(|x| x.max(16.0)).unwrap() - 1.0).abs() < 1e-12);
        assert!(of(|_| 2.0).unwrap().abs() < 1e-12);
        assert!((exponent(&[(1.0, 1.0), (2.0, 4.0)]).unwrap() - 2.0).abs() < 1e-12);
        assert_eq!((exponent(&[(1.0, 1.0)]), exponent(&[])), (None, None));
    }

    #[test]
    fn studies_vary_what_they_name() {
        let settings = Settings {
            quick: true,
            reference: std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/reference"),
            beside: None,
        };
        for Study { curves, values, quick, title, .. } in studies() {
            assert!(quick <= values.len() && values.windows(2).all(|pair| pair[0] < pair[1]), "{title}");
            for (name, of) in curves {
                let case = of(&settings, values[0]).unwrap();
                assert!(case.prepare().is_ok(), "{title}, {name}");
            }
        }
    }
}
