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
            row.part_errors();
            (row, summaries[1])
        };
        let (rows, direct_hours) = values.chunks_exact(columns).map(of_sensor).unzip();
        Self { rows, direct_hours: if are_cells { Vec::new() } else { direct_hours }, factors_percent }
    }

    /// Returns the mean of sensors with the given weights; errors are taken as if those of all sensors were the same.
    fn mean(&self, weights: &[f64]) -> LitRow {
        let whole = weights.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let records = self.rows.first().map_or(0, |row| row.lux.len());
        let mut mean = LitRow { lux: vec![0.0; records], noise_lux: vec![0.0; records], ..LitRow::default() };
        let [mut error, mut common] = [0.0; 2];
        for (row, weight) in self.rows.iter().zip(weights) {
            let part = weight / whole;
            mean.lux.iter_mut().zip(&row.lux).for_each(|(mean, lux)| *mean += part * lux);
            mean.noise_lux.iter_mut().zip(&row.noise_lux).for_each(|(mean, noise)| *mean += part * noise);
            let whole = row.lux.iter().sum::<f64>();
            error += part * row.relative_error * whole;
            common += part * row.common_error * whole;
        }
        let sum: f64 = mean.lux.iter().sum();
        [mean.relative_error, mean.common_error] = [error, common].map(|of| if sum > 0.0 { of / sum } else { 0.0 });
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
    let whole = sums[0] + sums[1];
    let error = |of_one: f64, of_other: f64| match whole > 0.0 {
        true => libm::hypot(of_one * sums[0], of_other * sums[1]) / whole,
        false => 0.0,
    };
    LitRow {
        lux: one.lux.iter().zip(&other.lux).map(|(one, other)| one + other).collect(),
        noise_lux: other.noise_lux.clone(),
        relative_error: error(one.relative_error, other.relative_error),
        common_error: error(one.common_error, other.common_error),
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
    let largest = of_tubes.lux.iter().zip(&lux).map(share).fold(0.0, f64::max);
    let [relative_error, common_error] = [of_tubes.relative_error, of_tubes.common_error].map(|error| error * largest);
    LitRow { lux, relative_error, common_error, ..of_tubes }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Parts errors that were put together from a common one of 1 % and independent ones of 3 lx, and finds no common one where there is none.
    #[test]
    fn errors_are_parted_into_common_and_independent_ones() {
        let lux: Vec<f64> = (0..1000).map(|record| 100.0 + f64::from(record % 7)).collect();
        let sum: f64 = lux.iter().sum();
        let row = |common: f64| LitRow {
            noise_lux: lux.iter().map(|lux| libm::hypot(common * lux, 3.0)).collect(),
            relative_error: libm::hypot(common * sum, 3.0 * 1000f64.sqrt()) / sum,
            lux: lux.clone(),
            common_error: 0.0,
        };
        for common in [0.01, 0.0] {
            let mut parted = row(common);
            parted.part_errors();
            assert!((parted.common_error - common).abs() < 1e-6, "{}", parted.common_error);
            assert!(parted.noise_lux.iter().all(|noise| (noise - 3.0).abs() < 1e-4));
        }
        let mut one = LitRow { lux: vec![100.0], noise_lux: vec![2.0], relative_error: 0.02, common_error: 0.0 };
        one.part_errors();
        assert!((one.common_error - 0.02).abs() < 1e-12 && one.noise_lux[0] < 1e-6);
    }
}
