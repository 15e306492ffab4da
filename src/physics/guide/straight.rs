//! Straight tubes in closed form.

use std::f64::consts::PI;

use glam::DVec3;

use super::transit::{End, Entry, Transit};
use crate::geometry::cylinder::{cosine_of_incidence, traverse};
use crate::optics::{Mirror, Spectrum};
use crate::sampling::warp;

/// A vertical mirror cylinder from z = 0 to z = `length`.
#[derive(Clone, Debug, PartialEq)]
pub struct StraightGuide {
    /// Radius in m.
    pub radius: f64,
    /// Length in m, > 0.
    pub length: f64,
    /// Reflectance of the wall, per bounce.
    pub reflectance: Mirror,
    /// Transmittance of the collector at every angle, linear Rec.709, 0..=1.
    pub collector_transmittance: [f64; 3],
}

impl StraightGuide {
    /// Returns the half-angle in radians of the cone about the axis from which nearly all light comes that passes the guide; `None` for a
    /// perfect mirror.
    ///
    /// A black guide passes only light within an angle of tangent D / L; at k times that tangent the throughput is R^k: 98 % of the light
    /// of a uniform sky lies within a tangent of (1 + 5 / ln(1/R)) D / L.
    pub fn cone(&self) -> Option<f64> {
        let decades = -libm::log(self.reflectance.brightest());
        (decades > 0.0).then(|| libm::atan((1.0 + 5.0 / decades) * 2.0 * self.radius / self.length))
    }

    #[inline]
    pub(super) fn entry(&self, point: [f64; 2], direction: DVec3) -> Option<Entry> {
        let cosine = -direction.z;
        (cosine > 0.0).then(|| Entry {
            position: (warp::disc(point) * self.radius).extend(self.length),
            projected_area_m2: PI * self.radius * self.radius * cosine,
        })
    }

    #[inline]
    pub(super) fn down<const C: usize>(&self, position: DVec3, direction: DVec3) -> Transit<C> {
        self.pass(position, direction, End::Opening)
    }

    #[inline]
    pub(super) fn up<const C: usize>(&self, position: DVec3, direction: DVec3) -> Transit<C> {
        self.pass(position, direction, End::Top)
    }

    #[inline]
    fn pass<const C: usize>(&self, position: DVec3, direction: DVec3, end: End) -> Transit<C> {
        if direction.z == 0.0 {
            let lost = Spectrum::ZERO;
            let collector = Spectrum::from_rgb(self.collector_transmittance);
            return Transit { end: End::Lost, position, direction, collector, mirrors: lost, entered: true, rays: 1 };
        }
        let passage = traverse(self.radius, position, direction, self.length);
        Transit {
            end,
            position: passage.position,
            direction: passage.direction,
            collector: Spectrum::from_rgb(self.collector_transmittance),
            mirrors: self.reflectance.power(|| cosine_of_incidence(self.radius, position, direction), passage.bounces),
            entered: true,
            rays: 1,
        }
    }
}
