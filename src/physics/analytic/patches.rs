//! Rectangular patches of the faces of a room, and the form factors to them.

use glam::DVec3;

use crate::geometry::rectangle::{parallel_factor, perpendicular_factor};

/// Number of parts along each edge of a divided patch.
const DIVIDED: usize = 4;

/// Values of the parts of a divided patch; the second of its two axes runs fastest.
pub type Parts = [f64; DIVIDED * DIVIDED];

/// Approximate largest number of patches of a room: 16 x 16 on every face of a cube.
const PATCHES: f64 = 1536.0;

/// Smallest number of patches along an edge of the room.
const LEAST_DIVISIONS: usize = 4;

/// A rectangle on a face of the room; faces are numbered as in [`crate::scene::Face`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Number of the face, 0..=5.
    pub face: usize,
    /// Corner with the smallest coordinates, in m.
    pub low: DVec3,
    /// Corner with the largest coordinates, in m; along the axis of the face it has the coordinate of `low`.
    pub high: DVec3,
}

/// Division of a room's faces into patches.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Extent of the room along x, y and z in m.
    pub size: DVec3,
    /// Numbers of patches along x, y and z.
    pub divisions: [usize; 3],
    /// Face by face; on a face, the second of its two axes (in the order x, y, z, x, y) runs fastest.
    pub patches: Vec<Patch>,
}

/// An element of area that receives light, parallel to a face of the room.
#[derive(Clone, Copy, Debug)]
pub struct Element {
    /// Place in the room, in m.
    pub position: DVec3,
    axis: usize,
    /// Side to which the element looks along the axis, +1 or -1.
    sign: f64,
}

impl Element {
    /// Builds an element that looks up.
    pub fn looking_up(position: DVec3) -> Self {
        Self { position, axis: 2, sign: 1.0 }
    }

    /// Returns the unit normal.
    pub fn normal(&self) -> DVec3 {
        DVec3::AXES[self.axis] * self.sign
    }

    /// True if a point is on the side to which the element looks.
    pub fn is_before(&self, point: DVec3) -> bool {
        (point - self.position)[self.axis] * self.sign > 0.0
    }

    /// Builds an element on the face of a patch.
    pub fn on(patch: &Patch, position: DVec3) -> Self {
        Self { position, axis: patch.axis(), sign: patch.sign() }
    }
}

impl Patch {
    /// Returns the axis that the patch is perpendicular to: 0 for x, 1 for y, 2 for z.
    pub fn axis(&self) -> usize {
        self.face / 2
    }

    /// Returns the middle of the patch, in m.
    pub fn centre(&self) -> DVec3 {
        0.5 * (self.low + self.high)
    }

    /// Computes the area in m2.
    pub fn area(&self) -> f64 {
        let extent = self.high - self.low;
        let axis = self.axis();
        extent[(axis + 1) % 3] * extent[(axis + 2) % 3]
    }

    /// Returns the unit normal, pointing into the room.
    pub fn normal(&self) -> DVec3 {
        DVec3::AXES[self.axis()] * self.sign()
    }

    /// Returns the sign of the normal along its axis: +1 on the faces at 0, -1 on the others.
    fn sign(&self) -> f64 {
        if self.face % 2 == 1 { -1.0 } else { 1.0 }
    }

    /// Returns part `k` of the patch when it is divided.
    pub fn part(&self, k: usize) -> Self {
        let (u, v) = ((self.axis() + 1) % 3, (self.axis() + 2) % 3);
        let extent = self.high - self.low;
        let (mut low, mut high) = (self.low, self.low);
        for (axis, n) in [(u, k / DIVIDED), (v, k % DIVIDED)] {
            low[axis] += extent[axis] * n as f64 / DIVIDED as f64;
            high[axis] += extent[axis] * (n + 1) as f64 / DIVIDED as f64;
        }
        Self { face: self.face, low, high }
    }

    /// Returns the number of the part that holds a point of the patch.
    fn part_at(&self, position: DVec3) -> usize {
        let index = |k: usize| {
            let fraction = (position[k] - self.low[k]) / (self.high[k] - self.low[k]);
            ((fraction * DIVIDED as f64).max(0.0) as usize).min(DIVIDED - 1)
        };
        index((self.axis() + 1) % 3) * DIVIDED + index((self.axis() + 2) % 3)
    }

    /// Computes the form factor from an element to this patch, without occlusion.
    pub fn factor_from(&self, element: Element) -> f64 {
        let Element { position, axis, sign } = element;
        let own = self.axis();
        let reach = |k: usize| [self.low[k] - position[k], self.high[k] - position[k]];
        let distance = (self.low[own] - position[own]).abs();
        // an element in the patch's plane, or one that looks the same way, sees nothing of it
        if distance == 0.0 || (own == axis && sign == self.sign()) {
            return 0.0;
        }
        if own == axis {
            return parallel_factor(distance, reach((own + 1) % 3), reach((own + 2) % 3));
        }
        let along = reach(axis);
        let along = if sign > 0.0 { along } else { [-along[1], -along[0]] };
        perpendicular_factor(distance, reach(3 - own - axis), along)
    }
}

impl Mesh {
    /// Divides the faces of a room; `divisions`: patches along x, y and z, each >= 1.
    pub fn new(size: DVec3, divisions: [usize; 3]) -> Self {
        let mut patches = Vec::new();
        for face in 0..6 {
            let axis = face / 2;
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for i in 0..divisions[u] {
                for j in 0..divisions[v] {
                    let mut low = DVec3::ZERO;
                    low[axis] = if face % 2 == 1 { size[axis] } else { 0.0 };
                    let mut high = low;
                    for (k, index) in [(u, i), (v, j)] {
                        let at = |n: usize| size[k] * n as f64 / divisions[k] as f64;
                        (low[k], high[k]) = (at(index), at(index + 1));
                    }
                    patches.push(Patch { face, low, high });
                }
            }
        }
        Self { size, divisions, patches }
    }

    /// Divides the faces into nearly square patches, about 1500 of them, more in a long room; an even number along every edge.
    pub fn fine(size: DVec3) -> Self {
        Self::new(size, Self::fine_divisions(size))
    }

    /// Returns the number of patches of [`Self::fine`].
    pub fn fine_count(size: DVec3) -> usize {
        let [x, y, z] = Self::fine_divisions(size);
        2 * (x * y + y * z + z * x)
    }

    fn fine_divisions(size: DVec3) -> [usize; 3] {
        let area = 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
        let side = (area / PATCHES).sqrt();
        [0, 1, 2].map(|axis| 2 * ((0.5 * size[axis] / side).round() as usize).max(LEAST_DIVISIONS / 2))
    }

    /// Returns the mesh of patches that are twice as long and wide.
    pub fn coarse(&self) -> Self {
        Self::new(self.size, self.divisions.map(|n| (n / 2).max(1)))
    }

    /// Finds the patch that holds a point of a face.
    pub fn patch_at(&self, face: usize, position: DVec3) -> usize {
        let first: usize = (0..face).map(|face| self.on_face(face)).sum();
        let axis = face / 2;
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let index = |k: usize| {
            ((position[k] / self.size[k] * self.divisions[k] as f64).max(0.0) as usize).min(self.divisions[k] - 1)
        };
        first + index(u) * self.divisions[v] + index(v)
    }

    fn on_face(&self, face: usize) -> usize {
        let axis = face / 2;
        self.divisions[(axis + 1) % 3] * self.divisions[(axis + 2) % 3]
    }

    /// Computes the area means of `values` over the patches of `coarse`, whose divisions are half of these.
    pub fn merged(&self, values: &[f64], coarse: &Self) -> Vec<f64> {
        let mut sums = vec![0.0; coarse.patches.len()];
        for (patch, value) in self.patches.iter().zip(values) {
            sums[coarse.patch_at(patch.face, patch.centre())] += value * patch.area();
        }
        sums.iter().zip(&coarse.patches).map(|(sum, patch)| sum / patch.area()).collect()
    }

    /// Interpolates the values in the parts of a patch, linearly between neighbouring patches.
    pub fn linear(&self, values: &[f64], index: usize) -> Parts {
        let patch = &self.patches[index];
        let slope = |k: usize| {
            let step = DVec3::AXES[k] * (patch.high[k] - patch.low[k]);
            let at = |to: DVec3| self.patch_at(patch.face, to);
            // beyond the face's edge this is the patch itself
            let (before, after) = (at(patch.centre() - step), at(patch.centre() + step));
            let steps = f64::from(u8::from(before != index) + u8::from(after != index));
            if steps == 0.0 { 0.0 } else { (values[after] - values[before]) / steps }
        };
        let slopes = [slope((patch.axis() + 1) % 3), slope((patch.axis() + 2) % 3)];
        let part = |k: usize| (k as f64 + 0.5) / DIVIDED as f64 - 0.5;
        std::array::from_fn(|k| values[index] + slopes[0] * part(k / DIVIDED) + slopes[1] * part(k % DIVIDED))
    }

    /// Computes the means over the parts of the patches of `coarse`, whose divisions are half of these.
    pub fn merged_parts(&self, parts: &[Parts], coarse: &Self) -> Vec<Parts> {
        let mut means = vec![[0.0; DIVIDED * DIVIDED]; coarse.patches.len()];
        for (patch, parts) in self.patches.iter().zip(parts) {
            let whole = coarse.patch_at(patch.face, patch.centre());
            for (k, value) in parts.iter().enumerate() {
                let of = coarse.patches[whole].part_at(patch.part(k).centre());
                means[whole][of] += 0.25 * value;
            }
        }
        means
    }
}
