//! Perspective cameras.

use glam::DVec3;

/// A perspective view in the room frame.
#[derive(Clone, Debug)]
pub struct View {
    /// Name in the document, unique among the views of a job; files of results carry it.
    pub name: String,
    /// Place of the eye in m, inside the room or outside.
    pub eye: DVec3,
    /// Width and height of the image in pixels.
    pub size_px: [usize; 2],
    /// Unit vector along the optical axis.
    forward: DVec3,
    /// Vector along half the image's width at distance 1; `up` is that along half its height.
    right: DVec3,
    up: DVec3,
    /// Middle of the image in units of `right` and `up` from the axis: zero, except for a [`View::window`].
    middle: [f64; 2],
}

impl View {
    /// Builds a view; `vertical_fov` in radians, 0 < fov < pi. `None` when the axis is zero or parallel to `up`.
    pub fn new(
        name: String,
        eye: DVec3,
        look_at: DVec3,
        up: DVec3,
        vertical_fov: f64,
        size_px: [usize; 2],
    ) -> Option<Self> {
        let forward = (look_at - eye).try_normalize()?;
        let right = forward.cross(up).try_normalize().filter(|right| right.is_finite())?;
        if forward.cross(up.try_normalize()?).length() < 1e-9 {
            return None;
        }
        let half_height = libm::tan(0.5 * vertical_fov);
        let half_width = half_height * size_px[0] as f64 / size_px[1] as f64;
        let (right, up) = (right * half_width, right.cross(forward) * half_height);
        Some(Self { name, eye, size_px, forward, right, up, middle: [0.0; 2] })
    }

    /// Returns the part of this view that begins at pixel `first` (column and row, from the upper left) and is `size_px` wide and high:
    /// its pixels are those of the whole view.
    pub fn window(&self, first: [usize; 2], size_px: [usize; 2]) -> Self {
        let fraction = |axis: usize| size_px[axis] as f64 / self.size_px[axis] as f64;
        let middle = |axis: usize| (2 * first[axis] + size_px[axis]) as f64 / self.size_px[axis] as f64 - 1.0;
        Self {
            name: self.name.clone(),
            size_px,
            right: self.right * fraction(0),
            up: self.up * fraction(1),
            middle: [(self.middle[0] + middle(0)) / fraction(0), (self.middle[1] - middle(1)) / fraction(1)],
            ..*self
        }
    }

    /// Returns the unit direction through image position (`x`, `y`) in pixels, from the upper left corner.
    #[inline]
    pub fn ray_direction(&self, x: f64, y: f64) -> DVec3 {
        let across = 2.0 * x / self.size_px[0] as f64 - 1.0 + self.middle[0];
        let upward = 1.0 - 2.0 * y / self.size_px[1] as f64 + self.middle[1];
        (self.forward + self.right * across + self.up * upward).normalize()
    }

    /// Finds the pixel in which a point is seen, and the solid angle in sr of a pixel there; `None` outside the image.
    pub fn pixel_of(&self, point: DVec3) -> Option<(usize, f64)> {
        let direction = (point - self.eye).try_normalize()?;
        let [x, y] = self.image_point(point)?;
        let [width, height] = self.size_px.map(|size| size as f64);
        if !(x >= 0.0 && x < width && y >= 0.0 && y < height) {
            return None;
        }
        Some((y as usize * self.size_px[0] + x as usize, self.pixel_sr(direction)))
    }

    /// Returns the image position in pixels, from the upper left corner, at which a point is seen, also outside the image; `None` behind
    /// the eye.
    pub fn image_point(&self, point: DVec3) -> Option<[f64; 2]> {
        let direction = (point - self.eye).try_normalize()?;
        let cosine = direction.dot(self.forward);
        if cosine <= 0.0 {
            return None;
        }
        let on_plane = direction / cosine;
        let [width, height] = self.size_px.map(|size| size as f64);
        let x = 0.5 * width * (1.0 + on_plane.dot(self.right) / self.right.length_squared() - self.middle[0]);
        let y = 0.5 * height * (1.0 - on_plane.dot(self.up) / self.up.length_squared() + self.middle[1]);
        Some([x, y])
    }

    /// Returns the solid angle in sr of a pixel around a unit direction of the image.
    pub fn pixel_sr(&self, direction: DVec3) -> f64 {
        // a square of the plane at distance 1 appears smaller by the cube of the cosine
        let [width, height] = self.size_px.map(|size| size as f64);
        let cosine = direction.dot(self.forward);
        let area = 4.0 * self.right.length() * self.up.length() / (width * height);
        area * cosine * cosine * cosine
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pixels of a window, and of a window of a window, have the directions, numbers and solid angles that they have in the whole.
    #[test]
    fn a_window_shows_the_pixels_of_the_whole() {
        let (eye, to) = (DVec3::new(0.3, 0.2, 1.5), DVec3::new(2.0, 3.0, 1.0));
        let whole = View::new("v".into(), eye, to, DVec3::Z, 1.2, [40, 24]).unwrap();
        let outer = whole.window([6, 4], [30, 16]);
        for (part, first) in [(outer.window([2, 8], [16, 8]), [8, 12]), (outer, [6, 4])] {
            for [x, y] in [[0.5, 0.5], [7.25, 3.5], [15.9, 7.9]] {
                let direction = part.ray_direction(x, y);
                let of_whole = whole.ray_direction(x + first[0] as f64, y + first[1] as f64);
                assert!((direction - of_whole).length() < 1e-14);
                let (pixel, steradians) = part.pixel_of(eye + 2.0 * direction).unwrap();
                assert_eq!([pixel % part.size_px[0], pixel / part.size_px[0]], [x as usize, y as usize]);
                assert!((steradians / whole.pixel_sr(direction) - 1.0).abs() < 1e-12);
            }
            let beside = whole.ray_direction(first[0] as f64 - 0.5, first[1] as f64 + 0.5);
            assert_eq!(part.pixel_of(eye + beside), None);
        }
    }
}
