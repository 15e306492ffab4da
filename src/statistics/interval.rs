//! Quantiles for confidence intervals.

use statrs::distribution::{ContinuousCDF, Normal};

/// Two-sided normal quantile z of a `confidence` in 0..1, e.g. 1.95996 for 0.95.
pub fn two_sided_normal_quantile(confidence: f64) -> f64 {
    Normal::standard().inverse_cdf(0.5 * (1.0 + confidence))
}

#[cfg(test)]
mod tests {
    #[test]
    fn ninety_five_percent() {
        assert!((super::two_sided_normal_quantile(0.95) - 1.959963984540054).abs() < 1e-9);
    }
}
