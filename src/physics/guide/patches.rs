//! Approximation of a sky by 145 parallel beams, as in some light pipe simulations, for comparison with the continuous sky.

use glam::DVec3;

use super::Guide;
use super::performance::{closed, closed_beam};
use super::throughput::{Aim, Effort, Throughput, replicated};
use crate::sampling::Key;
use crate::sky::Sky;
use crate::sky::patches::{SkyPatch, SkyPatches};

/// Computes the light through a guide from a sky made of parallel beams, one from the centre of each of the 145 patches of Tregenza (1987),
/// as Dutton and Shao traced light pipes; light of the ground is left out. Where rays are traced, the patch of each is drawn with a probability in proportion to its light
/// on the guide.
///
/// Comparing with [`sky`](super::performance::sky) shows the error of the division into patches: near the sun the luminance at a patch's
/// centre is not the mean of the patch.
pub fn patch_sky(guide: &Guide, sky: &Sky, key: Key, effort: impl Into<Effort>) -> Throughput {
    let tregenza = SkyPatches::new(1);
    let luminous = |patch: &SkyPatch| (patch.toward, sky.luminance(patch.toward) * patch.solid_angle_sr);
    if closed(guide).is_some() {
        let mut sum = Throughput::nothing();
        // patches of a band follow each other
        let mut last: Option<(f64, Throughput)> = None;
        for (toward, luminous) in tregenza.all().iter().map(luminous) {
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
    let up_to = |patch: &SkyPatch| {
        let (toward, luminous) = luminous(patch);
        let meets = luminous * guide.projected_area_m2(-toward);
        all += meets;
        (toward, luminous / meets, all)
    };
    let patches: Vec<(DVec3, f64, f64)> = tregenza.all().iter().map(up_to).collect();
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
    use super::*;
    use crate::guide::performance::traced_sky;
    use crate::guide::test_pipes::{cie_sky, straight, straight_by_rays};

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
