//! Round numbers for the ticks of axes, and numbers as text.

/// Largest number of ticks of an axis; an axis that would have more has none.
const MOST: f64 = 1000.0;

/// Tick of an axis, with its label.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// Value at the tick.
    pub value: f64,
    /// Label; `None` for a grid line without one.
    pub label: Option<String>,
}

/// Steps between ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Steps {
    /// 1, 2 and 5 times powers of ten.
    Decimal,
    /// Steps for angles and hours: 1, 2, 5, 10, 15, 30, 45, 60, 90.
    Sexagesimal,
}

/// Returns the smallest round step that divides a range (above zero) into at most `most` intervals.
pub fn step(range: f64, most: usize, steps: Steps) -> f64 {
    let rough = range / most.max(1) as f64;
    let sixtieths = [1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 45.0, 60.0, 90.0, 180.0];
    if steps == Steps::Sexagesimal
        && let Some(step) = sixtieths.into_iter().find(|step| *step >= rough * (1.0 - 1e-9))
        && rough > 0.5
    {
        return step;
    }
    let decade = libm::pow(10.0, libm::log10(rough).floor());
    let fitting = [1.0, 2.0, 5.0, 10.0].into_iter().map(|multiple| multiple * decade);
    fitting.into_iter().find(|step| *step >= rough * (1.0 - 1e-9)).unwrap_or(10.0 * decade)
}

/// Returns labelled ticks from `from` to `to` (larger), at most `most` + 1 of them, at whole multiples of a round step.
pub fn linear(from: f64, to: f64, most: usize, steps: Steps) -> Vec<Tick> {
    let range = to - from;
    if !(range.is_finite() && range > 0.0) {
        return Vec::new();
    }
    let step = step(range, most, steps);
    let [first, last] = [(from / step - 1e-9).ceil(), (to / step + 1e-9).floor()];
    if (last - first).is_nan() || last - first >= MOST {
        return Vec::new();
    }
    let decimals = decimals(step);
    let tick = |count: i32| {
        let value = (first + f64::from(count)) * step;
        let label = if value == 0.0 { "0".to_owned() } else { fixed(value, decimals) };
        Tick { value, label: Some(label) }
    };
    (0..=(last - first) as i32).map(tick).collect()
}

/// Returns the ticks of a logarithmic axis from `from` > 0 to `to`: labels at 1, 2 and 5 times powers of ten over few decades,
/// else at powers of ten only; unlabelled ticks at all other digits over at most five decades.
pub fn logarithmic(from: f64, to: f64, unit: &str) -> Vec<Tick> {
    let decades = libm::log10(to / from);
    if !(decades.is_finite() && decades > 0.0) {
        return Vec::new();
    }
    // over many decades only every second, third .. power of ten has room for a label
    let every = (decades / 8.0).ceil().max(1.0) as i32;
    let labelled: &[i32] = if decades <= 2.2 { &[1, 2, 5] } else { &[1] };
    let lined: &[i32] = if decades <= 5.0 { &[1, 2, 3, 4, 5, 6, 7, 8, 9] } else { &[1] };
    let powers = libm::log10(from).floor() as i32..=libm::log10(to).ceil() as i32;
    let mut ticks = Vec::new();
    for power in powers {
        for digit in lined {
            // of small powers the nearest number to the decimal fraction
            let value = match power {
                0.. => f64::from(*digit) * libm::pow(10.0, f64::from(power)),
                _ => f64::from(*digit) / libm::pow(10.0, f64::from(-power)),
            };
            if value < from * (1.0 - 1e-9) || value > to * (1.0 + 1e-9) {
                continue;
            }
            let has_label = labelled.contains(digit) && power.rem_euclid(every) == 0;
            ticks.push(Tick { value, label: has_label.then(|| format!("{}{unit}", short(value))) });
        }
    }
    ticks
}

/// Returns the number of decimals by which multiples of a step differ.
fn decimals(step: f64) -> usize {
    (-libm::log10(step * (1.0 + 1e-9)).floor()).clamp(0.0, 12.0) as usize
}

/// Formats a number with a fixed number of decimals, and groups of thousands separated by spaces from five digits on.
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{:.decimals$}", value.abs());
    let (whole, fraction) = text.split_once('.').map_or((text.as_str(), None), |(whole, rest)| (whole, Some(rest)));
    let mut grouped = String::new();
    for (index, digit) in whole.chars().enumerate() {
        if index > 0 && (whole.len() - index).is_multiple_of(3) && whole.len() > 4 {
            grouped.push('\u{a0}');
        }
        grouped.push(digit);
    }
    let is_zero = text.chars().all(|digit| matches!(digit, '0' | '.'));
    let sign = if value < 0.0 && !is_zero { "−" } else { "" };
    match fraction {
        Some(fraction) => format!("{sign}{grouped}.{fraction}"),
        None => format!("{sign}{grouped}"),
    }
}

/// Formats a number with all its digits, up to twelve decimals and without trailing zeros: `0.05`, `1200`, `10 000`, `2e9`.
pub fn short(value: f64) -> String {
    if value != 0.0 && !(1e-6..1e7).contains(&value.abs()) {
        return format!("{value:e}").replace('-', "−");
    }
    let text = fixed(value, 12);
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Formats a number with `digits` significant digits: `211`, `0.0407`, `12 300`.
pub fn significant(value: f64, digits: i32) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".to_owned() } else { "∞".to_owned() };
    }
    let first = libm::log10(value.abs()).floor() as i32;
    let decimals = digits - 1 - first;
    if decimals >= 0 {
        return fixed(value, decimals.min(12) as usize);
    }
    let unit = libm::pow(10.0, f64::from(-decimals));
    fixed((value / unit).round() * unit, 0)
}

/// Formats a value and its error (above zero) with two significant digits of the error: `211.04 ± 0.31`.
pub fn with_error(value: f64, error: f64) -> String {
    let decimals = (1 - libm::log10(error).floor() as i32).clamp(0, 6) as usize;
    format!("{} ± {}", fixed(value, decimals), fixed(error, decimals))
}

/// Formats a time with its unit and `digits` significant digits: `38 µs`, `9.8 ms`, `0.983 s`, `39 s`, `42 min`, `5.3 h`, `12
/// d`.
pub fn duration(seconds: f64, digits: i32) -> String {
    // seconds up to two minutes, minutes up to two hours, hours up to two days
    let (name, unit) = match seconds {
        _ if seconds >= 2.0 * 86_400.0 => ("d", 86_400.0),
        _ if seconds >= 2.0 * 3600.0 => ("h", 3600.0),
        _ if seconds >= 2.0 * 60.0 => ("min", 60.0),
        _ if seconds > 0.0 && seconds < 1e-3 => ("µs", 1e-6),
        _ if seconds > 0.0 && seconds < 0.1 => ("ms", 1e-3),
        _ => ("s", 1.0),
    };
    format!("{} {name}", significant(seconds / unit, digits))
}

/// Longest predicted time in seconds that is printed as a number: predictions become less certain the longer they are.
pub const FARTHEST_SECONDS: f64 = 3600.0;

/// Formats a predicted time: `about 39 s`, or `> 1 h` beyond [`FARTHEST_SECONDS`].
pub fn foretold_duration(seconds: f64) -> String {
    if seconds > FARTHEST_SECONDS { "> 1 h".to_owned() } else { format!("about {}", duration(seconds, 2)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(ticks: Vec<Tick>) -> String {
        ticks.into_iter().filter_map(|tick| tick.label).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn ticks_are_numbers_that_people_would_write() {
        for (from, to, most, expected) in [
            (0.0, 600.0, 6, "0 100 200 300 400 500 600"),
            (0.0, 484.0, 6, "0 100 200 300 400"),
            (0.0, 1.0, 5, "0 0.2 0.4 0.6 0.8 1.0"),
            (0.0, 0.7, 8, "0 0.1 0.2 0.3 0.4 0.5 0.6 0.7"),
            (-2.0, 2.0, 4, "−2 −1 0 1 2"),
            (0.0, 62_000.0, 7, "0 10\u{a0}000 20\u{a0}000 30\u{a0}000 40\u{a0}000 50\u{a0}000 60\u{a0}000"),
            (0.013, 0.017, 4, "0.013 0.014 0.015 0.016 0.017"),
            (5.0, 5.0, 4, ""),
        ] {
            assert_eq!(labels(linear(from, to, most, Steps::Decimal)), expected, "{from} to {to}");
        }
        assert_eq!(labels(linear(0.0, 90.0, 6, Steps::Sexagesimal)), "0 15 30 45 60 75 90");
        assert_eq!(labels(linear(0.0, 360.0, 8, Steps::Sexagesimal)), "0 45 90 135 180 225 270 315 360");
        assert_eq!(labels(linear(0.0, 1.0, 5, Steps::Sexagesimal)), "0 0.2 0.4 0.6 0.8 1.0");
    }

    #[test]
    fn logarithmic_ticks_are_few() {
        assert_eq!(labels(logarithmic(0.5, 20.0, "")), "0.5 1 2 5 10 20");
        assert_eq!(labels(logarithmic(0.001, 10.0, " %")), "0.001 % 0.01 % 0.1 % 1 % 10 %");
        assert_eq!(labels(logarithmic(1e-3, 1e9, "")), "0.01 1 100 10\u{a0}000 1\u{a0}000\u{a0}000 1e8");
        assert_eq!(logarithmic(1.0, 10.0, "").len(), 10);
        assert_eq!(logarithmic(0.0, 10.0, ""), []);
    }

    #[test]
    fn numbers_have_the_digits_that_are_asked_for() {
        for (value, digits, text) in [
            (211.0437, 3, "211"),
            (0.040_73, 3, "0.0407"),
            (12_345.0, 3, "12\u{a0}300"),
            (0.0, 3, "0"),
            (9.999, 2, "10.0"),
        ] {
            assert_eq!(significant(value, digits), text);
        }
        for (seconds, text) in [
            (0.0, "0 s"),
            (0.000_953, "950 µs"),
            (0.0546, "55 ms"),
            (0.983_347, "0.98 s"),
            (38.8, "39 s"),
            (1000.0, "17 min"),
            (2e5, "2.3 d"),
            (7300.0, "2.0 h"),
        ] {
            assert_eq!(duration(seconds, 2), text);
        }
        let foretold = [38.8, 3600.0, 3601.0, 5e79, f64::INFINITY].map(foretold_duration);
        assert_eq!(foretold, ["about 39 s", "about 60 min", "> 1 h", "> 1 h", "> 1 h"]);
        assert_eq!(short(1200.0), "1200");
        assert_eq!(short(-0.05), "−0.05");
    }
}
