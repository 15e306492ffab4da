//! Every method on every scene: one matrix of comparisons, with one false-alarm rate.
//!
//! A row is a scene with the values that it must have: closed forms, radiosity, renders by others' programs, or long
//! renders by a method of another family that are stored (`reference/oracles`). A column is a method with its settings. In
//! each cell the method renders the scene, and all its values are compared: every sensor, the mean of every grid, blocks
//! of 8 x 8 pixels of every view and its mean, the flux through every tube. A method that cannot must say so, with the code
//! that its row lists; one whose error is known not to know all is left out by its row, which says why. One comparison more
//! for each column pools the means of all rows: a fault of 1 % in all that a method does is far beyond that error, though
//! it may be within the errors of each cell.
//!
//! A comparison is by Student's t with the standard errors of both sides, and all comparisons of the matrix together have
//! [`FALSE_ALARM`] by Sidak's correction. Nothing else allows for anything. Standard errors of density estimates contain
//! their bias, whose square is not normally distributed: they have to cover the difference with the same quantile.
//!
//! Each row is a test, so that one row can be run alone; it is judged as strictly as in the whole.

pub mod columns;

mod oracles;
pub mod render;
pub mod row;
mod rows;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{LazyLock, OnceLock};
use std::time::Instant;

use skyduct::integrator::method::RefusalCode;

use self::columns::{COLUMNS, Column, Family};
use self::render::{Effort, Left, render, seed};
use self::row::Row;
pub use self::row::compare_all;
use crate::judge::{self, Deviation, Verdict, deviation, sigmas};

/// Probability that a change of the random numbers alone lets any comparison of the matrix fail.
const FALSE_ALARM: f64 = 0.01;

/// The standard error's own error is 18 %, which Student's t takes into account.
const EFFORT: Effort = Effort { passes: 16, factor: 1.0, long: false };

/// Effort of the long trial: two fifths of the errors.
const LONG_EFFORT: Effort = Effort { passes: 24, factor: 4.0, ..EFFORT };

/// Largest relative standard error of the mean of a cell: a comparison with an unbounded error would say nothing.
const LARGEST_ERROR: f64 = 0.1;

/// Largest relative error in common of a method's means that may stay unseen.
const UNSEEN: f64 = 0.01;

/// A row by name, the methods that refuse it, and why.
struct Entry {
    name: &'static str,
    make: fn() -> Row,
    refused: &'static [(&'static str, RefusalCode)],
}

impl Entry {
    /// Names of the methods that refuse the row; fails if one is listed twice.
    fn columns_that_refuse(&self) -> BTreeSet<&'static str> {
        let columns: BTreeSet<_> = self.refused.iter().map(|(column, _)| *column).collect();
        assert_eq!(columns.len(), self.refused.len(), "{}: a method is listed twice", self.name);
        columns
    }
}

macro_rules! rows {
    ($($room:ident::$name:ident [$($column:ident: $code:ident),*],)*) => {
        const ROWS: &[Entry] = &[$(Entry {
            name: stringify!($name),
            make: rows::$room::$name,
            refused: &[$((stringify!($column), RefusalCode::$code)),*],
        }),*];

        mod every_method_agrees {
            $(#[test] fn $name() { super::judge_row(stringify!($name)); })*
        }
    };
}

rows! {
    documents::s1_points [],
    documents::s1_cells [],
    documents::s2_points [
        path_tracing: SunThroughClearClosures, two_stage: ClearClosures
    ],
    documents::s2_cells [
        path_tracing: SunThroughClearClosures, two_stage: ClearClosures
    ],
    documents::s3_points [],
    documents::s3_cells [],
    documents::s3_mesh_points [holigilm: MeshTubes],
    documents::s3_mesh_cells [holigilm: MeshTubes],
    documents::cornell_box [light_tracing: GridsOnly, holigilm: GridsOnly],
    documents::glossy_walls [holigilm: SpecularSurfaces],
    documents::mirror_in_the_sun [
        path_tracing: SunByMirrors, two_stage: SunByMirrors, holigilm: Objects
    ],
    documents::furniture [holigilm: Objects],
    documents::two_tubes [],
    documents::measured_diffuser [
        two_stage: MeasuredDiffusers, holigilm: MeasuredDiffusers
    ],
    radiosity::black_points [],
    radiosity::usual_with_black_disc_cells [],
    radiosity::usual_points [],
    radiosity::grey_with_black_disc_points [],
    radiosity::grey_cells [],
    radiosity::white_points [],
    radiosity::white_cells [],
    plain::two_mixed_dim_sun_points [path_tracing: SunThroughClearClosures],
    plain::two_mixed_dim_sun_cells [path_tracing: SunThroughClearClosures],
    plain::below_a_bend_points [],
    plain::below_a_bend_sun_cells [],
    plain::short_tube_bright_sun_points [],
    plain::glossy_wall_cells [holigilm: SpecularSurfaces],
    plain::glossy_wall_points [holigilm: SpecularSurfaces],
    plain::mirror_wall_cells [holigilm: SpecularSurfaces],
    plain::large_grid_points [],
    furnished::scattering_points [
        two_stage: MeasuredDiffusers, holigilm: Objects
    ],
    furnished::scattering_sun_cells [
        two_stage: MeasuredDiffusers, holigilm: Objects
    ],
    furnished::peaked_sun_points [
        two_stage: MeasuredDiffusers, holigilm: Objects
    ],
    furnished::matt_points [holigilm: Objects],
    furnished::matt_sun_cells [holigilm: Objects],
    furnished::domed_sun_points [holigilm: Objects],
    furnished::clear_sun_points [
        path_tracing: SunThroughClearClosures, two_stage: ClearClosures, holigilm: Objects
    ],
    furnished::clear_sun_cells [
        path_tracing: SunThroughClearClosures, two_stage: ClearClosures, holigilm: Objects
    ],
    furnished::mixed_sun_cells [
        path_tracing: SunThroughClearClosures, holigilm: Objects
    ],
    furnished::bent_clear_points [
        light_tracing: ClearClosuresOfBentTubes, two_stage: ClearClosures, holigilm: Objects
    ],
    furnished::bent_clear_cells [two_stage: ClearClosures, holigilm: Objects],
    furnished::bent_mixed_points [
        light_tracing: ClearClosuresOfBentTubes, two_stage: ClearClosuresOfBentTubes, holigilm: Objects
    ],
    furnished::bent_mixed_cells [holigilm: Objects],
    furnished::mirror_cells [holigilm: Objects],
    furnished::mirrors_points [
        light_tracing: MirrorsAtPoints, two_stage: MirrorsAtPoints, holigilm: Objects
    ],
    furnished::between_mirrors_points [
        light_tracing: MirrorsAtPoints, holigilm: Objects
    ],
    furnished::between_mirrors_cells [holigilm: Objects],
    furnished::mirror_clear_sun_cells [
        path_tracing: SunThroughClearClosures, bidirectional_path_tracing: SunThroughClearClosures,
        two_stage: ClearClosures, holigilm: Objects
    ],
    furnished::narrow_lobe_cells [holigilm: Objects],
    furnished::bent_clear_sun_points [
        light_tracing: ClearClosuresOfBentTubes, path_tracing: SunThroughClearClosures,
        bidirectional_path_tracing: SunThroughClearClosures, two_stage: ClearClosures, holigilm: ClearClosuresOfBentTubes
    ],
    furnished::coloured_points [
        light_tracing: ClearClosuresOfBentTubes, two_stage: ClearClosuresOfBentTubes, holigilm: Colours
    ],
    furnished::coloured_cells [holigilm: Colours],
    furnished::coloured_tube_points [holigilm: Colours],
    furnished::corners_and_crowded_sensors [
        light_tracing: PointsNearSurfaces, two_stage: MeasuredDiffusers, holigilm: Objects
    ],
    furnished::twenty_tubes_points [],
    furnished::beside_boxes_and_walls_points [light_tracing: PointsNearSurfaces, holigilm: Colours],
    furnished::leaning_board_sun_points [holigilm: Objects],
    furnished::dark_desks_points [holigilm: Objects],
    furnished::bright_chairs_points [holigilm: Objects],
    furnished::desks_and_chairs_beside_walls_points [holigilm: Objects],
    sun::patterns_of_a_low_sun_points [],
    sun::patterns_of_the_sun_cells [],
    sun::patterns_of_a_high_sun_points [],
    sun::interreflection_of_the_sun_points [light_tracing: PointsNearSurfaces],
    sun::beside_walls_points [],
    sun::beside_walls_cells [],
    rooms::l_hall_points [holigilm: RoomShape],
    rooms::attic_points [holigilm: RoomShape],
    rooms::gable_points [holigilm: RoomShape],
    rooms::skew_points [holigilm: RoomShape],
    rooms::l_hall_sensors [
        light_tracing: PlacedSensors, bidirectional_path_tracing: PlacedSensors, photon_mapping: PlacedSensors,
        ppm: PlacedSensors, ppm_per_point: PlacedSensors, sppm: PlacedSensors, sppm_per_point: PlacedSensors, holigilm: PlacedSensors
    ],
    rooms::attic_sensors [
        light_tracing: PlacedSensors, bidirectional_path_tracing: PlacedSensors, photon_mapping: PlacedSensors,
        ppm: PlacedSensors, ppm_per_point: PlacedSensors, sppm: PlacedSensors, sppm_per_point: PlacedSensors, holigilm: PlacedSensors
    ],
    rooms::skew_sensors [
        light_tracing: PlacedSensors, bidirectional_path_tracing: PlacedSensors, photon_mapping: PlacedSensors,
        ppm: PlacedSensors, ppm_per_point: PlacedSensors, sppm: PlacedSensors, sppm_per_point: PlacedSensors, holigilm: PlacedSensors
    ],
    rooms::tilted_openings_points [holigilm: RoomShape],
    rooms::tilted_clear_openings_cells [two_stage: ClearClosures, holigilm: RoomShape],
    effects::no_interreflection_cells [holigilm: Objects],
    effects::no_guide_return_cells [holigilm: Objects],
    effects::no_guide_return_clear_cells [holigilm: Objects],
    effects::no_objects_cells [holigilm: Luminaires],
    electric::panels_points [holigilm: Objects],
    electric::below_a_panel_cells [holigilm: Objects],
    electric::panels_cells [holigilm: Objects],
    images::mirrored_lambertian_points [
        light_tracing: MirrorsAtPoints, holigilm: SpecularSurfaces
    ],
    images::mirrored_lambertian_cells [holigilm: SpecularSurfaces],
    images::mirrored_clear_points [
        light_tracing: MirrorsAtPoints, two_stage: ClearClosures, holigilm: SpecularSurfaces
    ],
    images::mirrored_clear_cells [
        two_stage: ClearClosures, holigilm: SpecularSurfaces
    ],
    images::mirrored_panel_cells [holigilm: Luminaires],
    images::view_of_a_mirrored_tube [light_tracing: GridsOnly, holigilm: GridsOnly],
    images::view_of_a_mirrored_panel [light_tracing: GridsOnly, holigilm: GridsOnly],
    images::mesh_block_on_the_floor [holigilm: Objects],
    images::view_of_a_mesh_block [light_tracing: GridsOnly, holigilm: GridsOnly],
    images::mesh_block_at_its_top [holigilm: Objects],
    images::mesh_block_at_its_top_cells [holigilm: Objects],
    images::mesh_block_cut_by_cells [holigilm: Objects],
    images::rug_points [holigilm: Objects],
    sheets::sheet_of_two_sides_points [holigilm: Objects],
    images::lambertian_table_points [
        two_stage: MeasuredDiffusers, holigilm: MeasuredDiffusers
    ],
    images::lambertian_table_below_a_bend_cells [
        two_stage: MeasuredDiffusers, holigilm: MeasuredDiffusers
    ],
    views::into_the_room [light_tracing: GridsOnly, holigilm: GridsOnly],
    views::up_in_the_sun [
        light_tracing: GridsOnly, two_stage: MeasuredDiffusers, holigilm: GridsOnly
    ],
    views::up_matt_in_the_sun [light_tracing: GridsOnly, holigilm: GridsOnly],
    views::sun_patch [
        light_tracing: GridsOnly, path_tracing: SunThroughClearClosures, two_stage: ClearClosures, holigilm: GridsOnly
    ],
    views::up_the_pipe [
        light_tracing: GridsOnly, two_stage: ClearClosures, holigilm: GridsOnly
    ],
    views::up_a_bent_pipe [
        light_tracing: GridsOnly, two_stage: ClearClosures, holigilm: GridsOnly
    ],
    views::mirror [light_tracing: GridsOnly, holigilm: GridsOnly],
    views::mirror_box [
        light_tracing: GridsOnly, two_stage: MeasuredDiffusers, holigilm: GridsOnly
    ],
    views::sky_in_a_mirror [
        light_tracing: GridsOnly, two_stage: ClearClosures, holigilm: GridsOnly
    ],
    views::sun_in_a_mirror [
        light_tracing: GridsOnly, path_tracing: SunThroughClearClosures, bidirectional_path_tracing: SunByMirrors,
        two_stage: ClearClosures, holigilm: GridsOnly
    ],
    views::edges [
        light_tracing: GridsOnly, two_stage: MeasuredDiffusers, holigilm: GridsOnly
    ],
}

/// What the methods that accept a row have found, compared with its oracle.
#[derive(Default)]
struct Judged {
    /// By column: what is compared, and the result.
    verdicts: Vec<(&'static str, String, Verdict)>,
    refused: BTreeMap<&'static str, RefusalCode>,
    /// Columns that other rows judge.
    elsewhere: Vec<&'static str>,
    /// By column: relative deviations of the mean of the row's first output.
    deviations: BTreeMap<&'static str, Deviation>,
}

static JUDGED: [OnceLock<Judged>; ROWS.len()] = [const { OnceLock::new() }; ROWS.len()];

/// Probability below which a comparison fails.
static LIMIT: LazyLock<f64> = LazyLock::new(|| {
    let of = |entry: &Entry| (COLUMNS.len() - entry.columns_that_refuse().len()) * (entry.make)().comparisons();
    let comparisons = ROWS.iter().map(of).sum::<usize>() + COLUMNS.len();
    let limit = judge::each(FALSE_ALARM, comparisons);
    println!(
        "{comparisons} comparisons: each fails beyond {:.2} standard errors of a normal distribution",
        sigmas(limit)
    );
    limit
});

/// The row of that number, rendered once in a process.
fn judged(number: usize) -> &'static Judged {
    JUDGED[number].get_or_init(|| judge_entry(&ROWS[number], EFFORT))
}

fn judge_entry(entry: &Entry, effort: Effort) -> Judged {
    let row = (entry.make)();
    let mut judged = Judged::default();
    for column in COLUMNS {
        match judge_cell(entry, &row, column, effort, &mut judged) {
            Err(Left::Refused(code)) => drop(judged.refused.insert(column.name, code)),
            Err(Left::Elsewhere) => judged.elsewhere.push(column.name),
            Ok(()) | Err(Left::ByChance) => {}
        }
    }
    judged
}

/// True for what other rows judge: half of the rows have `sppm` by the schedule of its radius, each has `ppm` by one of both laws, and
/// half have the solver; the long trial has all. A refusal costs nothing, and is judged everywhere.
fn is_left_to_others(entry: &Entry, column: &Column) -> bool {
    let place = seed(&[entry.name]);
    let law: &[&str] = if place.is_multiple_of(2) { &["ppm"] } else { &["ppm_per_point", "sppm"] };
    let is_other = law.contains(&column.name) || (column.name == "holigilm" && (place / 2).is_multiple_of(2));
    is_other && entry.refused.iter().all(|(refused, _)| *refused != column.name)
}

fn judge_cell(entry: &Entry, row: &Row, column: &Column, effort: Effort, judged: &mut Judged) -> Result<(), Left> {
    let name = entry.name;
    if effort.factor <= EFFORT.factor && is_left_to_others(entry, column) {
        return Err(Left::Elsewhere);
    }
    let begun = Instant::now();
    let (method, found) = render(row, &row.scene, column, effort, seed(&[name, column.name]))?;
    let (oracle, bound) = oracles::values(name, row, Family::of(&method));
    let verdicts = compare_all(&found, &oracle, bound);
    judged.verdicts.extend(verdicts.into_iter().map(|(what, verdict)| (column.name, what, verdict)));
    let [found, oracle] = [&found, &oracle].map(|values| values.outputs[0].1);
    if let Some(deviation) = deviation(&found, &oracle, bound) {
        println!(
            "{name}, {}: mean {:+.3} % +- {:.3} %, bias {:+.3} %, {:.2} s",
            column.name,
            100.0 * deviation.value,
            100.0 * deviation.noise,
            100.0 * deviation.bias,
            begun.elapsed().as_secs_f64(),
        );
        judged.deviations.insert(column.name, deviation);
    }
    Ok(())
}

/// Fails unless the methods that the row lists refuse it, and all others agree with its oracle.
#[track_caller]
fn judge_row(name: &str) {
    let number = ROWS.iter().position(|entry| entry.name == name).unwrap();
    assert_agrees(&ROWS[number], judged(number));
}

#[track_caller]
fn assert_agrees(entry: &Entry, judged: &Judged) {
    let name = entry.name;
    let is_judged = |column: &&str| judged.elsewhere.iter().all(|left| left != column);
    let refused = entry.refused.iter().copied().filter(|(column, _)| is_judged(column)).collect();
    assert_eq!(judged.refused, refused, "{name}: refusals");
    let failures = judged.verdicts.iter().filter(|(.., verdict)| verdict.probability < *LIMIT);
    let failures: Vec<_> =
        failures.map(|(column, what, verdict)| format!("{column}: {what}, {:.2} standard errors", verdict.t)).collect();
    for column in COLUMNS {
        let of_column = judged.verdicts.iter().filter(|(name, ..)| *name == column.name);
        if let Some(worst) = of_column.map(|(.., verdict)| verdict.probability).reduce(f64::min) {
            println!("{name}, {}: worst {:.2} of {:.2}", column.name, sigmas(worst), sigmas(*LIMIT));
        }
        if let Some(it) = judged.deviations.get(column.name) {
            assert!(it.noise.hypot(it.bias) < LARGEST_ERROR, "{name}, {}: {it:?}", column.name);
        }
    }
    assert!(failures.is_empty(), "{name}: {failures:#?}");
}

/// What is wrong with a method everywhere is seen in the mean of all rows.
#[test]
fn no_method_deviates_in_the_mean_of_all_rows() {
    assert_means_agree(&(0..ROWS.len()).map(judged).collect::<Vec<_>>());
}

/// All rows with passes of four times as many paths, and their means.
#[test]
#[ignore = "minutes: four times the work of all rows"]
fn every_method_agrees_to_half_of_the_error() {
    let rows: Vec<_> = ROWS.iter().map(|entry| judge_entry(entry, LONG_EFFORT)).collect();
    ROWS.iter().zip(&rows).for_each(|(entry, judged)| assert_agrees(entry, judged));
    assert_means_agree(&rows.iter().collect::<Vec<_>>());
}

#[track_caller]
fn assert_means_agree(rows: &[&Judged]) {
    let mut failures = Vec::new();
    for column in COLUMNS {
        let deviations: Vec<_> = rows.iter().filter_map(|row| row.deviations.get(column.name)).copied().collect();
        let (mean, verdict) = judge::pool(&deviations);
        // the error at which the comparison would fail
        let seen = sigmas(*LIMIT) * mean.error;
        println!(
            "{}: {:+.4} % +- {:.4} % over {} rows: {:.2} standard errors; {:.2} % would be seen",
            column.name,
            100.0 * mean.value,
            100.0 * mean.error,
            deviations.len(),
            verdict.t,
            100.0 * seen,
        );
        assert!(seen < UNSEEN, "{}: an error of {seen} would not be seen", column.name);
        if verdict.probability < *LIMIT {
            failures.push(format!("{}: {mean:?}, {:.2} standard errors", column.name, verdict.t));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

/// Names in the table are names of columns, each once in a row, and leave methods to compare.
#[test]
fn refusals_name_columns() {
    for entry in ROWS {
        let refused = entry.columns_that_refuse();
        for name in &refused {
            assert!(COLUMNS.iter().any(|column| column.name == *name), "{}: {name}", entry.name);
        }
        assert!(refused.len() + 1 < COLUMNS.len(), "{}: nobody is compared", entry.name);
    }
}

/// Stored renders are what their methods give with other random numbers; `reference/oracles/make` calls this to write them
/// anew, those that `REMAKE_ORACLES` names or all. `CHECK_ORACLES` names those to check; without it all are.
#[test]
#[ignore = "minutes: every stored render is made again"]
fn stored_oracles_hold() {
    let asked = std::env::var("REMAKE_ORACLES").ok();
    let named = asked.clone().or_else(|| std::env::var("CHECK_ORACLES").ok());
    let names = |entry: &&Entry| {
        let names = named.as_deref().unwrap_or_default();
        names.is_empty() || names.split_whitespace().any(|name| name == entry.name)
    };
    let mut verdicts = Vec::new();
    for entry in ROWS.iter().filter(names) {
        let begun = Instant::now();
        let row = (entry.make)();
        match asked {
            Some(_) => oracles::make(entry.name, &row),
            None => verdicts.extend(oracles::check(entry.name, &row)),
        }
        println!("{}: {:.1} s", entry.name, begun.elapsed().as_secs_f64());
    }
    let limit = judge::each(FALSE_ALARM, verdicts.len().max(1));
    let failures: Vec<_> = verdicts.iter().filter(|(_, verdict)| verdict.probability < limit).collect();
    assert!(failures.is_empty(), "{failures:#?}");
}
