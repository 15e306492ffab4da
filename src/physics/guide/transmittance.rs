//! Transmission of a straight mirror cylinder for parallel light and for a sky, in closed form.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};
use std::num::NonZeroUsize;

use gauss_quad::GaussLegendre;

use crate::sky::{Sky, direction};

/// Computes the transmission of parallel light that fills the upper end of a straight tube.
///
/// `aspect` = length / diameter, `tan_theta` = tangent of the angle from the axis (both >= 0), `reflectance` per bounce
/// in 0..=1. The integral of Swift and Smith (1995), T = (4/pi) int s^2/sqrt(1-s^2) R^N (1 - (1-R)(A/s - N)) ds with
/// A = aspect tan(theta) and N = floor(A/s), summed exactly between its kinks
/// (docs/physics/tubes.md#transmission-of-parallel-light); absolute error below 1e-14.
///
/// A black wall passes (2/pi)(acos A - A sqrt(1 - A^2)) of the light; a mirror of 98 % and an aspect ratio of 4 pass 0.83912 at 60 degrees
/// from the axis:
///
/// ```
/// use skyduct_physics::guide::transmittance::beam_transmission;
///
/// let a: f64 = 0.5;
/// let black = 2.0 / std::f64::consts::PI * (a.acos() - a * (1.0 - a * a).sqrt());
/// assert!((beam_transmission(1.0, a, 0.0) - black).abs() < 1e-14);
/// assert!((beam_transmission(4.0, 3f64.sqrt(), 0.98) - 0.83912).abs() < 5e-6);
/// ```
pub fn beam_transmission(aspect: f64, tan_theta: f64, reflectance: f64) -> f64 {
    let a = aspect * tan_theta;
    if a == 0.0 || reflectance == 1.0 {
        return 1.0;
    }
    if !a.is_finite() {
        return 0.0;
    }
    let loss = 1.0 - reflectance;
    let first = a.floor();
    let mut power = if first == 0.0 { 1.0 } else { libm::pow(reflectance, first) };
    let mut upper = 1.0;
    let mut root_upper = root(upper);
    let mut chords_below = primitive(upper, root_upper);
    let mut sum = 0.0;
    let mut n = first;
    while power >= f64::MIN_POSITIVE {
        let lower = a / (n + 1.0);
        let root_lower = root(lower);
        let below = primitive(lower, root_lower);
        let chords = chords_below - below;
        let roots = if upper == lower { 0.0 } else { -(upper - lower) * (upper + lower) / (root_upper + root_lower) };
        sum += power * ((1.0 + loss * n) * chords + loss * a * roots);
        // the rest is below (4/pi) R^N P(lower), and P(s) < s^3
        if power * lower * lower * lower < 1e-17 * sum {
            break;
        }
        n += 1.0;
        power *= reflectance;
        (upper, root_upper, chords_below) = (lower, root_lower, below);
        if n - first >= MOST_TERMS {
            sum += remainder(a, reflectance, upper);
            break;
        }
    }
    (sum / FRAC_PI_4).clamp(0.0, 1.0)
}

/// Number of terms of the series that are added one by one. The rest is negligible, or belongs to a wall that absorbs so little that the
/// steps from one number of reflections to the next are as good as a curve.
const MOST_TERMS: f64 = 4096.0;

/// Computes the rest of the series: the integral over s from 0 to `upper` with R^(A/s) (1 + (ln R)^2 / 12) instead of the broken line
/// through its whole powers, which lies above R^(A/s) by that factor on average; s = sin(phi).
fn remainder(a: f64, reflectance: f64, upper: f64) -> f64 {
    let lambda = -libm::log(reflectance);
    let end = libm::asin(upper);
    let rule = GaussLegendre::new(NonZeroUsize::new(32).unwrap_or(NonZeroUsize::MIN));
    let curve = |phi: f64| {
        let s = libm::sin(phi);
        s * s * libm::exp(-lambda * a / s)
    };
    // in halves toward zero, where the curve rises extremely slowly
    let halves: f64 = (0..24).map(|k| rule.integrate(end * 0.5f64.powi(k + 1), end * 0.5f64.powi(k), curve)).sum();
    halves * (1.0 + lambda * lambda / 12.0)
}

fn root(s: f64) -> f64 {
    ((1.0 - s) * (1.0 + s)).max(0.0).sqrt()
}

/// Evaluates P(s) = (asin s - s sqrt(1 - s^2)) / 2, the integral of s^2 / sqrt(1 - s^2); by its series where the difference cancels.
fn primitive(s: f64, root: f64) -> f64 {
    if s < 0.02 {
        let s2 = s * s;
        return s * s2 * (1.0 / 3.0 + s2 * (1.0 / 10.0 + s2 * (3.0 / 56.0 + s2 * (5.0 / 144.0))));
    }
    0.5 * (libm::asin(s) - s * root)
}

/// Approximates the transmission of parallel light by the mean number of reflections, R^(4 A / pi) with A = `aspect` `tan_theta` (Zastrow
/// and Wittwer 1986): never above [`beam_transmission`], whose arguments it takes.
///
/// ```
/// use skyduct_physics::guide::transmittance::{beam_transmission, zastrow_wittwer_transmission};
///
/// let tangent = 75f64.to_radians().tan();
/// let approximate = zastrow_wittwer_transmission(8.0, tangent, 0.98);
/// assert!((approximate - 0.4639).abs() < 5e-5 && approximate < beam_transmission(8.0, tangent, 0.98));
/// ```
pub fn zastrow_wittwer_transmission(aspect: f64, tan_theta: f64, reflectance: f64) -> f64 {
    libm::pow(reflectance, aspect * tan_theta / FRAC_PI_4)
}

/// Estimates the fraction of parallel light that a straight tube passes, at least a thousandth, for importance sampling only.
///
/// Takes the arguments of [`beam_transmission`]. The estimate is the larger of [`zastrow_wittwer_transmission`], for bright mirrors, and
/// the transmission without a reflection, which is all that a dark wall leaves. Tables of directions are far coarser than the kinks of the
/// exact series.
pub fn likely_transmission(aspect: f64, tan_theta: f64, reflectance: f64) -> f64 {
    let by_mirror = zastrow_wittwer_transmission(aspect, tan_theta, reflectance);
    by_mirror.max(beam_transmission(aspect, tan_theta, 0.0)).max(1e-3)
}

/// Computes the transmission of a straight tube for the light of a uniform sky.
///
/// `aspect` = length / diameter (>= 0), `reflectance` per bounce in 0..=1. The order of the integrals of [`beam_transmission`] and
/// over the sky is exchanged: the light that meets the mirror every b = aspect / s diameters of depth has a transmission that is
/// a smooth series in b (docs/physics/tubes.md#transmission-of-a-sky). Relative error below 1e-9.
///
/// An aspect ratio of 4 and a mirror of 98 % keep 0.869927 of the light; a black pipe 100 diameters long passes only direct light from the
/// sky to its lower end, by the form factor 1 / (4 100^2) to first order:
///
/// ```
/// use skyduct_physics::guide::transmittance::uniform_sky_transmission;
///
/// assert!((uniform_sky_transmission(4.0, 0.98) - 0.869927).abs() < 5e-7);
/// assert!((uniform_sky_transmission(100.0, 0.0) / 2.499_875e-5 - 1.0).abs() < 1e-6);
/// ```
pub fn uniform_sky_transmission(aspect: f64, reflectance: f64) -> f64 {
    if aspect == 0.0 || reflectance == 1.0 {
        return 1.0;
    }
    through_straight(aspect, reflectance, &FINE, left_of_atan).clamp(0.0, 1.0)
}

/// Computes [`uniform_sky_transmission`] with a relative error below 1e-5, in a third of the time.
pub(super) fn nearly_uniform_sky_transmission(aspect: f64, reflectance: f64) -> f64 {
    if aspect == 0.0 || reflectance == 1.0 {
        return 1.0;
    }
    through_straight(aspect, reflectance, &ROUGH, left_of_atan).clamp(0.0, 1.0)
}

/// Numbers of quadrature nodes of each part of the integral over chords, and of each part of a series' rest.
pub(super) struct Nodes {
    chords: &'static [usize],
    rest: usize,
}

/// Numbers of nodes for relative errors below 1e-9 (`FINE`) and below 1e-5 (`ROUGH`).
const FINE: Nodes = Nodes { chords: &[12, 12, 10, 8, 8, 6, 6, 4, 4, 4, 4], rest: 8 };
pub(super) const ROUGH: Nodes = Nodes { chords: &[8, 6, 5, 4, 4, 3], rest: 6 };

/// Evaluates x - atan x, by its series where the difference cancels: the moment of a uniform sky of 1 lx.
fn left_of_atan(x: f64) -> f64 {
    if x >= 0.1 {
        return x - libm::atan(x);
    }
    let x2 = x * x;
    let series = 1.0 / 7.0 - x2 * (1.0 / 9.0 - x2 * (1.0 / 11.0 - x2 * (1.0 / 13.0 - x2 / 15.0)));
    x * x2 * (1.0 / 3.0 - x2 * (1.0 / 5.0 - x2 * series))
}

/// Computes the light of a sky that a straight tube passes, per area of its cross-section; `aspect` > 0, `reflectance` below 1; `moment` is
/// the integral from 0 to x of the light of the sky per tangent t of the zenith angle, times x - t.
pub(super) fn through_straight(aspect: f64, reflectance: f64, nodes: &Nodes, moment: impl Fn(f64) -> f64) -> f64 {
    let rule = |nodes: usize| GaussLegendre::new(NonZeroUsize::new(nodes).unwrap_or(NonZeroUsize::MIN));
    let chords = EvenChords::new(reflectance, &rule(nodes.rest));
    let of_chord = |phi: f64| {
        let s = libm::sin(phi);
        s * s * chords.passed(aspect / s, &moment)
    };
    // in halves toward zero: the shortest chords of a bright pipe lose what others keep, and each half has an eighth of the light of
    // the one before
    let halves = nodes.chords.len();
    let end = |k: usize| if k < halves { FRAC_PI_2 * 0.5f64.powi(k as i32) } else { 0.0 };
    let half = |(k, nodes): (usize, &usize)| rule(*nodes).integrate(end(k + 1), end(k), of_chord);
    nodes.chords.iter().enumerate().map(half).sum::<f64>() / FRAC_PI_4
}

/// Number of terms of the series of [`EvenChords`] that are added one by one.
const SINGLE_TERMS: usize = 32;

/// Coefficients of Gregory's formula: a sum from n on is the integral, half of the first term, and these times the forward
/// differences there, with alternating signs.
const GREGORY: [f64; 7] =
    [1.0 / 12.0, 1.0 / 24.0, 19.0 / 720.0, 3.0 / 160.0, 863.0 / 60_480.0, 275.0 / 24_192.0, 33_953.0 / 3_628_800.0];

/// Quadrature of sums over reflections at even distances along a guide: (1 - R)^2 times the sum over n from 1 of R^(n-1) f(n), for smooth
/// functions f.
struct EvenChords {
    /// Numbers n, whole and fractional, at which the function is evaluated, with their weights.
    terms: Vec<(f64, f64)>,
}

impl EvenChords {
    /// Computes the terms for a `reflectance` R below 1; `rule` integrates the rest of the series after its first terms.
    fn new(reflectance: f64, rule: &GaussLegendre) -> Self {
        let mut terms = Vec::with_capacity(128);
        let loss = 1.0 - reflectance;
        let mut power = loss * loss;
        for n in 1..SINGLE_TERMS {
            terms.push((n as f64, power));
            power *= reflectance;
        }
        if power > 1e-20 * loss * loss {
            let lambda = -libm::log(reflectance);
            let at = |n: f64| power * libm::exp(-lambda * (n - SINGLE_TERMS as f64));
            let mut from = SINGLE_TERMS as f64;
            // nothing is left where R^n is 1e-18 of what it was
            let end = from + 42.0 / lambda;
            while from < end {
                // from here to twice as far
                terms.extend(rule.iter().map(|(node, weight)| {
                    let n = from * (1.5 + 0.5 * node);
                    (n, 0.5 * from * weight * at(n))
                }));
                from *= 2.0;
            }
            // weights of the function's values, whose differences Gregory's formula adds up
            let mut of_values = [0.0; GREGORY.len() + 1];
            of_values[0] = 0.5;
            for (k, coefficient) in GREGORY.iter().enumerate() {
                // (-1)^(k + 1) times the forward difference k + 1, which has value j with the sign (-1)^(k + 1 - j)
                let mut binomial = 1.0;
                for (j, of_value) in of_values.iter_mut().enumerate().take(k + 2) {
                    *of_value += if j % 2 == 0 { 1.0 } else { -1.0 } * coefficient * binomial;
                    binomial *= (k + 1 - j) as f64 / (j + 1) as f64;
                }
            }
            let value = |(k, of_value): (usize, &f64)| {
                let n = (SINGLE_TERMS + k) as f64;
                (n, of_value * at(n))
            };
            terms.extend(of_values.iter().enumerate().map(value));
        }
        Self { terms }
    }

    /// Computes the light of a sky that passes a guide in which light at the angle Z from the axis meets the mirror `b` tan(Z) times at
    /// even distances: the sum for f(n) = b M(n / b) with the `moment` M, which is x - atan x for a uniform sky of 1 lx.
    fn passed(&self, b: f64, moment: &impl Fn(f64) -> f64) -> f64 {
        let per_chord = 1.0 / b;
        b * self.terms.iter().map(|(n, weight)| weight * moment(n * per_chord)).sum::<f64>()
    }
}

/// Number of kinks of T(Z) at which the quadrature over a sky is split; light beyond the last has as many reflections.
const KINKS: u32 = 160;

/// Number of kinks of T(Z) up to which each part of the quadrature has the most nodes.
const BRIGHT_KINKS: f64 = 8.0;

/// Numbers of quadrature nodes by the width of a part in radians: the first entry whose width is larger applies.
const NODES: [(f64, usize); 4] = [(1e-3, 6), (1e-2, 8), (0.03, 16), (f64::INFINITY, 20)];

/// Computes the luminous flux of a sky through a vertical straight tube, per area of its cross-section, in lm/m2.
///
/// E = integral of L cos Z T(Z) over the sky, with T of [`beam_transmission`] for the tube's `aspect` (length over diameter)
/// and `reflectance`; divided by the horizontal illuminance it is the diffuse transmission.
/// Relative error below 1e-9 for aspect ratios up to 32 and reflectances from 0.9.
///
/// A uniform sky through an aspect ratio of 4 and a mirror of 98 % keeps 0.869927 of its light:
///
/// ```
/// use glam::DVec3;
/// use skyduct_physics::guide::transmittance::sky_exitance;
/// use skyduct_physics::sky::{CieType, Sky, SkyDistribution};
///
/// let distribution = SkyDistribution::new(CieType::UNIFORM, DVec3::Z);
/// let sky = Sky::new(distribution, 1.0);
/// let transmission = sky_exitance(&sky, 4.0, 0.98) / sky.horizontal_illuminance_lux();
/// assert!((transmission - 0.869927).abs() < 5e-7);
/// ```
pub fn sky_exitance(sky: &Sky, aspect: f64, reflectance: f64) -> f64 {
    let sun = sky.distribution.sun();
    let sun_zenith_angle = libm::atan2(sun.truncate().length(), sun.z).clamp(0.0, FRAC_PI_2);
    let sun_azimuth = libm::atan2(sun.x, sun.y);
    let rule = |degree| GaussLegendre::new(NonZeroUsize::new(degree).unwrap_or(NonZeroUsize::MIN));
    let around = rule(48);
    let along = NODES.map(|(width, nodes)| (width, rule(nodes)));
    // the luminance has a cusp at the sun: nodes crowd toward azimuth difference 0
    let ring = |zenith_angle: f64| {
        if sky.distribution.is_azimuthally_uniform() {
            return 2.0 * PI * sky.luminance(direction(FRAC_PI_2 - zenith_angle, sun_azimuth));
        }
        around.integrate(0.0, 1.0, |u: f64| {
            let difference = PI * u * u * u;
            let seen = direction(FRAC_PI_2 - zenith_angle, sun_azimuth + difference);
            2.0 * sky.luminance(seen) * 3.0 * PI * u * u
        })
    };
    let integrand = |zenith_angle: f64| {
        let (sin, cos) = libm::sincos(zenith_angle);
        ring(zenith_angle) * beam_transmission(aspect, sin / cos, reflectance) * sin * cos
    };
    // the little that a dull pipe passes is in the first parts, however narrow they are
    let bright = libm::atan(BRIGHT_KINKS / aspect);
    // T has kinks where A is a whole number; the sky has one at the sun
    let mut edges: Vec<f64> = (0..=KINKS).map(|k| libm::atan(f64::from(k) / aspect)).collect();
    edges.push(FRAC_PI_2);
    if !sky.distribution.is_azimuthally_uniform() {
        edges.push(sun_zenith_angle);
    }
    edges.extend((1..24).map(|k| FRAC_PI_2 * f64::from(k) / 24.0));
    edges.sort_by(f64::total_cmp);
    let between = |from: f64, to: f64| {
        // x = u^2 (3 - 2u) flattens both ends, where the integrand's derivatives are singular
        let narrow = along.iter().find(|(width, _)| from >= bright && to - from < *width);
        let (_, along) = narrow.unwrap_or(&along[3]);
        along
            .integrate(0.0, 1.0, |u: f64| integrand(from + (to - from) * u * u * (3.0 - 2.0 * u)) * 6.0 * u * (1.0 - u))
            * (to - from)
    };
    edges.windows(2).filter(|pair| pair[1] > pair[0]).map(|pair| between(pair[0], pair[1])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares the exchanged integral with the quadrature over the sky, which is exact to 1e-9 here.
    #[test]
    fn a_uniform_sky_by_chords() {
        let distribution = crate::sky::SkyDistribution::new(crate::sky::CieType::UNIFORM, glam::DVec3::Z);
        let sky = Sky::new(distribution, 1.0);
        for aspect in [0.1, 1.0, 4.0, 11.0, 32.0] {
            for reflectance in [0.9, 0.95, 0.98, 0.995, 0.9999] {
                let quadrature = sky_exitance(&sky, aspect, reflectance) / sky.horizontal_illuminance_lux();
                let chords = uniform_sky_transmission(aspect, reflectance);
                assert!((chords / quadrature - 1.0).abs() < 2e-9, "{aspect} {reflectance}: {chords} {quadrature}");
            }
        }
    }

    /// Compares few nodes with many, for bright and dull, short and very long tubes.
    #[test]
    fn few_nodes_are_nearly_as_good() {
        for aspect in [0.05, 0.5, 3.94, 11.0, 100.0, 10_000.0] {
            for reflectance in [0.0, 0.5, 0.9, 0.98, 0.995, 0.9999] {
                let (fine, rough) = (
                    uniform_sky_transmission(aspect, reflectance),
                    nearly_uniform_sky_transmission(aspect, reflectance),
                );
                assert!((rough / fine - 1.0).abs() < 1e-5, "{aspect} {reflectance}: {rough} {fine}");
            }
        }
    }

    /// Compares black pipes with the form factor of two discs, 1 + h - sqrt(h^2 + 2 h) with h = 2 aspect^2, without its cancellation.
    #[test]
    fn black_pipes_show_their_ends() {
        for aspect in [0.05, 0.5, 3.0, 40.0, 500.0] {
            let h = 2.0 * aspect * aspect;
            let factor = 1.0 / (1.0 + h + f64::sqrt(h * h + 2.0 * h));
            let found = uniform_sky_transmission(aspect, 0.0);
            assert!((found / factor - 1.0).abs() < 1e-9, "{aspect}: {found} {factor}");
        }
    }

    fn tangent(degrees: f64) -> f64 {
        degrees.to_radians().tan()
    }

    /// Checks perfect mirrors, tubes of no length, grazing light, black walls (T = (2/pi)(acos A - A sqrt(1 - A^2)) below A = 1), and tubes
    /// so long that almost nothing is left.
    #[test]
    fn limits() {
        assert_eq!(beam_transmission(100.0, tangent(89.0), 1.0), 1.0);
        assert_eq!(beam_transmission(0.0, 5.0, 0.5), 1.0);
        assert_eq!(beam_transmission(4.0, f64::INFINITY, 0.98), 0.0);
        assert!((beam_transmission(1.0, tangent(5.0), 0.0) - 0.888_748_244_1).abs() < 1e-10);
        assert!((beam_transmission(1.0, tangent(30.0), 0.0) - 0.308_068_009_3).abs() < 1e-10);
        assert_eq!(beam_transmission(1.5, 1.0, 0.0), 0.0);
        assert!((beam_transmission(100.0, tangent(80.0), 0.9999) - 0.930_817_476).abs() < 1e-9);
        let tiny = beam_transmission(100.0, tangent(89.0), 0.98);
        assert!((tiny / 7.934e-52 - 1.0).abs() < 1e-3, "{tiny}");
    }

    /// Compares the remainder of the series with all of its terms, for walls that absorb almost nothing.
    #[test]
    fn remainder_of_the_series() {
        for (a, reflectance) in [(0.5f64, 0.9999f64), (17.6, 0.999), (3000.0, 0.9999), (40.0, 0.99999)] {
            let all_terms: f64 = {
                let (loss, mut sum, mut upper, mut n) = (1.0 - reflectance, 0.0, 1.0, f64::floor(a));
                while n < 2e6 {
                    let lower = a / (n + 1.0);
                    let (root_upper, root_lower) = (root(upper), root(lower));
                    let chords = primitive(upper, root_upper) - primitive(lower, root_lower);
                    let roots = -(upper - lower) * (upper + lower) / (root_upper + root_lower).max(1e-300);
                    sum += reflectance.powf(n) * ((1.0 + loss * n) * chords + loss * a * roots);
                    (upper, n) = (lower, n + 1.0);
                }
                sum / FRAC_PI_4
            };
            let value = beam_transmission(a, 1.0, reflectance);
            assert!((value - all_terms).abs() < 1e-10, "{a} {reflectance}: {value} {all_terms}");
        }
    }

    /// Checks R^(4A/pi) <= T <= R^floor(A), and that T is monotone in A and R.
    #[test]
    fn bounds_and_monotony() {
        for reflectance in [0.5, 0.9, 0.98, 0.9999] {
            let mut last = 1.0;
            for step in 0..400 {
                let a = f64::from(step) * 0.05;
                let t = beam_transmission(a, 1.0, reflectance);
                assert!(t <= last + 1e-15 && t <= reflectance.powf(a.floor()) + 1e-15);
                assert!(t >= zastrow_wittwer_transmission(a, 1.0, reflectance) - 1e-15);
                assert!(t <= beam_transmission(a, 1.0, reflectance + 1e-5) + 1e-15);
                last = t;
            }
        }
    }
}
