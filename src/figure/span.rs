//! Scales of false-colour pictures: their range, linear or logarithmic, and their ticks.

use crate::output::percentile;

/// Ratio of the highest to the lowest value beyond which a scale is logarithmic.
const LOGARITHMIC_BEYOND: f64 = 100.0;

/// Largest number of decades of a logarithmic scale.
const MOST_DECADES: i32 = 4;

/// Map from values to positions 0..1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Value at position 0; positive on a logarithmic scale.
    pub lowest: f64,
    /// Value at position 1, above the lowest.
    pub highest: f64,
    /// True if positions are proportional to the logarithm of the values.
    pub logarithmic: bool,
}

impl Scale {
    /// Creates a scale over `values` without the fraction `trim` (0..0.5) of lowest and of highest values; values that are not
    /// finite are left out.
    pub fn over(values: &[f64], trim: f64) -> Self {
        let highest = percentile(values.iter().copied(), 1.0 - trim).unwrap_or(0.0);
        let lowest = percentile(values.iter().copied(), trim).unwrap_or(0.0);
        if highest <= 0.0 {
            return Self { lowest: 0.0, highest: 1.0, logarithmic: false };
        }
        if highest > LOGARITHMIC_BEYOND * lowest {
            let positive = values.iter().copied().filter(|value| *value > 0.0);
            let lowest = percentile(positive, trim).unwrap_or(highest).max(highest * 10f64.powi(-MOST_DECADES));
            if highest > LOGARITHMIC_BEYOND * lowest && lowest > 0.0 {
                return Self { lowest, highest, logarithmic: true };
            }
        }
        // a scale of nearly equal values would show nothing but noise
        let lowest = if highest - lowest > 1e-3 * highest { lowest.max(0.0) } else { 0.0 };
        Self { lowest, highest, logarithmic: false }
    }

    /// Returns the position of a value, clipped to 0..1; 0 for NaN.
    pub fn position(&self, value: f64) -> f64 {
        let position = if self.logarithmic {
            libm::log(value / self.lowest) / libm::log(self.highest / self.lowest)
        } else {
            (value - self.lowest) / (self.highest - self.lowest)
        };
        if position.is_nan() { 0.0 } else { position.clamp(0.0, 1.0) }
    }

    /// Returns round values within the scale, ascending: 3 to 10 of them, or the two ends.
    pub fn ticks(&self) -> Vec<f64> {
        let ticks = if self.logarithmic { self.logarithmic_ticks() } else { self.linear_ticks() };
        if ticks.len() < 2 { vec![self.lowest, self.highest] } else { ticks }
    }

    fn linear_ticks(&self) -> Vec<f64> {
        let rough = (self.highest - self.lowest) / 5.0;
        let decade = 10f64.powi(libm::log10(rough).floor() as i32);
        let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * decade).find(|step| *step >= rough).unwrap_or(rough);
        let slack = 1e-9 * step;
        let first = ((self.lowest - slack) / step).ceil();
        (0..=10).map(|k| (first + f64::from(k)) * step).take_while(|tick| *tick <= self.highest + slack).collect()
    }

    fn logarithmic_ticks(&self) -> Vec<f64> {
        let decades = libm::log10(self.lowest).floor() as i32..=libm::log10(self.highest).ceil() as i32;
        let many = libm::log10(self.highest / self.lowest) > 3.0;
        let within = |tick: &f64| *tick >= self.lowest * (1.0 - 1e-9) && *tick <= self.highest * (1.0 + 1e-9);
        let multiples: &[f64] = if many { &[1.0] } else { &[1.0, 2.0, 5.0] };
        decades.flat_map(|decade| multiples.iter().map(move |m| m * 10f64.powi(decade))).filter(within).collect()
    }
}

/// Formats a tick's value with few characters, e.g. `0.05`, `1200`, `2e9`.
pub fn label(value: f64) -> String {
    let magnitude = value.abs();
    if value == 0.0 {
        return "0".to_owned();
    }
    if !(1e-3..1e5).contains(&magnitude) {
        let text = format!("{value:.1e}");
        return text.replace(".0e", "e");
    }
    // three significant digits distinguish the ticks
    let decimals = (2 - libm::log10(magnitude).floor() as i32).max(0) as usize;
    let text = format!("{value:.decimals$}");
    if decimals == 0 { text } else { text.trim_end_matches('0').trim_end_matches('.').to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_ranges_are_logarithmic() {
        let even = Scale::over(&[50.0, 60.0, 90.0], 0.0);
        assert_eq!(even, Scale { lowest: 50.0, highest: 90.0, logarithmic: false });
        assert_eq!(even.ticks(), [50.0, 60.0, 70.0, 80.0, 90.0]);
        let wide = Scale::over(&[0.0, 1.0, 90.0, 5000.0], 0.0);
        assert_eq!(wide, Scale { lowest: 1.0, highest: 5000.0, logarithmic: true });
        assert_eq!(wide.ticks(), [1.0, 10.0, 100.0, 1000.0]);
        assert!((wide.position(70.710678) - 0.5).abs() < 1e-7);
        assert_eq!([wide.position(0.0), wide.position(f64::NAN), wide.position(1e9)], [0.0, 0.0, 1.0]);
    }

    #[test]
    fn defined_for_every_range() {
        for values in
            [&[][..], &[0.0], &[f64::NAN], &[-1.0, -2.0], &[5.0, 5.0], &[1e-300, 1e300], &[f64::INFINITY, 1.0]]
        {
            let scale = Scale::over(values, 0.005);
            assert!(scale.lowest < scale.highest && scale.highest.is_finite(), "{values:?}: {scale:?}");
            let ticks = scale.ticks();
            assert!((2..=12).contains(&ticks.len()), "{values:?}: {ticks:?}");
            assert!((0.0..=1.0).contains(&scale.position(3.0)));
        }
    }

    #[test]
    fn labels_are_short() {
        let labels = [0.0, 0.05, 0.5, 1.0, 62.5, 150.0, 1200.0, 99_000.0, 2e9, 1.5e-7].map(label);
        assert_eq!(labels, ["0", "0.05", "0.5", "1", "62.5", "150", "1200", "99000", "2e9", "1.5e-7"]);
    }
}
