//! Perspective cameras.

use glam::DVec3;

/// A perspective view in the room frame.
#[derive(Clone, Debug)]
pub struct View {
    pub name: String,
    pub eye: DVec3,
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
        let half_height = (0.5 * vertical_fov).tan();
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
}
