//! How bright surfaces are, roughly: enough to place vertices by.

use std::f64::consts::PI;

use glam::DVec3;

use super::panels::{Panel, luminous};
use super::runs::Run;
use super::sent::Sensors;
use crate::geometry::disc::far_disc_illuminance;
use crate::traceable::{Side, TraceableScene, TraceableTube};

/// Points along either edge of a cell at which its importance is looked at.
const POINTS: usize = 2;

/// Distance from a panel, in shares of its size, from where it is looked at what it sees.
const HAIR: f64 = 1e-6;

/// Share of the light at the collectors that may reach the room: it weighs daylight against luminaires only.
const LIKELY_TRANSMISSION: f64 = 0.3;

/// True if sensors gather what surfaces reflect, and vertices send them no more than what is wrong of that: boxes alone stand in the
/// room, and openings alone give light. Past the triangles of meshes a ray costs ten times as much, and vertices with their shadows take less
/// time (a chair of 10 368 triangles, none of them a box', among 20 boxes in the room of the thesis).
pub fn gathers(scene: &TraceableScene) -> bool {
    let are_boxes = scene.obstructed && scene.meshes.is_none() && scene.luminaires.is_empty();
    are_boxes && scene.interreflection && !scene.tubes.is_empty()
}

/// Rough light in the room.
pub struct Light<'a> {
    pub scene: &'a TraceableScene,
    /// Flux that leaves each square metre of an opening, in lm/m2.
    pub of_openings: f64,
    /// Illuminance of every surface by light that was reflected, in lx.
    pub ambient: f64,
    /// Share of the direct light of surfaces that vertices send on: nothing of it where sensors gather.
    direct_share: f64,
}

impl<'a> Light<'a> {
    pub fn new(scene: &'a TraceableScene, panels: &[Panel]) -> Self {
        let sky = scene.sky.as_ref().map_or(0.0, |sky| sky.horizontal_illuminance_lux());
        let sun = scene.sun.map_or(0.0, |sun| sun.horizontal_illuminance_lux());
        Self::of_openings(scene, panels, LIKELY_TRANSMISSION * (sky + sun))
    }

    /// The light where so many lumens leave each square metre of the openings.
    pub fn of_openings(scene: &'a TraceableScene, panels: &[Panel], of_openings: f64) -> Self {
        let of_luminaires: f64 = scene.luminaires.iter().map(|luminaire| luminaire.flux::<3>().luminance()).sum();
        let openings: f64 = scene.tubes.iter().map(|tube| PI * tube.opening_radius * tube.opening_radius).sum();
        let area: f64 = panels.iter().map(Panel::area_m2).sum();
        let absorbed: f64 = panels.iter().map(|panel| panel.area_m2() * (1.0 - panel.reflectance)).sum();
        let mean = 1.0 - absorbed / area;
        let flux = of_openings * openings + of_luminaires;
        // a room that absorbs nothing is taken as one that absorbs a hundredth
        let ambient = flux * mean / absorbed.max(0.01 * area);
        let ambient = if scene.interreflection { ambient } else { 0.0 };
        Self { scene, of_openings, ambient, direct_share: if gathers(scene) { 0.0 } else { 1.0 } }
    }

    /// Reflected flux of a cell, times what a lumen of it means to the sensors, on one scale for all cells.
    pub fn weight_of_cell(&self, panel: &Panel, [row, column]: [usize; 2], sensors: &Sensors) -> f64 {
        if !panel.can_reach(sensors.lowest) {
            return 0.0;
        }
        let at = |cell: usize, point: usize| (cell as f64 + (point as f64 + 0.5) / POINTS as f64) / panel.cells as f64;
        let middle = |cell: usize| (cell as f64 + 0.5) / panel.cells as f64;
        let middle = panel.corner + panel.u * middle(row) + panel.v * middle(column);
        let seen = self.seen_from(middle + panel.normal * HAIR * panel.area_m2().sqrt());
        let mut sum = 0.0;
        for number in 0..POINTS * POINTS {
            let (u, v) = (at(row, number / POINTS), at(column, number % POINTS));
            let point = panel.corner + panel.u * u + panel.v * v;
            let lux = self.direct_share * self.direct(point, panel.normal, &seen) + self.ambient;
            sum += lux * sensors.sent(point, Some(panel.normal));
        }
        let share = panel.area_m2() / (panel.cells * panel.cells * POINTS * POINTS) as f64;
        panel.reflectance * sum * share
    }

    /// Luminous reflectance of the brightest of a run's facets on its side.
    pub fn reflectance(&self, run: &Run) -> f64 {
        let of = |(facet, side): &(usize, Side)| luminous(self.scene, self.scene.numbering.facet_side(*facet, *side));
        run.faces.iter().map(of).fold(0.0, f64::max)
    }

    /// Reflected flux of a run of triangles, times what a lumen of it means to the sensors, on the scale of the cells of panels.
    pub fn weight_of_run(&self, run: &Run, sensors: &Sensors) -> f64 {
        let reflectance = self.reflectance(run);
        if reflectance == 0.0 {
            return 0.0;
        }
        let before = run.normal.unwrap_or_default() * HAIR * run.area_m2.sqrt();
        let seen = self.seen_from(run.middle + before);
        // of several facets some may face anything
        let direct = run.normal.map_or(0.0, |normal| self.direct(run.middle, normal, &seen));
        reflectance * run.area_m2 * (self.direct_share * direct + self.ambient) * sensors.sent(run.middle, run.normal)
    }

    /// One over the illuminance of a sensor, in 1/lx.
    pub fn need(&self, position: DVec3) -> f64 {
        1.0 / (self.direct(position, DVec3::Z, &self.seen_from(position)) + self.ambient)
    }

    /// Share of a sensor's illuminance that comes by reflection; 1 in the dark.
    pub fn indirect_share(&self, position: DVec3) -> f64 {
        let all = self.direct(position, DVec3::Z, &self.seen_from(position)) + self.ambient;
        if all > 0.0 { self.ambient / all } else { 1.0 }
    }

    /// For each tube, whether the middle of its opening is seen from a point.
    fn seen_from(&self, point: DVec3) -> Vec<bool> {
        self.scene.tubes.iter().map(|tube| self.scene.visible(point, None, tube.origin, None)).collect()
    }

    /// Illuminance straight from luminaires and from the openings that are seen, in lx.
    fn direct(&self, point: DVec3, normal: DVec3, seen: &[bool]) -> f64 {
        let of_tube = |(tube, seen): (&TraceableTube, &bool)| {
            if !seen {
                return 0.0;
            }
            let way = tube.origin - point;
            let offset = way.truncate().length();
            // nearer the form does not hold
            let near = way.length_squared() < tube.opening_radius * tube.opening_radius;
            if way.z <= 0.0 || near {
                return 0.0;
            }
            let toward_axis = if offset > 0.0 { way.truncate().dot(normal.truncate()) / offset } else { 0.0 };
            far_disc_illuminance(tube.opening_radius, way.z, offset, [normal.z, toward_axis]).max(0.0)
        };
        let openings: f64 = self.scene.tubes.iter().zip(seen).map(of_tube).sum();
        let luminaires = self.scene.luminaires.iter();
        let of_luminaires: f64 = luminaires.map(|luminaire| luminaire.irradiance::<3>(point, normal).luminance()).sum();
        self.of_openings * openings + of_luminaires
    }
}
