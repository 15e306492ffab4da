//! Tubes as rays meet them: the opening, its closure and the guide behind it.

use std::f64::consts::PI;

use glam::DVec3;

use crate::geometry::turn::unit_vector;
use crate::guide::{BentGuide, DomedGuide, Guide, MeshGuide, MeshGuideError, Section, StraightGuide, dome::PipeBelow};
use crate::optics::{Closure, Collector, Diffuser};
use crate::sampling::NestedCones;
use crate::scene::{Enclosure, MeshTube, StraightOrBent, Tube, TubeShape};
use crate::sky::direction;

/// A tube with its guide built, in the room's frame.
#[derive(Clone, Debug)]
pub struct TraceableTube {
    /// Number of the face of the room that the tube comes through.
    pub face: usize,
    /// True if the opening hangs below that face.
    pub hangs: bool,
    /// Centre of the opening, in m.
    pub origin: DVec3,
    /// Radius of the opening in m.
    pub opening_radius: f64,
    /// Guide between the opening and the collector, in the tube's own frame.
    pub guide: Guide,
    /// Shape recognised in a mesh; `None` for tubes that are no meshes.
    pub section: Option<Section>,
    /// Cones about the axis from which nearly all light comes that passes the guide; `None` for guides that pass light from more
    /// directions.
    pub cones: Option<NestedCones>,
    /// The closure in the opening.
    pub diffuser: Diffuser,
    /// False where neither sky nor sun shine on the collector.
    pub daylit: bool,
}

impl TraceableTube {
    /// Returns the area of the opening in m2.
    #[inline]
    pub fn opening_area_m2(&self) -> f64 {
        PI * self.opening_radius * self.opening_radius
    }

    pub(super) fn new(tube: &Tube, enclosure: &Enclosure) -> Result<Self, MeshGuideError> {
        let guide = match &tube.shape {
            TubeShape::Cylinders(description) => cylinder_guide(description, tube.opening_radius),
            TubeShape::Mesh(description) => match &description.section {
                Section::Cylinder(cylinder) => Guide::Straight(StraightGuide {
                    radius: cylinder.radius,
                    length: cylinder.length,
                    reflectance: cylinder.reflectance.clone(),
                    collector_transmittance: cylinder.collector_transmittance,
                }),
                Section::Bend(bend) => {
                    let turn = unit_vector(-description.rotation);
                    let turned = |axis: DVec3| turn.rotate(axis.truncate()).extend(axis.z);
                    let segments: Vec<_> =
                        bend.segments.iter().map(|(length, axis)| (*length, turned(*axis))).collect();
                    let (reflectance, cover) = (bend.reflectance.clone(), bend.collector_transmittance);
                    Guide::Bent(BentGuide::new(bend.radius, &segments, reflectance, cover))
                }
                Section::Facets { .. } => Guide::Mesh(mesh(description, tube.opening_radius)?),
            },
        };
        let section = match &tube.shape {
            TubeShape::Cylinders(_) => None,
            TubeShape::Mesh(description) => Some(description.section.clone()),
        };
        let cones = guide.cones();
        Ok(Self {
            face: tube.face,
            hangs: tube.drop_m > 0.0,
            origin: tube.centre.extend(enclosure.height_at(tube.face, tube.centre) - tube.drop_m),
            opening_radius: tube.opening_radius,
            guide,
            cones,
            section,
            diffuser: tube.diffuser.clone(),
            daylit: true,
        })
    }

    /// Returns the distance in m of a point to the nearest point of the opening.
    #[inline]
    pub fn distance_to_opening(&self, point: DVec3) -> f64 {
        let away = point - self.origin;
        libm::hypot((away.truncate().length() - self.opening_radius).max(0.0), away.z)
    }

    /// True if a point of the opening's plane is in the opening.
    #[inline]
    pub fn has(&self, point: DVec3) -> bool {
        (point - self.origin).truncate().length_squared() < self.opening_radius * self.opening_radius
    }

    /// Returns the closure at a point of the opening.
    #[inline]
    pub fn closure_at(&self, position: DVec3) -> Closure<'_> {
        self.diffuser.at((position - self.origin).truncate().length())
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
    if tube.segments.iter().all(|segment| segment.tilt == 0.0) {
        let length = tube.segments.iter().map(|segment| segment.length_m).sum();
        return PipeBelow::Straight(StraightGuide { radius, length, reflectance, collector_transmittance });
    }
    let axis = |tilt: f64, azimuth: f64| direction(std::f64::consts::FRAC_PI_2 - tilt, azimuth);
    let segments: Vec<_> =
        tube.segments.iter().map(|segment| (segment.length_m, axis(segment.tilt, segment.azimuth))).collect();
    PipeBelow::Bent(BentGuide::new(radius, &segments, reflectance, collector_transmittance))
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
#[error("tube {tube}: {error}")]
pub struct TubeError {
    /// Number of the tube in the scene.
    pub tube: usize,
    /// Reason why its mesh forms no guide.
    pub error: MeshGuideError,
}
