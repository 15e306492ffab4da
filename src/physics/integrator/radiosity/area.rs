//! Parallelograms at which rays are aimed.

use glam::DVec3;

/// Parallelogram that reflects light, or is an image.
#[derive(Clone, Copy, Debug)]
pub struct Area {
    pub corner: DVec3,
    pub edges: [DVec3; 2],
}

impl Area {
    /// Returns the area in m2.
    pub fn area_m2(&self) -> f64 {
        self.edges[0].cross(self.edges[1]).length()
    }

    /// Returns the squared distance over the cosine, in m2, at which a line from a place toward another meets the area: the ratio of a density
    /// per sr to that per m2. `None` where it passes beside.
    pub fn squared_over_cosine(&self, from: DVec3, toward: DVec3) -> Option<f64> {
        let [u, v] = self.edges;
        let across = u.cross(v);
        let direction = toward - from;
        let along = direction.dot(across);
        let distance = (self.corner - from).dot(across) / along;
        let place = from + direction * distance - self.corner;
        let within = |other: DVec3, edge: DVec3| {
            let side = across.cross(other);
            (0.0..=1.0).contains(&(place.dot(side) / edge.dot(side)))
        };
        let is_met = distance > 0.0 && within(v, u) && within(u, v);
        let length = direction.length();
        is_met.then(|| (distance * length).powi(2) * length * across.length() / along.abs())
    }

    /// Returns the squared length of the longer edges in m2.
    pub fn length_squared(&self) -> f64 {
        self.edges[0].length_squared().max(self.edges[1].length_squared())
    }
}
