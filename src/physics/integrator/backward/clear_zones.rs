//! Light straight through all clear zones at a point of a surface: the connections of paths where every clear zone has them.

use glam::DVec3;

use super::through_opening::{Backward, Choice};
use crate::guide::{Guide, RayCount};
use crate::optics::Spectrum;
use crate::sampling::PathRandom;
use crate::traceable::{SurfacePoint, TraceableScene, TraceableTube};

/// True if vertices of paths can be connected to all light that enters a scene through clear zones: some closures have one, all of these
/// belong to straight upright tubes, and every surface is diffuse.
pub fn clear_zones_are_connected(scene: &TraceableScene) -> bool {
    let clear = || scene.tubes.iter().filter(|tube| tube.specular_zone().is_some());
    let measured = scene.tubes.iter().any(|tube| tube.diffuser.measured().is_some());
    let is_straight = |tube: &TraceableTube| matches!(tube.guide, Guide::Straight(_));
    let is_diffuse = || !scene.interreflection || scene.specular_surfaces().next().is_none();
    clear().next().is_some() && clear().all(is_straight) && !measured && is_diffuse()
}

/// Number of zenith angles of the sun's disc by which a vertex of a path receives the sun. Two, half a step apart, integrate a disc that is
/// seen as a whole without error.
const SUN_NODES_OF_VERTEX: usize = 2;

/// Estimates the light that comes straight through clear zones to a point of a surface, times the point's `response` per sr to light from
/// a direction (the cosine included): the sky by a ray through one opening, which `point` and `random` choose, and the sun by the arcs of
/// each that show it. Adds the number of rays to `rays`.
pub fn through_clear_zones<const C: usize>(
    scene: &TraceableScene,
    at: SurfacePoint,
    response: impl Fn(DVec3) -> Spectrum<C>,
    (point, random): ([f64; 2], &mut PathRandom),
    rays: &mut RayCount,
) -> Spectrum<C> {
    let lit = || scene.tubes.iter().filter(|tube| tube.is_daylit()).filter_map(|tube| Backward::new(scene, tube, at));
    let all: f64 = lit().map(|backward| backward.weight()).sum();
    let choice = random.uniform() * all;
    let (mut found, mut before, mut chosen) = (Spectrum::ZERO, 0.0, None);
    for backward in lit() {
        let weight = backward.weight();
        if weight <= 0.0 {
            continue;
        }
        if before <= choice {
            chosen = Some((backward, weight / all));
        }
        before += weight;
        if let Some(sun) = backward.tube.sun.as_ref().filter(|sun| backward.may_show(sun)) {
            let (of_sun, of_arcs) = backward.sun(sun, &response, SUN_NODES_OF_VERTEX, random.uniform2());
            found += of_sun;
            *rays += of_arcs;
        }
    }
    if let Some((backward, probability)) = chosen
        && let Some(sky) = &backward.tube.sky
    {
        let kinds: &[Choice] = if backward.is_near() { &[Choice::OfZone, Choice::ByCosine] } else { &[Choice::Alone] };
        for kind in kinds {
            if let Some((weight, toward)) = backward.ray(*kind, point, &response, random, rays) {
                found += weight * (sky.luminance(toward) / (probability * kinds.len() as f64));
            }
        }
    }
    found
}

/// Computes the sunlight that comes straight through clear zones of straight tubes to a point, in lx, at fixed zenith angles of the disc.
pub fn sun_through_clear_zones(scene: &TraceableScene, at: SurfacePoint) -> f64 {
    let of_tube = |tube| {
        let backward = Backward::new(scene, tube, at)?;
        let sun = tube.sun.as_ref().filter(|sun| backward.may_show(sun))?;
        Some(backward.sun::<1>(sun, &|toward| at.cosine(toward), SUN_NODES_OF_VERTEX, [0.5; 2]).0.luminance())
    };
    scene.tubes.iter().filter_map(of_tube).sum()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use glam::DVec2;

    use super::*;
    use crate::geometry::disc::disc_irradiance;
    use crate::integrator::photon::descent::{Entering, descend};
    use crate::integrator::photon::emission::Emission;
    use crate::integrator::photon::energy_balance::EnergyBalance;
    use crate::optics::{Diffuser, Surface};
    use crate::sampling::Key;
    use crate::scene::{Daylight, Face};
    use crate::sky::zenith::ZenithFormula;
    use crate::sky::{CieType, Sky, SkyDistribution, Sun};
    use crate::statistics::Moments;
    use crate::traceable::test_rooms::{compiled, empty, straight_tube};

    const CEILING: usize = Face::Ceiling as usize;

    /// Checks that below a lossless pipe a clear opening is as bright as a uniform sky: points that look up, sideways and askew get what a
    /// disc sends them in closed form, in every channel, within four standard errors.
    #[test]
    fn openings_light_surfaces_as_discs_do() {
        let (luminance, transmittance) = (3000.0, [0.9, 0.8, 0.5]);
        let distribution = SkyDistribution::new(CieType::UNIFORM, DVec3::Z);
        let sky = Some(Sky::new(distribution, luminance));
        let tube = straight_tube((CEILING, DVec2::new(1.0, 1.2)), [1.0; 3], Diffuser::Clear { transmittance });
        let mut scene = empty(DVec3::new(3.0, 2.0, 2.5), None);
        scene.daylight = Some(Daylight { sky, sun: None, formula: ZenithFormula::GivenZenithLuminance });
        scene.tubes = vec![tube];
        let traceable = compiled(&scene);
        let (stream, mut number) = (Key::new(8), 0);
        for position in [DVec3::new(0.0, 0.4, 0.1), DVec3::new(0.1, 1.9, 1.5), DVec3::new(2.9, 0.3, 0.7)] {
            let away = tube_axis(&traceable) - position;
            let toward_axis = away.truncate().normalize().extend(0.0);
            for normal in [DVec3::Z, toward_axis, (toward_axis + 0.5 * DVec3::Z).normalize()] {
                let mut sums = [Moments::default(); 3];
                let at = SurfacePoint { position, normal, surface: None };
                for _ in 0..4000 {
                    number += 1;
                    let mut random = PathRandom::new(stream.child(number));
                    let (point, mut rays) = (random.uniform2(), RayCount::default());
                    let lux: Spectrum<3> = through_clear_zones(
                        &traceable,
                        at,
                        |toward| at.cosine(toward),
                        (point, &mut random),
                        &mut rays,
                    );
                    assert!(rays.followed >= 2);
                    sums.iter_mut().zip(lux.0).for_each(|(sum, lux)| sum.push(lux));
                }
                let facing = [normal.z, normal.dot(toward_axis)];
                let seen = disc_irradiance(0.3, away.z, away.truncate().length());
                let factor = facing[0] * seen.vertical + facing[1] * seen.toward_axis;
                for (sum, transmittance) in sums.iter().zip(transmittance) {
                    let truth = PI * luminance * transmittance * factor;
                    assert!(
                        (sum.mean - truth).abs() <= 4.0 * sum.standard_error(),
                        "{position} {normal}: {truth} {sum:?}"
                    );
                }
            }
        }
    }

    /// Checks the light of sky and sun through a clear closure at walls and floor: the mean over a rectangle of each is the flux of the
    /// photons that arrive there, within four standard errors.
    #[test]
    fn surfaces_get_the_photons_that_arrive() {
        let mut scene = empty(DVec3::new(2.0, 2.0, 2.5), Some(Surface::diffuse([0.5; 3])));
        let sun = Sun { direction: DVec3::new(0.5, 0.2, 0.7).normalize(), normal_illuminance_lux: 50_000.0 };
        let sky = Some(Sky::new(SkyDistribution::new(CieType::UNIFORM, DVec3::Z), 3000.0));
        scene.daylight = Some(Daylight { sky, sun: Some(sun), formula: ZenithFormula::GivenZenithLuminance });
        scene.tubes = vec![straight_tube(
            (CEILING, DVec2::new(0.9, 1.1)),
            [0.95; 3],
            Diffuser::Clear { transmittance: [0.9; 3] },
        )];
        let scene = compiled(&scene);
        let rectangles = [
            (DVec3::ZERO, DVec3::X * 2.0, DVec3::Y * 2.0, DVec3::Z),
            (DVec3::ZERO, DVec3::X * 2.0, DVec3::Z * 2.0, DVec3::Y),
            (DVec3::X * 2.0, DVec3::Y * 2.0, DVec3::Z * 2.0, DVec3::NEG_X),
        ];
        let emission = Emission::of_daylight(&scene, 8192);
        for (number, (corner, u, v, normal)) in rectangles.into_iter().enumerate() {
            let (mut arrived, mut received) = (Moments::default(), Moments::default());
            let key = Key::new(number as u64);
            for pass in 0..16 {
                let mut lm = 0.0;
                for photon in 0..emission.photons() {
                    let (Some(photon), mut samples) = emission.photon(&scene, key.child(pass), photon) else {
                        continue;
                    };
                    let entering =
                        Entering { position: photon.position, direction: photon.direction, flux: photon.flux };
                    let sums = (&mut RayCount::default(), &mut EnergyBalance::default());
                    descend::<1>(&scene, &scene.tubes[0], entering, &mut samples, sums, |exit| {
                        let hit = scene.intersect(exit.position, -exit.from, None);
                        let away = hit.position - corner;
                        let within = away.dot(normal).abs() < 1e-9 && (0.0..2.0).contains(&away.z);
                        lm += if within { exit.into_room().luminance() } else { 0.0 };
                    });
                }
                arrived.push(lm / u.cross(v).length());
                let mut random = PathRandom::new(key.child(100 + pass));
                let places = 4000;
                let lux = (0..places).map(|_| {
                    let [s, t, ..] = [random.uniform(), random.uniform()];
                    let at = SurfacePoint { position: corner + u * s + v * t, normal, surface: None };
                    let numbers = (random.uniform2(), &mut random);
                    let cosine = |toward| at.cosine::<1>(toward);
                    through_clear_zones(&scene, at, cosine, numbers, &mut RayCount::default()).luminance()
                });
                received.push(lux.sum::<f64>() / f64::from(places));
            }
            let error = arrived.standard_error().hypot(received.standard_error());
            assert!(received.mean > 30.0 && error < 0.05 * received.mean, "{number}: {received:?}");
            assert!((arrived.mean - received.mean).abs() <= 4.0 * error, "{number}: {arrived:?} {received:?}");
        }
    }

    fn tube_axis(scene: &TraceableScene) -> DVec3 {
        scene.tubes[0].frame.origin
    }
}
