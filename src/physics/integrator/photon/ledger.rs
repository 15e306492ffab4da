//! Books of the energy of photons: the places where it ends.

use crate::guide::{End, RayCount, Transit};
use crate::optics::Spectrum;

/// Flux by the places where it ended, in lm; an estimate holds the sum over its passes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnergyLedger {
    /// Flux that reaches the collectors from outside.
    pub emitted: f64,
    /// Flux that leaves the luminaires.
    pub luminaires: f64,
    /// Flux reflected or absorbed by collectors on the way in, or through a dome and out again on its far side.
    pub collector: f64,
    /// Flux absorbed by mirrors, on the way down or up.
    pub guide: f64,
    /// Flux that leaves through the upper end of a guide, or is sent up into one from which nothing returns.
    pub guide_top: f64,
    /// Flux absorbed by diffusers.
    pub diffuser: f64,
    /// Flux absorbed by the surfaces of the room, its objects and luminaires.
    pub room: f64,
    /// Flux that leaves through open surfaces of the room.
    pub open_surfaces: f64,
    /// Flux of paths that were ended for their length, and the differences, zero in the mean, that roulette leaves
    /// where it chooses between two branches.
    pub cut: f64,
    /// Flux that left a guide through gaps in its mesh.
    pub lost: f64,
}

impl EnergyLedger {
    /// Adds the entries of other photons.
    pub fn add(&mut self, other: &Self) {
        let mut other = *other;
        self.values_mut().into_iter().zip(other.values_mut()).for_each(|(sum, value)| *sum += *value);
    }

    /// Every entry, the two sources first.
    pub fn values_mut(&mut self) -> [&mut f64; 10] {
        let Self { emitted, luminaires, collector, guide, guide_top, diffuser, room, open_surfaces, cut, lost } = self;
        [emitted, luminaires, collector, guide, guide_top, diffuser, room, open_surfaces, cut, lost]
    }

    /// Books what a guide took of a flux, of which `arriving` has come to its end; true if that is the opening.
    pub fn book_transit<const C: usize>(
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

    /// Emitted flux minus everything booked, relative to the emitted flux: the rounding error of the books; 0 without
    /// light.
    pub fn relative_closure_error(&self) -> f64 {
        let mut copy = *self;
        let booked: f64 = copy.values_mut()[2..].iter().map(|value| **value).sum();
        let sources = self.emitted + self.luminaires;
        if sources == 0.0 { 0.0 } else { (sources - booked) / sources }
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
    /// The part of it that leaves as from a Lambertian surface.
    pub evenly: f64,
}

/// Sums of a set of photons beside the visitor's own tallies.
#[derive(Clone, Debug, Default)]
pub struct Account {
    /// Where the flux went, in lm.
    pub ledger: EnergyLedger,
    /// Fluxes of each tube, in the scene's order.
    pub tubes: Vec<TubeFlux>,
    /// Ray segments that were followed.
    pub rays: RayCount,
    /// Number of the first photon of the pass that gave something infinite or no number: a fault of the program.
    pub not_finite: Option<u64>,
}

impl Account {
    /// An account of no photons.
    pub fn new(tubes: usize) -> Self {
        Self { tubes: vec![TubeFlux::default(); tubes], ..Self::default() }
    }

    /// True if all fluxes are finite.
    pub fn is_finite(&self) -> bool {
        let mut ledger = self.ledger;
        let tubes = self
            .tubes
            .iter()
            .all(|tube| (tube.at_collector + tube.at_diffuser + tube.into_room + tube.evenly).is_finite());
        tubes && ledger.values_mut().into_iter().all(|value| value.is_finite())
    }

    /// Adds the account of other photons. Sums depend on the order: it must be the same in every run.
    pub fn add(&mut self, other: &Self) {
        self.ledger.add(&other.ledger);
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
