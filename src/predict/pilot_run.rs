//! Passes of one size that a pilot has tried: which accuracies they tell of, and what passes of another size would take.

use std::cmp::Ordering;

use super::pilot_passes::Passes;
use crate::integrator::trial::TrialPasses;

/// Passes of one size that were tried.
pub struct Run {
    /// Size of a pass.
    pub size: f64,
    /// Relative error that the passes are meant for.
    pub accuracy: f64,
    pub passes: Passes,
    /// Processor seconds until the first pass of a job begins.
    pub setup_seconds: f64,
    /// Processor seconds in which integrators of another size would be built, which share what these have computed of the room.
    pub rebuilding: f64,
    /// Processor seconds of a pass apart from its places, and of each place.
    pub of_pass: f64,
    pub of_place: f64,
    /// Processor seconds of everything that was tried for this size, apart from building integrators.
    pub spent: f64,
}

impl Run {
    /// True if passes for this relative error need not be tried: those of one size are the same, except that a room may size them
    /// otherwise for the error that is `asked`.
    pub fn tells(&self, passes: &TrialPasses, accuracy: f64, asked: f64) -> bool {
        let is_apart = passes.by_room && accuracy == asked && accuracy != self.accuracy;
        self.size == passes.tried && !is_apart
    }

    /// Returns the processor seconds that a run of passes of this size would take, whose work is in proportion to it.
    pub fn expected_seconds(&self, size: f64) -> f64 {
        self.rebuilding + self.spent * size / self.size
    }

    /// Returns the run that is nearest to a trial for this relative error: in size, and of equal sizes in the error.
    pub fn nearest<'a>(runs: &'a [Self], passes: &TrialPasses, accuracy: f64) -> Option<&'a Self> {
        let ratio = |of: f64, to: f64| libm::log(of / to).abs();
        let apart = |run: &Self| [ratio(run.size, passes.tried), ratio(run.accuracy, accuracy)];
        let order = |one: &&Self, other: &&Self| apart(one).partial_cmp(&apart(other)).unwrap_or(Ordering::Equal);
        runs.iter().min_by(order)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::trial::Powers;

    fn run(size: f64, accuracy: f64) -> Run {
        let passes = Passes::default();
        Run { size, accuracy, passes, setup_seconds: 8.0, rebuilding: 2.0, of_pass: 0.0, of_place: 0.0, spent: 3.0 }
    }

    /// A room may size passes otherwise for another error, so those for the asked one are tried by themselves; others only if their size
    /// is new. Set-up that is shared is not expected again.
    #[test]
    fn passes_for_the_asked_error_are_tried() {
        let (of_room, fixed) = (TrialPasses::of_size(4.0, Powers::of_growth(2.0)), TrialPasses::WHOLE);
        let rough = run(4.0, 0.1);
        assert_eq!([0.05, 0.02].map(|accuracy| rough.tells(&of_room, accuracy, 0.02)), [true, false]);
        assert!(run(4.0, 0.02).tells(&of_room, 0.02, 0.02));
        assert!(run(1.0, 0.1).tells(&fixed, 0.02, 0.02) && !rough.tells(&fixed, 0.05, 0.02));
        assert_eq!(rough.expected_seconds(16.0), 2.0 + 12.0);
    }

    #[test]
    fn an_error_is_predicted_by_the_nearest_run() {
        let runs = [run(4.0, 0.1), run(4.0, 0.02), run(64.0, 0.005)];
        let of = |size: f64, accuracy: f64| {
            let passes = TrialPasses::of_size(size, Powers::of_growth(2.0));
            Run::nearest(&runs, &passes, accuracy).unwrap().accuracy
        };
        assert_eq!([of(4.0, 0.05), of(4.0, 0.03), of(8.0, 0.015), of(32.0, 0.01)], [0.1, 0.02, 0.02, 0.005]);
        assert!(Run::nearest(&[], &TrialPasses::WHOLE, 0.1).is_none());
    }
}
