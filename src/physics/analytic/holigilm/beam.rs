//! Light of sky and sun traced down through one tube to its opening and, where the closure is clear, into the room.

use std::sync::atomic::AtomicBool;

use glam::DVec3;

use super::coefficients::reflectance;
use super::landing::Landed;
use super::profile::{Cells, RINGS, SECTORS};
use crate::analytic::patches::Mesh;
use crate::analytic::{Installation, Tube, is_raised};
use crate::guide::transmittance::likely_transmission;
use crate::guide::{End, Guide, Transit};
use crate::sampling::{Key, PathRandom, Replicate, warp};
use crate::scene::EstimateKind;
use crate::sky::sampler::SkySampler;
use crate::sky::sun::HALF_ANGLE;
use crate::sky::{Sky, Sun};

/// Source of the light that is traced.
#[derive(Clone, Copy)]
pub enum Source<'a> {
    Sky(&'a Sky, &'a SkySampler),
    Sun(&'a Sun),
}

/// Room and tube through which light is traced.
#[derive(Clone, Copy)]
pub struct BeamTask<'a> {
    pub room: &'a Installation,
    pub mesh: &'a Mesh,
    pub tube: &'a Tube,
    /// Raised when the light is not needed any more.
    pub cancel: &'a AtomicBool,
}

/// Number of rays that are traced between two looks at [`BeamTask::cancel`]: a few milliseconds.
pub const RAYS_BETWEEN_CHECKS: u64 = 1 << 12;

/// Light of one source through one tube, in lm, by the places where it ends.
#[derive(Clone, Debug)]
pub struct Beam {
    pub emitted: f64,
    pub collector: f64,
    pub guide: f64,
    pub guide_top: f64,
    /// Flux onto the cells of the Lambertian zone, from above.
    pub cells: Vec<f64>,
    /// Flux onto the clear zone, from above.
    pub clear: f64,
    /// Flux through the clear zone onto each patch of the room, without the light that `landed` has.
    pub patches: Vec<f64>,
    /// Sunlight through the clear zone onto the cells of the patches, if its first reflection is computed.
    pub landed: Option<Landed>,
    /// Illuminance through the clear zone onto the cells of each grid of averages, in lux.
    pub grids: Vec<Vec<f64>>,
}

impl Source<'_> {
    /// True if the source's light through clear zones is counted in the cells where it lands, for its first reflection.
    fn lands_in_cells(&self, room: &Installation) -> bool {
        matches!(self, Self::Sun(_)) && room.interreflection
    }
}

impl Beam {
    /// Returns the flux onto the whole opening from above.
    pub fn at_diffuser(&self) -> f64 {
        self.lambertian() + self.clear
    }

    pub fn lambertian(&self) -> f64 {
        self.cells.iter().sum()
    }

    /// Multiplies the flux that passes the guide by `factor`, and counts the difference as absorbed by the guide.
    pub fn scale(&mut self, factor: f64) {
        self.guide += (1.0 - factor) * self.at_diffuser();
        self.clear *= factor;
        let values = self.cells.iter_mut().chain(&mut self.patches).chain(self.grids.iter_mut().flatten());
        values.for_each(|value| *value *= factor);
        self.landed.iter_mut().for_each(|landed| landed.scale(factor));
    }
}

/// Builds the sampler of directions for the sky's light into a tube.
pub fn sky_sampler(sky: &Sky, tube: &Tube) -> Option<SkySampler> {
    let sampler = SkySampler::new(sky, |toward| {
        let likely = match &tube.guide {
            Guide::Straight(guide) => {
                let tangent = toward.truncate().length() / toward.z.max(1e-9);
                let aspect = guide.length / (2.0 * guide.radius);
                likely_transmission(aspect, tangent, reflectance(guide))
            }
            _ => 1.0,
        };
        likely * tube.guide.projected_area_m2(-toward)
    });
    sampler.map(|sampler| sampler.with_cone(tube.guide.narrow_cone()))
}

/// Traces `count` rays of one replicate; fewer when cancelled.
pub fn follow(task: &BeamTask, source: Source, stream: Key, count: u64) -> Beam {
    let BeamTask { room, mesh, tube, cancel } = *task;
    let cells = lambertian_cells(tube);
    let averages = |kind: EstimateKind, len: usize| if kind == EstimateKind::CellAverage { len } else { 0 };
    let mut beam = Beam {
        emitted: 0.0,
        collector: 0.0,
        guide: 0.0,
        guide_top: 0.0,
        cells: vec![0.0; if cells.is_some() { RINGS * SECTORS } else { 0 }],
        clear: 0.0,
        patches: vec![0.0; mesh.patches.len()],
        landed: source.lands_in_cells(room).then(|| Landed::nowhere(mesh)),
        grids: room.grids.iter().map(|grid| vec![0.0; averages(grid.estimate, grid.len())]).collect(),
    };
    let mut random = PathRandom::new(stream);
    for number in 0..count {
        if number % RAYS_BETWEEN_CHECKS == 0 && is_raised(cancel) {
            break;
        }
        let (replicate, index) = Replicate::of(stream, number);
        let [u, v, s, t] = replicate.point(index, 0);
        let (toward, luminance_per_density) = match source {
            Source::Sky(sky, sampler) => {
                let (toward, density) = sampler.sample([u, v]);
                (toward, sky.luminance(toward) / density)
            }
            Source::Sun(sun) => {
                let toward = warp::around(sun.direction, warp::cone([u, v], HALF_ANGLE));
                let visible = if toward.z > 0.0 { 1.0 } else { 0.0 };
                (toward, visible * sun.luminance_cd_m2() * Sun::solid_angle_sr())
            }
        };
        let Some(entry) = tube.guide.entry([s, t], -toward) else { continue };
        let flux = luminance_per_density * entry.projected_area_m2 / count as f64;
        let transit: Transit<1> = tube.guide.down(entry.position, -toward, &mut random);
        let (collector, weight) = (transit.collector.luminance(), transit.weight().luminance());
        beam.emitted += flux;
        beam.collector += flux * (1.0 - collector);
        beam.guide += flux * (collector - weight);
        match transit.end {
            End::Opening => {}
            End::Top => {
                beam.guide_top += flux * weight;
                continue;
            }
            End::Absorbed | End::Lost | End::Cut => {
                beam.guide += flux * weight;
                continue;
            }
        }
        let arriving = flux * weight;
        let place = transit.position.truncate();
        match (tube.diffuser.at(place.length()).unscattered::<1>(), cells) {
            (Some(transmittance), _) => {
                beam.clear += arriving;
                let start = tube.origin + transit.position.with_z(0.0);
                land(room, mesh, start, transit.direction, arriving * transmittance.luminance(), &mut beam);
            }
            (None, Some(cells)) => beam.cells[cells.at(place)] += arriving,
            // measured diffusers are refused
            (None, None) => beam.guide += arriving,
        }
    }
    beam
}

/// Returns the cells of a diffuser's Lambertian zone, if it has one.
pub fn lambertian_cells(tube: &Tube) -> Option<Cells> {
    if !tube.diffuser.scatters(tube.radius) {
        return None;
    }
    let (inner, outer) = match tube.diffuser.specular_zone(tube.radius) {
        None => (0.0, tube.radius),
        Some((0.0, to)) => (to, tube.radius),
        Some((from, _)) => (0.0, from),
    };
    Some(Cells { inner, outer })
}

/// Adds light that enters the room at `start` to the cells of grids that it crosses, and to the patch where it arrives.
fn land(room: &Installation, mesh: &Mesh, start: DVec3, direction: DVec3, flux: f64, beam: &mut Beam) {
    let (mut distance, mut face) = (f64::INFINITY, 4);
    for axis in 0..3 {
        let far = direction[axis] > 0.0;
        let wall = if far { room.size[axis] } else { 0.0 };
        let to_wall = (wall - start[axis]) / direction[axis];
        if direction[axis] != 0.0 && to_wall < distance {
            (distance, face) = (to_wall.max(0.0), 2 * axis + usize::from(far));
        }
    }
    let end = start + direction * distance;
    match &mut beam.landed {
        Some(landed) => landed.add(mesh, face, end, flux),
        None => beam.patches[mesh.patch_at(face, end)] += flux,
    }
    for (grid, cells) in room.grids.iter().zip(&mut beam.grids).filter(|(_, cells)| !cells.is_empty()) {
        if end.z > grid.height_m {
            continue;
        }
        let crossing = start.lerp(end, (start.z - grid.height_m) / (start.z - end.z));
        let index = |axis: usize, first: f64| {
            let position = (crossing[axis] - first) / grid.cell_size_m[axis] + 0.5;
            (position >= 0.0).then_some(position as usize).filter(|index| *index < grid.cells[axis])
        };
        if let (Some(i), Some(j)) = (index(0, grid.x_m[0]), index(1, grid.y_m[0])) {
            cells[j * grid.cells[0] + i] += flux / (grid.cell_size_m[0] * grid.cell_size_m[1]);
        }
    }
}
