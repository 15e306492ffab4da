//! Illuminances of a grid at any hours, by the responses that a year keeps of its room: nothing is traced but beams through tubes without a
//! closed form.

use super::JobYear;
use super::lumens::lumens;
use crate::annual::light::{Illuminances, lit};
use crate::annual::moment::Moment;
use crate::annual::response::RecordLight;
use crate::annual::sensors::{GridLight, Sensors};
use crate::annual::weather::{Record, Site};
use crate::document::annual::hours::ValidHour;
use crate::document::limits::SENSORS_TIMES_RECORDS;
use crate::document::{DocumentErrors, FieldError, FieldErrorCode};
use crate::engine::annual::check_tracing;
use crate::output::npy;
use crate::sky::direction;
use crate::sky::sun;

/// Reason why there are no illuminances at other hours.
#[derive(Debug)]
pub enum HoursError {
    /// The year has no grid of this name.
    NoSuchGrid,
    /// Closures let light pass with its direction, so that the room has no responses.
    NoResponses,
    /// The hours are not valid.
    Hours(DocumentErrors),
}

impl From<FieldError> for HoursError {
    fn from(error: FieldError) -> Self {
        Self::Hours(error.into())
    }
}

impl JobYear {
    /// Computes the illuminances in lux of the sensors of a grid by the tubes at some hours as an array of NumPy, float32, sensors x hours;
    /// 0 where the sun is down, not-a-number for sensors without a value.
    pub fn at_hours(&self, grid: &str, hours: &[ValidHour]) -> Result<Vec<u8>, HoursError> {
        let (_, of) = self.grid(grid).ok_or(HoursError::NoSuchGrid)?;
        let Some(light @ GridLight::ByResponses(_)) = of.lights.first() else { return Err(HoursError::NoResponses) };
        let sensors = of.weights.len();
        if sensors * hours.len() > SENSORS_TIMES_RECORDS {
            let product = sensors * hours.len();
            let detail = format!(
                "the number of hours times the {sensors} sensors must be <= {SENSORS_TIMES_RECORDS}, but is {product}"
            );
            return Err(FieldError::new("/hours", detail).coded(FieldErrorCode::TooMany).into());
        }
        check_tracing(&self.scene, hours.len())
            .map_err(|error| FieldError { pointer: "/hours".to_owned(), ..error })?;
        let site = &self.first.weather.site;
        let moments = hours.iter().enumerate().map(|(number, hour)| moment(number, hour, site));
        let moments = moments.collect::<Result<Vec<Moment>, FieldError>>()?;
        let records: Vec<Record> = hours.iter().map(record).collect();
        let lit = lit(&records, &moments, Illuminances::Perez, self.rotation);
        let tubes = lumens((&self.scene, self.seed), &lit, (&self.document, self.sources), &records);
        let of_records = RecordLight::new(&lit, &tubes);
        let all = Sensors { light, other_lux: &[], eyes: &[], records: hours.len() };
        let row = |sensor: usize| match of.weights[sensor] > 0.0 {
            true => all.row_lux(sensor, &of_records),
            false => vec![f32::NAN; hours.len()],
        };
        Ok(npy::encode([sensors, hours.len()], (0..sensors).flat_map(row)))
    }
}

/// Finds the sun of an hour over a site.
fn moment(number: usize, hour: &ValidHour, site: &Site) -> Result<Moment, FieldError> {
    let place = sun::Site::at_height(site.latitude_deg, site.longitude_deg, site.elevation_m);
    let position = sun::position_from(hour.instant, place)
        .map_err(|error| FieldError::new(format!("/hours/{number}/time"), error.to_string()))?;
    Ok(Moment {
        record: number,
        share: 1.0,
        represented_hour: 0.0,
        day_of_year: hour.day_of_year,
        sun: direction(position.altitude, position.azimuth),
    })
}

fn record(hour: &ValidHour) -> Record {
    Record {
        month: hour.instant.month as u8,
        day: hour.instant.day as u8,
        middle_hour: f64::from(hour.instant.hour),
        direct_normal_w_m2: hour.irradiances.direct_normal_w_m2,
        diffuse_horizontal_w_m2: hour.irradiances.diffuse_horizontal_w_m2,
        dew_point_c: hour.irradiances.dew_point_c,
        illuminances_lux: None,
    }
}
