//! Perspective cameras.

use glam::DVec3;

/// A perspective view in the room frame.
#[derive(Clone, Debug)]
pub struct View {
    /// Name in the document, unique among the views of a job; files of results carry it.
    pub name: String,
    /// Place of the eye in m, inside the room or outside.
    pub eye: DVec3,
    /// Width and height of the image.
    pub size_px: [usize; 2],
    /// Unit vector along the optical axis.
    forward: DVec3,
    /// Half the image's width and height at distance 1.
    right: DVec3,
    up: DVec3,
}

impl View {
    /// `vertical_fov` in radians, 0 < fov < pi; `None` when the axis is zero or parallel to `up`.
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
        Some(Self { name, eye, size_px, forward, right: right * half_width, up: right.cross(forward) * half_height })
    }

    /// Unit direction through image position (`x`, `y`) in pixels, from the upper left corner.
    #[inline]
    pub fn ray_direction(&self, x: f64, y: f64) -> DVec3 {
        let across = 2.0 * x / self.size_px[0] as f64 - 1.0;
        let upward = 1.0 - 2.0 * y / self.size_px[1] as f64;
        (self.forward + self.right * across + self.up * upward).normalize()
    }

    /// The pixel in which a point is seen, and the solid angle in sr of a pixel there; `None` outside the image.
    pub fn pixel_of(&self, point: DVec3) -> Option<(usize, f64)> {
        let direction = (point - self.eye).try_normalize()?;
        let cosine = direction.dot(self.forward);
        if cosine <= 0.0 {
            return None;
        }
        let on_plane = direction / cosine;
        let [width, height] = self.size_px.map(|size| size as f64);
        let x = 0.5 * width * (1.0 + on_plane.dot(self.right) / self.right.length_squared());
        let y = 0.5 * height * (1.0 - on_plane.dot(self.up) / self.up.length_squared());
        if !(x >= 0.0 && x < width && y >= 0.0 && y < height) {
            return None;
        }
        Some((y as usize * self.size_px[0] + x as usize, self.pixel_sr(direction)))
    }

    /// Solid angle in sr of a pixel around a unit direction of the image.
    pub fn pixel_sr(&self, direction: DVec3) -> f64 {
        // a square of the plane at distance 1 appears smaller by the cube of the cosine
        let [width, height] = self.size_px.map(|size| size as f64);
        let cosine = direction.dot(self.forward);
        let area = 4.0 * self.right.length() * self.up.length() / (width * height);
        area * cosine * cosine * cosine
    }
}
