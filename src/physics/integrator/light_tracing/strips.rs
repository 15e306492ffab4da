//! Strips of walls beside point sensors, from where light comes to them from very near.
//!
//! A photon that is scattered at the foot of a wall is rare and bright for the sensors beside it: what it sends them goes with
//! the inverse square of the distance. So each pass spreads points over the strips, where sensors need them. Photons are connected
//! to some points of each strip from wherever they are scattered, and at the end of the pass the points, with what they reflect,
//! to all sensors. Strips stand where nothing can come between, and all scatter as Lambert's law has it.
//!
//! The points count what comes to a strip
//! - from where a photon was scattered, unless it is so near that this connection would be rare and bright instead;
//! - from the sky straight through clear closures, by a ray from the point up the guide.
//!
//! What photons bring in other ways (the sun's light straight through clear closures, what was scattered very near) is
//! connected to the sensors from where it arrives.

use std::f64::consts::PI;

use glam::DVec3;
use rayon::prelude::*;

use crate::guide::RayCount;
use crate::integrator::backward::unscattered::sky_through_openings;
use crate::integrator::photon::connect::{Connection, SensorPlane};
use crate::integrator::photon::path::{Flight, Origin, Scattering};
use crate::optics::Spectrum;
use crate::sampling::{Key, PathSamples, Stream};
use crate::scene::{EstimateKind, Face, Grid};
use crate::traceable::{SurfaceId, TraceableScene};

/// The walls, each at the index of its discriminant.
const WALLS: [Face; 4] = [Face::West, Face::East, Face::South, Face::North];

/// Sensors that are nearer to a wall than this share of the room's shortest edge get a strip there.
const BESIDE: f64 = 0.15;

/// Height of a strip in distances of the nearest sensors from the wall: from higher up little comes to them, and not from near. In
/// the room of the thesis with a clear closure 3.5 of them have a tenth more variance, 8 no less.
const HEIGHT: f64 = 5.0;

/// Distance, in distances of the nearest sensors, within which no photon is connected to points of a strip.
const UNCONNECTED: f64 = 0.5;

/// Photons of a pass for every point of a strip, and fewest and most points.
const PHOTONS_PER_POINT: f64 = 8.0;
const FEWEST_POINTS: f64 = 16.0;
const MOST_POINTS: f64 = 1024.0;

/// Points of a strip over each length of the nearest sensors' distance, at least: by fewer, what comes from very near would be as rare
/// and bright as by photons.
const POINTS_PER_DISTANCE: f64 = 2.0;

/// Length of a wall in distances of the nearest sensors above which it has no strip: nearer to a corner, what photons bring there is
/// so rare and bright for points and sensors that few photons tell no honest errors. Sensors in corners at a 60th of the walls had
/// intervals of 95 % that held 85 %.
const MOST_LENGTH: f64 = 32.0;

/// Points of a strip that a photon is connected to: others get others, and connections to all tell hardly more.
const CONNECTED: usize = 16;

/// Points whose light of the sky one thread follows at least.
const POINTS_AT_ONCE: usize = 64;

/// Sensors of a plane above which photons are connected to some of them alone, and strips would take longer than they save.
const MOST_SENSORS: usize = 1024;

/// Sensors to which one thread connects all points at least.
const SENSORS_AT_ONCE: usize = 256;

/// All strips of a room; none where obstacles, luminaires or what scatters otherwise ask for more than connections.
#[derive(Debug)]
pub struct Strips<const C: usize> {
    all: Vec<Strip<C>>,
    /// For each plane of sensors the number of its strip on each of the walls.
    numbers: Vec<[Option<usize>; 4]>,
    /// Points on each strip, a power of two.
    points: usize,
}

/// The part of a wall that rises from the height of a plane of sensors.
#[derive(Debug)]
struct Strip<const C: usize> {
    /// Number of the plane.
    plane: usize,
    wall: Face,
    /// Heights above the floor in m.
    from: f64,
    to: f64,
    /// Of the wall, in m.
    length: f64,
    /// Of the nearest sensors from the wall, in m.
    distance: f64,
    /// Squared distance in m2 within which no photon is connected to its points.
    unconnected_squared: f64,
    reflectance: Spectrum<C>,
    reflectance_rgb: Spectrum<3>,
    /// Room coordinate of the wall along its normal.
    offset: f64,
}

/// Points of a pass, strip by strip.
#[derive(Debug, Default)]
pub struct Points {
    /// Coordinates along the wall.
    along: Vec<f64>,
    /// Heights above the floor.
    height: Vec<f64>,
    /// Area in m2 that each stands for.
    area: Vec<f64>,
    /// Exitance in lm/m2 by the light of the sky straight through clear closures.
    of_sky: Vec<f64>,
}

/// A point of a strip.
#[derive(Clone, Copy, Debug)]
struct Place {
    along: f64,
    height: f64,
    /// One over its density, in m2.
    area: f64,
}

impl<const C: usize> Strips<C> {
    /// The strips beside `sensors`, for passes of so many photons.
    pub fn new(scene: &TraceableScene, sensors: &[SensorPlane], photons: u64) -> Self {
        let mut strips = Self { all: Vec::new(), numbers: Vec::new(), points: 0 };
        for (number, plane) in sensors.iter().enumerate() {
            strips.numbers.push(WALLS.map(|wall| {
                strips.all.push(Strip::new(scene, number, &plane.grid, wall)?);
                Some(strips.all.len() - 1)
            }));
        }
        let along =
            strips.all.iter().map(|strip| POINTS_PER_DISTANCE * strip.length / strip.distance).fold(0.0, f64::max);
        let points = (photons as f64 / PHOTONS_PER_POINT).max(along).clamp(FEWEST_POINTS, MOST_POINTS);
        strips.points = (points.ceil() as usize).next_power_of_two();
        strips
    }

    /// No strips beside `sensors`.
    pub fn none(sensors: &[SensorPlane]) -> Self {
        Self { all: Vec::new(), numbers: vec![[None; 4]; sensors.len()], points: CONNECTED }
    }

    /// True if nothing has a strip.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// True if a plane of sensors has a strip.
    pub fn stand_beside(&self, plane: usize) -> bool {
        self.numbers[plane].iter().any(Option::is_some)
    }

    /// Number of points of a pass.
    pub fn points(&self) -> usize {
        self.all.len() * self.points
    }

    /// The part of each strip's points that a photon is connected to, by its number among those of its source: so that photons with
    /// neighbouring numbers, as those with equal last digits, are spread over all parts.
    pub fn part(&self, index: u64) -> usize {
        let parts = (self.points / CONNECTED) as u64;
        let (mut part, mut rest) = (0, index);
        while rest > 0 && parts > 1 {
            part ^= rest % parts;
            rest /= parts;
        }
        part as usize
    }

    /// Points spread for a pass, and the rays that found the light of the sky there.
    pub fn spread(&self, scene: &TraceableScene, pass: Key) -> (Points, RayCount) {
        let mut points = Points::default();
        let mut rays = RayCount::default();
        for (number, strip) in self.all.iter().enumerate() {
            let stream = pass.stream(Stream::Strips, number as u64);
            let at = |index: usize| {
                let mut samples = PathSamples::with_pairs(stream, index as u64, 2);
                let place = strip.place(samples.pair());
                let position = strip.position(place.along, place.height);
                let (lux, rays) = sky_through_openings(scene, (position, strip.normal()), &mut samples);
                (place, (lux * strip.reflectance_rgb).luminance(), rays)
            };
            let found: Vec<_> = (0..self.points).into_par_iter().with_min_len(POINTS_AT_ONCE).map(at).collect();
            for (Place { along, height, area }, of_sky, taken) in found {
                points.along.push(along);
                points.height.push(height);
                points.area.push(area / self.points as f64);
                points.of_sky.push(of_sky);
                rays += taken;
            }
        }
        (points, rays)
    }

    /// True if the points of a strip count, for the sensors of a plane, light that came by `flight` to where it is scattered.
    #[inline]
    pub fn count(&self, plane: usize, scattering: &Scattering<'_, C>, flight: &Flight<C>, from_sky: bool) -> bool {
        let wall = scattering.surface.and_then(SurfaceId::face).map(|face| face as usize);
        let Some(number) = wall.filter(|wall| *wall < WALLS.len()).and_then(|wall| self.numbers[plane][wall]) else {
            return false;
        };
        let strip = &self.all[number];
        scattering.position.z <= strip.to
            && match flight.origin {
                Origin::Specular => from_sky,
                Origin::Surface(_) | Origin::Diffuser => {
                    (flight.to - flight.from).length_squared() >= strip.unconnected_squared
                }
                Origin::Lobe(_) | Origin::Luminaire(_) => false,
            }
    }

    /// Adds what a vertex sends to some of the points of every strip, and these reflect, to their exitance in lm/m2.
    pub fn connect(
        &self,
        vectors: pulp::Arch,
        points: &Points,
        part: usize,
        (scattering, weight): (&Scattering<'_, C>, f64),
        exitance: &mut [f64],
    ) {
        let wall = scattering.surface.and_then(SurfaceId::face);
        let share = (self.points / CONNECTED) as f64 * weight / PI;
        for (number, strip) in self.all.iter().enumerate().filter(|(_, strip)| wall != Some(strip.wall)) {
            // as a plane of sensors that look along the wall's normal
            let vertex = strip.seen_on(scattering.position - DVec3::AXES[strip.axis()] * strip.offset);
            let connection = Connection {
                vertex,
                normal: strip.seen_on(scattering.normal),
                depth: vertex.z,
                per_sr: share * (scattering.leaving * strip.reflectance).luminance(),
                near_squared: strip.unconnected_squared,
            };
            let first = number * self.points + part * CONNECTED;
            let some = first..first + CONNECTED;
            connection.add_to(vectors, &mut exitance[some.clone()], &points.along[some.clone()], &points.height[some]);
        }
    }

    /// Adds the illuminance in lx by the points of all strips, whose exitance by photons is given.
    pub fn light(
        &self,
        vectors: pulp::Arch,
        points: &Points,
        by_photons: &[f64],
        sensors: &[SensorPlane],
        lux: &mut [f64],
    ) {
        for (number, strip) in self.all.iter().enumerate() {
            let plane = &sensors[strip.plane];
            let connection = |index: usize| {
                let vertex = strip.position(points.along[index], points.height[index]);
                let per_sr = (by_photons[index] + points.of_sky[index]) * points.area[index] / PI;
                Connection { vertex, normal: strip.normal(), depth: vertex.z - plane.height, per_sr, near_squared: 0.0 }
            };
            let connections: Vec<_> = (number * self.points..(number + 1) * self.points).map(connection).collect();
            let of_plane = lux[plane.first..plane.first + plane.len()].par_chunks_mut(SENSORS_AT_ONCE);
            let places = plane.x.par_chunks(SENSORS_AT_ONCE).zip(plane.y.par_chunks(SENSORS_AT_ONCE));
            of_plane.zip(places).for_each(|(lux, (x, y))| {
                connections.iter().for_each(|connection| connection.add_to(vectors, lux, x, y));
            });
        }
    }
}

/// True if points of some grids are too near to a wall for a strip.
pub fn has_points_very_near(scene: &TraceableScene, grids: &[Grid]) -> bool {
    let is_very_near = |grid: &Grid, wall: &Face| {
        let (axis, _, distance) = beside(scene, grid, *wall);
        scene.size[1 - axis] > MOST_LENGTH * distance
    };
    let points = |grid: &&Grid| grid.estimate != EstimateKind::CellAverage;
    grids.iter().filter(points).any(|grid| WALLS.iter().any(|wall| is_very_near(grid, wall)))
}

/// The axis of a wall's normal, its room coordinate along that, and the distance in m of the nearest points of a grid.
fn beside(scene: &TraceableScene, grid: &Grid, wall: Face) -> (usize, f64, f64) {
    let axis = wall as usize / 2;
    let offset = if (wall as usize).is_multiple_of(2) { 0.0 } else { scene.size[axis] };
    let across = if axis == 0 { &grid.x_m } else { &grid.y_m };
    (axis, offset, across.iter().map(|at| (at - offset).abs()).fold(f64::INFINITY, f64::min))
}

/// True if a room has strips beside the sensors of some grids.
pub fn has_strips(scene: &TraceableScene, grids: &[Grid]) -> bool {
    grids.iter().any(|grid| WALLS.iter().any(|wall| Strip::<3>::new(scene, 0, grid, *wall).is_some()))
}

impl<const C: usize> Strip<C> {
    /// The strip on a wall beside the sensors of a grid, whose plane has this number; `None` where it needs none.
    fn new(scene: &TraceableScene, plane: usize, grid: &Grid, wall: Face) -> Option<Self> {
        let measured = scene.tubes.iter().any(|tube| tube.diffuser.measured().is_some());
        if grid.estimate == EstimateKind::CellAverage || measured || !scene.is_plain() {
            return None;
        }
        let optics = scene.optics(SurfaceId::of_face(wall))?;
        let (axis, offset, distance) = beside(scene, grid, wall);
        let strip = Self {
            plane,
            wall,
            from: grid.height_m,
            to: (grid.height_m + HEIGHT * distance).min(scene.size.z),
            length: scene.size[1 - axis],
            distance,
            unconnected_squared: (UNCONNECTED * distance).powi(2),
            reflectance: optics.diffuse(),
            reflectance_rgb: optics.diffuse(),
            offset,
        };
        let is_beside = distance > 0.0 && distance < BESIDE * scene.size.min_element() && strip.to > strip.from;
        let is_far = strip.length <= MOST_LENGTH * distance;
        let connects_all = grid.len() <= MOST_SENSORS;
        (is_beside && is_far && connects_all && strip.reflectance.max() > 0.0).then_some(strip)
    }

    /// Number of the axis of its normal.
    fn axis(&self) -> usize {
        self.wall as usize / 2
    }

    /// Unit normal into the room.
    fn normal(&self) -> DVec3 {
        DVec3::AXES[self.axis()] * if self.offset == 0.0 { 1.0 } else { -1.0 }
    }

    /// Components of a vector along the wall, upward, and into the room.
    fn seen_on(&self, vector: DVec3) -> DVec3 {
        DVec3::new(vector[1 - self.axis()], vector.z, vector.dot(self.normal()))
    }

    /// The point of the wall with these coordinates.
    fn position(&self, along: f64, height: f64) -> DVec3 {
        let mut position = DVec3::new(along, along, height);
        position[self.axis()] = self.offset;
        position
    }

    /// A place for two numbers in 0..1: even along the wall, and by its height h above the sensors with a density in proportion to
    /// h / (h^2 + d^2)^(7/4), which is what a point sends to an endless row of sensors at the distance d, root of the sum of
    /// squares.
    fn place(&self, [u, v]: [f64; 2]) -> Place {
        let (height, squared) = (self.to - self.from, self.distance * self.distance);
        // the density's integral from a height upward, but for a factor
        let above = |height: f64| libm::pow(height * height + squared, -0.75);
        let all = above(0.0) - above(height);
        let by_sensors = libm::pow(above(0.0) - v * all, -4.0 / 3.0);
        let h = (by_sensors - squared).max(0.0).sqrt();
        let density = 1.5 * h * libm::pow(h * h + squared, -1.75) / all;
        let area = if density > 0.0 { self.length / density } else { 0.0 };
        Place { along: u * self.length, height: self.from + h, area }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::Surface;
    use crate::sampling::PathRandom;
    use crate::scene::{Channels, Room, Scene};
    use crate::statistics::Moments;
    use crate::traceable::Follow;

    fn scene(grids: Vec<Grid>) -> (Scene, TraceableScene) {
        let size = DVec3::new(3.0, 4.0, 2.5);
        let surfaces = [0.5, 0.4, 0.6, 0.0, 0.2, 0.8].map(|reflectance| Some(Surface::diffuse([reflectance; 3])));
        let room = Room { size, surfaces, boxes: Vec::new(), meshes: Vec::new(), luminaires: Vec::new() };
        let scene =
            Scene { daylight: None, room, tubes: Vec::new(), grids, views: Vec::new(), channels: Channels::Photopic };
        let follow = Follow { interreflection: true, guide_return: true, objects: true };
        let traceable = TraceableScene::new(&scene, follow).unwrap();
        (scene, traceable)
    }

    fn grid(height: f64, cells: [usize; 2], estimate: EstimateKind) -> Grid {
        Grid::new("grid".into(), height, cells, 0.0, [3.0, 4.0], estimate)
    }

    /// Strips stand on walls that reflect, beside points that are near to them, from the height of these upward.
    #[test]
    fn strips_stand_where_points_are_beside_walls_that_reflect() {
        let (point, average) = (EstimateKind::Point, EstimateKind::CellAverage);
        let grids = [grid(0.5, [10, 2], point), grid(0.0, [10, 10], average), grid(2.3, [12, 16], point)];
        let (_, scene) = scene(grids.to_vec());
        let planes = grids.each_ref().map(|grid| SensorPlane::new(grid, 0));
        let strips = Strips::<1>::new(&scene, &planes, 2048);
        // the northern wall reflects nothing
        assert_eq!(strips.numbers, [[Some(0), Some(1), None, None], [None; 4], [Some(2), Some(3), Some(4), None]]);
        let heights: Vec<_> = strips.all.iter().map(|strip| [strip.from, strip.to]).collect();
        assert!((heights[1][0], heights[2]) == (0.5, [2.3, 2.5]) && (heights[1][1] - 1.25).abs() < 1e-12);
        assert!(has_strips(&scene, &grids) && !has_strips(&scene, &grids[1..2]));
    }

    /// The mean of f times the area that a place stands for is the integral of f over the strip, within four standard errors; places
    /// lie on the wall, and are seen from the room as they are from before it.
    #[test]
    fn densities_are_those_of_the_places() {
        let (scene, traceable) = scene(vec![grid(0.5, [10, 16], EstimateKind::Point)]);
        for wall in [Face::West, Face::East, Face::South] {
            let strip = Strip::<3>::new(&traceable, 0, &scene.grids[0], wall).unwrap();
            let mut random = PathRandom::new(Key::new(4));
            let mut sum = Moments::default();
            for _ in 0..20_000 {
                let Place { along, height, area } = strip.place(random.uniform2());
                let position = strip.position(along, height);
                assert!((strip.from..=strip.to + 1e-12).contains(&height) && (0.0..strip.length).contains(&along));
                assert_eq!((position - position.clamp(DVec3::ZERO, traceable.size)).length(), 0.0);
                assert_eq!(position[strip.axis()], strip.offset);
                assert_eq!(strip.seen_on(strip.normal()), DVec3::Z);
                assert!(
                    traceable.intersect(0.5 * traceable.size, position - 0.5 * traceable.size, None).normal
                        == strip.normal()
                );
                sum.push(area * (1.0 + along * height));
            }
            let height = strip.to - strip.from;
            let integral =
                strip.length * height + 0.25 * strip.length.powi(2) * (strip.to.powi(2) - strip.from.powi(2));
            assert!((sum.mean - integral).abs() <= 4.0 * sum.standard_error(), "{wall:?}: {integral} {sum:?}");
        }
    }

    /// Points nearer to a wall than a 32nd of its length are very near, cells never: means over them have no poles.
    #[test]
    fn points_very_near_to_walls_are_known() {
        let near = |cells, kind| {
            let (scene, traceable) = scene(vec![grid(0.5, [9, 9], EstimateKind::Point), grid(0.0, cells, kind)]);
            has_points_very_near(&traceable, &scene.grids)
        };
        assert!(!near([12, 12], EstimateKind::Point));
        assert!(near([40, 12], EstimateKind::Point) && near([12, 40], EstimateKind::Point));
        assert!(!near([40, 40], EstimateKind::CellAverage));
    }

    /// Any run of photons that are connected at all reaches every part of the points equally often.
    #[test]
    fn photons_are_spread_over_all_parts() {
        let (scene, traceable) = scene(vec![grid(0.0, [9, 9], EstimateKind::Point)]);
        let strips = Strips::<1>::new(&traceable, &[SensorPlane::new(&scene.grids[0], 0)], 1024);
        let parts = strips.points / CONNECTED;
        assert_eq!(parts, 8);
        for (first, step) in [(0, 1), (64, 1), (0, 8), (3, 8), (5, 64)] {
            let mut counts = vec![0; parts];
            (0..8).for_each(|k| counts[strips.part(first + step * k)] += 1);
            assert_eq!(counts, vec![1; parts], "{first} {step}");
        }
    }
}
