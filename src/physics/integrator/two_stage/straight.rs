//! Direct light from openings and luminaires to the sensors.
//!
//! A sensor that certainly sees all of an opening is connected to every photon that leaves it, and one that certainly sees nothing of it to
//! none. A sensor from which something may hide a part is connected to some photons: they are ordered along a line through all cells of the
//! opening, and the connections of all passes together are spread evenly over it. So they notice every obstacle that hides more than about
//! one over their number.
//!
//! Smaller obstacles may be missed, and n connections that agree are no proof that there are none. If a fifth of all openings that may be
//! partly hidden are so, and all hidden fractions are equally likely, the missed fraction of the light has a standard deviation of n^-3/2:
//! this is the smallest error of a sensor.

use std::f64::consts::PI;
use std::ops::AddAssign;

use glam::{DVec2, DVec3};

use super::sample_counts::SampleCounts;
use super::variances::PASSES;
use crate::guide::RayCount;
use crate::integrator::backward::next_event::{luminaire_density, power_heuristic};
use crate::integrator::backward::pass::lifted;
use crate::integrator::diffuser_source::cells::per_lumen;
use crate::integrator::diffuser_source::light::DiffuserLight;
use crate::integrator::diffuser_source::visible_parts::{VisiblePart, point_of_cell, reach, visible_parts};
use crate::sampling::lattice::{self, radical_inverse};
use crate::sampling::{Key, PathRandom, Stream};
use crate::scene::{EstimateKind, Grid, Sensor};
use crate::traceable::TraceableScene;
use crate::traceable::luminaire::TraceableLuminaire;

/// Direct light of a sensor.
#[derive(Clone, Copy, Debug, Default)]
pub struct Straight {
    /// Illuminance in lx.
    pub lux: f64,
    /// Error in lx by obstacles that all connections may have missed, times the number of passes.
    pub missed: f64,
    /// Part of this error by obstacles that connections to some photons may have missed.
    pub missed_by_connections: f64,
    /// Variance in lx2 by light that boxes partly hide, with one photon of each opening in place of all.
    pub by_one_photon: f64,
    pub rays: RayCount,
}

impl AddAssign for Straight {
    fn add_assign(&mut self, other: Self) {
        self.lux += other.lux;
        self.missed += other.missed;
        self.missed_by_connections += other.missed_by_connections;
        self.by_one_photon += other.by_one_photon;
        self.rays += other.rays;
    }
}

/// Connections of sensors to openings.
#[derive(Debug)]
pub struct OpeningConnections {
    /// Part of each opening that each sensor sees, grid by grid, and tube by tube.
    seen: Vec<Vec<VisiblePart>>,
    /// Number of connections to an opening that something may hide, by grid.
    per_opening: Vec<u32>,
    seed: Key,
}

/// Sensors of a grid in a pass.
#[derive(Clone, Copy)]
pub struct GridSensors<'a> {
    /// Number of the grid.
    pub number: usize,
    pub grid: &'a Grid,
    /// Number of the pass.
    pub pass: u64,
    /// Offsets of all photons within a cell, in m; `None` for points.
    pub offsets: Option<&'a [Vec<DVec2>]>,
    /// Key of the random numbers of this grid in this pass.
    pub stream: Key,
}

impl OpeningConnections {
    /// Finds the openings that the sensors of the grids see whole, and those that they do not see at all.
    pub fn new(scene: &TraceableScene, grids: &[Grid], counts: &[SampleCounts], seed: Key) -> Self {
        let per_opening = counts.iter().map(|counts| counts.per_opening).collect();
        Self { seen: grids.iter().map(|grid| visible_parts(scene, grid)).collect(), per_opening, seed }
    }

    /// Counts the sources to each of which a sensor of a grid has several connections: openings and luminaires that something may hide in
    /// part, and chains of mirrors.
    pub fn hidden_sources(&self, scene: &TraceableScene, grid: usize, sensor: usize) -> usize {
        let tubes = scene.tubes.len();
        let seen = &self.seen[grid][sensor * tubes..(sensor + 1) * tubes];
        let openings = seen.iter().filter(|seen| **seen == VisiblePart::InPart).count();
        let luminaires = scene.luminaires.iter().filter(|luminaire| luminaire.emits()).count();
        let hidden = if scene.luminaires_obstructed { luminaires } else { 0 };
        openings + hidden + scene.mirrors.count() * (1 + luminaires)
    }

    /// Computes the direct light of a sensor from all openings that are far from it.
    pub fn straight<const C: usize>(
        &self,
        scene: &TraceableScene,
        light: &DiffuserLight<C>,
        sensors: GridSensors,
        sensor: usize,
    ) -> Straight {
        let grid = sensors.grid;
        let (Sensor { position, normal }, reach) = (lifted(scene, grid, sensor), reach(grid));
        let tubes = scene.tubes.len();
        let average = grid.estimate == EstimateKind::CellAverage;
        let key = self.seed.stream(Stream::EvenConnections, sensors.number as u64).child(sensor as u64);
        let mut random =
            PathRandom::new(sensors.stream.stream(Stream::Sensor, sensor as u64).stream(Stream::PartlySeen, 0));
        let (mut straight, [mut by_photons, mut by_connections]) = (Straight::default(), [0.0; 2]);
        for tube in (0..tubes).filter(|tube| light.tubes()[*tube].is_far(position, reach)) {
            match self.seen[sensors.number][sensor * tubes + tube] {
                VisiblePart::Whole => {
                    straight.lux += light.at_sensor(tube, Sensor { position, normal }, sensors.offsets);
                    continue;
                }
                VisiblePart::Hidden => continue,
                VisiblePart::PastBoxes => {
                    let of_tube = past_boxes(scene, light, tube, Sensor { position, normal });
                    straight += Straight { missed: 0.0, ..of_tube };
                    by_photons += of_tube.missed.powi(2);
                    continue;
                }
                VisiblePart::InPart => {}
            }
            let start = PathRandom::new(key.child(tube as u64)).uniform();
            let connections = self.per_opening[sensors.number];
            let fraction = 1.0 / f64::from(connections);
            let mut unhidden = 0.0;
            for connection in 0..connections {
                let point = position + if average { point_of_cell(grid, random.uniform2()) } else { DVec3::ZERO };
                let number = sensors.pass.wrapping_mul(u64::from(connections)).wrapping_add(u64::from(connection));
                let place = (start + radical_inverse(number)).fract();
                let Some((source, lux)) = light.of_photon(tube, Sensor { position: point, normal }, place) else {
                    continue;
                };
                unhidden += lux * fraction;
                straight.rays += 1;
                if !(average && scene.is_in_solid(point)) && scene.visible(source, None, point, None) {
                    straight.lux += lux * fraction;
                }
            }
            by_connections += (unhidden / (f64::from(connections).powi(3) * PASSES).sqrt()).powi(2);
        }
        let [missed, missed_by_connections] = [by_photons + by_connections, by_connections].map(f64::sqrt);
        Straight { missed, missed_by_connections, ..straight }
    }
}

/// Computes the direct light of a point from an opening that boxes may partly hide: for every photon the shadows of the boxes decide.
fn past_boxes<const C: usize>(
    scene: &TraceableScene,
    light: &DiffuserLight<C>,
    tube: usize,
    sensor: Sensor,
) -> Straight {
    let of_tube = &light.tubes()[tube];
    let between = scene.between(sensor.position, &of_tube.frame, of_tube.radius);
    let (mut seen, mut unhidden, mut squares) = (0.0, 0.0, 0.0);
    for (source, flux) in of_tube.photons() {
        let to_light = source - sensor.position;
        let lux = flux.luminance() * per_lumen(to_light, sensor.normal).max(0.0);
        unhidden += lux;
        if !between.hides(source.truncate()) {
            seen += lux;
            squares += lux * lux;
        }
    }
    let count = of_tube.photons.len().max(1) as f64;
    Straight {
        lux: seen,
        missed: unhidden / (count.powi(3) * PASSES).sqrt(),
        by_one_photon: (count * squares - seen * seen).max(0.0),
        ..Straight::default()
    }
}

/// Computes the light that openings and luminaires send to a sensor by mirrors, with `connections` connections by each chain of mirrors;
/// the connections to luminaires are weighted (MIS) against the sensor's `rays`.
pub fn by_mirrors<const C: usize>(
    scene: &TraceableScene,
    light: &DiffuserLight<C>,
    sensors: GridSensors,
    sensor: usize,
    [rays, connections]: [f64; 2],
) -> Straight {
    let grid = sensors.grid;
    let mut straight = Straight::default();
    let Sensor { position, normal } = lifted(scene, grid, sensor);
    let average = grid.estimate == EstimateKind::CellAverage;
    let key = sensors.stream.stream(Stream::Sensor, sensor as u64).stream(Stream::StraightByMirrors, 0);
    // points of a cell may lie in front of mirrors behind which its centre lies
    for chain in 0..scene.mirrors.count() {
        let mut random = PathRandom::new(key.child(chain as u64));
        let connections = scene.mirrors.connections(chain, connections);
        let shift = random.uniform2();
        for connection in 0..connections as u32 {
            let point = position + if average { point_of_cell(grid, random.uniform2()) } else { DVec3::ZERO };
            if average && scene.is_in_solid(point) {
                continue;
            }
            let numbers = lattice::point(f64::from(connection), connections, shift);
            if let Some((path, light)) = light.by_mirrors(scene, chain, (point, normal, None), numbers) {
                straight.rays += path.rays;
                straight.lux += light.luminance() * path.toward.dot(normal).max(0.0) / connections;
            }
            for luminaire in scene.luminaires.iter().filter(|luminaire| luminaire.emits()) {
                let source = scene.enclosure.clamp(luminaire.point(random.uniform2()));
                let to = (source, Some(luminaire.surface));
                let Some(path) = scene.mirror_path::<C>((&scene.mirrors, chain), (point, None), to) else { continue };
                straight.rays += path.rays;
                let per_luminance =
                    weighted_connection(luminaire, path.unfolded, path.toward.dot(normal), [rays, connections]);
                straight.lux += (path.reflectance * luminaire.seen(path.unfolded)).luminance() * per_luminance;
            }
        }
    }
    straight
}

/// Computes the direct light of a sensor from luminaires: in closed form where nothing can hide it, else by `connections` connections to
/// each, which share it with the sensor's `rays` by the power heuristic (Veach and Guibas 1995, beta = 2).
pub fn of_luminaires<const C: usize>(
    scene: &TraceableScene,
    sensors: GridSensors,
    sensor: usize,
    [rays, connections]: [f64; 2],
) -> Straight {
    let grid = sensors.grid;
    let mut straight = Straight::default();
    if !scene.luminaires.iter().any(TraceableLuminaire::emits) {
        return straight;
    }
    let Sensor { position, normal } = lifted(scene, grid, sensor);
    let average = grid.estimate == EstimateKind::CellAverage;
    let key = sensors.stream.stream(Stream::Sensor, sensor as u64);
    for (number, luminaire) in scene.luminaires.iter().enumerate().filter(|(_, luminaire)| luminaire.emits()) {
        if !average && !scene.luminaires_obstructed {
            straight.lux += luminaire.irradiance::<C>(position, normal).luminance();
            continue;
        }
        let mut random = PathRandom::new(key.stream(Stream::StraightFromLuminaires, number as u64));
        let (shift, shift_in_cell) = (random.uniform2(), random.uniform2());
        for connection in 0..connections as u32 {
            let even = |shift: [f64; 2]| lattice::point(f64::from(connection), connections, shift);
            let point = if average { position + point_of_cell(grid, even(shift_in_cell)) } else { position };
            if average && scene.is_in_solid(point) {
                continue;
            }
            if !scene.luminaires_obstructed {
                straight.lux += luminaire.irradiance::<C>(point, normal).luminance() / connections;
                continue;
            }
            let source = scene.enclosure.clamp(luminaire.point(if average { random.uniform2() } else { even(shift) }));
            let to_light = source - point;
            let cosine = to_light.normalize_or_zero().dot(normal);
            let per_luminance = weighted_connection(luminaire, to_light, cosine, [rays, connections]);
            if per_luminance <= 0.0 {
                continue;
            }
            straight.rays += 1;
            if scene.visible(source, Some(luminaire.surface), point, None) {
                straight.lux += luminaire.seen::<C>(to_light).luminance() * per_luminance;
            }
        }
    }
    straight
}

/// Returns the illuminance of a sensor per luminance by one of `connections` connections to a luminaire, `to_light`, that arrives at this
/// cosine, weighted (MIS) against `rays` of the sensor.
fn weighted_connection(
    luminaire: &TraceableLuminaire,
    to_light: DVec3,
    cosine: f64,
    [rays, connections]: [f64; 2],
) -> f64 {
    let connected = connections * luminaire_density(luminaire, to_light);
    if cosine > 0.0 && connected > 0.0 {
        cosine * power_heuristic(connected, rays * cosine / PI) / connected
    } else {
        0.0
    }
}
