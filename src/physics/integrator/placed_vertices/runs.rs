//! Triangles of meshes as places for vertices: in runs of neighbours, on either side.

use std::ops::Range;

use glam::DVec3;

use crate::traceable::Side;
use crate::traceable::mesh_objects::TraceableMeshes;

/// Fewest triangles of one facet that share a weight, as long as there are not more.
const LENGTH: usize = 16;

/// Runs of all meshes together, facets of fewer than [`LENGTH`] triangles left aside; larger meshes have longer runs.
const MOST_RUNS: usize = 2048;

/// Some triangles whose importance is one number, on one side.
#[derive(Clone, Debug)]
pub struct Run {
    /// Places of the triangles in [`Runs::order`].
    triangles: Range<usize>,
    /// 1 on the side about which their corners go counter-clockwise, -1 on the other.
    side: f64,
    /// Unit normal; `None` where they are of several facets.
    pub normal: Option<DVec3>,
    /// Mean of their middles by area, in m.
    pub middle: DVec3,
    pub area_m2: f64,
    /// Height of the highest corner in m.
    pub highest: f64,
    /// Facets that they belong to, each with its side.
    pub faces: Vec<(usize, Side)>,
}

/// All runs of a scene's meshes.
#[derive(Clone, Debug, Default)]
pub struct Runs {
    /// Numbers of the triangles, facet by facet.
    order: Vec<u32>,
    pub all: Vec<Run>,
}

impl Runs {
    /// Both sides of all triangles.
    pub fn new(meshes: &TraceableMeshes) -> Self {
        let facet = |triangle: u32| meshes.facets.of_triangle[triangle as usize];
        let mut order: Vec<u32> = (0..meshes.triangles.len() as u32).collect();
        order.sort_by_key(|triangle| facet(*triangle));
        let length = LENGTH.max(order.len().div_ceil(MOST_RUNS));
        let mut runs = Self { order, all: Vec::new() };
        let mut first = 0;
        while first < runs.order.len() {
            let of = facet(runs.order[first]);
            let of_facet =
                runs.order[first..].iter().take(length).take_while(|triangle| facet(**triangle) == of).count();
            // of small facets as many as fit
            let whole = length == LENGTH || of_facet == length;
            let end = if whole { first + of_facet } else { (first + length).min(runs.order.len()) };
            for side in [1.0, -1.0] {
                let run = runs.run(meshes, first..end, side);
                runs.all.push(run);
            }
            first = end;
        }
        runs
    }

    fn run(&self, meshes: &TraceableMeshes, triangles: Range<usize>, side: f64) -> Run {
        let facet = |place: usize| meshes.facets.of_triangle[self.order[place] as usize] as usize;
        let (mut middle, mut area_m2, mut across, mut highest) = (DVec3::ZERO, 0.0, DVec3::ZERO, f64::NEG_INFINITY);
        let mut faces: Vec<(usize, Side)> = Vec::new();
        for place in triangles.clone() {
            let [corner, u, v] = corners(meshes, self.order[place]);
            let twice = u.cross(v);
            let area = 0.5 * twice.length();
            let is_front = side * twice.dot(meshes.facets.normals[facet(place)]) >= 0.0;
            let face = (facet(place), if is_front { Side::Front } else { Side::Back });
            if !faces.contains(&face) {
                faces.push(face);
            }
            middle += area * (corner + (u + v) / 3.0);
            area_m2 += area;
            across += twice;
            highest = highest.max(corner.z + u.z.max(v.z).max(0.0));
        }
        let first = facet(triangles.start);
        // triangles of a facet may be wound either way
        let is_flat = triangles.clone().all(|place| facet(place) == first) && across.length() > 1.999 * area_m2;
        let normal = across.try_normalize().filter(|_| is_flat).map(|normal| normal * side);
        let middle = if area_m2 > 0.0 { middle / area_m2 } else { corners(meshes, self.order[triangles.start])[0] };
        Run { triangles, side, normal, middle, area_m2, highest, faces }
    }

    /// Areas in m2 of the triangles of a run.
    pub fn areas(&self, meshes: &TraceableMeshes, run: usize) -> impl Iterator<Item = f64> {
        let area = |triangle: &u32| {
            let [_, u, v] = corners(meshes, *triangle);
            0.5 * u.cross(v).length()
        };
        self.order[self.all[run].triangles.clone()].iter().map(area)
    }

    /// A point of a triangle of a run by two numbers in 0..1, the unit normal there, the triangle's area in m2 and its facet.
    pub fn place(
        &self,
        meshes: &TraceableMeshes,
        run: usize,
        number: usize,
        [s, t]: [f64; 2],
    ) -> (DVec3, DVec3, f64, usize) {
        let Run { triangles, side, .. } = &self.all[run];
        let triangle = self.order[triangles.start + number];
        let [corner, u, v] = corners(meshes, triangle);
        let [s, t] = if s + t > 1.0 { [1.0 - s, 1.0 - t] } else { [s, t] };
        let across = u.cross(v);
        let normal = across.normalize_or(DVec3::Z) * *side;
        (corner + u * s + v * t, normal, 0.5 * across.length(), meshes.facets.of_triangle[triangle as usize] as usize)
    }
}

/// A corner of a triangle and the two edges from there.
fn corners(meshes: &TraceableMeshes, triangle: u32) -> [DVec3; 3] {
    let [a, b, c] = meshes.triangles[triangle as usize].map(|corner| meshes.positions[corner as usize]);
    [a, b - a, c - a]
}
