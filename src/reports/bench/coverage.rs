//! Validity of reported errors: how often confidence intervals contain the truth, and how far values are from it.

use std::path::Path;

use serde_json::{Value, json};

use super::case::Case;
use super::measure::{on_one_thread, percent};
use super::scenes;
use super::settings::{Progress, Settings};
use crate::page::{ReportError, Section, Table};
use skyduct::document::method;
use skyduct::engine::cancel::Stop;
use skyduct::estimate::{Estimate, grid_statistics};
use skyduct::figure::ticks::significant;
use skyduct::statistics::Moments;
use skyduct::statistics::interval::{two_sided_normal_quantile, two_sided_student_quantile};
use skyduct::study::compare::{Values, holds};
use skyduct::study::reference::{KnownGrid, values};

/// Requested relative errors, at 95 % confidence.
const ASKED: [f64; 2] = [0.05, 0.01];

const CONFIDENCE: f64 = 0.95;

/// Fractions of intervals with the truth that are near enough to 95 %.
const GOOD: std::ops::RangeInclusive<f64> = 0.93..=0.97;

/// Number of runs below which their spread is not reported.
const FEW: f64 = 10.0;

/// Relative error of a truth that is rendered, at 95 % confidence.
const OF_TRUTH: f64 = 0.001;

/// Scene with accurate reference values of its sensors, or blocks of pixels.
struct Subject {
    name: &'static str,
    what: &'static str,
    case: Case,
    truth: Values,
    /// Indices of the sensors whose intervals are checked.
    sensors: Vec<usize>,
}

/// Statistics of the runs of one method to one error.
#[derive(Default)]
struct Held {
    /// Fraction of the sensors whose interval contains the truth, for each run that reports errors.
    sensors: Moments,
    /// 1 for a run whose interval of the grid's mean contains the true mean, else 0; empty for views.
    means: Moments,
    /// Relative deviation of the mean, for each run.
    deviations: Moments,
    /// Upper bound of the relative standard error of the true mean.
    of_truth: f64,
    /// Mean square of the relative deviations of all sensors, by which jobs end, less the variance of the truth.
    squares: Moments,
    /// Number of runs whose root mean square deviation, at 95 %, is more than one and a half times the requested error.
    far: f64,
    /// Number of runs that ended by their time limit.
    not_met: f64,
}

/// Result of one rendered job.
struct Found {
    values: Values,
    mean: f64,
    /// Standard error of the mean; `None` for a view, because the correlation of the errors of blocks is not estimated.
    mean_error: Option<f64>,
    passes: u64,
    met: bool,
}

pub fn section(settings: &Settings, seeds: u64, progress: Progress) -> Result<Section, ReportError> {
    let subjects = subjects(settings, progress)?;
    let methods: Vec<&str> = method::names().skip(1).collect();
    let mut tables = Vec::new();
    for (number, subject) in subjects.iter().enumerate() {
        let of_subject =
            progress.part(number as f64 / subjects.len() as f64, (number + 1) as f64 / subjects.len() as f64);
        let mut rows = Vec::new();
        for (step, method) in methods.iter().enumerate() {
            for asked in ASKED {
                let what = format!("intervals of {method} in {}", subject.name);
                of_subject.step(step, methods.len(), &what);
                let Some(held) = subject.held(settings, method, asked, seeds)? else { continue };
                rows.push(row(method, asked, &held));
            }
        }
        let head = ["method", "asked", "runs", "sensors", "means", "actual over asked", "beyond 1.5", "mean off by"];
        let caption = format!("{}: {}", subject.name, subject.what);
        tables.push(Table { caption, head: head.map(str::to_owned).into(), rows });
    }
    Ok(Section {
        title: "How often intervals contain the true value".to_owned(),
        text: format!(
            "Each method renders each scene with up to {seeds} seeds to 5 and to 1 % at 95 %, for {} s at most. \
             \"Sensors\" is the share of the sensors (of a view: of blocks of 8 x 8 pixels) whose 95 % interval by \
             Student's t contains the true value, whose own error is included; \"means\" is the share of the runs \
             whose interval of the mean does. Each share is followed by its standard error (s.e.): over the runs, \
             since the errors of a run's sensors are correlated, and for means the binomial one. **Bold** are shares \
             of ten runs or more that lie outside of 93 to 97 % by more than two standard errors. \"Actual over \
             asked\" is the root mean square of the deviations of all sensors and runs, times 1.96, over the \
             requested error; \"beyond 1.5\" is the share of the runs where this ratio is more than 1.5; both are \
             given where no run was cut short. \"Mean off by\" is the mean deviation of the mean, in standard errors \
             of the runs and of the true value: jobs stop once they are accurate enough, which must not bias them. \
             Errors of solvers are bounds, so that all of their intervals may contain the true value.",
            significant(settings.budget(), 2)
        ),
        tables,
        ..Section::default()
    })
}

fn row(method: &str, asked: f64, held: &Held) -> Vec<String> {
    let runs = held.squares.count;
    let binomial = (CONFIDENCE * (1.0 - CONFIDENCE) / held.means.count).sqrt();
    let not_met = if held.not_met > 0.0 { format!(", {} of them cut short", held.not_met) } else { String::new() };
    let off = libm::hypot(held.deviations.standard_error(), held.of_truth);
    let actual = held.squares.mean.max(0.0).sqrt() * two_sided_normal_quantile(CONFIDENCE);
    vec![
        method.to_owned(),
        percent(asked),
        format!("{runs}{not_met}"),
        share(&held.sensors, held.sensors.standard_error()),
        share(&held.means, binomial),
        // jobs that were cut short are not as accurate as requested
        if held.not_met > 0.0 { String::new() } else { significant(actual / asked, 2) },
        if held.not_met > 0.0 { String::new() } else { percent(held.far / runs) },
        if runs < FEW { String::new() } else { format!("{} σ", significant(held.deviations.mean / off, 2)) },
    ]
}

fn share(shares: &Moments, error: f64) -> String {
    if shares.count == 0.0 {
        return String::new();
    }
    let share = shares.mean;
    let error = if error.is_finite() { error } else { 0.0 };
    let text = format!("{:.1} % (s.e. {:.1})", 100.0 * share, 100.0 * error);
    let near = shares.count < FEW || share >= GOOD.start() - 2.0 * error && share <= GOOD.end() + 2.0 * error;
    if near { text } else { format!("**{text}**") }
}

impl Settings {
    /// Returns the seconds for all seeds of one method to one error in one scene.
    fn budget(&self) -> f64 {
        self.either(6.0, 0.3)
    }
}

fn subjects(settings: &Settings, progress: Progress) -> Result<Vec<Subject>, ReportError> {
    let stored = |name: &'static str, what, file: &str| {
        let case = scenes::stored(settings, name)?;
        let truth = values(&[known(settings, file)?]);
        Ok::<_, ReportError>(Subject { name, what, case, sensors: (0..truth.lux.len()).collect(), truth })
    };
    let mut subjects = vec![
        stored("S1", "a straight tube with a Lambertian diffuser, 81 points", "S1.exact.point")?,
        stored("S2", "the sun through a clear sheet, 81 points", "S2.exact.point")?,
        stored("S3", "a tube with two bends, 81 points", "S3.mesh.point")?,
    ];
    progress.step(0, 1, "truths");
    let side = 30;
    let corner = scenes::points(settings, side)?;
    let side = side as usize;
    let sensors = vec![0, side - 1, side * (side - 1), side * side - 1];
    let truth = rendered(settings, &corner)?;
    let what = "S1 with 30 x 30 points, of which the four in the corners, 3 cm from two walls, are compared";
    subjects.push(Subject { name: "S1, corners", what, case: corner, truth, sensors });
    let view = view(settings)?;
    let truth = rendered(settings, &view)?;
    let sensors = (0..truth.lux.len()).collect();
    subjects.push(Subject { name: "S1, a view", what: "64 x 64 pixels of the room", case: view, truth, sensors });
    Ok(subjects)
}

/// Reads the values of a file of `tests/reference/scenes`.
pub fn known(settings: &Settings, name: &str) -> Result<KnownGrid, ReportError> {
    let file = settings.reference.join("scenes").join(format!("{name}.reference.json"));
    let mut read = scenes::read(&file)?;
    let mut grid = Value::Null;
    for field in ["illuminance_lux", "standard_error_lux"] {
        grid[field] = read[field].take();
    }
    serde_json::from_value(grid).map_err(|error| ReportError::Case(format!("{}: {error}", file.display())))
}

/// Returns S1 as seen from a corner, without a grid.
fn view(settings: &Settings) -> Result<Case, ReportError> {
    let mut document = scenes::stored(settings, "S1")?.document;
    document["grids"] = json!([]);
    document["views"] = json!([{ "name": "room", "eye_m": [0.1, 0.1, 0.5], "look_at_m": [1.061, 1.061, 1.134], "vertical_fov_deg": 90,
                                 "size_px": [64, 64] }]);
    Ok(Case::beside(document, Path::new(".")))
}

/// Renders the truth of a case by the method that `auto` chooses, with a seed of its own.
fn rendered(settings: &Settings, case: &Case) -> Result<Values, ReportError> {
    let seconds = settings.either(60.0, 3.0);
    let error = settings.either(OF_TRUTH, 0.01) / two_sided_normal_quantile(CONFIDENCE);
    let run = case.clone().to(error, seconds).seed(1_000_000).run()?;
    Ok(Found::of(&run.estimate, run.met).values)
}

impl Subject {
    /// Runs seeds of a method to an error within the time budget; `None` where the method refuses the scene, or reports no
    /// errors.
    fn held(&self, settings: &Settings, method: &str, asked: f64, seeds: u64) -> Result<Option<Held>, ReportError> {
        let mut case = self.case.clone().to(asked / two_sided_normal_quantile(CONFIDENCE), settings.budget());
        case.document["method"] = method.into();
        if case.prepare().is_err() {
            return Ok(None);
        }
        let threads = std::thread::available_parallelism().map_or(1, |count| count.get() as u64);
        let begin = std::time::Instant::now();
        // each thread takes every n-th seed: jobs are small
        let of_thread = |thread: u64| {
            let mut found = Vec::new();
            for seed in (thread..seeds).step_by(threads as usize) {
                if seed >= threads && begin.elapsed().as_secs_f64() > settings.budget() {
                    break;
                }
                let rendered = case.seed(seed).prepare()?.render(&Stop::default(), &mut |_, _| {})?;
                if rendered.estimate.passes > 0 {
                    found.push(Found::of(&rendered.estimate, rendered.stopped_by.is_as_asked()));
                }
            }
            Ok::<_, ReportError>(found)
        };
        let found = std::thread::scope(|scope| {
            let threads: Vec<_> =
                (0..threads).map(|thread| scope.spawn(move || on_one_thread(|| of_thread(thread)))).collect();
            let join = |thread: std::thread::ScopedJoinHandle<'_, Result<Vec<Found>, ReportError>>| {
                thread.join().unwrap_or_else(|_| Err(ReportError::Case(format!("{method} panicked in {}", self.name))))
            };
            threads.into_iter().map(join).collect::<Result<Vec<_>, _>>()
        })?;
        // formulas have no estimate of their error
        if found.iter().flatten().all(|found| found.values.errors.iter().all(|error| !error.is_finite())) {
            return Ok(None);
        }
        let mut held = Held::default();
        found.iter().flatten().for_each(|found| self.add(found, asked, &mut held));
        Ok(Some(held))
    }

    fn add(&self, found: &Found, asked: f64, held: &mut Held) {
        let (values, truth) = (self.of_sensors(&found.values), self.of_sensors(&self.truth));
        // jobs end by all of their sensors
        let variance = self.truth.relative_variance().unwrap_or(0.0);
        let square = found.values.squared_error(&self.truth);
        // a single pass gives no errors
        if let Some(covered) = values.covered(&truth, CONFIDENCE) {
            held.sensors.push(covered);
        }
        held.squares.push(square - variance);
        held.far += f64::from(square.sqrt() * two_sided_normal_quantile(CONFIDENCE) > 1.5 * asked);
        held.not_met += f64::from(!found.met);
        let count = self.truth.lux.len() as f64;
        let mean = self.truth.lux.iter().sum::<f64>() / count;
        // errors of the truth's sensors may be correlated
        let error =
            self.truth.errors.iter().map(|error| if error.is_finite() { *error } else { 0.0 }).sum::<f64>() / count;
        let quantile = two_sided_student_quantile(CONFIDENCE, found.passes.max(2) as f64 - 1.0);
        if let Some(of_mean) = found.mean_error.filter(|error| error.is_finite()) {
            held.means.push(f64::from(holds((found.mean, of_mean), (mean, error), quantile)));
        }
        held.deviations.push((found.mean - mean) / mean);
        held.of_truth = error / mean;
    }

    fn of_sensors(&self, all: &Values) -> Values {
        let pick = |values: &[f64]| self.sensors.iter().map(|sensor| values[*sensor]).collect();
        Values {
            lux: pick(&all.lux),
            errors: pick(&all.errors),
            grids: vec![self.sensors.len()],
            degrees_of_freedom: all.degrees_of_freedom,
        }
    }
}

impl Found {
    fn of(estimate: &Estimate, met: bool) -> Self {
        let passes = estimate.passes;
        match (estimate.grids.first(), estimate.views.first()) {
            (Some(grid), _) => {
                let mean = grid_statistics::mean(grid);
                let values = Values::of_estimate(estimate);
                Self { values, mean: mean.value, mean_error: Some(mean.standard_error), passes, met }
            }
            (None, Some(film)) => {
                let values = Values::of_view(film);
                let mean = values.lux.iter().sum::<f64>() / values.lux.len().max(1) as f64;
                Self { values, mean, mean_error: None, passes, met }
            }
            (None, None) => Self { values: Values::default(), mean: 0.0, mean_error: None, passes, met },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_far_from_95_percent_stand_out() {
        let shares = |held: u32, all: u32| {
            let mut shares = Moments::default();
            (0..all).for_each(|run| shares.push(f64::from(u8::from(run < held))));
            shares
        };
        assert_eq!(share(&shares(190, 200), 0.015), "95.0 % (s.e. 1.5)");
        assert_eq!(share(&shares(180, 200), 0.015), "90.0 % (s.e. 1.5)");
        assert_eq!(share(&shares(178, 200), 0.015), "**89.0 % (s.e. 1.5)**");
        assert_eq!(share(&shares(200, 200), 0.01), "**100.0 % (s.e. 1.0)**");
        assert_eq!(share(&shares(2, 2), 0.0), "100.0 % (s.e. 0.0)");
    }

    /// Two of four sensors are checked, and the interval of one of them contains the truth; the mean and the errors are those
    /// of all.
    #[test]
    fn a_run_is_judged_by_the_sensors_that_are_looked_at() {
        let values = |lux: [f64; 4], error: f64| Values {
            lux: lux.to_vec(),
            errors: vec![error; 4],
            grids: vec![4],
            degrees_of_freedom: 999.0,
        };
        let case = Case::beside(json!({}), Path::new("."));
        let truth = values([100.0; 4], 0.0);
        let subject = Subject { name: "", what: "", case, truth, sensors: vec![1, 3] };
        let found = Found {
            values: values([0.0, 101.0, 0.0, 110.0], 1.0),
            mean: 99.0,
            mean_error: Some(1.0),
            passes: 1000,
            met: true,
        };
        let mut held = Held::default();
        subject.add(&found, 0.05, &mut held);
        assert_eq!((held.sensors.mean, held.means.mean, held.far), (0.5, 1.0, 1.0));
        assert!(
            (held.squares.mean - 0.25 * (1.0 + 1e-4 + 1.0 + 1e-2)).abs() < 1e-12
                && (held.deviations.mean + 0.01).abs() < 1e-12
        );
    }
}
