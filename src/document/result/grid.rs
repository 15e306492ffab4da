//! Illuminance of a grid as JSON.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::components::{GridComponents, GridPart};
use super::number::{coverage_factor, coverage_factor_of_sensors, degrees_of_sensors, error, finite, rows, value};
use super::responses::{PatchResponse, TubeResponse};
use super::target::{TargetResult, percent_at_least};
use crate::document::outputs::EstimateDocument;
use crate::estimate::GridEstimate;
use crate::estimate::grid_statistics::{self, Statistic};
use crate::integrator::components::Component;
use crate::scene::{Daylight, Grid, Responses, Sensor};
use crate::sky::Sky;

/// Illuminance of one grid: row j is at `y_m[j]` (south to north), column i at `x_m[i]` (west to east).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct GridResult {
    /// Name of the grid in the document.
    pub name: String,
    /// Height of the sensors above the floor in metres.
    pub height_m: f64,
    /// Number of cells along x and y.
    pub cells: [usize; 2],
    /// Quantity that each sensor gives, `point` or `cell_average`.
    pub estimate: EstimateDocument,
    /// Unit of the values, always `lux`.
    pub unit: String,
    /// Centres of the columns in metres, from west to east; empty for sensors at given points.
    pub x_m: Vec<f64>,
    /// Centres of the rows in metres, from south to north; empty for sensors at given points.
    pub y_m: Vec<f64>,
    /// Sensors at given points, in the order of the one row of values: x, y and z in metres, and the unit vector that the sensor faces.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points_m: Option<Vec<[f64; 6]>>,
    /// Area of each cell that lies in the room, in m2, by which statistics weigh the sensors; absent where all cells have one area.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub area_m2: Option<Vec<Vec<f64>>>,
    /// Area of a whole cell in m2; absent for sensors at given points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cell_area_m2: Option<f64>,
    /// Illuminance of each sensor, row by row; null inside solids and outside the room. A cell that solids cover in part has the mean over its free
    /// part.
    pub illuminance_lux: Vec<Vec<Option<f64>>>,
    /// Standard error of each illuminance; null inside solids, before the second pass, and where the method has no estimate of
    /// its error. For a deterministic method it is the estimated numerical error. While a sensor has found fewer than ten
    /// photons, the error is not below Poisson's and at least what one photon more would add, even if none was found.
    pub standard_error_lux: Vec<Vec<Option<f64>>>,
    /// Coverage factor of GUM: this number of `standard_error_lux` is half an interval of 95 %, for sensors of this grid, its components and
    /// its responses. It is Student's quantile for the degrees of freedom of these errors: one less than passes, or more where sensors share a
    /// residual (Welch and Satterthwaite); 1.96 for numerical errors. Null before the second pass.
    #[serde(default)]
    pub coverage_factor: Option<f64>,
    /// Degrees of freedom of `standard_error_lux`, for Student's quantiles of other confidences; null for numerical errors and before the second
    /// pass.
    #[serde(default)]
    pub degrees_of_freedom: Option<f64>,
    /// Illuminances in percent of the unobstructed horizontal illuminance of sky and sun, electric light included; null without
    /// daylight, and inside solids.
    pub illuminance_ratio_percent: Vec<Vec<Option<f64>>>,
    /// Daylight factors: illuminances in percent of the unobstructed horizontal illuminance; only under an overcast sky (types 1
    /// to 6 and 16, `ies_overcast`) without sun and without electric light.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub daylight_factor_percent: Option<Vec<Vec<Option<f64>>>>,
    /// Unobstructed horizontal illuminance, the reference of the ratios.
    pub external_horizontal_illuminance_lux: ExternalIlluminance,
    /// Illuminance by source, direct and interreflected, if the grid asks for `components`. Apart from rounding, the parts add up
    /// to the whole.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub components: Option<GridComponents>,
    /// Illuminance by the light of sky and sun that enters through each tube's collector, in the document's order, if the grid
    /// asks for `components`. Apart from rounding, these and the light of luminaires add up to the whole.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub by_tube: Option<Vec<GridPart>>,
    /// Illuminance of each sensor per lumen of each patch of every opening, tube by tube, if the grid asks for `responses`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub responses: Option<Vec<PatchResponse>>,
    /// Illuminance of each sensor per lumen of each tube, and of all, in a job with `annual`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tube_responses: Option<Vec<TubeResponse>>,
    /// Statistics over the sensors.
    pub statistics: GridStatistics,
}

/// Unobstructed horizontal illuminance in lux; zero without a sky.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ExternalIlluminance {
    /// Illuminance of the sky alone.
    pub sky: f64,
    /// Illuminance of the beam alone.
    pub sun: f64,
}

/// Statistics over the sensors of a grid. Errors are null before the second pass, and where the method has no estimate of them.
///
/// The true value lies within `coverage_factor .._standard_error` of the reported one with a confidence of 95 % at least. Errors
/// include bias and the choice of fixed points. Those of minimum, median and maximum include the selection, too: the least of
/// many noisy values is too low on average.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct GridStatistics {
    /// Number of sensors outside the room or within `margin_m` of its walls, which have no value and count in none of these statistics.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub points_outside: usize,
    /// Number of sensors inside solids, which have no value and count in none of these statistics.
    #[serde(default)]
    pub points_inside_solids: usize,
    /// Coverage factor of GUM: this number of the standard errors of these statistics is half an interval of 95 %. It is Student's quantile for
    /// one degree of freedom less than passes, or 1.96 for numerical errors. Null before the second pass.
    #[serde(default)]
    pub coverage_factor: Option<f64>,
    /// Mean over the sensors in lux, by the areas of their cells.
    pub mean_lux: f64,
    /// Standard error of the mean in lux.
    #[serde(default)]
    pub mean_lux_standard_error: Option<f64>,
    /// Median over the sensors in lux.
    #[serde(default)]
    pub median_lux: f64,
    /// Standard error of the median in lux.
    #[serde(default)]
    pub median_lux_standard_error: Option<f64>,
    /// Smallest illuminance of the sensors in lux.
    pub min_lux: f64,
    /// Standard error of the smallest illuminance in lux.
    #[serde(default)]
    pub min_lux_standard_error: Option<f64>,
    /// Largest illuminance of the sensors in lux.
    pub max_lux: f64,
    /// Standard error of the largest illuminance in lux.
    #[serde(default)]
    pub max_lux_standard_error: Option<f64>,
    /// Uniformity: minimum over mean; null when all is dark.
    pub uniformity: Option<f64>,
    /// Standard error of the uniformity; not less than that which follows from the errors of minimum and mean together.
    #[serde(default)]
    pub uniformity_standard_error: Option<f64>,
    /// Fractions of the grid's area at or above 100, 200, 300, 500 and 750 lux.
    #[serde(default)]
    pub area_above: Vec<AreaAbove>,
    /// Comparison with `target_lux` of the grid, if the document has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<TargetResult>,
    /// Daylight factors of the statistics in percent; only under an overcast sky (types 1 to 6 and 16, `ies_overcast`) without
    /// sun and without electric light.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub daylight_factor_percent: Option<DaylightFactors>,
}

/// Fraction of a grid's area at or above an illuminance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AreaAbove {
    /// Illuminance in lux that is reached or exceeded.
    pub lux: f64,
    /// Percentage of the grid's area outside solids that reaches it, 0..100.
    pub percent: f64,
}

/// Daylight factors of a grid's statistics in percent; null without daylight.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DaylightFactors {
    /// Daylight factor of the grid's mean.
    pub mean: Option<f64>,
    /// Daylight factor of the grid's median.
    pub median: Option<f64>,
    /// Daylight factor of the grid's minimum.
    pub minimum: Option<f64>,
}

/// Illuminances in lux for which the fraction of the area is reported: those that standards require, from corridors to precise
/// work.
const LEVELS_LUX: [f64; 5] = [100.0, 200.0, 300.0, 500.0, 750.0];

impl GridResult {
    /// Returns the result of a grid from its `estimate`, which has one sensor per cell. `electric` is true if luminaires give
    /// light; `parts` are the components of the estimate, and `tubes` is the number of openings whose responses it has, where it
    /// has them.
    pub fn new(
        grid: &Grid,
        estimate: &GridEstimate,
        daylight: Option<&Daylight>,
        electric: bool,
        parts: &[Component],
        tubes: usize,
    ) -> Self {
        let [columns, _] = grid.cells;
        let sensors = estimate.sensors.len().min(grid.len());
        let values: Vec<Option<f64>> = (0..sensors).map(|sensor| value(estimate, sensor)).collect();
        let errors: Vec<Option<f64>> = (0..sensors).map(|sensor| error(estimate, sensor)).collect();
        let (sky, sun) = daylight.map_or((0.0, 0.0), Daylight::horizontal_illuminance_lux);
        let ratios: Vec<Option<f64>> = values.iter().map(|value| finite(100.0 * (*value)? / (sky + sun))).collect();
        let ratios = rows(&ratios, columns);
        let parts = grid.components.then(|| GridComponents::new(parts, estimate, columns));
        let (components, by_tube) = parts.unzip();
        let points_m = grid.placed.as_ref().map(|placed| placed.iter().map(point).collect());
        let area = grid.area.as_ref().filter(|_| grid.placed.is_none());
        let area: Option<Vec<f64>> = area.map(|area| area.iter().map(|share| share * grid.cell_area_m2()).collect());
        Self {
            name: grid.name.clone(),
            height_m: grid.height_m,
            cells: grid.cells,
            estimate: grid.estimate.into(),
            unit: "lux".to_owned(),
            x_m: if points_m.is_some() { Vec::new() } else { grid.x_m.clone() },
            y_m: if points_m.is_some() { Vec::new() } else { grid.y_m.clone() },
            points_m,
            area_m2: area.map(|area| area.chunks(columns.max(1)).map(<[f64]>::to_vec).collect()),
            cell_area_m2: grid.placed.is_none().then(|| grid.cell_area_m2()),
            illuminance_lux: rows(&values, columns),
            standard_error_lux: rows(&errors, columns),
            coverage_factor: coverage_factor_of_sensors(estimate),
            degrees_of_freedom: finite(degrees_of_sensors(estimate))
                .filter(|_| !estimate.numerical && estimate.passes() >= 2.0),
            daylight_factor_percent: has_daylight_factor(daylight, electric).then(|| ratios.clone()),
            illuminance_ratio_percent: ratios,
            external_horizontal_illuminance_lux: ExternalIlluminance { sky, sun },
            components,
            by_tube,
            responses: (grid.responses == Responses::ToPatches).then(|| PatchResponse::all(estimate, columns, tubes)),
            tube_responses: (grid.responses == Responses::ToTubes).then(|| TubeResponse::all(estimate, columns, tubes)),
            statistics: GridStatistics::new(grid, estimate, daylight, electric),
        }
    }
}

impl GridResult {
    /// Returns the name of the grid and its place in words: its height, or the number of its points.
    pub fn place_in_words(&self) -> String {
        match &self.points_m {
            Some(points) => format!("{}, {} points", self.name, points.len()),
            None => format!("{}, {} m above the floor", self.name, self.height_m),
        }
    }

    /// Returns what parts of the grid are parts of, in words: its area, or its points.
    pub fn whole_in_words(&self) -> &'static str {
        if self.points_m.is_some() { "points" } else { "area" }
    }
}

/// Returns the place and the direction of a sensor.
fn point(Sensor { position, normal }: &Sensor) -> [f64; 6] {
    [position.x, position.y, position.z, normal.x, normal.y, normal.z]
}

fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// True if ratios to the unobstructed illuminance are daylight factors.
fn has_daylight_factor(daylight: Option<&Daylight>, electric: bool) -> bool {
    let overcast = |sky: &Sky| sky.distribution.sky_type().is_sunless();
    let overcast = |daylight: &Daylight| daylight.sun.is_none() && daylight.sky.as_ref().is_some_and(overcast);
    !electric && daylight.is_some_and(overcast)
}

impl GridStatistics {
    /// Returns the statistics of the estimate of a grid; `electric` is true if luminaires give light.
    pub fn new(grid: &Grid, estimate: &GridEstimate, daylight: Option<&Daylight>, electric: bool) -> Self {
        let none = Statistic { value: 0.0, standard_error: f64::INFINITY };
        let statistics = grid_statistics::GridStatistics::new(estimate);
        let [mean, median, min, max] = statistics.map_or([none; 4], |of| [of.mean, of.median, of.min, of.max]);
        let uniformity = statistics.map(|of| of.uniformity);
        let without_value = estimate.sensors.len() - estimate.valued().count();
        let outside = (0..estimate.sensors.len()).filter(|sensor| estimate.weight(*sensor) == 0.0).count();
        let area_above = LEVELS_LUX.map(|lux| AreaAbove { lux, percent: percent_at_least(estimate, lux) });
        let (sky, sun) = daylight.map_or((0.0, 0.0), Daylight::horizontal_illuminance_lux);
        let factor = |statistic: Statistic| finite(100.0 * statistic.value / (sky + sun));
        let external = Some(sky + sun).filter(|external| !electric && *external > 0.0);
        Self {
            points_outside: outside,
            points_inside_solids: without_value - outside,
            coverage_factor: coverage_factor(estimate.passes(), estimate.numerical),
            mean_lux: mean.value,
            mean_lux_standard_error: finite(mean.standard_error),
            median_lux: median.value,
            median_lux_standard_error: finite(median.standard_error),
            min_lux: min.value,
            min_lux_standard_error: finite(min.standard_error),
            max_lux: max.value,
            max_lux_standard_error: finite(max.standard_error),
            uniformity: uniformity.and_then(|uniformity| finite(uniformity.value)),
            uniformity_standard_error: uniformity.and_then(|uniformity| finite(uniformity.standard_error)),
            area_above: area_above.to_vec(),
            target: grid.target_lux.map(|lux| TargetResult::new(lux, estimate, mean, external)),
            daylight_factor_percent: has_daylight_factor(daylight, electric).then(|| DaylightFactors {
                mean: factor(mean),
                median: factor(median),
                minimum: factor(min),
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::EstimateKind;
    use crate::sky::zenith::ZenithFormula;
    use crate::sky::{CieType, IesSky, Sky, SkyDistribution, SkyType, Sun, direction};
    use crate::statistics::Moments;

    fn grid() -> Grid {
        Grid::new("floor".to_owned(), 0.0, [3, 2], 0.0, [3.0, 2.0], EstimateKind::Point)
    }

    fn under(cie_type: u8, with_sun: bool) -> Daylight {
        under_sky(CieType::new(cie_type).unwrap().into(), with_sun)
    }

    fn under_sky(sky_type: SkyType, with_sun: bool) -> Daylight {
        let toward_sun = direction(0.6, 0.0);
        let distribution = SkyDistribution::new(sky_type, toward_sun);
        let sun = Sun { direction: toward_sun, normal_illuminance_lux: 1000.0 };
        Daylight {
            sky: Some(Sky::new(distribution, 1000.0)),
            sun: with_sun.then_some(sun),
            formula: ZenithFormula::GivenZenithLuminance,
        }
    }

    fn estimate(passes: &[f64]) -> GridEstimate {
        let mut sensors = vec![Moments::default(); 6];
        for (index, sensor) in sensors.iter_mut().enumerate() {
            passes.iter().for_each(|pass| sensor.push(pass * index as f64));
        }
        GridEstimate { sensors, ..GridEstimate::default() }
    }

    #[test]
    fn rows_run_south_to_north() {
        let result = GridResult::new(&grid(), &estimate(&[10.0, 10.0]), Some(&under(12, false)), false, &[], 0);
        let lux = [[0.0, 10.0, 20.0], [30.0, 40.0, 50.0]].map(|row| row.map(Some));
        assert_eq!(result.illuminance_lux, lux);
        assert_eq!((result.x_m.len(), result.y_m.len()), (3, 2));
        let GridStatistics { mean_lux, median_lux, min_lux, max_lux, uniformity, .. } = result.statistics;
        assert_eq!((mean_lux, median_lux, min_lux, max_lux, uniformity), (25.0, 25.0, 0.0, 50.0, Some(0.0)));
        assert_eq!(result.daylight_factor_percent, None);
        assert_eq!(result.statistics.daylight_factor_percent, None);
    }

    #[test]
    fn one_pass_has_no_error_and_the_text_no_infinity() {
        let result = GridResult::new(&grid(), &estimate(&[10.0]), Some(&under(16, false)), false, &[], 0);
        assert_eq!(result.standard_error_lux[0][0], None);
        let text = serde_json::to_value(&result).unwrap();
        assert!(text["standard_error_lux"][1][2].is_null());
        // 1 klx zenith of the traditional overcast sky: D = 7 pi / 9 klx
        let ratio = text["daylight_factor_percent"][0][1].as_f64().unwrap();
        assert!((ratio - 100.0 * 10.0 / (7.0 * std::f64::consts::PI / 9.0 * 1000.0)).abs() < 1e-12);
        for (daylight, electric) in [(Some(&under(16, true)), false), (Some(&under(16, false)), true), (None, true)] {
            assert!(
                GridResult::new(&grid(), &estimate(&[1.0]), daylight, electric, &[], 0)
                    .daylight_factor_percent
                    .is_none()
            );
        }
    }

    /// Statistics of 0, 90, ... 450 lux under an overcast sky of 7 pi / 9 klx.
    #[test]
    fn shares_of_the_area_and_daylight_factors() {
        let result = GridResult::new(&grid(), &estimate(&[90.0, 90.0]), Some(&under(16, false)), false, &[], 0);
        let shares: Vec<_> = result.statistics.area_above.iter().map(|above| (above.lux, above.percent)).collect();
        let sixth = 100.0 / 6.0;
        assert_eq!(
            shares,
            [(100.0, 4.0 * sixth), (200.0, 3.0 * sixth), (300.0, 2.0 * sixth), (500.0, 0.0), (750.0, 0.0)]
        );
        let outside = 7000.0 * std::f64::consts::PI / 9.0;
        let factors = result.statistics.daylight_factor_percent.unwrap();
        assert!((factors.mean.unwrap() - 100.0 * 225.0 / outside).abs() < 1e-12);
        assert!((factors.median.unwrap() - 100.0 * 225.0 / outside).abs() < 1e-12);
        assert_eq!(factors.minimum, Some(0.0));
        for (daylight, electric) in [(Some(&under(16, true)), false), (Some(&under(16, false)), true), (None, true)] {
            let result = GridResult::new(&grid(), &estimate(&[1.0, 1.0]), daylight, electric, &[], 0);
            assert_eq!(result.statistics.daylight_factor_percent, None);
        }
    }

    /// Checks every sky that is overcast, and some with a beam.
    #[test]
    fn daylight_factors_under_every_overcast_sky() {
        let factors = |sky_type: SkyType, with_sun: bool| {
            let daylight = under_sky(sky_type, with_sun);
            let result = GridResult::new(&grid(), &estimate(&[1.0, 1.0]), Some(&daylight), false, &[], 0);
            assert_eq!(
                result.daylight_factor_percent.is_some(),
                result.statistics.daylight_factor_percent.is_some_and(|of| of.mean.is_some_and(|mean| mean > 0.0))
            );
            result.daylight_factor_percent.is_some()
        };
        for cie_type in CieType::all() {
            let overcast = matches!(cie_type.number(), 1..=6 | 16);
            assert_eq!(factors(cie_type.into(), false), overcast, "{cie_type:?}");
            assert!(!factors(cie_type.into(), true));
        }
        let of_presets = IesSky::ALL.map(|sky| factors(sky.into(), false));
        assert_eq!(of_presets, [true, false, false]);
    }

    #[test]
    fn darkness_is_null_and_not_nan() {
        let dark = Daylight { sky: None, sun: None, formula: ZenithFormula::GivenZenithLuminance };
        for daylight in [Some(&dark), None] {
            let result = GridResult::new(&grid(), &estimate(&[0.0, 0.0]), daylight, false, &[], 0);
            assert_eq!(result.illuminance_ratio_percent[0][0], None);
            let GridStatistics { uniformity, uniformity_standard_error, min_lux_standard_error, .. } =
                result.statistics;
            assert_eq!((uniformity, uniformity_standard_error, min_lux_standard_error), (None, None, Some(0.0)));
        }
        let electric = GridResult::new(&grid(), &estimate(&[1.0, 1.0]), None, true, &[], 0);
        assert!(electric.illuminance_ratio_percent.iter().flatten().all(Option::is_none));
    }
}
