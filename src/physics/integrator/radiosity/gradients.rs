//! Subdivision of cells of surfaces on which the direct light of openings and luminaires has a steep gradient.

use std::f64::consts::PI;

use glam::DVec3;

use crate::geometry::disc::disc_irradiance;
use crate::geometry::lambert::quadrilateral_irradiance;
use crate::traceable::luminaire::TraceableLuminaire;
use crate::traceable::{TraceableScene, TraceableTube};

/// Largest tolerated spread of the direct light over a part of a cell, relative to the room's mean, times the root of the cell's fraction
/// of the area.
const TOLERANCE: f64 = 0.1;

/// Largest number of parts along an edge of a cell.
const MOST_PARTS: f64 = 16.0;

/// Distance of a source from a cell, relative to the sum of their edge lengths, beyond which its light changes little over the cell.
const FAR: f64 = 3.0;

/// Places along an edge of a cell where the light is computed.
const PLACES: [f64; 3] = [0.0, 0.5, 1.0];

/// Openings and luminaires whose light may have a steep gradient.
pub struct Gradients<'a> {
    tubes: &'a [TraceableTube],
    luminaires: Vec<&'a TraceableLuminaire>,
    area_m2: f64,
    /// Mean illuminances of all surfaces by openings of unit exitance, and by luminaires.
    means: [f64; 2],
}

impl<'a> Gradients<'a> {
    /// Computes the mean illuminances; `area_m2` is the area of all surfaces that are divided.
    pub fn new(scene: &'a TraceableScene, area_m2: f64) -> Self {
        let luminaires: Vec<_> = scene.luminaires.iter().filter(|luminaire| luminaire.emits()).collect();
        let of_openings: f64 = scene.tubes.iter().map(|tube| tube.opening.area_m2()).sum();
        let of_luminaires: f64 = luminaires.iter().map(|luminaire| luminaire.flux::<1>().luminance()).sum();
        Self { tubes: &scene.tubes, luminaires, area_m2, means: [of_openings, of_luminaires].map(|lm| lm / area_m2) }
    }

    /// Returns the number of parts of a cell along an edge, from 1 to 16.
    pub fn parts(&self, corner: DVec3, edges: [DVec3; 2], normal: DVec3) -> u32 {
        let middle = corner + 0.5 * (edges[0] + edges[1]);
        let length = edges[0].length().max(edges[1].length());
        let fraction = (edges[0].cross(edges[1]).length() / self.area_m2).sqrt();
        let is_near = |source: DVec3, size: f64| (source - middle).length() < FAR * (length + size);
        let tubes: Vec<_> =
            self.tubes.iter().filter(|tube| is_near(tube.frame.origin, tube.opening.outer_radius())).collect();
        let luminaires: Vec<_> = self
            .luminaires
            .iter()
            .filter(|luminaire| is_near(luminaire.point([0.5; 2]), luminaire.longer_edge_m()))
            .collect();
        if tubes.is_empty() && luminaires.is_empty() {
            return 1;
        }
        let [mut low, mut high] = [[f64::INFINITY; 2], [0.0; 2]];
        for (u, v) in PLACES.into_iter().flat_map(|u| PLACES.map(|v| (u, v))) {
            let place = corner + edges[0] * u + edges[1] * v;
            let of_tubes: f64 = tubes.iter().map(|tube| of_opening(tube, place, normal)).sum();
            let of_luminaires: f64 =
                luminaires.iter().map(|luminaire| luminaire.irradiance::<1>(place, normal).luminance()).sum();
            for (kind, lux) in [of_tubes, of_luminaires].into_iter().enumerate() {
                (low[kind], high[kind]) = (low[kind].min(lux), high[kind].max(lux));
            }
        }
        let wanted = |kind: usize| match self.means[kind] {
            mean if mean > 0.0 => (high[kind] - low[kind]) / mean * fraction / TOLERANCE,
            _ => 0.0,
        };
        wanted(0).max(wanted(1)).ceil().clamp(1.0, MOST_PARTS) as u32
    }
}

/// Returns the illuminance of a place by an opening of unit exitance; approximate where the horizon cuts the opening.
pub fn of_opening(tube: &TraceableTube, place: DVec3, normal: DVec3) -> f64 {
    let away = tube.frame.levelled_direction(tube.frame.origin - place);
    let offset = away.truncate().length();
    if away.z <= 0.0 {
        return 0.0;
    }
    let Some(radius) = tube.opening.disc() else {
        let of = |corners: [DVec3; 4]| quadrilateral_irradiance(&corners, place, normal).max(0.0) / PI;
        return tube.corners().map_or(0.0, of);
    };
    let (found, normal) = (disc_irradiance(radius, away.z, offset), tube.frame.levelled_direction(normal));
    let toward = if offset > 0.0 { away.truncate().dot(normal.truncate()) / offset } else { 0.0 };
    (found.vertical * normal.z + found.toward_axis * toward).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::Surface;
    use crate::scene::Luminaire;
    use crate::traceable::test_rooms::{compiled, empty};

    /// Checks that a cell of a wall right below a luminaire is divided, and into more parts than one that is farther off; one of the floor,
    /// far below, and cells that the luminaire does not light are not.
    #[test]
    fn cells_beside_a_luminaire_are_divided() {
        let mut scene = empty(DVec3::new(4.0, 4.0, 3.0), Some(Surface::diffuse([0.5; 3])));
        scene.room.luminaires = vec![Luminaire {
            corner: DVec3::new(0.01, 1.0, 3.0),
            edge_u: DVec3::Y * 0.3,
            edge_v: DVec3::X * 0.3,
            luminance: [1000.0; 3],
        }];
        let scene = compiled(&scene);
        let gradients = Gradients::new(&scene, 80.0);
        let wall = |z: f64| gradients.parts(DVec3::new(0.0, 1.0, z), [DVec3::Y * 0.3, DVec3::Z * 0.3], DVec3::X);
        assert!(wall(2.7) >= 4 && wall(2.7) > wall(2.1), "{} {}", wall(2.7), wall(2.1));
        let level =
            |z: f64, normal: DVec3| gradients.parts(DVec3::new(0.0, 1.0, z), [DVec3::X * 0.3, DVec3::Y * 0.3], normal);
        assert_eq!([level(0.0, DVec3::Z), level(3.0, DVec3::NEG_Z)], [1, 1]);
    }
}
