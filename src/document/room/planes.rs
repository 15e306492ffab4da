//! Planes of faces, and the corners in which they meet.

use glam::DVec3;

use super::closed::{CorneredFaces, area_vector};
use crate::geometry::planar::Polygon;

/// Fraction of the room's scale by which numbers differ that are meant to be equal.
const ROUNDING: f64 = 1e-9;

/// Least sine of the angle between planes whose common line is used to place a corner; the distance that a corner is moved is at most its
/// distance from the planes over this.
const LEAST_ANGLE: f64 = 0.1;

/// Plane of a face.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    /// Unit normal, about which the boundary runs counter-clockwise.
    pub normal: DVec3,
    /// Distance from the origin along the normal in m.
    offset: f64,
}

impl Plane {
    /// Fits the plane of a face to its corners, of which `area` is the area times the normal; `near` in m is the distance within which
    /// corners are taken for one. The plane is along axes to the bit where all corners lie so near to such a plane.
    pub fn fit<I: Iterator<Item = DVec3>>(corners: impl Fn() -> I, area: DVec3, near: f64) -> Self {
        let low = corners().fold(DVec3::INFINITY, DVec3::min);
        let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
        if let Some(axis) = (0..3).find(|axis| high[*axis] - low[*axis] <= near) {
            let normal = DVec3::AXES[axis] * area[axis].signum();
            return Self { normal, offset: 0.5 * (low[axis] + high[axis]) * normal[axis] };
        }
        let normal = area.normalize_or_zero();
        let (sum, count) = corners().fold((0.0, 0.0), |(sum, count), corner| (sum + normal.dot(corner), count + 1.0));
        Self { normal, offset: sum / count }
    }

    /// Returns the height in m of a point above the plane, along the normal.
    pub fn height(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }
}

/// Returns faces that are planar within `near` m with their corners in their planes, and the largest distance in m by which one was moved;
/// `None` where a face is not as planar. Corners of one face on edges of others become corners of those, too.
pub fn straightened(cornered: &CorneredFaces, near: f64) -> Option<(CorneredFaces, f64)> {
    let mut straight = cornered.clone();
    straight.split_at_corners(near);
    let plane = |rings: &Vec<Vec<usize>>| {
        let corners = || rings.iter().flatten().map(|corner| straight.places[*corner]);
        let plane = Plane::fit(corners, area_vector(&straight.places, &rings[0]), near);
        corners().all(|corner| plane.height(corner).abs() <= near).then_some(plane)
    };
    let planes: Vec<Plane> = straight.faces.iter().map(plane).collect::<Option<_>>()?;
    move_into_planes(&mut straight, &planes);
    let moved = straight.places.iter().zip(&cornered.places).map(|(to, from)| to.distance(*from)).fold(0.0, f64::max);
    Some((straight, moved))
}

/// Moves each corner into the planes of the faces that meet in it, as far as they have a common point; returns the largest distance in m
/// of a corner from a plane that is left.
pub fn move_into_planes(cornered: &mut CorneredFaces, planes: &[Plane]) -> f64 {
    let mut of_corner: Vec<Vec<usize>> = vec![Vec::new(); cornered.places.len()];
    for (face, rings) in cornered.faces.iter().enumerate() {
        rings.iter().flatten().for_each(|corner| of_corner[*corner].push(face));
    }
    let mut left: f64 = 0.0;
    for (place, faces) in cornered.places.iter_mut().zip(&of_corner) {
        let mut basis: Vec<DVec3> = Vec::with_capacity(3);
        for Plane { normal, offset } in faces.iter().map(|face| planes[*face]) {
            let across = basis.iter().fold(normal, |across, other| across - *other * other.dot(across));
            let sine = across.length();
            if sine < LEAST_ANGLE || basis.len() == 3 {
                continue;
            }
            // across the planes before, so that it stays in them
            *place += across * ((offset - normal.dot(*place)) / (sine * sine));
            basis.push(across / sine);
        }
        for Plane { normal, offset } in faces.iter().map(|face| planes[*face]) {
            if let Some(axis) = (0..3).find(|axis| normal[*axis].abs() == 1.0) {
                place[axis] = offset * normal[axis];
            }
            left = left.max((normal.dot(*place) - offset).abs());
        }
    }
    left
}

/// Builds the polygon of a face, given by its number and whether it runs counter-clockwise seen from inside, as the polygon does. `scale` in
/// m is that of rounding.
pub fn polygon(cornered: &CorneredFaces, (face, inward): (usize, bool), plane: &Plane, scale: f64) -> Polygon {
    let ring = |ring: &Vec<usize>| -> Vec<DVec3> {
        let corners = ring.iter().map(|corner| cornered.places[*corner]);
        if inward { corners.collect() } else { corners.rev().collect() }
    };
    let rings: Vec<Vec<DVec3>> = cornered.faces[face].iter().map(ring).collect();
    let normal = if inward { plane.normal } else { -plane.normal };
    let polygon = Polygon::with_normal(rings.clone(), normal);
    if polygon.corners().all(|corner| polygon.height(corner).abs() <= ROUNDING * scale) {
        return polygon;
    }
    // planes without a common point: each face is planar, and neighbours differ by less than the repair
    let onto = |ring: Vec<DVec3>| ring.into_iter().map(|corner| polygon.onto(corner)).collect();
    Polygon::with_normal(rings.into_iter().map(onto).collect(), normal)
}
