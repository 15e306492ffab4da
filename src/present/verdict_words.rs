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
    let VerdictResult { value, low, high, ref unit, .. } = *verdict;
    [
        format!("{}, {}", verdict.scheme, verdict.clause),
        format!("{} {unit}", interval_in_words(WithInterval { value, low, high })),
        format!("{} {unit}", rounded(verdict.limit)),
        outcome.to_owned(),
    ]
}

/// Formats a value with its interval of 95 % confidence where that has a width.
pub fn interval_in_words(WithInterval { value, low, high }: WithInterval) -> String {
    match high - low > 1e-9 * value.abs() {
        true => format!("{} ({} to {})", rounded(value), rounded(low), rounded(high)),
        false => rounded(value),
    }
}

/// Formats a number with four digits at most: shares of few sensors are whole percents, and limits are round.
fn rounded(value: f64) -> String {
    let text = significant(value, 4);
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeros_that_tell_nothing_are_left_out() {
        let interval = |value, low, high| interval_in_words(WithInterval { value, low, high });
        assert_eq!(interval(43.0, 36.0, 44.0), "43 (36 to 44)");
        assert_eq!(interval(121.08, 119.5, 122.7), "121.1 (119.5 to 122.7)");
        assert_eq!((interval(100.0, 100.0, 100.0), interval(0.0, 0.0, 0.0)), ("100".to_owned(), "0".to_owned()));
    }
}
