//! Light that tubes deliver through their closures, under many skies and suns: of a sky a number of lumens, of a beam that and a place, its
//! centroid, which are all that is left of light behind a Lambertian closure.
//!
//! Straight guides with closed forms have both without error; through all others rays are traced, for a sky the same ones at all times.
//! A horizon hides directions of skies and parts of suns; light from below it, and of the ground, is a fixed share of the light outside.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec2, DVec3};

use super::Guide;
use super::exit_moment::beam_exit_moment;
use super::performance::closed;
use super::sky_rings::{RINGS, SkyRings, zenith_angles};
use super::throughput::REPLICATES;
use super::transit::{End, Transit};
use super::transmittance::beam_transmission;
use crate::geometry::opening_frame::{levelled, unlevelled};
use crate::optics::scatter::{Scatter as _, SheetSide};
use crate::optics::{Diffuser, Spectrum};
use crate::sampling::{Key, PathRandom, Replicate, Stream, warp};
use crate::sky::{Horizon, SkyDistribution, Sun, Surroundings};
use crate::statistics::Moments;

/// Number of rays of each of the 8 replicates: for all skies together, and for each beam.
const SKY_RAYS: u64 = 512;
const BEAM_RAYS: u64 = 128;

/// Number of rays by which the light is found that a guide sends back to its closure.
const UP_RAYS: u64 = 4096;

/// Numbers of azimuths, and of heights at each, at which the light is computed that a horizon takes from a guide with closed forms.
const HIDDEN: [usize; 2] = [180, 10];

/// Numbers of the keys of the rays of skies, of beams, of the light that goes up again, and of the ground.
const OF_SKIES: u64 = 0;
const OF_BEAMS: u64 = 1;
const OF_RETURN: u64 = 2;
const OF_GROUND: u64 = 3;

/// Lambertian closure of a tube; coefficients are linear Rec.709.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EvenClosure {
    /// Radius of the pipe in m.
    pub radius: f64,
    /// Fraction that passes.
    pub transmittance: [f64; 3],
    /// Fraction that is scattered back up.
    pub reflectance: [f64; 3],
    /// True if a transition spreads the light of the pipe evenly over the closure.
    pub spreads: bool,
}

/// Light that leaves a closure: an area in m2, that times the illuminance outside is the flux in lm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Delivered {
    /// Flux over the normal illuminance of a beam, or over the horizontal illuminance of a sky, in m2.
    pub area_m2: f64,
    /// Standard error of `area_m2`; 0 in closed form.
    pub standard_error_m2: f64,
    /// Centroid of the light on the closure, in m from its centre in its levelled frame; the centre for light from below the horizon.
    pub centroid_m: DVec2,
}

/// Closure of a tube.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TubeClosure<'a> {
    /// Closure that passes and reflects all light alike.
    Even(EvenClosure),
    /// Closure that passes light by its place or direction, below a pipe of this radius in m.
    Other(&'a Diffuser, f64),
}

impl TubeClosure<'_> {
    /// Returns the fractions of light from the unit vector `from` that pass at a place, and that are scattered back; both in the levelled frame
    /// of the opening.
    fn fractions(&self, place: DVec3, from: DVec3) -> [Spectrum<3>; 2] {
        match self {
            Self::Even(even) => [even.transmittance, even.reflectance].map(Spectrum::from_rgb),
            Self::Other(diffuser, _) => {
                let closure = diffuser.at(place.truncate().length());
                [SheetSide::Other, SheetSide::Same].map(|side| closure.albedo(from, side))
            }
        }
    }

    fn radius(&self) -> f64 {
        match self {
            Self::Even(EvenClosure { radius, .. }) | Self::Other(_, radius) => *radius,
        }
    }

    fn reflects(&self) -> bool {
        match self {
            Self::Even(even) => even.reflectance.iter().any(|reflectance| *reflectance > 0.0),
            Self::Other(..) => true,
        }
    }
}

/// Closure with what the guide sends back to it of the light that it scatters up.
#[derive(Clone, Copy, Debug)]
struct Passed<'a> {
    closure: TubeClosure<'a>,
    /// Fraction of this light that passes in the end.
    again: Spectrum<3>,
    /// Matrix that levels directions at the opening; `None` for a level one.
    turn: Option<&'a DMat3>,
}

impl Passed<'_> {
    /// Returns the fraction of light from `from` that leaves downward in the end, after any ways up and down again.
    fn of(&self, place: DVec3, from: DVec3) -> Spectrum<3> {
        let [passes, reflects] = self.closure.fractions(place, from);
        passes + reflects * self.again
    }

    fn of_transit(&self, transit: &Transit<3>) -> Spectrum<3> {
        self.of(levelled(self.turn, transit.position), levelled(self.turn, -transit.direction))
    }

    /// Returns the fraction of all light; `None` if it is not the same for all.
    fn of_all(&self) -> Option<Spectrum<3>> {
        matches!(self.closure, TubeClosure::Even(_)).then(|| self.of(DVec3::ZERO, DVec3::Z))
    }
}

/// Tube above a closure, prepared for many skies and suns.
#[derive(Debug)]
pub struct Delivery<'a> {
    guide: &'a Guide,
    passed: Passed<'a>,
    /// True if the light is spread evenly over the closure.
    spreads: bool,
    /// Key of the rays of beams.
    key: Key,
    of_skies: OfSkies,
    horizon: Option<&'a Horizon>,
    /// Light from below the horizon, per horizontal illuminance of the sky.
    below_horizon: Delivered,
    /// Light of the ground, per horizontal illuminance of sky and sun.
    ground: Delivered,
}

#[derive(Debug)]
enum OfSkies {
    /// Quadrature.
    Nodes {
        /// Area in m2 at the zenith angles of [`SkyRings`], per horizontal illuminance, and its first moment in m3 toward the light's azimuth.
        rings: Box<[f64; RINGS]>,
        moments: Box<[f64; RINGS]>,
        /// Directions that the horizon hides, with the flux per luminance in m2 sr, and the first moment of this in m3 sr.
        hidden: Vec<(DVec3, f64, DVec2)>,
        /// Fraction of the light that leaves the closure.
        passed: Spectrum<3>,
    },
    /// Rays of each replicate.
    Rays(Vec<Vec<SkyRay>>),
}

#[derive(Clone, Copy, Debug)]
struct SkyRay {
    toward: DVec3,
    /// Flux that leaves the closure, and horizontal illuminance, per luminance: shares of the means over all rays.
    delivered: f64,
    horizontal: f64,
    /// Place in m where it leaves the closure, in the levelled frame of the opening.
    place: DVec2,
}

impl<'a> Delivery<'a> {
    /// Prepares a guide with its surroundings above a closure. With `returns`, light that the closure scatters up and the guide sends back
    /// counts, too. `turn` is the matrix of the opening's frame.
    pub fn new(
        (guide, turn): (&'a Guide, Option<&'a DMat3>),
        surroundings: Option<&'a Surroundings>,
        closure: TubeClosure<'a>,
        returns: bool,
        key: Key,
    ) -> Self {
        let again = match returns && closure.reflects() && guide.returns_light() {
            true => passed_again((guide, turn), closure, key.child(OF_RETURN)),
            false => Spectrum::ZERO,
        };
        let passed = Passed { closure, again, turn };
        let horizon = surroundings.and_then(|surroundings| surroundings.horizon.as_ref());
        let [below, ground] =
            surroundings.map_or([0.0; 2], |around| [around.luminance_ratio / PI, around.ground_reflectance / PI]);
        let of_all = passed.of_all().filter(|_| closed(guide).is_some());
        let rays = |of: u64, side: f64| -> Vec<Vec<SkyRay>> {
            let key = key.child(of);
            (0..REPLICATES).map(|number| sky_rays(guide, &passed, side, key.child(number))).collect()
        };
        let (of_skies, below_horizon) = match of_all {
            Some(passed) => {
                let of = |(toward, solid_angle): (DVec3, f64)| {
                    let [area, moment] = closed_area(guide, passed, toward);
                    (toward, solid_angle * area, toward.truncate().normalize_or_zero() * (solid_angle * moment))
                };
                let [azimuths, heights] = HIDDEN;
                let hidden: Vec<_> =
                    horizon.into_iter().flat_map(|horizon| horizon.hidden(azimuths, heights)).map(of).collect();
                let area_m2 = below * hidden.iter().map(|(_, flux, _)| flux).sum::<f64>();
                let of_rings = zenith_angles()
                    .map(|toward| closed_area(guide, passed, toward).map(|per_normal| per_normal / toward.z));
                let [rings, moments] = [0, 1].map(|part| Box::new(of_rings.map(|ring| ring[part])));
                let below = Delivered { area_m2, ..Delivered::default() };
                (OfSkies::Nodes { rings, moments, hidden, passed }, below)
            }
            None => {
                let mut rays = rays(OF_SKIES, 1.0);
                let hidden =
                    horizon.map(|horizon| Delivered::of_fluxes(below, rays.iter_mut().map(|rays| hide(rays, horizon))));
                (OfSkies::Rays(rays), hidden.unwrap_or_default())
            }
        };
        let ground = match of_all.is_some() || ground == 0.0 {
            true => Delivered::default(),
            false => Delivered::of_fluxes(ground, rays(OF_GROUND, -1.0).iter().map(|rays| flux(rays))),
        };
        let key = key.child(OF_BEAMS);
        let spreads = matches!(closure, TubeClosure::Even(EvenClosure { spreads: true, .. }));
        Self { guide, passed, spreads, key, of_skies, horizon, below_horizon, ground }
    }

    /// Returns the light of the ground per horizontal illuminance of sky and sun.
    pub fn of_ground(&self) -> Delivered {
        self.ground
    }

    /// Computes the light of a sky, and from below the horizon before it, per the horizontal illuminance of the open sky.
    pub fn of_sky(&self, distribution: &SkyDistribution, rings: &SkyRings) -> Delivered {
        let open = self.of_open_sky(distribution, rings);
        let area_m2 = open.area_m2 + self.below_horizon.area_m2;
        Delivered {
            area_m2,
            standard_error_m2: open.standard_error_m2 + self.below_horizon.standard_error_m2,
            centroid_m: self.unless_spread(open.centroid_m * open.area_m2, area_m2),
        }
    }

    fn of_open_sky(&self, distribution: &SkyDistribution, rings: &SkyRings) -> Delivered {
        let replicates = match &self.of_skies {
            OfSkies::Nodes { rings: areas, moments, hidden, .. } => {
                let (mut lost, mut lost_moment) = (0.0, DVec2::ZERO);
                for (toward, flux, moment) in hidden {
                    let per_horizontal = distribution.relative_luminance(*toward) / rings.horizontal_ratio;
                    lost += flux * per_horizontal;
                    lost_moment += *moment * per_horizontal;
                }
                let area_m2 = (rings.mean(areas) - lost).max(0.0);
                let centroid_m = centroid(rings.mean_toward(moments) - lost_moment, area_m2);
                return Delivered { area_m2, standard_error_m2: 0.0, centroid_m };
            }
            OfSkies::Rays(replicates) => replicates,
        };
        let mut moment = DVec2::ZERO;
        let mut sums_of = |rays: &Vec<SkyRay>| {
            let mut sums = [0.0; 2];
            for ray in rays {
                let luminance = distribution.relative_luminance(ray.toward);
                sums[0] += luminance * ray.delivered;
                sums[1] += luminance * ray.horizontal;
                moment += ray.place * (luminance * ray.delivered);
            }
            sums
        };
        let sums: Vec<[f64; 2]> = replicates.iter().map(&mut sums_of).collect();
        let [delivered, horizontal] = sums.iter().fold([0.0; 2], |all, [a, b]| [all[0] + a, all[1] + b]);
        if horizontal <= 0.0 {
            return Delivered::default();
        }
        let area_m2 = delivered / horizontal;
        let mut residuals = Moments::default();
        let mean = horizontal / sums.len() as f64;
        sums.iter().for_each(|[a, b]| residuals.push((a - area_m2 * b) / mean));
        Delivered { area_m2, standard_error_m2: residuals.standard_error(), centroid_m: centroid(moment, delivered) }
    }

    /// Computes the light of a sun at the unit vector `toward`, as far as the horizon leaves it, per its unobstructed normal illuminance.
    pub fn of_beam(&self, toward: DVec3) -> Delivered {
        let sun = Sun { direction: toward, normal_illuminance_lux: 1.0 };
        let uncovered = self.horizon.map_or(1.0, |horizon| horizon.uncovered(&sun));
        if uncovered == 0.0 {
            return Delivered::default();
        }
        let Delivered { area_m2, standard_error_m2, centroid_m } = self.beam(toward);
        Delivered {
            area_m2: uncovered * area_m2,
            standard_error_m2: uncovered * standard_error_m2,
            centroid_m: self.unless_spread(centroid_m, 1.0),
        }
    }

    /// Returns the centroid of light by its first moment; the centre of a closure over which a transition spreads the light evenly.
    fn unless_spread(&self, moment: DVec2, light: f64) -> DVec2 {
        if self.spreads { DVec2::ZERO } else { centroid(moment, light) }
    }

    fn beam(&self, toward: DVec3) -> Delivered {
        if let OfSkies::Nodes { passed, .. } = self.of_skies {
            let [area_m2, moment] = closed_area(self.guide, passed, toward);
            let centroid_m = centroid(toward.truncate().normalize_or_zero() * moment, area_m2);
            return Delivered { area_m2, standard_error_m2: 0.0, centroid_m };
        }
        let (mut areas, mut moment) = (Moments::default(), DVec2::ZERO);
        for number in 0..REPLICATES {
            let mut sum = 0.0;
            follow(
                self.guide,
                self.key.child(number),
                BEAM_RAYS,
                |_| toward,
                |_, entry_m2, transit| {
                    let area = entry_m2 * (transit.weight() * self.passed.of_transit(transit)).luminance();
                    sum += area;
                    moment += area * levelled(self.passed.turn, transit.position).truncate();
                },
            );
            areas.push(sum / BEAM_RAYS as f64);
        }
        let whole = areas.mean * (REPLICATES * BEAM_RAYS) as f64;
        Delivered {
            area_m2: areas.mean,
            standard_error_m2: areas.standard_error(),
            centroid_m: centroid(moment, whole),
        }
    }
}

impl Delivered {
    /// Returns the light of fluxes per luminance in m2 sr, one of each replicate, where the luminance is a share of the illuminance outside.
    fn of_fluxes(share: f64, fluxes: impl Iterator<Item = f64>) -> Self {
        let mut moments = Moments::default();
        fluxes.for_each(|flux| moments.push(share * flux));
        Self { area_m2: moments.mean, standard_error_m2: moments.standard_error(), centroid_m: DVec2::ZERO }
    }
}

/// Returns the flux per luminance of the rays of one replicate in m2 sr.
fn flux(rays: &[SkyRay]) -> f64 {
    rays.iter().map(|ray| ray.delivered).sum()
}

/// Takes the light from rays that a horizon hides, and returns its flux per luminance in m2 sr.
fn hide(rays: &mut [SkyRay], horizon: &Horizon) -> f64 {
    let hidden = rays.iter_mut().filter(|ray| horizon.hides(ray.toward));
    hidden.map(|ray| std::mem::take(&mut ray.delivered)).sum()
}

/// Evaluates a function of the reflectance of each channel, and weights the results by the light that collector and closure pass.
fn by_channel(passed: Spectrum<3>, reflectance: [f64; 3], collector: [f64; 3], of: impl Fn(f64) -> f64) -> f64 {
    let of_red = of(reflectance[0]);
    let of = |channel: usize| if reflectance[channel] == reflectance[0] { of_red } else { of(reflectance[channel]) };
    (Spectrum(std::array::from_fn(of)) * Spectrum::from_rgb(collector) * passed).luminance()
}

/// Returns the centroid of light by its first moment; the centre without light.
fn centroid(moment: DVec2, light: f64) -> DVec2 {
    if light > 0.0 { moment / light } else { DVec2::ZERO }
}

/// Computes the area in m2 of a guide with closed forms for a beam, and the first moment in m3 of this area toward the beam's azimuth.
fn closed_area(guide: &Guide, passed: Spectrum<3>, toward: DVec3) -> [f64; 2] {
    let Some((aspect, reflectance, collector)) = closed(guide).filter(|_| toward.z > 0.0) else { return [0.0; 2] };
    let tangent = toward.truncate().length() / toward.z;
    let projected = guide.projected_area_m2(-toward);
    let area = projected * by_channel(passed, reflectance, collector, |of| beam_transmission(aspect, tangent, of));
    let Guide::Straight(pipe) = guide else { return [area, 0.0] };
    // along the travel of the light
    let moment = by_channel(passed, reflectance, collector, |of| beam_exit_moment(aspect, tangent, of));
    [area, -projected * pipe.radius * moment]
}

/// Traces the rays of one replicate for all skies, or, with `side` -1 in place of 1, for the ground: half of them evenly distributed over the
/// solid angle and half over its projection.
fn sky_rays(guide: &Guide, passed: &Passed, side: f64, key: Key) -> Vec<SkyRay> {
    let direction = |[u, v]: [f64; 2]| {
        // the height z has the density (1 + 2 z) / 2
        let z = 0.5 * ((1.0 + 8.0 * u).sqrt() - 1.0);
        let (sin, cos) = libm::sincos(TAU * v);
        let radius = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
        DVec3::new(radius * cos, radius * sin, side * z)
    };
    let share = |toward: DVec3| 2.0 * TAU / (1.0 + 2.0 * toward.z.abs()) / SKY_RAYS as f64;
    let ray = |index: u64| {
        let [u, v, ..] = point(key, index);
        let toward = direction([u, v]);
        SkyRay { toward, delivered: 0.0, horizontal: toward.z * share(toward), place: DVec2::ZERO }
    };
    let mut rays: Vec<SkyRay> = (0..SKY_RAYS).map(ray).collect();
    follow(guide, key, SKY_RAYS, direction, |index, entry_m2, transit| {
        let ray = &mut rays[index];
        ray.delivered = entry_m2 * (transit.weight() * passed.of_transit(transit)).luminance() * share(ray.toward);
        ray.place = levelled(passed.turn, transit.position).truncate();
    });
    rays
}

/// Follows the rays of a replicate down a guide. `direction` makes the unit vector toward the origin of each
/// of two numbers in 0..1; `arrived` takes the number, the area in m2 of the entry, and the passage of each ray that reaches the opening.
fn follow(
    guide: &Guide,
    key: Key,
    count: u64,
    direction: impl Fn([f64; 2]) -> DVec3,
    mut arrived: impl FnMut(usize, f64, &Transit<3>),
) {
    let mut random = PathRandom::new(key.stream(Stream::ThroughputChoices, 0));
    for index in 0..count {
        let [u, v, s, t] = point(key, index);
        let toward = direction([u, v]);
        let Some(entry) = guide.entry([s, t], -toward) else { continue };
        let transit = guide.down(entry.position, -toward, &mut random);
        if transit.entered && transit.end == End::Opening {
            arrived(index as usize, entry.projected_area_m2, &transit);
        }
    }
}

/// Returns point `index` of the Sobol sequence of a replicate.
fn point(key: Key, index: u64) -> [f64; 4] {
    let (replicate, index) = Replicate::of(key, index);
    replicate.point(index, 0)
}

/// Traces the light that a closure scatters up a guide, as if evenly, and returns the fraction of each channel that passes it in the end.
fn passed_again((guide, turn): (&Guide, Option<&DMat3>), closure: TubeClosure, key: Key) -> Spectrum<3> {
    let [mut scattered, mut passes, mut reflects] = [Spectrum::<3>::ZERO; 3];
    let mut random = PathRandom::new(key.stream(Stream::ThroughputChoices, 0));
    for index in 0..UP_RAYS {
        let [u, v, s, t] = point(key, index);
        let (place, toward) = ((warp::disc([u, v]) * closure.radius()).extend(0.0), warp::cosine_hemisphere([s, t]));
        let [_, weight] = closure.fractions(place, toward);
        scattered += weight;
        let transit = guide.up::<3>(unlevelled(turn, place), unlevelled(turn, toward), &mut random);
        if transit.end == End::Opening {
            let [place, from] = [transit.position, -transit.direction].map(|v| levelled(turn, v));
            let [passed, reflected] = closure.fractions(place, from);
            passes += weight * transit.weight() * passed;
            reflects += weight * transit.weight() * reflected;
        }
    }
    let fraction = |channel: usize| match scattered.0[channel] - reflects.0[channel] {
        left if left > 0.0 => passes.0[channel] / left,
        _ => 0.0,
    };
    Spectrum(std::array::from_fn(fraction))
}
