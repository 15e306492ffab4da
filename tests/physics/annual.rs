//! A year of daylight from a document to its files, against an independent program (tests/reference/annual).

use serde_json::{Value, json};
use skyduct::annual::weather::Record;
use skyduct::document::result::annual::{GridYearResult, WithInterval, YearResult};
use skyduct::document::result::weather_files::AnnualResult;
use skyduct::document::{FieldErrorCode, FileSource, JobDocument};
use skyduct::engine::progress::StoppedBy;
use skyduct::engine::spent::Spent;
use skyduct::output::npy;
use skyduct::present::outputs::{Annual, Format, Honeybee, Output};
use skyduct::present::prepared::{Prepared, prepare_document};
use skyduct::present::reader::ResultReader as _;

use crate::documents::{Folder, first_passes};
use crate::{documents, reference};

/// A classroom of 6 m x 6 m x 3 m with four tubes, over the synthetic year.
pub fn classroom() -> Value {
    let tube = |x: f64, y: f64| {
        json!({ "centre_m": [x, y], "diameter_m": 0.53, "reflectance": 0.98, "segments": [{ "length_m": 1.5 }],
                "collector": { "kind": "dome", "transmittance": 0.92 },
                "diffuser": { "kind": "lambertian", "transmittance": 0.8, "reflectance": 0.0 } })
    };
    json!({
        "annual": { "weather": "synthetic.epw", "dimming": {} },
        "room": { "size_m": [6, 6, 3], "surfaces": { "floor": { "reflectance": 0.2 }, "walls": { "reflectance": 0.5 },
                                                     "ceiling": { "reflectance": 0.7 } } },
        "tubes": [tube(1.5, 1.5), tube(4.5, 1.5), tube(1.5, 4.5), tube(4.5, 4.5)],
        "grids": [{ "name": "desks", "height_m": 0.85, "cells": [10, 10], "margin_m": 0.5 }],
        "stop": { "relative_error": 0.005 }
    })
}

pub fn prepared(document: &Value) -> Prepared {
    prepare_document(&JobDocument::parse(document.to_string().as_bytes()).unwrap(), &Folder).unwrap()
}

pub fn file(prepared: &Prepared, passes: u64, part: Annual, format: Format) -> Vec<u8> {
    let estimate = first_passes(prepared, passes);
    prepared.results(&estimate).file(&Output::Annual(part, format)).unwrap().unwrap().bytes.to_vec()
}

pub fn summary(prepared: &Prepared, passes: u64) -> YearResult {
    years(prepared, passes).first
}

pub fn years(prepared: &Prepared, passes: u64) -> AnnualResult {
    serde_json::from_slice(&file(prepared, passes, Annual::Summary, Format::Json)).unwrap()
}

/// Checks a value against that of the other program, whose response has an error of 7e-4 in lux, in its own unit `other`.
#[track_caller]
fn agrees(found: WithInterval, expected: f64, other: f64) {
    let standard_error = (found.high - found.low) / (2.0 * 1.959_964);
    let tolerance = 4.0 * standard_error.hypot(other);
    assert!((found.value - expected).abs() <= tolerance, "{found:?}: {expected} +- {tolerance}");
}

#[test]
fn a_classroom_agrees_with_another_program() {
    let found = summary(&prepared(&classroom()), 8);
    let klm_h: f64 = found.tubes.iter().map(|tube| tube.klm_h.value).sum();
    assert!((klm_h / 78_292.05 - 1.0).abs() < 2e-4, "{klm_h}");
    assert!((found.tubes[0].sky_share - 0.398_366).abs() < 1e-4);
    assert!((found.outside.median_diffuse_lux / 10_955.85 - 1.0).abs() < 1e-4);
    assert_eq!((found.conventions.lit_records, found.conventions.occupied_hours), (4396, 3650.0));
    let grid = &found.grids[0];
    // points of a metric per relative error of lux, as the other program found them, and one record of 3650
    let of_lux = 7e-4;
    for (autonomy, expected, slope) in [
        (&grid.autonomies[0].da_percent, 76.323, 14.1),
        (&grid.autonomies[1].da_percent, 49.509, 23.9),
        (&grid.autonomies[2].da_percent, 36.631, 25.0),
        (&grid.autonomies[1].cda_percent, 69.112, 25.0),
        (&grid.udi.below_percent, 23.677, 14.1),
        (&grid.udi.supplementary_percent, 26.814, 30.0),
    ] {
        agrees(*autonomy, expected, slope * of_lux + 0.027);
    }
    agrees(grid.median_lux, 259.529, of_lux * 260.0);
    agrees(grid.mean_lux, 445.197, of_lux * 446.0);
    agrees(grid.dimming.unwrap().saved_kwh, 432.249, of_lux * 433.0);
    assert_eq!(grid.udi.above_percent.value, 0.0);
    assert!(grid.sda_percent.low <= 44.0 && 44.0 <= grid.sda_percent.high, "{:?}", grid.sda_percent);
    assert_eq!(grid.en17037.len(), 4);
}

/// The sun leaves a tube off its centre by the hour, which points see: sums over the year with the centroid.
#[test]
fn points_of_the_thesis_room_agree_with_another_program() {
    let prepared = documents::prepare("S1", |document| {
        let fields = document.as_object_mut().unwrap();
        ["sky", "time", "location", "views"].iter().for_each(|field| drop(fields.remove(*field)));
        document["method"] = json!("auto");
        document["annual"] = json!({ "weather": "synthetic.epw", "thresholds_lux": [100, 200] });
        document["stop"] = json!({ "relative_error": 0.005 });
    });
    let points: Value =
        serde_json::from_slice(&file(&prepared, 32, Annual::Points(prepared.grids()[0].name.clone()), Format::Json))
            .unwrap();
    let column = |name: &str| {
        let columns = points["columns"].as_array().unwrap();
        let column = columns.iter().find(|column| column["name"] == name).unwrap_or_else(|| panic!("{name}"));
        ["values", "standard_errors"].map(|field| column[field].as_array().unwrap().clone())
    };
    let [exposure, errors] = column("exposure_klxh");
    let text = std::fs::read_to_string(reference::folder().join("annual/S1_synthetic_points_centroid.csv")).unwrap();
    let mut compared = 0;
    for line in text.lines().skip(1) {
        let row: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
        let sensor = row[1] as usize * 9 + row[0] as usize;
        let [found, error] = [&exposure, &errors].map(|values| values[sensor].as_f64().unwrap());
        // the other program leaves out what the centroid does to interreflected light: 5e-4
        assert!((found - row[2]).abs() <= 4.0 * error.hypot(5e-4 * row[2]), "{sensor}: {found} +- {error}: {}", row[2]);
        assert!(error < 7e-3 * found, "{sensor}: {error} of {found}");
        compared += 1;
    }
    assert_eq!(compared, 81);
}

#[test]
fn files_have_all_hours_and_sensors() {
    let prepared = prepared(&classroom());
    let text = |part: Annual, format: Format| String::from_utf8(file(&prepared, 2, part, format)).unwrap();
    let hours = text(Annual::Hours, Format::Csv);
    assert_eq!(hours.lines().count(), 1 + 4396);
    let fields = hours.lines().next().unwrap().split(',').count();
    assert!(hours.lines().all(|line| line.split(',').count() == fields));

    let array = file(&prepared, 2, Annual::Points("desks".to_owned()), Format::Npy);
    let length = usize::from(u16::from_le_bytes([array[8], array[9]]));
    let header = std::str::from_utf8(&array[10..10 + length]).unwrap();
    assert!(header.contains("'shape': (100, 8760)") && header.ends_with('\n') && (10 + length) % 64 == 0, "{header}");
    let lux: Vec<f32> =
        array[10 + length..].chunks_exact(4).map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap())).collect();
    assert_eq!(lux.len(), 100 * 8760);
    let ill = text(Annual::Points("desks".to_owned()), Format::Ill);
    assert_eq!((ill.lines().count(), ill.lines().next().unwrap().split('\t').count()), (100, 4396));
    let lighting = text(Annual::Lighting, Format::Csv);
    let fractions = |hour: &str| -> Vec<f64> {
        let rows = lighting.lines().skip(1).filter(|row| row.split(',').nth(2) == Some(hour));
        rows.map(|row| row.split(',').nth(3).unwrap().parse().unwrap()).collect()
    };
    assert!(lighting.lines().count() == 8761 && fractions("3.5").iter().all(|fraction| *fraction == 0.0));
    let noon = fractions("12.5");
    assert!(noon.len() == 365 && noon.iter().all(|fraction| (0.1..=1.0).contains(fraction)) && noon.contains(&0.1));

    let of_honeybee = |part: Honeybee, format: Format| file(&prepared, 2, Annual::Honeybee(part), format);
    let hours = String::from_utf8(of_honeybee(Honeybee::SunUpHours, Format::Txt)).unwrap();
    let hours: Vec<usize> = hours.lines().map(|hour| hour.parse().unwrap()).collect();
    let grids: Value = serde_json::from_slice(&of_honeybee(Honeybee::Grids, Format::Json)).unwrap();
    assert_eq!((grids[0]["full_id"].as_str(), grids[0]["count"].as_u64()), (Some("desks"), Some(100)));
    let study: Value = serde_json::from_slice(&of_honeybee(Honeybee::Study, Format::Json)).unwrap();
    assert_eq!(
        (study["study_hours"].as_array().unwrap().len(), study["study_hours"][8759].as_f64()),
        (8760, Some(8759.0))
    );
    let lit = of_honeybee(Honeybee::Points("desks".to_owned()), Format::Npy);
    let lit: Vec<f32> = lit[lit.len() - 4 * 100 * 4396..]
        .chunks_exact(4)
        .map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap()))
        .collect();
    for (place, hour) in hours.iter().enumerate().step_by(97) {
        assert_eq!((lit[place], lit[99 * 4396 + place]), (lux[*hour], lux[99 * 8760 + hour]));
    }

    // exposure is the sum of the hours
    let csv = text(Annual::Points("desks".to_owned()), Format::Csv);
    let place = csv.lines().next().unwrap().split(',').position(|name| name == "exposure_klxh").unwrap();
    let exposure: f64 = csv.lines().nth(1).unwrap().split(',').nth(place).unwrap().parse().unwrap();
    let sum: f64 = lux[..8760].iter().map(|lux| f64::from(*lux)).sum();
    assert!((1e-3 * sum / exposure - 1.0).abs() < 1e-5, "{sum} {exposure}");
    for part in [Annual::Fluxes, Annual::Autonomy("desks".to_owned()), Annual::ByHour("desks".to_owned())] {
        assert!(text(part, Format::Svg).starts_with("<svg"));
    }
}

/// A half year has half of the records; maintenance of half the light halves the lumens; a place too far away is refused.
#[test]
fn periods_factors_and_places() {
    let mut document = classroom();
    document["annual"]["period"] = json!({ "from": "07-01", "to": "12-31" });
    document["annual"]["maintenance"] = json!(vec![0.5; 12]);
    let half = summary(&prepared(&document), 2);
    assert_eq!((half.conventions.records, half.conventions.occupied_hours), (184 * 24, 1840.0));
    document["annual"]["maintenance"] = Value::Null;
    let whole = summary(&prepared(&document), 2);
    assert!((whole.tubes[0].klm_h.value / half.tubes[0].klm_h.value - 2.0).abs() < 1e-12);
    assert!(whole.tubes[0].monthly_klm_h[..6].iter().all(|month| *month == 0.0));

    document["location"] = json!({ "latitude_deg": 55.9, "longitude_deg": 12.4 });
    assert_eq!(summary(&prepared(&document), 1).site.latitude_deg, 55.9);
    document["location"] = json!({ "latitude_deg": 54.9, "longitude_deg": 12.4 });
    let refused = |document: &Value| {
        let document = JobDocument::parse(document.to_string().as_bytes()).unwrap();
        let refused = prepare_document(&document, &Folder).err().unwrap();
        refused.0[0].pointer.clone()
    };
    assert_eq!(refused(&document), "/location");
    document["location"] = Value::Null;
    document["annual"]["weather"] = json!("none.epw");
    assert_eq!(refused(&document), "/annual/weather");
    document["annual"] = json!({ "weather": "synthetic.epw", "period": { "from": "02-29", "to": "02-29" } });
    assert_eq!(refused(&document), "/annual/period");
    let mut many = classroom();
    many["grids"][0]["cells"] = json!([200, 200]);
    assert_eq!(refused(&many), "/grids");
    let mut clear = classroom();
    clear["tubes"][0]["diffuser"] = json!({ "kind": "clear", "transmittance": 0.9 });
    clear["grids"] = json!([{ "name": "wall", "points_m": [[1, 1, 1, 1, 0, 0]] }]);
    assert_eq!(refused(&clear), "/annual");
}

/// Compares some records of a year with jobs of these moments, before a horizon, an obstruction and the ground, with a straight tube that has a
/// horizon of its own, and one below a tilted pane.
#[test]
fn records_agree_with_single_moments_before_surroundings() {
    let tube = |x: f64, collector: Value| {
        json!({ "centre_m": [x, 1.5], "diameter_m": 0.4, "reflectance": 0.97, "segments": [{ "length_m": 0.8 }],
                "collector": collector, "diffuser": { "kind": "lambertian", "transmittance": 0.8, "reflectance": 0.0 } })
    };
    let mut document = json!({
        "room": { "size_m": [4, 3, 3], "rotation_deg": 30, "surfaces": { "floor": { "reflectance": 0.2 },
                  "walls": { "reflectance": 0.5 }, "ceiling": { "reflectance": 0.7 } } },
        "surroundings": { "horizon": [[0, 5], [120, 20], [240, 0]], "luminance_ratio": 0.2, "ground_reflectance": 0.3,
                          "obstructions": [{ "kind": "box", "size_m": [6, 2, 4], "position_m": [2, -8, 3] }] },
        "tubes": [tube(1.0, json!({ "kind": "open" })), tube(3.0, json!({ "kind": "flat", "transmittance": 0.9,
                  "tilt_deg": 35, "azimuth_deg": 180 }))],
        "grids": [{ "name": "desks", "height_m": 0.85, "cells": [4, 3] }],
        "stop": { "relative_error": 0.005 }
    });
    document["tubes"][0]["horizon"] = json!([[90, 15], [270, 30]]);
    let mut of_year = document.clone();
    of_year["annual"] = json!({ "weather": "synthetic.epw" });
    let of_year = prepared(&of_year);
    let year = summary(&of_year, 8);
    let of_tubes = year.tubes.iter().map(|tube| (tube.klm_h.high - tube.klm_h.low) / (2.0 * 1.96 * tube.klm_h.value));
    let of_tubes = of_tubes.fold(0.0, f64::max);
    assert!(of_tubes > 0.0 && of_tubes < 0.02, "{of_tubes}");
    let hours = String::from_utf8(file(&of_year, 8, Annual::Hours, Format::Csv)).unwrap();
    let weather = Folder.weather("synthetic.epw").unwrap();
    document["location"] = json!({ "latitude_deg": weather.site.latitude_deg, "longitude_deg": weather.site.longitude_deg,
                                   "elevation_m": weather.site.elevation_m });
    let offset = weather.site.utc_offset_hours;
    assert_eq!(offset.fract(), 0.0);
    for row in hours.lines().skip(1).filter(|row| row.contains(",9.5,") || row.contains(",15.5,")).step_by(250) {
        let fields: Vec<f64> = row.split(',').map(|field| field.parse().unwrap()).collect();
        let [month, day, hour] = [0, 1, 2].map(|field| fields[field]);
        let is_this = |record: &&Record| {
            (f64::from(record.month), f64::from(record.day), record.middle_hour) == (month, day, hour)
        };
        let record = weather.records.iter().find(is_this).unwrap();
        document["time"] =
            json!(format!("{}-{month:02}-{day:02}T{:02}:30:00{offset:+03}:00", weather.year_of_sun, hour.floor()));
        document["sky"] = json!({ "perez": { "direct_normal_irradiance_w_m2": record.direct_normal_w_m2, "dew_point_c": record.dew_point_c,
                                             "diffuse_horizontal_irradiance_w_m2": record.diffuse_horizontal_w_m2 } });
        let moment = prepared(&document);
        let estimate = first_passes(&moment, 3);
        let grid = moment.results(&estimate).grid("desks").unwrap().unwrap();
        let mean = |rows: &[Vec<Option<f64>>]| rows.iter().flatten().map(|value| value.unwrap()).sum::<f64>() / 12.0;
        let (lux, error) = (mean(&grid.illuminance_lux), mean(&grid.standard_error_lux));
        let found = *fields.last().unwrap();
        // beams of single moments have larger errors than the year
        let tolerance = 4.0 * error.hypot(2.0 * of_tubes * found) + 3e-3 * found;
        assert!((found - lux).abs() < tolerance, "{row}: {found} {lux} +- {error}");
    }
}

/// Three files, of which one is that of the document with less light: its own year, and the spread over all. Responses are computed once.
#[test]
fn several_weather_files_have_a_year_each() {
    let mut document = classroom();
    let alone = years(&prepared(&document), 2);
    assert!(alone.others.is_empty() && alone.over_files.is_empty());
    document["annual"]["weather"] = json!(["synthetic.epw", "synthetic.epw", "synthetic.epw"]);
    document["annual"]["weather"][1] = json!("half:synthetic.epw");
    let found = years(&prepared(&document), 2);
    assert_eq!(found.first, alone.first);
    assert_eq!(found.others.len(), 2);
    assert_eq!((found.others[0].weather.as_str(), &found.others[1]), ("half:synthetic.epw", &alone.first));
    let [half, whole] = [&found.others[0], &found.first].map(|year| year.grids[0].exposure_klxh.value);
    assert!(half > 0.3 * whole && half < 0.7 * whole, "{half} {whole}");
    let spread = found.over_files[0].metrics.iter().find(|metric| metric.name == "exposure_klxh").unwrap();
    assert_eq!([spread.least, spread.median, spread.largest], [half, whole, whole]);
    document["annual"]["weather"][2] = json!("none.epw");
    let refused = |document: &Value| {
        let parsed = JobDocument::parse(document.to_string().as_bytes()).unwrap();
        prepare_document(&parsed, &Folder).err().unwrap().0.remove(0)
    };
    assert_eq!(refused(&document).pointer, "/annual/weather/2");
    // 10 x 8760 hours x 12 positions of the sun are a million and more
    document["annual"]["weather"] = json!(vec!["synthetic.epw"; 10]);
    document["annual"]["suns_per_hour"] = json!(12);
    let fault = refused(&document);
    assert_eq!((fault.pointer.as_str(), fault.code), ("/annual/suns_per_hour", FieldErrorCode::TooMany), "{fault}");
}

/// Criteria that name a single moment are judged without a year, at these moments and under clear skies alone.
#[test]
fn moments_of_criteria_are_judged_without_a_year() {
    let mut document = classroom();
    document.as_object_mut().unwrap().remove("annual");
    document["location"] = json!({ "latitude_deg": 55.77, "longitude_deg": 12.5 });
    let judged = |time: &str, cie_type: u8| -> Vec<(String, f64, f64, f64)> {
        let mut document = document.clone();
        document["time"] = json!(time);
        document["sky"] = json!({ "cie_type": cie_type });
        let prepared = prepared(&document);
        let estimate = first_passes(&prepared, 8);
        let summary = prepared.summary(&estimate, Spent::NOTHING, StoppedBy::RelativeError);
        let verdicts = &summary.grids.unwrap()[0].verdicts;
        verdicts.iter().map(|of| (of.scheme.clone(), of.limit, of.low, of.high)).collect()
    };
    let leed = judged("2026-09-20T15:00:00+02:00", 12);
    assert!(
        leed.iter()
            .map(|(scheme, limit, ..)| (scheme.as_str(), *limit))
            .eq([55.0, 75.0, 90.0].map(|limit| ("LEED v4.1", limit)))
    );
    assert!(leed.iter().all(|(_, _, low, high)| 0.0 <= *low && low <= high && *high <= 100.0));
    let nbr = judged("2026-04-23T09:30:00-03:00", 1);
    assert!(
        nbr.iter()
            .map(|(scheme, limit, ..)| (scheme.as_str(), *limit))
            .eq([60.0, 90.0, 120.0].map(|limit| ("ABNT NBR 15575", limit)))
    );
    assert!(nbr.iter().all(|(_, _, low, high)| 0.0 < *low && *low < *high && *high < 1.1 * low));
    for (time, cie_type) in
        [("2026-09-20T15:00:00+02:00", 1), ("2026-09-20T14:00:00+02:00", 12), ("2026-04-23T09:30:30-03:00", 1)]
    {
        assert_eq!(judged(time, cie_type), [], "{time}");
    }
}

/// Other daylight of a year that is that of the tubes themselves doubles all illuminances; arrays of other shapes are refused.
#[test]
fn other_daylight_is_added_before_thresholds() {
    let mut document = classroom();
    let alone = prepared(&document);
    let of_alone = summary(&alone, 2);
    let array = file(&alone, 2, Annual::Points("desks".to_owned()), Format::Npy);
    document["annual"]["other_daylight"] = json!([{ "grid": "desks", "file": "other.npy" }]);
    let with_array = |document: &Value, array: &[u8]| {
        let document = JobDocument::parse(document.to_string().as_bytes()).unwrap();
        prepare_document(&document, &WithArray(array.to_vec()))
    };
    let both = summary(&with_array(&document, &array).unwrap(), 2);
    let [alone, both] = [&of_alone, &both].map(|year| &year.grids[0]);
    assert!((both.exposure_klxh.value / alone.exposure_klxh.value - 2.0).abs() < 1e-5);
    assert!(both.autonomies[1].da_percent.value > alone.autonomies[1].da_percent.value + 5.0);
    assert_eq!(both.en17037[0].by_factors_percent, alone.en17037[0].by_factors_percent);
    // no verdict of the tubes alone
    let judged = |year: &GridYearResult, of: &str| year.verdicts.iter().any(|verdict| verdict.clause.contains(of));
    for of in ["daylight factors", "ASE"] {
        assert!(judged(alone, of) && !judged(both, of));
    }
    assert_eq!([alone.ase_percent, both.ase_percent], [Some(0.0), None]);
    let short = npy::encode([100, 8759], std::iter::repeat_n(0.0, 875_900));
    let refused = with_array(&document, &short).err().unwrap();
    assert_eq!(refused.0[0].pointer, "/annual/other_daylight/0/file");
}

/// Weather of the examples, and one array.
struct WithArray(Vec<u8>);

impl FileSource for WithArray {
    fn load(&self, id: &str) -> Result<std::sync::Arc<skyduct::geometry::TriangleMesh>, String> {
        Folder.load(id)
    }

    fn weather(&self, id: &str) -> Result<std::sync::Arc<skyduct::annual::weather::Weather>, String> {
        Folder.weather(id)
    }

    fn array(&self, _: &str) -> Result<std::sync::Arc<npy::Array>, String> {
        npy::decode(&self.0).map(std::sync::Arc::new).map_err(|error| error.to_string())
    }
}

/// An eye before a wall has a small closure above it: its rating by the hour is that of the formula for a source of one place, with the background of
/// its own illuminance less the direct part; the eye that looks at the floor is none.
#[test]
fn eyes_have_a_rating_in_every_hour() {
    let mut document = classroom();
    let tube = json!({ "centre_m": [4.5, 3.0], "diameter_m": 0.2, "reflectance": 0.98, "segments": [{ "length_m": 0.5 }],
                       "collector": { "kind": "open" }, "diffuser": { "kind": "lambertian", "transmittance": 0.8, "reflectance": 0.0 } });
    document["tubes"] = json!([tube]);
    document["annual"]["schedule"] = json!({ "kind": "daylight_hours" });
    document["grids"] = json!([{ "name": "eyes", "points_m": [[1.5, 3.0, 1.2, 1, 0, 0], [1.5, 3.0, 1.2, 0, 0, -1]] }]);
    let prepared = prepared(&document);
    let hours = String::from_utf8(file(&prepared, 4, Annual::Hours, Format::Csv)).unwrap();
    let names: Vec<&str> = hours.lines().next().unwrap().split(',').collect();
    assert!(names.contains(&"eyes_1_ugr") && !names.contains(&"eyes_2_ugr"), "{names:?}");
    let array = file(&prepared, 4, Annual::Points("eyes".to_owned()), Format::Ill);
    let lux: Vec<f64> =
        String::from_utf8(array).unwrap().lines().next().unwrap().split('\t').map(|lux| lux.parse().unwrap()).collect();
    // 3 m ahead and 1.8 m above: the cosine at closure and eye, and 31 degrees above the line of sight
    let (distance, area) = (3.0f64.hypot(1.8), std::f64::consts::PI * 0.01);
    let solid_angle = area * 1.8 / distance.powi(3);
    let degrees = (1.8f64 / 3.0).atan().to_degrees();
    let index = (1e-3 * (35.2 - 1.22) * degrees + 1e-5 * 21.0 * degrees * degrees).exp();
    let mut compared = 0;
    for (row, lux) in hours.lines().skip(1).zip(&lux).step_by(50) {
        let fields: Vec<f64> = row.split(',').map(|field| field.parse().unwrap()).collect();
        let luminance = (fields[9] + fields[10]) / (std::f64::consts::PI * area);
        let background = (lux - luminance * solid_angle * 3.0 / distance) / std::f64::consts::PI;
        let expected = 8.0 * (0.25 * luminance * luminance * solid_angle / (index * index * background)).log10();
        // printed lux have two decimals
        if *lux > 2.0 {
            assert!((fields.last().unwrap() - expected.max(0.0)).abs() < 0.05, "{row}: {expected}");
            compared += usize::from(expected > 5.0);
        }
    }
    assert!(compared > 20, "{compared}");
    let points = String::from_utf8(file(&prepared, 4, Annual::Points("eyes".to_owned()), Format::Csv)).unwrap();
    assert!(points.lines().next().unwrap().contains("ugr_above_19_percent,ugr_above_19_percent_standard_error"));
}
