//! Light that passes a closure unscattered, followed backward: from a sensor through the opening and up the guide.

use glam::DVec3;

use super::through_opening::{Backward, Choice};
use crate::guide::RayCount;
use crate::integrator::pass_size::PassSize;
use crate::sampling::{Key, PathRandom, Replicate, Stream};
use crate::scene::Sensor;
use crate::sky::{OutsidePart, Sun};
use crate::traceable::{TraceableScene, TraceableTube};

/// Number of backward rays toward the sky through each of the nearest openings, per sensor and pass.
const SKY_RAYS: PassSize = PassSize { for_one_percent: 16.0, growth: 1.0, fewest: 4.0, most: 256.0 };

/// Number of openings that count as nearest to a sensor: where there are more, most of them send it little.
const NEAREST: usize = 4;

/// Number of zenith angles of the sun's disc per sensor and pass: where an edge cuts the visible disc, the error depends on it.
const SUN_NODES: PassSize = PassSize { for_one_percent: 8.0, growth: 0.3, fewest: 4.0, most: 32.0 };

/// Number of rays toward the sky for each zenith angle where the number of rays is given, and the largest number of zenith angles then.
const RAYS_PER_NODE: u64 = 4;
const MOST_NODES_BY_RAYS: u64 = 16;

/// Numbers of rays and zenith angles by which a sensor looks up through openings in a pass; without zenith angles the sun does not count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LooksUp {
    sky_rays: f64,
    sun_nodes: usize,
}

impl LooksUp {
    /// Chooses the numbers for a relative standard error `target`.
    pub fn new(target: f64) -> Self {
        Self { sun_nodes: SUN_NODES.of(target, 1.0).round() as usize, ..Self::to_the_sky(target) }
    }

    /// Chooses the numbers for a relative standard error `target` where the sun is computed otherwise.
    pub fn to_the_sky(target: f64) -> Self {
        Self { sky_rays: SKY_RAYS.of(target, 1.0), sun_nodes: 0 }
    }

    /// Chooses the numbers for about `rays` rays through each of the nearest openings.
    pub fn by_rays(rays: u64) -> Self {
        let sun_nodes = (rays / RAYS_PER_NODE).clamp(SUN_NODES.fewest as u64, MOST_NODES_BY_RAYS) as usize;
        Self { sky_rays: (rays as f64).min(SKY_RAYS.most), sun_nodes }
    }

    /// Divides the rays of a sensor among openings, by the light that each would send it.
    fn sky_rays_toward(self, openings: &[(usize, Backward)]) -> Vec<f64> {
        let weights: Vec<f64> = openings.iter().map(|(_, backward)| backward.weight()).collect();
        let (total, all) = (self.sky_rays * openings.len().min(NEAREST) as f64, weights.iter().sum::<f64>());
        weights.into_iter().map(|weight| total * weight / all).collect()
    }
}

/// Computes the light that reaches a sensor unscattered through the closures of the tubes that `by` selects, in lx, and the number of rays.
pub fn unscattered(
    scene: &TraceableScene,
    sensor: Sensor,
    stream: Key,
    looks_up: LooksUp,
    by: impl Fn(&TraceableTube) -> bool,
) -> (f64, RayCount) {
    let (mut lux, mut traced) = (0.0, RayCount::default());
    let all = openings(scene, sensor, |tube| tube.is_daylit() && by(tube));
    let wanted = looks_up.sky_rays_toward(&all);
    for ((number, backward), wanted) in all.iter().zip(wanted) {
        let stream = stream.child(*number as u64);
        let (sky, sky_rays) = backward.sky(stream.stream(Stream::SkyFromBelow, 0), wanted);
        let sun = backward.tube.sun.filter(|_| looks_up.sun_nodes > 0);
        let of_sun = |sun: &Sun| backward.sun_at_sensor(sun, stream, looks_up);
        let (sun, sun_rays) = sun.as_ref().map(of_sun).unwrap_or_default();
        lux += sky + sun;
        traced += sky_rays + sun_rays;
    }
    (lux, traced)
}

/// Computes the light of a sun that reaches a sensor unscattered through straight tubes, in lx, and the number of rays.
pub fn unscattered_sun(
    scene: &TraceableScene,
    sensor: Sensor,
    stream: Key,
    looks_up: LooksUp,
    sun: &Sun,
) -> (f64, RayCount) {
    let (mut lux, mut traced) = (0.0, RayCount::default());
    for (number, backward) in openings(scene, sensor, |_| true) {
        let Some(sun) = backward.tube.before(*sun) else { continue };
        let (of_tube, rays) = backward.sun_at_sensor(&sun, stream.child(number as u64), looks_up);
        lux += of_tube;
        traced += rays;
    }
    (lux, traced)
}

/// Follows rays from a sensor through the clear zones of openings to the outside. Passes the part that each meets, the illuminance in lx per
/// cd/m2 of the luminance to which that of this part is relative, and the unit vector toward it to `found`; returns the number of rays.
pub fn toward_outside(
    scene: &TraceableScene,
    sensor: Sensor,
    stream: Key,
    looks_up: LooksUp,
    mut found: impl FnMut(OutsidePart, f64, DVec3),
) -> RayCount {
    let all = openings(scene, sensor, |_| true);
    let wanted = looks_up.sky_rays_toward(&all);
    let of_tube = |((number, backward), wanted): (&(usize, Backward), f64)| {
        let stream = stream.child(*number as u64).stream(Stream::SkyFromBelow, 0);
        backward.toward_sky(stream, wanted, |per_luminance, toward| {
            if let Some((part, share)) = backward.tube.outside(toward) {
                found(part, share * per_luminance, toward);
            }
        })
    };
    all.iter().zip(wanted).map(of_tube).sum()
}

/// Finds the tubes that `by` selects whose clear zones may light a sensor; none inside solids.
pub(super) fn openings(
    scene: &TraceableScene,
    sensor: Sensor,
    by: impl Fn(&TraceableTube) -> bool,
) -> Vec<(usize, Backward<'_>)> {
    if scene.is_in_solid(sensor.position) {
        return Vec::new();
    }
    let tubes = scene.tubes.iter().enumerate().filter(|(_, tube)| by(tube));
    tubes.filter_map(|(number, tube)| Some((number, Backward::new(scene, tube, sensor.into())?))).collect()
}

impl Backward<'_> {
    /// Computes the sky light that reaches the sensor, with [`Self::toward_sky`].
    fn sky(&self, stream: Key, wanted: f64) -> (f64, RayCount) {
        let Some(sky) = &self.tube.sky else { return (0.0, RayCount::default()) };
        let mut lux = 0.0;
        let rays =
            self.toward_sky(stream, wanted, |per_luminance, toward| lux += per_luminance * sky.luminance(toward));
        (lux, rays)
    }

    /// Follows rays to uniform points of the clear zone and on to the sky, and passes the illuminance per luminance in the direction of each
    /// to `found`. Very near to the opening the important ones are rare and bright: there
    /// every other ray takes a cosine-distributed direction instead, and both share the light by the balance heuristic (Veach and Guibas
    /// 1995).
    ///
    /// `wanted` is the mean number of rays; a fractional number is rounded up or down at random.
    fn toward_sky(&self, stream: Key, wanted: f64, mut found: impl FnMut(f64, DVec3)) -> RayCount {
        let near = self.is_near();
        let mut random = PathRandom::new(stream);
        // as many of both kinds
        let wanted = if near { 2.0 * (0.5 * wanted).ceil() } else { wanted };
        let whole = wanted == wanted.floor();
        let count = if whole { wanted as u64 } else { (wanted + random.uniform()) as u64 };
        let mut rays = RayCount::default();
        let response = |toward: DVec3| self.at.cosine::<3>(toward);
        for number in 0..count {
            let (replicate, index) = Replicate::of(stream, number);
            let [u, v, ..] = replicate.point(index, 0);
            let kind = match (near, number % 2) {
                (false, _) => Choice::Alone,
                (true, 0) => Choice::OfZone,
                (true, _) => Choice::ByCosine,
            };
            if let Some((weight, toward)) = self.ray(kind, [u, v], &response, &mut random, &mut rays) {
                found(weight.luminance() / wanted, toward);
            }
        }
        rays
    }

    /// Computes the sunlight that reaches the sensor through a straight pipe, in lx.
    fn sun_at_sensor(&self, sun: &Sun, stream: Key, looks_up: LooksUp) -> (f64, RayCount) {
        let uniform = PathRandom::new(stream.stream(Stream::SunFromBelow, 0)).uniform2();
        let (lux, rays) = self.sun::<3>(sun, &|toward| self.at.cosine(toward), looks_up.sun_nodes, uniform);
        (lux.luminance(), rays)
    }
}
