//! How a tube performs, as JSON: fluxes, efficiencies, the transmission of beams.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::tube::{FluxResult, TubeResult};
use crate::guide::performance::{Throughput, Transmission};

/// A tube in numbers of the trade. The fluxes are the job's own; all else is computed apart, without the diffuser: in closed form, with
/// errors of 0, where the guide is straight, its collector thin and the reflectance of its mirror the same at all angles; else by rays,
/// until the standard error of a transmission under a sky or in the sun is one and a half times that which the job asks of its grids, but
/// at most 0.015, and four times that for beams over altitudes, in the root mean square over these.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TubeReport {
    /// Number of the tube in the document.
    pub tube: usize,
    /// Times each standard error below, but for those of `flux`, which have factors of their own, is half an interval of 95 %: GUM's
    /// coverage factor, Student's quantile for one less than the replicates of rays.
    #[serde(default)]
    pub coverage_factor: Option<f64>,
    /// Computation of the guide: `closed_form_straight`, `closed_form_bent` or `mesh`.
    pub guide: String,
    /// Fluxes of the job: at the collector, at the diffuser's top, into the room.
    pub flux: TubeResult,
    /// Collector and guide under parallel light, over its altitude.
    pub beam: BeamReport,
    /// Collector and guide under a uniform sky.
    pub uniform_sky: TransmissionResult,
    /// Under the job's sky and sun; null when there is none.
    pub sky: Option<SkyReport>,
    /// The job's beam through collector and guide; null when there is none.
    pub sun: Option<ThroughputResult>,
    /// Straight tube that passes as much light; only of a bent tube.
    pub equivalent_straight: Option<StraightReport>,
}

/// Transmission of collector and guide for parallel light against the altitude of the sun.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct BeamReport {
    /// Azimuth of the sun that the curve is for, clockwise from the room's +y axis: the job's, or 180 without one.
    pub azimuth_deg: f64,
    /// Altitudes of the sun, ascending; the other lists have one value for each. Steps of 5 degrees where the transmission is in closed
    /// form; else 5 degrees, steps of 10 degrees, and altitudes between where a straight line could be farther from the curve than the
    /// errors of its points.
    pub altitude_deg: Vec<f64>,
    /// Flux at the diffuser's top over flux at the collector.
    pub transmission: Vec<f64>,
    /// Standard errors of `transmission`.
    pub standard_error: Vec<f64>,
    /// Flux at the diffuser's top in lm per lux of the beam's normal illuminance.
    pub effective_area_m2: Vec<f64>,
    /// Transmission of eight beams together, from that azimuth on evenly around the tube: flux at the diffuser's top over flux at
    /// the collector of all.
    pub azimuth_mean_transmission: Vec<f64>,
    /// Standard errors of `azimuth_mean_transmission`.
    pub azimuth_mean_standard_error: Vec<f64>,
}

/// A transmission of collector and guide.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TransmissionResult {
    /// Flux at the diffuser's top over flux at the collector, 0..1.
    pub transmission: f64,
    /// Standard error of the transmission.
    pub standard_error: f64,
}

impl From<Transmission> for TransmissionResult {
    fn from(transmission: Transmission) -> Self {
        Self { transmission: transmission.value, standard_error: transmission.standard_error }
    }
}

/// Light of one kind through collector and guide.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ThroughputResult {
    /// Flux that reaches the collector from outside.
    pub at_collector: FluxResult,
    /// Flux that arrives at the diffuser's top.
    pub at_diffuser: FluxResult,
    /// The second flux over the first, 0..1.
    pub transmission: f64,
    /// Standard error of the transmission.
    pub standard_error: f64,
}

impl ThroughputResult {
    /// `per_unit`: what one unit of the throughput stands for, in lm.
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

/// The sky through collector and guide, integrated in two ways.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SkyReport {
    /// Directions drawn from the sky itself.
    pub direct: ThroughputResult,
    /// Parallel light from the middle of each of the 145 patches of Tregenza, as Dutton and Shao traced light pipes:
    /// what differs from `direct` beyond the errors is the division into patches.
    pub patches: ThroughputResult,
}

/// The bent tube beside straight tubes of its diameter, reflectance and collector, under a uniform sky.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StraightReport {
    /// Length along the axis of the bent tube.
    pub length_m: f64,
    /// Transmission of the straight tube of this length.
    pub transmission: TransmissionResult,
    /// Transmission of the bent tube over that.
    pub efficiency: f64,
    /// Length of the straight tube that transmits as much as the bent one; null when no straight tube up to a hundred
    /// times its length loses as much.
    pub equivalent_length_m: Option<f64>,
}
