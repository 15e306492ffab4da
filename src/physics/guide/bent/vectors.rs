//! Vectors of as many rays at once as the processor takes.

use glam::{DMat3, DVec3};
use pulp::Simd;

use crate::geometry::numbers::Numbers;

/// Three coordinates, each of several rays.
pub type Vector<S> = [Numbers<S>; 3];

/// A vector turned by another, as complex numbers multiply.
#[inline(always)]
pub fn rotated<S: Simd>(by: [Numbers<S>; 2], v: [Numbers<S>; 2]) -> [Numbers<S>; 2] {
    [by[0] * v[0] - by[1] * v[1], by[1] * v[0] + by[0] * v[1]]
}

/// The same vector for all.
#[inline(always)]
pub fn all<S: Simd>(simd: S, v: DVec3) -> Vector<S> {
    [Numbers::all(simd, v.x), Numbers::all(simd, v.y), Numbers::all(simd, v.z)]
}

/// Scalar products.
#[inline(always)]
pub fn dot<S: Simd>(a: Vector<S>, b: Vector<S>) -> Numbers<S> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Sums.
#[inline(always)]
pub fn sum<S: Simd>(a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// Differences.
#[inline(always)]
pub fn difference<S: Simd>(a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Vectors times a matrix.
#[inline(always)]
pub fn turned<S: Simd>(simd: S, by: &DMat3, v: Vector<S>) -> Vector<S> {
    let [x, y, z] = [all(simd, by.x_axis), all(simd, by.y_axis), all(simd, by.z_axis)];
    [
        x[0] * v[0] + y[0] * v[1] + z[0] * v[2],
        x[1] * v[0] + y[1] * v[1] + z[1] * v[2],
        x[2] * v[0] + y[2] * v[1] + z[2] * v[2],
    ]
}
