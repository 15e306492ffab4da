//! Times to an accuracy of rooms as they are built, beside the goals set for them.

use serde_json::{Value, json};

use super::case::{Case, Run};
use super::furnished::{self, Kind, USUAL};
use super::measure::{Quartiles, as_time, percent, time};
use super::scenes::{self, ROOM_M};
use super::settings::{Progress, Settings};
use super::shapes;
use crate::page::{ReportError, Section, Table};
use skyduct::figure::ticks::significant;

const TWO_TUBES: &str = include_str!("../../../examples/two_tubes.json");

/// Methods that are tried beside the one that `auto` chooses, and their time as a fraction of its time.
const OTHERS: [&str; 5] =
    ["two_stage", "light_tracing", "photon_mapping", "path_tracing", "bidirectional_path_tracing"];
const WITHIN: f64 = 1.0 / 1.5;

/// Error at 95 % that corresponds to a standard error of 1 %.
const STANDARD: f64 = 0.0196;

/// Shortest time limit of a job in seconds.
const LONG_ENOUGH: f64 = 10.0;

/// Goal for the time of a case.
#[derive(Clone, Copy)]
enum Asked {
    /// Largest number of seconds of the passes.
    Seconds(f64),
    /// Largest number of seconds from the document to the last pass.
    Whole(f64),
    /// Largest time of the passes as a multiple of that of the first row.
    TimesFirst(f64),
    /// Largest time of the passes as a multiple of that of the row before.
    TimesBefore(f64),
    /// No goal: the row is there for the next one.
    Nothing,
}

/// Case that is rendered until its outputs have an error at 95 %, or by the stop rule of its own document.
struct Row {
    name: &'static str,
    case: Case,
    error: Option<f64>,
    asked: Asked,
}

fn rows(settings: &Settings) -> Result<Vec<Row>, ReportError> {
    let row = |name, case, error, asked| Row { name, case, error: Some(error), asked };
    let mixed = Kind { mixed_in_the_sun: true, ..USUAL };
    let cells = Kind { cells: true, ..USUAL };
    let s1 = || scenes::stored(settings, "S1");
    let edited = |case: Case, edit: fn(&mut Value)| {
        let mut case = case;
        edit(&mut case.document);
        case
    };
    let sun = |altitude: f64| -> Result<Case, ReportError> {
        let mut case = scenes::stored(settings, "S2")?;
        case.document["sky"]["sun_position"]["altitude_deg"] = json!(altitude);
        Ok(case)
    };
    let s3 = edited(scenes::stored(settings, "S3")?, |document| {
        document["tubes"][0]["diffuser"] = json!({ "kind": "clear", "transmittance": 0.9 });
        document["sky"]["direct_normal_illuminance_lux"] = json!(60000.0);
    });
    let grey = edited(s1()?, |document| {
        let all = json!({ "reflectance": 0.9 });
        document["room"]["surfaces"] = json!({ "floor": all, "walls": all, "ceiling": all });
    });
    let aside = edited(s1()?, |document| document["tubes"][0]["centre_m"] = json!([0.127 + 0.01, 0.5 * ROOM_M]));
    let high = edited(s1()?, |document| document["grids"][0]["height_m"] = json!(2.0));
    let shiny = edited(s1()?, |document| {
        document["room"]["surfaces"]["walls"] = json!({ "reflectance": 0.5, "specular": 0.05 });
    });
    let two_tubes: Value = serde_json::from_str(TWO_TUBES)
        .map_err(|error| ReportError::Case(format!("examples/two_tubes.json: {error}")))?;
    let two_tubes = Case::with(two_tubes, skyduct::geometry::TriangleMesh::default());
    let boxes = scenes::boxes(settings, 20)?;
    let shape = |name: &str| shapes::stored(settings, name);
    use Asked::{Nothing, Seconds, TimesBefore, TimesFirst, Whole};
    Ok(vec![
        row("S1", s1()?, STANDARD, Seconds(3e-3)),
        row("S1, all reflectances 0.9", grey, STANDARD, TimesFirst(5.0)),
        row("S1, the tube 1 cm from a wall", aside, STANDARD, TimesFirst(5.0)),
        row("S1, points at 2 m, below the tube", high, STANDARD, TimesFirst(5.0)),
        row("S1, walls that are mirrors by 5 %", shiny, STANDARD, TimesFirst(5.0)),
        row(
            "S1, 20 boxes and 3 bent chairs",
            furnished::with_chairs(boxes.clone(), 3, true),
            STANDARD,
            TimesFirst(8.0),
        ),
        row("S1, 20 boxes and 8 chairs of boards", furnished::with_chairs(boxes, 8, false), STANDARD, TimesFirst(5.0)),
        row("S2, clear closure, the sun at 60 degrees", sun(60.0)?, STANDARD, TimesFirst(15.0)),
        row("S2, the sun at 70 degrees", sun(70.0)?, STANDARD, TimesFirst(15.0)),
        row("S3 with a clear closure and sun", s3, STANDARD, TimesFirst(100.0)),
        row("office: 40 tubes, 60 desks, 60 bent chairs", furnished::office(true, USUAL), 0.05, Seconds(0.2)),
        row("its cell averages", furnished::office(true, cells), 0.05, TimesBefore(1.5)),
        row("the office", furnished::office(true, USUAL), 0.01, Seconds(0.6)),
        row("the office, empty", furnished::office(false, USUAL), 0.01, Seconds(0.2)),
        row("the office, mixed closures in the sun", furnished::office(true, mixed), 0.05, Seconds(0.4)),
        row("corridor of 40 m", furnished::corridor(), 0.01, Seconds(0.05)),
        row("warehouse with racks", furnished::warehouse(), 0.01, Seconds(3.0)),
        row("bathroom with gloss and a mirror", furnished::bathroom(), 0.05, Seconds(0.3)),
        row("view of the office, 1280 x 720", furnished::view(), 0.05, Seconds(10.0)),
        row("room with one mesh of 290 304 triangles", furnished::one_mesh(), 0.05, Whole(0.5)),
        Row { name: "examples/two_tubes.json", case: two_tubes, error: None, asked: Whole(0.5) },
        row("box like the L hall", shapes::as_box(shape("L_hall")?), STANDARD, Nothing),
        row("L hall", shape("L_hall")?, STANDARD, TimesBefore(5.0)),
        row("box like the gable", shapes::as_box(shape("gable")?), STANDARD, Nothing),
        row("gable", shape("gable")?, STANDARD, TimesBefore(5.0)),
        row("box like the skew room", shapes::as_box(shape("skew")?), STANDARD, Nothing),
        row("skew room with a core and a partition", shape("skew")?, STANDARD, TimesBefore(5.0)),
        row("box like the attic", shapes::as_box(shape("attic")?), STANDARD, Nothing),
        row("attic with a luminaire", shape("attic")?, STANDARD, TimesBefore(5.0)),
        row("the attic, of 40 faces", shapes::attic_of_faces(settings)?, STANDARD, TimesBefore(2.0)),
        row("the furnished office again", furnished::office(true, USUAL), 0.05, Nothing),
        row("the office without a corner of 10 x 12 m", shapes::l_office(), 0.05, TimesBefore(1.5)),
    ])
}

/// Runs of a row.
struct Measured {
    runs: Vec<Run>,
    method: String,
    /// Methods that were as accurate in less than two thirds of the time.
    faster: Vec<&'static str>,
}

fn measure(row: &Row, settings: &Settings) -> Result<Measured, ReportError> {
    let until = |seconds: f64| {
        let mut case = row.case.clone();
        let stop = &mut case.document["stop"];
        if let Some(error) = row.error {
            *stop = json!({ "relative_error": error, "view_relative_error": error, "max_passes": 1_000_000_000 });
        }
        stop["max_seconds"] = json!(seconds);
        case
    };
    // no pass of a large room ends within a second
    let case = until(settings.longest_job().max(LONG_ENOUGH));
    let runs = case.runs(super::measure::Repeats { most: 9, ..settings.repeats() })?;
    let names = case.prepare()?.plan.methods.names();
    let met = runs.iter().all(|run| run.met);
    let mut faster = Vec::new();
    let seconds = Quartiles::of(runs.iter().map(|run| run.passes)).median * WITHIN;
    for other in OTHERS.into_iter().filter(|other| met && !names.contains(other)) {
        let mut case = until(seconds);
        case.document["method"] = json!(other);
        // methods that refuse the case are left out
        let Ok(prepared) = case.prepare() else { continue };
        if Run::of(&prepared, 0.0).is_ok_and(|run| run.met && run.passes < seconds) {
            faster.push(other);
        }
    }
    Ok(Measured { runs, method: names.join(", "), faster })
}

/// Measures all rows on the current pool.
pub fn section(settings: &Settings, progress: Progress) -> Result<Section, ReportError> {
    let rows = rows(settings)?;
    let mut cells: Vec<Vec<String>> = Vec::new();
    let (mut first, mut before) = (f64::NAN, f64::NAN);
    for (number, row) in rows.iter().enumerate() {
        progress.step(number, rows.len(), row.name);
        let Measured { runs, method, faster } = measure(row, settings)?;
        let met = runs.iter().all(|run| run.met);
        let passes = Quartiles::of(runs.iter().map(|run| run.passes));
        let whole = Quartiles::of(runs.iter().map(|run| run.passes + run.set_up));
        if number == 0 {
            first = passes.median;
        }
        let (asked, found) = match row.asked {
            Asked::Seconds(most) => (time(most), passes.median / most),
            Asked::Whole(most) => (format!("{} in all", time(most)), whole.median / most),
            Asked::TimesFirst(times) => (format!("{times} times S1"), passes.median / (times * first)),
            Asked::TimesBefore(times) => (format!("{times} times the row before"), passes.median / (times * before)),
            Asked::Nothing => ("none".to_owned(), 0.0),
        };
        before = passes.median;
        let told = Quartiles::of(runs.iter().map(|run| run.told)).median;
        let verdict = match (row.asked, met && found <= 1.0) {
            (Asked::Nothing, _) => String::new(),
            (_, true) => "reached".to_owned(),
            (_, false) => format!("**not reached**, {} times", significant(found, 2)),
        };
        cells.push(vec![
            row.name.to_owned(),
            row.error.map_or_else(|| "its own".to_owned(), percent),
            asked,
            if met { as_time(&passes) } else { format!("not within {}", as_time(&passes)) },
            time(Quartiles::of(runs.iter().map(|run| run.set_up)).median),
            percent(told),
            runs.first().map_or_else(String::new, |run| run.estimate.passes.to_string()),
            method,
            if faster.is_empty() { "none".to_owned() } else { faster.join(", ") },
            verdict,
        ]);
    }
    let head = [
        "room",
        "error",
        "target",
        "time of passes",
        "set-up",
        "reported",
        "passes",
        "method",
        "methods faster by a third",
        "",
    ];
    Ok(Section {
        title: "Rooms as they are built".to_owned(),
        text: "Processor seconds of one thread to a relative error at 95 %, by the method that `auto` takes: medians \
               of runs with seeds of their own, quartiles in brackets; 1.96 % is a standard error of 1 %. *Set-up* is \
               from the document to the first pass, *reported* the standard error. Other methods are tried with two \
               thirds of that time. Offices have 2400 points, the warehouse 4000. Boxes like other rooms have their \
               floor area, tubes and grid."
            .to_owned(),
        tables: vec![Table {
            caption: "Targets, and the time that was needed".to_owned(),
            head: head.map(str::to_owned).into(),
            rows: cells,
        }],
        ..Section::default()
    })
}
