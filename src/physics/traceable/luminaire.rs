//! Luminaires as they are traced: thin black rectangles that emit on one side.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::surface_id::SurfaceId;
use crate::geometry::lambert::quadrilateral_irradiance;
use crate::geometry::triangle::distance_above;
use crate::optics::Spectrum;
use crate::scene::Luminaire;

/// A luminaire and the quantities derived from it.
#[derive(Clone, Copy, Debug)]
pub struct TraceableLuminaire {
    corner: DVec3,
    edge_u: DVec3,
    edge_v: DVec3,
    /// Unit normal of the side that emits.
    pub normal: DVec3,
    /// Area of the rectangle in m2.
    pub area_m2: f64,
    /// Luminance in cd/m2, linear Rec.709; zero when switched off.
    pub luminance: [f64; 3],
    /// Number of its surface.
    pub surface: SurfaceId,
    /// Gradient of the coordinate along `edge_u`, 0..1 on the rectangle; `to_v` is that along `edge_v`.
    to_u: DVec3,
    to_v: DVec3,
}

impl TraceableLuminaire {
    /// Compiles a luminaire, whose edges must not be parallel; `surface` is its surface number.
    pub fn new(luminaire: &Luminaire, surface: SurfaceId) -> Self {
        let Luminaire { corner, edge_u, edge_v, luminance } = *luminaire;
        let across = edge_u.cross(edge_v);
        let area_m2 = across.length();
        let normal = axis_or(across / area_m2);
        let to_u = edge_v.cross(normal) / edge_u.dot(edge_v.cross(normal));
        let to_v = normal.cross(edge_u) / edge_v.dot(normal.cross(edge_u));
        Self { corner, edge_u, edge_v, normal, area_m2, luminance, surface, to_u, to_v }
    }

    /// True if the luminaire emits light in any channel.
    pub fn emits(&self) -> bool {
        self.luminance.iter().any(|luminance| *luminance > 0.0)
    }

    /// Returns the point at coordinates 0..1 along the edges.
    #[inline]
    pub fn point(&self, [u, v]: [f64; 2]) -> DVec3 {
        self.corner + self.edge_u * u + self.edge_v * v
    }

    /// Returns the edges from the corner at coordinates 0.
    pub fn edges(&self) -> [DVec3; 2] {
        [self.edge_u, self.edge_v]
    }

    /// Moves a point near the rectangle exactly onto its plane where that is normal to an axis: a grid may lie in it.
    pub fn onto_plane(&self, mut point: DVec3) -> DVec3 {
        for axis in (0..3).filter(|axis| self.normal[*axis].abs() == 1.0) {
            point[axis] = self.corner[axis];
        }
        point
    }

    /// Returns the corners, counter-clockwise seen from the side that emits.
    pub fn corners(&self) -> [DVec3; 4] {
        [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|point| self.point(point))
    }

    /// Returns the distance in m of a point on the side that emits to the nearest part of the rectangle that is higher than the point;
    /// infinite on the dark side, and where no part is higher.
    pub fn horizontal_distance(&self, point: DVec3) -> f64 {
        self.distance_of_part_above(point, point.z)
    }

    /// True if a point on the side that emits is nearer than `reach` metres to the rectangle.
    pub fn is_within(&self, reach: f64, point: DVec3) -> bool {
        // most points are farther from its plane
        (point - self.corner).dot(self.normal) < reach && self.distance_of_part_above(point, f64::NEG_INFINITY) < reach
    }

    fn distance_of_part_above(&self, point: DVec3, height: f64) -> f64 {
        if (point - self.corner).dot(self.normal) <= 0.0 {
            return f64::INFINITY;
        }
        let [a, b, c, d] = self.corners();
        let halves = [[a, b, c], [a, c, d]];
        halves.iter().filter_map(|half| distance_above(half, point, height)).fold(f64::INFINITY, f64::min)
    }

    /// Returns the longer edge in m.
    pub fn longer_edge_m(&self) -> f64 {
        let [a, b, _, d] = self.corners();
        (b - a).length().max((d - a).length())
    }

    /// Finds the distance, in lengths of `direction`, at which a ray crosses the rectangle's plane inside its outline.
    #[inline]
    pub fn intersect(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let approach = direction.dot(self.normal);
        if approach == 0.0 {
            return None;
        }
        let distance = (self.corner - origin).dot(self.normal) / approach;
        let relative = origin + direction * distance - self.corner;
        let place = DVec2::new(relative.dot(self.to_u), relative.dot(self.to_v));
        (place.cmpge(DVec2::ZERO).all() && place.cmple(DVec2::ONE).all()).then_some(distance)
    }

    /// Returns the luminance in cd/m2 seen along `direction`, which meets the rectangle: zero on the dark side.
    #[inline]
    pub fn seen<const C: usize>(&self, direction: DVec3) -> Spectrum<C> {
        if direction.dot(self.normal) < 0.0 { Spectrum::from_rgb(self.luminance) } else { Spectrum::ZERO }
    }

    /// Computes the unoccluded irradiance in lux at a point of a surface with unit `normal`: Lambert's closed form.
    #[inline]
    pub fn irradiance<const C: usize>(&self, position: DVec3, normal: DVec3) -> Spectrum<C> {
        if (position - self.corner).dot(self.normal) <= 0.0 {
            return Spectrum::ZERO;
        }
        let [a, b, c, d] = self.corners();
        let per_luminance = quadrilateral_irradiance(&[a, d, c, b], position, normal).max(0.0);
        Spectrum::from_rgb(self.luminance) * per_luminance
    }

    /// Computes the irradiance in lux as if the whole rectangle were at its point `source`, L cos(theta) cos(theta') A / d^2: the mean
    /// over evenly distributed points is the irradiance without occlusion.
    #[inline]
    pub fn connection<const C: usize>(&self, source: DVec3, position: DVec3, normal: DVec3) -> Spectrum<C> {
        let to_light = source - position;
        let (arriving, outgoing) = (to_light.dot(normal), -to_light.dot(self.normal));
        if arriving <= 0.0 || outgoing <= 0.0 {
            return Spectrum::ZERO;
        }
        let distance_squared = to_light.length_squared();
        let geometry = arriving * outgoing / (distance_squared * distance_squared) * self.area_m2;
        Spectrum::from_rgb(self.luminance) * geometry
    }

    /// Computes the emitted flux in lm: pi A L.
    pub fn flux<const C: usize>(&self) -> Spectrum<C> {
        Spectrum::from_rgb(self.luminance) * (PI * self.area_m2)
    }
}

/// Returns a unit vector along an axis without the rounding of its length, so that planes that coincide give equal distances; other
/// vectors stay.
fn axis_or(unit: DVec3) -> DVec3 {
    let axis = (0..3).find(|axis| (0..3).all(|other| other == *axis || unit[other] == 0.0));
    axis.map_or(unit, |axis| DVec3::AXES[axis] * unit[axis].signum())
}
