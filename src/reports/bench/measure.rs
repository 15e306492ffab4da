//! Repeated measurements, their medians, and their formats.

use std::time::{Duration, Instant};

use crate::page::ReportError;
use skyduct::engine::spent::Clocks;
use skyduct::figure::ticks::significant;
pub use skyduct::study::outcome::Quartiles;

/// Limits for repeating a measurement: at most `most` times, but not again after `seconds`; once in any case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repeats {
    pub most: usize,
    pub seconds: f64,
}

impl Repeats {
    /// Repeats a measurement and returns the results; `run` gets the number of each run, from 0.
    pub fn run<T>(self, mut run: impl FnMut(u64) -> Result<T, ReportError>) -> Result<Vec<T>, ReportError> {
        let end = Instant::now() + Duration::from_secs_f64(self.seconds);
        let mut results = vec![run(0)?];
        while results.len() < self.most && Instant::now() < end {
            results.push(run(results.len() as u64)?);
        }
        Ok(results)
    }
}

/// Formats a median of seconds as a time, followed by its quartiles.
pub fn as_time(quartiles: &Quartiles) -> String {
    let Quartiles { lower, median, upper } = *quartiles;
    if lower == upper { time(median) } else { format!("{} ({} to {})", time(median), time(lower), time(upper)) }
}

/// Runs something on the current pool, and measures the processor seconds of its threads; wall-clock seconds where the system
/// does not report them.
pub fn processor_seconds<T>(of: impl FnOnce() -> T) -> (T, f64) {
    let clocks = Clocks::start();
    let value = of();
    let spent = clocks.spent();
    (value, spent.cpu_seconds.unwrap_or(spent.seconds))
}

/// Runs something on a pool of one thread.
pub fn on_one_thread<T: Send>(run: impl FnOnce() -> Result<T, ReportError> + Send) -> Result<T, ReportError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    pool.map_err(|error| ReportError::Case(format!("no thread can be started: {error}")))?.install(run)
}

/// Formats seconds with three significant digits and a unit: `930 µs`, `12.4 s`.
pub fn time(seconds: f64) -> String {
    match seconds {
        seconds if seconds >= 1.0 => format!("{} s", significant(seconds, 3)),
        seconds if seconds >= 1e-3 => format!("{} ms", significant(1e3 * seconds, 3)),
        seconds => format!("{} µs", significant(1e6 * seconds, 3)),
    }
}

/// Formats a fraction in percent with three significant digits.
pub fn percent(share: f64) -> String {
    format!("{} %", significant(100.0 * share, 3))
}

/// Formats bytes in MiB.
pub fn mebibytes(bytes: u64) -> String {
    format!("{} MiB", significant(bytes as f64 / f64::from(1 << 20), 3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_end_by_their_number_or_their_time_and_there_is_one() {
        let count = |repeats: Repeats| repeats.run(Ok).unwrap();
        assert_eq!(count(Repeats { most: 3, seconds: 1e3 }), [0, 1, 2]);
        assert_eq!(count(Repeats { most: 3, seconds: 0.0 }), [0]);
        assert_eq!(count(Repeats { most: 0, seconds: 1e3 }), [0]);
        let failing = Repeats { most: 3, seconds: 1.0 }.run(|_| Err::<(), _>(ReportError::Case("no".to_owned())));
        assert_eq!(failing.unwrap_err().to_string(), "no");
    }

    #[test]
    fn numbers_have_their_units() {
        assert_eq!(
            [3e-6, 0.000_93, 0.0366, 12.44, 1234.5].map(time),
            ["3.00 µs", "930 µs", "36.6 ms", "12.4 s", "1230 s"]
        );
        assert_eq!(percent(0.0123), "1.23 %");
        assert_eq!(mebibytes(3 << 20), "3.00 MiB");
        let spread = Quartiles { lower: 0.001, median: 0.002, upper: 0.003 };
        assert_eq!(as_time(&spread), "2.00 ms (1.00 ms to 3.00 ms)");
    }
}
