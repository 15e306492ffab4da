//! Furnished rooms with the settings that users get when they name none: whether intervals hold the values of independent methods.

use serde_json::{Value, json};
use skyduct::document::JobDocument;
use skyduct::engine::cancel::Stop;
use skyduct::engine::progress::StoppedBy;
use skyduct::estimate::{Estimate, grid_statistics};
use skyduct::present::prepared::{Prepared, prepare_document};
use skyduct::statistics::interval::two_sided_student_quantile;

use crate::documents::Beside;
use crate::reference;

/// The job of a stored room with a seed.
fn prepared(room: &Value, seed: u64) -> Prepared {
    let mut job = room["job"].clone();
    job["seed"] = json!(seed);
    let document = JobDocument::parse(job.to_string().as_bytes()).unwrap();
    prepare_document(&document, &Beside("furnished")).unwrap()
}

fn stored(name: &str) -> Value {
    reference::json(&format!("furnished/{name}.json"))
}

/// The numbers of a stored table, row by row.
fn numbers(table: &Value) -> Vec<f64> {
    let rows = table.as_array().unwrap().iter();
    rows.flat_map(|row| row.as_array().unwrap()).map(|value| value.as_f64().unwrap()).collect()
}

/// Intervals of 95 % that held the truth, and all: of sensors, and of means.
#[derive(Clone, Copy, Default)]
struct Held {
    sensors: [f64; 2],
    means: [f64; 2],
}

impl Held {
    fn shares(&self) -> [f64; 2] {
        [self.sensors, self.means].map(|[held, all]| held / all)
    }
}

/// Renders a room with so many seeds; the truth's own error widens the intervals.
fn held(name: &str, seeds: u64) -> Held {
    let room = stored(name);
    let (lux, errors) = (numbers(&room["lux"]), numbers(&room["standard_error_lux"]));
    let mut held = Held::default();
    for seed in 1..=seeds {
        let Estimate { grids, .. } = prepared(&room, seed).render(&Stop::default(), &mut |_, _| {}).unwrap().estimate;
        let grid = &grids[0];
        let quantile = two_sided_student_quantile(0.95, grid.degrees_of_freedom());
        let holds = |value: f64, error: f64, truth: f64, error_of_truth: f64| {
            f64::from((value - truth).abs() <= (quantile * error).hypot(1.96 * error_of_truth))
        };
        let valued: Vec<usize> = grid.valued().collect();
        for sensor in &valued {
            let (value, error) = (grid.illuminance_lux(*sensor), grid.standard_error_lux(*sensor));
            held.sensors[0] += holds(value, error, lux[*sensor], errors[*sensor]);
            held.sensors[1] += 1.0;
        }
        // sensors inside solids have no value here, and were counted as dark there
        let scale = lux.len() as f64 / valued.len() as f64;
        let mean = grid_statistics::mean(grid);
        let of_truth = ["mean_lux", "mean_lux_standard_error"].map(|of| scale * room[of].as_f64().unwrap());
        held.means[0] += holds(mean.value, mean.standard_error, of_truth[0], of_truth[1]);
        held.means[1] += 1.0;
    }
    println!("{name}: {:?} of sensors and means", held.shares());
    held
}

/// Share of intervals that held the truth, and its standard error over rooms, whose sensors are wrong together.
#[derive(Clone, Copy, Debug)]
struct Share {
    share: f64,
    error: f64,
}

impl Share {
    fn of(rooms: &[[f64; 2]]) -> Self {
        let [held, all] = [0, 1].map(|of| rooms.iter().map(|room| room[of]).sum::<f64>());
        let (share, count) = (held / all, rooms.len() as f64);
        let squares: f64 = rooms.iter().map(|[held, all]| (held - share * all).powi(2)).sum();
        Self { share, error: (squares * count / (count - 1.0)).sqrt() / all }
    }

    /// True if it is between two bounds, but for two standard errors.
    fn is_within(self, least: f64, most: f64) -> bool {
        self.share >= least - 2.0 * self.error && self.share <= most + 2.0 * self.error
    }
}

/// Shares of the intervals of these rooms, of sensors and of means; no room's sensors are below 85 %.
fn shares_of(names: impl Iterator<Item = String>, seeds: u64) -> [Share; 2] {
    let mut rooms = Vec::new();
    for name in names {
        let room = held(&name, seeds);
        assert!(room.shares()[0] >= 0.85, "{name}: {:?}", room.shares());
        rooms.push(room);
    }
    let of = |part: fn(&Held) -> [f64; 2]| Share::of(&rooms.iter().map(part).collect::<Vec<_>>());
    let shares = [of(|room| room.sensors), of(|room| room.means)];
    println!("all: {shares:?}");
    shares
}

/// Four drawn rooms and an office whose sensors are far from its tube: 93 to 97 % of the sensors and 90 to 99 % of the means, within two
/// standard errors.
#[test]
fn intervals_hold_the_truth_in_furnished_rooms() {
    let [sensors, means] =
        shares_of((0..40).step_by(13).map(|room| format!("{room:02}")).chain(["office".to_owned()]), 10);
    assert!(sensors.is_within(0.93, 0.97) && means.is_within(0.9, 0.99), "{sensors:?} {means:?}");
}

/// The same of forty rooms: 800 jobs, a minute of processors.
#[test]
#[ignore = "minutes"]
fn intervals_hold_the_truth_in_forty_furnished_rooms() {
    let [sensors, means] = shares_of((0..40).map(|room| format!("{room:02}")), 20);
    assert!(sensors.is_within(0.93, 0.97) && means.is_within(0.9, 0.99), "{sensors:?} {means:?}");
}

/// Light that is reflected a thousand times is all counted: the mean within four standard errors of both sides.
#[test]
fn a_room_that_absorbs_little_is_as_bright_as_its_balance_says() {
    let room = stored("bright");
    let estimate = prepared(&room, 1).render(&Stop::default(), &mut |_, _| {}).unwrap().estimate;
    let mean = grid_statistics::mean(&estimate.grids[0]);
    let [truth, error] = ["mean_lux", "mean_lux_standard_error"].map(|of| room[of].as_f64().unwrap());
    assert!((mean.value - truth).abs() <= 4.0 * mean.standard_error.hypot(error), "{mean:?} {truth}");
}

/// Asking for less is met, and takes no more passes than the bound of a job.
#[test]
fn a_coarse_answer_is_met_in_a_high_room() {
    let room = stored("high");
    for error in [0.05, 0.02, 0.01] {
        let mut room = room.clone();
        room["job"]["stop"]["relative_error"] = json!(error);
        let rendered = prepared(&room, 1).render(&Stop::default(), &mut |_, _| {}).unwrap();
        assert_eq!(rendered.stopped_by, StoppedBy::RelativeError, "{error}");
        assert!(rendered.estimate.passes < 1000, "{error}: {}", rendered.estimate.passes);
    }
}
