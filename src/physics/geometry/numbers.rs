//! Several numbers at once, with the operations of one.

use std::ops::{Add, Div, Mul, Neg, Sub};

use pulp::Simd;

/// As many numbers as a vector has.
pub struct Numbers<S: Simd>(S, S::f64s);

/// What is true of each of several numbers.
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

/// 1.5 2^52: numbers below 2^51 to which it is added, and from which it is taken, are rounded to whole ones.
const WHOLE: f64 = 6_755_399_441_055_744.0;

impl<S: Simd> Numbers<S> {
    /// The same number everywhere.
    #[inline(always)]
    pub fn all(simd: S, number: f64) -> Self {
        Self(simd, simd.splat_f64s(number))
    }

    /// The `j`-th vector of some numbers that fill whole vectors.
    #[inline(always)]
    pub fn of(simd: S, numbers: &[f64], j: usize) -> Self {
        Self(simd, S::as_simd_f64s(numbers).0[j])
    }

    /// Writes them to the `j`-th vector.
    #[inline(always)]
    pub fn store(self, numbers: &mut [f64], j: usize) {
        S::as_mut_simd_f64s(numbers).0[j] = self.1;
    }

    #[inline(always)]
    pub fn abs(self) -> Self {
        Self(self.0, self.0.abs_f64s(self.1))
    }

    /// The larger one of each pair.
    #[inline(always)]
    pub fn larger(self, other: Self) -> Self {
        other.is_below(self).pick(self, other)
    }

    /// The lesser one of each pair.
    #[inline(always)]
    pub fn less(self, other: Self) -> Self {
        self.is_below(other).pick(self, other)
    }

    /// The square roots.
    #[inline(always)]
    pub fn root(self) -> Self {
        Self(self.0, self.0.sqrt_f64s(self.1))
    }

    /// The whole numbers at or below.
    #[inline(always)]
    pub fn floor(self) -> Self {
        let nearest = self.rounded();
        nearest - self.is_below(nearest).pick(Self::all(self.0, 1.0), Self::all(self.0, 0.0))
    }

    /// The nearest whole numbers.
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
    /// One of two numbers by what is true.
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

    /// True where this is, and the other is not.
    #[inline(always)]
    pub fn but_not(self, other: Self) -> Self {
        Self(self.0, self.0.and_m64s(self.1, self.0.not_m64s(other.1)))
    }

    /// True if it is true of one of them at least.
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
