//! Subdivision of cells of surfaces on which the direct light of openings, luminaires and sunbeams has a steep gradient.

use std::f64::consts::PI;

use glam::DVec3;

use crate::geometry::disc::disc_irradiance;
use crate::geometry::lambert::quadrilateral_irradiance;
use crate::integrator::backward::clear_zones::sun_through_clear_zones;
use crate::traceable::luminaire::TraceableLuminaire;
use crate::traceable::{SurfaceId, SurfacePoint, TraceableScene, TraceableTube};

/// Largest tolerated spread of the direct light over a part of a cell, relative to the room's mean, times the root of the cell's fraction
/// of the area.
const TOLERANCE: f64 = 0.1;

/// Largest number of parts along an edge of a cell.
const MOST_PARTS: f64 = 16.0;

/// Distance of a source from a cell, relative to the sum of their edge lengths, beyond which its light changes little over the cell.
const FAR: f64 = 3.0;

/// Places along an edge of a cell where the light is computed.
const PLACES: [f64; 3] = [0.0, 0.5, 1.0];

/// Number of places along an edge of a cell where sunbeams are computed, which may be narrow.
const PLACES_IN_BEAMS: u32 = 8;

/// Openings, luminaires and sunbeams whose light may have a steep gradient.
pub struct Gradients<'a> {
    scene: &'a TraceableScene,
    luminaires: Vec<&'a TraceableLuminaire>,
    area_m2: f64,
    /// Mean illuminances of all surfaces by openings of unit exitance, by luminaires, and by the sun's beams through clear zones as if
    /// nothing absorbed them.
    means: [f64; 3],
}

impl<'a> Gradients<'a> {
    /// Computes the mean illuminances; `area_m2` is the area of all surfaces that are divided. Sunbeams count if this is asked for.
    pub fn new((scene, with_clear_zones): (&'a TraceableScene, bool), area_m2: f64) -> Self {
        let luminaires: Vec<_> = scene.luminaires.iter().filter(|luminaire| luminaire.emits()).collect();
        let of_openings: f64 = scene.tubes.iter().map(|tube| tube.opening.area_m2()).sum();
        let of_luminaires: f64 = luminaires.iter().map(|luminaire| luminaire.flux::<1>().luminance()).sum();
        let of_beams: f64 = scene.tubes.iter().map(|tube| if with_clear_zones { beam_lm(tube) } else { 0.0 }).sum();
        Self { scene, luminaires, area_m2, means: [of_openings, of_luminaires, of_beams].map(|lm| lm / area_m2) }
    }

    /// Returns the number of parts of a cell of a surface along an edge, from 1 to 16.
    pub fn parts(&self, (corner, edges): (DVec3, [DVec3; 2]), normal: DVec3, surface: Option<SurfaceId>) -> u32 {
        let middle = corner + 0.5 * (edges[0] + edges[1]);
        let length = edges[0].length().max(edges[1].length());
        let fraction = (edges[0].cross(edges[1]).length() / self.area_m2).sqrt();
        let is_near = |source: DVec3, size: f64| (source - middle).length() < FAR * (length + size);
        let tubes = self.scene.tubes.iter();
        let tubes: Vec<_> = tubes.filter(|tube| is_near(tube.frame.origin, tube.opening.outer_radius())).collect();
        let luminaires: Vec<_> = self
            .luminaires
            .iter()
            .filter(|luminaire| is_near(luminaire.point([0.5; 2]), luminaire.longer_edge_m()))
            .collect();
        let at = |[u, v]: [f64; 2]| corner + edges[0] * u + edges[1] * v;
        let places = || PLACES.into_iter().flat_map(|u| PLACES.map(|v| at([u, v])));
        let inside = |number: u32| (f64::from(number) + 0.5) / f64::from(PLACES_IN_BEAMS);
        let places_in_beams = (0..PLACES_IN_BEAMS * PLACES_IN_BEAMS)
            .map(|number| at([number / PLACES_IN_BEAMS, number % PLACES_IN_BEAMS].map(inside)));
        let of_tubes = |place: DVec3| tubes.iter().map(|tube| of_opening(tube, place, normal)).sum();
        let of_luminaires = |place: DVec3| {
            luminaires.iter().map(|luminaire| luminaire.irradiance::<1>(place, normal).luminance()).sum()
        };
        let of_beams =
            |position: DVec3| sun_through_clear_zones(self.scene, SurfacePoint { position, normal, surface });
        let spreads = [
            if tubes.is_empty() { 0.0 } else { spread(places().map(of_tubes)) },
            if luminaires.is_empty() { 0.0 } else { spread(places().map(of_luminaires)) },
            if self.means[2] > 0.0 { spread(places_in_beams.map(of_beams)) } else { 0.0 },
        ];
        let wanted = |(spread, mean): (f64, f64)| if mean > 0.0 { spread / mean * fraction / TOLERANCE } else { 0.0 };
        spreads.into_iter().zip(self.means).map(wanted).fold(0.0, f64::max).ceil().clamp(1.0, MOST_PARTS) as u32
    }
}

/// Returns the difference of the largest and the smallest of some values of 0 or more.
fn spread(values: impl Iterator<Item = f64>) -> f64 {
    let (low, high) = values.fold((f64::INFINITY, 0.0), |(low, high), value: f64| (value.min(low), value.max(high)));
    high - low
}

/// Returns the flux in lm of the sun on the clear zone of a tube, as if nothing absorbed it.
fn beam_lm(tube: &TraceableTube) -> f64 {
    let of_zone = |(inner, outer): (f64, f64)| PI * (outer * outer - inner * inner);
    tube.sun.zip(tube.specular_zone()).map_or(0.0, |(sun, zone)| sun.horizontal_illuminance_lux() * of_zone(zone))
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
        let gradients = Gradients::new((&scene, false), 80.0);
        let wall =
            |z: f64| gradients.parts((DVec3::new(0.0, 1.0, z), [DVec3::Y * 0.3, DVec3::Z * 0.3]), DVec3::X, None);
        assert!(wall(2.7) >= 4 && wall(2.7) > wall(2.1), "{} {}", wall(2.7), wall(2.1));
        let level = |z: f64, normal: DVec3| {
            gradients.parts((DVec3::new(0.0, 1.0, z), [DVec3::X * 0.3, DVec3::Y * 0.3]), normal, None)
        };
        assert_eq!([level(0.0, DVec3::Z), level(3.0, DVec3::NEG_Z)], [1, 1]);
    }
}
