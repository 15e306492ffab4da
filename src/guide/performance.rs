//! How much light a tube passes: ray-traced transmission of any guide with its collector.
//!
//! Every figure comes from independent randomised Sobol replicates, so that it has a standard error, or from a closed form.
//! Luminances of RGB coefficients are weighted to Y.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec3;

use super::sky_moments::SkyMoments;
pub use super::throughput::{Effort, Throughput, Transmission};
use super::throughput::{Rays, replicated, until_exact};
use super::transit::End;
use super::transmittance::{beam_transmission, uniform_sky_transmission};
use super::{Guide, StraightGuide};
use crate::optics::{Mirror, Spectrum};
use crate::sampling::{Key, PathRandom, warp};
use crate::sky::sampler::SkySampler;
use crate::sky::{CieType, Sky, SkyDistribution, direction};

/// Parallel light of 1 lx (normal to itself) from the unit vector `toward`: in closed form, with a standard error of 0, through a
/// straight guide under a thin collector whose mirror reflects alike at all angles; else of [`traced_beam`], whose arguments
/// it takes.
///
/// ```
/// use skyduct::guide::performance::beam;
/// use skyduct::guide::{Guide, StraightGuide};
/// use skyduct::optics::Mirror;
/// use skyduct::sampling::Key;
/// use skyduct::sky::direction;
///
/// // 0.98 per reflection, four diameters long, at 60 degrees from the axis (docs/physics/tubes.md)
/// let (reflectance, collector_transmittance) = (Mirror::Constant([0.98; 3]), [0.9; 3]);
/// let pipe = Guide::Straight(StraightGuide { radius: 0.1, length: 0.8, reflectance, collector_transmittance });
/// let through = beam(&pipe, direction(30f64.to_radians(), 2.0), Key::new(0), 16).transmission();
/// assert!((through.value - 0.9 * 0.83912).abs() < 5e-6 && through.standard_error == 0.0);
/// ```
pub fn beam(guide: &Guide, toward: DVec3, key: Key, effort: impl Into<Effort>) -> Throughput {
    closed_beam(guide, toward).unwrap_or_else(|| traced_beam(guide, toward, key, effort))
}

/// A straight guide under a thin collector whose mirror reflects alike at all angles, which has closed forms: its aspect ratio and
/// the reflectance and transmittance of its channels.
fn closed(guide: &Guide) -> Option<(f64, [f64; 3], [f64; 3])> {
    match guide {
        Guide::Straight(StraightGuide {
            radius,
            length,
            reflectance: Mirror::Constant(mirror),
            collector_transmittance,
        }) => Some((length / (2.0 * radius), *mirror, *collector_transmittance)),
        _ => None,
    }
}

/// [`beam`] where it has a closed form, which is the same at all azimuths.
fn closed_beam(guide: &Guide, toward: DVec3) -> Option<Throughput> {
    let (aspect, reflectance, collector_transmittance) = closed(guide)?;
    let tangent = toward.truncate().length() / toward.z;
    let entering = guide.projected_area_m2(-toward);
    if entering <= 0.0 {
        return Some(Throughput::nothing());
    }
    let passed = by_channel(reflectance, |reflectance| beam_transmission(aspect, tangent, reflectance));
    let share = Spectrum::<3>(passed) * Spectrum::from_rgb(collector_transmittance);
    Some(Throughput::exact(entering, entering * share.luminance()))
}

/// Parallel light of 1 lx (normal to itself) from the unit vector `toward`, by rays.
pub fn traced_beam(guide: &Guide, toward: DVec3, key: Key, effort: impl Into<Effort>) -> Throughput {
    let [found] = replicated(key, effort.into(), |[u, v, ..], random| [follow(guide, [u, v], toward, random)]);
    found
}

/// A function of each channel's value, computed once for equal ones.
fn by_channel([red, green, blue]: [f64; 3], of: impl Fn(f64) -> f64) -> [f64; 3] {
    let of_red = of(red);
    let other = |value: f64| if value == red { of_red } else { of(value) };
    [of_red, other(green), other(blue)]
}

/// The light of a sky: in closed form, with a standard error of 0, where [`beam`] has one; else of [`traced_sky`], whose arguments it
/// takes.
pub fn sky(guide: &Guide, sky: &Sky, key: Key, effort: impl Into<Effort>) -> Throughput {
    let Some((aspect, reflectance, collector_transmittance)) = closed(guide) else {
        return traced_sky(guide, sky, key, effort);
    };
    let moments = SkyMoments::new(sky);
    let area = guide.projected_area_m2(-DVec3::Z);
    let passed = by_channel(reflectance, |reflectance| moments.through_straight(aspect, reflectance));
    let arriving = Spectrum::<3>(passed) * Spectrum::from_rgb(collector_transmittance);
    Throughput::exact(area * moments.horizontal_illuminance_lux(), area * arriving.luminance())
}

/// The light of a sky, integrated directly: directions by importance. Empty without light that could enter.
pub fn traced_sky(guide: &Guide, sky: &Sky, key: Key, effort: impl Into<Effort>) -> Throughput {
    let Some(sampler) = SkySampler::new(sky, |toward| guide.projected_area_m2(-toward)) else {
        return Throughput::nothing();
    };
    let sampler = sampler.with_cone(guide.narrow_cone());
    let [found] = replicated(key, effort.into(), |[a, b, u, v], random| {
        let (toward, density) = sampler.sample([a, b]);
        [scaled(follow(guide, [u, v], toward, random), sky.luminance(toward) / density)]
    });
    found
}

/// Transmission of collector and guide under a uniform sky: in closed form, with a standard error of 0, through a straight
/// guide under a thin collector whose mirror reflects alike at all angles; else of [`sky`], whose arguments it takes.
///
/// Of a black pipe as long as 100 of its diameters the sky sees the lower end alone, by the form factor 1 / (4 100^2) to first
/// order, which no ray out of ten thousand finds:
///
/// ```
/// use skyduct::guide::performance::uniform_sky;
/// use skyduct::guide::{Guide, StraightGuide};
/// use skyduct::optics::Mirror;
/// use skyduct::sampling::Key;
///
/// let (reflectance, collector_transmittance) = (Mirror::Constant([0.0; 3]), [1.0; 3]);
/// let pipe = Guide::Straight(StraightGuide { radius: 0.1, length: 20.0, reflectance, collector_transmittance });
/// assert!((uniform_sky(&pipe, Key::new(0), 16).value / 2.499_875e-5 - 1.0).abs() < 1e-6);
/// ```
pub fn uniform_sky(guide: &Guide, key: Key, effort: impl Into<Effort>) -> Transmission {
    let Some((aspect, reflectance, collector_transmittance)) = closed(guide) else {
        let distribution = SkyDistribution::new(CieType::UNIFORM, DVec3::Z);
        let uniform = Sky { distribution, zenith_luminance_cd_m2: 1.0 };
        return traced_sky(guide, &uniform, key, effort).transmission();
    };
    let of = |reflectance: f64| uniform_sky_transmission(aspect, reflectance);
    let passed = Spectrum::<3>(by_channel(reflectance, of)) * Spectrum::from_rgb(collector_transmittance);
    Transmission { value: passed.luminance(), standard_error: 0.0 }
}

/// Transmission under a uniform sky, and the light of a sky: in closed form where [`beam`] has one, else of [`traced_skies`], whose
/// arguments it takes.
pub fn skies(
    guide: &Guide,
    of_job: Option<&Sky>,
    keys: [Key; 2],
    effort: Effort,
) -> (Transmission, Option<Throughput>) {
    if closed(guide).is_some() {
        return (uniform_sky(guide, keys[0], effort), of_job.map(|light| sky(guide, light, keys[1], effort)));
    }
    let (uniform, of_job) = traced_skies(guide, of_job, keys, effort);
    (uniform.transmission(), of_job)
}

/// The light of a uniform sky of 1 cd/m2 and of a sky, by the same rays in directions that suit both, until the transmission of
/// both is as exact as asked; where next to all light that a guide passes comes from a narrow cone, by rays of their own. `keys` are theirs.
pub fn traced_skies(
    guide: &Guide,
    sky: Option<&Sky>,
    keys: [Key; 2],
    effort: Effort,
) -> (Throughput, Option<Throughput>) {
    let distribution = SkyDistribution::new(CieType::UNIFORM, DVec3::Z);
    let uniform = Sky { distribution, zenith_luminance_cd_m2: 1.0 };
    if guide.narrow_cone().is_some() {
        let of_sky = sky.map(|sky| traced_sky(guide, sky, keys[1], effort));
        return (traced_sky(guide, &uniform, keys[0], effort), of_sky);
    }
    let [of_uniform, of_sky] = replicated(keys[0], effort, |[a, b, u, v], random| {
        let (toward, density) = upper_hemisphere([a, b]);
        let light = follow(guide, [u, v], toward, random);
        let luminance = sky.map_or(0.0, |sky| sky.luminance(toward));
        [scaled(light, 1.0 / density), scaled(light, luminance / density)]
    });
    (of_uniform, sky.map(|_| of_sky))
}

/// A direction above the horizon and its density per sr: half of them as the cosine of the zenith angle says, half evenly, because
/// domes see the horizon, too.
fn upper_hemisphere([u, v]: [f64; 2]) -> (DVec3, f64) {
    let toward =
        if u < 0.5 { warp::cosine_hemisphere([2.0 * u, v]) } else { warp::cone([2.0 * u - 1.0, v], FRAC_PI_2) };
    (toward, (toward.z.max(0.0) + 0.5) / TAU)
}

fn scaled((enters, arrives): (f64, f64), factor: f64) -> (f64, f64) {
    (factor * enters, factor * arrives)
}

/// The light of a sky that is made of parallel beams, one from the middle of each of the 145 patches of Tregenza (1987),
/// as Dutton and Shao traced light pipes; `effort` is for each patch, and its error that of their sum.
///
/// Against [`sky`] it shows what the division into patches costs: near the sun the luminance of a patch's middle is not
/// that of the patch.
pub fn patch_sky(guide: &Guide, sky: &Sky, key: Key, effort: impl Into<Effort>) -> Throughput {
    let luminous = |patch: SkyPatch| (patch.toward, sky.luminance(patch.toward) * patch.solid_angle_sr);
    if closed(guide).is_some() {
        let mut sum = Throughput::nothing();
        // patches of a band follow each other
        let mut last: Option<(f64, Throughput)> = None;
        for (toward, luminous) in tregenza_patches().map(luminous) {
            if last.as_ref().is_none_or(|(height, _)| *height != toward.z) {
                last = closed_beam(guide, toward).map(|beam| (toward.z, beam));
            }
            if let Some((_, beam)) = &last {
                sum.add(beam, luminous);
            }
        }
        return sum;
    }
    let rays = |(number, patch): (usize, SkyPatch)| (luminous(patch), Rays::<1>::new(key.child(number as u64)));
    let mut patches: Vec<_> = tregenza_patches().enumerate().map(rays).collect();
    let mut sum = Throughput::nothing();
    until_exact(effort.into(), |count| {
        sum = Throughput::nothing();
        for ((toward, luminous), rays) in &mut patches {
            rays.follow(count, |[u, v, ..], random| [follow(guide, [u, v], *toward, random)]);
            let [beam] = rays.throughputs();
            sum.add(&beam, *luminous);
        }
        sum.transmission().standard_error
    });
    sum
}

/// Beams of 1 lx of one altitude.
#[derive(Clone, Debug)]
pub struct BeamsOfAltitude {
    /// The beam from the first azimuth.
    pub first: Throughput,
    /// Mean over the azimuths of the transmissions.
    pub mean: Transmission,
}

/// Rays of the beam from the first azimuth, which has a figure of its own, over those from the others.
const RAYS_OF_FIRST: u64 = 8;

/// Beams of 1 lx from each of `altitudes` and from `azimuths` azimuths, evenly from `azimuth` on (rad): [`beam`] of each. `effort` is for
/// the azimuths beside the first one; its error is the root mean square over the altitudes, of the means and of the first azimuth.
pub fn beams_over(
    guide: &Guide,
    altitudes: &[f64],
    [azimuth, azimuths]: [f64; 2],
    key: Key,
    effort: Effort,
) -> Vec<BeamsOfAltitude> {
    let turns = azimuths as u64;
    let toward = |altitude: f64, turn: u64| direction(altitude, azimuth + TAU * turn as f64 / azimuths);
    let closed = altitudes.iter().map(|altitude| closed_beam(guide, toward(*altitude, 0)));
    let closed = closed.map(|beam| beam.map(|first| BeamsOfAltitude { mean: first.transmission(), first }));
    if let Some(closed) = closed.collect::<Option<Vec<_>>>() {
        return closed;
    }
    let rays = |number: usize, turn: u64| Rays::<1>::new(key.child(number as u64).child(turn));
    let mut beams: Vec<Vec<Rays<1>>> =
        (0..altitudes.len()).map(|number| (0..turns).map(|turn| rays(number, turn)).collect()).collect();
    let mut follow_all = |turns: std::ops::Range<usize>, count: u64| {
        for (altitude, beams) in altitudes.iter().zip(&mut beams) {
            for turn in turns.clone() {
                let toward = toward(*altitude, turn as u64);
                beams[turn].follow(count, |[u, v, ..], random| [follow(guide, [u, v], toward, random)]);
            }
        }
        let found = beams.iter().map(|beams| beams_of_altitude(beams));
        found.collect::<Vec<_>>()
    };
    let mean_square = |errors: &mut dyn Iterator<Item = f64>| {
        (errors.map(|error| error * error).sum::<f64>() / altitudes.len().max(1) as f64).sqrt()
    };
    let mut found = Vec::new();
    let of_first = Effort { least: (RAYS_OF_FIRST * effort.least).min(effort.most), ..effort };
    until_exact(of_first, |count| {
        found = follow_all(0..1, count);
        mean_square(&mut found.iter().map(|beams| beams.first.transmission().standard_error))
    });
    until_exact(effort, |count| {
        found = follow_all(0..turns as usize, count);
        mean_square(&mut found.iter().map(|beams| beams.mean.standard_error))
    });
    found
}

fn beams_of_altitude(beams: &[Rays<1>]) -> BeamsOfAltitude {
    let beams: Vec<Throughput> = beams.iter().map(|beam| beam.throughputs()).map(|[beam]| beam).collect();
    let mean = Transmission::mean(&beams);
    BeamsOfAltitude { first: beams.into_iter().next().unwrap_or_else(Throughput::nothing), mean }
}

/// Area (m2) that one ray stands for, if it reaches the collector, and the same times the share that arrives.
fn follow(guide: &Guide, point: [f64; 2], toward: DVec3, random: &mut PathRandom) -> (f64, f64) {
    let Some(entry) = guide.entry(point, -toward) else { return (0.0, 0.0) };
    let transit = guide.down::<3>(entry.position, -toward, random);
    if !transit.entered {
        return (0.0, 0.0);
    }
    let share = if transit.end == End::Opening { Spectrum::luminance(&transit.weight()) } else { 0.0 };
    (entry.projected_area_m2, entry.projected_area_m2 * share)
}

/// A patch of the sky that is taken as one beam.
#[derive(Clone, Copy, Debug)]
pub struct SkyPatch {
    /// Unit vector toward its middle.
    pub toward: DVec3,
    /// Solid angle of the patch in sr.
    pub solid_angle_sr: f64,
}

/// The 145 patches of Tregenza (1987): seven bands of 12 degrees and the zenith.
///
/// ```
/// use skyduct::guide::performance::tregenza_patches;
///
/// assert_eq!(tregenza_patches().count(), 145);
/// let whole: f64 = tregenza_patches().map(|patch| patch.solid_angle_sr).sum();
/// assert!((whole - std::f64::consts::TAU).abs() < 1e-12);
/// ```
pub fn tregenza_patches() -> impl Iterator<Item = SkyPatch> {
    let bands = [30u32, 30, 24, 24, 18, 12, 6];
    let half_band = 6f64.to_radians();
    let last = FRAC_PI_2 - half_band;
    let zenith = SkyPatch { toward: DVec3::Z, solid_angle_sr: TAU * (1.0 - libm::sin(last)) };
    bands
        .into_iter()
        .enumerate()
        .flat_map(move |(band, count)| {
            let altitude = half_band * (2.0 * band as f64 + 1.0);
            let solid_angle_sr =
                TAU * (libm::sin(altitude + half_band) - libm::sin(altitude - half_band)) / f64::from(count);
            (0..count).map(move |patch| SkyPatch {
                toward: direction(altitude, TAU * f64::from(patch) / f64::from(count)),
                solid_angle_sr,
            })
        })
        .chain(std::iter::once(zenith))
}

/// Length of the straight tube that passes as much light as `target`, in metres, to 1e-4 of it; `transmission_of` the
/// transmission of a straight tube of a length, which falls with it, and `about_m` a length to begin at. `None` when not even a tube of
/// 100 times that loses as much, or next to no length loses more.
///
/// ```
/// let halved_every_metre = |length: f64| 0.5f64.powf(length);
/// let length = skyduct::guide::performance::equivalent_length_m(0.125, 1.0, halved_every_metre).unwrap();
/// assert!((length - 3.0).abs() < 3e-4);
/// ```
pub fn equivalent_length_m(target: f64, about_m: f64, transmission_of: impl Fn(f64) -> f64) -> Option<f64> {
    let excess = |length: f64| transmission_of(length) / target - 1.0;
    // an end where more passes, and one where less does
    let (mut short, mut long) = ((about_m, excess(about_m)), (about_m, f64::NAN));
    if short.1 > 0.0 {
        loop {
            long = ((2.0 * short.0).min(LONGEST * about_m), 0.0);
            long.1 = excess(long.0);
            if long.1 <= 0.0 {
                break;
            }
            if long.0 >= LONGEST * about_m {
                return None;
            }
            short = long;
        }
    } else {
        while short.1 <= 0.0 {
            if short.0 < SHORTEST * about_m {
                return None;
            }
            long = short;
            short = (0.5 * long.0, excess(0.5 * long.0));
        }
    }
    // false position, where the value of an end that stays is halved
    let between = |short: (f64, f64), long: (f64, f64)| short.0 + (long.0 - short.0) * short.1 / (short.1 - long.1);
    for _ in 0..MOST_STEPS {
        let length = between(short, long);
        let found = (length, excess(length));
        let step = if found.1 > 0.0 { length - short.0 } else { long.0 - length };
        if found.1 > 0.0 {
            (short, long.1) = (found, 0.5 * long.1);
        } else {
            (long, short.1) = (found, 0.5 * short.1);
        }
        if step < 2e-5 * length {
            break;
        }
    }
    Some(between(short, long))
}

/// Lengths of equivalent straight tubes, over those to begin at.
const LONGEST: f64 = 100.0;
const SHORTEST: f64 = 1e-9;

/// Steps after which an equivalent length is exact to the last digit.
const MOST_STEPS: usize = 64;

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;
    use std::sync::Arc;

    use super::*;
    use crate::guide::dome::Pipe;
    use crate::guide::transmittance::sky_exitance;
    use crate::guide::{BentGuide, DomedGuide, StraightGuide};
    use crate::optics::mirror::{Mirror, MirrorTable};
    use crate::sky::{CieType, SkyDistribution};

    const RADIUS: f64 = 0.127;

    fn straight(length: f64, reflectance: f64) -> Guide {
        let reflectance = Mirror::Constant([reflectance; 3]);
        Guide::Straight(StraightGuide { radius: RADIUS, length, reflectance, collector_transmittance: [1.0; 3] })
    }

    fn cie_sky(number: u8) -> Sky {
        let distribution = SkyDistribution::new(CieType::new(number).unwrap(), direction(35f64.to_radians(), 2.0));
        Sky { distribution, zenith_luminance_cd_m2: 1000.0 }
    }

    #[test]
    fn patches_cover_the_sky() {
        let patches: Vec<_> = tregenza_patches().collect();
        assert_eq!(patches.len(), 145);
        let whole: f64 = patches.iter().map(|patch| patch.solid_angle_sr).sum();
        assert!((whole / TAU - 1.0).abs() < 1e-12);
        // the middle of a band overestimates the horizontal illuminance of a uniform sky by 1 / cos(half a band)
        let half_band = 6f64.to_radians();
        let bands: f64 = patches[..144].iter().map(|patch| patch.solid_angle_sr * patch.toward.z).sum();
        let cap = PI * half_band.sin().powi(2);
        assert!(((bands * half_band.cos() + cap) / PI - 1.0).abs() < 1e-12);
    }

    /// Traced beams against the exact series, within 4 standard errors.
    #[test]
    fn beams_agree_with_the_exact_series() {
        for (altitude_deg, reflectance) in [(15.0f64, 0.98), (35.0, 0.95), (60.0, 0.98), (85.0, 0.9)] {
            let altitude = altitude_deg.to_radians();
            let through = traced_beam(&straight(1.0, reflectance), direction(altitude, 0.4), Key::new(3), 512);
            let traced = through.transmission();
            let exact = beam_transmission(1.0 / (2.0 * RADIUS), 1.0 / altitude.tan(), reflectance);
            assert!((traced.value - exact).abs() < 4.0 * traced.standard_error, "{altitude_deg}: {traced:?} {exact}");
            assert!(traced.standard_error < 2e-3);
            let area = PI * RADIUS * RADIUS * altitude.sin();
            assert!((through.entering().mean / area - 1.0).abs() < 1e-12);
        }
    }

    /// The direct integral against the quadrature of the exact series; the patches differ from it by their middles only:
    /// little under a uniform sky.
    #[test]
    fn skies_agree_with_quadrature() {
        let guide = straight(1.0, 0.98);
        for number in [1, 5, 12] {
            let sky_light = cie_sky(number);
            let through = traced_sky(&guide, &sky_light, Key::new(5), 4096);
            let exact = sky_exitance(&sky_light, 1.0 / (2.0 * RADIUS), 0.98);
            let arriving = through.arriving();
            let per_area = arriving.mean / (PI * RADIUS * RADIUS);
            let error = arriving.standard_error() / (PI * RADIUS * RADIUS);
            assert!((per_area - exact).abs() < 4.0 * error, "type {number}: {per_area} +- {error}, {exact}");
        }
        let uniform = cie_sky(5);
        let (direct, patches) =
            (traced_sky(&guide, &uniform, Key::new(5), 4096), patch_sky(&guide, &uniform, Key::new(6), 128));
        let (direct, patches) = (direct.transmission(), patches.transmission());
        assert!((direct.value - patches.value).abs() < 5e-3, "{direct:?} {patches:?}");
    }

    /// Very long pipes under a uniform sky, where next to all light is lost: rays near the axis alone count, for which
    /// cos(theta) is 1, so that T = (3/4) / a^2 integral 2 x g(x) dx with the aspect ratio a and g(x) = R^N (1 - (1-R)(x-N)),
    /// N = floor(x), but for 1 / a^2 of it (the integral of Swift and Smith, exchanged with that over the sky).
    #[test]
    fn uniform_skies_through_long_and_dull_pipes() {
        for (aspect, reflectance) in [(100.0, 0.0), (1000.0, 0.0), (10_000.0, 0.5), (10_000.0, 0.9)] {
            let loss: f64 = 1.0 - reflectance;
            let powers = |n: i32| f64::powi(reflectance, n);
            let moment: f64 =
                (0..2000).map(|n| powers(n) * (2.0 * f64::from(n) * (1.0 - 0.5 * loss) + 1.0 - 2.0 / 3.0 * loss)).sum();
            let expected = 0.75 * moment / (aspect * aspect);
            let Transmission { value, standard_error } =
                uniform_sky(&straight(2.0 * RADIUS * aspect, reflectance), Key::new(1), 2048);
            // 1 / a^2, times twice the mean square of x: at most 1 without reflections, and 6 / ln(R)^2 by many
            let tolerance = 1e-6 + 2.0 * (1.0 + 6.0 / reflectance.ln().powi(2)) / (aspect * aspect);
            assert!((value / expected - 1.0).abs() < tolerance, "{aspect} {reflectance}: {value} {expected}");
            assert_eq!(standard_error, 0.0);
        }
    }

    /// The closed form with colours of mirror and collector against traced rays, within 4 standard errors.
    #[test]
    fn uniform_skies_in_colours_agree_with_traced_rays() {
        let reflectance = Mirror::Constant([0.98, 0.95, 0.9]);
        let pipe = Guide::Straight(StraightGuide {
            radius: RADIUS,
            length: 1.0,
            reflectance,
            collector_transmittance: [0.9, 0.8, 0.7],
        });
        let traced = traced_sky(&pipe, &cie_sky(5), Key::new(7), 4096).transmission();
        let exact = uniform_sky(&pipe, Key::new(7), 4096).value;
        assert!((traced.value - exact).abs() < 4.0 * traced.standard_error, "{traced:?} {exact}");
        assert!(traced.standard_error < 2e-3);
    }

    /// A straight pipe of one reflectance that is followed by rays all the same, as its mirror has a table.
    fn straight_by_rays(length: f64, reflectance: f64) -> Guide {
        let table = MirrorTable::new(&[(0.0, [reflectance; 3]), (FRAC_PI_2, [reflectance; 3])]).unwrap();
        let reflectance = Mirror::ByAngle(Arc::new(table));
        Guide::Straight(StraightGuide { radius: RADIUS, length, reflectance, collector_transmittance: [1.0; 3] })
    }

    /// As few rays as an error allows: each altitude is within 4 told errors of the exact series, all together as far off as the errors
    /// say (chi-squared of 18 terms, false alarm rate 1e-4), and the errors are what was asked for.
    #[test]
    fn beams_by_few_rays_are_within_their_errors() {
        let altitudes: Vec<f64> = (1..=18).map(|step| f64::from(5 * step).to_radians()).collect();
        for (reflectance, asked) in [(0.9, 0.02), (0.98, 0.03), (0.7, 0.01)] {
            let effort = Effort { standard_error: asked, least: 1, most: 1024 };
            let beams = beams_over(&straight_by_rays(1.0, reflectance), &altitudes, [0.3, 8.0], Key::new(4), effort);
            let (mut squares, mut told) = ([0.0; 2], [0.0; 2]);
            for (altitude, beams) in altitudes.iter().zip(&beams) {
                let exact = beam_transmission(1.0 / (2.0 * RADIUS), 1.0 / altitude.tan(), reflectance);
                for (index, found) in [beams.first.transmission(), beams.mean].into_iter().enumerate() {
                    let error = found.standard_error;
                    assert!((found.value - exact).abs() < 4.0 * error, "{altitude}: {found:?} {exact}");
                    squares[index] += (found.value - exact).powi(2) / (error * error);
                    told[index] += error * error / altitudes.len() as f64;
                }
            }
            assert!(squares.iter().all(|sum| *sum < 46.0), "{reflectance}: {squares:?}");
            assert!(told.iter().all(|told| told.sqrt() <= asked), "{reflectance}: {told:?}");
        }
    }

    /// The same rays for both skies against rays of each sky's own, within 4 combined errors; the larger error is what was asked for.
    #[test]
    fn skies_that_share_rays_agree_with_skies_alone() {
        let (sin, cos) = 40f64.to_radians().sin_cos();
        let axes = [(0.5, DVec3::Z), (0.5, DVec3::new(sin, 0.0, cos))];
        let bent = BentGuide::new(RADIUS, &axes, Mirror::Constant([0.95; 3]), [0.9; 3]);
        let domed = DomedGuide::new(Pipe::Bent(bent.clone()), 1.49, 0.003, 0.0);
        for guide in [Guide::Bent(bent), Guide::Domed(Box::new(domed)), straight_by_rays(1.0, 0.98)] {
            for number in [1, 12, 14] {
                let of_job = cie_sky(number);
                let effort = Effort { standard_error: 0.004, least: 16, most: 8192 };
                let (uniform, shared) = traced_skies(&guide, Some(&of_job), [Key::new(1), Key::new(2)], effort);
                let alone = [
                    traced_sky(&guide, &cie_sky(5), Key::new(3), 2048),
                    traced_sky(&guide, &of_job, Key::new(4), 2048),
                ];
                for (few, many) in [uniform, shared.unwrap()].iter().zip(&alone) {
                    let (few, many) = (few.transmission(), many.transmission());
                    let error = few.standard_error.hypot(many.standard_error);
                    assert!((few.value - many.value).abs() < 4.0 * error, "type {number}: {few:?} {many:?}");
                    assert!(few.standard_error <= 0.004, "type {number}: {few:?}");
                }
            }
        }
    }

    /// Closed forms of skies through coloured pipes against rays, flux by flux, within 4 standard errors.
    #[test]
    fn skies_in_closed_form_agree_with_rays() {
        let reflectance = Mirror::Constant([0.98, 0.95, 0.9]);
        let collector_transmittance = [0.9, 0.8, 0.7];
        let pipe = Guide::Straight(StraightGuide { radius: RADIUS, length: 1.0, reflectance, collector_transmittance });
        for number in [1, 5, 9, 12, 15, 16] {
            let light = cie_sky(number);
            let (exact, traced) = (sky(&pipe, &light, Key::new(0), 1), traced_sky(&pipe, &light, Key::new(7), 4096));
            for (exact, traced) in [(exact.entering(), traced.entering()), (exact.arriving(), traced.arriving())] {
                let tolerance = 4.0 * traced.standard_error() + 1e-5 * exact.mean;
                assert!((exact.mean - traced.mean).abs() < tolerance, "type {number}: {exact:?} {traced:?}");
            }
            assert_eq!(exact.transmission().standard_error, 0.0);
        }
    }

    /// Patches by few rays against the closed form of each beam.
    #[test]
    fn patches_by_few_rays_are_within_their_error() {
        let light = cie_sky(12);
        let effort = Effort { standard_error: 0.01, least: 1, most: 32 };
        let traced = patch_sky(&straight_by_rays(1.0, 0.9), &light, Key::new(8), effort).transmission();
        let exact = patch_sky(&straight(1.0, 0.9), &light, Key::new(8), 1).transmission();
        assert!((traced.value - exact.value).abs() < 4.0 * traced.standard_error, "{traced:?} {exact:?}");
        assert!(traced.standard_error <= 0.01 && exact.standard_error == 0.0);
    }

    /// A tube loses what a straight tube of the same length loses when it does not bend, and more when it does.
    #[test]
    fn bends_count_as_extra_length() {
        let uniform = cie_sky(5);
        let of_straight =
            |length: f64| traced_sky(&straight(length, 0.98), &uniform, Key::new(1), 1024).transmission().value;
        let bent = |bend: f64| {
            let (sin, cos) = bend.to_radians().sin_cos();
            let axes = [(0.5, DVec3::Z), (0.5, DVec3::new(sin, 0.0, cos))];
            Guide::Bent(BentGuide::new(RADIUS, &axes, Mirror::Constant([0.98; 3]), [1.0; 3]))
        };
        let length = |guide: &Guide| {
            let target = sky(guide, &uniform, Key::new(1), 1024).transmission().value;
            equivalent_length_m(target, 1.0, of_straight).unwrap()
        };
        assert!((length(&bent(0.0)) - 1.0).abs() < 1e-3);
        assert!(length(&bent(45.0)) > 1.2);
        assert_eq!(equivalent_length_m(0.999_999, 1.0, |length| 1.0 - 0.1 * length).map(|l| l < 1e-4), Some(true));
        assert_eq!(equivalent_length_m(0.5, 1.0, |_| 0.9), None);
    }
}
