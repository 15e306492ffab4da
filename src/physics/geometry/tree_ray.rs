//! Rays, boxes and triangles in f32, laid out for SIMD tests.

use glam::Vec3A;

use super::triangle::ShearedRay;

/// Number of boxes, and of triangles, that are tested together.
pub const WIDTH: usize = 16;

/// Least size of a direction's component, to which smaller ones are raised: f32 products with its inverse stay finite.
const LEAST_COMPONENT: f32 = 1e-18;

/// Lower x, y, z of boxes, then upper x, y, z; lanes with `lower > upper` hold no box.
pub type Bounds = [[f32; WIDTH]; 6];

/// Bounds with no box in any lane.
pub const NO_BOXES: Bounds = {
    let (lower, upper) = ([f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]);
    [lower, lower, lower, upper, upper, upper]
};

/// Coordinates of triangles by corner and axis; NaN in lanes without a triangle.
pub type Corners = [[[f32; WIDTH]; 3]; 3];

/// Indices of triangles, one per lane.
pub type Numbers = [u32; WIDTH];

/// A ray prepared for tests against boxes, in their coordinates; each number a scalar, or a vector with one ray in all lanes.
#[derive(Clone, Copy, Debug)]
pub struct BoxRay<T = f32> {
    /// Inverse of the direction's components.
    pub inverse: [T; 3],
    /// Negative products of the origin's components and `inverse`.
    pub start: [T; 3],
    /// Rows of [`Bounds`] at which the ray enters a box, by axis; `far` has those at which it leaves.
    pub near: [usize; 3],
    pub far: [usize; 3],
}

/// A ray prepared for tests against triangles, in the coordinates of boxes; each number a scalar, or a vector with one ray in all lanes.
#[derive(Clone, Copy, Debug)]
pub struct TriangleRay<T = f32> {
    /// Axis permutation, the axis of the direction's largest component last.
    pub axes: [usize; 3],
    /// Coordinates of the origin along these axes.
    pub origin: [T; 3],
    /// Negative shear that takes the direction to the last axis.
    pub shear: [T; 2],
}

// arrays are written out: what `map` calls would be compiled without the vector instructions of its caller

impl BoxRay {
    /// Prepares a ray for box tests; its origin lies within some times the extent of the boxes.
    #[inline(always)]
    pub fn new(origin: Vec3A, direction: Vec3A) -> Self {
        let inverse = [inverse(direction.x), inverse(direction.y), inverse(direction.z)];
        let first = |axis: usize| if inverse[axis] > 0.0 { axis } else { axis + 3 };
        let near = [first(0), first(1), first(2)];
        Self {
            inverse,
            start: [-origin.x * inverse[0], -origin.y * inverse[1], -origin.z * inverse[2]],
            near,
            far: [3 - near[0], 5 - near[1], 7 - near[2]],
        }
    }
}

/// Returns the inverse of a direction's component, bounded by [`LEAST_COMPONENT`].
#[inline(always)]
fn inverse(component: f32) -> f32 {
    1.0 / component.abs().max(LEAST_COMPONENT).copysign(component)
}

impl TriangleRay {
    /// Prepares a ray for triangle tests from its `origin` in the coordinates of boxes and the direction of `ray`.
    #[inline(always)]
    pub fn new(origin: Vec3A, ray: &ShearedRay) -> Self {
        let (origin, [x, y, z]) = (origin.to_array(), ray.axes());
        let [shear_x, shear_y] = ray.shear();
        Self { axes: [x, y, z], origin: [origin[x], origin[y], origin[z]], shear: [-shear_x as f32, -shear_y as f32] }
    }
}
