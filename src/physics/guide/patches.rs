//! Approximation of a sky by 145 parallel beams, as in some light pipe simulations, for comparison with the continuous sky.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec3;

use super::Guide;
use super::performance::{closed, closed_beam};
use super::throughput::{Aim, Effort, Throughput, replicated};
use crate::sampling::Key;
use crate::sky::{Sky, direction};

/// A sky patch that is replaced by one beam.
#[derive(Clone, Copy, Debug)]
pub struct SkyPatch {
    /// Unit vector toward the centre of the patch.
    pub toward: DVec3,
    /// Solid angle of the patch in sr.
    pub solid_angle_sr: f64,
    /// Heights (z) of its lower and upper edge on the unit sphere.
    heights: [f64; 2],
    /// Azimuth of its centre and its width in azimuth, in rad.
    azimuths: [f64; 2],
}

impl SkyPatch {
    /// Samples a unit vector toward a point of the patch, uniform in solid angle, from numbers in 0..1, the first along the azimuth.
    pub(super) fn point(&self, [u, v]: [f64; 2]) -> DVec3 {
        let [lower, upper] = self.heights;
        let z = lower + (upper - lower) * v;
        let (sin, cos) = libm::sincos(self.azimuths[0] + self.azimuths[1] * (u - 0.5));
        let radius = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
        DVec3::new(radius * sin, radius * cos, z)
    }
}

/// Returns the 145 sky patches of Tregenza (1987): seven bands of 12 degrees and the zenith.
///
/// ```
/// use skyduct_physics::guide::patches::tregenza_patches;
///
/// assert_eq!(tregenza_patches().count(), 145);
/// let whole: f64 = tregenza_patches().map(|patch| patch.solid_angle_sr).sum();
/// assert!((whole - std::f64::consts::TAU).abs() < 1e-12);
/// ```
pub fn tregenza_patches() -> impl Iterator<Item = SkyPatch> {
    let bands = [30u32, 30, 24, 24, 18, 12, 6];
    let half_band = 6f64.to_radians();
    let last = FRAC_PI_2 - half_band;
    let patch = |toward: DVec3, heights: [f64; 2], azimuths: [f64; 2]| SkyPatch {
        toward,
        solid_angle_sr: (heights[1] - heights[0]) * azimuths[1],
        heights,
        azimuths,
    };
    let zenith = patch(DVec3::Z, [libm::sin(last), 1.0], [0.0, TAU]);
    bands
        .into_iter()
        .enumerate()
        .flat_map(move |(band, count)| {
            let altitude = half_band * (2.0 * band as f64 + 1.0);
            let heights = [altitude - half_band, altitude + half_band].map(libm::sin);
            let width = TAU / f64::from(count);
            (0..count).map(move |number| {
                let middle = width * f64::from(number);
                patch(direction(altitude, middle), heights, [middle, width])
            })
        })
        .chain(std::iter::once(zenith))
}

/// Computes the light through a guide from a sky made of parallel beams, one from the centre of each of the 145 patches of Tregenza (1987),
/// as Dutton and Shao traced light pipes; light of the ground is left out. Where rays are traced, the patch of each is drawn with a probability in proportion to its light
/// on the guide.
///
/// Comparing with [`sky`](super::performance::sky) shows the error of the division into patches: near the sun the luminance at a patch's
/// centre is not the mean of the patch.
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
    let mut all = 0.0;
    let up_to = |patch: SkyPatch| {
        let (toward, luminous) = luminous(patch);
        let meets = luminous * guide.projected_area_m2(-toward);
        all += meets;
        (toward, luminous / meets, all)
    };
    let patches: Vec<(DVec3, f64, f64)> = tregenza_patches().map(up_to).collect();
    if all <= 0.0 {
        return Throughput::nothing();
    }
    let [found] = replicated(guide, key, effort.into(), |[choice, u, v, _]| {
        let number = patches.partition_point(|(.., up_to)| *up_to <= choice * all).min(patches.len() - 1);
        let (toward, luminous, _) = patches[number];
        Aim { point: [u, v], toward, weights: [luminous * all] }
    });
    found
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::guide::performance::traced_sky;
    use crate::guide::test_pipes::{cie_sky, straight, straight_by_rays};

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

    /// Checks that patches differ from a uniform sky by their centres only, which is little.
    #[test]
    fn patches_of_a_uniform_sky_pass_what_it_passes() {
        let guide = straight(1.0, 0.98);
        let uniform = cie_sky(5);
        let (direct, patches) =
            (traced_sky(&guide, &uniform, Key::new(5), 4096), patch_sky(&guide, &uniform, Key::new(6), 128));
        let (direct, patches) = (direct.transmission(), patches.transmission());
        assert!((direct.value - patches.value).abs() < 5e-3, "{direct:?} {patches:?}");
    }

    /// Compares patches with few rays with the closed form of each beam.
    #[test]
    fn patches_by_few_rays_are_within_their_error() {
        let light = cie_sky(12);
        let effort = Effort { standard_error: 0.01, least: 16, most: 4096 };
        let traced = patch_sky(&straight_by_rays(1.0, 0.9), &light, Key::new(8), effort).transmission();
        let exact = patch_sky(&straight(1.0, 0.9), &light, Key::new(8), 1).transmission();
        assert!((traced.value - exact.value).abs() < 4.0 * traced.standard_error, "{traced:?} {exact:?}");
        assert!(traced.standard_error <= 0.01 && exact.standard_error == 0.0);
    }
}
