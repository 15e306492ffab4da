//! Results of a year: light outside, light of the tubes, metrics of the grids, and verdicts.

use crate::annual::metrics::en17037::THRESHOLDS_LUX;
use crate::annual::metrics::glare::LIMITS_CD_M2;
use crate::annual::metrics::{Basis, Bounded, Outcome, Value, Verdict};
use crate::annual::summary::{GridYear, Outside, TubeSummary};
use crate::annual::weather::Site;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::document::annual::{AnnualDocument, DaylightSavingDocument, IlluminanceSource, ScheduleDocument};
use crate::document::schema::shapes::Vector;

/// Year of daylight of a job by one weather file.
///
/// Intervals from `low` to `high` hold with a confidence of 95 % for the numerical error alone: they do not contain that the weather of
/// one year differs from that of another, nor what is not known of the tubes and the room.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct YearResult {
    /// Weather file, as the document names it.
    pub weather: String,
    /// Place of the weather file, or of the document.
    pub site: SiteResult,
    /// Choices that results depend on.
    pub conventions: Conventions,
    /// Light outside.
    pub outside: OutsideResult,
    /// Light of each tube, in the order of the document.
    pub tubes: Vec<TubeYearResult>,
    /// Metrics of each grid, in the order of the document.
    pub grids: Vec<GridYearResult>,
}

/// Place of a weather file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SiteResult {
    /// Name as the file has it.
    pub name: String,
    /// Latitude in degrees, north positive.
    pub latitude_deg: f64,
    /// Longitude in degrees, east positive.
    pub longitude_deg: f64,
    /// Hours by which standard time is ahead of UTC.
    pub utc_offset_hours: f64,
    /// Height above sea level in metres.
    pub elevation_m: f64,
}

impl From<&Site> for SiteResult {
    fn from(site: &Site) -> Self {
        let Site { name, latitude_deg, longitude_deg, utc_offset_hours, elevation_m } = site.clone();
        Self { name, latitude_deg, longitude_deg, utc_offset_hours, elevation_m }
    }
}

/// Choices that results of a year depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Conventions {
    /// Luminance of the sky: that of Perez, Seals and Michalsky (1993).
    pub sky: String,
    /// Source of the illuminances.
    pub illuminance: IlluminanceSource,
    /// Minutes from the stamp of a record to the moment for which it stands.
    pub sun_offset_minutes: f64,
    /// Positions of the sun in an hour.
    pub suns_per_hour: u32,
    /// Year by which the sun's positions are computed.
    pub year_of_sun: i32,
    /// Number of records.
    pub records: usize,
    /// Number of records with light.
    pub lit_records: usize,
    /// Records in an hour.
    pub records_per_hour: u32,
    /// Hours in which the room is occupied.
    pub occupied_hours: f64,
    /// Schedule of the document.
    pub schedule: ScheduleDocument,
    /// Summer time of the document.
    pub daylight_saving: DaylightSavingDocument,
    /// Factors of the light of all tubes in each month.
    pub maintenance: [f64; 12],
}

/// Number with its interval of 95 % confidence.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct WithInterval {
    /// Number.
    pub value: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
}

impl From<Bounded> for WithInterval {
    fn from(Bounded { value, low, high }: Bounded) -> Self {
        Self { value, low, high }
    }
}

impl From<Value> for WithInterval {
    fn from(value: Value) -> Self {
        Bounded::from(value).into()
    }
}

/// Light outside over the year.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct OutsideResult {
    /// Diffuse horizontal illuminance in klx h.
    pub diffuse_klxh: f64,
    /// Horizontal illuminance of the sun in klx h.
    pub direct_klxh: f64,
    /// Median of the diffuse horizontal illuminance over the daylight hours of EN 17037 in lux.
    pub median_diffuse_lux: f64,
}

impl From<&Outside> for OutsideResult {
    fn from(outside: &Outside) -> Self {
        let Outside { diffuse_klxh, direct_klxh, median_diffuse_lux, .. } = *outside;
        Self { diffuse_klxh, direct_klxh, median_diffuse_lux }
    }
}

/// Light of a tube over the year.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TubeYearResult {
    /// Light into the room in klm h.
    pub klm_h: WithInterval,
    /// Part of it in occupied records.
    pub occupied_klm_h: f64,
    /// Fraction of it that comes from the sky, without the sun.
    pub sky_share: f64,
    /// Light of each month in klm h, January first.
    pub monthly_klm_h: [f64; 12],
    /// Largest mean flux of a record in lm.
    pub largest_lm: f64,
    /// Light into the room over the light that falls on a horizontal surface as large as the opening.
    pub transmission: f64,
    /// Largest luminance of the closure in an occupied record in cd/m2; null unless it is Lambertian.
    pub largest_luminance_cd_m2: Option<f64>,
    /// Occupied hours in which the luminance of the closure is above limits; empty unless it is Lambertian.
    pub luminance_hours: Vec<LuminanceHours>,
}

/// Occupied hours in which the luminance of a closure is above a limit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LuminanceHours {
    /// Limit in cd/m2.
    pub above_cd_m2: f64,
    /// Number of hours.
    pub hours: f64,
}

impl From<&TubeSummary> for TubeYearResult {
    fn from(tube: &TubeSummary) -> Self {
        let hours = |(above_cd_m2, hours): (f64, f64)| LuminanceHours { above_cd_m2, hours };
        let above = tube.luminance.iter().flat_map(|luminance| LIMITS_CD_M2.into_iter().zip(luminance.hours_above));
        Self {
            klm_h: tube.klm_h.into(),
            occupied_klm_h: tube.occupied_klm_h,
            sky_share: tube.sky_share,
            monthly_klm_h: tube.monthly_klm_h,
            largest_lm: tube.largest_lm,
            transmission: tube.transmission,
            largest_luminance_cd_m2: tube.luminance.as_ref().map(|luminance| luminance.largest_cd_m2),
            luminance_hours: above.map(hours).collect(),
        }
    }
}

/// Metrics of a grid over the year; means and shares are by the areas of cells.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct GridYearResult {
    /// Name of the grid.
    pub name: String,
    /// Daylight autonomies, for each illuminance of the document.
    pub autonomies: Vec<AutonomyResult>,
    /// Useful daylight illuminances, shares of the occupied records.
    pub udi: UsefulResult,
    /// Spatial daylight autonomy: share of the area in percent.
    pub sda_percent: WithInterval,
    /// Annual sunlight exposure ASE1000,250: share of the area in percent with 1000 lx of sunlight that nothing in the room or the closure has
    /// scattered in more than 250 occupied hours. It is 0 below Lambertian closures by definition. Null for means over cells below others, and
    /// with `other_daylight`, which may have some.
    pub ase_percent: Option<f64>,
    /// Mean exposure in klx h.
    pub exposure_klxh: WithInterval,
    /// Mean illuminance of the occupied records in lux.
    pub mean_lux: WithInterval,
    /// Median illuminance of the daylight hours of EN 17037 in lux: mean over the area.
    pub median_lux: WithInterval,
    /// Smallest median of a point over the daylight hours of EN 17037.
    pub smallest_median_lux: WithInterval,
    /// Largest median of a point over the daylight hours of EN 17037.
    pub largest_median_lux: WithInterval,
    /// Provision of daylight by EN 17037: shares of the area.
    pub en17037: Vec<ProvisionResult>,
    /// Electric light; absent without `dimming` in the document, and for points of which one does not face straight up.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dimming: Option<ElectricityResult>,
    /// Criteria of standards and schemes, and whether the grid meets them; none for points of which one does not face straight up.
    pub verdicts: Vec<VerdictResult>,
}

/// Daylight autonomy of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AutonomyResult {
    /// Illuminance in lux.
    pub lux: f64,
    /// Share of the occupied records that reach it, in percent.
    pub da_percent: WithInterval,
    /// Continuous autonomy in percent: records below count by the fraction that they reach.
    pub cda_percent: WithInterval,
}

/// Useful daylight illuminances in percent of the occupied records; the four add up to 100.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct UsefulResult {
    /// Records below the first limit.
    pub below_percent: WithInterval,
    /// Records between the first and the second limit.
    pub supplementary_percent: WithInterval,
    /// Records between the second and the third limit.
    pub autonomous_percent: WithInterval,
    /// Records above the third limit.
    pub above_percent: WithInterval,
}

/// Share of the area that has an illuminance in half of the daylight hours.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ProvisionResult {
    /// Illuminance in lux.
    pub lux: f64,
    /// Share of the area in percent by the illuminances of all daylight hours.
    pub by_hours_percent: WithInterval,
    /// Daylight factor in percent that the site asks for; null where the median outside is 0.
    pub daylight_factor_percent: Option<f64>,
    /// Share of the area in percent with this daylight factor.
    pub by_factors_percent: WithInterval,
}

/// Electric light over the year: one zone with an ideal sensor, so that savings are an upper estimate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ElectricityResult {
    /// Energy without daylight in kWh.
    pub full_kwh: f64,
    /// Energy that daylight saves in kWh.
    pub saved_kwh: WithInterval,
    /// Energy in kWh that it would save if light dimmed to nothing without losses.
    pub saved_at_most_kwh: WithInterval,
}

/// Metrics of the sensors of a grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PointsYearResult {
    /// Name of the grid.
    pub name: String,
    /// Places of the sensors in metres, x, y and z, row by row.
    #[schema(value_type = Vec<Vector>)]
    pub points_m: Vec<[f64; 3]>,
    /// Unit vectors that the sensors face.
    #[schema(value_type = Vec<Vector>)]
    pub normals: Vec<[f64; 3]>,
    /// Metrics, each with a value for every sensor.
    pub columns: Vec<ColumnResult>,
}

/// Metric of the sensors of a grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ColumnResult {
    /// Name of the metric with its unit, such as `da_300_percent`.
    pub name: String,
    /// Value of each sensor; null inside solids and outside the room.
    pub values: Vec<Option<f64>>,
    /// Standard error of each value, raised where few passes tell it: 1.96 of them are half an interval of 95 %.
    pub standard_errors: Vec<Option<f64>>,
}

/// Criterion of a standard or a scheme, and whether a grid meets it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct VerdictResult {
    /// Standard or scheme.
    pub scheme: String,
    /// Criterion in words.
    pub clause: String,
    /// Value.
    pub value: f64,
    /// Lower end of its interval.
    pub low: f64,
    /// Upper end of its interval.
    pub high: f64,
    /// Limit.
    pub limit: f64,
    /// Unit of value, interval and limit: `%`, `h` or `lx`; empty in results of versions that did not store it.
    #[serde(default)]
    pub unit: String,
    /// Outcome: undecided where the limit lies within the interval.
    pub verdict: VerdictKind,
    /// Source of the criterion.
    pub basis: BasisKind,
    /// Number of points that count.
    pub points: usize,
    /// Hours that count.
    pub hours: f64,
}

/// Outcome of a comparison with a limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum VerdictKind {
    /// The whole interval meets the criterion.
    Pass,
    /// The whole interval misses it.
    Fail,
    /// The limit lies within the interval: more passes decide.
    Undecided,
}

/// Source of a criterion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum BasisKind {
    /// Text of the standard.
    Text,
    /// Publications that quote it.
    Secondary,
    /// Programs that compute it.
    Code,
    /// Own reading where the standard says nothing of tubes.
    Reading,
}

impl From<&Verdict> for VerdictResult {
    fn from(verdict: &Verdict) -> Self {
        let Bounded { value, low, high } = verdict.value;
        Self {
            scheme: verdict.scheme.to_owned(),
            clause: verdict.clause.clone(),
            value,
            low,
            high,
            limit: verdict.limit,
            unit: verdict.unit.to_owned(),
            verdict: match verdict.outcome {
                Outcome::Pass => VerdictKind::Pass,
                Outcome::Fail => VerdictKind::Fail,
                Outcome::Undecided => VerdictKind::Undecided,
            },
            basis: match verdict.basis {
                Basis::Text => BasisKind::Text,
                Basis::Secondary => BasisKind::Secondary,
                Basis::Code => BasisKind::Code,
                Basis::Reading => BasisKind::Reading,
            },
            points: verdict.points,
            hours: verdict.hours,
        }
    }
}

impl GridYearResult {
    /// Returns the metrics of a grid, by the illuminances of the document.
    pub fn new(name: &str, year: &GridYear, annual: &AnnualDocument) -> Self {
        let autonomies = annual.thresholds_lux.iter().zip(&year.autonomies_percent).zip(&year.continuous_percent);
        let provision = (0..THRESHOLDS_LUX.len()).map(|level| ProvisionResult {
            lux: THRESHOLDS_LUX[level],
            by_hours_percent: year.provision.by_hours_percent[level].into(),
            daylight_factor_percent: Some(year.provision.factors_percent[level]).filter(|factor| factor.is_finite()),
            by_factors_percent: year.provision.by_factors_percent[level].into(),
        });
        let [median, least, most] = year.median_lux;
        Self {
            name: name.to_owned(),
            autonomies: autonomies
                .map(|((lux, da), cda)| AutonomyResult {
                    lux: *lux,
                    da_percent: (*da).into(),
                    cda_percent: (*cda).into(),
                })
                .collect(),
            udi: UsefulResult {
                below_percent: year.useful.below_percent.into(),
                supplementary_percent: year.useful.supplementary_percent.into(),
                autonomous_percent: year.useful.autonomous_percent.into(),
                above_percent: year.useful.above_percent.into(),
            },
            sda_percent: year.spatial_percent.into(),
            ase_percent: year.sun_exposure_percent.map(|share| share.value),
            exposure_klxh: year.exposure_klxh.into(),
            mean_lux: year.mean_lux.into(),
            median_lux: median.into(),
            smallest_median_lux: least.into(),
            largest_median_lux: most.into(),
            en17037: provision.collect(),
            dimming: year.energy.as_ref().map(|energy| ElectricityResult {
                full_kwh: energy.full_kwh,
                saved_kwh: energy.saved_kwh.into(),
                saved_at_most_kwh: energy.saved_at_most_kwh.into(),
            }),
            verdicts: year.verdicts.iter().map(VerdictResult::from).collect(),
        }
    }
}
