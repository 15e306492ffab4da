//! Dielectric domes: hemispherical shells over the top of a straight or bent guide.
//!
//! See docs/physics/tubes.md#thin-covers-and-dielectric-domes.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

use super::bent::BentGuide;
use super::straight::StraightGuide;
use super::transit::{End, Entry, Transit};
use crate::optics::Spectrum;
use crate::optics::fresnel::{fresnel, refract};
use crate::sampling::{PathRandom, warp};

/// Largest number of ray segments of one path; longer paths are ended.
const MAX_STEPS: u32 = 100_000;

/// A shell between two concentric hemispheres that stands on the plane z = 0 of its own frame, in air.
///
/// Its faces reflect and refract by Fresnel; what reaches the rim, the ring in the plane z = 0, is absorbed. A ray stays in
/// its plane through the centre, so that light polarised across and along that plane never mixes: both are followed on
/// one path. Refractive index times distance from the centre times sine of the angle to the normal is the same all along
/// a path (Bouguer), and with it the reflectances of both faces and the chord between them.
#[derive(Clone, Debug, PartialEq)]
pub struct Dome {
    /// Radius of the inner face in metres.
    pub inner: f64,
    /// Radius of the outer face in metres, above that of the inner one.
    pub outer: f64,
    /// Refractive index of the shell, >= 1.
    pub index: f64,
    /// Napierian absorption coefficient in 1/m.
    pub absorption: f64,
}

/// A straight or bent guide under a dome of the guide's radius.
#[derive(Clone, Debug, PartialEq)]
pub struct DomedGuide {
    /// The guide below; its own collector passes everything.
    pub pipe: PipeBelow,
    /// The shell above the pipe's upper end.
    pub dome: Dome,
    /// The dome's frame: origin in the centre of the pipe's upper end, z along its axis.
    centre: DVec3,
    to_local: DMat3,
}

/// Guide that a dome stands on.
#[derive(Clone, Debug, PartialEq)]
pub enum PipeBelow {
    /// One vertical cylinder.
    Straight(StraightGuide),
    /// Cylinders with elbows; the dome leans with the last of them.
    Bent(BentGuide),
}

/// Place where light leaves a dome.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum DomeExit {
    /// Aperture in the plane z = 0, within the inner face, passed downward.
    Aperture,
    /// Outer face, passed outward.
    Outside,
    /// Rim, where the light is absorbed.
    Absorbed,
    Cut,
}

/// Passage of a ray through a dome, with the throughput.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    exit: DomeExit,
    position: DVec3,
    direction: DVec3,
    fraction: f64,
    rays: u32,
}

/// A ray in a dome with the quantities that are constant along its path.
struct DomeRay {
    position: DVec3,
    direction: DVec3,
    /// Throughputs of the s and p polarised light.
    shares: [f64; 2],
    /// Reflectances of the outer (`at_outer`) and the inner face for s and p.
    at_outer: [f64; 2],
    at_inner: [f64; 2],
    /// Length in m of the chord between the faces, and the transmittance along it (`passes`).
    chord: f64,
    passes: f64,
    rays: u32,
}

impl Dome {
    /// Follows light from outside that meets a point of the outer face.
    ///
    /// Light that the outer face reflects, from outside or within, leaves for good and is taken off the weight. Only at the inner face is a
    /// branch chosen, to pass or to go once more round the shell; the latter has the probability r^2, so that nearly every photon keeps the
    /// pane's transmittance (1 - r) / (1 + r).
    fn enter(&self, position: DVec3, direction: DVec3, random: &mut PathRandom) -> Crossing {
        let impact = position.cross(direction).length();
        if impact >= self.inner {
            // reflected by the outer face, or totally by the inner one, or past it: back outside or into the rim
            return Crossing { exit: DomeExit::Outside, position, direction, fraction: 0.0, rays: 1 };
        }
        let mut ray = self.ray(position, direction, impact);
        ray.pass(|ray, k| 1.0 - ray.at_outer[k], 1.0);
        ray.direction = refract(direction, position / self.outer, self.index);
        while ray.rays < MAX_STEPS {
            if !ray.cross(self.inner) {
                return ray.ends(DomeExit::Absorbed);
            }
            let once_more = ray.mean(|ray, k| ray.at_inner[k] * ray.at_outer[k] * ray.passes);
            if !ray.chooses(once_more, random) {
                ray.pass(|ray, k| 1.0 - ray.at_inner[k], 1.0 - once_more);
                ray.direction = refract(ray.direction, ray.position / self.inner, 1.0 / self.index);
                return self.inside(ray, random);
            }
            ray.pass(|ray, k| ray.at_inner[k] * ray.at_outer[k], once_more);
            ray.reflect();
            if !ray.cross(self.outer) {
                return ray.ends(DomeExit::Absorbed);
            }
            ray.reflect();
        }
        ray.ends(DomeExit::Cut)
    }

    /// Follows unpolarised light that comes up through the plane z = 0.
    fn leave(&self, position: DVec3, direction: DVec3, random: &mut PathRandom) -> Crossing {
        let impact = position.cross(direction).length().min(self.inner);
        self.inside(self.ray(position, direction, impact), random)
    }

    /// Follows a ray from within the inner face; one branch is chosen at every face.
    fn inside(&self, mut ray: DomeRay, random: &mut PathRandom) -> Crossing {
        while ray.rays < MAX_STEPS {
            ray.rays += 1;
            let along = ray.position.dot(ray.direction);
            let below = self.inner * self.inner - ray.position.length_squared();
            let to_face = (along * along + below).max(0.0).sqrt() - along;
            let falls = ray.direction.z < 0.0;
            let to_aperture = if falls { (-ray.position.z / ray.direction.z).max(0.0) } else { f64::INFINITY };
            if to_aperture <= to_face {
                ray.position += ray.direction * to_aperture;
                ray.position.z = 0.0;
                return ray.ends(DomeExit::Aperture);
            }
            ray.position = (ray.position + ray.direction * to_face).normalize() * self.inner;
            if ray.reflects(|ray, k| ray.at_inner[k], random) {
                ray.reflect();
                continue;
            }
            ray.direction = refract(ray.direction, -ray.position / self.inner, self.index);
            if let Some(end) = self.in_shell(&mut ray, random) {
                return end;
            }
        }
        ray.ends(DomeExit::Cut)
    }

    /// Follows a ray outward from the inner face until it has left the shell; `None` if it is inside again.
    fn in_shell(&self, ray: &mut DomeRay, random: &mut PathRandom) -> Option<Crossing> {
        while ray.rays < MAX_STEPS {
            if !ray.cross(self.outer) {
                return Some(ray.ends(DomeExit::Absorbed));
            }
            if !ray.reflects(|ray, k| ray.at_outer[k], random) {
                ray.direction = refract(ray.direction, -ray.position / self.outer, 1.0 / self.index);
                return Some(ray.ends(DomeExit::Outside));
            }
            ray.reflect();
            if !ray.cross(self.inner) {
                return Some(ray.ends(DomeExit::Absorbed));
            }
            if !ray.reflects(|ray, k| ray.at_inner[k], random) {
                ray.direction = refract(ray.direction, ray.position / self.inner, 1.0 / self.index);
                return None;
            }
            ray.reflect();
        }
        Some(ray.ends(DomeExit::Cut))
    }

    fn ray(&self, position: DVec3, direction: DVec3, impact: f64) -> DomeRay {
        let Self { inner, outer, index, absorption } = *self;
        let at = |radius: f64| {
            let sine = impact / radius;
            fresnel(((1.0 - sine) * (1.0 + sine)).max(0.0).sqrt(), index)
        };
        let foot = |radius: f64| ((radius - impact / index) * (radius + impact / index)).max(0.0).sqrt();
        let chord = (outer - inner) * (outer + inner) / (foot(outer) + foot(inner));
        let passes = libm::exp(-absorption * chord);
        DomeRay {
            position,
            direction,
            shares: [0.5; 2],
            at_outer: at(outer),
            at_inner: at(inner),
            chord,
            passes,
            rays: 1,
        }
    }
}

impl DomeRay {
    /// Returns the mean of a factor over both polarisations, weighted by their throughputs.
    fn mean(&self, factor: impl Fn(&Self, usize) -> f64) -> f64 {
        let [s, p] = self.shares;
        if s + p > 0.0 { (s * factor(self, 0) + p * factor(self, 1)) / (s + p) } else { 0.0 }
    }

    /// Takes a branch of the given `probability` in which the light is multiplied by a factor.
    fn pass(&mut self, factor: impl Fn(&Self, usize) -> f64, probability: f64) {
        self.shares = std::array::from_fn(|k| self.shares[k] * factor(self, k) / probability);
    }

    /// Draws a boolean that is true with the given probability.
    fn chooses(&self, probability: f64, random: &mut PathRandom) -> bool {
        probability > 0.0 && random.uniform() < probability
    }

    /// Chooses between reflection and transmission at a face in proportion to the light; the total throughput is unchanged.
    fn reflects(&mut self, reflectance: impl Fn(&Self, usize) -> f64, random: &mut PathRandom) -> bool {
        let probability = self.mean(&reflectance);
        let reflects = self.chooses(probability, random);
        if reflects {
            self.pass(reflectance, probability);
        } else {
            self.pass(|ray, k| 1.0 - reflectance(ray, k), 1.0 - probability);
        }
        reflects
    }

    /// Moves the ray through the shell to the face of the given radius; false if it meets the rim.
    fn cross(&mut self, radius: f64) -> bool {
        self.rays += 1;
        let end = self.position + self.direction * self.chord;
        if end.z < 0.0 && self.direction.z < 0.0 {
            return false;
        }
        self.position = end.normalize() * radius;
        self.shares = self.shares.map(|fraction| fraction * self.passes);
        true
    }

    /// Reflects the direction at the face that the ray is on.
    fn reflect(&mut self) {
        let normal = self.position.normalize();
        self.direction = (self.direction - normal * (2.0 * self.direction.dot(normal))).normalize();
    }

    fn ends(&self, exit: DomeExit) -> Crossing {
        let Self { position, direction, shares, rays, .. } = *self;
        Crossing { exit, position, direction, fraction: shares[0] + shares[1], rays }
    }
}

/// Position and direction of light in the aperture between dome and pipe.
enum ApertureRay {
    /// Light on its way down into the pipe.
    Falls(DVec3, DVec3),
    Rises(DVec3, DVec3),
}

impl DomedGuide {
    /// Puts a dome on a `pipe` with a clear collector; the dome's inner radius is the pipe's, `thickness` is in metres and `absorption` in
    /// 1/m.
    pub fn new(pipe: PipeBelow, index: f64, thickness: f64, absorption: f64) -> Self {
        let (radius, centre, to_local) = match &pipe {
            PipeBelow::Straight(guide) => (guide.radius, DVec3::Z * guide.length, DMat3::IDENTITY),
            PipeBelow::Bent(guide) => {
                let (centre, to_local) = guide.upper_end();
                (guide.radius, centre, to_local)
            }
        };
        Self { pipe, dome: Dome { inner: radius, outer: radius + thickness, index, absorption }, centre, to_local }
    }

    /// Samples an entry point uniformly over the dome's silhouette: half a disc and, toward the base, half an ellipse.
    #[inline]
    pub(super) fn entry(&self, point: [f64; 2], direction: DVec3) -> Option<Entry> {
        let d = self.to_local * direction;
        let radius = self.dome.outer;
        // cosine between the axis and the direction toward the light; negative: light from behind
        let cosine = -d.z;
        let height = 0.5 * (1.0 + cosine);
        if height <= 0.0 {
            return None;
        }
        let up = (DVec3::Z - d * d.z).try_normalize().unwrap_or(DVec3::X);
        let across = d.cross(up);
        // columns of the disc are pressed to those of the silhouette
        let on_disc = warp::disc(point);
        let column = ((1.0 - on_disc.x) * (1.0 + on_disc.x)).max(0.0).sqrt();
        let y = on_disc.y * height + column * 0.5 * (1.0 - cosine);
        let offset = (across * on_disc.x + up * y) * radius;
        let rise = (radius * radius - offset.length_squared()).max(0.0).sqrt();
        let mut position = offset - d * rise;
        position.z = position.z.max(0.0);
        Some(Entry {
            position: self.centre + self.to_local.transpose() * position,
            projected_area_m2: PI * radius * radius * height,
        })
    }

    pub(super) fn down<const C: usize>(
        &self,
        position: DVec3,
        direction: DVec3,
        random: &mut PathRandom,
    ) -> Transit<C> {
        let d = self.to_local * direction;
        let crossing = self.dome.enter(self.to_local * (position - self.centre), d, random);
        let mut transit = Transit {
            end: End::Absorbed,
            position,
            direction,
            collector: Spectrum::ONE * crossing.fraction,
            mirrors: Spectrum::ONE,
            entered: true,
            rays: crossing.rays,
        };
        if crossing.exit == DomeExit::Aperture {
            let (position, direction) = self.to_tube(&crossing);
            self.follow(&mut transit, ApertureRay::Falls(position, direction), random);
        } else if crossing.exit == DomeExit::Cut {
            transit.end = End::Cut;
        } else {
            // it has never been in the pipe: what is lost is lost by the collector
            transit.collector = Spectrum::ZERO;
        }
        transit
    }

    pub(super) fn up<const C: usize>(&self, position: DVec3, direction: DVec3, random: &mut PathRandom) -> Transit<C> {
        let mut transit = self.pipe.up::<C>(position, direction);
        if transit.end == End::Top {
            let place = ApertureRay::Rises(transit.position, transit.direction);
            self.follow(&mut transit, place, random);
        }
        transit
    }

    /// Follows light from the aperture to the end of its path.
    fn follow<const C: usize>(&self, transit: &mut Transit<C>, from: ApertureRay, random: &mut PathRandom) {
        let mut place = from;
        loop {
            if transit.rays >= MAX_STEPS {
                transit.end = End::Cut;
                return;
            }
            match place {
                ApertureRay::Falls(position, direction) => {
                    let below: Transit<C> = self.pipe.down(position, direction);
                    transit.mirrors *= below.mirrors;
                    transit.rays += below.rays;
                    (transit.end, transit.position, transit.direction) = (below.end, below.position, below.direction);
                    if below.end != End::Top {
                        return;
                    }
                    place = ApertureRay::Rises(below.position, below.direction);
                }
                ApertureRay::Rises(position, direction) => {
                    let (p, d) = (self.to_local * (position - self.centre), self.to_local * direction);
                    let crossing = self.dome.leave(p, d, random);
                    transit.collector = transit.collector * crossing.fraction;
                    transit.rays += crossing.rays;
                    (transit.position, transit.direction) = self.to_tube(&crossing);
                    transit.end = match crossing.exit {
                        DomeExit::Aperture => {
                            place = ApertureRay::Falls(transit.position, transit.direction);
                            continue;
                        }
                        DomeExit::Outside => End::Top,
                        DomeExit::Absorbed => End::Absorbed,
                        DomeExit::Cut => End::Cut,
                    };
                    return;
                }
            }
        }
    }

    fn to_tube(&self, crossing: &Crossing) -> (DVec3, DVec3) {
        let back = self.to_local.transpose();
        (self.centre + back * crossing.position, back * crossing.direction)
    }
}

impl PipeBelow {
    fn down<const C: usize>(&self, position: DVec3, direction: DVec3) -> Transit<C> {
        match self {
            Self::Straight(guide) => guide.down(position, direction),
            Self::Bent(guide) => guide.down(position, direction),
        }
    }

    fn up<const C: usize>(&self, position: DVec3, direction: DVec3) -> Transit<C> {
        match self {
            Self::Straight(guide) => guide.up(position, direction),
            Self::Bent(guide) => guide.up(position, direction),
        }
    }
}
