//! Rays, boxes and triangles in f32, as they are looked at many at once.

use glam::Vec3A;

use super::triangle::ShearedRay;

/// Boxes that are looked at at once, and triangles.
pub const WIDTH: usize = 16;

/// Below this size a component of a direction is taken as this: f32 products with its inverse stay finite.
const LEAST_COMPONENT: f32 = 1e-18;

/// Lower x, y, z of boxes, then upper x, y, z; of no box where `lower > upper`.
pub type Bounds = [[f32; WIDTH]; 6];

/// Bounds of no boxes.
pub const NO_BOXES: Bounds = {
    let (lower, upper) = ([f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]);
    [lower, lower, lower, upper, upper, upper]
};

/// Coordinates of triangles by corner and axis; not a number where there is no triangle.
pub type Corners = [[[f32; WIDTH]; 3]; 3];

/// Numbers of triangles.
pub type Numbers = [u32; WIDTH];

/// A ray as boxes see it, in their coordinates; each number alone, or in every lane of a vector.
#[derive(Clone, Copy, Debug)]
pub struct BoxRay<T = f32> {
    /// Inverse of the direction's components.
    pub inverse: [T; 3],
    /// The origin's components times that, negative.
    pub start: [T; 3],
    /// Rows of bounds that the ray meets first, by axis, and those where it leaves.
    pub near: [usize; 3],
    pub far: [usize; 3],
}

/// A ray as triangles see it, in the coordinates of boxes; each number alone, or in every lane of a vector.
#[derive(Clone, Copy, Debug)]
pub struct TriangleRay<T = f32> {
    /// The axes, that of the direction's largest component last.
    pub axes: [usize; 3],
    /// The origin's coordinates along these axes.
    pub origin: [T; 3],
    /// The shear that takes the direction to the last axis, negative.
    pub shear: [T; 2],
}

// arrays are written out: what `map` calls would be compiled without the vector instructions of its caller

impl BoxRay {
    /// `origin` and `direction` of a ray, the origin within some times the extent of the boxes.
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

/// One over a component of a direction.
#[inline(always)]
fn inverse(component: f32) -> f32 {
    1.0 / component.abs().max(LEAST_COMPONENT).copysign(component)
}

impl TriangleRay {
    /// `origin` of a ray in the coordinates of boxes; its direction is that of `ray`.
    #[inline(always)]
    pub fn new(origin: Vec3A, ray: &ShearedRay) -> Self {
        let (origin, [x, y, z]) = (origin.to_array(), ray.axes());
        let [shear_x, shear_y] = ray.shear();
        Self { axes: [x, y, z], origin: [origin[x], origin[y], origin[z]], shear: [-shear_x as f32, -shear_y as f32] }
    }
}
