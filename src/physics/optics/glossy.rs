//! Glossy reflection: a microfacet lobe that conserves energy.
//!
//! Derivation of its energy conservation: docs/physics/diffusers.md#the-glossy-lobe.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::Spectrum;
use super::scatter::{Kind, Oriented, Scatter, Scattered, SheetSide, Travel};
use crate::sampling::{PathRandom, PathSamples, warp};

/// Smallest roughness of a lobe. Documents must choose between a mirror (roughness 0) and a lobe of at least this roughness.
pub const LEAST_ROUGHNESS: f64 = 0.02;

/// Number of intervals of the table of the directional albedo.
const INTERVALS: usize = 128;

/// Numbers of points of its quadrature along the two coordinates of the visible normals.
const QUADRATURE: [usize; 2] = [32, 128];

/// A reciprocal glossy lobe whose directional albedo is 1 at every angle; surfaces scale it by their `specular`.
///
/// BRDF = D G2 / (4 cos_i cos_o) + (1 - E(cos_i)) (1 - E(cos_o)) / (pi (1 - E_mean)): single scattering by GGX microfacets (Walter et al.
/// 2007, eq. 33) of alpha = roughness^2 with the height-correlated Smith masking and shadowing (Heitz 2014, eq. 99) and Fresnel factor 1,
/// plus the compensation lobe of Kulla and Conty (2017), which returns the light that single scattering loses. E is the directional
/// albedo of the first term and E_mean its mean over the hemisphere, weighted with 2 cos; E is tabulated, which leaves an error of 2e-4
/// at most in the albedo of the whole.
#[derive(Clone, Debug)]
pub struct Glossy {
    alpha: f64,
    /// Cosine at each node; `losses` has 1 - E there.
    cosines: Vec<f64>,
    losses: Vec<f64>,
    /// Integral of 2 cos (1 - E) from 0 to each node; the last is 1 - E_mean.
    cumulative: Vec<f64>,
}

impl Glossy {
    /// Returns the width alpha of the microfacets' inclinations.
    pub fn alpha(&self) -> f64 {
        self.alpha
    }

    /// Builds a lobe; `roughness` in [`LEAST_ROUGHNESS`]..=1.
    pub fn new(roughness: f64) -> Self {
        let alpha = roughness * roughness;
        let cosines: Vec<f64> = (0..=INTERVALS)
            .map(|k| {
                // even in cos / (cos + alpha): the loss falls from grazing on over some alpha
                let t = k as f64 / INTERVALS as f64;
                alpha * t / (1.0 + alpha - t)
            })
            .collect();
        let losses: Vec<f64> = cosines.iter().map(|cosine| 1.0 - single_scattering_albedo(alpha, *cosine)).collect();
        let mut cumulative = vec![0.0];
        for k in 0..INTERVALS {
            // Simpson's rule is exact for the cosine times a linear loss
            let ([a, b], [loss_a, loss_b]) = ([cosines[k], cosines[k + 1]], [losses[k], losses[k + 1]]);
            let middle = 2.0 * (a + b) * (loss_a + loss_b);
            cumulative.push(cumulative[k] + (b - a) / 6.0 * (2.0 * a * loss_a + middle + 2.0 * b * loss_b));
        }
        Self { alpha, cosines, losses, cumulative }
    }

    /// Computes the BRDF times the cosine of `toward`, per sr: also the density with which [`Self::reflect`] chooses `toward`.
    ///
    /// `from` and `toward` are unit vectors that point away from the surface; zero unless both are above it.
    ///
    /// At normal incidence a lobe of roughness 1 has D / 4 = 1 / (4 pi) by single scattering, and the rest by compensation:
    ///
    /// ```
    /// use glam::DVec3;
    /// use skyduct_physics::optics::Glossy;
    ///
    /// let density = Glossy::new(1.0).density(DVec3::Z, DVec3::Z, DVec3::Z);
    /// let once = 0.25 / std::f64::consts::PI;
    /// assert!(density > once && density < 1.2 / std::f64::consts::PI);
    /// ```
    #[inline]
    pub fn density(&self, normal: DVec3, from: DVec3, toward: DVec3) -> f64 {
        let (cos_i, cos_o) = (normal.dot(from), normal.dot(toward));
        if cos_i <= 0.0 || cos_o <= 0.0 {
            return 0.0;
        }
        let half = (from + toward).normalize();
        let cos_h = normal.dot(half);
        // 1 - cos_h^2 would lose all digits of a narrow lobe
        let sin_h_squared = (half - normal * cos_h).length_squared();
        let alpha_squared = self.alpha * self.alpha;
        let spread = alpha_squared * cos_h * cos_h + sin_h_squared;
        let normals = alpha_squared / (PI * spread * spread);
        let masking = 1.0 / (1.0 + lambda(self.alpha, cos_i) + lambda(self.alpha, cos_o));
        normals * masking / (4.0 * cos_i) + self.loss(cos_i) * self.loss(cos_o) * cos_o / (PI * self.mean_loss())
    }

    /// Samples a direction `toward` above the surface, pointing away from it, for light that comes from `from`.
    ///
    /// Its density is [`Self::density`], so that the sample's weight, BRDF cosine / density, is 1: the reflection about a visible normal
    /// (Dupuy and Benyoub 2023) is kept with the probability that it is not shadowed, G2 / G1; otherwise the compensation lobe is
    /// sampled.
    #[inline]
    pub fn reflect(&self, normal: DVec3, from: DVec3, point: [f64; 2], random: &mut PathRandom) -> DVec3 {
        let (x, y) = frame(normal, from);
        let local = DVec3::new(from.dot(x), 0.0, from.dot(normal).max(f64::MIN_POSITIVE));
        let (reflected, kept) = visible_reflection(self.alpha, local, point);
        let local = if random.uniform() < kept { reflected } else { self.sample_compensation(random) };
        (x * local.x + y * local.y + normal * local.z).normalize()
    }

    /// Samples a local direction of density cos (1 - E) / (pi (1 - E_mean)).
    fn sample_compensation(&self, random: &mut PathRandom) -> DVec3 {
        let target = random.uniform() * self.mean_loss();
        let interval = self.cumulative[1..INTERVALS].partition_point(|sum| *sum <= target);
        let [a, b] = [self.cosines[interval], self.cosines[interval + 1]];
        let [loss_a, loss_b] = [self.losses[interval], self.losses[interval + 1]];
        let most = loss_a.max(loss_b);
        let cosine = loop {
            let [u, v] = random.uniform2();
            let cosine = (a * a + u * (b * b - a * a)).sqrt();
            let loss = loss_a + (loss_b - loss_a) * ((cosine - a) / (b - a));
            if v * most <= loss {
                break cosine;
            }
        };
        let (sin_phi, cos_phi) = libm::sincos(TAU * random.uniform());
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        DVec3::new(sine * cos_phi, sine * sin_phi, cosine)
    }

    fn mean_loss(&self) -> f64 {
        self.cumulative[INTERVALS]
    }

    /// Returns 1 - E at a cosine in 0..=1, linear between nodes.
    #[inline]
    fn loss(&self, cosine: f64) -> f64 {
        let t = cosine * (1.0 + self.alpha) / (cosine + self.alpha);
        let k = ((t * INTERVALS as f64) as usize).min(INTERVALS - 1);
        let fraction = ((cosine - self.cosines[k]) / (self.cosines[k + 1] - self.cosines[k])).clamp(0.0, 1.0);
        self.losses[k] + (self.losses[k + 1] - self.losses[k]) * fraction
    }
}

impl<const C: usize> Scatter<C> for Oriented<'_, Glossy> {
    #[inline]
    fn value(&self, travel: Travel, from: DVec3, toward: DVec3) -> Spectrum<C> {
        Spectrum([Scatter::<C>::pdf(self, travel, from, toward); C])
    }

    #[inline]
    fn pdf(&self, _: Travel, from: DVec3, toward: DVec3) -> f64 {
        self.optics.density(self.normal, from, toward)
    }

    fn sample(&self, travel: Travel, from: DVec3, side: SheetSide, samples: &mut PathSamples) -> Option<Scattered<C>> {
        if side == SheetSide::Other {
            return None;
        }
        let point = samples.pair();
        let toward = self.optics.reflect(self.normal, from, point, &mut samples.random);
        let pdf = Scatter::<C>::pdf(self, travel, from, toward);
        let weight = Spectrum::ONE;
        (pdf > 0.0).then_some(Scattered { toward, kind: Kind::Glossy, pdf, weight })
    }

    fn albedo(&self, _: DVec3, side: SheetSide) -> Spectrum<C> {
        if side == SheetSide::Same { Spectrum::ONE } else { Spectrum::ZERO }
    }
}

/// Computes Smith's Lambda of GGX: (sqrt(1 + alpha^2 tan^2) - 1) / 2 (Heitz 2014, eq. 72).
#[inline]
fn lambda(alpha: f64, cosine: f64) -> f64 {
    let tan_squared = (1.0 - cosine * cosine).max(0.0) / (cosine * cosine);
    // without the cancellation of sqrt(1 + x) - 1
    let x = alpha * alpha * tan_squared;
    0.5 * x / ((1.0 + x).sqrt() + 1.0)
}

/// Reflects the local direction `from` about the visible normal of the point `[u, v]`, and returns G2 / G1, the probability that it leaves,
/// too.
#[inline]
fn visible_reflection(alpha: f64, from: DVec3, [u, v]: [f64; 2]) -> (DVec3, f64) {
    let stretched = DVec3::new(alpha * from.x, alpha * from.y, from.z).normalize();
    let z = (1.0 - v) * (1.0 + stretched.z) - stretched.z;
    let (sin_phi, cos_phi) = libm::sincos(TAU * u);
    let sine = (1.0 - z * z).max(0.0).sqrt();
    let half = DVec3::new(sine * cos_phi, sine * sin_phi, z) + stretched;
    let normal = DVec3::new(alpha * half.x, alpha * half.y, half.z.max(0.0)).try_normalize().unwrap_or(DVec3::Z);
    let toward = normal * (2.0 * from.dot(normal)) - from;
    if toward.z <= 0.0 {
        return (toward, 0.0);
    }
    let masked = 1.0 + lambda(alpha, from.z);
    (toward, masked / (masked + lambda(alpha, toward.z)))
}

/// Computes E at a cosine: the mean of G2 / G1 over visible normals, by the midpoint rule.
fn single_scattering_albedo(alpha: f64, cosine: f64) -> f64 {
    // grazing light sees the microfacets from the side: the limit is as good as the value close to it
    let cosine = cosine.max(1e-6 * alpha);
    let from = DVec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
    let [angles, heights] = QUADRATURE;
    let mut sum = 0.0;
    for i in 0..angles {
        // both sides of the plane of incidence are alike
        let u = 0.5 * (i as f64 + 0.5) / angles as f64;
        for j in 0..heights {
            // narrow strata for grazing normals, which lose most: 1 - v = rest^4
            let rest = |j: f64| (1.0 - j / heights as f64).powi(4);
            let width = rest(j as f64) - rest(j as f64 + 1.0);
            sum += width * visible_reflection(alpha, from, [u, 1.0 - rest(j as f64 + 0.5)]).1;
        }
    }
    sum / angles as f64
}

/// Returns unit vectors across `normal`, the first toward the side of `from`.
#[inline]
fn frame(normal: DVec3, from: DVec3) -> (DVec3, DVec3) {
    let across = from - normal * from.dot(normal);
    let x = if across.length_squared() > 1e-24 { across.normalize() } else { warp::around(normal, DVec3::X) };
    (x, normal.cross(x))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Key;

    const ROUGHNESSES: [f64; 6] = [LEAST_ROUGHNESS, 0.1, 0.3, 0.5, 0.75, 1.0];

    /// Returns a direction above z = 0.
    fn direction(cosine: f64, azimuth: f64) -> DVec3 {
        let sine = (1.0 - cosine * cosine).sqrt();
        DVec3::new(sine * azimuth.cos(), sine * azimuth.sin(), cosine)
    }

    /// Returns the half vector of squared tangent alpha^2 u / (1 - u) and azimuth phi: distributed by D cos when u is uniform.
    fn half_vector(alpha: f64, u: f64, phi: f64) -> DVec3 {
        let tangent = alpha * (u / (1.0 - u)).sqrt();
        DVec3::new(tangent * phi.cos(), tangent * phi.sin(), 1.0).normalize()
    }

    /// Computes the density of the reflection of `from` about such half vectors, per sr.
    fn half_vector_density(alpha: f64, from: DVec3, toward: DVec3) -> f64 {
        let half = (from + toward).normalize();
        let tan_squared = half.truncate().length_squared() / (half.z * half.z);
        let normals = alpha * alpha / (PI * half.z.powi(4) * (alpha * alpha + tan_squared).powi(2));
        normals * half.z / (4.0 * from.dot(half))
    }

    #[test]
    fn reciprocal() {
        let mut random = PathRandom::new(Key::new(5));
        for roughness in ROUGHNESSES {
            let lobe = Glossy::new(roughness);
            for _ in 0..1000 {
                let normal = warp::around(DVec3::X, direction(random.uniform(), TAU * random.uniform()));
                let [a, b] = [(); 2]
                    .map(|()| warp::around(normal, direction(1e-3 + 0.999 * random.uniform(), TAU * random.uniform())));
                let (forth, back) = (lobe.density(normal, a, b), lobe.density(normal, b, a));
                let (forth, back) = (forth / normal.dot(b), back / normal.dot(a));
                assert!(forth > 0.0 && (forth - back).abs() <= 1e-10 * forth, "{roughness}: {forth} {back}");
            }
        }
    }

    /// The integral of the BRDF times cosine over the hemisphere, by midpoint rules in half vectors (graded toward the tail of narrow
    /// lobes) and in uniform directions, combined by the balance heuristic, is 1 but for the errors of the table (2e-4) and of these
    /// rules (1e-4).
    #[test]
    fn loses_nothing_at_any_angle() {
        let n = 400;
        let cells = || (0..n * n).map(|k| [((k % n) as f64 + 0.5) / n as f64, ((k / n) as f64 + 0.5) / n as f64]);
        for roughness in ROUGHNESSES {
            let lobe = Glossy::new(roughness);
            let alpha = roughness * roughness;
            for cosine in [0.99, 0.9, 0.7, 0.4, 0.15, 0.05] {
                let from = direction(cosine, 0.3);
                let fraction = |toward: DVec3| {
                    if toward.z <= 0.0 {
                        return 0.0;
                    }
                    let half = (from + toward).normalize();
                    let tan_squared = half.truncate().length_squared() / (half.z * half.z);
                    let tail = alpha * alpha / (alpha * alpha + tan_squared);
                    let graded = half_vector_density(alpha, from, toward) / (4.0 * tail.powf(0.75));
                    let densities = graded + 1.0 / TAU;
                    lobe.density(DVec3::Z, from, toward) / densities
                };
                let by_half_vectors = |[u, v]: [f64; 2]| {
                    let half = half_vector(alpha, 1.0 - (1.0 - u).powi(4), TAU * v);
                    // half vectors that the light meets from behind have no direction of their own
                    if from.dot(half) > 0.0 { fraction(half * (2.0 * from.dot(half)) - from) } else { 0.0 }
                };
                let sum: f64 = cells().map(|p| by_half_vectors(p) + fraction(direction(p[0], TAU * p[1]))).sum();
                let albedo = sum / (n * n) as f64;
                println!("{roughness} {cosine}: {:.1e}", albedo - 1.0);
                assert!((albedo - 1.0).abs() < 3e-4, "{roughness} {cosine}: {albedo}");
            }
        }
    }

    /// Sampled directions in bins of their half vectors against the integral of the density, so that the weight of a
    /// sample is 1: chi-squared within 4.5 of its standard deviations.
    #[test]
    fn samples_have_their_density() {
        let (rows, columns, fine, count) = (16, 12, 12, 100_000);
        for (roughness, cosine) in
            [(0.1, 0.95), (0.1, 0.3), (0.3, 1.0), (0.3, 0.5), (0.6, 0.9), (0.6, 0.2), (1.0, 0.99), (1.0, 0.5)]
        {
            let lobe = Glossy::new(roughness);
            let alpha = roughness * roughness;
            let from = direction(cosine, 0.0);
            // the last row, half vectors far from the normal, is what the others leave
            let bins = (rows - 1) * columns;
            let mut expected = vec![0.0; bins];
            for (bin, expected) in expected.iter_mut().enumerate() {
                for k in 0..fine * fine {
                    let u = ((bin / columns) as f64 + ((k / fine) as f64 + 0.5) / fine as f64) / rows as f64;
                    let v = ((bin % columns) as f64 + ((k % fine) as f64 + 0.5) / fine as f64) / columns as f64;
                    let half = half_vector(alpha, u, TAU * v);
                    let toward = half * (2.0 * from.dot(half)) - from;
                    if from.dot(half) > 0.0 && toward.z > 0.0 {
                        let density = lobe.density(DVec3::Z, from, toward);
                        *expected += density / half_vector_density(alpha, from, toward);
                    }
                }
                *expected *= f64::from(count) / (rows * columns * fine * fine) as f64;
            }
            let mut seen = vec![0.0; bins + 1];
            let mut random = PathRandom::new(Key::new(11));
            for _ in 0..count {
                let point = random.uniform2();
                let half = (from + lobe.reflect(DVec3::Z, from, point, &mut random)).normalize();
                let tan_squared = half.truncate().length_squared() / (half.z * half.z);
                let u = tan_squared / (alpha * alpha + tan_squared);
                let v = half.y.atan2(half.x).rem_euclid(TAU) / TAU;
                let (row, column) = ((u * rows as f64) as usize, ((v * columns as f64) as usize).min(columns - 1));
                seen[if row < rows - 1 { row * columns + column } else { bins }] += 1.0;
            }
            expected.push(f64::from(count) - expected.iter().sum::<f64>());
            // bins of few photons together
            let (mut chi_squared, mut degrees, mut rest) = (0.0, -1.0, (0.0, 0.0));
            let mut compare = |seen: f64, expected: f64| {
                chi_squared += (seen - expected).powi(2) / expected;
                degrees += 1.0;
            };
            for (seen, expected) in seen.iter().zip(&expected) {
                if *expected > 20.0 { compare(*seen, *expected) } else { rest = (rest.0 + seen, rest.1 + expected) }
            }
            if rest.1 > 20.0 {
                compare(rest.0, rest.1);
            }
            let sigmas = (chi_squared - degrees) / (2.0f64 * degrees).sqrt();
            println!("{roughness} {cosine}: {sigmas:.2} ({degrees})");
            assert!(degrees > 40.0 && sigmas.abs() < 4.5, "{roughness} {cosine}: {chi_squared} of {degrees}");
        }
    }

    /// Less than 1 % of the light of the narrowest lobe leaves the cone of 0.02 rad, 25 alpha for half vectors, around the
    /// mirror direction; at the same width the lobe of roughness 0.5 is almost all outside.
    #[test]
    fn narrow_lobes_tend_to_the_mirror() {
        for (roughness, least, most) in [(LEAST_ROUGHNESS, 0.0, 0.01), (0.5, 0.97, 1.0)] {
            let lobe = Glossy::new(roughness);
            let from = direction(0.8, 1.0);
            let mirrored = DVec3::new(-from.x, -from.y, from.z);
            let mut random = PathRandom::new(Key::new(2));
            let outside = (0..10_000).filter(|_| {
                let point = random.uniform2();
                let toward = lobe.reflect(DVec3::Z, from, point, &mut random);
                (toward - mirrored).length() > 0.02
            });
            let fraction = outside.count() as f64 / 1e4;
            assert!((least..=most).contains(&fraction), "{roughness}: {fraction}");
        }
    }

    /// Grazing and normal incidence, corners of the unit square: unit vectors above the surface, finite densities.
    #[test]
    fn edges_are_finite() {
        let mut random = PathRandom::new(Key::new(1));
        for roughness in ROUGHNESSES {
            let lobe = Glossy::new(roughness);
            for cosine in [1.0, 1.0 - 1e-15, 0.5, 1e-6, 1e-12, 0.0] {
                for point in [[0.0, 0.0], [0.5, 0.0], [0.0, 1.0 - 1e-16], [0.25, 0.999], [0.7, 0.3]] {
                    let from = direction(cosine, 0.0);
                    let toward = lobe.reflect(DVec3::Z, from, point, &mut random);
                    assert!(toward.is_normalized() && toward.z >= 0.0, "{roughness} {cosine} {point:?}: {toward}");
                    let density = lobe.density(DVec3::Z, from, toward);
                    assert!(density.is_finite() && density >= 0.0, "{roughness} {cosine} {point:?}: {density}");
                }
            }
        }
    }
}
