//! One replicate of the responses of a room.

use crate::guide::RayCount;
use crate::optics::Spectrum;

/// One replicate of the responses of all sensors of some grids.
#[derive(Debug)]
pub struct RoomPass {
    /// The sensors of each grid.
    pub grids: Vec<Vec<Response>>,
    /// Rays that were traced for it.
    pub rays: RayCount,
}

/// What one sensor gets.
#[derive(Debug)]
pub struct Response {
    /// By way of surfaces of the room, in lx/lm for each patch of each tube, all channels of a patch together.
    pub reflected: Vec<f64>,
    /// Straight from each patch in lx/lm, where it is told and the sensor does not see all openings whole; else empty.
    pub straight: Vec<f64>,
    /// Light of luminaires in lx.
    pub luminaires: f64,
}

impl RoomPass {
    /// Bytes that it takes.
    pub fn bytes(&self) -> usize {
        let values = |response: &Response| response.reflected.len() + response.straight.len() + 8;
        self.grids.iter().flatten().map(|response| size_of::<f64>() * values(response)).sum()
    }
}

/// The sum over patches of what one lumen of each gives times the lumens that leave it: the channels of the light.
pub fn lit_by<const C: usize>(reflected: &[f64], fluxes: &[Spectrum<C>]) -> Spectrum<C> {
    let mut lit = Spectrum::ZERO;
    for (per_lumen, flux) in reflected.chunks_exact(C).zip(fluxes) {
        for ((lit, per_lumen), flux) in lit.0.iter_mut().zip(per_lumen).zip(flux.0) {
            *lit += per_lumen * flux;
        }
    }
    lit
}
