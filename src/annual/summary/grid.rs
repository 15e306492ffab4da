//! Metrics of a grid and its area over a year.

use rayon::prelude::*;

use crate::metrics::area::Area;
use crate::metrics::dimming::Energy;
use crate::metrics::en17037::{self, Provision};
use crate::metrics::points::{Illuminances, Useful};
use crate::metrics::schemes::{Space, YEAR_LUX};
use crate::metrics::{Bounded, Value, Verdict};
use crate::response::{LitRow, RecordLight};

use super::input::{GridInput, Hours, Options};
use super::outside::Outside;
use super::point::PointYear;

/// Metrics of a grid over a year.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GridYear {
    /// Metrics of its points; those of points without weight are all zero and count nowhere.
    pub points: Vec<PointYear>,
    /// Means over the area of the daylight autonomy in percent for each threshold of the options.
    pub autonomies_percent: Vec<Value>,
    /// Means over the area of the continuous daylight autonomy in percent for each threshold of the options.
    pub continuous_percent: Vec<Value>,
    /// Means over the area of the useful daylight illuminance.
    pub useful: Useful,
    /// Spatial daylight autonomy: share of the area in percent.
    pub spatial_percent: Bounded,
    /// Annual sunlight exposure: share of the area in percent with more than 250 occupied hours of direct sunlight; none below Lambertian
    /// closures, by definition. `None` where it is not known: with other daylight, which may have some, and for means over cells.
    pub sun_exposure_percent: Option<Bounded>,
    /// Mean over the area of the exposure in klx h.
    pub exposure_klxh: Value,
    /// Mean over the area of the mean illuminance in lux of the occupied records.
    pub mean_lux: Value,
    /// Mean over the area of the median illuminance in lux of the daylight hours, and its extremes; zero without points.
    pub median_lux: [Value; 3],
    /// Shares of the area by EN 17037.
    pub provision: Provision,
    /// Energy of electric light; `None` if it is not asked for, and where a sensor does not look straight up.
    pub energy: Option<Energy>,
    /// Criteria of standards and schemes, and whether the space meets them; none where a sensor does not look straight up.
    pub verdicts: Vec<Verdict>,
    /// Mean illuminance in lux of the area in each lit record.
    pub mean_by_record_lux: Vec<f64>,
}

impl GridYear {
    /// Computes the metrics of a grid.
    pub(super) fn new(
        grid: &GridInput,
        light: &RecordLight,
        hours: &Hours,
        options: &Options,
        outside: &Outside,
    ) -> Self {
        let area = Area { weights: grid.weights };
        let point = |sensor: usize| match grid.weights[sensor] > 0.0 {
            true => PointYear::new(&grid.sensors, sensor, light, hours, options),
            false => PointYear::default(),
        };
        let sensors = grid.sensors.light.sensors().min(grid.weights.len());
        let points: Vec<PointYear> = (0..sensors).into_par_iter().map(point).collect();
        let each = |of: fn(&PointYear) -> Value| points.iter().map(of).collect::<Vec<Value>>();
        let of_mean = grid.sensors.mean(grid.weights, light);
        // the errors of metrics go together as those of illuminances do
        let exposures = each(|point| point.exposure_klxh);
        let error_of_mean = of_mean.relative_error * area.mean(&exposures, 1.0).value;
        let correlation = area.correlation(&exposures, error_of_mean);
        let mean_of = |values: &[Value]| area.mean(values, correlation);
        let mean = |of: fn(&PointYear) -> Value| mean_of(&each(of));
        let by_threshold = |of: fn(&PointYear) -> &Vec<Value>| -> Vec<Value> {
            let value = |point: &PointYear, number: usize| of(point).get(number).copied().unwrap_or_default();
            let numbers = 0..options.thresholds_lux.len();
            numbers
                .map(|number| mean_of(&points.iter().map(|point| value(point, number)).collect::<Vec<_>>()))
                .collect()
        };
        let medians = each(|point| point.median_lux);
        let [least, most] = area.extremes(&medians).unwrap_or_default();
        let points_of_standard = en17037::Points {
            area,
            autonomies_percent: &points.iter().map(|point| point.en17037_percent).collect::<Vec<_>>(),
            factors_percent: &each(|point| point.daylight_factor_percent),
        };
        let provision = Provision::new(&points_of_standard, outside.median_diffuse_lux);
        let occupied = Illuminances::new(&of_mean, &light.records, hours.occupied);
        let dimming = options.dimming.as_ref().filter(|_| grid.is_level);
        let energy = dimming.map(|dimming| dimming.energy(&occupied, grid.zone_area_m2, hours.each));
        let useful = Useful {
            below_percent: mean(|point| point.useful.below_percent),
            supplementary_percent: mean(|point| point.useful.supplementary_percent),
            autonomous_percent: mean(|point| point.useful.autonomous_percent),
            above_percent: mean(|point| point.useful.above_percent),
        };
        let mut verdicts = provision.verdicts(area.points(), hours.of(hours.daylight));
        verdicts.extend(schemes(area, &points, (grid.middle, &of_mean), light, hours));
        let tubes_alone = grid.sensors.other_lux.is_empty();
        verdicts.retain(|verdict| grid.is_level && (tubes_alone || !verdict.is_of_tubes_alone));
        Self {
            autonomies_percent: by_threshold(|point| &point.autonomies_percent),
            continuous_percent: by_threshold(|point| &point.continuous_percent),
            useful,
            spatial_percent: area.share_percent(&each(|point| point.spatial_percent), options.spatial_time_percent),
            sun_exposure_percent: sun_exposure(area, &points),
            exposure_klxh: mean(|point| point.exposure_klxh),
            mean_lux: mean(|point| point.mean_lux),
            median_lux: [mean_of(&medians), least, most],
            provision,
            energy,
            verdicts,
            mean_by_record_lux: of_mean.lux,
            points,
        }
    }
}

/// Hours of direct sunlight that are not too many (IES LM-83-12).
const DIRECT_HOURS: f64 = 250.0;

/// Computes the share of the area in percent whose points have more than [`DIRECT_HOURS`].
fn sun_exposure(area: Area, points: &[PointYear]) -> Option<Bounded> {
    let hours = |(point, weight): (&PointYear, &f64)| match *weight > 0.0 {
        true => point.direct_hours,
        false => Some(Value::default()),
    };
    let hours: Option<Vec<Value>> = points.iter().zip(area.weights).map(hours).collect();
    Some(area.share_percent(&hours?, DIRECT_HOURS.next_up()))
}

/// Judges a grid by the criteria of schemes; `middle` is the sensor in the middle, `mean` the mean of the area.
fn schemes(
    area: Area,
    points: &[PointYear],
    (middle, mean): (Option<usize>, &LitRow),
    light: &RecordLight,
    hours: &Hours,
) -> Vec<Verdict> {
    let every = vec![true; hours.occupied.len()];
    let mean = Illuminances::new(mean, &light.records, &every);
    let of_year = hours.of(&every) / 100.0;
    let within_leed: Vec<Value> = points.iter().map(|point| point.within_leed_lux.unwrap_or_default()).collect();
    let space = Space {
        area,
        sun_exposure_percent: sun_exposure(area, points),
        occupied_percent: &points.iter().map(|point| point.of_occupied_percent).collect::<Vec<_>>(),
        daylight_percent: &points.iter().map(|point| point.of_daylight_percent).collect::<Vec<_>>(),
        hours: &points.iter().map(|point| point.year_hours).collect::<Vec<_>>(),
        mean_hours: YEAR_LUX.map(|lux| mean.autonomy_percent(lux).times(of_year)),
        middle_lux: middle.and_then(|middle| points.get(middle)).and_then(|point| point.least_of_moments_lux),
        within_leed_lux: hours.leed.as_ref().map(|_| within_leed.as_slice()),
        number_of_hours: [hours.of(hours.occupied), hours.of(hours.daylight), hours.of(&every)],
    };
    space.verdicts()
}
