//! Tubes as rays meet them: the opening, its closure and the guide behind it.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec2, DVec3};

use crate::geometry::OpeningFrame;
use crate::geometry::turn::unit_vector;
use crate::guide::{
    BentGuide, DomedGuide, End, Guide, MeshGuide, MeshGuideError, Section, StraightGuide, Transit, dome::PipeBelow,
};
use crate::optics::{Closure, Collector, Diffuser};
use crate::sampling::{NestedCones, PathRandom, warp};
use crate::scene::{Daylight, Enclosure, MeshTube, OpeningShape, StraightOrBent, Tube, TubeShape};
use crate::sky::{OutsidePart, Sky, Sun, Surroundings};

/// A tube with its guide built, in the room's frame.
#[derive(Clone, Debug)]
pub struct TraceableTube {
    /// Number of the face of the room that the tube comes through.
    pub face: usize,
    /// True if the opening hangs below that face.
    pub hangs: bool,
    /// Centre of the opening, and its plane.
    pub frame: OpeningFrame,
    /// Shape of the opening.
    pub opening: OpeningShape,
    /// Radius in m of the guide's lower end.
    pub pipe_radius: f64,
    /// Fraction of the light from the guide that arrives at the opening: below 1 where a transition between the two absorbs some.
    pub transition_transmittance: f64,
    /// Guide between the opening and the collector; its frame has its origin in the centre of the opening, and axes along those of the room.
    pub guide: Guide,
    /// Shape recognised in a mesh; `None` for tubes that are no meshes.
    pub section: Option<Section>,
    /// Cones about the axis from which nearly all light comes that passes the guide; `None` for guides that pass light from more
    /// directions.
    pub cones: Option<NestedCones>,
    /// The closure in the opening.
    pub diffuser: Diffuser,
    /// Surroundings of the upper end, followed or not.
    pub surroundings: Option<Arc<Surroundings>>,
    /// Sky and surroundings before the collector; `None` where no light of them is followed.
    pub sky: Option<Sky>,
    /// Sun before the collector; `None` where no beam is followed or the horizon covers it.
    pub sun: Option<Sun>,
}

impl TraceableTube {
    /// Returns the part of the outside that is seen toward a unit vector, and its relative luminance as in [`Surroundings::share`]; `None`
    /// below the horizontal without surroundings.
    pub fn outside(&self, toward: DVec3) -> Option<(OutsidePart, f64)> {
        let Some(surroundings) = &self.surroundings else {
            return (toward.z >= 0.0).then_some((OutsidePart::Sky, 1.0));
        };
        let part = surroundings.part(toward);
        Some((part, surroundings.share(part)))
    }

    /// Returns a sun as the upper end sees it; `None` where the horizon covers it.
    pub fn before(&self, sun: Sun) -> Option<Sun> {
        self.surroundings.as_ref().map_or(Some(sun), |surroundings| surroundings.dimmed(sun))
    }

    /// Returns the area in m2 of the guide's lower end.
    pub fn pipe_area_m2(&self) -> f64 {
        PI * self.pipe_radius * self.pipe_radius
    }

    /// Returns the inner and outer radius (m) of the zone of the closure through which light passes without scattering, if there is one.
    #[inline]
    pub fn specular_zone(&self) -> Option<(f64, f64)> {
        self.diffuser.specular_zone(self.opening.outer_radius())
    }

    /// Returns the inner and outer radius (m) of the zone of the closure that passes light as a Lambertian sheet, or in part so, if there
    /// is one; of a square it is all.
    pub fn even_zone(&self) -> Option<(f64, f64)> {
        self.diffuser.even_zone(self.opening.outer_radius())
    }

    /// True if a part of the closure scatters.
    pub fn scatters(&self) -> bool {
        self.diffuser.scatters(self.opening.outer_radius())
    }

    /// Returns a point of the opening in m; uniform numbers in 0..1 give uniform points.
    #[inline]
    pub fn point(&self, numbers: [f64; 2]) -> DVec3 {
        self.at(self.opening.point(numbers))
    }

    /// Returns the point of the opening's plane at `away` m from its centre, along x and y of its levelled frame.
    #[inline]
    pub fn at(&self, away: DVec2) -> DVec3 {
        self.frame.origin + self.frame.direction_in_room(away.extend(0.0))
    }

    /// Returns the place of a point of the opening's plane, in m from its centre along x and y of its levelled frame.
    #[inline]
    pub fn away(&self, point: DVec3) -> DVec2 {
        self.frame.levelled_direction(point - self.frame.origin).truncate()
    }

    /// Returns the corners of a square opening, counter-clockwise seen from above; `None` for a disc.
    pub fn corners(&self) -> Option<[DVec3; 4]> {
        Some(self.opening.corners()?.map(|corner| self.at(corner)))
    }

    /// Returns a corner of the rectangle around the opening in m, and the edges from there.
    pub fn rectangle(&self) -> [DVec3; 3] {
        let around =
            |radius: f64| [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|at| radius * DVec2::from(at));
        let corners = self.opening.corners().unwrap_or_else(|| around(self.opening.outer_radius()));
        let [corner, u, _, v] = corners.map(|corner| self.at(corner));
        [corner, u - corner, v - corner]
    }

    /// Follows light from the collector down to the opening; positions are in the tube's frame.
    #[inline]
    pub fn down<const C: usize>(&self, position: DVec3, direction: DVec3, random: &mut PathRandom) -> Transit<C> {
        self.spread(self.guide.down(position, direction, random), random)
    }

    /// Follows light that went down the guide through the transition, if there is one, which spreads it evenly over the opening.
    #[inline]
    fn spread<const C: usize>(&self, mut transit: Transit<C>, random: &mut PathRandom) -> Transit<C> {
        if self.opening.disc().is_none() && transit.end == End::Opening {
            transit.position = self.frame.direction_in_room(self.opening.point(random.uniform2()).extend(0.0));
            transit.mirrors = transit.mirrors * self.transition_transmittance;
        }
        transit
    }

    /// Follows light upward from a point of the opening in the room's frame.
    ///
    /// By reciprocity a transition sends up the fraction of light that it sends down, times the area of the guide over that of the opening
    /// (docs/physics/tubes.md#square-closures); the rest is absorbed in it.
    #[inline]
    pub fn up<const C: usize>(&self, position: DVec3, direction: DVec3, random: &mut PathRandom) -> Transit<C> {
        if self.opening.disc().is_some() {
            return self.guide.up(position - self.frame.origin, direction, random);
        }
        let place = self.frame.direction_in_room((warp::disc(random.uniform2()) * self.pipe_radius).extend(0.0));
        let mut transit: Transit<C> = self.guide.up(place, direction, random);
        let fraction = self.transition_transmittance * self.pipe_area_m2() / self.opening.area_m2();
        transit.mirrors = transit.mirrors * fraction;
        self.spread(transit, random)
    }

    /// True if light of sky or sun is followed through the collector.
    #[inline]
    pub fn is_daylit(&self) -> bool {
        self.sky.is_some() || self.sun.is_some()
    }

    pub(super) fn new(tube: &Tube, enclosure: &Enclosure, daylight: Option<&Daylight>) -> Result<Self, MeshGuideError> {
        let frame = tube.frame(enclosure);
        let guide = match &tube.shape {
            TubeShape::Cylinders(description) => cylinder_guide(description, tube.opening_radius),
            TubeShape::Mesh(description) => match &description.section {
                Section::Cylinder(cylinder) => {
                    let (radius, length) = (cylinder.radius, cylinder.length);
                    let (reflectance, cover) = (cylinder.reflectance.clone(), cylinder.collector_transmittance);
                    match frame.is_level() {
                        true => Guide::Straight(StraightGuide {
                            radius,
                            length,
                            reflectance,
                            collector_transmittance: cover,
                        }),
                        false => Guide::Bent(BentGuide::new(radius, &[(length, frame.outward())], reflectance, cover)),
                    }
                }
                Section::Bend(bend) => {
                    let turn = unit_vector(-description.rotation);
                    let turned = |axis: DVec3| frame.direction_in_room(turn.rotate(axis.truncate()).extend(axis.z));
                    let segments: Vec<_> =
                        bend.segments.iter().map(|(length, axis)| (*length, turned(*axis))).collect();
                    let (reflectance, cover) = (bend.reflectance.clone(), bend.collector_transmittance);
                    Guide::Bent(BentGuide::new(bend.radius, &segments, reflectance, cover))
                }
                Section::Facets { .. } => {
                    Guide::Mesh(mesh(description, tube.opening_radius)?.turned(frame.turn().copied()))
                }
            },
        };
        let section = match &tube.shape {
            TubeShape::Cylinders(_) => None,
            TubeShape::Mesh(description) => Some(description.section.clone()),
        };
        let cones = guide.cones();
        let (sky, sun) = daylight.map_or((None, None), |daylight| daylight.before(tube));
        Ok(Self {
            face: tube.face,
            hangs: tube.hangs(),
            frame,
            opening: tube.opening(),
            pipe_radius: tube.opening_radius,
            transition_transmittance: tube.transition.map_or(1.0, |transition| transition.transmittance),
            guide,
            cones,
            section,
            diffuser: tube.diffuser.clone(),
            surroundings: tube.surroundings.clone(),
            sky,
            sun,
        })
    }

    /// Returns the distance in m of a point to the nearest point of the opening.
    #[inline]
    pub fn distance_to_opening(&self, point: DVec3) -> f64 {
        let away = self.frame.levelled_direction(point - self.frame.origin);
        libm::hypot(self.opening.distance(away.truncate()), away.z)
    }

    /// True if a point of the opening's plane is in the opening.
    #[inline]
    pub fn has(&self, point: DVec3) -> bool {
        self.opening.contains(self.away(point))
    }

    /// Returns the closure at a point of the opening.
    #[inline]
    pub fn closure_at(&self, position: DVec3) -> Closure<'_> {
        self.diffuser.at(self.away(position).length()).turned(self.frame.turn())
    }
}

/// Builds the guide of cylinders of `radius` in m.
pub fn cylinder_guide(tube: &StraightOrBent, radius: f64) -> Guide {
    let pipe = pipe(tube, radius);
    if let Collector::DielectricDome { refractive_index, thickness_m, absorption_per_m } = tube.collector {
        return Guide::Domed(Box::new(DomedGuide::new(pipe, refractive_index, thickness_m, absorption_per_m)));
    }
    match pipe {
        PipeBelow::Straight(guide) => Guide::Straight(guide),
        PipeBelow::Bent(guide) => Guide::Bent(guide),
    }
}

fn pipe(tube: &StraightOrBent, radius: f64) -> PipeBelow {
    let reflectance = tube.reflectance.clone();
    let collector_transmittance = tube.collector.transmittance();
    if tube.is_straight() {
        let length = tube.segments.iter().map(|segment| segment.length_m).sum();
        return PipeBelow::Straight(StraightGuide { radius, length, reflectance, collector_transmittance });
    }
    let segments: Vec<_> = tube.segments.iter().map(|segment| (segment.length_m, segment.axis())).collect();
    let guide = BentGuide::new(radius, &segments, reflectance, collector_transmittance);
    PipeBelow::Bent(match tube.cut {
        Some(normal) => guide.cut(normal),
        None => guide,
    })
}

fn mesh(tube: &MeshTube, opening_radius: f64) -> Result<MeshGuide, MeshGuideError> {
    let mut mesh = tube.mesh.as_ref().clone();
    let turn = unit_vector(-tube.rotation);
    for position in &mut mesh.positions {
        *position = turn.rotate(position.truncate()).extend(position.z);
    }
    MeshGuide::new(&mesh, &tube.parts, opening_radius)
}

/// A tube whose guide cannot be built.
#[derive(Clone, Debug, thiserror::Error)]
#[error("tube {}: {error}", .tube + 1)]
pub struct TubeError {
    /// Number of the tube in the scene, from 0.
    pub tube: usize,
    /// Reason why its mesh forms no guide.
    pub error: MeshGuideError,
}
