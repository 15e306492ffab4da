//! Records of EPW files (EnergyPlus 2024, data dictionary).

use super::header::{self, Header};
use super::line::{Field, Line, WeatherError};
use super::order::Order;
use super::record::Format;
use super::rows::{RepairKind, Repairs, Row, Rows, USUAL_DEW_POINT_C};
use crate::calendar::{Date, days_of_month, is_leap, typical_year};

const YEAR: Field = Field { number: 1, name: "year" };
const MONTH: Field = Field { number: 2, name: "month" };
const DAY: Field = Field { number: 3, name: "day" };
const HOUR: Field = Field { number: 4, name: "hour" };
const MINUTE: Field = Field { number: 5, name: "minute" };
const DEW_POINT: Field = Field { number: 8, name: "dew point" };
const GLOBAL: Field = Field { number: 14, name: "global horizontal irradiance" };
pub(super) const DIRECT: Field = Field { number: 15, name: "direct normal irradiance" };
pub(super) const DIFFUSE: Field = Field { number: 16, name: "diffuse horizontal irradiance" };
const ILLUMINANCES: [Field; 2] = [
    Field { number: 18, name: "direct normal illuminance" },
    Field { number: 19, name: "diffuse horizontal illuminance" },
];

/// Number of the last field without which a record is none.
const LEAST_FIELDS: usize = 16;

/// Highest direct normal and diffuse horizontal irradiance in W/m2 that the sun can give on the ground; more is another unit, or a
/// shifted column.
pub(super) const HIGHEST_W_M2: [f64; 2] = [1450.0, 1100.0];

/// Illuminance in lux from which on it is missing.
const MISSING_LUX: f64 = 999_900.0;

/// Years of the calendar for which the sun's positions are computed as they are; others are those of typical years.
const YEARS: std::ops::RangeInclusive<f64> = 1583.0..=2999.0;

/// Reads the lines of a file, numbered from 1.
pub(super) fn read<'a>(mut lines: impl Iterator<Item = (usize, &'a str)>) -> Result<Rows, WeatherError> {
    let header = header::read(&mut lines)?;
    let mut order = Order::new(header.records_per_hour);
    let (mut rows, mut repairs) = (Vec::new(), Repairs::default());
    let (mut year, mut year_changes, mut reached) = (None, false, header.first_line - 1);
    for (number, text) in lines {
        let line = Line::at_commas(number, text);
        let of_year = line.value(YEAR)?;
        year_changes |= *year.get_or_insert(of_year) != of_year;
        rows.push(row(&line, &header, &mut order, &mut repairs)?);
        reached = number;
    }
    check_period(&order, &header, reached)?;
    if rows.iter().all(|row| row.illuminances_lux.is_none_or(|lux| lux == [0.0; 2])) {
        rows.iter_mut().for_each(|row| row.illuminances_lux = None);
    }
    let year_of_sun = match year {
        Some(year) if !year_changes && YEARS.contains(&year) && (is_leap(year as i32) || !order.has_leap_day()) => {
            year as i32
        }
        _ => typical_year(order.has_leap_day()),
    };
    let first = rows.first().map_or((1, 1), |row| row.date);
    let first_weekday = header.first_weekday.unwrap_or_else(|| crate::calendar::weekday(year_of_sun, first));
    Ok(Rows {
        format: Format::Epw,
        daylight_saving: header.daylight_saving(year_of_sun, (first, first_weekday))?,
        first_weekday,
        site: header.site,
        comments: header.comments,
        records_per_hour: header.records_per_hour,
        year_of_sun,
        first_line: header.first_line,
        rows,
        direct_is_horizontal: false,
        is_photometric: false,
        repairs,
    })
}

fn row(line: &Line, header: &Header, order: &mut Order, repairs: &mut Repairs) -> Result<Row, WeatherError> {
    if line.fields.len() < LEAST_FIELDS {
        let detail = format!("a record must have at least {LEAST_FIELDS} fields, but has {}", line.fields.len());
        return Err(WeatherError::of_line(line.number, detail));
    }
    let date = date(line, [MONTH, DAY])?;
    let hour = line.whole(HOUR, 1..=24)?;
    line.within(MINUTE, 0.0..=60.0)?;
    let place = order.take(line.number, date, usize::from(hour) - 1)?;
    let dew_point = line.value(DEW_POINT)?;
    let dew_point = (-90.0..99.9).contains(&dew_point).then_some(dew_point);
    if dew_point.is_none() {
        repairs.count(RepairKind::MissingDewPoint, line.number);
    }
    let [highest_direct, highest_diffuse] = HIGHEST_W_M2;
    Ok(Row {
        date,
        middle_hour: f64::from(hour - 1) + (place as f64 + 0.5) / f64::from(header.records_per_hour),
        global_w_m2: repairs.irradiance(line.value(GLOBAL)?, line.number),
        direct_normal_w_m2: irradiance(line, DIRECT, highest_direct, repairs)?,
        diffuse_w_m2: irradiance(line, DIFFUSE, highest_diffuse, repairs)?,
        dew_point_c: dew_point.unwrap_or(USUAL_DEW_POINT_C),
        illuminances_lux: illuminances(line)?,
    })
}

/// Reads month and day.
pub(super) fn date(line: &Line, [month_field, day_field]: [Field; 2]) -> Result<Date, WeatherError> {
    let month = line.whole(month_field, 1..=12)?;
    Ok((month, line.whole(day_field, 1..=days_of_month(month, true))?))
}

/// Reads an irradiance in W/m2; none if it is missing.
pub(super) fn irradiance(
    line: &Line,
    field: Field,
    highest: f64,
    repairs: &mut Repairs,
) -> Result<Option<f64>, WeatherError> {
    let value = repairs.irradiance(line.value(field)?, line.number);
    match value {
        Some(value) if value > highest => {
            Err(line.error(field, format!("must be {highest} W/m2 at most, or 9999 if it is missing, but is {value}")))
        }
        _ => Ok(value),
    }
}

fn illuminances(line: &Line) -> Result<Option<[f64; 2]>, WeatherError> {
    let [direct, diffuse] = ILLUMINANCES;
    if line.fields.len() < diffuse.number {
        return Ok(None);
    }
    let values = [line.value(direct)?, line.value(diffuse)?];
    Ok(values.iter().all(|lux| (0.0..MISSING_LUX).contains(lux)).then_some(values))
}

/// Refuses records that are neither those of a year nor those of the days that the header tells.
fn check_period(order: &Order, header: &Header, reached: usize) -> Result<(), WeatherError> {
    let Some(found) = order.ended(reached)? else { return Ok(()) };
    if header.period == Some(found) {
        return Ok(());
    }
    let [first, last] = found.map(|(month, day)| format!("{month}/{day}"));
    Err(WeatherError::of_line(
        reached,
        format!(
            "the records end here: they must be those of a year or of the days of DATA PERIODS, but are of {first} to {last}"
        ),
    ))
}
