//! Weather files of Radiance (gendaymtx, Ward 2013).

use super::epw::{HIGHEST_W_M2, date, irradiance};
use super::header::printable;
use super::line::{Field, Line, WeatherError};
use super::order::Order;
use super::record::{Format, Site};
use super::rows::{Repairs, Row, Rows, USUAL_DEW_POINT_C};
use crate::calendar::{typical_year, weekday};

/// Most records of a year: one for each minute.
const MOST_RECORDS: usize = 366 * 24 * 60;

/// Words of the header, each followed by its value, with the numbers that it may have.
const HEADER: [(&str, [f64; 2]); 5] = [
    ("latitude", [-90.0, 90.0]),
    ("longitude", [-180.0, 180.0]),
    ("time_zone", [-210.0, 180.0]),
    ("site_elevation", [-500.0, 9000.0]),
    ("weather_data_file_units", [1.0, 3.0]),
];
const VALUE: Field = Field { number: 2, name: "value" };

const MONTH: Field = Field { number: 1, name: "month" };
const DAY: Field = Field { number: 2, name: "day" };
const HOUR: Field = Field { number: 3, name: "hour" };
const DIRECT: Field = Field { number: 4, name: "direct light" };
const DIFFUSE: Field = Field { number: 5, name: "diffuse horizontal light" };

/// Largest illuminance in lux that a record may have.
const HIGHEST_LUX: f64 = 200_000.0;

/// Quantities of the records, by the units of the header.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Units {
    /// Direct normal irradiance.
    Normal,
    /// Direct irradiance on a level plane.
    Horizontal,
    /// Direct normal illuminance, and diffuse illuminance.
    Lux,
}

/// Reads the lines of a file, numbered from 1.
pub(super) fn read<'a>(lines: impl Iterator<Item = (usize, &'a str)>) -> Result<Rows, WeatherError> {
    let (mut name, mut values, mut records) = (String::new(), [None; HEADER.len()], Vec::new());
    for (number, text) in lines {
        let line = Line::at_blanks(number, text);
        let word = line.fields.first().map_or("", |word| word);
        if records.len() > MOST_RECORDS {
            return Err(WeatherError::of_line(number, "the records must be those of one year at most"));
        }
        if !records.is_empty() || !word.starts_with(|c: char| c.is_ascii_alphabetic()) {
            records.push(line);
        } else if word == "place" {
            name = printable(text.trim().strip_prefix("place").unwrap_or_default().trim());
        } else if let Some(place) = HEADER.iter().position(|(known, _)| *known == word) {
            let [low, high] = HEADER[place].1;
            values[place] = Some(line.within(VALUE, low..=high)?);
        } else {
            return Err(WeatherError::of_line(number, "must be a line of the header, or a record"));
        }
    }
    let first_line = records.first().map_or(1, |line| line.number);
    let missing = HEADER.iter().zip(&values).find(|(_, value)| value.is_none());
    if let Some(((word, _), _)) = missing {
        return Err(WeatherError::of_line(first_line, format!("{word} must stand before the records")));
    }
    let [latitude_deg, longitude, time_zone, elevation_m, units] = values.map(Option::unwrap_or_default);
    // to the west they are positive
    let site = Site {
        name,
        latitude_deg,
        longitude_deg: 0.0 - longitude,
        utc_offset_hours: (0.0 - time_zone) / 15.0,
        elevation_m,
    };
    let records_per_hour = records_per_hour(&records)?;
    let (mut order, mut repairs) = (Order::new(records_per_hour), Repairs::default());
    let units = match units {
        2.0 => Units::Horizontal,
        3.0 => Units::Lux,
        _ => Units::Normal,
    };
    let row = |line| row(line, units, &mut order, &mut repairs);
    let rows = records.iter().map(row).collect::<Result<Vec<_>, _>>()?;
    order.ended(records.last().map_or(first_line, |line| line.number))?;
    let year_of_sun = typical_year(order.has_leap_day());
    Ok(Rows {
        format: Format::Wea,
        site,
        comments: Vec::new(),
        records_per_hour,
        year_of_sun,
        first_weekday: weekday(year_of_sun, rows.first().map_or((1, 1), |row| row.date)),
        daylight_saving: None,
        first_line,
        rows,
        direct_is_horizontal: units == Units::Horizontal,
        is_photometric: units == Units::Lux,
        repairs,
    })
}

/// Returns the records per hour that the hours of the first two records make.
fn records_per_hour(records: &[Line]) -> Result<u32, WeatherError> {
    let [first, second, ..] = records else {
        let line = records.first().map_or(1, |line| line.number);
        return Err(WeatherError::of_line(line, "there must be records of a whole day or more"));
    };
    let per_hour = 1.0 / (hour(second)? - hour(first)?);
    let whole = per_hour.round();
    let minutes = 60.0 / whole;
    if (1.0..=60.0).contains(&whole) && (per_hour - whole).abs() < 0.02 * whole && minutes.fract() == 0.0 {
        return Ok(whole as u32);
    }
    Err(second.error(HOUR, "must be later than the hour before by an hour, or by a part of it in whole minutes"))
}

fn hour(line: &Line) -> Result<f64, WeatherError> {
    let hour = line.within(HOUR, 0.0..=24.0)?;
    (hour < 24.0).then_some(hour).ok_or_else(|| line.error(HOUR, "must be below 24"))
}

fn row(line: &Line, units: Units, order: &mut Order, repairs: &mut Repairs) -> Result<Row, WeatherError> {
    let (date, hour) = (date(line, [MONTH, DAY])?, hour(line)?);
    order.take(line.number, date, hour as usize)?;
    if units == Units::Lux {
        let lux = |field| line.within(field, 0.0..=HIGHEST_LUX);
        let without_irradiances = Row {
            date,
            middle_hour: hour,
            global_w_m2: None,
            direct_normal_w_m2: None,
            diffuse_w_m2: None,
            dew_point_c: USUAL_DEW_POINT_C,
            illuminances_lux: Some([lux(DIRECT)?, lux(DIFFUSE)?]),
        };
        return Ok(without_irradiances);
    }
    let horizontal = units == Units::Horizontal;
    let [highest_direct, highest_diffuse] = HIGHEST_W_M2;
    let direct = irradiance(line, DIRECT, highest_direct, repairs)?;
    let diffuse_w_m2 = irradiance(line, DIFFUSE, highest_diffuse, repairs)?;
    let global = direct.zip(diffuse_w_m2).map(|(direct, diffuse)| direct + diffuse);
    Ok(Row {
        date,
        middle_hour: hour,
        global_w_m2: global.filter(|_| horizontal),
        direct_normal_w_m2: direct.filter(|_| !horizontal),
        diffuse_w_m2,
        dew_point_c: USUAL_DEW_POINT_C,
        illuminances_lux: None,
    })
}
