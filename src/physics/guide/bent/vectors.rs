//! Three-dimensional vectors of several rays, one per SIMD lane.

use glam::{DMat3, DVec3};
use pulp::Simd;

use crate::geometry::numbers::Numbers;

/// Three coordinates, each a SIMD vector with one ray per lane.
pub type Vector<S> = [Numbers<S>; 3];

/// Rotates a plane vector by another one, as complex numbers multiply.
#[inline(always)]
pub fn rotated<S: Simd>(by: [Numbers<S>; 2], v: [Numbers<S>; 2]) -> [Numbers<S>; 2] {
    [by[0] * v[0] - by[1] * v[1], by[1] * v[0] + by[0] * v[1]]
}

/// Copies one vector to all lanes.
#[inline(always)]
pub fn all<S: Simd>(simd: S, v: DVec3) -> Vector<S> {
    [Numbers::all(simd, v.x), Numbers::all(simd, v.y), Numbers::all(simd, v.z)]
}

/// Computes scalar products.
#[inline(always)]
pub fn dot<S: Simd>(a: Vector<S>, b: Vector<S>) -> Numbers<S> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Computes sums of vectors.
#[inline(always)]
pub fn sum<S: Simd>(a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// Computes differences of vectors.
#[inline(always)]
pub fn difference<S: Simd>(a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Multiplies vectors by a matrix.
#[inline(always)]
pub fn turned<S: Simd>(simd: S, by: &DMat3, v: Vector<S>) -> Vector<S> {
    let [x, y, z] = [all(simd, by.x_axis), all(simd, by.y_axis), all(simd, by.z_axis)];
    [
        x[0] * v[0] + y[0] * v[1] + z[0] * v[2],
        x[1] * v[0] + y[1] * v[1] + z[1] * v[2],
        x[2] * v[0] + y[2] * v[1] + z[2] * v[2],
    ]
}
