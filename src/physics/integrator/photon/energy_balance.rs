//! Energy balance of photons: the places where their flux ends.

use crate::guide::{End, RayCount, Transit};
use crate::optics::Spectrum;

/// Flux by the places where it ended, in lm; that of an estimate is the sum over its passes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnergyBalance {
    /// Flux that reaches the collectors from outside.
    pub emitted: f64,
    /// Flux that leaves the luminaires.
    pub luminaires: f64,
    /// Flux that enters from outside and is reflected or absorbed by collectors, or passes a dome and leaves on its far side.
    pub collector: f64,
    /// Flux absorbed by the mirrors of guides, downward or upward.
    pub guide: f64,
    /// Flux that leaves through the upper end of a guide, or is sent up into one from which nothing returns.
    pub guide_top: f64,
    /// Flux absorbed by diffusers.
    pub diffuser: f64,
    /// Flux absorbed by the surfaces of the room, its objects and luminaires.
    pub room: f64,
    /// Flux that leaves through open surfaces of the room.
    pub open_surfaces: f64,
    /// Flux of paths that were ended for their length, and the differences, zero on average, that Russian roulette leaves where it chooses
    /// between two branches.
    pub cut: f64,
    /// Flux that left a guide through gaps in its mesh.
    pub lost: f64,
}

impl EnergyBalance {
    /// Adds the entries of other photons.
    pub fn add(&mut self, other: &Self) {
        let mut other = *other;
        self.values_mut().into_iter().zip(other.values_mut()).for_each(|(sum, value)| *sum += *value);
    }

    /// Returns every entry, the two sources first.
    pub fn values_mut(&mut self) -> [&mut f64; 10] {
        let Self { emitted, luminaires, collector, guide, guide_top, diffuser, room, open_surfaces, cut, lost } = self;
        [emitted, luminaires, collector, guide, guide_top, diffuser, room, open_surfaces, cut, lost]
    }

    /// Adds the flux that was lost in a guide, of which `arriving` reached the end of its path; true if that end is the opening.
    pub fn add_transit<const C: usize>(
        &mut self,
        transit: &Transit<C>,
        flux: Spectrum<C>,
        arriving: Spectrum<C>,
    ) -> bool {
        let collected = flux * transit.collector;
        self.collector += flux.luminance() - collected.luminance();
        self.guide += collected.luminance() - arriving.luminance();
        let place = match transit.end {
            End::Opening => return true,
            End::Top => &mut self.guide_top,
            End::Absorbed => &mut self.guide,
            End::Lost => &mut self.lost,
            End::Cut => &mut self.cut,
        };
        *place += arriving.luminance();
        false
    }

    /// Returns the emitted flux minus the sum of all other entries, relative to the emitted flux: the rounding error of the energy balance.
    /// Returns 0 without light.
    pub fn relative_closure_error(&self) -> f64 {
        let mut copy = *self;
        let accounted: f64 = copy.values_mut()[2..].iter().map(|value| **value).sum();
        let sources = self.emitted + self.luminaires;
        if sources == 0.0 { 0.0 } else { (sources - accounted) / sources }
    }
}

/// Flux of one tube in lm.
#[derive(Clone, Copy, Debug, Default)]
pub struct TubeFlux {
    /// Flux that reaches the collector from outside.
    pub at_collector: f64,
    /// Flux that arrives at the closure from above.
    pub at_diffuser: f64,
    /// Flux that leaves the closure downward for the first time.
    pub into_room: f64,
    /// Part of `into_room` that leaves with a Lambertian distribution.
    pub evenly: f64,
}

/// Sums over a set of photons, beside the visitor's own tallies.
#[derive(Clone, Debug, Default)]
pub struct PhotonTotals {
    /// Flux by the places where it ended, in lm.
    pub energy: EnergyBalance,
    /// Fluxes of each tube, in the scene's order.
    pub tubes: Vec<TubeFlux>,
    /// Number of ray segments that were traced.
    pub rays: RayCount,
    /// Number of the first photon of the pass whose result is infinite or not a number, which is a fault of the program.
    pub not_finite: Option<u64>,
}

impl PhotonTotals {
    /// Creates the sums over no photons.
    pub fn new(tubes: usize) -> Self {
        Self { tubes: vec![TubeFlux::default(); tubes], ..Self::default() }
    }

    /// True if all fluxes are finite.
    pub fn is_finite(&self) -> bool {
        let mut energy = self.energy;
        let tubes = self
            .tubes
            .iter()
            .all(|tube| (tube.at_collector + tube.at_diffuser + tube.into_room + tube.evenly).is_finite());
        tubes && energy.values_mut().into_iter().all(|value| value.is_finite())
    }

    /// Adds the sums over other photons. Rounding depends on the order of the additions, which must be the same in every run.
    pub fn add(&mut self, other: &Self) {
        self.energy.add(&other.energy);
        for (sum, tube) in self.tubes.iter_mut().zip(&other.tubes) {
            sum.at_collector += tube.at_collector;
            sum.at_diffuser += tube.at_diffuser;
            sum.into_room += tube.into_room;
            sum.evenly += tube.evenly;
        }
        self.rays += other.rays;
        self.not_finite = self.not_finite.or(other.not_finite);
    }
}
