//! Paths between the faces of an empty room whose surfaces are all diffuse: what the general walk does there, without asking at
//! each vertex what it could be, in half the time.

use std::f64::consts::PI;

use glam::DVec3;

use super::cells::TubeLight;
use crate::integrator::backward::next_event::Way;
use crate::integrator::backward::walk::{Ray, Walk};
use crate::integrator::roulette::MAX_EVENTS;
use crate::optics::Spectrum;
use crate::sampling::warp;
use crate::scene::Face;
use crate::traceable::{SurfaceId, TraceableScene};

/// What faces reflect; `None` is open.
#[derive(Debug)]
pub struct BoxRoom<const C: usize>([Option<Spectrum<C>>; 6]);

impl<const C: usize> BoxRoom<C> {
    /// The faces of a room that has nothing else, and where all light is diffuse and followed; else `None`.
    pub fn of(scene: &TraceableScene) -> Option<Self> {
        let diffuse = |face: Face| scene.optics(SurfaceId::of_face(face)).map(|optics| optics.diffuse());
        scene.is_plain().then(|| Self(Face::ALL.map(diffuse)))
    }

    /// Follows a ray whose path began with weight `first` from face to face and counts the light of `tubes`; returns the ray
    /// that meets an opening, or a place so near to one that its light is not connected.
    pub fn follow(
        &self,
        tubes: &[TubeLight<C>],
        walk: &mut Walk<'_, C>,
        mut ray: Ray<C, Way>,
        first: f64,
    ) -> Option<Ray<C, Way>> {
        let scene = walk.scene;
        for _ in 0..MAX_EVENTS {
            let (axis, is_far, position) = scene.meet_face(ray.origin, ray.direction);
            let is_near_opening = |tube: &TubeLight<C>| !tube.is_far(position, 0.0);
            if (axis == 2 && is_far && scene.opening_at(position.truncate()).is_some())
                || tubes.iter().any(is_near_opening)
            {
                return Some(ray);
            }
            walk.rays += 1;
            let diffuse = self.0[2 * axis + usize::from(is_far)]?;
            walk.met += 1;
            // of the inward normal
            let sign = if is_far { -1.0 } else { 1.0 };
            let leaving = ray.weight * diffuse;
            for tube in tubes.iter().filter(|tube| tube.origin.z > position.z && !tube.choices.is_empty()) {
                let mut normal = DVec3::ZERO;
                normal[axis] = sign;
                let lux = tube.seen_by(walk.met, position, normal, walk.samples.random.uniform());
                walk.sum += leaving * lux * (1.0 / PI);
            }
            let survival = walk.survival(leaving.max(), ray.weight.max(), first)?;
            let [x, y, cosine] = warp::cosine_hemisphere(walk.samples.pair()).to_array();
            // what `warp::around` does with the normal of a face
            ray.direction = match axis {
                0 => DVec3::new(sign * cosine, y, -sign * x),
                1 => DVec3::new(x, sign * cosine, -sign * y),
                _ => DVec3::new(x, sign * y, sign * cosine),
            };
            ray.weight = leaving * (1.0 / survival);
            (ray.origin, ray.from) = (position, Some(SurfaceId::of_face(Face::ALL[2 * axis + usize::from(is_far)])));
            (ray.reflected, ray.trace) = (true, Way::of_diffuse(position, cosine / PI));
            if cosine <= 0.0 || ray.weight.max() <= 0.0 {
                return None;
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use glam::DVec2;

    use super::*;
    use crate::integrator::backward::next_event::{Daylight, NextEvent};
    use crate::integrator::backward::vertex::Vertex;
    use crate::integrator::lamp::light::DiffuserLight;
    use crate::integrator::photon::emission::Emission;
    use crate::optics::{Collector, Diffuser, Surface};
    use crate::sampling::{Key, PathSamples, Stream};
    use crate::scene::{self, Channels, Room, Scene, Segment, StraightOrBent, Tube, TubeShape};
    use crate::sky::zenith::ZenithFormula;
    use crate::sky::{CieType, Sky, SkyDistribution, direction};
    use crate::traceable::Follow;

    /// The same light for a walk that never hurries.
    struct Slowly<'a>(&'a DiffuserLight<3>);

    impl Daylight<3> for Slowly<'_> {
        fn connect(&self, walk: &mut Walk<'_, 3>, vertex: &Vertex<'_, 3>, tube: usize) {
            self.0.connect(walk, vertex, tube);
        }

        fn found_share(&self, scene: &TraceableScene, tube: usize, way: &Way, position: DVec3) -> Option<f64> {
            self.0.found_share(scene, tube, way, position)
        }
    }

    /// Two tubes, one beside a wall, whose closures reflect, over a room of coloured faces of which one is open.
    fn scene() -> Scene {
        let tube = |x: f64| Tube {
            centre: DVec2::new(x, 1.1),
            opening_radius: 0.15,
            shape: TubeShape::Cylinders(StraightOrBent {
                reflectance: [0.95; 3].into(),
                segments: vec![Segment { length_m: 0.8, tilt: 0.0, azimuth: 0.0 }],
                collector: Collector::Open,
            }),
            diffuser: Diffuser::Lambertian { transmittance: [0.5, 0.4, 0.3], reflectance: [0.3; 3] },
        };
        let distribution = SkyDistribution::new(CieType::new(12).unwrap(), direction(0.6, 2.0));
        let sky = Some(Sky { distribution, zenith_luminance_cd_m2: 4000.0 });
        let surfaces = [0.5, 0.4, 0.6, 0.3, 0.2, 0.8].map(|red| Some(Surface::diffuse([red, 0.5, 0.9])));
        Scene {
            daylight: Some(scene::Daylight { sky, sun: None, formula: ZenithFormula::GivenZenithLuminance }),
            room: Room {
                size: DVec3::new(3.0, 2.2, 2.5),
                surfaces: [surfaces[0], surfaces[1], None, surfaces[3], surfaces[4], surfaces[5]],
                boxes: Vec::new(),
                meshes: Vec::new(),
                luminaires: Vec::new(),
            },
            tubes: vec![tube(0.2), tube(1.9)],
            grids: Vec::new(),
            views: Vec::new(),
            channels: Channels::Rgb,
        }
    }

    /// Every path finds what the general walk finds, to the bit: past openings, beside them, and out of the open face.
    #[test]
    fn paths_are_those_of_the_walk() {
        let follow = Follow { interreflection: true, guide_return: true, objects: true };
        let traceable = TraceableScene::new(&scene(), follow).unwrap();
        let emission = Emission::of_daylight(&traceable, 512);
        let pass = Key::new(3);
        let (light, _) = DiffuserLight::<3>::trace(&traceable, &emission, pass, &AtomicBool::new(false)).unwrap();
        let (quick, slow) = (NextEvent(&light), Slowly(&light));
        let slow = NextEvent(&slow);
        let (mut lit, mut several) = (0, 0);
        for number in 0..4000 {
            let samples = || PathSamples::new(pass.stream(Stream::PlacedVertices, 0), number);
            let mut start = samples();
            let ([u, v], [s, t]) = (start.pair(), start.pair());
            let origin = DVec3::new(3.0 * u, 2.2 * v, 2.5 * s);
            let direction = warp::cone([t, start.random.uniform()], std::f64::consts::PI);
            let (weight, trace) = (Spectrum::ONE, Way::COUNTED);
            let ray = Ray { origin, direction, from: None, weight, reflected: true, trace };
            let mut walks = [0, 1].map(|_| Walk::<3>::new(&traceable, samples(), 3));
            walks[0].follow(&quick, ray);
            walks[1].follow(&slow, ray);
            let [quick, slow] = walks;
            assert_eq!(quick.sum, slow.sum, "{number}");
            assert_eq!((quick.rays, quick.met), (slow.rays, slow.met), "{number}");
            lit += u32::from(quick.sum.luminance() > 0.0);
            several += u32::from(quick.met > 3);
        }
        assert!(lit > 2000 && several > 500, "{lit} {several}");
    }
}
