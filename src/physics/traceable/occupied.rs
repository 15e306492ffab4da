//! Parts of grids that solids take or that lie outside the room: points inside boxes and closed meshes or where there is no floor, and
//! parts of cells.
//!
//! A box is solid, and so is a piece of a mesh object that is closed, by itself or by faces of the room that it stands on; a piece within
//! a larger one of the same object is its cavity. A piece that holds an opening or a luminaire is no solid: it is a room drawn as a mesh,
//! or the shade of a lamp. Points on the sides or the top of a solid are outside; those on the underside, which look up into it, are
//! inside.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use super::box_object::TraceableBox;
use super::enclosure::TraceableEnclosure;
use super::solids::{Sheet, Solid, sections};
use super::surface_id::RoomObject;
use crate::geometry::covered::{
    Edge, area_in_rectangle, bounds, contains, covered, distance, enclosed_area, polygon, rectangle,
};
use crate::scene::{EstimateKind, Grid, MeshObject, Scene, Sensor};

/// Fraction of the room's scale within which points lie on surfaces.
const TOLERANCE: f64 = 1e-9;

/// Smallest free fraction of a cell: below it the cell counts as all inside a solid, above 1 minus it as all free.
const LEAST_SHARE: f64 = 1e-6;

/// Number of points on an opening's rim at which it is tested whether the opening lies in a piece.
const RIM: u32 = 16;

/// Parts of a grid that solids take.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OccupiedParts {
    /// Free fraction of each sensor, as in [`Grid::free`]; empty where nothing is taken.
    pub free: Vec<f64>,
    /// Fraction of the area of each sensor's cell that lies in the room, as in [`Grid::area`]; empty where that is all of every cell.
    pub area: Vec<f64>,
    /// Objects that take any part of the grid, boxes first.
    pub by: Vec<RoomObject>,
}

impl OccupiedParts {
    /// Returns the number of sensors outside the room or inside solids; a cell counts where nothing of it is free.
    pub fn without_value(&self) -> usize {
        self.free.iter().filter(|free| **free == 0.0).count()
    }

    /// Returns the number of cells that solids take in part.
    pub fn partly(&self) -> usize {
        let in_room = |sensor: usize| self.area.get(sensor).copied().unwrap_or(1.0);
        self.free.iter().enumerate().filter(|(sensor, free)| **free > 0.0 && **free < in_room(*sensor)).count()
    }

    /// Finds the parts of a grid that objects of a scene take or that lie outside its faces.
    pub fn of(scene: &Scene, grid: &Grid) -> Self {
        Self::of_grid(&Solids::of(scene), grid)
    }

    /// Finds the parts of a grid that lie outside the faces of a scene, whatever stands in it.
    pub fn outside(scene: &Scene, grid: &Grid) -> Self {
        Self::of_grid(&Solids::none(scene), grid)
    }

    fn of_grid(solids: &Solids<'_>, grid: &Grid) -> Self {
        if let Some(placed) = &grid.placed {
            return Self::of_placed(solids, placed);
        }
        let (scene, tolerance) = (solids.scene, solids.tolerance);
        let covers = solids.covers(grid.height_m);
        let area = area_inside(scene, grid, tolerance);
        let of_area = |area: &f64| match grid.estimate {
            EstimateKind::Point => f64::from(*area > 0.0),
            EstimateKind::CellAverage => *area,
        };
        let mut free = if area.is_empty() { vec![1.0; grid.len()] } else { area.iter().map(of_area).collect() };
        let mut by = Vec::new();
        if covers.is_empty() && area.is_empty() {
            return Self::default();
        }
        for row in 0..grid.cells[1] {
            let sensors = row * grid.cells[0]..(row + 1) * grid.cells[0];
            let free_parts = &mut free[sensors];
            match grid.estimate {
                EstimateKind::Point => take_points(grid, row, &covers, tolerance, free_parts, &mut by),
                EstimateKind::CellAverage => take_cells(grid, row, &covers, tolerance, free_parts, &mut by),
            }
        }
        by.sort_unstable();
        by.dedup();
        if by.is_empty() && area.is_empty() { Self::default() } else { Self { free, area, by } }
    }

    /// Finds those of sensors at any places that objects of a scene take; each sensor has a level plane of its own.
    fn of_placed(solids: &Solids<'_>, placed: &[Sensor]) -> Self {
        let (scene, tolerance) = (solids.scene, solids.tolerance);
        let enclosure = TraceableEnclosure::new(&scene.room.enclosure);
        let mut covers: HashMap<u64, Vec<Cover>> = HashMap::new();
        let mut by = Vec::new();
        // a hair in front of the sensor, to which side its light comes from
        let before = |sensor: &Sensor| sensor.position + sensor.normal * (4.0 * tolerance);
        let mut of_sensor = |sensor: &Sensor| {
            let at = before(sensor);
            let covers = covers.entry(at.z.to_bits()).or_insert_with(|| solids.covers(at.z));
            let mut free = [1.0];
            take_points(&single_point(scene, at), 0, covers, tolerance, &mut free, &mut by);
            free[0]
        };
        let is_in_room = |sensor: &Sensor| enclosure.contains(sensor.position) && enclosure.contains(before(sensor));
        let mut area: Vec<f64> = placed.iter().map(|sensor| f64::from(is_in_room(sensor))).collect();
        let in_room = placed.iter().zip(&area);
        let free: Vec<f64> = in_room.map(|(sensor, area)| if *area == 0.0 { 0.0 } else { of_sensor(sensor) }).collect();
        if area.iter().all(|area| *area == 1.0) {
            area.clear();
        }
        by.sort_unstable();
        by.dedup();
        if free.iter().all(|free| *free == 1.0) { Self::default() } else { Self { free, area, by } }
    }
}

/// Lists the objects of a scene inside which a point of its room lies, boxes first.
pub fn solids_around(scene: &Scene, point: DVec3) -> Vec<RoomObject> {
    OccupiedParts::of(scene, &single_point(scene, point)).by
}

/// Returns a grid of one point sensor.
fn single_point(scene: &Scene, point: DVec3) -> Grid {
    let size = scene.room.enclosure.extent().truncate().to_array();
    let plane = Grid::new(String::new(), point.z, [1; 2], 0.0, size, EstimateKind::Point);
    Grid { x_m: vec![point.x], y_m: vec![point.y], ..plane }
}

/// Computes the fraction of the area of each cell that lies in the room: 0 where its centre lies outside or too close to a wall. Empty where
/// all cells lie inside as a whole.
fn area_inside(scene: &Scene, grid: &Grid, tolerance: f64) -> Vec<f64> {
    let enclosure = &scene.room.enclosure;
    let half = 0.5 * DVec2::from(grid.cell_size_m);
    let [low, high] = enclosure.bounds().map(DVec3::truncate);
    let is_within = |sensor: usize| {
        let centre = grid.centre(sensor).truncate();
        (centre - half).cmpge(low - tolerance).all() && (centre + half).cmple(high + tolerance).all()
    };
    if enclosure.as_box().is_some() && grid.from_walls_m == 0.0 && is_within(0) && is_within(grid.len() - 1) {
        return Vec::new();
    }
    let inside = enclosure.section(grid.height_m);
    let from_walls = grid.from_walls_m.max(2.0 * tolerance) - tolerance;
    let of_sensor = |sensor: usize| {
        let centre = grid.centre(sensor).truncate();
        let to_wall = distance(&inside, centre);
        if !contains(&inside, centre) || to_wall < from_walls {
            return 0.0;
        }
        if to_wall > half.length() {
            return 1.0;
        }
        match area_in_rectangle(&inside, centre - half, centre + half) / grid.cell_area_m2() {
            share if share > 1.0 - LEAST_SHARE => 1.0,
            share => share.max(LEAST_SHARE),
        }
    };
    let area: Vec<f64> = (0..grid.len()).map(of_sensor).collect();
    if area.iter().all(|area| *area == 1.0) { Vec::new() } else { area }
}

/// Outline of a solid in the plane of a grid.
struct Cover {
    of: RoomObject,
    edges: Vec<Edge>,
    low: DVec2,
    high: DVec2,
    /// Box whose outline this is; `None` for a mesh.
    solid: Option<TraceableBox>,
}

/// Solids of a scene that can cover sensors.
struct Solids<'a> {
    scene: &'a Scene,
    tolerance: f64,
    boxes: Vec<TraceableBox>,
    /// Closed pieces of meshes that hold no source of light, with the number of their object.
    pieces: Vec<(usize, Solid)>,
}

impl<'a> Solids<'a> {
    fn none(scene: &'a Scene) -> Self {
        let tolerance = TOLERANCE * scene.room.enclosure.scale_m();
        Self { scene, tolerance, boxes: Vec::new(), pieces: Vec::new() }
    }

    fn of(scene: &'a Scene) -> Self {
        let tolerance = TOLERANCE * scene.room.enclosure.scale_m();
        let boxes = scene.room.boxes.iter().map(TraceableBox::new).collect();
        let faces: Vec<_> = scene.room.enclosure.faces().iter().map(|face| face.polygon.clone()).collect();
        let of_mesh = |(number, object): (usize, &MeshObject)| {
            let solids = object.in_room().flat_map(|mesh| Solid::of_mesh(&mesh, &faces, tolerance));
            let solids = solids.filter(Solid::is_closed).filter(|solid| !holds_a_source(scene, solid, tolerance));
            solids.map(|solid| (number, solid)).collect::<Vec<_>>()
        };
        let pieces = scene.room.meshes.iter().enumerate().flat_map(of_mesh).collect();
        Self { scene, tolerance, boxes, pieces }
    }

    /// Returns the outlines of the solids in a level plane.
    fn covers(&self, height: f64) -> Vec<Cover> {
        let new = |of, edges: Vec<Edge>, solid| {
            let (low, high) = bounds(edges.iter());
            Cover { of, edges, low, high, solid }
        };
        let boxes = self.boxes.iter().enumerate().filter(|(_, object)| {
            let (low, high) = object.span();
            height >= low && height < high
        });
        let boxes = boxes
            .map(|(number, object)| new(RoomObject::Box(number), polygon(&object.outline()), Some(object.clone())));
        let mut covers: Vec<Cover> = boxes.collect();
        let sheet = horizontal(self.scene, height, self.tolerance);
        for of_object in self.pieces.chunk_by(|a, b| a.0 == b.0) {
            let solids = of_object.iter().map(|(_, solid)| solid).filter(|solid| solid.may_cut(&sheet));
            let found = sections(solids, &sheet).covers.into_iter();
            covers.extend(found.map(|edges| new(RoomObject::Mesh(of_object[0].0), edges, None)));
        }
        covers
    }
}

impl Cover {
    /// True if the bounds of the outline meet the rectangle from `low` to `high`.
    fn is_near(&self, low: DVec2, high: DVec2) -> bool {
        self.low.cmple(high).all() && self.high.cmpge(low).all()
    }
}

/// Returns the whole horizontal plane of the room at a height, seen from above.
fn horizontal(scene: &Scene, height: f64, hair: f64) -> Sheet {
    let [low, high] = scene.room.enclosure.bounds();
    Sheet {
        origin: DVec3::new(0.0, 0.0, height),
        u: DVec3::X,
        v: DVec3::Y,
        seen: DVec3::Z,
        low: low.with_z(height),
        high: high.with_z(height),
        hair,
    }
}

/// True if an opening, or the middle of a luminaire, lies in a solid: there is light inside.
fn holds_a_source(scene: &Scene, solid: &Solid, tolerance: f64) -> bool {
    let holds = |height: f64, points: &[DVec2]| {
        // the section is a hair above
        let sheet = horizontal(scene, height - tolerance, tolerance);
        solid.may_cut(&sheet)
            && sections(std::iter::once(solid), &sheet)
                .covers
                .iter()
                .any(|cover| points.iter().all(|point| contains(cover, *point)))
    };
    let of_tube = |tube: &crate::scene::Tube| {
        let frame = tube.frame(&scene.room.enclosure);
        let around = |angle: f64| DVec2::new(libm::cos(angle), libm::sin(angle));
        let angle = |number: u32| f64::from(number) / f64::from(RIM) * std::f64::consts::TAU;
        let opening = tube.opening();
        let rim = (0..RIM).map(|number| (1.0 - TOLERANCE) * opening.rim(around(angle(number))));
        let points = std::iter::once(DVec2::ZERO).chain(rim);
        if !frame.is_level() {
            let before = |away: DVec2| frame.origin + frame.direction_in_room(away.extend(-2.0 * tolerance));
            return points.map(before).all(|point| holds(point.z, &[point.truncate()]));
        }
        let points: Vec<DVec2> = points.map(|away| tube.centre + away).collect();
        holds(frame.origin.z - tolerance, &points)
    };
    let of_luminaire = |luminaire: &crate::scene::Luminaire| {
        let middle = luminaire.corner + 0.5 * (luminaire.edge_u + luminaire.edge_v);
        holds(middle.z, &[middle.truncate()])
    };
    scene.tubes.iter().any(of_tube) || scene.room.luminaires.iter().any(of_luminaire)
}

/// Takes the points of a row that lie inside solids: their free fraction becomes 0.
fn take_points(grid: &Grid, row: usize, covers: &[Cover], tolerance: f64, free: &mut [f64], by: &mut Vec<RoomObject>) {
    let y = grid.y_m[row];
    for cover in covers.iter().filter(|cover| cover.low.y <= y && cover.high.y >= y) {
        let near = |x: f64| cover.low.x <= x && x <= cover.high.x;
        // a point on a side is not between the crossings of both lines beside it
        let lines = [y - tolerance, y + tolerance].map(|y| crossings(&cover.edges, y));
        let within = |x: f64, line: &[f64]| {
            let before = |x: f64| line.partition_point(|crossing| *crossing < x);
            let (left, right) = (before(x - tolerance), before(x + tolerance));
            left == right && left % 2 == 1
        };
        for (x, free) in grid.x_m.iter().zip(&mut *free).filter(|(x, _)| near(**x)) {
            let is_inside = match &cover.solid {
                // as the integrators test it
                Some(solid) => solid.contains(DVec3::new(*x, y, grid.height_m)),
                None => lines.iter().all(|line| within(*x, line)),
            };
            if is_inside {
                *free = 0.0;
                by.push(cover.of);
            }
        }
        by.dedup();
    }
}

/// Finds the x, in ascending order, at which the line at `y` crosses edges.
fn crossings(edges: &[Edge], y: f64) -> Vec<f64> {
    let crossing = |[a, b]: &Edge| ((a.y > y) != (b.y > y)).then(|| a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x));
    let mut found: Vec<f64> = edges.iter().filter_map(crossing).collect();
    found.sort_unstable_by(f64::total_cmp);
    found
}

/// Subtracts from the free fractions of a row of cells the parts that lie inside solids.
fn take_cells(grid: &Grid, row: usize, covers: &[Cover], tolerance: f64, free: &mut [f64], by: &mut Vec<RoomObject>) {
    let half = 0.5 * DVec2::from(grid.cell_size_m);
    let margin = DVec2::splat(8.0 * tolerance);
    let around = |edge: &&Edge, low: DVec2, high: DVec2| {
        let [a, b] = **edge;
        a.max(b).cmpge(low).all() && a.min(b).cmple(high).all()
    };
    // the edges that the row meets suffice to decide whether a point of the row is inside
    let (low, high) = (grid.y_m[row] - half.y - margin.y, grid.y_m[row] + half.y + margin.y);
    let (low, high) = (DVec2::new(f64::NEG_INFINITY, low), DVec2::new(f64::INFINITY, high));
    let covers: Vec<(&Cover, Vec<Edge>)> = covers
        .iter()
        .filter(|cover| cover.is_near(low, high))
        .map(|cover| (cover, cover.edges.iter().filter(|edge| around(edge, low, high)).copied().collect()))
        .collect();
    for (x, free) in grid.x_m.iter().zip(free) {
        let centre = DVec2::new(*x, grid.y_m[row]);
        let (low, high) = (centre - half, centre + half);
        let mut parts: Vec<Vec<Edge>> = Vec::new();
        let mut takers = Vec::new();
        for (cover, edges) in covers.iter().filter(|(cover, _)| cover.is_near(low, high)) {
            let cuts = edges.iter().any(|edge| around(&edge, low - margin, high + margin));
            if cuts || contains(edges, centre) {
                takers.push(cover.of);
                parts.push(edges.clone());
            }
        }
        if parts.is_empty() {
            continue;
        }
        let area = grid.cell_area_m2();
        let fraction = 1.0 - enclosed_area(&covered(&rectangle(low, high), &parts, tolerance)) / area;
        *free = match *free + fraction - 1.0 {
            fraction if fraction < LEAST_SHARE => 0.0,
            fraction if fraction > 1.0 - LEAST_SHARE => continue,
            fraction => fraction,
        };
        by.extend(takers);
        by.sort_unstable();
        by.dedup();
    }
}
