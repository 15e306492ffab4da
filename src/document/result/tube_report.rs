//! Performance of a tube as JSON: fluxes, efficiencies, and transmission of beams.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::tube::{FluxResult, TubeResult};
use crate::guide::performance::{Throughput, Transmission};

/// Performance of a tube. The fluxes are the job's own. Everything else is computed separately, without the diffuser and the
/// transition to a square: in closed form, with errors of 0, if the guide is straight, its collector thin and the reflectance
/// of its mirror the same at all angles; otherwise by rays, until the standard error of a transmission under a sky or in the
/// sun is one and a half times the error that the job asks of its grids, but at most 0.015, and for beams over altitudes four
/// times that, as the root mean square over these.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TubeReport {
    /// Number of the tube in the document, from 0.
    pub tube: usize,
    /// Coverage factor of GUM for each standard error below except those of `flux`, which have factors of their own: this number
    /// of standard errors is half an interval of 95 %. It is Student's quantile for one degree of freedom less than replicates of
    /// rays.
    #[serde(default)]
    pub coverage_factor: Option<f64>,
    /// Computation of the guide: `closed_form_straight`, `closed_form_bent` or `mesh`.
    pub guide: String,
    /// Fluxes of the job: at the collector, at the upper side of the diffuser, and into the room.
    pub flux: TubeResult,
    /// Transmission of collector and guide for parallel light, by its altitude.
    pub beam: BeamReport,
    /// Transmission of collector and guide under a uniform sky.
    pub uniform_sky: TransmissionResult,
    /// Transmission of collector and guide under the job's sky; null when there is none.
    pub sky: Option<SkyReport>,
    /// Transmission of collector and guide for the job's sunbeam; null when there is none.
    pub sun: Option<ThroughputResult>,
    /// Straight tube that transmits as much light; only for a bent tube.
    pub equivalent_straight: Option<StraightReport>,
}

/// Transmission of collector and guide for parallel light, by the altitude of the sun.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct BeamReport {
    /// Azimuth of the sun in degrees, clockwise from the room's +y axis: the job's, or 180 without one.
    pub azimuth_deg: f64,
    /// Altitudes of the sun in degrees, ascending; the other lists have one value for each. Steps of 5 degrees where the
    /// transmission is in closed form; otherwise 5 degrees, steps of 10 degrees, and altitudes between where a straight line
    /// could be farther from the curve than the errors of its points.
    pub altitude_deg: Vec<f64>,
    /// Ratio of flux at the diffuser's upper side to flux at the collector, for each altitude.
    pub transmission: Vec<f64>,
    /// Standard errors of `transmission`.
    pub standard_error: Vec<f64>,
    /// Effective area in m2: flux at the diffuser's upper side in lm per lux of the beam's normal illuminance.
    pub effective_area_m2: Vec<f64>,
    /// Transmission of eight beams together, spaced evenly around the tube from `azimuth_deg` on: the ratio of their total flux
    /// at the diffuser's upper side to that at the collector.
    pub azimuth_mean_transmission: Vec<f64>,
    /// Standard errors of `azimuth_mean_transmission`.
    pub azimuth_mean_standard_error: Vec<f64>,
}

/// Transmission of collector and guide with its standard error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TransmissionResult {
    /// Ratio of flux at the diffuser's upper side to flux at the collector, 0..1.
    pub transmission: f64,
    /// Standard error of the transmission.
    pub standard_error: f64,
}

impl From<Transmission> for TransmissionResult {
    fn from(transmission: Transmission) -> Self {
        Self { transmission: transmission.value, standard_error: transmission.standard_error }
    }
}

/// Fluxes and transmission of light of one kind through collector and guide.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ThroughputResult {
    /// Flux that reaches the collector from outside.
    pub at_collector: FluxResult,
    /// Flux that arrives at the upper side of the diffuser.
    pub at_diffuser: FluxResult,
    /// Ratio of `at_diffuser` to `at_collector`, 0..1.
    pub transmission: f64,
    /// Standard error of the transmission.
    pub standard_error: f64,
}

impl ThroughputResult {
    /// Converts a throughput, one unit of which is `per_unit` lm.
    pub fn new(throughput: &Throughput, per_unit: f64) -> Self {
        let flux = |moments: crate::statistics::Moments| FluxResult::new(&moments, per_unit, false);
        let Transmission { value, standard_error } = throughput.transmission();
        Self {
            at_collector: flux(throughput.entering()),
            at_diffuser: flux(throughput.arriving()),
            transmission: value,
            standard_error,
        }
    }
}

/// Transmission of the sky's light through collector and guide, integrated in two ways.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SkyReport {
    /// Integral over directions that are sampled from the sky itself.
    pub direct: ThroughputResult,
    /// Integral by parallel light from the centre of each of the 145 patches of Tregenza, as Dutton and Shao traced light pipes:
    /// where it differs from `direct` beyond the errors, the division into patches is the cause.
    pub patches: ThroughputResult,
}

/// Comparison of the bent tube with straight tubes of its diameter, reflectance and collector, under a uniform sky.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StraightReport {
    /// Length along the axis of the bent tube in metres.
    pub length_m: f64,
    /// Transmission of the straight tube of this length.
    pub transmission: TransmissionResult,
    /// Ratio of the bent tube's transmission to that of the straight tube of this length.
    pub efficiency: f64,
    /// Length in metres of the straight tube that transmits as much as the bent one; null if even one of a hundred times the bent
    /// tube's length loses less light.
    pub equivalent_length_m: Option<f64>,
}
