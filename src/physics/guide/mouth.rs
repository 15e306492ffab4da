//! Mouth of a mesh pipe: its flat upper end, through which all light enters.
//!
//! A ray aimed at the mouth enters the pipe, while most of those aimed at the collector around it do not. Both give the same light if there
//! is no other entrance: the pipe has no holes, it lies on one side of the mouth's plane, and no collector reflects.

use std::collections::HashMap;

use glam::DVec3;

use crate::geometry::welded::TriangleSide;

/// Tolerance by which the rim may leave its plane, and the pipe stand out of it, relative to the size of the mesh: digits of files.
const FLAT: f64 = 1e-6;

/// Flat upper end of a pipe: a fan of triangles around its centre.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Mouth {
    centre: DVec3,
    /// Corners of the rim in order.
    rim: Vec<DVec3>,
    /// Unit normal, pointing out of the pipe.
    normal: DVec3,
    /// Cumulative areas in m2 of the fan's triangles.
    areas: Vec<f64>,
}

impl Mouth {
    /// Finds the mouth of a pipe, if it has one, from the sides of its triangles; `at` has the positions by place, and `size` is that of
    /// the mesh in m.
    pub fn of(sides: &[TriangleSide], at: &[DVec3], size: f64) -> Option<Self> {
        let [one, other] = &boundary_loops(sides)?[..] else { return None };
        let position = |place: &u32| at[*place as usize];
        let at = |places: &[u32]| -> Vec<DVec3> { places.iter().map(position).collect() };
        let height = |rim: &[DVec3]| rim.iter().map(|corner| corner.z).sum::<f64>() / rim.len() as f64;
        let (one, other) = (at(one), at(other));
        let (lower, rim) = if height(&one) < height(&other) { (one, other) } else { (other, one) };
        let is_level = lower.iter().all(|corner| corner.z.abs() <= FLAT * size);
        let mouth = Self::fan(rim)?;
        let above = |corner: &DVec3| (*corner - mouth.centre).dot(mouth.normal);
        let is_flat = mouth.rim.iter().all(|corner| above(corner).abs() <= FLAT * size);
        let is_end = sides.iter().flat_map(|side| &side.edge).all(|place| above(&position(place)) <= FLAT * size);
        (is_level && is_flat && is_end).then_some(mouth)
    }

    /// Creates the fan over a rim, its normal away from the opening; `None` if its triangles overlap.
    fn fan(mut rim: Vec<DVec3>) -> Option<Self> {
        let centre = rim.iter().copied().sum::<DVec3>() / rim.len() as f64;
        let doubled = |rim: &[DVec3], k: usize| (rim[k] - centre).cross(rim[(k + 1) % rim.len()] - centre);
        let whole: DVec3 = (0..rim.len()).map(|k| doubled(&rim, k)).sum();
        let mut normal = whole.try_normalize()?;
        // out of the pipe is away from the opening, which is around the origin
        if normal.dot(centre) < 0.0 {
            rim.reverse();
            normal = -normal;
        }
        let mut areas = Vec::with_capacity(rim.len());
        let mut sum = 0.0;
        for k in 0..rim.len() {
            let area = 0.5 * doubled(&rim, k).dot(normal);
            if area <= 0.0 {
                return None;
            }
            sum += area;
            areas.push(sum);
        }
        Some(Self { centre, rim, normal, areas })
    }

    /// Returns the area in m2.
    pub fn area_m2(&self) -> f64 {
        self.areas.last().copied().unwrap_or_default()
    }

    /// Returns the cosine of the angle between light along `direction` and the inward normal.
    pub fn cosine(&self, direction: DVec3) -> f64 {
        -direction.dot(self.normal)
    }

    /// Samples a point of the mouth, uniform in area, from numbers in 0..1.
    pub fn point(&self, [u, v]: [f64; 2]) -> DVec3 {
        let wanted = u * self.area_m2();
        let k = self.areas.partition_point(|area| *area <= wanted).min(self.rim.len() - 1);
        let before = if k > 0 { self.areas[k - 1] } else { 0.0 };
        let along = ((wanted - before) / (self.areas[k] - before)).clamp(0.0, 1.0);
        let edge = self.rim[k].lerp(self.rim[(k + 1) % self.rim.len()], along);
        self.centre.lerp(edge, v.sqrt())
    }
}

/// Returns the borders of a surface, given by its sides, as loops of places; `None` if it has edges of more than two triangles, or borders
/// that cross.
fn boundary_loops(sides: &[TriangleSide]) -> Option<Vec<Vec<u32>>> {
    let mut next: HashMap<u32, Vec<u32>> = HashMap::new();
    let mut starts = Vec::new();
    for edge in sides.chunk_by(|a, b| a.edge == b.edge) {
        match edge {
            [side] => {
                let [a, b] = side.edge;
                next.entry(a).or_default().push(b);
                next.entry(b).or_default().push(a);
                starts.push(a);
            }
            [_, _] => {}
            _ => return None,
        }
    }
    if next.values().any(|neighbours| neighbours.len() != 2) {
        return None;
    }
    let mut loops = Vec::new();
    for start in starts {
        // starts of loops that were followed already have been removed
        let Some(mut neighbours) = next.remove(&start) else { continue };
        let mut border = vec![start];
        let mut current = neighbours.pop()?;
        while let Some(neighbours) = next.remove(&current) {
            let previous = border[border.len() - 1];
            border.push(current);
            current = if neighbours[0] == previous { neighbours[1] } else { neighbours[0] };
        }
        loops.push(border);
    }
    Some(loops)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::welded;

    /// Finds the mouth of triangles given with their places.
    fn mouth(pipe: &[([DVec3; 3], [u32; 3])], size: f64) -> Option<Mouth> {
        let mut at = vec![DVec3::ZERO; 1000];
        for (corners, places) in pipe {
            places.iter().zip(corners).for_each(|(place, corner)| at[*place as usize] = *corner);
        }
        let places = pipe.iter().enumerate().map(|(number, (_, places))| (number as u32, *places));
        Mouth::of(&welded::sides(places), &at, size)
    }

    /// Returns a prism of `sides` around the axis up to the plane z = 1 + `slope` x, as triangles with places.
    fn pipe(sides: usize, slope: f64) -> Vec<([DVec3; 3], [u32; 3])> {
        let corner = |k: usize, upper: bool| {
            let (sin, cos) = (std::f64::consts::TAU * (k % sides) as f64 / sides as f64).sin_cos();
            let z = if upper { 1.0 + slope * cos } else { 0.0 };
            (DVec3::new(cos, sin, z), (2 * (k % sides) + usize::from(upper)) as u32)
        };
        let triangle = |corners: [(DVec3, u32); 3]| (corners.map(|(at, _)| at), corners.map(|(_, place)| place));
        (0..sides)
            .flat_map(|k| {
                let (a, b, c, d) = (corner(k, false), corner(k + 1, false), corner(k + 1, true), corner(k, true));
                [triangle([a, b, c]), triangle([a, c, d])]
            })
            .collect()
    }

    /// Checks that the area of the mouth of a tilted end is that of the polygon over the cosine, and that its points are uniform.
    #[test]
    fn a_pipe_has_its_upper_end_as_mouth() {
        for slope in [0.0, 0.5] {
            let mouth = mouth(&pipe(24, slope), 2.0).unwrap();
            let normal = DVec3::new(-slope, 0.0, 1.0).normalize();
            assert!(mouth.normal.distance(normal) < 1e-12, "{}", mouth.normal);
            let polygon = 12.0 * (std::f64::consts::TAU / 24.0).sin();
            assert!((mouth.area_m2() * normal.z - polygon).abs() < 1e-12);
            let (mut mean, steps) = (DVec3::ZERO, 64);
            for i in 0..steps {
                for k in 0..steps {
                    let at = |n: i32| (f64::from(n) + 0.5) / f64::from(steps);
                    let point = mouth.point([at(i), at(k)]);
                    assert!((point.z - 1.0 - slope * point.x).abs() < 1e-12 && point.truncate().length() < 1.0);
                    mean += point / f64::from(steps * steps);
                }
            }
            // the centre of a lattice that is uniform in area: second order in its step
            assert!(mean.distance(DVec3::Z) < 1e-3, "{mean}");
        }
    }

    /// Checks that pipes with a hole, with a rim that is not flat, with parts above the rim, or that begin above the opening have no mouth.
    #[test]
    fn other_pipes_have_none() {
        let whole = pipe(24, 0.0);
        assert!(mouth(&whole[1..], 2.0).is_none(), "a missing triangle at an end bends the rim");
        let mut bent = whole.clone();
        let raised = whole[0].0[2];
        bent.iter_mut().flat_map(|(corners, _)| corners).filter(|at| **at == raised).for_each(|at| at.z += 0.01);
        assert!(mouth(&bent, 2.0).is_none(), "a rim that is not flat");
        let lifted: Vec<_> = whole.iter().map(|(corners, places)| (corners.map(|at| at + DVec3::Z), *places)).collect();
        assert!(mouth(&lifted, 2.0).is_none(), "it begins above the opening");
        let mut fin = whole.clone();
        fin.push(([DVec3::new(3.0, 0.0, 0.0), DVec3::new(3.0, 0.0, 2.0), DVec3::new(3.0, 1.0, 0.0)], [900, 901, 902]));
        assert!(mouth(&fin, 2.0).is_none(), "a third border");
        let twice: Vec<_> = whole.iter().chain(&whole).copied().collect();
        assert!(mouth(&twice, 2.0).is_none(), "no border at all");
    }
}
