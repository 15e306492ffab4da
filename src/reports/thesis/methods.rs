//! Illuminance of the floor under the light pipe by every method (the thesis' section 6.2).

use serde_json::{Value, json};

use super::case::{Case, Tried, try_all};
use super::settings::{Progress, Settings};
use super::{printed, scenes};
use crate::page::{Figure, ReportError, Section, Table};
use crate::run::render_all;
use skyduct::estimate::GridEstimate;
use skyduct::figure::Heading;
use skyduct::figure::axes::Axis;
use skyduct::figure::curves::{Series, curves};
use skyduct::figure::false_colour::FalseColours;
use skyduct::figure::montage::montage;
use skyduct::figure::svg::svg;
use skyduct::figure::ticks::Steps;
use skyduct::output::png;
use skyduct::scene::Grid;

/// Passes of the methods in the full report.
const PHOTON_MAPPING_PASSES: u64 = printed::ILLUMINANCE_PASSES;
const OTHER_PASSES: u64 = 64;
const BIDIRECTIONAL_PASSES: u64 = 16;

/// Pixels per cell of the maps.
const CELL_PX: usize = 12;

/// Illuminance of the floor by one method.
struct Floor {
    name: String,
    passes: u64,
    grid: Grid,
    estimate: GridEstimate,
}

pub fn sections(settings: &Settings, progress: Progress) -> Result<Vec<Section>, ReportError> {
    let mut figures = Vec::new();
    let mut tables = Vec::new();
    let mut profiles = Vec::new();
    let mut left_out = String::new();
    for interreflection in [false, true] {
        let label = if interreflection { "light with interreflection" } else { "direct light alone" };
        let floor = scenes::floor([settings.cells; 2], interreflection)?;
        let Tried { results: floors, left_out: refused } =
            try_all(cases(&floor, interreflection, settings), |case, prepared| {
                progress(&format!("the floor under the pipe, {label}: {}", case.name));
                let mut estimate = render_all(prepared, |_| {})?;
                let grid = prepared.grids().first().cloned();
                let (Some(grid), Some(of_grid)) = (grid, estimate.grids.pop()) else {
                    return Err(ReportError::Case("a job without a grid".to_owned()));
                };
                Ok(Floor { name: case.name, passes: estimate.passes, grid, estimate: of_grid })
            })?;
        if !refused.is_empty() {
            left_out += &format!("\n\nNot in the table of {label}:{refused}");
        }
        let mut rows = if interreflection { Vec::new() } else { printed_rows() };
        rows.extend(floors.iter().map(row));
        tables.push(Table {
            caption: if interreflection {
                "The same with the reflections of the room (floor 0.2, walls 0.5, ceiling 0.7)".to_owned()
            } else {
                "Illuminance of the floor in lx, direct light alone; the thesis' own numbers first".to_owned()
            },
            head: COLUMNS.map(str::to_owned).into(),
            rows,
        });
        figures.push(maps(&floors, interreflection)?);
        profiles.extend(profile(&floors, interreflection));
    }
    figures.push(Figure {
        file: "floor_profile.svg",
        caption: "Illuminance along the floor's middle from west to east: lines HOLIGILM and the formula of Jenkins, \
                  Muneer and Kubie, marks PPM and SPPM with the thesis' settings, without and with interreflection."
            .to_owned(),
        bytes: svg(&curves(
            &Heading::of("Illuminance along the middle of the floor"),
            &profiles,
            Axis::linear("x in m", [0.0, scenes::ROOM_M], 10, Steps::Decimal),
            Axis::linear("illuminance in lx", [0.0, 80.0], 8, Steps::Decimal),
        ))?
        .into_bytes(),
    });
    Ok(vec![Section {
        title: "2. The floor under the light pipe, by every method".to_owned(),
        text: format!(
            "An 80-inch cube with a 10-inch pipe (section 6.2). What HOLIGILM computed there is consistent with one case \
             only: 13:00 UTC on 15 September 2011 in Kgs. Lyngby, sky type 12 without sun, the turbidity form of the \
             zenith luminance, no interreflection, and 519 lm into the room; `examples/holigilm_thesis.json` is that case. \
             The grid has {cells} x {cells} points; SPPM, which at points is PPM, has their cells \
             instead. Uniformity is the lowest over the mean value. Positions are in metres \
             from the south-west corner; the pipe is at ({middle:.3}, {middle:.3}).{left_out}",
            cells = settings.cells,
            middle = 0.5 * scenes::ROOM_M,
        ),
        tables,
        figures,
        ..Section::default()
    }])
}

const COLUMNS: [&str; 8] =
    ["method", "mean", "standard error of the mean", "highest", "at", "lowest", "uniformity", "passes"];

/// Returns a case for every method of this program. Scheduled radii and own settings are compared with interreflection only,
/// because direct light is not gathered and does not depend on them.
fn cases(floor: &Value, interreflection: bool, settings: &Settings) -> Vec<Case> {
    let photon_mapping = scenes::passes(floor.clone(), settings.share(PHOTON_MAPPING_PASSES));
    let other = scenes::passes(floor.clone(), settings.share(OTHER_PASSES));
    // at points SPPM would be PPM: it gets averages over cells
    let mut regions = photon_mapping.clone();
    regions["grids"][0]["estimate"] = "cell_average".into();
    let scheduled = |kind: &str| {
        let mut method = scenes::thesis_method(kind, settings);
        method["radius"] = "schedule".into();
        method
    };
    let bidirectional = scenes::passes(floor.clone(), settings.share(BIDIRECTIONAL_PASSES));
    let mut cases = vec![
        Case::new("HOLIGILM", other.clone(), "holigilm".into()),
        Case::new("Jenkins, Muneer and Kubie", other.clone(), "jenkins".into()),
        Case::new("two stages", other.clone(), "two_stage".into()),
        Case::new("light tracing", other.clone(), "light_tracing".into()),
        Case::new("path tracing", other.clone(), "path_tracing".into()),
        Case::new("bidirectional path tracing", bidirectional, "bidirectional_path_tracing".into()),
        Case::new("photon mapping", other, json!({ "kind": "photon_mapping" })),
        Case::new("PPM, thesis' settings", photon_mapping.clone(), scenes::thesis_method("ppm", settings)),
        Case::new("SPPM, thesis' settings", regions.clone(), scenes::thesis_method("sppm", settings)),
    ];
    if interreflection {
        cases.extend([
            Case::new("PPM, thesis' settings, scheduled radius", photon_mapping.clone(), scheduled("ppm")),
            Case::new("SPPM, thesis' settings, scheduled radius", regions.clone(), scheduled("sppm")),
            Case::new("PPM, own settings", photon_mapping, scenes::own_method("ppm", settings)),
            Case::new("SPPM, own settings", regions, scenes::own_method("sppm", settings)),
        ]);
    }
    cases
}

fn printed_rows() -> Vec<Vec<String>> {
    let row = |thesis: &printed::Illuminance| {
        let at = thesis.highest_at.map_or("under the pipe".to_owned(), |[x, y]| format!("pixel ({x}, {y})"));
        vec![
            format!("the thesis, {}", thesis.method),
            thesis.mean_lux.to_string(),
            String::new(),
            thesis.highest_lux.to_string(),
            at,
            String::new(),
            String::new(),
            thesis.iterations.map_or(String::new(), |iterations| iterations.to_string()),
        ]
    };
    [printed::HOLIGILM, printed::PPM, printed::SPPM].iter().map(row).collect()
}

fn row(floor: &Floor) -> Vec<String> {
    let Floor { name, passes, grid, estimate } = floor;
    let value = |sensor: &usize| estimate.illuminance_lux(*sensor);
    let sensors = || 0..estimate.sensors.len();
    let highest = sensors().max_by(|a, b| value(a).total_cmp(&value(b))).unwrap_or(0);
    let lowest = sensors().map(|sensor| value(&sensor)).fold(f64::INFINITY, f64::min);
    let error = estimate.mean.standard_error();
    vec![
        name.clone(),
        format!("{:.3}", estimate.mean.mean),
        if error.is_finite() { format!("{error:.4}") } else { "unknown".to_owned() },
        format!("{:.2}", value(&highest)),
        format!("({:.2}, {:.2})", grid.x_m[highest % grid.cells[0]], grid.y_m[highest / grid.cells[0]]),
        format!("{lowest:.2}"),
        format!("{:.3}", lowest / estimate.mean.mean),
        passes.to_string(),
    ]
}

fn values(floor: &Floor) -> Vec<f64> {
    (0..floor.estimate.sensors.len()).map(|sensor| floor.estimate.illuminance_lux(sensor)).collect()
}

fn maps(floors: &[Floor], interreflection: bool) -> Result<Figure, ReportError> {
    // the scale is that of the methods without noise, which come first
    let colours = FalseColours::illuminance(&floors.iter().take(1).flat_map(values).collect::<Vec<_>>());
    let mut pictures = Vec::new();
    for floor in floors {
        let map = colours.heat_map(floor.grid.cells, &values(floor))?.enlarged(CELL_PX);
        pictures.push((short(&floor.name), map));
    }
    let names = floors.iter().map(|floor| floor.name.as_str()).collect::<Vec<_>>().join("; ");
    let (file, light) = if interreflection {
        ("floor_total.png", "with interreflection")
    } else {
        ("floor_direct.png", "direct light alone")
    };
    Ok(Figure {
        file,
        caption: format!(
            "Illuminance of the floor in lx, {light}, north up; all on the scale of HOLIGILM, what is beyond it has the \
             colour of its end: {names}."
        ),
        bytes: png::encode(&colours.with_scale(&montage(&pictures, 4)?)?)?,
    })
}

/// Shortens a title to fit a map.
fn short(name: &str) -> String {
    name.replace("Jenkins, Muneer and Kubie", "Jenkins")
        .replace("bidirectional path tracing", "bidirectional")
        .replace(", thesis' settings, scheduled radius", " sched.")
        .replace(", thesis' settings", " thesis")
        .replace(", own settings", " own")
}

/// Returns series of illuminances along the row of cells through the middle.
fn profile(floors: &[Floor], interreflection: bool) -> Vec<Series> {
    let light = if interreflection { "total" } else { "direct" };
    let along = |floor: &Floor| {
        let first = floor.grid.cells[1] / 2 * floor.grid.cells[0];
        let value = |i: usize| (floor.grid.x_m[i], floor.estimate.illuminance_lux(first + i));
        (0..floor.grid.cells[0]).map(value).collect::<Vec<_>>()
    };
    let named = |name: &str| floors.iter().find(|floor| floor.name.starts_with(name));
    let mut drawn = vec![("HOLIGILM", true), ("PPM, thesis", false)];
    if interreflection {
        drawn.extend([("Jenkins", true), ("SPPM, thesis", false)]);
    }
    let series = |(name, line): (&str, bool)| {
        let floor = named(name)?;
        let points = along(floor);
        let (line, marks) = if line { (points, Vec::new()) } else { (Vec::new(), points) };
        Some(Series { name: format!("{}, {light}", short(&floor.name)), line, marks, ..Series::default() })
    };
    drawn.into_iter().filter_map(series).collect()
}
