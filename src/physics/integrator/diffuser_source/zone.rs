//! Cells of an opening that may be Lambertian only in part: the Lambertian zone of a mixed closure.

use std::f64::consts::TAU;

use glam::DVec2;

use super::patches::{CELLS, RINGS, SECTORS, ring_and_sector, within};
use crate::geometry::turn::unit_vector;
use crate::scene::OpeningShape;
use crate::traceable::TraceableTube;

/// Width of a part of a ring, in squared radii of the disc, below which it is due to rounding.
const SLIVER: f64 = 1e-9;

/// Unit vectors toward the beginnings of the sectors, relative to that of the first.
const TURNS: [DVec2; SECTORS] = {
    let (half, height) = (0.5, 0.866_025_403_784_438_6);
    [
        DVec2::new(1.0, 0.0),
        DVec2::new(half, height),
        DVec2::new(-half, height),
        DVec2::new(-1.0, 0.0),
        DVec2::new(-half, -height),
        DVec2::new(half, -height),
    ]
};

/// Parts of the cells of an opening that lie in a zone between two circles around its centre; all of a square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Zone {
    shape: OpeningShape,
    /// Squared radii of the part of each ring, in those of the disc; equal where there is none.
    rings: [[f64; 2]; RINGS],
}

impl Zone {
    /// Finds the parts within the Lambertian zone of a tube's closure.
    pub fn of(tube: &TraceableTube) -> Self {
        Self::new(tube.even_zone(), tube.opening)
    }

    /// Finds the parts within a zone of inner and outer radius, in m; none without a zone.
    fn new(zone: Option<(f64, f64)>, shape: OpeningShape) -> Self {
        let radius = shape.outer_radius();
        let squared = |length: f64| (length * length) / (radius * radius);
        let [from, to] = zone.map_or([0.0, 0.0], |(inner, outer)| [squared(inner), squared(outer)]);
        let rings = std::array::from_fn(|ring| {
            let [inner, outer] = [ring, ring + 1].map(|ring| ring as f64 / RINGS as f64);
            let inner = inner.max(from);
            let outer = outer.min(to);
            if outer - inner > SLIVER { [inner, outer] } else { [inner, inner] }
        });
        Self { shape, rings }
    }

    /// Returns the area of the opening divided by that of the part of a cell; 0 where a cell has no part.
    pub fn per_part(&self, cell: usize) -> f64 {
        let [inner, outer] = self.rings[cell / SECTORS];
        if outer > inner { SECTORS as f64 / (outer - inner) } else { 0.0 }
    }

    /// Returns 1 for each cell that has a part in the zone, else 0.
    pub fn held(&self) -> [f64; CELLS] {
        std::array::from_fn(|cell| if self.per_part(cell) > 0.0 { 1.0 } else { 0.0 })
    }

    /// Returns the fractions of the zone's area in its parts; zeros without a zone.
    pub fn shares(&self) -> [f64; CELLS] {
        let areas: [f64; CELLS] =
            std::array::from_fn(|cell| self.rings[cell / SECTORS]).map(|[inner, outer]| outer - inner);
        let whole: f64 = areas.iter().sum();
        areas.map(|area| if whole > 0.0 { area / whole } else { 0.0 })
    }

    /// Returns the centroid of the part of each cell, in radii from the disc's centre; the centre where there is none, and for all cells of a
    /// square, whose light is even.
    pub fn centroids(&self) -> [DVec2; CELLS] {
        if self.shape.disc().is_none() {
            return [DVec2::ZERO; CELLS];
        }
        // a sector of half-angle h has its centroid at 2/3 sin(h)/h of its radius
        let half = 0.5 * TAU / SECTORS as f64;
        let of_sector = 2.0 / 3.0 * libm::sin(half) / half;
        let radii = self.rings.map(|[inner, outer]| match outer - inner {
            area if area > 0.0 => of_sector * (outer * outer.sqrt() - inner * inner.sqrt()) / area,
            _ => 0.0,
        });
        let middle_of_first = unit_vector((0.5 / SECTORS as f64 - 0.5) * TAU);
        std::array::from_fn(|cell| {
            let (ring, sector) = ring_and_sector(cell);
            TURNS[sector].rotate(middle_of_first) * radii[ring]
        })
    }

    /// Returns the mean square of the distance from the disc's centre over the zone, in squared radii of the disc; 0 without a zone.
    pub fn mean_square(&self) -> f64 {
        let of_ring = |[inner, outer]: [f64; 2]| 0.5 * (inner + outer) * (outer - inner);
        let area: f64 = self.rings.iter().map(|[inner, outer]| outer - inner).sum();
        if area > 0.0 { self.rings.map(of_ring).iter().sum::<f64>() / area } else { 0.0 }
    }

    /// Returns a point of the part of each cell, in m from the centre; uniform numbers in 0..1 give uniform points.
    pub fn within_each(&self, [u, v]: [f64; 2]) -> [DVec2; CELLS] {
        let Some(radius) = self.shape.disc() else {
            return std::array::from_fn(|cell| within(&self.shape, cell, [u, v]));
        };
        let first = unit_vector((v / SECTORS as f64 - 0.5) * TAU);
        let radii = self.rings.map(|[inner, outer]| (inner + u * (outer - inner)).sqrt());
        let directions = TURNS.map(|turn| turn.rotate(first));
        std::array::from_fn(|cell| {
            let (ring, sector) = ring_and_sector(cell);
            directions[sector] * radii[ring] * radius
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::diffuser_source::patches::cell;

    const RADIUS: f64 = 0.127;
    const DISC: OpeningShape = OpeningShape::Disc { radius: RADIUS };

    /// Checks that a point of each cell lies in it and in the zone; that the parts make up the zone; and that cells without a part are
    /// marked.
    #[test]
    fn points_lie_in_their_parts() {
        for zone in [(0.0, RADIUS), (0.0, 0.6 * RADIUS), (0.8 * RADIUS, RADIUS), (0.3 * RADIUS, 0.31 * RADIUS)] {
            let parts = Zone::new(Some(zone), DISC);
            let area = (zone.1 * zone.1 - zone.0 * zone.0) / (RADIUS * RADIUS);
            let sum: f64 =
                (0..CELLS).map(|cell| parts.per_part(cell)).filter(|per| *per > 0.0).map(|per| 1.0 / per).sum();
            assert!((sum - area).abs() < 1e-14);
            for numbers in [[0.5, 0.5], [0.01, 0.99], [0.7, 0.2]] {
                for (number, point) in parts.within_each(numbers).into_iter().enumerate() {
                    if parts.held()[number] > 0.0 {
                        assert_eq!(cell(&DISC, point), number);
                        assert!((zone.0..=zone.1).contains(&(point.length())));
                    }
                }
            }
        }
        let square = OpeningShape::Square { side: RADIUS, along: DVec2::new(0.6, 0.8) };
        let parts = Zone::new(Some((0.0, square.outer_radius())), square);
        for (number, point) in parts.within_each([0.3, 0.8]).into_iter().enumerate() {
            assert_eq!((cell(&square, point), parts.per_part(number)), (number, CELLS as f64));
        }
        let whole = Zone::new(Some((0.0, RADIUS)), DISC);
        // the mean of many points of each cell
        let mean = (0..64 * 64).fold([DVec2::ZERO; CELLS], |mut mean, number| {
            let numbers = [number % 64, number / 64].map(|n| (f64::from(n) + 0.5) / 64.0);
            mean.iter_mut().zip(whole.within_each(numbers)).for_each(|(mean, point)| *mean += point / (64.0 * 64.0));
            mean
        });
        assert!(
            mean.iter().zip(whole.centroids()).all(|(mean, centroid)| mean.distance(centroid * RADIUS) < 2e-4 * RADIUS)
        );
        assert!((whole.shares().iter().sum::<f64>() - 1.0).abs() < 1e-14);
        assert!((0..CELLS).all(|cell| whole.per_part(cell) == CELLS as f64));
        for zone in [None, Some((0.5 * RADIUS, 0.5 * RADIUS))] {
            assert!(Zone::new(zone, DISC).held().iter().all(|held| *held == 0.0));
        }
        assert_eq!(Zone::new(Some((0.0, 0.5 * RADIUS)), DISC).held().iter().sum::<f64>(), SECTORS as f64);
    }
}
