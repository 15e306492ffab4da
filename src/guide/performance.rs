//! How much light a tube passes: ray-traced transmission of any guide with its collector.
//!
//! Every figure comes from independent randomised Sobol replicates, so that it has a standard error, or from a closed form.
//! Luminances of RGB coefficients are weighted to Y.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec3;

use super::transit::End;
use super::transmittance::{beam_transmission, uniform_sky_transmission};
use super::{Guide, StraightGuide};
use crate::optics::{Mirror, Spectrum};
use crate::sampling::sobol::REPLICATE_LEN;
use crate::sampling::{Key, PathRandom, Replicate, Stream};
use crate::sky::sampler::SkySampler;
use crate::sky::{CieType, Sky, SkyDistribution, direction};
use crate::statistics::Moments;

/// Independent replicates of each figure.
const REPLICATES: u64 = 8;

/// A ratio of two estimated quantities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transmission {
    /// 0..=1; zero when nothing arrives at the collector.
    pub value: f64,
    /// Standard error of the ratio to first order, from the replicates.
    pub standard_error: f64,
}

/// Light of one kind through a tube: what reaches the collector from outside and what arrives at the diffuser's top, per
/// replicate. Of a beam of 1 lx these are effective areas in m2, of a sky fluxes in lm.
#[derive(Clone, Debug, Default)]
pub struct Throughput {
    replicates: Vec<(f64, f64)>,
}

impl Throughput {
    /// Light that reaches the collector.
    pub fn entering(&self) -> Moments {
        self.moments(|(entering, _)| entering)
    }

    /// Light that arrives at the diffuser's top.
    pub fn arriving(&self) -> Moments {
        self.moments(|(_, arriving)| arriving)
    }

    /// Ratio of the light that arrives to the light that enters, with the error of a ratio of means.
    pub fn transmission(&self) -> Transmission {
        let (entering, arriving) = (self.entering().mean, self.arriving().mean);
        if entering <= 0.0 {
            return Transmission { value: 0.0, standard_error: 0.0 };
        }
        let value = arriving / entering;
        let residuals = self.moments(|(entering, arriving)| arriving - value * entering);
        Transmission { value, standard_error: residuals.standard_error() / entering }
    }

    fn moments(&self, of: impl Fn((f64, f64)) -> f64) -> Moments {
        let mut moments = Moments::default();
        self.replicates.iter().for_each(|replicate| moments.push(of(*replicate)));
        moments
    }

    /// Weighted sum of replicates that were drawn with independent keys.
    fn add(&mut self, other: &Self, factor: f64) {
        for (sum, part) in self.replicates.iter_mut().zip(&other.replicates) {
            sum.0 += factor * part.0;
            sum.1 += factor * part.1;
        }
    }
}

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
pub fn beam(guide: &Guide, toward: DVec3, key: Key, rays: u64) -> Throughput {
    closed_beam(guide, toward).unwrap_or_else(|| traced_beam(guide, toward, key, rays))
}

/// [`beam`] where it has a closed form, which is the same at all azimuths.
fn closed_beam(guide: &Guide, toward: DVec3) -> Option<Throughput> {
    let Guide::Straight(StraightGuide {
        radius,
        length,
        reflectance: Mirror::Constant(reflectance),
        collector_transmittance,
    }) = guide
    else {
        return None;
    };
    let tangent = toward.truncate().length() / toward.z;
    let entering = guide.projected_area_m2(-toward);
    if entering <= 0.0 {
        return Some(Throughput { replicates: vec![(0.0, 0.0); REPLICATES as usize] });
    }
    let passed =
        by_channel(*reflectance, |reflectance| beam_transmission(length / (2.0 * radius), tangent, reflectance));
    let share = Spectrum::<3>(passed) * Spectrum::from_rgb(*collector_transmittance);
    Some(Throughput { replicates: vec![(entering, entering * share.luminance()); REPLICATES as usize] })
}

/// Beams of 1 lx from one altitude and `azimuths` of them, evenly from `azimuth` on (rad): [`beam`] of each.
pub fn beams_around(guide: &Guide, altitude: f64, azimuth: f64, azimuths: u32, key: Key, rays: u64) -> Vec<Throughput> {
    if let Some(closed) = closed_beam(guide, direction(altitude, azimuth)) {
        return vec![closed; azimuths as usize];
    }
    let at = |turn: u32| {
        let toward = direction(altitude, azimuth + TAU * f64::from(turn) / f64::from(azimuths));
        traced_beam(guide, toward, key.child(u64::from(turn)), rays)
    };
    (0..azimuths).map(at).collect()
}

/// Parallel light of 1 lx (normal to itself) from the unit vector `toward`, by `rays` rays in each of 8 replicates.
pub fn traced_beam(guide: &Guide, toward: DVec3, key: Key, rays: u64) -> Throughput {
    replicated(key, rays, |[u, v, ..], random| follow(guide, [u, v], toward, random))
}

/// A function of each channel's value, computed once for equal ones.
fn by_channel([red, green, blue]: [f64; 3], of: impl Fn(f64) -> f64) -> [f64; 3] {
    let of_red = of(red);
    let other = |value: f64| if value == red { of_red } else { of(value) };
    [of_red, other(green), other(blue)]
}

/// The light of a sky, integrated directly: directions by importance, `rays` rays in each of 8 replicates. Empty without
/// light that could enter.
pub fn sky(guide: &Guide, sky: &Sky, key: Key, rays: u64) -> Throughput {
    let Some(sampler) = SkySampler::new(sky, |toward| guide.projected_area_m2(-toward)) else {
        return Throughput { replicates: vec![(0.0, 0.0); REPLICATES as usize] };
    };
    let sampler = sampler.with_cone(guide.narrow_cone());
    replicated(key, rays, |[a, b, u, v], random| {
        let (toward, density) = sampler.sample([a, b]);
        let (enters, arrives) = follow(guide, [u, v], toward, random);
        let luminance = sky.luminance(toward) / density;
        (luminance * enters, luminance * arrives)
    })
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
pub fn uniform_sky(guide: &Guide, key: Key, rays: u64) -> Transmission {
    let distribution = SkyDistribution::new(CieType::UNIFORM, DVec3::Z);
    let uniform = Sky { distribution, zenith_luminance_cd_m2: 1.0 };
    match guide {
        Guide::Straight(StraightGuide {
            radius,
            length,
            reflectance: Mirror::Constant(reflectance),
            collector_transmittance,
        }) => {
            let of = |reflectance: f64| uniform_sky_transmission(length / (2.0 * radius), reflectance);
            let passed = Spectrum::<3>(by_channel(*reflectance, of)) * Spectrum::from_rgb(*collector_transmittance);
            Transmission { value: passed.luminance(), standard_error: 0.0 }
        }
        _ => sky(guide, &uniform, key, rays).transmission(),
    }
}

/// The light of a sky that is made of parallel beams, one from the middle of each of the 145 patches of Tregenza (1987),
/// as Dutton and Shao traced light pipes; `rays` rays per patch in each of 8 replicates.
///
/// Against [`sky`] it shows what the division into patches costs: near the sun the luminance of a patch's middle is not
/// that of the patch.
pub fn patch_sky(guide: &Guide, sky: &Sky, key: Key, rays: u64) -> Throughput {
    let mut sum = Throughput { replicates: vec![(0.0, 0.0); REPLICATES as usize] };
    // patches of a band follow each other
    let mut closed: Option<(f64, Throughput)> = None;
    for (number, patch) in tregenza_patches().enumerate() {
        let luminous = sky.luminance(patch.toward) * patch.solid_angle_sr;
        if closed.as_ref().is_none_or(|(height, _)| *height != patch.toward.z) {
            closed = closed_beam(guide, patch.toward).map(|beam| (patch.toward.z, beam));
        }
        match &closed {
            Some((_, beam)) => sum.add(beam, luminous),
            None => sum.add(&traced_beam(guide, patch.toward, key.child(number as u64), rays), luminous),
        }
    }
    sum
}

/// Means over `rays` Sobol points of what `one` says enters and arrives, in each replicate.
fn replicated(key: Key, rays: u64, one: impl Fn([f64; 4], &mut PathRandom) -> (f64, f64)) -> Throughput {
    debug_assert!(rays <= REPLICATE_LEN, "{rays} rays are more than one randomisation has");
    let replicates = (0..REPLICATES).map(|number| {
        let stream = key.child(number);
        let mut random = PathRandom::new(stream.stream(Stream::ThroughputChoices, 0));
        let (mut entering, mut arriving) = (0.0, 0.0);
        for ray in 0..rays {
            let (replicate, index) = Replicate::of(stream, ray);
            let (enters, arrives) = one(replicate.point(index, 0), &mut random);
            entering += enters;
            arriving += arrives;
        }
        (entering / rays as f64, arriving / rays as f64)
    });
    Throughput { replicates: replicates.collect() }
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
/// transmission of a straight tube of a length. `None` when not even a tube of `longest_m` loses as much, or a tube
/// without length loses more.
///
/// ```
/// let halved_every_metre = |length: f64| 0.5f64.powf(length);
/// let length = skyduct::guide::performance::equivalent_length_m(0.125, 100.0, halved_every_metre).unwrap();
/// assert!((length - 3.0).abs() < 1e-3);
/// ```
pub fn equivalent_length_m(target: f64, longest_m: f64, transmission_of: impl Fn(f64) -> f64) -> Option<f64> {
    let (mut short, mut long) = (0.0, longest_m);
    if transmission_of(longest_m) > target || transmission_of(longest_m * 1e-9) < target {
        return None;
    }
    while long - short > 1e-4 * long {
        let middle = 0.5 * (short + long);
        if transmission_of(middle) > target { short = middle } else { long = middle }
    }
    Some(0.5 * (short + long))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::guide::transmittance::sky_exitance;
    use crate::guide::{BentGuide, StraightGuide};
    use crate::optics::mirror::Mirror;
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
            let through = sky(&guide, &sky_light, Key::new(5), 4096);
            let exact = sky_exitance(&sky_light, 1.0 / (2.0 * RADIUS), 0.98);
            let arriving = through.arriving();
            let per_area = arriving.mean / (PI * RADIUS * RADIUS);
            let error = arriving.standard_error() / (PI * RADIUS * RADIUS);
            assert!((per_area - exact).abs() < 4.0 * error, "type {number}: {per_area} +- {error}, {exact}");
        }
        let uniform = cie_sky(5);
        let (direct, patches) =
            (sky(&guide, &uniform, Key::new(5), 4096), patch_sky(&guide, &uniform, Key::new(6), 128));
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
        let traced = sky(&pipe, &cie_sky(5), Key::new(7), 4096).transmission();
        let exact = uniform_sky(&pipe, Key::new(7), 4096).value;
        assert!((traced.value - exact).abs() < 4.0 * traced.standard_error, "{traced:?} {exact}");
        assert!(traced.standard_error < 2e-3);
    }

    /// A tube loses what a straight tube of the same length loses when it does not bend, and more when it does.
    #[test]
    fn bends_count_as_extra_length() {
        let uniform = cie_sky(5);
        let of_straight = |length: f64| sky(&straight(length, 0.98), &uniform, Key::new(1), 1024).transmission().value;
        let bent = |bend: f64| {
            let (sin, cos) = bend.to_radians().sin_cos();
            let axes = [(0.5, DVec3::Z), (0.5, DVec3::new(sin, 0.0, cos))];
            Guide::Bent(BentGuide::new(RADIUS, &axes, Mirror::Constant([0.98; 3]), [1.0; 3]))
        };
        let length = |guide: &Guide| {
            let target = sky(guide, &uniform, Key::new(1), 1024).transmission().value;
            equivalent_length_m(target, 100.0, of_straight).unwrap()
        };
        assert!((length(&bent(0.0)) - 1.0).abs() < 1e-3);
        assert!(length(&bent(45.0)) > 1.2);
        assert_eq!(equivalent_length_m(0.999_999, 1.0, |length| 1.0 - 0.1 * length).map(|l| l < 1e-4), Some(true));
        assert_eq!(equivalent_length_m(0.5, 1.0, |_| 0.9), None);
    }
}
