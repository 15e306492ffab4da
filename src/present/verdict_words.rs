//! Verdicts on criteria in words.

use crate::document::result::annual::{VerdictKind, VerdictResult, WithInterval};
use crate::figure::ticks::significant;

/// Returns criterion, value, limit, and outcome.
pub fn verdict_in_words(verdict: &VerdictResult) -> [String; 4] {
    let outcome = match verdict.verdict {
        VerdictKind::Pass => "pass",
        VerdictKind::Fail => "fail",
        VerdictKind::Undecided => "undecided",
    };
    let VerdictResult { value, low, high, .. } = *verdict;
    [
        format!("{}, {}", verdict.scheme, verdict.clause),
        interval_in_words(WithInterval { value, low, high }),
        significant(verdict.limit, 4),
        outcome.to_owned(),
    ]
}

/// Formats a value with its interval of 95 % confidence where that has a width.
pub fn interval_in_words(WithInterval { value, low, high }: WithInterval) -> String {
    match high - low > 1e-9 * value.abs() {
        true => format!("{} ({} to {})", significant(value, 4), significant(low, 4), significant(high, 4)),
        false => significant(value, 4),
    }
}
