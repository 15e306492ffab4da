//! Direct light of patches that does not come from Lambertian openings: that of luminaires, and of sky and sun through clear zones.

use rayon::prelude::*;

use super::patch_rays::{RAYS, variance_of_sum};
use crate::guide::RayCount;
use crate::integrator::backward::clear_zones::through_clear_zones;
use crate::optics::Spectrum;
use crate::sampling::{Key, PathRandom};
use crate::traceable::luminaire::TraceableLuminaire;
use crate::traceable::{Mirrors, SurfacePoint, TraceableScene};

/// Estimates the illuminances in lx of patches from the light at a point of each of their parts, and the variances of these estimates by
/// luminance in lx^2. The light of sky and sun through clear zones of straight tubes counts if this is asked for.
pub(super) fn other_light<const C: usize>(
    (scene, mirrors, with_clear_zones): (&TraceableScene, &Mirrors, bool),
    patches: &[[SurfacePoint; RAYS]],
) -> Vec<(Spectrum<C>, f64)> {
    let key = Key::new(0).child(3);
    let of_patch = |(number, points): (usize, &[SurfacePoint; RAYS])| {
        let mut random = PathRandom::new(key.child(number as u64));
        let of_parts = points.map(|point| {
            let mut sum = Spectrum::ZERO;
            if with_clear_zones {
                let numbers = (random.uniform2(), &mut random);
                let cosine = |toward| point.cosine(toward);
                sum += through_clear_zones::<C>(scene, point, cosine, numbers, &mut RayCount::default());
            }
            for luminaire in scene.luminaires.iter().filter(|luminaire| luminaire.emits()) {
                let source = luminaire.point(random.uniform2());
                if scene.visible(source, Some(luminaire.surface), point.position, point.surface) {
                    sum += luminaire.irradiance(point.position, point.normal);
                }
                sum += by_mirrors((scene, mirrors), luminaire, &point, &mut random);
            }
            sum * (1.0 / RAYS as f64)
        });
        let variance = variance_of_sum(&of_parts.map(|lux| lux.luminance()));
        (of_parts.into_iter().fold(Spectrum::ZERO, |sum, lux| sum + lux), variance)
    };
    patches.par_iter().enumerate().map(of_patch).collect()
}

/// Estimates the illuminance in lx of a point by a luminaire and one random chain of mirrors.
fn by_mirrors<const C: usize>(
    (scene, mirrors): (&TraceableScene, &Mirrors),
    luminaire: &TraceableLuminaire,
    point: &SurfacePoint,
    random: &mut PathRandom,
) -> Spectrum<C> {
    let Some((chain, probability)) = mirrors.choose(point.position, random.uniform()) else { return Spectrum::ZERO };
    let source = (luminaire.point(random.uniform2()), Some(luminaire.surface));
    let path = scene.mirror_path::<C>((mirrors, chain), (point.position, point.surface), source);
    let (image, normal) = mirrors.image(chain, (point.position, point.normal));
    path.map_or(Spectrum::ZERO, |path| {
        luminaire.irradiance::<C>(image, normal) * path.reflectance * (1.0 / probability)
    })
}
