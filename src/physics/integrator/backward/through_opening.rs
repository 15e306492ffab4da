//! Light straight through the clear zone of one opening, followed backward from a point: up the guide to the sky, and by the arcs that show
//! the sun.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use crate::guide::sun_arcs::{PointBelow, STEPS};
use crate::guide::sun_disc::{SunDisc, SunNode};
use crate::guide::{End, Guide, RayCount, Transit};
use crate::integrator::photon::nearness::is_near_opening;
use crate::optics::Spectrum;
use crate::sampling::{PathRandom, warp};
use crate::sky::Sun;
use crate::sky::sun::HALF_ANGLE;
use crate::traceable::{SurfacePoint, TraceableScene, TraceableTube, opening_weight};

/// Choice of the point of an opening through which a ray goes to the sky.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Choice {
    /// Uniform point of the clear zone, beside no other kind of choice.
    Alone,
    /// Uniform point of the clear zone; as many rays have cosine-distributed directions.
    OfZone,
    /// Point in a cosine-distributed direction; as many rays have uniform points.
    ByCosine,
}

/// Light that reaches a point unscattered through one tube, followed backward.
#[derive(Clone, Copy)]
pub(super) struct Backward<'a> {
    scene: &'a TraceableScene,
    pub tube: &'a TraceableTube,
    pub at: SurfacePoint,
    /// Inner and outer radius of the diffuser's clear zone in m.
    zone: (f64, f64),
}

impl<'a> Backward<'a> {
    /// Returns the light of a tube's clear zone at a point; `None` without a clear zone, and behind its plane.
    pub fn new(scene: &'a TraceableScene, tube: &'a TraceableTube, at: SurfacePoint) -> Option<Self> {
        let zone = tube.specular_zone().filter(|_| tube.frame.depth(at.position) > 0.0)?;
        Some(Self { scene, tube, at, zone })
    }

    /// Estimates the relative contribution of a uniformly bright opening to the point: more than 0 wherever it sends any light.
    pub fn weight(&self) -> f64 {
        opening_weight(&self.tube.frame, self.zone.1, self.at.position, self.at.normal) * self.zone.1 * self.zone.1
    }

    /// True if the point is so near to the opening that the important rays through uniform points of it are rare and bright.
    pub fn is_near(&self) -> bool {
        is_near_opening(self.scene, self.tube, self.at.position)
    }

    /// False where light of the sun's zenith angles cannot come from the clear zone of an upright tube to the point.
    pub fn may_show(&self, sun: &Sun) -> bool {
        let below = self.at.position - self.tube.frame.origin;
        let (depth, distance) = (-below.z, below.truncate().length());
        let (level, rise, half) = (sun.direction.truncate().length(), sun.direction.z, HALF_ANGLE);
        let [low, high] =
            [(level - rise * half) / (rise + level * half), (level + rise * half) / (rise - level * half)];
        let reaches_beyond = high <= 0.0 || depth * high >= distance - self.zone.1;
        reaches_beyond && depth * low <= distance + self.zone.1
    }

    /// Follows a ray through a chosen point of the clear zone: returns the light that the sky sends by it per luminance, where all rays
    /// are of this kind or equally many of both, and the direction outside.
    pub fn ray<const C: usize>(
        &self,
        kind: Choice,
        uniform: [f64; 2],
        response: &impl Fn(DVec3) -> Spectrum<C>,
        random: &mut PathRandom,
        rays: &mut RayCount,
    ) -> Option<(Spectrum<C>, DVec3)> {
        let (inner, outer) = self.zone;
        let area = PI * (outer * outer - inner * inner);
        let point = match kind {
            Choice::ByCosine => self.point_by_cosine(uniform)?,
            Choice::Alone | Choice::OfZone => self.tube.at(warp::annulus(uniform, inner, outer)),
        };
        // combined density of both kinds of rays, relative to uniform points of the zone
        let fraction = match kind {
            Choice::Alone => 1.0,
            Choice::OfZone | Choice::ByCosine => 2.0 / (1.0 + self.cosine_density(point) * area),
        };
        let (weight, toward) = self.through(point, response, random, rays)?;
        Some((weight * (fraction * area), toward))
    }

    /// Returns the point of the clear zone in a cosine-distributed direction, if this meets the zone.
    fn point_by_cosine(&self, uniform: [f64; 2]) -> Option<DVec3> {
        let direction = warp::around(self.at.normal, warp::cosine_hemisphere(uniform));
        let frame = &self.tube.frame;
        let rise = frame.up(direction);
        if rise <= 0.0 {
            return None;
        }
        let point = frame.onto(self.at.position + direction * (frame.depth(self.at.position) / rise));
        let radius = self.tube.away(point).length();
        (self.zone.0..self.zone.1).contains(&radius).then_some(point)
    }

    /// Returns the density per m2 of points in cosine-distributed directions.
    fn cosine_density(&self, point: DVec3) -> f64 {
        let to_point = point - self.at.position;
        let squared = to_point.length_squared();
        to_point.dot(self.at.normal).max(0.0) * self.tube.frame.up(to_point) / (PI * squared * squared)
    }

    /// Computes the sunlight through a straight pipe, by the arcs of the opening in which the disc is visible, at `nodes` zenith angles of
    /// it, which the `uniform` numbers choose.
    pub fn sun<const C: usize>(
        &self,
        sun: &Sun,
        response: &impl Fn(DVec3) -> Spectrum<C>,
        nodes: usize,
        [node, step]: [f64; 2],
    ) -> (Spectrum<C>, RayCount) {
        let Some(point) = self.below() else { return (Spectrum::ZERO, RayCount::default()) };
        let arrives = |offset, direction| self.arrives(offset, direction, response);
        let found = point.sunlight(sun, (nodes, node), (STEPS, 1.0 - step), arrives);
        (found.illuminance, RayCount { followed: found.rays, ..RayCount::default() })
    }

    /// Returns the part of the sun's disc whose zenith angles light from the clear zone of a straight pipe to the point may have.
    pub fn disc(&self, sun: &Sun) -> Option<SunDisc> {
        SunDisc::within(sun, self.below()?.zenith_angles())
    }

    /// Computes the sunlight of one zenith angle through a straight pipe; `step`, in 0..1, is the position of the steps along its arc.
    pub fn sun_of_node<const C: usize>(
        &self,
        sun: &Sun,
        response: &impl Fn(DVec3) -> Spectrum<C>,
        node: SunNode,
        step: f64,
    ) -> Spectrum<C> {
        let arrives = |offset, direction| self.arrives(offset, direction, response);
        let found = |point: PointBelow| point.of_node(sun, node, (STEPS, 1.0 - step), arrives).illuminance;
        self.below().map_or(Spectrum::ZERO, found)
    }

    /// Returns the point below a straight pipe; `None` below others.
    fn below(&self) -> Option<PointBelow<'a>> {
        let Guide::Straight(guide) = &self.tube.guide else { return None };
        let below = self.at.position - self.tube.frame.origin;
        Some(PointBelow { guide, zone: self.zone, depth: -below.z, foot: below.truncate() })
    }

    /// Returns the factor on light through a place of the opening, given from its centre, that comes along a unit vector up from the point:
    /// 0 where something hides the place.
    fn arrives<const C: usize>(
        &self,
        offset: DVec2,
        direction: DVec3,
        response: &impl Fn(DVec3) -> Spectrum<C>,
    ) -> Spectrum<C> {
        let (place, answer) = (self.tube.at(offset), response(direction));
        let SurfacePoint { position, surface, .. } = self.at;
        match self.tube.closure_at(place).unscattered::<C>() {
            Some(transmittance) if answer.max() > 0.0 && self.scene.visible(place, None, position, surface) => {
                answer * transmittance
            }
            _ => Spectrum::ZERO,
        }
    }

    /// Follows a ray through `point` of the opening: returns response times geometry factor times transmittances, and the direction
    /// outside.
    fn through<const C: usize>(
        &self,
        point: DVec3,
        response: &impl Fn(DVec3) -> Spectrum<C>,
        random: &mut PathRandom,
        rays: &mut RayCount,
    ) -> Option<(Spectrum<C>, DVec3)> {
        let transmittance: Spectrum<C> = self.tube.closure_at(point).unscattered()?;
        let to_point = point - self.at.position;
        let distance_squared = to_point.length_squared();
        let direction = to_point / distance_squared.sqrt();
        if !self.scene.visible(point, None, self.at.position, self.at.surface) {
            return None;
        }
        let transit: Transit<C> = self.tube.up(point, direction, random);
        *rays += 1;
        *rays += transit.ray_count();
        if transit.end != End::Top {
            return None;
        }
        let weight = transit.weight() * transmittance * response(direction);
        Some((weight * (self.tube.frame.up(direction) / distance_squared), transit.direction))
    }
}
