//! Rooms above a plan: a polygon with walls, below a flat, sloped or gable ceiling.

use glam::{DVec2, DVec3};

use super::enclosure::{Enclosure, EnclosureError, EnclosureFace, FaceKind};
use crate::geometry::planar::Polygon;
use crate::optics::Surface;

/// Fraction of a height within which two planes of a ceiling meet.
const COINCIDING: f64 = 1e-9;

/// A plane of a ceiling over a plan: `height_m` at the origin of the plan, and the rise in m per m along x and y.
#[derive(Clone, Copy, Debug)]
pub struct CeilingPlane {
    /// Height at (0, 0) in m.
    pub height_m: f64,
    /// Rise in m per m along x and y; zero where the ceiling is flat.
    pub rise: DVec2,
}

/// Surfaces of a room by the kinds of its faces.
#[derive(Clone, Copy, Debug)]
pub struct KindSurfaces {
    /// Surface of the floor.
    pub floor: Option<Surface>,
    /// Surface of all walls.
    pub walls: Option<Surface>,
    /// Surface of the ceiling.
    pub ceiling: Option<Surface>,
}

impl Enclosure {
    /// Builds a room above a plan: `rings` are the outline and the holes of the floor in m, simple polygons of either sense that do not
    /// meet; the ceiling is the lowest of its planes (one is flat or sloped, two make a gable). Faces: the floor, walls, then a ceiling
    /// for each plane that is lowest anywhere. The wall `wall_K` stands on edge K, from corner K to the next one, counted through the
    /// rings as they are given; edges of no length, within `near_m`, have no wall.
    ///
    /// # Errors
    ///
    /// A ceiling that is not above the floor at all corners, or rings of no area.
    pub fn prism(
        rings: &[Vec<DVec2>],
        near_m: f64,
        ceiling: &[CeilingPlane],
        surfaces: KindSurfaces,
    ) -> Result<Self, EnclosureError> {
        let (walls, rings) = walls_and_rings(rings, near_m);
        let height = |p: DVec2| ceiling.iter().map(|plane| plane.at(p)).fold(f64::INFINITY, f64::min);
        let low = rings.iter().flatten().find(|p| height(**p) <= 0.0);
        if let Some(corner) = low {
            return Err(EnclosureError::LowCeiling { corner: *corner, height_m: height(*corner) });
        }
        let on_floor = rings.iter().map(|ring| ring.iter().map(|p| p.extend(0.0)).collect()).collect();
        let mut faces = vec![EnclosureFace {
            name: "floor".into(),
            kind: FaceKind::Floor,
            polygon: Polygon::with_normal(on_floor, DVec3::Z),
            surface: surfaces.floor,
        }];
        for (number, [from, to]) in walls {
            // the wall's top bends where another plane of the ceiling becomes the lowest
            let at = |fraction: f64| from.lerp(to, fraction);
            let mut bends: Vec<f64> = CeilingPlane::crossings(ceiling, from, to);
            bends.retain(|fraction| CeilingPlane::meet(ceiling, at(*fraction), height(at(*fraction))));
            bends.sort_by(f64::total_cmp);
            let top = bends.into_iter().map(at).map(|p| p.extend(height(p)));
            let mut corners = vec![to.extend(0.0), from.extend(0.0), from.extend(height(from))];
            corners.extend(top);
            corners.push(to.extend(height(to)));
            let normal = (to - from).perp().normalize().extend(0.0);
            faces.push(EnclosureFace {
                name: format!("wall_{number}"),
                kind: FaceKind::Wall,
                polygon: Polygon::with_normal(vec![corners], normal),
                surface: surfaces.walls,
            });
        }
        for (number, plane) in ceiling.iter().enumerate() {
            let others = ceiling.iter().enumerate().filter(|(other, _)| *other != number).map(|(_, other)| *other);
            let lowered = |rings: Vec<Vec<DVec2>>, other: CeilingPlane| -> Vec<Vec<DVec2>> {
                rings.iter().flat_map(|ring| plane.lower_parts(ring, other)).collect()
            };
            let parts: Vec<Vec<DVec3>> = rings
                .iter()
                .flat_map(|ring| others.clone().fold(vec![ring.clone()], lowered))
                .filter(|ring| ring.len() > 2)
                // seen from below, the sense turns round
                .map(|ring| ring.iter().rev().map(|p| p.extend(plane.at(*p))).collect())
                .collect();
            if parts.is_empty() {
                continue;
            }
            let normal = DVec3::new(plane.rise.x, plane.rise.y, -1.0).normalize();
            faces.push(EnclosureFace {
                name: if ceiling.len() == 1 { "ceiling".into() } else { format!("ceiling_{number}") },
                kind: FaceKind::Ceiling,
                polygon: Polygon::with_normal(parts, normal),
                surface: surfaces.ceiling,
            });
        }
        Self::new(faces)
    }
}

impl CeilingPlane {
    /// Builds a flat ceiling.
    pub fn flat(height_m: f64) -> Self {
        Self { height_m, rise: DVec2::ZERO }
    }

    /// Returns the height in m at a place of the plan.
    pub fn at(&self, place: DVec2) -> f64 {
        self.height_m + self.rise.dot(place)
    }

    /// Returns the parts of a ring where this plane is below another one, in the ring's sense. Corners where both are equal lie on their common
    /// line; the parts are closed along this line, through all such corners.
    fn lower_parts(&self, ring: &[DVec2], other: Self) -> Vec<Vec<DVec2>> {
        let scale = ring.iter().map(|p| self.at(*p).abs()).fold(0.0, f64::max);
        let below = |p: DVec2| match other.at(p) - self.at(p) {
            difference if difference.abs() <= COINCIDING * scale => 0.0,
            difference => difference,
        };
        if !ring.iter().any(|p| below(*p) < 0.0) {
            return vec![ring.to_vec()];
        }
        // each piece of the ring that lies below, from the place where it comes from the line to the place where it goes back
        let mut pieces: Vec<Vec<DVec2>> = Vec::new();
        let Some(start) = (0..ring.len()).find(|k| below(ring[*k]) <= 0.0) else { return vec![ring.to_vec()] };
        for k in start..start + ring.len() {
            let (a, b) = (ring[k % ring.len()], ring[(k + 1) % ring.len()]);
            let (from, to) = (below(a), below(b));
            let crossing = || {
                if from == 0.0 {
                    a
                } else if to == 0.0 {
                    b
                } else {
                    a.lerp(b, from / (from - to))
                }
            };
            match (from > 0.0, to > 0.0) {
                (false, true) => pieces.push(vec![crossing(), b]),
                (true, true) => pieces.last_mut().into_iter().for_each(|piece| piece.push(b)),
                (true, false) => pieces.last_mut().into_iter().for_each(|piece| piece.push(crossing())),
                (false, false) => {}
            }
        }
        closed_along_line(&pieces, (self.rise - other.rise).perp(), ring.iter().copied().filter(|p| below(*p) == 0.0))
    }

    /// Finds the fractions of the segment between two places at which any two of some planes cross.
    fn crossings(planes: &[Self], from: DVec2, to: DVec2) -> Vec<f64> {
        let pairs = planes.iter().enumerate().flat_map(|(number, a)| planes[number + 1..].iter().map(move |b| (a, b)));
        let fraction = |(a, b): (&Self, &Self)| {
            let (start, end) = (a.at(from) - b.at(from), a.at(to) - b.at(to));
            ((start > 0.0 && end < 0.0) || (start < 0.0 && end > 0.0)).then(|| start / (start - end))
        };
        pairs.filter_map(fraction).collect()
    }

    /// True if at least two of some planes have this height at a place.
    fn meet(planes: &[Self], place: DVec2, height: f64) -> bool {
        planes.iter().filter(|plane| plane.at(place) <= height * (1.0 + COINCIDING)).count() > 1
    }
}

/// Joins pieces of a ring, which begin and end on a line, to rings along the line: between the first and the second of their ends in the
/// direction `along`, the third and the fourth, and so on, through the corners `on_line`.
fn closed_along_line(pieces: &[Vec<DVec2>], along: DVec2, on_line: impl Iterator<Item = DVec2>) -> Vec<Vec<DVec2>> {
    let on_line: Vec<DVec2> = on_line.collect();
    // (place along the line, piece, true for its end)
    let mut ends: Vec<(f64, usize, bool)> = Vec::new();
    for (number, piece) in pieces.iter().enumerate() {
        if let [first, .., last] = piece[..] {
            ends.extend([(first.dot(along), number, false), (last.dot(along), number, true)]);
        }
    }
    ends.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut rings = Vec::new();
    let mut is_used = vec![false; pieces.len()];
    for first in 0..pieces.len() {
        let (mut ring, mut number) = (Vec::new(), first);
        while !std::mem::replace(&mut is_used[number], true) {
            ring.extend(&pieces[number]);
            let Some(place) = ends.iter().position(|(_, of, is_end)| *of == number && *is_end) else { break };
            let Some((to, next, _)) = ends.get(place ^ 1).copied() else { break };
            let from = ends[place].0;
            let mut between: Vec<DVec2> = on_line.clone();
            between.retain(|p| (p.dot(along) - from) * (p.dot(along) - to) < 0.0);
            between.sort_by(|a, b| (a.dot(along) - from).abs().total_cmp(&(b.dot(along) - from).abs()));
            ring.extend(between);
            number = next;
        }
        if !ring.is_empty() {
            rings.push(ring);
        }
    }
    rings
}

fn edges(ring: &[DVec2]) -> impl Iterator<Item = [DVec2; 2]> {
    (0..ring.len()).map(|k| [ring[k], ring[(k + 1) % ring.len()]])
}

/// Edge of a plan on which a wall stands, with its number.
type NumberedWall = (usize, [DVec2; 2]);

/// Returns the walls on the edges of rings, each with its number and with the room on its left, and the rings in that sense. An edge that
/// is not longer than `near` has no wall: its end is dropped.
fn walls_and_rings(rings: &[Vec<DVec2>], near: f64) -> (Vec<NumberedWall>, Vec<Vec<DVec2>>) {
    let (mut walls, mut directed) = (Vec::new(), Vec::new());
    let mut first = 0;
    for (number, ring) in rings.iter().enumerate() {
        // corners with the number of the edge that starts there
        let mut corners: Vec<(usize, DVec2)> = Vec::new();
        for (edge, corner) in ring.iter().enumerate() {
            match corners.last_mut().filter(|(_, last)| last.distance(*corner) <= near) {
                Some((before, _)) => *before = first + edge,
                None => corners.push((first + edge, *corner)),
            }
        }
        while corners.len() > 1 && corners[0].1.distance(corners[corners.len() - 1].1) <= near {
            corners.pop();
        }
        first += ring.len();
        let places: Vec<DVec2> = corners.iter().map(|(_, corner)| *corner).collect();
        let doubled: f64 = edges(&places).map(|[a, b]| a.perp_dot(b)).sum();
        let numbered = corners.iter().map(|(edge, _)| *edge).zip(edges(&places));
        if (doubled > 0.0) == (number == 0) {
            walls.extend(numbered);
            directed.push(places);
        } else {
            let turned: Vec<_> = numbered.map(|(edge, [a, b])| (edge, [b, a])).collect();
            walls.extend(turned.into_iter().rev());
            directed.push(places.iter().rev().copied().collect());
        }
    }
    (walls, directed)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(corners: &[[f64; 2]]) -> Vec<DVec2> {
        corners.iter().map(|corner| DVec2::from(*corner)).collect()
    }

    const OPEN: KindSurfaces = KindSurfaces { floor: None, walls: None, ceiling: None };

    fn area(enclosure: &Enclosure, kind: FaceKind) -> f64 {
        enclosure.faces().iter().filter(|face| face.kind == kind).map(|face| face.polygon.area_m2()).sum()
    }

    /// Computes the volume by the cones of the faces over the origin: their normals point inward.
    fn volume(enclosure: &Enclosure) -> f64 {
        let cone = |face: &EnclosureFace| face.polygon.height(DVec3::ZERO) * face.polygon.area_m2() / 3.0;
        enclosure.faces().iter().map(cone).sum()
    }

    /// A box as such and as a prism has the same volume, areas and section, whichever way its outline runs.
    #[test]
    fn a_box_is_a_prism() {
        let size = DVec3::new(3.0, 2.0, 2.5);
        let outline = [[0.0, 0.0], [0.0, 2.0], [3.0, 2.0], [3.0, 0.0]];
        let prism = Enclosure::prism(&[ring(&outline)], 1e-9, &[CeilingPlane::flat(2.5)], OPEN).unwrap();
        let cuboid = Enclosure::cuboid(size, [None; 6]);
        Enclosure::new(cuboid.faces().to_vec()).unwrap();
        for enclosure in [&prism, &cuboid] {
            assert_eq!((enclosure.bounds(), enclosure.scale_m()), ([DVec3::ZERO, size], size.length()));
            assert!((volume(enclosure) - 15.0).abs() < 1e-12);
            assert!((area(enclosure, FaceKind::Wall) - 25.0).abs() < 1e-12);
            let section: f64 = enclosure.section(1.0).iter().map(|[a, b]| 0.5 * a.perp_dot(*b)).sum();
            assert!((section - 6.0).abs() < 1e-12);
            assert_eq!(enclosure.ceiling_above(DVec2::new(1.0, 1.0)), Some(5));
        }
        assert!(prism.as_box().is_none() && cuboid.as_box().is_some());
    }

    /// A gable over a plan with a core that stands below the ridge: volume, the height of both ceilings, walls that bend.
    #[test]
    fn a_gable_over_a_core() {
        let outline = ring(&[[0.0, 0.0], [6.0, 0.0], [6.0, 4.0], [0.0, 4.0]]);
        let core = ring(&[[2.0, 1.0], [3.0, 1.0], [3.0, 3.0], [2.0, 3.0]]);
        let planes = [
            CeilingPlane { height_m: 2.0, rise: DVec2::new(0.0, 0.5) },
            CeilingPlane { height_m: 4.0, rise: DVec2::new(0.0, -0.5) },
        ];
        let gable = Enclosure::prism(&[outline, core], 1e-9, &planes, OPEN).unwrap();
        // 2.5 m high in the mean over the outline, 2.75 m over the core
        assert!((volume(&gable) - (24.0 * 2.5 - 2.0 * 2.75)).abs() < 1e-12, "{}", volume(&gable));
        let south = gable.ceiling_above(DVec2::new(5.0, 1.0)).unwrap();
        assert!((gable.height_at(south, DVec2::new(5.0, 1.0)) - 2.5).abs() < 1e-12);
        assert_eq!(gable.ceiling_above(DVec2::new(2.5, 2.0)), None, "over the core");
        let corners =
            |name: &str| gable.faces().iter().find(|face| face.name == name).unwrap().polygon.corners().count();
        assert_eq!(["wall_0", "wall_1", "wall_3", "wall_5"].map(corners), [4, 5, 5, 5]);
    }

    /// Gables over an L, whose ridge runs along an edge, and over a U, whose ridge crosses both arms: the volumes are those by hand.
    #[test]
    fn gables_over_concave_plans() {
        let l = ring(&[[0.0, 0.0], [8.0, 0.0], [8.0, 3.0], [4.0, 3.0], [4.0, 6.0], [0.0, 6.0]]);
        let along_x = [
            CeilingPlane { height_m: 2.0, rise: DVec2::new(0.0, 0.5) },
            CeilingPlane { height_m: 5.0, rise: DVec2::new(0.0, -0.5) },
        ];
        let u = ring(&[[0.0, 0.0], [9.0, 0.0], [9.0, 6.0], [6.0, 6.0], [6.0, 2.0], [3.0, 2.0], [3.0, 6.0], [0.0, 6.0]]);
        // 2.75 m high in the mean over each half of a depth of 3 m
        let of_l = 8.0 * 3.0 * 2.75 + 4.0 * 3.0 * 2.75;
        // the base of 2 m is 2.5 m high in the mean, arms 3 m wide from 2 to 3 m and from 3 to 6 m
        let of_u = 9.0 * 2.0 * 2.5 + 2.0 * 3.0 * (1.0 * 3.25 + 3.0 * 2.75);
        for (outline, expected) in [(l, of_l), (u, of_u)] {
            for turned in [false, true] {
                let mut outline = outline.clone();
                if turned {
                    outline.reverse();
                }
                let room = Enclosure::prism(&[outline], 1e-9, &along_x, OPEN).unwrap();
                assert!((volume(&room) - expected).abs() < 1e-9, "{} {expected}", volume(&room));
                let plan = area(&room, FaceKind::Floor);
                let slope = 1.25f64.sqrt();
                assert!((area(&room, FaceKind::Ceiling) - plan * slope).abs() < 1e-9);
            }
        }
    }

    /// Walls have the numbers of the edges that were given, whichever way the outline runs; a repeated corner has no wall.
    #[test]
    fn walls_are_numbered_as_edges() {
        let outline = [[0.0, 0.0], [0.0, 2.0], [0.0, 2.0], [3.0, 2.0], [3.0, 0.0]];
        let prism = Enclosure::prism(&[ring(&outline)], 1e-9, &[CeilingPlane::flat(2.5)], OPEN).unwrap();
        let wall = |name: &str| prism.faces().iter().find(|face| face.name == name);
        assert!(wall("wall_1").is_none());
        for (number, normal) in [(0, DVec3::X), (2, DVec3::NEG_Y), (3, DVec3::NEG_X), (4, DVec3::Y)] {
            assert_eq!(wall(&format!("wall_{number}")).unwrap().polygon.normal(), normal, "{number}");
        }
    }

    /// Enclosures with a gap, with a face that is not planar, or with a ceiling that comes down to the floor are refused, and the place
    /// is named.
    #[test]
    fn what_encloses_nothing() {
        let outline = ring(&[[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [0.0, 2.0]]);
        let room = Enclosure::prism(std::slice::from_ref(&outline), 1e-9, &[CeilingPlane::flat(2.5)], OPEN).unwrap();
        let mut faces = room.faces().to_vec();
        faces.pop();
        assert!(matches!(Enclosure::new(faces), Err(EnclosureError::Open { others: 3, .. })));
        let mut faces = room.faces().to_vec();
        let mut corners: Vec<DVec3> = faces[0].polygon.corners().collect();
        corners[0].z += 0.01;
        faces[0].polygon = Polygon::new(vec![corners]).unwrap();
        assert!(matches!(Enclosure::new(faces), Err(EnclosureError::NotPlanar { face, .. }) if face == "floor"));
        let slope = CeilingPlane { height_m: 1.0, rise: DVec2::new(0.0, -0.5) };
        let low = Enclosure::prism(&[outline], 1e-9, &[slope], OPEN);
        assert!(matches!(low, Err(EnclosureError::LowCeiling { height_m: 0.0, .. })));
    }
}
