//! Light in one photopic channel or in three linear Rec.709 channels.

use std::ops::{Add, AddAssign, Mul, MulAssign};

/// Weights of linear Rec.709 red, green and blue in luminance Y.
pub const REC709_LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// A flux, luminance or weight in `C` channels: 1 (photopic, Y itself) or 3 (linear Rec.709).
///
/// The number of channels is a compile-time constant, so that a scene without colours pays for one channel only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spectrum<const C: usize>(pub [f64; C]);

impl<const C: usize> Spectrum<C> {
    /// No light.
    pub const ZERO: Self = Self([0.0; C]);
    /// One in every channel: the weight of a path at its start.
    pub const ONE: Self = Self([1.0; C]);

    /// Builds the spectrum of a coefficient that is stored as linear Rec.709; a photopic scene stores the same number three times.
    #[inline]
    pub fn from_rgb(rgb: [f64; 3]) -> Self {
        let mut spectrum = Self::ZERO;
        for (value, of_channel) in spectrum.0.iter_mut().zip(rgb) {
            *value = of_channel;
        }
        spectrum
    }

    /// Returns the luminance Y of this spectrum (Rec.709 weights; the value itself in one channel).
    ///
    /// ```
    /// use skyduct_physics::optics::Spectrum;
    ///
    /// assert!((Spectrum([1.0; 3]).luminance() - 1.0).abs() < 1e-15);
    /// assert_eq!(Spectrum([0.0, 1.0, 0.0]).luminance(), 0.7152);
    /// ```
    #[inline]
    pub fn luminance(&self) -> f64 {
        if C == 1 { self.0[0] } else { (0..C).map(|c| REC709_LUMINANCE[c] * self.0[c]).sum() }
    }

    /// Returns the value of the largest channel.
    #[inline]
    pub fn max(&self) -> f64 {
        self.0.iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }

    /// True if every channel is finite.
    pub fn is_finite(&self) -> bool {
        self.0.iter().all(|value| value.is_finite())
    }

    /// Applies `f` to each channel.
    #[inline]
    pub fn map(mut self, mut f: impl FnMut(f64) -> f64) -> Self {
        for value in &mut self.0 {
            *value = f(*value);
        }
        self
    }
}

// loops, and no functions of arrays: these are compiled apart, and not always inlined

impl<const C: usize> Mul for Spectrum<C> {
    type Output = Self;
    #[inline]
    fn mul(mut self, other: Self) -> Self {
        self *= other;
        self
    }
}

impl<const C: usize> Mul<f64> for Spectrum<C> {
    type Output = Self;
    #[inline]
    fn mul(mut self, factor: f64) -> Self {
        for value in &mut self.0 {
            *value *= factor;
        }
        self
    }
}

impl<const C: usize> MulAssign for Spectrum<C> {
    #[inline]
    fn mul_assign(&mut self, other: Self) {
        for c in 0..C {
            self.0[c] *= other.0[c];
        }
    }
}

impl<const C: usize> Add for Spectrum<C> {
    type Output = Self;
    #[inline]
    fn add(mut self, other: Self) -> Self {
        self += other;
        self
    }
}

impl<const C: usize> AddAssign for Spectrum<C> {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        for c in 0..C {
            self.0[c] += other.0[c];
        }
    }
}
