//! Passes add up to estimates with errors.

pub mod film;
pub mod grid;
pub mod stopping;

pub use film::FilmEstimate;
pub use grid::GridEstimate;
pub use stopping::{Accuracy, StopRule};

use crate::statistics::Moments;

/// The state of a job: everything that its passes have added up to. Merged in chunk order only.
#[derive(Clone, Debug, Default)]
pub struct Estimate {
    pub passes: u64,
    pub photons: u64,
    pub rays: u64,
    pub grids: Vec<GridEstimate>,
    pub views: Vec<FilmEstimate>,
    pub tubes: Vec<TubeEstimate>,
    pub ledger: Ledger,
}

/// Flux through one tube in lm, per pass.
#[derive(Clone, Copy, Debug, Default)]
pub struct TubeEstimate {
    pub at_collector: Moments,
    pub at_diffuser: Moments,
    pub into_room: Moments,
}

/// Where the emitted flux went, in lm summed over passes (divide by the number of passes).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ledger {
    /// Reaches the collectors from outside.
    pub emitted: f64,
    /// Reflected or absorbed by collectors on the way in.
    pub collector: f64,
    /// Absorbed by mirrors, on the way down or up.
    pub guide: f64,
    /// Leaves through the upper end of a guide, or is sent up into one from which nothing returns.
    pub guide_top: f64,
    /// Absorbed by diffusers.
    pub diffuser: f64,
    /// Absorbed by the surfaces of the room and its objects.
    pub room: f64,
    /// Leaves through open surfaces of the room.
    pub open_surfaces: f64,
    /// What paths carried that were ended for their length, and the differences, zero in the mean, that roulette leaves
    /// where it chooses between two branches.
    pub cut: f64,
}

impl Ledger {
    pub fn add(&mut self, other: &Self) {
        self.emitted += other.emitted;
        self.collector += other.collector;
        self.guide += other.guide;
        self.guide_top += other.guide_top;
        self.diffuser += other.diffuser;
        self.room += other.room;
        self.open_surfaces += other.open_surfaces;
        self.cut += other.cut;
    }

    /// Emitted less everything booked, relative to emitted: the rounding error of the books; 0 when nothing was emitted.
    pub fn relative_closure_error(&self) -> f64 {
        let booked = self.collector
            + self.guide
            + self.guide_top
            + self.diffuser
            + self.room
            + self.open_surfaces
            + self.cut;
        if self.emitted == 0.0 { 0.0 } else { (self.emitted - booked) / self.emitted }
    }
}
