//! Illuminances of a grid's sensors in the records of a year: by responses to tubes, or computed moment by moment.

use skyduct_physics::integrator::moments::SUMMARIES;

use crate::eyes::Eye;
use crate::light::LitMoment;
use crate::metrics::Value;
use crate::response::{LitRow, RecordLight, Responses};

/// Light of the sensors of a grid.
#[derive(Clone, Debug, PartialEq)]
pub enum GridLight {
    /// Responses to tubes, whose lumens are known: below Lambertian closures.
    ByResponses(Responses),
    /// Illuminances that were computed at every moment.
    AtMoments(SensorsAtMoments),
    /// Responses to the tubes with Lambertian closures, and illuminances by the others that were computed at every moment.
    Added(Responses, SensorsAtMoments),
}

/// Illuminances of the sensors of a grid that were computed at every moment of a year.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SensorsAtMoments {
    rows: Vec<LitRow>,
    /// Occupied hours of direct sunlight; empty for means over cells, whose direct light no pass knows well enough for a threshold.
    direct_hours: Vec<Value>,
    /// Daylight factors in percent.
    factors_percent: Vec<Value>,
}

impl SensorsAtMoments {
    /// Makes the rows of sensors from their `values` with standard errors: for each sensor those of all moments in lux, its exposure in
    /// lx h, and its occupied hours of direct sunlight, which are left out for cells; `factors_percent` are the daylight factors of the sensors.
    pub fn new(lit: &[LitMoment], values: &[Value], are_cells: bool, factors_percent: Vec<Value>) -> Self {
        let columns = lit.len() + SUMMARIES;
        let of_sensor = |values: &[Value]| {
            let (moments, summaries) = values.split_at(lit.len());
            let mut row = LitRow::default();
            let mut first = 0;
            for of_record in lit.chunk_by(|a, b| a.record == b.record) {
                let moments = of_record.iter().zip(&moments[first..]);
                row.lux.push(moments.clone().map(|(moment, value)| moment.share * value.value).sum());
                let square = |(moment, value): (&LitMoment, &Value)| (moment.share * value.standard_error).powi(2);
                row.noise_lux.push(moments.map(square).sum::<f64>().sqrt());
                first += of_record.len();
            }
            let exposure = summaries[0];
            row.relative_error = if exposure.value > 0.0 { exposure.standard_error / exposure.value } else { 0.0 };
            (row, summaries[1])
        };
        let (rows, direct_hours) = values.chunks_exact(columns).map(of_sensor).unzip();
        Self { rows, direct_hours: if are_cells { Vec::new() } else { direct_hours }, factors_percent }
    }

    /// Returns the mean of sensors with the given weights; errors are taken as if those of all sensors were the same.
    fn mean(&self, weights: &[f64]) -> LitRow {
        let whole = weights.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let records = self.rows.first().map_or(0, |row| row.lux.len());
        let mut mean = LitRow { lux: vec![0.0; records], noise_lux: vec![0.0; records], relative_error: 0.0 };
        let mut error = 0.0;
        for (row, weight) in self.rows.iter().zip(weights) {
            let part = weight / whole;
            mean.lux.iter_mut().zip(&row.lux).for_each(|(mean, lux)| *mean += part * lux);
            mean.noise_lux.iter_mut().zip(&row.noise_lux).for_each(|(mean, noise)| *mean += part * noise);
            error += part * row.relative_error * row.lux.iter().sum::<f64>();
        }
        let sum: f64 = mean.lux.iter().sum();
        mean.relative_error = if sum > 0.0 { error / sum } else { 0.0 };
        mean
    }
}

impl GridLight {
    /// Estimates the memory of illuminances that were computed at every moment in bytes.
    pub fn bytes(&self) -> usize {
        match self {
            Self::ByResponses(_) => 0,
            Self::AtMoments(sensors) | Self::Added(_, sensors) => {
                sensors.rows.iter().map(|row| size_of_val(&*row.lux) + size_of_val(&*row.noise_lux)).sum()
            }
        }
    }

    /// Returns the number of sensors.
    pub fn sensors(&self) -> usize {
        match self {
            Self::ByResponses(responses) => responses.sensors(),
            Self::AtMoments(sensors) | Self::Added(_, sensors) => sensors.rows.len(),
        }
    }

    /// Returns the illuminances of a sensor.
    pub fn row(&self, sensor: usize, light: &RecordLight) -> LitRow {
        match self {
            Self::ByResponses(responses) => responses.row(sensor, light),
            Self::AtMoments(sensors) => sensors.rows[sensor].clone(),
            Self::Added(responses, sensors) => added(responses.row(sensor, light), &sensors.rows[sensor]),
        }
    }

    /// Returns the illuminances of the mean of sensors with the given weights.
    pub fn mean(&self, weights: &[f64], light: &RecordLight) -> LitRow {
        match self {
            Self::ByResponses(responses) => responses.mean(weights).row(0, light),
            Self::AtMoments(sensors) => sensors.mean(weights),
            Self::Added(responses, sensors) => added(responses.mean(weights).row(0, light), &sensors.mean(weights)),
        }
    }

    /// Returns the daylight factor of a sensor in percent; `overcast_m2` is the light of each tube under the CIE standard overcast sky
    /// over its horizontal illuminance, in m2, and `relative_error` that of the sensor.
    pub fn daylight_factor_percent(&self, sensor: usize, overcast_m2: &[f64], relative_error: f64) -> Value {
        match self {
            Self::ByResponses(responses) => {
                let value = 100.0 * responses.of_areas(sensor, overcast_m2);
                Value { value, standard_error: value * relative_error }
            }
            Self::AtMoments(sensors) | Self::Added(_, sensors) => {
                sensors.factors_percent.get(sensor).copied().unwrap_or_default()
            }
        }
    }

    /// Returns the occupied hours in which a sensor has at least 1000 lx of unscattered sunlight: 0 below Lambertian closures, `None` where
    /// they are not known.
    pub fn direct_hours(&self, sensor: usize) -> Option<Value> {
        match self {
            Self::ByResponses(_) => Some(Value::default()),
            Self::AtMoments(sensors) | Self::Added(_, sensors) => sensors.direct_hours.get(sensor).copied(),
        }
    }

    /// Returns the illuminance in lux of a sensor by each tube alone, as the mean over all `records` of the year: which tube serves which
    /// desk. Empty where the tubes were computed together.
    pub fn mean_by_tube_lux(&self, sensor: usize, light: &RecordLight, records: usize) -> Vec<f64> {
        match self {
            Self::ByResponses(responses) => responses.mean_by_tube_lux(sensor, light, records),
            Self::AtMoments(_) | Self::Added(..) => Vec::new(),
        }
    }
}

/// Adds the light of other tubes to that of some; the errors that are the same in all records are independent of each other.
fn added(one: LitRow, other: &LitRow) -> LitRow {
    let sums = [&one, other].map(|row| row.lux.iter().sum::<f64>());
    let error = libm::hypot(one.relative_error * sums[0], other.relative_error * sums[1]);
    let whole = sums[0] + sums[1];
    LitRow {
        lux: one.lux.iter().zip(&other.lux).map(|(one, other)| one + other).collect(),
        noise_lux: other.noise_lux.clone(),
        relative_error: if whole > 0.0 { error / whole } else { 0.0 },
    }
}

/// Sensors of a grid: their light, and what other openings add.
#[derive(Clone, Copy, Debug)]
pub struct Sensors<'a> {
    /// Light of the tubes.
    pub light: &'a GridLight,
    /// Illuminances in lux by other daylight, of all records sensor by sensor; empty without any. Those of records without light do not count.
    pub other_lux: &'a [f32],
    /// Eyes among the sensors; empty where there are none.
    pub eyes: &'a [Option<Eye>],
    /// Number of records of the year.
    pub records: usize,
}

impl Sensors<'_> {
    /// Returns the illuminances of a sensor; other daylight has no part in their errors.
    pub fn row(&self, sensor: usize, light: &RecordLight) -> LitRow {
        with_others(self.light.row(sensor, light), |record| self.other(sensor, record), light)
    }

    /// Returns the illuminances of the mean of all sensors with the given weights.
    pub fn mean(&self, weights: &[f64], light: &RecordLight) -> LitRow {
        let whole = weights.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let other = |record: usize| match self.other_lux.is_empty() {
            true => 0.0,
            false => {
                let weighted = weights.iter().enumerate().map(|(sensor, weight)| weight * self.other(sensor, record));
                weighted.sum::<f64>() / whole
            }
        };
        with_others(self.light.mean(weights, light), other, light)
    }

    /// Returns the occupied hours of direct sunlight as [`GridLight::direct_hours`]; `None` with other daylight, which may have some.
    pub fn direct_hours(&self, sensor: usize) -> Option<Value> {
        self.light.direct_hours(sensor).filter(|_| self.other_lux.is_empty())
    }

    /// Computes the illuminances in lux of a sensor in all records of the year, dark ones included.
    pub fn row_lux(&self, sensor: usize, light: &RecordLight) -> Vec<f32> {
        let mut row = vec![0.0; self.records];
        for (record, lux) in light.records.iter().zip(self.row(sensor, light).lux) {
            if let Some(of_record) = row.get_mut(*record) {
                *of_record = lux as f32;
            }
        }
        row
    }

    fn other(&self, sensor: usize, record: usize) -> f64 {
        let lux = self.other_lux.get(sensor * self.records + record).copied().filter(|lux| !lux.is_nan());
        lux.map_or(0.0, f64::from)
    }
}

/// Adds other light to that of tubes in each lit record, and lowers the relative error to that of the record of which tubes are the largest
/// part: metrics look at single records.
fn with_others(of_tubes: LitRow, other: impl Fn(usize) -> f64, light: &RecordLight) -> LitRow {
    let lux: Vec<f64> = of_tubes.lux.iter().zip(&light.records).map(|(lux, record)| lux + other(*record)).collect();
    let share = |(tubes, all): (&f64, &f64)| if *all > 0.0 { tubes / all } else { 0.0 };
    let relative_error = of_tubes.relative_error * of_tubes.lux.iter().zip(&lux).map(share).fold(0.0, f64::max);
    LitRow { lux, relative_error, ..of_tubes }
}
