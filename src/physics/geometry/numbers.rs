//! Vectors of f64 numbers with arithmetic operators.

use std::ops::{Add, Div, Mul, Neg, Sub};

use pulp::Simd;

/// A SIMD vector of f64 numbers.
pub struct Numbers<S: Simd>(S, S::f64s);

/// A mask for [`Numbers`]: one boolean per lane.
pub struct Truths<S: Simd>(S, S::m64s);

impl<S: Simd> Clone for Numbers<S> {
    #[inline(always)]
    fn clone(&self) -> Self {
        *self
    }
}

impl<S: Simd> Copy for Numbers<S> {}

impl<S: Simd> Clone for Truths<S> {
    #[inline(always)]
    fn clone(&self) -> Self {
        *self
    }
}

impl<S: Simd> Copy for Truths<S> {}

/// Constant 1.5 2^52: adding and subtracting it rounds numbers below 2^51 to whole numbers.
const WHOLE: f64 = 6_755_399_441_055_744.0;

impl<S: Simd> Numbers<S> {
    /// Returns a vector with the same number in every lane.
    #[inline(always)]
    pub fn all(simd: S, number: f64) -> Self {
        Self(simd, simd.splat_f64s(number))
    }

    /// Reads the `j`-th vector of a slice of whole vectors.
    #[inline(always)]
    pub fn of(simd: S, numbers: &[f64], j: usize) -> Self {
        Self(simd, S::as_simd_f64s(numbers).0[j])
    }

    /// Writes the numbers to the `j`-th vector of a slice.
    #[inline(always)]
    pub fn store(self, numbers: &mut [f64], j: usize) {
        S::as_mut_simd_f64s(numbers).0[j] = self.1;
    }

    #[inline(always)]
    pub fn abs(self) -> Self {
        Self(self.0, self.0.abs_f64s(self.1))
    }

    /// Returns the larger number of each lane.
    #[inline(always)]
    pub fn larger(self, other: Self) -> Self {
        other.is_below(self).pick(self, other)
    }

    /// Returns the lesser number of each lane.
    #[inline(always)]
    pub fn less(self, other: Self) -> Self {
        self.is_below(other).pick(self, other)
    }

    /// Returns the square root of each lane.
    #[inline(always)]
    pub fn root(self) -> Self {
        Self(self.0, self.0.sqrt_f64s(self.1))
    }

    /// Rounds each lane down to a whole number.
    #[inline(always)]
    pub fn floor(self) -> Self {
        let nearest = self.rounded();
        nearest - self.is_below(nearest).pick(Self::all(self.0, 1.0), Self::all(self.0, 0.0))
    }

    /// Rounds each lane to the nearest whole number.
    #[inline(always)]
    pub fn rounded(self) -> Self {
        let whole = Self::all(self.0, WHOLE);
        (self + whole) - whole
    }

    #[inline(always)]
    pub fn is_below(self, other: Self) -> Truths<S> {
        Truths(self.0, self.0.less_than_f64s(self.1, other.1))
    }
}

impl<S: Simd> Truths<S> {
    /// Selects, lane by lane, `if_true` where the mask is true, else `if_false`.
    #[inline(always)]
    pub fn pick(self, if_true: Numbers<S>, if_false: Numbers<S>) -> Numbers<S> {
        Numbers(self.0, self.0.select_f64s(self.1, if_true.1, if_false.1))
    }

    #[inline(always)]
    pub fn and(self, other: Self) -> Self {
        Self(self.0, self.0.and_m64s(self.1, other.1))
    }

    #[inline(always)]
    pub fn or(self, other: Self) -> Self {
        Self(self.0, self.0.or_m64s(self.1, other.1))
    }

    /// Returns the lanes in which this mask is true and the other is false.
    #[inline(always)]
    pub fn but_not(self, other: Self) -> Self {
        Self(self.0, self.0.and_m64s(self.1, self.0.not_m64s(other.1)))
    }

    /// True if the mask is true in at least one lane.
    #[inline(always)]
    pub fn any(self) -> bool {
        self.0.first_true_m64s(self.1) < S::F64_LANES
    }
}

impl<S: Simd> Add for Numbers<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0, self.0.add_f64s(self.1, other.1))
    }
}

impl<S: Simd> Sub for Numbers<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0, self.0.sub_f64s(self.1, other.1))
    }
}

impl<S: Simd> Mul for Numbers<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0, self.0.mul_f64s(self.1, other.1))
    }
}

impl<S: Simd> Div for Numbers<S> {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self(self.0, self.0.div_f64s(self.1, other.1))
    }
}

impl<S: Simd> Neg for Numbers<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0, self.0.neg_f64s(self.1))
    }
}
