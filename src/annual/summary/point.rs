//! All metrics of one point of a grid.

use crate::eyes::GlareYear;
use crate::metrics::Value;
use crate::metrics::en17037::THRESHOLDS_LUX;
use crate::metrics::points::{Illuminances, Useful};
use crate::metrics::schemes::{DAYLIGHT_LUX, LEED_LUX, OCCUPIED_LUX, YEAR_LUX};
use crate::response::RecordLight;
use crate::sensors::Sensors;

use super::input::{Hours, Options};

/// Metrics of a point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointYear {
    /// Daylight autonomy in percent for each threshold of the options.
    pub autonomies_percent: Vec<Value>,
    /// Continuous daylight autonomy in percent for each threshold of the options.
    pub continuous_percent: Vec<Value>,
    /// Useful daylight illuminance.
    pub useful: Useful,
    /// Daylight autonomy in percent for the threshold of the spatial daylight autonomy.
    pub spatial_percent: Value,
    /// Sum of the illuminance over all records in klx h.
    pub exposure_klxh: Value,
    /// Mean illuminance in lux over the occupied records.
    pub mean_lux: Value,
    /// Median illuminance in lux over the daylight hours of EN 17037.
    pub median_lux: Value,
    /// Daylight factor of the tubes in percent, under the CIE standard overcast sky.
    pub daylight_factor_percent: Value,
    /// Occupied hours in which unscattered sunlight alone gives 1000 lx; `None` where they are not known.
    pub direct_hours: Option<Value>,
    /// Glare of the closures; `None` for sensors that are no eyes.
    pub glare: Option<GlareYear>,
    /// Mean illuminance in lux over all records by each tube alone; empty where it is not known.
    pub by_tube_lux: Vec<f64>,
    pub(super) en17037_percent: [Value; THRESHOLDS_LUX.len()],
    pub(super) of_occupied_percent: [Value; OCCUPIED_LUX.len()],
    pub(super) of_daylight_percent: [Value; DAYLIGHT_LUX.len()],
    pub(super) year_hours: [Value; YEAR_LUX.len()],
    pub(super) least_of_moments_lux: Option<Value>,
    pub(super) within_leed_lux: Option<Value>,
}

impl PointYear {
    /// Computes the metrics of a sensor.
    pub(super) fn new(sensors: &Sensors, sensor: usize, light: &RecordLight, hours: &Hours, options: &Options) -> Self {
        let row = sensors.row(sensor, light);
        let error = row.relative_error;
        let of = |counts: &[bool]| Illuminances::new(&row, &light.records, counts);
        let (occupied, daylight) = (of(hours.occupied), of(hours.daylight));
        let all = of(&vec![true; hours.occupied.len()]);
        let with_error = |value: f64| Value { value, standard_error: value * error };
        let of_tubes = sensors.light.row(sensor, light).relative_error;
        // other openings are no sources of glare here, but would be in the background
        let eye = sensors.eyes.get(sensor).and_then(Option::as_ref).filter(|_| sensors.other_lux.is_empty());
        // the sum of nothing is -0
        let mean = (0.0 + occupied.lit_lux.iter().sum::<f64>()) / occupied.records.max(1) as f64;
        let of_year = hours.each * all.records as f64 / 100.0;
        let of_record = |values: &[f64], record: &usize| {
            light.records.binary_search(record).ok().and_then(|place| values.get(place)).copied().unwrap_or(0.0)
        };
        let mean_of = |records: &[usize]| {
            let count = records.len() as f64;
            let lux = records.iter().map(|record| of_record(&row.lux, record)).sum::<f64>() / count;
            let noise =
                records.iter().map(|record| of_record(&row.noise_lux, record).powi(2)).sum::<f64>().sqrt() / count;
            Value { value: lux, standard_error: libm::hypot(lux * row.common_error, noise) }
        };
        let by_value = |a: &Value, b: &Value| a.value.total_cmp(&b.value);
        let least = hours.nbr.iter().map(|record| mean_of(&[*record])).min_by(by_value);
        let [low, high] = LEED_LUX;
        let within = |records: &Vec<usize>| {
            let mean = mean_of(records);
            Value { value: (mean.value - low).min(high - mean.value), ..mean }
        };
        let within_leed_lux = hours.leed.as_ref().and_then(|hours| hours.iter().map(within).min_by(by_value));
        Self {
            autonomies_percent: options.thresholds_lux.iter().map(|lux| occupied.autonomy_percent(*lux)).collect(),
            continuous_percent: options
                .thresholds_lux
                .iter()
                .map(|lux| occupied.continuous_autonomy_percent(*lux))
                .collect(),
            useful: occupied.useful(options.useful_lux),
            spatial_percent: occupied.autonomy_percent(options.spatial_lux),
            exposure_klxh: all.exposure_klxh(hours.each),
            mean_lux: with_error(mean),
            median_lux: daylight.median_lux(),
            daylight_factor_percent: sensors.light.daylight_factor_percent(sensor, &hours.overcast_m2, of_tubes),
            direct_hours: sensors.direct_hours(sensor),
            glare: eye.map(|eye| eye.year((&row.lux, error), light, hours.occupied)),
            by_tube_lux: sensors.light.mean_by_tube_lux(sensor, light, all.records),
            en17037_percent: THRESHOLDS_LUX.map(|lux| daylight.autonomy_percent(lux)),
            of_occupied_percent: OCCUPIED_LUX.map(|lux| occupied.autonomy_percent(lux)),
            of_daylight_percent: DAYLIGHT_LUX.map(|lux| daylight.autonomy_percent(lux)),
            year_hours: YEAR_LUX.map(|lux| all.autonomy_percent(lux).times(of_year)),
            least_of_moments_lux: least,
            within_leed_lux,
        }
    }
}
