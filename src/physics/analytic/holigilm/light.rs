//! Light that comes out of the tubes, in independent randomisations.

use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

use rayon::prelude::*;

use super::aperture::{luminance_from, upward};
use super::beam::{Beam, BeamTask, RAYS_BETWEEN_CHECKS, Source, follow, lambertian_cells, sky_sampler};
use super::coefficients::{lambertian_coefficients, reflectance};
use super::landing::Landed;
use super::levels::{FIRST_RAYS, REPLICATES};
use super::profile::{Cells, Profile, RINGS, SECTORS};
use super::quadrature::{gauss, patch_mean};
use crate::analytic::patches::{Mesh, Patch};
use crate::analytic::{Balance, Installation, Quantity, Tube, TubeSolution, is_raised};
use crate::guide::sun_disc::{ABOVE_HORIZON, sun_nodes};
use crate::guide::transmittance::{beam_transmission, sky_exitance};
use crate::guide::{End, Guide, Transit};
use crate::sampling::{Key, PathRandom, Replicate, Stream, warp};
use crate::sky::Sky;
use crate::sky::sampler::SkySampler;
use crate::statistics::Moments;

/// Number of points of the rule for [`TubeLight::returned`].
const RETURN_RAYS: u64 = 1 << 14;

/// Number of nodes over the solar disc for its flux through a straight tube.
const SUN_FLUX_NODES: usize = 256;

/// Properties of one tube that do not depend on the level of accuracy.
#[derive(Debug)]
pub struct TubeLight {
    sampler: Option<SkySampler>,
    /// Flux of the sky through a straight tube; `None` for other tubes.
    sky: Option<Through>,
    sun: Option<Through>,
    /// Fraction of uniform diffuse light, sent up into the guide, that comes back down; 0 where guide return is not followed.
    pub returned: f64,
}

/// Flux in lm at the upper end and at the diffuser.
#[derive(Clone, Copy, Debug)]
struct Through {
    emitted: f64,
    at_diffuser: f64,
}

/// Light of one tube in one randomisation.
pub struct Replica {
    /// Exitance of the Lambertian zone.
    pub profile: Option<Profile>,
    /// Flux through the clear zone onto the room's patches in lm, without the light that is counted in cells.
    patches: Vec<f64>,
    /// Sunlight through the clear zone, in the cells where it lands; moved to [`Light::landed`].
    landed: Option<Landed>,
    /// Illuminance through the clear zone onto the cells of each grid of averages, in lux.
    pub grids: Vec<Vec<f64>>,
    at_diffuser: f64,
    into_room: f64,
    balance: Balance,
    rays: u64,
}

/// Light of all tubes at one level of accuracy.
pub struct Light {
    /// Replicas by tube, then by randomisation.
    pub replicas: Vec<Vec<Replica>>,
    /// Means over the randomisations, by tube.
    pub profiles: Vec<Option<Profile>>,
    /// Sunlight through the clear zones of all tubes by randomisation, in the cells where it lands; empty where there is none.
    pub landed: Vec<Landed>,
}

/// Direct illuminance averaged over the patches of the room, in lux.
pub struct PatchLight {
    /// Illuminances by randomisation, then by patch, without those of sunlight that landed in cells.
    pub replicas: Vec<Vec<f64>>,
    /// Illuminances by patch of sunlight that landed in cells, averaged over the randomisations; empty where there is none.
    pub beams: Vec<f64>,
    /// True if the randomisations differ by more than the profile of a diffuser.
    pub varies: bool,
    /// Fraction of the Lambertian zones' flux that the rule over the patches misses.
    pub closure: f64,
}

impl PatchLight {
    /// Computes the mean over the randomisations of all light.
    pub fn mean(&self) -> Vec<f64> {
        let mut lux = mean(&self.replicas);
        lux.iter_mut().zip(&self.beams).for_each(|(lux, beams)| *lux += beams);
        lux
    }
}

/// Computes the mean over the randomisations by patch.
pub fn mean(replicas: &[Vec<f64>]) -> Vec<f64> {
    let sum = |patch: usize| replicas.iter().map(|values| values[patch]).sum::<f64>();
    (0..replicas[0].len()).map(|patch| sum(patch) / REPLICATES as f64).collect()
}

impl TubeLight {
    pub fn new(room: &Installation, tube: &Tube) -> Self {
        let area = PI * tube.radius * tube.radius;
        let straight = if let Guide::Straight(guide) = &tube.guide { Some(guide) } else { None };
        let aspect = straight.map_or(0.0, |guide| guide.length / (2.0 * guide.radius));
        let sky = straight.zip(room.sky.as_ref()).map(|(guide, sky)| Through {
            emitted: area * sky.horizontal_illuminance_lux(),
            at_diffuser: area * guide.collector_transmittance[0] * sky_exitance(sky, aspect, reflectance(guide)),
        });
        let sun = straight.zip(room.sun.as_ref()).map(|(guide, sun)| {
            // horizontal illuminance through a transmission, over the disc
            let horizontal = |transmission: &dyn Fn(f64) -> f64| -> f64 {
                let nodes = sun_nodes(sun, (SUN_FLUX_NODES, 0.5), ABOVE_HORIZON);
                let integral = nodes.iter().map(|node| {
                    let (sin, cos) = libm::sincos(node.zenith_angle);
                    sin * cos * 2.0 * node.half_azimuth * node.step * transmission(sin / cos)
                });
                sun.luminance_cd_m2() * integral.sum::<f64>()
            };
            let through = |tangent: f64| beam_transmission(aspect, tangent, reflectance(guide));
            Through {
                emitted: area * horizontal(&|_| 1.0),
                at_diffuser: area * guide.collector_transmittance[0] * horizontal(&through),
            }
        });
        Self {
            sampler: room.sky.as_ref().and_then(|sky| sky_sampler(sky, tube)),
            sky,
            sun,
            returned: if room.guide_return { returned(tube) } else { 0.0 },
        }
    }
}

/// Estimates the fraction of uniform diffuse light, sent up from the opening, that comes back down.
fn returned(tube: &Tube) -> f64 {
    if !tube.guide.returns_light() {
        return 0.0;
    }
    let key = Key::new(0);
    let mut random = PathRandom::new(key);
    let back = (0..RETURN_RAYS).map(|number| {
        let (replicate, index) = Replicate::of(key, number);
        let [u, v, s, t] = replicate.point(index, 0);
        let start = (warp::disc([u, v]) * tube.radius).extend(0.0);
        let transit: Transit<1> = tube.guide.up(start, warp::cosine_hemisphere([s, t]), &mut random);
        if transit.end == End::Opening { transit.weight().luminance() } else { 0.0 }
    });
    back.sum::<f64>() / RETURN_RAYS as f64
}

/// Sums up the luminances that arrive from the sky on the upper side of each cell, over `count` rays: the shape of the profile.
fn sky_shape(task: &BeamTask, sky: &Sky, cells: Cells, stream: Key, count: u64) -> Vec<f64> {
    let mut shape = vec![0.0; RINGS * SECTORS];
    let mut random = PathRandom::new(stream);
    let cones = task.tube.guide.cones();
    for number in 0..count {
        if number % RAYS_BETWEEN_CHECKS == 0 && is_raised(task.cancel) {
            break;
        }
        let (replicate, index) = Replicate::of(stream, number);
        let [u, v, s, t] = replicate.point(index, 0);
        let point = warp::annulus([u, v], cells.inner, cells.outer);
        shape[cells.at(point)] +=
            luminance_from(&task.tube.guide, sky, point, upward([s, t], cones.as_ref()), &mut random);
    }
    shape
}

/// Adds the landed light of one more tube; nothing where light is not counted in cells.
fn merge(sums: &mut Vec<Landed>, of_tube: Vec<Landed>) {
    if sums.is_empty() {
        *sums = of_tube;
    } else {
        sums.iter_mut().zip(of_tube).for_each(|(sum, landed)| sum.merge(landed));
    }
}

impl Light {
    /// Computes the light of all tubes at a level of accuracy on the current rayon pool; `None` when cancelled.
    pub fn new(
        room: &Installation,
        lights: &[TubeLight],
        seed: Key,
        level: u32,
        mesh: &Mesh,
        cancel: &AtomicBool,
    ) -> Option<Self> {
        let count = FIRST_RAYS << (2 * level);
        let tubes = room.tubes.len();
        let of_tube = |tube: usize, replicate: u64| {
            let stream = seed.stream(Stream::TubeLight, tube as u64).child(replicate);
            let task = BeamTask { room, mesh, tube: &room.tubes[tube], cancel };
            (!is_raised(cancel)).then(|| Replica::new(&task, &lights[tube], stream, count))
        };
        let mut replicas: Vec<Vec<Replica>> = Vec::with_capacity(tubes);
        let mut landed = Vec::new();
        // a few tubes at a time: the landed light of each fills many cells until it is summed up
        let concurrent = rayon::current_num_threads().div_ceil(REPLICATES as usize);
        for first in (0..tubes).step_by(concurrent) {
            let few = (first..tubes.min(first + concurrent)).into_par_iter();
            let few: Option<Vec<Vec<Replica>>> = few
                .map(|tube| (0..REPLICATES).into_par_iter().map(|replicate| of_tube(tube, replicate)).collect())
                .collect();
            for mut of_tube in few? {
                merge(&mut landed, of_tube.iter_mut().filter_map(|replica| replica.landed.take()).collect());
                replicas.push(of_tube);
            }
        }
        let mean =
            |of_tube: &Vec<Replica>| Profile::mean(of_tube.iter().filter_map(|replica| replica.profile.as_ref()));
        Some(Self { profiles: replicas.iter().map(mean).collect(), replicas, landed })
    }

    pub fn rays(&self) -> u64 {
        self.replicas.iter().flatten().map(|replica| replica.rays).sum()
    }

    pub fn tubes(&self) -> Vec<TubeSolution> {
        let quantity = |replicas: &[Replica], of: fn(&Replica) -> f64| {
            let mut moments = Moments::default();
            replicas.iter().for_each(|replica| moments.push(of(replica)));
            Quantity { value: moments.mean, error: Some(moments.standard_error()) }
        };
        let tube = |replicas: &Vec<Replica>| TubeSolution {
            at_collector: quantity(replicas, |replica| replica.balance.emitted),
            at_diffuser: quantity(replicas, |replica| replica.at_diffuser),
            into_room: quantity(replicas, |replica| replica.into_room),
        };
        self.replicas.iter().map(tube).collect()
    }

    /// Sums up the light that ended before it entered the room, by the places where it ended.
    pub fn balance(&self) -> Balance {
        let mut sum = Balance::default();
        for replica in self.replicas.iter().flatten() {
            let Balance { emitted, collector, guide, guide_top, diffuser, .. } = replica.balance;
            let mean = |value: f64| value / REPLICATES as f64;
            sum.emitted += mean(emitted);
            sum.collector += mean(collector);
            sum.guide += mean(guide);
            sum.guide_top += mean(guide_top);
            sum.diffuser += mean(diffuser);
        }
        sum
    }

    /// Computes the direct illuminance averaged over the patches; meaningless when cancelled.
    pub fn on_patches(&self, tubes: &[Tube], mesh: &Mesh, cancel: &AtomicBool) -> PatchLight {
        let rule = gauss(3);
        let (mut missed, mut total) = (0.0, 0.0);
        // of each Lambertian zone, for 1 lm: from the mean profile
        let mut shapes: Vec<Option<Vec<f64>>> = Vec::new();
        for (tube, profile) in tubes.iter().zip(&self.profiles) {
            let Some(profile) = profile.as_ref().filter(|profile| profile.flux() > 0.0) else {
                shapes.push(None);
                continue;
            };
            let mean = |patch: &Patch| {
                if patch.face == crate::scene::Face::Ceiling as usize || is_raised(cancel) {
                    return 0.0;
                }
                patch_mean(patch, &rule, |point, normal| {
                    let from_opening = point - tube.origin;
                    profile.illuminance(from_opening.truncate(), -from_opening.z, normal)
                })
            };
            let mut values: Vec<f64> = mesh.patches.par_iter().map(mean).collect();
            let landed: f64 = values.iter().zip(&mesh.patches).map(|(lux, patch)| lux * patch.area()).sum();
            missed += (landed - profile.flux()).abs();
            total += profile.flux();
            values.iter_mut().for_each(|value| *value /= landed);
            shapes.push(Some(values));
        }
        let replica = |number: usize| {
            let mut lux = vec![0.0; mesh.patches.len()];
            for (of_tube, shape) in self.replicas.iter().zip(&shapes) {
                let replica = &of_tube[number];
                for ((lux, flux), patch) in lux.iter_mut().zip(&replica.patches).zip(&mesh.patches) {
                    *lux += flux / patch.area();
                }
                if let (Some(shape), Some(profile)) = (shape, &replica.profile) {
                    let flux = profile.flux();
                    lux.iter_mut().zip(shape).for_each(|(lux, fraction)| *lux += flux * fraction);
                }
            }
            lux
        };
        // flux through a straight tube onto a diffuser that scatters everything is the same in all
        let varies = tubes.iter().any(|tube| {
            !matches!(tube.guide, Guide::Straight(_)) || tube.diffuser.specular_zone(tube.radius).is_some()
        });
        let replicas = (0..REPLICATES as usize).map(replica).collect();
        let mut beams = vec![0.0; if self.landed.is_empty() { 0 } else { mesh.patches.len() }];
        for landed in &self.landed {
            for ((lux, flux), patch) in beams.iter_mut().zip(landed.by_patch()).zip(&mesh.patches) {
                *lux += flux / patch.area() / REPLICATES as f64;
            }
        }
        PatchLight { replicas, beams, varies, closure: if total > 0.0 { missed / total } else { 0.0 } }
    }
}

impl Replica {
    fn new(task: &BeamTask, light: &TubeLight, stream: Key, count: u64) -> Self {
        let BeamTask { room, mesh, tube, .. } = *task;
        let cells = lambertian_cells(tube);
        let mut flux = vec![0.0; if cells.is_some() { RINGS * SECTORS } else { 0 }];
        let mut replica = Self {
            profile: None,
            patches: vec![0.0; mesh.patches.len()],
            landed: None,
            grids: room.grids.iter().map(|grid| vec![0.0; grid.len()]).collect(),
            at_diffuser: 0.0,
            into_room: 0.0,
            balance: Balance::default(),
            rays: 0,
        };
        if let Some((sky, sampler)) = room.sky.as_ref().zip(light.sampler.as_ref()) {
            let clear = tube.diffuser.specular_zone(tube.radius).is_some();
            let on_lambertian = match light.sky {
                // the flux has a closed form: only the profile is estimated
                Some(through) if !clear => {
                    replica.add_through(tube, through);
                    through.at_diffuser
                }
                through => {
                    let beam = follow(task, Source::Sky(sky, sampler), stream.stream(Stream::SkyBeam, 0), count);
                    replica.add(tube, beam, through, count)
                }
            };
            if let Some(cells) = cells {
                let shape = sky_shape(task, sky, cells, stream.stream(Stream::SkyProfile, 0), count);
                replica.rays += count;
                let sum: f64 = shape.iter().sum();
                if sum > 0.0 {
                    flux.iter_mut().zip(&shape).for_each(|(flux, fraction)| *flux += fraction * on_lambertian / sum);
                }
            }
        }
        if let Some(sun) = &room.sun {
            let mut beam = follow(task, Source::Sun(sun), stream.stream(Stream::SunBeam, 0), count);
            let on_cells = std::mem::take(&mut beam.cells);
            let arrived: f64 = on_cells.iter().sum();
            beam.cells = vec![arrived];
            let on_lambertian = replica.add(tube, beam, light.sun, count);
            let scale = if arrived > 0.0 { on_lambertian / arrived } else { 0.0 };
            flux.iter_mut().zip(&on_cells).for_each(|(flux, cell)| *flux += scale * cell);
        }
        if let Some(cells) = cells {
            replica.scatter(tube, cells, flux, light.returned);
        }
        replica
    }

    /// Adds light that passes a straight tube onto a diffuser without clear zone.
    fn add_through(&mut self, tube: &Tube, through: Through) {
        let Guide::Straight(guide) = &tube.guide else { return };
        let Through { emitted, at_diffuser } = through;
        let collector = emitted * (1.0 - guide.collector_transmittance[0]);
        self.balance.emitted += emitted;
        self.balance.collector += collector;
        self.balance.guide += emitted - collector - at_diffuser;
    }

    /// Adds a beam, scaled to the exact flux through the guide where there is one; returns the flux that arrives at the Lambertian zone.
    fn add(&mut self, tube: &Tube, mut beam: Beam, known: Option<Through>, count: u64) -> f64 {
        if let Some(through) = known {
            let arrived = beam.at_diffuser();
            beam.scale(if arrived > 0.0 { through.at_diffuser / arrived } else { 0.0 });
            self.add_through(tube, through);
        } else {
            self.balance.emitted += beam.emitted;
            self.balance.collector += beam.collector;
            self.balance.guide += beam.guide;
            self.balance.guide_top += beam.guide_top;
        }
        let transmittance =
            tube.diffuser.at(zone_radius(tube)).unscattered::<1>().map_or(0.0, |fraction| fraction.luminance());
        self.at_diffuser += beam.clear;
        self.into_room += transmittance * beam.clear;
        self.balance.diffuser += (1.0 - transmittance) * beam.clear;
        self.patches.iter_mut().zip(&beam.patches).for_each(|(sum, flux)| *sum += flux);
        self.landed = beam.landed.take().or(self.landed.take());
        for (sums, cells) in self.grids.iter_mut().zip(&beam.grids) {
            sums.iter_mut().zip(cells).for_each(|(sum, lux)| *sum += lux);
        }
        self.rays += count;
        beam.lambertian()
    }

    /// Adds the light on the upper side of a Lambertian zone, in lm per cell: the transmitted part leaves below, and of the reflected
    /// part the guide returns a fraction, which arrives again.
    fn scatter(&mut self, tube: &Tube, cells: Cells, mut flux: Vec<f64>, returned: f64) {
        let (transmittance, reflectance) = lambertian_coefficients(&tube.diffuser);
        let again = 1.0 / (1.0 - reflectance * returned);
        let above = again * flux.iter().sum::<f64>();
        flux.iter_mut().for_each(|value| *value *= again * transmittance);
        self.at_diffuser += above;
        self.into_room += transmittance * above;
        self.balance.diffuser += (1.0 - transmittance - reflectance) * above;
        self.balance.guide_top += reflectance * (1.0 - returned) * above;
        self.profile = Some(cells.profile(&flux));
    }
}

/// Returns a radius within the clear zone; within the opening where there is none.
fn zone_radius(tube: &Tube) -> f64 {
    tube.diffuser.specular_zone(tube.radius).map_or(0.0, |(inner, outer)| 0.5 * (inner + outer))
}
