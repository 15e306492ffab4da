//! Emission of photons from sky and sun into the tubes, and from luminaires.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec2, DVec3};

use crate::guide::{Guide, StraightGuide, dome::PipeBelow, transmittance};
use crate::optics::Spectrum;
use crate::sampling::{Key, PathRandom, PathSamples, Stream, warp};
use crate::sky::patches::SkyPatch;
use crate::sky::sampler::{SkySampler, SkyTable};
use crate::sky::sun::HALF_ANGLE;
use crate::sky::{OutsidePart, Sky, Sun};
use crate::traceable::luminaire::TraceableLuminaire;
use crate::traceable::{TraceableScene, TraceableTube};

/// Fraction of a pass' photons that is divided evenly among the sources of light; the rest is divided by their flux.
const LEAST_SHARE: f64 = 0.125;

/// Fewest photons of a pass per source of light, on average.
const LEAST_PHOTONS: u64 = 4;

/// Least area of a tube that is expected to pass light from a patch of the sky, relative to its lower end; it changes the choice of samples
/// only.
const LEAST_AREA: f64 = 1e-3;

/// Fraction of the light that the far side of a dome is assumed to reflect into the aperture; it changes the choice of samples only.
const FAR_SIDE_REFLECTANCE: f64 = 0.08;

/// Sources of a scene, each integrated on its own: sky and sun through each tube, and the luminaires.
#[derive(Debug, Default)]
pub struct Emission {
    emitters: Vec<Emitter>,
}

#[derive(Debug)]
struct Emitter {
    source: EmissionSource,
    photons: u64,
    /// Number within the pass of the emitter's first photon.
    first: u64,
}

#[derive(Debug)]
enum EmissionSource {
    Sky { tube: usize, table: Arc<SkyTable>, sampler: Arc<SkySampler> },
    Sun { tube: usize, sun: Sun },
    Patch { tube: usize, patch: SkyPatch, part: OutsidePart },
    Luminaire(usize),
}

/// Place where a photon starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// Outside, toward the collector of this tube.
    Tube(usize),
    /// On this luminaire.
    Luminaire(usize),
}

/// Photon that enters a tube's collector, or leaves a luminaire.
#[derive(Clone, Copy, Debug)]
pub struct EmittedPhoton {
    /// Tube or luminaire where the photon starts.
    pub start: Start,
    /// Entry point in the tube's frame, or a point of the luminaire in the room's frame, in m.
    pub position: DVec3,
    /// Unit direction of travel.
    pub direction: DVec3,
    /// True if the photon comes from the sun.
    pub sun: bool,
    /// Flux in lm, or for a luminaire in lm per cd/m2 of its luminance; the photons of a pass add up to the whole flux.
    pub flux: f64,
    /// Number of this photon among the `of` photons of its source.
    pub index: u64,
    /// Number of photons of its source in this pass.
    pub of: u64,
}

impl Emission {
    /// Divides `photons`, or 4 per source if these are more, among all sources, mostly in proportion to the flux that is expected of each.
    pub fn new(scene: &TraceableScene, photons: u64) -> Self {
        Self::of(scene, &scene.tubes, &scene.luminaires, photons)
    }

    /// Divides `photons` among sky and sun alone, mostly in proportion to the flux that is expected of each.
    pub fn of_daylight(scene: &TraceableScene, photons: u64) -> Self {
        Self::of(scene, &scene.tubes, &[], photons)
    }

    /// Divides `photons` among the luminaires alone; no photons if none emits light.
    pub fn of_luminaires(scene: &TraceableScene, photons: u64) -> Self {
        Self::of(scene, &[], &scene.luminaires, photons)
    }

    /// Divides `photons` among the given sources; `tubes` are all of the scene, or none.
    fn of(scene: &TraceableScene, tubes: &[TraceableTube], luminaires: &[TraceableLuminaire], photons: u64) -> Self {
        let mut sources = Vec::new();
        let table = if tubes.is_empty() { None } else { scene.sky_table() };
        // by the first of the tubes that share it
        let mut samplers: Vec<(usize, Option<Sampled>)> = Vec::new();
        for (index, tube) in tubes.iter().enumerate() {
            let expected = |toward: DVec3| expected_area_m2(tube, toward);
            if let Some((table, sky)) = table.as_ref().zip(tube.sky.as_ref()) {
                let is_alike = |other: &TraceableTube| {
                    other.guide.is_like(&tube.guide)
                        && other.sky.as_ref().is_some_and(|other| other.has_surroundings_of(sky))
                };
                let known = samplers.iter().find(|(other, _)| is_alike(&tubes[*other]));
                let sampled = known.map(|(_, sampled)| sampled.clone());
                let sampled = sampled.unwrap_or_else(|| {
                    let sampled = sky_sampler(table, sky, &tube.guide, expected);
                    samplers.push((index, sampled.clone()));
                    sampled
                });
                if let Some((sampler, flux)) = sampled {
                    sources.push((EmissionSource::Sky { tube: index, table: table.clone(), sampler }, flux));
                }
            }
            sources.extend(tube.sun.and_then(|sun| of_sun(index, tube, sun)));
        }
        for (index, luminaire) in luminaires.iter().enumerate().filter(|(_, luminaire)| luminaire.emits()) {
            let flux: Spectrum<3> = luminaire.flux();
            sources.push((EmissionSource::Luminaire(index), flux.luminance()));
        }
        Self::shared(sources, photons)
    }

    /// Divides `photons` from the sun in place of the scene's own sky and sun among the tubes that `counts` selects.
    pub fn of_sun(scene: &TraceableScene, sun: Sun, counts: impl Fn(&TraceableTube) -> bool, photons: u64) -> Self {
        let before = |tube: &TraceableTube| tube.before(sun);
        let tubes = scene.tubes.iter().enumerate().filter(|(_, tube)| counts(tube));
        let sources = tubes.filter_map(|(index, tube)| of_sun(index, tube, before(tube)?));
        Self::shared(sources.collect(), photons)
    }

    /// Divides `photons` from a patch of the sky, or from its mirror image on the ground, among the tubes that `counts` selects, in place of
    /// the scene's own sky and sun. They come from one part of the outside, which has 1 cd/m2 times its share.
    pub fn of_patch(
        scene: &TraceableScene,
        (patch, part): (&SkyPatch, OutsidePart),
        counts: impl Fn(&TraceableTube) -> bool,
        photons: u64,
    ) -> Self {
        let source = |(tube, of_tube): (usize, &TraceableTube)| {
            let is_there = match (part, &of_tube.surroundings) {
                (OutsidePart::Sky, _) => true,
                (OutsidePart::BelowHorizon, Some(around)) => {
                    around.horizon.as_ref().is_some_and(|horizon| patch.begins_below(horizon.largest_altitude()))
                }
                (OutsidePart::Ground, Some(around)) => around.ground_reflectance > 0.0 && sees_ground(of_tube, patch),
                (_, None) => false,
            };
            // light may enter from a part of the patch alone
            let area = expected_area_m2(of_tube, patch.toward).max(LEAST_AREA * of_tube.pipe_area_m2());
            is_there.then(|| (EmissionSource::Patch { tube, patch: *patch, part }, patch.solid_angle_sr * area))
        };
        let tubes = scene.tubes.iter().enumerate().filter(|(_, tube)| counts(tube));
        Self::shared(tubes.filter_map(source).collect(), photons)
    }

    /// Divides `photons` among sources, mostly in proportion to the flux in lm that is expected of each.
    fn shared(sources: Vec<(EmissionSource, f64)>, photons: u64) -> Self {
        let fluxes: Vec<f64> = sources.iter().map(|(_, flux)| *flux).collect();
        let mut first = 0;
        let emitter = |((source, _), photons): ((EmissionSource, f64), u64)| {
            first += photons;
            Emitter { source, photons, first: first - photons }
        };
        let emitters = sources.into_iter().zip(divided(photons, &fluxes)).map(emitter).collect();
        Self { emitters }
    }

    /// Returns the number of photons per pass.
    pub fn photons(&self) -> u64 {
        self.emitters.last().map_or(0, |last| last.first + last.photons)
    }

    /// Returns the fraction of the photons that come from the sky through tube `number`.
    pub fn sky_fraction(&self, number: usize) -> f64 {
        self.fraction(|source| matches!(source, EmissionSource::Sky { tube, .. } if *tube == number))
    }

    /// Returns the number of the sun's photons per sr and per m2 of area perpendicular to the sun's direction that are sent to a tube's
    /// collector; 0 without such photons.
    pub fn sun_density(&self, scene: &TraceableScene, number: usize) -> f64 {
        let of_sun = |emitter: &&Emitter| matches!(emitter.source, EmissionSource::Sun { tube, .. } if tube == number);
        let Some((emitter, sun)) = self.emitters.iter().find(of_sun).zip(scene.tubes[number].sun) else { return 0.0 };
        let area = scene.tubes[number].guide.projected_area_m2(-sun.direction);
        emitter.photons as f64 / (area * Sun::solid_angle_sr())
    }

    /// Returns the fraction of the photons that leave luminaire `number`.
    pub fn luminaire_fraction(&self, number: usize) -> f64 {
        self.fraction(|source| matches!(source, EmissionSource::Luminaire(luminaire) if *luminaire == number))
    }

    fn fraction(&self, is: impl Fn(&EmissionSource) -> bool) -> f64 {
        let of = self.emitters.iter().filter(|emitter| is(&emitter.source)).map(|emitter| emitter.photons);
        of.sum::<u64>() as f64 / self.photons() as f64
    }

    /// Samples photon `number` of the pass with key `pass`, and returns it with the random numbers for the rest of its path. The photon is
    /// `None` if no light comes from its sampled direction or it misses the collector.
    #[inline]
    pub fn photon(&self, scene: &TraceableScene, pass: Key, number: u64) -> (Option<EmittedPhoton>, PathSamples) {
        let index = self.emitters.partition_point(|emitter| emitter.first <= number) - 1;
        let emitter = &self.emitters[index];
        let mut samples = PathSamples::new(pass.stream(Stream::Emission, index as u64), number - emitter.first);
        let point = samples.pair();
        let (tube, toward, luminance_per_density) = match &emitter.source {
            EmissionSource::Sky { tube, table, sampler } => {
                let (toward, density) = sampler.sample(point);
                (*tube, toward, luminance(scene.tubes[*tube].sky.as_ref(), table, toward) / density)
            }
            EmissionSource::Sun { tube, sun } => {
                let toward = warp::around(sun.direction, warp::cone(point, HALF_ANGLE));
                let visible = if toward.z > 0.0 { 1.0 } else { 0.0 };
                (*tube, toward, visible * sun.luminance_cd_m2() * Sun::solid_angle_sr())
            }
            EmissionSource::Patch { tube, patch, part } => {
                let above = patch.point(point);
                let toward = if *part == OutsidePart::Ground { DVec3 { z: -above.z, ..above } } else { above };
                let seen = scene.tubes[*tube].outside(toward).filter(|(seen, _)| seen == part);
                (*tube, toward, seen.map_or(0.0, |(_, share)| share * patch.solid_angle_sr))
            }
            EmissionSource::Luminaire(index) => {
                let luminaire = &scene.luminaires[*index];
                let photon = EmittedPhoton {
                    start: Start::Luminaire(*index),
                    position: scene.enclosure.clamp(luminaire.point(point)),
                    direction: warp::around(luminaire.normal, warp::cosine_hemisphere(samples.pair())),
                    sun: false,
                    flux: PI * luminaire.area_m2 / emitter.photons as f64,
                    index: number - emitter.first,
                    of: emitter.photons,
                };
                return (Some(photon), samples);
            }
        };
        let entry_point = samples.pair();
        let entry = scene.tubes[tube].guide.entry(entry_point, -toward);
        let photon = entry.filter(|_| luminance_per_density > 0.0).map(|entry| EmittedPhoton {
            start: Start::Tube(tube),
            position: entry.position,
            direction: -toward,
            sun: matches!(emitter.source, EmissionSource::Sun { .. }),
            flux: luminance_per_density * entry.projected_area_m2 / emitter.photons as f64,
            index: number - emitter.first,
            of: emitter.photons,
        });
        (photon, samples)
    }
}

/// True if light of the ground may enter a tube from the azimuths of a patch.
fn sees_ground(tube: &TraceableTube, patch: &SkyPatch) -> bool {
    let level = patch.toward.truncate().normalize_or(DVec2::X).extend(0.0);
    tube.guide.projected_area_m2(-level) > 0.0
}

/// Returns the sun as a source through tube `index`, and the flux in lm that is expected of it; `None` if it cannot enter.
fn of_sun(index: usize, tube: &TraceableTube, sun: Sun) -> Option<(EmissionSource, f64)> {
    let flux = sun.normal_illuminance_lux * expected_area_m2(tube, sun.direction);
    let enters = tube.guide.projected_area_m2(-sun.direction) > 0.0 && flux > 0.0;
    enters.then_some((EmissionSource::Sun { tube: index, sun }, flux))
}

/// Divides `photons`, or 4 per source if these are more, among sources of these fluxes in lm: each gets one at least.
fn divided(photons: u64, fluxes: &[f64]) -> Vec<u64> {
    let count = fluxes.len() as u64;
    let photons = photons.max(LEAST_PHOTONS * count);
    let total: f64 = fluxes.iter().sum();
    let least = LEAST_SHARE / count.max(1) as f64;
    let mut left = photons;
    let of_source = |(after, flux): (u64, &f64)| {
        // all that come after it have one at least
        let most = left - after;
        let fraction = photons as f64 * (least + (1.0 - LEAST_SHARE) * flux / total);
        let of_source = if after == 0 { most } else { (fraction as u64).clamp(1, most) };
        left -= of_source;
        of_source
    };
    (0..count).rev().zip(fluxes).map(of_source).collect()
}

/// Sampler of directions from which a sky's light enters a guide, and the flux in lm from all of them.
type Sampled = (Arc<SkySampler>, f64);

/// Builds a sampler of directions in proportion to a sky's luminance times `expected` (the effective area in m2 for light from a
/// direction), and estimates the flux in lm from all directions; `None` if no light is expected.
fn sky_sampler(table: &SkyTable, sky: &Sky, guide: &Guide, expected: impl Fn(DVec3) -> f64) -> Option<Sampled> {
    let sampler = match guide {
        // round and upright: no azimuth is before another
        Guide::Straight(_) => SkySampler::of_table_and_heights(table, sky, &expected),
        _ => SkySampler::of_table(table, sky, &expected),
    };
    let sampler = sampler?.with_cone(guide.narrow_cone());
    // a rough integral is enough to share photons
    let flux = (0..256u64).map(|k| {
        let mut random = PathRandom::new(Key::new(k));
        let (toward, density) = sampler.sample(random.uniform2());
        luminance(Some(sky), table, toward) * expected(toward) / density
    });
    let flux = flux.sum::<f64>() / 256.0;
    Some((Arc::new(sampler), flux))
}

/// Returns the luminance in cd/m2 toward a unit vector: of a sky's surroundings where they are in front, else from the table of the open sky.
#[inline]
fn luminance(sky: Option<&Sky>, table: &SkyTable, toward: DVec3) -> f64 {
    sky.and_then(|sky| sky.in_front(toward)).unwrap_or_else(|| table.sky().luminance(toward))
}

/// Returns the approximate area in m2 that passes light from a direction; it changes the choice of samples only.
fn expected_area_m2(tube: &TraceableTube, toward: DVec3) -> f64 {
    tube.guide.projected_area_m2(-toward) * likely_transmission(tube, toward)
}

/// Returns the approximate fraction of the light from a direction that a tube passes; it changes the choice of samples only.
fn likely_transmission(tube: &TraceableTube, toward: DVec3) -> f64 {
    let straight = |guide: &StraightGuide| {
        let reflectance = guide.reflectance.brightest();
        let tangent = toward.truncate().length() / toward.z.max(1e-9);
        transmittance::likely_transmission(guide.length / (2.0 * guide.radius), tangent, reflectance)
    };
    match &tube.guide {
        Guide::Straight(guide) => straight(guide),
        Guide::Domed(guide) => match &guide.pipe {
            PipeBelow::Straight(pipe) => {
                // most light that passes the near side but not the aperture leaves on the far side
                let aperture = PI * pipe.radius * pipe.radius * toward.z.max(0.0);
                let silhouette = tube.guide.projected_area_m2(-toward);
                straight(pipe) * (aperture / silhouette + FAR_SIDE_REFLECTANCE).min(1.0)
            }
            PipeBelow::Bent(_) => 1.0,
        },
        Guide::Bent(_) | Guide::Mesh(_) => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every source gets photons, and no photon is lost, whatever the number of sources and also where one of them has nearly all the
    /// light.
    #[test]
    fn every_source_has_photons() {
        for photons in [1, 64, 128, 512, 8192] {
            for sources in [1, 2, 16, 100, 400] {
                for large in [1.0, 40.0, 1e9] {
                    for place in [0, sources / 2, sources - 1] {
                        let mut fluxes = vec![1.0; sources];
                        fluxes[place] = large;
                        let divided = divided(photons, &fluxes);
                        assert!(divided.iter().all(|photons| *photons >= 1), "{photons} {sources} {large}");
                        assert_eq!(divided.iter().sum::<u64>(), photons.max(LEAST_PHOTONS * sources as u64));
                    }
                }
            }
        }
        assert!(divided(64, &[]).is_empty());
        // half of an eighth evenly, and the rest by flux
        assert_eq!(divided(1000, &[1.0, 3.0]), [281, 719]);
    }
}
