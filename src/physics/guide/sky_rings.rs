//! Light of a sky by zenith angle, for years of skies: far fewer directions than [`super::sky_moments`] takes, and an error of 1e-4.

use std::f64::consts::{FRAC_PI_2, PI};
use std::num::NonZeroUsize;
use std::sync::LazyLock;

use gauss_quad::GaussLegendre;
use glam::{DVec2, DVec3};

use crate::sky::SkyDistribution;

/// Number of zenith angles.
pub const RINGS: usize = 24;

/// Number of azimuths along half a circle, from that of the sun.
const AZIMUTHS: usize = 16;

/// Directions of a quadrature over half of the sky, relative to the sun's azimuth.
struct Nodes {
    /// Sine and cosine of the zenith angle of each ring, and its weight in the horizontal illuminance.
    rings: [(f64, f64, f64); RINGS],
    /// Cosine of each difference of azimuth, and its weight.
    azimuths: [(f64, f64); AZIMUTHS],
}

static NODES: LazyLock<Nodes> = LazyLock::new(|| {
    let rule = |nodes: usize| GaussLegendre::new(NonZeroUsize::new(nodes).unwrap_or(NonZeroUsize::MIN));
    let (along, around) = (rule(RINGS), rule(AZIMUTHS));
    let (along, around) = (along.as_node_weight_pairs(), around.as_node_weight_pairs());
    let ring = |number: usize| {
        let (node, weight) = along[number];
        let (sin, cos) = libm::sincos(0.5 * FRAC_PI_2 * (1.0 + node));
        (sin, cos, weight * sin * cos)
    };
    let azimuth = |number: usize| {
        let (node, weight) = around[number];
        (libm::cos(0.5 * PI * (1.0 + node)), weight)
    };
    Nodes { rings: std::array::from_fn(ring), azimuths: std::array::from_fn(azimuth) }
});

/// Light of a sky from each of 24 zenith angles, by Gauss-Legendre quadrature.
#[derive(Clone, Copy, Debug)]
pub struct SkyRings {
    /// Fractions of the horizontal illuminance, and these times the mean cosine of the azimuth from the sun's.
    fractions: [f64; RINGS],
    toward_sun: [f64; RINGS],
    /// Horizontal unit vector toward the sun; 0 for a sun in the zenith.
    sun: DVec2,
    /// Horizontal illuminance over the luminance of the zenith in sr.
    pub horizontal_ratio: f64,
}

impl SkyRings {
    /// Computes the fractions from the luminance in 24 x 16 directions on one side of the sun.
    pub fn new(distribution: &SkyDistribution) -> Self {
        let sun = distribution.sun();
        let (sin_sun, cos_sun) = (sun.truncate().length(), sun.z);
        let light = |(sin, cos, weight): (f64, f64, f64)| {
            let mut sums = [0.0; 2];
            for (cos_azimuth, weight) in &NODES.azimuths {
                let chord_squared = 2.0 - 2.0 * (cos * cos_sun + sin * sin_sun * cos_azimuth);
                let light = weight * distribution.of_distance(chord_squared.clamp(0.0, 4.0).sqrt());
                sums[0] += light;
                sums[1] += light * cos_azimuth;
            }
            sums.map(|sum| weight * distribution.of_height(cos) * sum)
        };
        let rings = NODES.rings.map(light);
        let whole: f64 = rings.iter().map(|[light, _]| light).sum();
        // both halves of the sky, whose angles are PI / 4 and PI / 2 of those of the rules
        let horizontal_ratio = 2.0 * 0.25 * PI * 0.5 * PI * whole;
        let per_whole = if whole > 0.0 { 1.0 / whole } else { 0.0 };
        let [fractions, toward_sun] = [0, 1].map(|part| rings.map(|sums| per_whole * sums[part]));
        Self { fractions, toward_sun, sun: sun.truncate().normalize_or_zero(), horizontal_ratio }
    }

    /// Returns the mean of a quantity over the light, from its values at the [`zenith_angles`].
    pub fn mean(&self, values: &[f64; RINGS]) -> f64 {
        self.fractions.iter().zip(values).map(|(fraction, value)| fraction * value).sum()
    }

    /// Returns the mean over the light of vectors that point toward its azimuth, from their lengths at the [`zenith_angles`].
    pub fn mean_toward(&self, lengths: &[f64; RINGS]) -> DVec2 {
        self.sun * self.toward_sun.iter().zip(lengths).map(|(fraction, length)| fraction * length).sum::<f64>()
    }
}

/// Returns unit vectors at the zenith angles of the rings, all at azimuth 0.
pub fn zenith_angles() -> [DVec3; RINGS] {
    NODES.rings.map(|(sin, cos, _)| DVec3::new(0.0, sin, cos))
}
