//! Completion of records: what is missing is computed from what is there, or copied from another day.

use glam::DVec3;
use skyduct_physics::sky::sun::SunPositionError;
use skyduct_physics::sky::{Irradiances, PerezSky};

use super::closure::{self, SunOfFile};
use super::file::{FileReport, Weather};
use super::line::WeatherError;
use super::record::{Record, usual_offset_minutes};
use super::rows::{RepairKind, Repairs, Row, Rows, USUAL_DEW_POINT_C};
use crate::calendar::day_of_year;
use crate::sun::{SINE_OF_LOW_SUN, SunOverSite};

/// Highest share of the hours with the sun up that may be copied from other days.
const MOST_COPIED: f64 = 0.01;

/// Luminous efficacy in lm/W from which those of a state of the sky are found, in so many rounds, with the sun at least this high (sine).
const TYPICAL_LM_PER_W: f64 = 110.0;
const ROUNDS: usize = 12;
const LEAST_SINE: f64 = 0.01;

/// Returns the weather of rows, tested and completed.
pub(super) fn weather(mut rows: Rows) -> Result<Weather, WeatherError> {
    let first_line = rows.first_line;
    let of_sun = |error: SunPositionError| WeatherError::of_line(first_line, error.to_string());
    let sun = SunOverSite::new(&rows.site, rows.year_of_sun);
    let closure = closure::test(&rows, &sun).map_err(of_sun)?;
    let usual = usual_offset_minutes(rows.format, rows.records_per_hour);
    let sun_offset_minutes = match closure.map(|closure| closure.sun) {
        Some(SunOfFile::OfComment(minutes)) => minutes,
        _ => usual,
    };
    let mut repairs = std::mem::take(&mut rows.repairs);
    let sine = |row: &Row| {
        let hour = row.middle_hour + (sun_offset_minutes - usual) / 60.0;
        sun.at(day_of_year(rows.year_of_sun, row.date), hour).map(|sun| sun.z)
    };
    let mut irradiances = Vec::with_capacity(rows.rows.len());
    for (k, row) in rows.rows.iter().enumerate() {
        let completed = match row.illuminances_lux.filter(|_| rows.is_photometric) {
            Some(lux) => sine(row).map(|sine| Some(irradiances_of(lux, sine, day_of_year(rows.year_of_sun, row.date)))),
            None => completed(row, || sine(row), rows.direct_is_horizontal, (&mut repairs, first_line + k)),
        };
        irradiances.push(completed.map_err(of_sun)?);
    }
    let per_day = 24 * rows.records_per_hour as usize;
    let up = || rows.rows.iter().map(|row| Ok(usize::from(sine(row)? > 0.0))).sum::<Result<usize, _>>().map_err(of_sun);
    fill(&mut irradiances, (&mut repairs, first_line), per_day, up)?;
    let record = |(row, irradiances): (&Row, Option<[f64; 2]>)| {
        let [direct_normal_w_m2, diffuse_horizontal_w_m2] = irradiances.unwrap_or_default();
        Record {
            month: row.date.0,
            day: row.date.1,
            middle_hour: row.middle_hour,
            direct_normal_w_m2,
            diffuse_horizontal_w_m2,
            dew_point_c: row.dew_point_c,
            illuminances_lux: row.illuminances_lux,
        }
    };
    Ok(Weather {
        records: rows.rows.iter().zip(irradiances).map(record).collect(),
        site: rows.site,
        records_per_hour: rows.records_per_hour,
        year_of_sun: rows.year_of_sun,
        sun_offset_minutes,
        first_weekday: rows.first_weekday,
        daylight_saving: rows.daylight_saving,
        file: FileReport {
            format: rows.format,
            is_photometric: rows.is_photometric,
            comments: rows.comments,
            first_line,
            closure,
            repairs: repairs.listed(),
        },
    })
}

/// Computes direct normal and diffuse horizontal irradiance in W/m2 that have these illuminances in lux by the efficacies of Perez, under a sun
/// of this sine of the altitude; they tell the state of the sky.
fn irradiances_of([direct_lux, diffuse_lux]: [f64; 2], sine: f64, day_of_year: u16) -> [f64; 2] {
    let z = sine.clamp(LEAST_SINE, 1.0);
    let sun = DVec3::new(0.0, ((1.0 - z) * (1.0 + z)).sqrt(), z);
    let [mut direct, mut diffuse] = [direct_lux, diffuse_lux].map(|lux| lux / TYPICAL_LM_PER_W);
    for _ in 0..ROUNDS {
        let irradiances = Irradiances {
            direct_normal_w_m2: direct,
            diffuse_horizontal_w_m2: diffuse,
            dew_point_c: USUAL_DEW_POINT_C,
        };
        let sky = PerezSky::new(irradiances, sun, Some(day_of_year));
        let found = [sky.direct_normal_illuminance_lux(), sky.diffuse_horizontal_illuminance_lux()];
        // a low sun can have no efficacy
        direct *= if found[0] > 0.0 { direct_lux / found[0] } else { 1.0 };
        diffuse *= if found[1] > 0.0 { diffuse_lux / found[1] } else { 1.0 };
    }
    [direct, diffuse]
}

/// Returns direct normal and diffuse horizontal irradiance of a row in W/m2, with one of them computed if it is missing; none if both are.
///
/// `sine` computes the sine of the sun's altitude. A night has no light, whatever is missing.
fn completed(
    row: &Row,
    sine: impl Fn() -> Result<f64, SunPositionError>,
    direct_is_horizontal: bool,
    (repairs, line): (&mut Repairs, usize),
) -> Result<Option<[f64; 2]>, SunPositionError> {
    let (global, direct, diffuse) = (row.global_w_m2, row.direct_normal_w_m2, row.diffuse_w_m2);
    if let (Some(direct), Some(diffuse)) = (direct, diffuse) {
        return Ok(Some([direct, diffuse]));
    }
    let sine = sine()?;
    Ok(match (global, direct, diffuse) {
        (Some(global), None, Some(diffuse)) => {
            if !direct_is_horizontal {
                repairs.count(RepairKind::MissingDirect, line);
            }
            let horizontal = (global - diffuse).max(0.0);
            if sine <= SINE_OF_LOW_SUN && horizontal > 0.0 {
                repairs.count(RepairKind::LowDirect, line);
            }
            Some([if sine > SINE_OF_LOW_SUN { horizontal / sine } else { 0.0 }, diffuse])
        }
        (Some(global), Some(direct), None) => {
            repairs.count(RepairKind::MissingDiffuse, line);
            Some([direct, (global - direct * sine.max(0.0)).max(0.0)])
        }
        _ if sine <= 0.0 => Some([0.0, 0.0]),
        _ => None,
    })
}

/// Fills records without irradiances with those of the same hour of the day before, or of the next day that has them.
///
/// `up` counts the records with the sun up.
fn fill(
    irradiances: &mut [Option<[f64; 2]>],
    (repairs, first_line): (&mut Repairs, usize),
    per_day: usize,
    up: impl Fn() -> Result<usize, WeatherError>,
) -> Result<(), WeatherError> {
    let missing: Vec<usize> = (0..irradiances.len()).filter(|k| irradiances[*k].is_none()).collect();
    let Some(first) = missing.first() else { return Ok(()) };
    let up = up()?;
    if missing.len() as f64 > MOST_COPIED * up as f64 {
        let detail = format!(
            "irradiances must not be missing in more than 1 % of the records with the sun up, but are in {} of {up}, first here",
            missing.len()
        );
        return Err(WeatherError::of_line(first_line + first, detail));
    }
    for k in missing {
        let before = k.checked_sub(per_day).and_then(|before| irradiances[before]);
        let after = || irradiances[k..].iter().step_by(per_day).find_map(|later| *later);
        irradiances[k] = before.or_else(after);
        repairs.count(RepairKind::MissingHour, first_line + k);
    }
    Ok(())
}
