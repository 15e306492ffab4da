//! Bends told as extra length: the straight tube that passes as much light as another one.

/// Length of the straight tube that passes as much light as `target`, in metres, to 1e-4 of it; `transmission_of` the
/// transmission of a straight tube of a length, which falls with it, and `about_m` a length to begin at. `None` when not even a tube of
/// 100 times that loses as much, or next to no length loses more.
///
/// ```
/// let halved_every_metre = |length: f64| 0.5f64.powf(length);
/// let length = skyduct_physics::guide::equivalent_length::equivalent_length_m(0.125, 1.0, halved_every_metre).unwrap();
/// assert!((length - 3.0).abs() < 3e-4);
/// ```
pub fn equivalent_length_m(target: f64, about_m: f64, transmission_of: impl Fn(f64) -> f64) -> Option<f64> {
    let excess = |length: f64| transmission_of(length) / target - 1.0;
    // an end where more passes, and one where less does
    let (mut short, mut long) = ((about_m, excess(about_m)), (about_m, f64::NAN));
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
    // false position, where the value of an end that stays is halved
    let between = |short: (f64, f64), long: (f64, f64)| short.0 + (long.0 - short.0) * short.1 / (short.1 - long.1);
    for _ in 0..MOST_STEPS {
        let length = between(short, long);
        let found = (length, excess(length));
        let step = if found.1 > 0.0 { length - short.0 } else { long.0 - length };
        if found.1 > 0.0 {
            (short, long.1) = (found, 0.5 * long.1);
        } else {
            (long, short.1) = (found, 0.5 * short.1);
        }
        if step < 2e-5 * length {
            break;
        }
    }
    Some(between(short, long))
}

/// Lengths of equivalent straight tubes, over those to begin at.
const LONGEST: f64 = 100.0;
const SHORTEST: f64 = 1e-9;

/// Steps after which an equivalent length is exact to the last digit.
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

    /// A tube loses what a straight tube of the same length loses when it does not bend, and more when it does.
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
            equivalent_length_m(target, 1.0, of_straight).unwrap()
        };
        assert!((length(&bent(0.0)) - 1.0).abs() < 1e-3);
        assert!(length(&bent(45.0)) > 1.2);
        assert_eq!(equivalent_length_m(0.999_999, 1.0, |length| 1.0 - 0.1 * length).map(|l| l < 1e-4), Some(true));
        assert_eq!(equivalent_length_m(0.5, 1.0, |_| 0.9), None);
    }
}
