//! Equivalent length of bent tubes: the length of the straight tube that passes as much light.

/// Finds the length in metres, to 1e-4 of it, of the straight tube whose transmission is `target`; `transmission_of` gives the transmission
/// of a straight tube of a length, which falls with it; the second argument is a length to begin at, with its transmission. `None` if even
/// a tube of 100 times that length loses less, or one of next to no length loses more.
///
/// ```
/// let halved_every_metre = |length: f64| 0.5f64.powf(length);
/// let length = skyduct_physics::guide::equivalent_length::equivalent_length_m(0.125, (1.0, 0.5), halved_every_metre).unwrap();
/// assert!((length - 3.0).abs() < 3e-4);
/// ```
pub fn equivalent_length_m(
    target: f64,
    (about_m, of_about): (f64, f64),
    transmission_of: impl Fn(f64) -> f64,
) -> Option<f64> {
    // the logarithm falls nearly evenly with the length, so that false position takes few steps
    let logarithm = |transmission: f64| libm::log((transmission / target).max(LEAST_RATIO));
    let excess = |length: f64| logarithm(transmission_of(length));
    // an end with a higher transmission, and one with a lower
    let (mut short, mut long) = ((about_m, logarithm(of_about)), (about_m, f64::NAN));
    if short.1 > 0.0 {
        loop {
            long = ((2.0 * short.0).min(LONGEST * about_m), 0.0);
            long.1 = excess(long.0);
            if long.1 <= 0.0 {
                break;
            }
            if long.0 >= LONGEST * about_m {
                return None;
            }
            short = long;
        }
    } else {
        while short.1 <= 0.0 {
            if short.0 < SHORTEST * about_m {
                return None;
            }
            long = short;
            short = (0.5 * long.0, excess(0.5 * long.0));
        }
    }
    // false position, where the value of an end that stays for a second time is halved (the Illinois method)
    let between = |short: (f64, f64), long: (f64, f64)| short.0 + (long.0 - short.0) * short.1 / (short.1 - long.1);
    let mut moved_before = None;
    for _ in 0..MOST_STEPS {
        let length = between(short, long);
        let found = (length, excess(length));
        // distance from the root by the slope between the ends
        let left = found.1.abs() * (long.0 - short.0) / (short.1 - long.1);
        let moves_short = found.1 > 0.0;
        let weight = if moved_before == Some(moves_short) { 0.5 } else { 1.0 };
        if moves_short {
            (short, long.1) = (found, weight * long.1);
        } else {
            (long, short.1) = (found, weight * short.1);
        }
        moved_before = Some(moves_short);
        if left < CLOSE * length {
            break;
        }
    }
    Some(between(short, long))
}

/// Distance from the equivalent length, relative to it, at which one more interpolation is exact enough.
const CLOSE: f64 = 2e-5;

/// Lower bound of the ratio of a transmission to the target: zero has no logarithm.
const LEAST_RATIO: f64 = 1e-12;

/// Bounds of equivalent lengths, relative to the length to begin at.
const LONGEST: f64 = 100.0;
const SHORTEST: f64 = 1e-9;

/// Number of steps after which an equivalent length is exact to the last digit.
const MOST_STEPS: usize = 64;

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::guide::performance::{sky, traced_sky};
    use crate::guide::test_pipes::{RADIUS, cie_sky, straight};
    use crate::guide::{BentGuide, Guide};
    use crate::optics::Mirror;
    use crate::sampling::Key;

    /// Checks that a tube loses as much as a straight tube of the same length if it does not bend, and more if it does.
    #[test]
    fn bends_count_as_extra_length() {
        let uniform = cie_sky(5);
        let of_straight =
            |length: f64| traced_sky(&straight(length, 0.98), &uniform, Key::new(1), 1024).transmission().value;
        let bent = |bend: f64| {
            let (sin, cos) = bend.to_radians().sin_cos();
            let axes = [(0.5, DVec3::Z), (0.5, DVec3::new(sin, 0.0, cos))];
            Guide::Bent(BentGuide::new(RADIUS, &axes, Mirror::Constant([0.98; 3]), [1.0; 3]))
        };
        let length = |guide: &Guide| {
            let target = sky(guide, &uniform, Key::new(1), 1024).transmission().value;
            equivalent_length_m(target, (1.0, of_straight(1.0)), of_straight).unwrap()
        };
        assert!((length(&bent(0.0)) - 1.0).abs() < 1e-3);
        assert!(length(&bent(45.0)) > 1.2);
        let nearly_all = equivalent_length_m(0.999_999, (1.0, 0.9), |length| 1.0 - 0.1 * length);
        assert_eq!(nearly_all.map(|length| length < 1e-4), Some(true));
        assert_eq!(equivalent_length_m(0.5, (1.0, 0.9), |_| 0.9), None);
        assert_eq!(equivalent_length_m(0.5, (1.0, 0.0), |_| 0.0), None);
    }

    /// Checks laws that a pipe may follow, from starting lengths far off: an error of 1e-4 of the length, with few evaluations.
    #[test]
    fn few_looks_find_the_length() {
        let laws: [fn(f64) -> f64; 3] =
            [|length| 0.9 * 0.7f64.powf(length), |length| 1.0 / (1.0 + length), |length| 0.8 / (1.0 + length).powi(2)];
        for law in laws {
            for expected in [0.03, 0.4, 1.3, 2.0, 7.0, 60.0] {
                let looks = std::cell::Cell::new(0);
                let seen = |length: f64| {
                    looks.set(looks.get() + 1);
                    law(length)
                };
                let found = equivalent_length_m(law(expected), (1.0, law(1.0)), seen).unwrap();
                assert!((found / expected - 1.0).abs() < 1e-4, "{found} {expected}");
                assert!(looks.get() <= 12, "{} looks for {expected}", looks.get());
            }
        }
    }
}
