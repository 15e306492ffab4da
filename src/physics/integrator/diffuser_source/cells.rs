//! Light of one Lambertian diffuser: its photons, in an order in which neighbours in space are neighbours, and some of them that each represent
//! all. The light of a square is even, and has a closed form at sensors.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::patches::{CELLS, cell};
use crate::geometry::OpeningFrame;
use crate::geometry::lambert::quadrilateral_irradiance;
use crate::optics::Spectrum;
use crate::traceable::TraceableTube;

/// Distance from a disc, in its radii, below which paths follow the light instead of being connected to photons.
const NEAR: f64 = 1.0;

/// Largest number of photons of a tube among which a vertex chooses.
const MOST_CHOICES: usize = 1 << 16;

/// Light that leaves one diffuser.
#[derive(Debug)]
pub struct TubeLight<const C: usize> {
    /// Centre of the opening, and its plane.
    pub frame: OpeningFrame,
    /// Radius in m of the disc around the opening.
    pub radius: f64,
    /// Corners of a square opening in the room, clockwise seen from it, and its exitance in lm/m2; `None` for a disc.
    even: Option<([DVec3; 4], Spectrum<C>)>,
    /// Photons that leave, sorted by cells.
    pub photons: Vec<Emitted<C>>,
    /// Photons, each repeated in proportion to its flux; each represents the whole flux, and their mean is unbiased.
    choices: Vec<Emitted<C>>,
}

/// Light that leaves a diffuser at a point, as from a Lambertian surface.
#[derive(Clone, Copy, Debug)]
pub struct Emitted<const C: usize> {
    /// Position in the plane of the opening, in its levelled frame in m.
    pub position: DVec2,
    /// Flux in lm.
    pub flux: Spectrum<C>,
}

impl<const C: usize> Emitted<C> {
    /// Makes the light of `flux` lm that leaves an opening at a point of the room.
    pub fn new(position: DVec3, flux: Spectrum<C>, opening: &OpeningFrame) -> Self {
        Self { position: opening.levelled(position).truncate(), flux }
    }

    /// Returns the position in the room in m.
    #[inline]
    pub fn in_room(&self, opening: &OpeningFrame) -> DVec3 {
        opening.in_room(self.position.extend(opening.origin.z))
    }
}

impl<const C: usize> TubeLight<C> {
    /// Sorts the photons that leave a tube's diffuser into cells; `start` in 0..1 is where the choice among them begins.
    pub fn new(tube: &TraceableTube, photons: Vec<Emitted<C>>, start: f64) -> Self {
        let (origin, radius) = (tube.frame.origin, tube.opening.outer_radius());
        // neighbours in space are neighbours in the list, so that uniform numbers choose them uniformly
        let mut cells: [Vec<Emitted<C>>; CELLS] = std::array::from_fn(|_| Vec::new());
        for photon in photons {
            let away = photon.position - origin.truncate();
            cells[cell(&tube.opening, away)].push(photon);
        }
        let photons = cells.concat();
        let even = tube.corners().map(|corners| {
            let mut flux = Spectrum::ZERO;
            photons.iter().for_each(|photon| flux += photon.flux);
            (corners, flux * (1.0 / tube.opening.area_m2()))
        });
        Self { frame: tube.frame, radius, even, choices: choose(&photons, start), photons }
    }

    /// Iterates over the photons that leave: positions in m, and fluxes in lm.
    pub fn photons(&self) -> impl Iterator<Item = (DVec3, Spectrum<C>)> {
        self.photons.iter().map(|photon| (photon.in_room(&self.frame), photon.flux))
    }

    /// Returns the flux of all light that leaves, in lm.
    pub fn flux(&self) -> Spectrum<C> {
        let mut flux = Spectrum::ZERO;
        self.photons.iter().for_each(|photon| flux += photon.flux);
        flux
    }

    /// Returns the centroid of the light in m from the centre of the opening, in its levelled frame: that of the photons, less what chance makes
    /// of an even density.
    pub fn centroid(&self) -> DVec2 {
        let (mut moment, mut all, mut squares) = (DVec2::ZERO, 0.0, 0.0);
        for photon in &self.photons {
            let flux = photon.flux.luminance();
            moment += flux * (photon.position - self.frame.origin.truncate());
            (all, squares) = (all + flux, squares + flux * flux);
        }
        if self.even.is_some() || all <= 0.0 {
            return DVec2::ZERO;
        }
        let centroid = moment / all;
        // the mean square of the distance from the centre is half of the squared radius
        let by_chance = 0.5 * self.radius * self.radius * squares / (all * all);
        centroid * (1.0 - by_chance / centroid.length_squared().max(f64::MIN_POSITIVE)).max(0.0)
    }

    /// True if no point within `reach` of `position`, at its height, is near the disc.
    pub fn is_far(&self, position: DVec3, reach: f64) -> bool {
        is_far(&self.frame, self.radius, position, reach)
    }

    /// Returns the illuminance in lx of a surface that sees the whole opening, if its light is even; `None` for a disc.
    #[inline]
    pub fn of_square(&self, position: DVec3, normal: DVec3) -> Option<Spectrum<C>> {
        let (corners, exitance) = self.even.as_ref()?;
        Some(*exitance * (quadrilateral_irradiance(corners, position, normal).max(0.0) / PI))
    }

    /// Returns a photon chosen by a number in 0..1, with the flux of all; `None` without light.
    pub fn choice(&self, number: f64) -> Option<&Emitted<C>> {
        self.choices.get((number * self.choices.len() as f64) as usize)
    }

    /// Returns the illuminance of a surface per lumen that leaves the opening where a photon does; below 0 where the surface faces away.
    #[inline]
    pub fn per_lumen(&self, photon: &Emitted<C>, position: DVec3, normal: DVec3) -> f64 {
        let frame = &self.frame;
        let to_light = photon.position.extend(frame.origin.z) - frame.levelled(position);
        per_lumen(to_light, frame.levelled_direction(normal))
    }
}

/// Chooses photons by systematic resampling: every choice has the same luminous flux, and the mean of all is the whole. `start` in 0..1.
fn choose<const C: usize>(photons: &[Emitted<C>], start: f64) -> Vec<Emitted<C>> {
    let total: f64 = photons.iter().map(|photon| photon.flux.luminance()).sum();
    let count = photons.len().min(MOST_CHOICES);
    let fraction = total / count as f64;
    let mut choices = Vec::new();
    let mut reached = 0.0;
    for photon in photons {
        let luminous = photon.flux.luminance();
        reached += luminous;
        while choices.len() < count && (choices.len() as f64 + start) * fraction < reached {
            choices.push(Emitted { flux: photon.flux * (total / luminous), ..*photon });
        }
    }
    choices
}

/// True if no point within `reach` of `position`, at its height, is near the disc of `radius` in an opening.
pub fn is_far(opening: &OpeningFrame, radius: f64, position: DVec3, reach: f64) -> bool {
    let origin = opening.origin;
    // the points lie at other depths before an opening that is not level
    let nearer = if opening.is_level() { 0.0 } else { reach };
    let depth = opening.depth(position);
    let depth = depth.signum() * (depth.abs() - nearer).max(0.0);
    let position = opening.levelled(position);
    if depth >= NEAR * radius {
        return true;
    }
    let beside = ((position - origin).truncate().length() - radius - reach).max(0.0);
    depth * depth + beside * beside >= (NEAR * radius).powi(2)
}

/// Surface that receives light from points of an opening, in the opening's levelled frame.
pub struct OpeningReceiver {
    position: DVec3,
    normal: DVec3,
    /// Height of the opening above the receiver in m.
    depth: f64,
}

impl OpeningReceiver {
    /// Makes a receiver at `position`, of unit `normal`, for an opening.
    pub fn new(position: DVec3, normal: DVec3, opening: &OpeningFrame) -> Self {
        let (position, normal) = (opening.levelled(position), opening.levelled_direction(normal));
        Self { position, normal, depth: opening.origin.z - position.z }
    }

    /// Returns the illuminance per lumen that leaves a point of the opening's plane above the horizon, given in its levelled frame.
    #[inline(always)]
    pub fn point(&self, source: DVec2) -> f64 {
        per_lumen((source - self.position.truncate()).extend(self.depth), self.normal)
    }
}

/// Returns the illuminance of a surface of unit `normal` per lumen from a point of a level opening, `to_light` from it: cos(theta)
/// cos(theta') / (pi d^2).
#[inline(always)]
pub fn per_lumen(to_light: DVec3, normal: DVec3) -> f64 {
    let distance_squared = to_light.length_squared();
    to_light.dot(normal) * to_light.z / (PI * distance_squared * distance_squared)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::guide::{Guide, StraightGuide};
    use crate::optics::Diffuser;
    use crate::sampling::{Key, Replicate};
    use crate::scene::OpeningShape;

    const RADIUS: f64 = 0.127;

    /// Makes photons in a lopsided pattern: twice as dense on one side, and denser toward the middle.
    fn lopsided(count: usize, centre: DVec2) -> Vec<Emitted<3>> {
        let (replicate, _) = Replicate::of(Key::new(5), 0);
        let photon = |k: usize| {
            let [u, v, w, _] = replicate.point(k as u16, 0);
            let angle = if w < 2.0 / 3.0 { PI * v } else { -PI * v };
            let position = centre + DVec2::from_angle(angle) * RADIUS * u.powf(0.6);
            Emitted { position, flux: Spectrum([1.0, 2.0, 0.5]) * (1.0 / count as f64) }
        };
        (0..count).map(photon).collect()
    }

    /// Checks that the mean over all choices equals the light of all photons, to rounding.
    #[test]
    fn nothing_is_lost_in_the_mean() {
        let origin = DVec3::new(1.0, 1.2, 2.5);
        let pipe = StraightGuide {
            radius: RADIUS,
            length: 1.0,
            reflectance: [0.95; 3].into(),
            collector_transmittance: [1.0; 3],
        };
        let tube = TraceableTube {
            face: 5,
            hangs: false,
            frame: OpeningFrame::level(origin),
            opening: OpeningShape::Disc { radius: RADIUS },
            pipe_radius: RADIUS,
            transition_transmittance: 1.0,
            guide: Guide::Straight(pipe),
            cones: None,
            section: None,
            diffuser: Diffuser::Lambertian { transmittance: [0.6; 3], reflectance: [0.2; 3] },
            surroundings: None,
            sky: None,
            sun: None,
        };
        let count = 4096;
        let photons = lopsided(count, origin.truncate());
        let light = TubeLight::new(&tube, photons.clone(), 0.5);
        assert_eq!(light.choices.len(), count);
        for (position, normal) in [
            (DVec3::new(1.0, 1.2, 1.5), DVec3::Z),
            (DVec3::new(2.0, 0.5, 1.0), DVec3::Z),
            (DVec3::new(0.0, 1.0, 1.8), DVec3::X),
            (DVec3::new(1.3, 1.25, 2.3), DVec3::NEG_X),
        ] {
            let receiver = OpeningReceiver::new(position, normal, &OpeningFrame::level(origin));
            let sum = |photons: &[Emitted<3>]| {
                let mut sum = Spectrum::ZERO;
                photons.iter().for_each(|photon| sum += photon.flux * receiver.point(photon.position));
                sum
            };
            let (truth, choices) = (sum(&photons), sum(&light.choices));
            for channel in 0..3 {
                let mean = choices.0[channel] / count as f64;
                assert!((mean / truth.0[channel] - 1.0).abs() < 1e-10, "{position}: {mean} {truth:?}");
            }
        }
    }
}
