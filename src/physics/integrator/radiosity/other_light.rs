//! Direct light of patches that does not come from Lambertian openings: that of luminaires, and of sky and sun through clear zones.

use rayon::prelude::*;

use crate::guide::RayCount;
use crate::integrator::backward::clear_zones::through_clear_zones;
use crate::optics::Spectrum;
use crate::sampling::{Key, PathRandom};
use crate::traceable::{SurfacePoint, TraceableScene};

/// Estimates the illuminances in lx of patches from the light at some points of each. The light of sky and sun through clear zones of straight
/// tubes counts if this is asked for.
pub(super) fn other_light<const C: usize>(
    (scene, with_clear_zones): (&TraceableScene, bool),
    patches: &[Vec<SurfacePoint>],
) -> Vec<Spectrum<C>> {
    let key = Key::new(0).child(3);
    let of_patch = |(number, points): (usize, &Vec<SurfacePoint>)| {
        let mut random = PathRandom::new(key.child(number as u64));
        let mut sum = Spectrum::ZERO;
        for point in points {
            if with_clear_zones {
                let numbers = (random.uniform2(), &mut random);
                let cosine = |toward| point.cosine(toward);
                sum += through_clear_zones::<C>(scene, *point, cosine, numbers, &mut RayCount::default());
            }
            for luminaire in scene.luminaires.iter().filter(|luminaire| luminaire.emits()) {
                let source = luminaire.point(random.uniform2());
                if scene.visible(source, Some(luminaire.surface), point.position, point.surface) {
                    sum += luminaire.irradiance(point.position, point.normal);
                }
            }
        }
        sum * (1.0 / points.len().max(1) as f64)
    };
    patches.par_iter().enumerate().map(of_patch).collect()
}
