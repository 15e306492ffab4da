//! Results as JSON: grids, tubes, plan, accuracy, timing, energy.

pub mod tube_report;

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::document::outputs::EstimateDocument;
use crate::estimate::grid_statistics::{self, Statistic};
use crate::estimate::{Accuracy, Estimate, GridEstimate, Ledger, TubeEstimate};
use crate::plan::{EffectPlan, GuidePlan, MethodChoice, Plan};
use crate::scene::{Daylight, Grid};
use crate::sky::Sky;
use crate::statistics::Moments;

/// The illuminance of one grid: row j is `y_m[j]` (south to north), column i is `x_m[i]` (west to east).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct GridResult {
    pub name: String,
    pub height_m: f64,
    /// Number of cells along x and y.
    pub cells: [usize; 2],
    pub estimate: EstimateDocument,
    /// Always `lux`.
    pub unit: String,
    pub x_m: Vec<f64>,
    pub y_m: Vec<f64>,
    pub illuminance_lux: Vec<Vec<f64>>,
    /// Null before the second pass, and where a method knows nothing of its error; of a deterministic method its
    /// estimated numerical error.
    pub standard_error_lux: Vec<Vec<Option<f64>>>,
    /// Percent of the unobstructed horizontal illuminance of sky and sun, electric light included; null without daylight.
    pub illuminance_ratio_percent: Vec<Vec<Option<f64>>>,
    /// The same, only under an overcast sky (types 1 and 16) without sun and without electric light.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub daylight_factor_percent: Option<Vec<Vec<Option<f64>>>>,
    pub external_horizontal_illuminance_lux: ExternalIlluminance,
    pub statistics: GridStatistics,
}

/// Unobstructed horizontal illuminance in lux; zero without a sky.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ExternalIlluminance {
    pub sky: f64,
    pub sun: f64,
}

/// Of the values of a grid. Errors are null before the second pass, and where nothing is known of them.
///
/// The true value lies within `1.96 .._standard_error` of the printed one with a confidence of 95 % at least (after fewer
/// than some 30 passes, with Student's quantile for one less than the passes in place of 1.96). Bias and the choice of
/// fixed points are in the errors. Those of minimum, median and maximum cover the selection, too: the least of many noisy
/// values is too low on average.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct GridStatistics {
    pub mean_lux: f64,
    #[serde(default)]
    pub mean_lux_standard_error: Option<f64>,
    #[serde(default)]
    pub median_lux: f64,
    #[serde(default)]
    pub median_lux_standard_error: Option<f64>,
    pub min_lux: f64,
    #[serde(default)]
    pub min_lux_standard_error: Option<f64>,
    pub max_lux: f64,
    #[serde(default)]
    pub max_lux_standard_error: Option<f64>,
    /// Minimum over mean; null when all is dark.
    pub uniformity: Option<f64>,
    #[serde(default)]
    pub uniformity_standard_error: Option<f64>,
    /// Shares of the grid's area at or above 100, 200, 300, 500 and 750 lux.
    #[serde(default)]
    pub area_above: Vec<AreaAbove>,
    /// Only under an overcast sky (types 1 and 16) without sun and without electric light.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub daylight_factor_percent: Option<DaylightFactors>,
}

/// The share of a grid's area that has an illuminance, or more.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AreaAbove {
    pub lux: f64,
    pub percent: f64,
}

/// Daylight factors of a grid in percent; null when all is dark outside.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DaylightFactors {
    pub mean: Option<f64>,
    pub median: Option<f64>,
    pub minimum: Option<f64>,
}

/// Illuminances in lux whose shares of the area are told: what standards ask of rooms, from corridors to precise work.
const LEVELS_LUX: [f64; 5] = [100.0, 200.0, 300.0, 500.0, 750.0];

impl GridResult {
    /// `estimate` has one sensor per cell of `grid`.
    /// `electric`: whether luminaires take part.
    pub fn new(grid: &Grid, estimate: &GridEstimate, daylight: Option<&Daylight>, electric: bool) -> Self {
        let [columns, _] = grid.cells;
        let sensors = estimate.sensors.len().min(grid.len());
        let values: Vec<f64> = (0..sensors).map(|sensor| estimate.illuminance_lux(sensor)).collect();
        let errors: Vec<Option<f64>> = (0..sensors).map(|sensor| finite(estimate.standard_error_lux(sensor))).collect();
        let (sky, sun) = daylight.map_or((0.0, 0.0), Daylight::horizontal_illuminance_lux);
        let ratios: Vec<Option<f64>> = values.iter().map(|value| finite(100.0 * value / (sky + sun))).collect();
        let ratios = rows(&ratios, columns);
        Self {
            name: grid.name.clone(),
            height_m: grid.height_m,
            cells: grid.cells,
            estimate: grid.estimate.into(),
            unit: "lux".to_owned(),
            x_m: grid.x_m.clone(),
            y_m: grid.y_m.clone(),
            illuminance_lux: rows(&values, columns),
            standard_error_lux: rows(&errors, columns),
            daylight_factor_percent: has_daylight_factor(daylight, electric).then(|| ratios.clone()),
            illuminance_ratio_percent: ratios,
            external_horizontal_illuminance_lux: ExternalIlluminance { sky, sun },
            statistics: GridStatistics::new(estimate, daylight, electric),
        }
    }
}

/// Whether ratios to the unobstructed illuminance are daylight factors.
fn has_daylight_factor(daylight: Option<&Daylight>, electric: bool) -> bool {
    let overcast = |sky: &Sky| sky.distribution.sky_type().is_standard_overcast();
    let overcast = |daylight: &Daylight| daylight.sun.is_none() && daylight.sky.as_ref().is_some_and(overcast);
    !electric && daylight.is_some_and(overcast)
}

impl GridStatistics {
    /// `electric`: whether luminaires take part.
    pub fn new(estimate: &GridEstimate, daylight: Option<&Daylight>, electric: bool) -> Self {
        let none = Statistic { value: 0.0, standard_error: f64::INFINITY };
        let statistics = grid_statistics::GridStatistics::new(estimate);
        let [mean, median, min, max] = statistics.map_or([none; 4], |of| [of.mean, of.median, of.min, of.max]);
        let uniformity = statistics.map(|of| of.uniformity);
        let sensors = estimate.sensors.len();
        let area_above = LEVELS_LUX.map(|lux| {
            let above = estimate.sensors.iter().filter(|sensor| sensor.mean >= lux).count();
            AreaAbove { lux, percent: 100.0 * above as f64 / sensors.max(1) as f64 }
        });
        let (sky, sun) = daylight.map_or((0.0, 0.0), Daylight::horizontal_illuminance_lux);
        let factor = |statistic: Statistic| finite(100.0 * statistic.value / (sky + sun));
        Self {
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
            daylight_factor_percent: has_daylight_factor(daylight, electric).then(|| DaylightFactors {
                mean: factor(mean),
                median: factor(median),
                minimum: factor(min),
            }),
        }
    }
}

fn rows<T: Clone>(values: &[T], columns: usize) -> Vec<Vec<T>> {
    values.chunks(columns.max(1)).map(<[T]>::to_vec).collect()
}

/// JSON has no infinity: `None` becomes null.
fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// A mean with its standard error (null before the second pass, and where nothing is known of it), in lm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FluxResult {
    pub flux_lm: f64,
    pub standard_error_lm: Option<f64>,
}

impl From<&Moments> for FluxResult {
    fn from(moments: &Moments) -> Self {
        Self { flux_lm: moments.mean, standard_error_lm: finite(moments.standard_error()) }
    }
}

/// Flux through one tube.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TubeResult {
    /// Arrives at the collector from outside: at the end of the tube, at the outer face of a `dielectric_dome`, which
    /// is larger, or at a mesh's collector.
    /// Null, as every flux, before the first pass and by methods that do not follow light from its sources.
    pub at_collector: Option<FluxResult>,
    /// Arrives at the diffuser's top.
    pub at_diffuser: Option<FluxResult>,
    pub into_room: Option<FluxResult>,
    /// Flux into the room over flux at the collector; null without light.
    pub transmission_efficiency: Option<f64>,
    /// Unobstructed horizontal illuminance times the area of the opening in the ceiling: what a level aperture of that
    /// size would receive without tube and collector.
    #[serde(default)]
    pub level_aperture_flux_lm: f64,
    /// Flux into the room over that: comparable between collectors; null without light.
    #[serde(default)]
    pub level_aperture_efficiency: Option<f64>,
}

impl TubeResult {
    /// `opening_radius` in metres.
    pub fn new(tube: &TubeEstimate, opening_radius: f64, daylight: Option<&Daylight>) -> Self {
        let (sky, sun) = daylight.map_or((0.0, 0.0), Daylight::horizontal_illuminance_lux);
        let flux = |moments: &Moments| (moments.count > 0.0).then(|| FluxResult::from(moments));
        let level_aperture_flux_lm = (sky + sun) * PI * opening_radius * opening_radius;
        Self {
            at_collector: flux(&tube.at_collector),
            at_diffuser: flux(&tube.at_diffuser),
            into_room: flux(&tube.into_room),
            transmission_efficiency: finite(tube.into_room.mean / tube.at_collector.mean),
            level_aperture_flux_lm,
            level_aperture_efficiency: flux(&tube.into_room)
                .and_then(|flux| finite(flux.flux_lm / level_aperture_flux_lm)),
        }
    }
}

/// What is simulated and what is not, and why.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PlanResult {
    pub effects: Vec<EffectResult>,
    /// One per tube.
    pub guides: Vec<GuideResult>,
    pub methods: MethodsResult,
}

/// An effect of the plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EffectResult {
    pub name: String,
    pub on: bool,
    pub reason: String,
    /// Largest share of any illuminance that is left out; null when that is nothing, or was asked for.
    pub bound: Option<f64>,
}

/// How a tube's guide is computed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct GuideResult {
    /// `closed_form_straight`, `closed_form_bent` or `mesh`.
    pub kind: String,
    pub reason: String,
}

/// Which method computes what; null where the job has no such output.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MethodsResult {
    pub grids: Option<MethodResult>,
    pub views: Option<MethodResult>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MethodResult {
    pub name: String,
    /// The method's own settings.
    #[schema(value_type = Object)]
    pub settings: serde_json::Value,
    pub reason: String,
}

impl From<&Plan> for PlanResult {
    fn from(plan: &Plan) -> Self {
        Self {
            effects: plan.effects.list.iter().map(EffectResult::from).collect(),
            guides: plan.guides.iter().map(GuideResult::from).collect(),
            methods: MethodsResult {
                grids: plan.methods.grids.as_ref().map(MethodResult::from),
                views: plan.methods.views.as_ref().map(MethodResult::from),
            },
        }
    }
}

impl From<&EffectPlan> for EffectResult {
    fn from(effect: &EffectPlan) -> Self {
        Self {
            name: effect.kind.name().to_owned(),
            on: effect.on,
            reason: effect.reason.clone(),
            bound: effect.bound.and_then(finite),
        }
    }
}

impl From<&GuidePlan> for GuideResult {
    fn from(guide: &GuidePlan) -> Self {
        Self { kind: guide.kind.to_owned(), reason: guide.reason.clone() }
    }
}

impl From<&MethodChoice> for MethodResult {
    fn from(choice: &MethodChoice) -> Self {
        Self {
            name: choice.method.name().to_owned(),
            settings: crate::document::method::settings_json(&choice.method),
            reason: choice.reason.clone(),
        }
    }
}

/// Achieved relative errors at the asked confidence; null before the second pass, or without such output.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AccuracyResult {
    pub relative_error: Option<f64>,
    pub view_relative_error: Option<f64>,
    pub confidence: f64,
}

impl AccuracyResult {
    pub fn new(accuracy: Accuracy, confidence: f64) -> Self {
        Self {
            relative_error: accuracy.grids.and_then(finite),
            view_relative_error: accuracy.views.and_then(finite),
            confidence,
        }
    }
}

/// What the computation cost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TimingResult {
    /// Render time.
    pub seconds: f64,
    pub passes: u64,
    pub photons: u64,
    pub rays: u64,
    /// Null when no time was measured.
    pub photons_per_second: Option<f64>,
    pub rays_per_second: Option<f64>,
}

impl TimingResult {
    pub fn new(estimate: &Estimate, seconds: f64) -> Self {
        let Estimate { passes, photons, rays, .. } = *estimate;
        Self {
            seconds,
            passes,
            photons,
            rays,
            photons_per_second: finite(photons as f64 / seconds),
            rays_per_second: finite(rays as f64 / seconds),
        }
    }
}

/// Where the emitted flux went, in lm: the mean over passes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EnergyResult {
    /// Reaches the collectors from outside.
    pub emitted_lm: f64,
    /// Leaves the luminaires.
    #[serde(default)]
    pub luminaires_lm: f64,
    /// Reflected or absorbed by collectors on the way in, or through a dome and out again on its far side.
    pub collector_lm: f64,
    /// Absorbed by mirrors.
    pub guide_lm: f64,
    /// Leaves through the upper end of a guide.
    pub guide_top_lm: f64,
    /// Absorbed by diffusers, or sent up by them into a guide from which nothing returns.
    pub diffuser_lm: f64,
    /// Absorbed by the surfaces of the room, its objects and luminaires.
    pub room_lm: f64,
    /// Leaves through open surfaces of the room.
    pub open_surfaces_lm: f64,
    /// The rest of paths that were ended for length.
    pub cut_lm: f64,
    /// (emitted + luminaires - all others) / (emitted + luminaires); zero without light.
    pub relative_closure_error: f64,
}

impl EnergyResult {
    pub fn new(ledger: &Ledger, passes: u64) -> Self {
        let Ledger { emitted, luminaires, collector, guide, guide_top, diffuser, room, open_surfaces, cut } = *ledger;
        let per_pass = |sum: f64| {
            if passes == 0 { 0.0 } else { sum / passes as f64 }
        };
        Self {
            emitted_lm: per_pass(emitted),
            luminaires_lm: per_pass(luminaires),
            collector_lm: per_pass(collector),
            guide_lm: per_pass(guide),
            guide_top_lm: per_pass(guide_top),
            diffuser_lm: per_pass(diffuser),
            room_lm: per_pass(room),
            open_surfaces_lm: per_pass(open_surfaces),
            cut_lm: per_pass(cut),
            relative_closure_error: ledger.relative_closure_error(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::EstimateKind;
    use crate::sky::zenith::ZenithFormula;
    use crate::sky::{CieType, Sky, SkyDistribution, Sun, direction};

    fn grid() -> Grid {
        Grid::new("floor".to_owned(), 0.0, [3, 2], 0.0, [3.0, 2.0], EstimateKind::Point)
    }

    fn under(cie_type: u8, with_sun: bool) -> Daylight {
        let toward_sun = direction(0.6, 0.0);
        let distribution = SkyDistribution::new(CieType::new(cie_type).unwrap(), toward_sun);
        let sun = Sun { direction: toward_sun, normal_illuminance_lux: 1000.0 };
        Daylight {
            sky: Some(Sky { distribution, zenith_luminance_cd_m2: 1000.0 }),
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
        let result = GridResult::new(&grid(), &estimate(&[10.0, 10.0]), Some(&under(12, false)), false);
        assert_eq!(result.illuminance_lux, [[0.0, 10.0, 20.0], [30.0, 40.0, 50.0]]);
        assert_eq!((result.x_m.len(), result.y_m.len()), (3, 2));
        let GridStatistics { mean_lux, median_lux, min_lux, max_lux, uniformity, .. } = result.statistics;
        assert_eq!((mean_lux, median_lux, min_lux, max_lux, uniformity), (25.0, 25.0, 0.0, 50.0, Some(0.0)));
        assert_eq!(result.daylight_factor_percent, None);
        assert_eq!(result.statistics.daylight_factor_percent, None);
    }

    #[test]
    fn one_pass_has_no_error_and_the_text_no_infinity() {
        let result = GridResult::new(&grid(), &estimate(&[10.0]), Some(&under(16, false)), false);
        assert_eq!(result.standard_error_lux[0][0], None);
        let text = serde_json::to_value(&result).unwrap();
        assert!(text["standard_error_lux"][1][2].is_null());
        // 1 klx zenith of the traditional overcast sky: D = 7 pi / 9 klx
        let ratio = text["daylight_factor_percent"][0][1].as_f64().unwrap();
        assert!((ratio - 100.0 * 10.0 / (7.0 * std::f64::consts::PI / 9.0 * 1000.0)).abs() < 1e-12);
        for (daylight, electric) in [(Some(&under(16, true)), false), (Some(&under(16, false)), true), (None, true)] {
            assert!(GridResult::new(&grid(), &estimate(&[1.0]), daylight, electric).daylight_factor_percent.is_none());
        }
    }

    /// 0, 90, ... 450 lux under an overcast sky of 7 pi / 9 klx.
    #[test]
    fn shares_of_the_area_and_daylight_factors() {
        let result = GridResult::new(&grid(), &estimate(&[90.0, 90.0]), Some(&under(16, false)), false);
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
            let result = GridResult::new(&grid(), &estimate(&[1.0, 1.0]), daylight, electric);
            assert_eq!(result.statistics.daylight_factor_percent, None);
        }
    }

    #[test]
    fn darkness_is_null_and_not_nan() {
        let dark = Daylight { sky: None, sun: None, formula: ZenithFormula::GivenZenithLuminance };
        for daylight in [Some(&dark), None] {
            let result = GridResult::new(&grid(), &estimate(&[0.0, 0.0]), daylight, false);
            assert_eq!(result.illuminance_ratio_percent[0][0], None);
            let GridStatistics { uniformity, uniformity_standard_error, min_lux_standard_error, .. } =
                result.statistics;
            assert_eq!((uniformity, uniformity_standard_error, min_lux_standard_error), (None, None, Some(0.0)));
        }
        let electric = GridResult::new(&grid(), &estimate(&[1.0, 1.0]), None, true);
        assert!(electric.illuminance_ratio_percent.iter().flatten().all(Option::is_none));
        let tube = TubeResult::new(&TubeEstimate::default(), 0.1, Some(&dark));
        assert_eq!((tube.transmission_efficiency, tube.level_aperture_efficiency), (None, None));
        assert_eq!(EnergyResult::new(&Ledger::default(), 0).relative_closure_error, 0.0);
        assert_eq!(TimingResult::new(&Estimate::default(), 0.0).photons_per_second, None);
    }
}
