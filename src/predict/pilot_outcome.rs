//! Predictions of one method by the pilot.

use super::predictions::PredictedTime;

/// Reason that is given where a method was not tried, or not long enough.
pub const NO_TIME: &str = "its set-up and first passes take longer than its trial may";

/// Reason that is given where the processors did other work instead.
pub const BUSY: &str = "the machine is busy: its processors had no time for the trial";

/// Lowers the time to an accuracy to that of the next tighter one where it is above that, which can only be chance of the pilot. `times`
/// begin with the loosest accuracy.
pub fn cheapen_the_looser(times: &mut [PredictedTime]) {
    for index in (1..times.len()).rev() {
        let (looser, tighter) = (&times[index - 1], &times[index]);
        if let (Some(of_looser), Some(of_tighter)) = (looser.seconds, tighter.seconds)
            && of_looser > of_tighter
        {
            times[index - 1] = PredictedTime { relative_error: looser.relative_error, ..tighter.clone() };
        }
    }
}

/// Predictions of a method.
#[derive(Default)]
pub struct Outcome {
    pub first_number: Option<f64>,
    pub times: Vec<PredictedTime>,
    /// True if other work of the machine left no time for more.
    pub is_busy: bool,
}

impl Outcome {
    pub fn time_to(&self, relative_error: f64) -> PredictedTime {
        let found = self.times.iter().find(|time| time.relative_error == relative_error);
        found
            .cloned()
            .unwrap_or_else(|| PredictedTime::unknown(relative_error, if self.is_busy { BUSY } else { NO_TIME }))
    }
}
