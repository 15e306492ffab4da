//! Direct light from diffusers and luminaires, estimated by connections to a pass' own photons at the diffusers and to points of
//! luminaires, without density estimation on the lit surface.

use std::f64::consts::PI;

use glam::DVec3;

use super::maps::{Gathered, Mapper, Maps, POINT_CONNECTIONS, POINT_STRATA, density};
use super::store::Tube;
use crate::geometry::disc::disc_disc_area;
use crate::integrator::backward::next_event::luminaire_density;
use crate::integrator::photon::nearness::is_near_opening;
use crate::optics::{Closure, Glossy, MeasuredDiffuser, Spectrum};
use crate::sampling::{PathRandom, warp};
use crate::traceable::luminaire::TraceableLuminaire;
use crate::traceable::{RoomHit, SurfaceId, TraceableTube};

/// Number of photons at each diffuser, and number of points per side of the square of strata on each luminaire, that a sensor is connected
/// to.
pub const SENSOR_CONNECTIONS: usize = 256;
pub const SENSOR_STRATA: usize = 8;

/// Largest number of rays toward a very near luminaire, per ray that is to hit it.
const TRIES: usize = 16;

impl<const C: usize> Mapper<C> {
    /// Estimates the direct irradiance from the diffusers and its bias: by connections to some of the photons that they scattered; for a
    /// diffuser so near that connections are rare and bright, by as many sampled rays, from the luminance where they meet it.
    pub fn diffuser_irradiance(
        &self,
        maps: &Maps<C>,
        position: DVec3,
        normal: DVec3,
        surface: Option<SurfaceId>,
        connections: usize,
        random: &mut PathRandom,
    ) -> Gathered<C> {
        let mut gathered = Gathered::NOTHING;
        for (index, exits) in maps.exits.iter().enumerate() {
            let tube = &self.scene.tubes[index];
            let diffuser = &tube.diffuser;
            if is_near_opening(&self.scene, tube, position) {
                gathered.add_light(&self.near_diffuser(maps, index, (position, normal, surface), connections, random));
                continue;
            }
            let count = connections.min(exits.len());
            for k in 0..count {
                let stratum = (k as f64 + random.uniform()) / count as f64;
                let number = ((stratum * exits.len() as f64) as usize).min(exits.len() - 1);
                let exit = &exits[number];
                let to_exit = exit.position - position;
                let distance_squared = to_exit.length_squared();
                let rise = tube.frame.up(to_exit);
                let cosines = to_exit.dot(normal) * rise;
                if cosines > 0.0 && rise > 0.0 && self.scene.visible(position, surface, exit.position, None) {
                    let mut geometry = cosines / (distance_squared * distance_squared) / PI;
                    if let Some(table) = diffuser.measured() {
                        let down = rise / distance_squared.sqrt();
                        geometry *= PI * measured_per_sr(table, tube.frame.up(maps.incidents[index][number]), down);
                    }
                    gathered.irradiance += exit.flux * (geometry * exits.len() as f64 / count as f64);
                }
            }
        }
        gathered
    }

    /// Estimates the direct irradiance from a diffuser and its bias, by `rays` cosine-distributed rays.
    fn near_diffuser(
        &self,
        maps: &Maps<C>,
        index: usize,
        (position, normal, surface): (DVec3, DVec3, Option<SurfaceId>),
        rays: usize,
        random: &mut PathRandom,
    ) -> Gathered<C> {
        let tube = &self.scene.tubes[index];
        let mut sum = Gathered::NOTHING;
        for k in 0..rays {
            let [u, v] = random.uniform2();
            let stratum = (k as f64 + u) / rays as f64;
            let direction = warp::around(normal, warp::cosine_hemisphere([stratum, v]));
            let rise = tube.frame.up(direction);
            if rise <= 0.0 {
                continue;
            }
            let point = tube.frame.onto(position + direction * (tube.frame.depth(position) / rise));
            let closure = tube.closure_at(point);
            if tube.has(point)
                && closure.unscattered::<C>().is_none()
                && self.scene.visible(position, surface, point, None)
            {
                sum.add_light(&self.luminance(maps, index, closure, point, direction));
            }
        }
        let per_ray = PI / rays as f64;
        Gathered { irradiance: sum.irradiance * per_ray, bias: sum.bias * per_ray, found: 0.0 }
    }

    /// Estimates the direct irradiance from the luminaires: in closed form if nothing can hide them, else from `strata` x `strata` points
    /// of each. Connections to a luminaire nearer than its strata are wide would be rare and bright: its closed form is multiplied by the
    /// fraction that is visible.
    pub fn luminaire_irradiance(
        &self,
        position: DVec3,
        normal: DVec3,
        surface: Option<SurfaceId>,
        strata: usize,
        random: &mut PathRandom,
    ) -> Spectrum<C> {
        let mut sum = Spectrum::ZERO;
        for luminaire in self.scene.luminaires.iter().filter(|luminaire| luminaire.emits()) {
            if !self.scene.luminaires_obstructed {
                sum += luminaire.irradiance(position, normal);
                continue;
            }
            let fraction = 1.0 / strata as f64;
            let count = strata * strata;
            if luminaire.is_within(fraction * luminaire.longer_edge_m(), position)
                && let Some(seen) = self.seen_part(luminaire, position, normal, surface, count, random)
            {
                sum += luminaire.irradiance(position, normal) * seen;
                continue;
            }
            for stratum in 0..count {
                let source = self.point_of(luminaire, strata, stratum, random);
                let arriving: Spectrum<C> = luminaire.connection(source, position, normal);
                if arriving.max() > 0.0 && self.scene.visible(position, surface, source, Some(luminaire.surface)) {
                    sum += arriving * (fraction * fraction);
                }
            }
        }
        sum
    }

    /// Estimates the luminance toward `eye` (a unit vector) of a glossy lobe of reflectance 1 lit by the luminaires, by connections with
    /// their MIS weight: a ray sampled from the lobe seldom meets a luminaire that is small and bright.
    pub fn luminaires_in_lobe(
        &self,
        lobe: &Glossy,
        hit: &RoomHit,
        surface: Option<SurfaceId>,
        eye: DVec3,
        random: &mut PathRandom,
    ) -> Spectrum<C> {
        let mut sum = Spectrum::ZERO;
        for luminaire in self.scene.luminaires.iter().filter(|luminaire| luminaire.emits()) {
            for stratum in 0..POINT_STRATA * POINT_STRATA {
                let source = self.point_of(luminaire, POINT_STRATA, stratum, random);
                let to_light = source - hit.position;
                let toward = to_light.normalize();
                let connected = connections_to_luminaire(luminaire, to_light);
                let density = if connected > 0.0 { lobe.density(hit.normal, eye, toward) } else { 0.0 };
                if density > 0.0 && self.scene.visible(hit.position, surface, source, Some(luminaire.surface)) {
                    sum += luminaire.seen(to_light) * (density / (density + connected));
                }
            }
        }
        sum
    }

    /// Returns a random point of one of the `strata` x `strata` parts of a luminaire.
    fn point_of(
        &self,
        luminaire: &TraceableLuminaire,
        strata: usize,
        stratum: usize,
        random: &mut PathRandom,
    ) -> DVec3 {
        let fraction = 1.0 / strata as f64;
        let [u, v] = random.uniform2();
        let along = [((stratum % strata) as f64 + u) * fraction, ((stratum / strata) as f64 + v) * fraction];
        self.scene.enclosure.clamp(luminaire.point(along))
    }

    /// Estimates the unoccluded fraction of a luminaire's light at a point, by up to `count` cosine-distributed rays that meet the
    /// luminaire; `None` if none does. The mean over any number of such rays has the right expectation.
    fn seen_part(
        &self,
        luminaire: &TraceableLuminaire,
        position: DVec3,
        normal: DVec3,
        surface: Option<SurfaceId>,
        count: usize,
        random: &mut PathRandom,
    ) -> Option<f64> {
        let (mut found, mut seen) = (0, 0);
        for _ in 0..TRIES * count {
            let direction = warp::around(normal, warp::cosine_hemisphere(random.uniform2()));
            let distance = luminaire.intersect(position, direction).filter(|distance| *distance > 0.0);
            let Some(distance) = distance.filter(|_| direction.dot(luminaire.normal) < 0.0) else { continue };
            let source = self.scene.enclosure.clamp(position + direction * distance);
            found += 1;
            seen += usize::from(self.scene.visible(position, surface, source, Some(luminaire.surface)));
            if found == count {
                break;
            }
        }
        (found > 0).then(|| seen as f64 / found as f64)
    }

    /// Estimates the luminance in cd/m2 and its bias of a scattering diffuser at `position`, a point of its lower side, as seen along the
    /// eye ray's `direction`.
    pub fn luminance(
        &self,
        maps: &Maps<C>,
        index: usize,
        closure: Closure<'_>,
        position: DVec3,
        direction: DVec3,
    ) -> Gathered<C> {
        let tube = &self.scene.tubes[index];
        let radius = maps.radius.min(0.25 * tube.opening.inner_radius());
        let sums = match closure.table() {
            Some(table) => measured_within(maps, (index, tube), table, (position, direction), radius),
            None => {
                let (whole, half, count) = maps.exit_grid.gather(position, radius, Tube(index as u32));
                (whole * (1.0 / PI), half * (1.0 / PI), count)
            }
        };
        let away = tube.away(position);
        let area = |radius: f64| {
            let opening = tube.opening.area_within(away, radius);
            match tube.specular_zone() {
                Some(zone) => {
                    let [inner, outer] = [zone.0, zone.1].map(|of| disc_disc_area(radius, of, away.length()));
                    opening - (outer - inner)
                }
                None => opening,
            }
        };
        density(sums, area, PI * radius * radius, radius)
    }

    /// Estimates the luminance toward `eye` (a unit vector) of a glossy lobe of reflectance 1 lit by the diffusers, by connections with
    /// their MIS weight.
    pub fn diffusers_in_lobe(
        &self,
        maps: &Maps<C>,
        lobe: &Glossy,
        hit: &RoomHit,
        surface: Option<SurfaceId>,
        eye: DVec3,
        random: &mut PathRandom,
    ) -> Spectrum<C> {
        let mut sum = Spectrum::ZERO;
        for (index, exits) in maps.exits.iter().enumerate() {
            let tube = &self.scene.tubes[index];
            let count = POINT_CONNECTIONS.min(exits.len());
            for k in 0..count {
                let stratum = (k as f64 + random.uniform()) / count as f64;
                let number = ((stratum * exits.len() as f64) as usize).min(exits.len() - 1);
                let exit = &exits[number];
                let to_exit = exit.position - hit.position;
                let distance_squared = to_exit.length_squared();
                let toward = to_exit / distance_squared.sqrt();
                let down = tube.frame.up(toward);
                let density = if down > 0.0 { lobe.density(hit.normal, eye, toward) } else { 0.0 };
                if density > 0.0 && self.scene.visible(hit.position, surface, exit.position, None) {
                    let connected = connection_density(tube, to_exit);
                    let fraction = connected / (density + connected);
                    let per_sr = match tube.diffuser.measured() {
                        Some(table) => {
                            down * measured_per_sr(table, tube.frame.up(maps.incidents[index][number]), down)
                        }
                        None => down / PI,
                    };
                    let geometry = density * per_sr / distance_squared;
                    sum += exit.flux * (fraction * geometry * exits.len() as f64 / count as f64);
                }
            }
        }
        sum
    }
}

/// Sums the luminous intensity per projected area, in cd, toward an eye along the ray's `direction` of the photons at a measured diffuser
/// within `radius` m of a point, and within half that area; also returns the number of photons in the whole.
fn measured_within<const C: usize>(
    maps: &Maps<C>,
    (index, tube): (usize, &TraceableTube),
    table: &MeasuredDiffuser,
    (position, direction): (DVec3, DVec3),
    radius: f64,
) -> (Spectrum<C>, Spectrum<C>, u64) {
    let (mut whole, mut half, mut count) = (Spectrum::ZERO, Spectrum::ZERO, 0);
    let half_squared = 0.5 * (radius * radius);
    if let Some(grid) = &maps.measured_exits[index] {
        grid.for_each_within(position, radius, |number, flux, distance_squared| {
            let incident = maps.incidents[index][number as usize];
            let sent = flux * measured_per_sr(table, tube.frame.up(incident), tube.frame.up(direction));
            whole += sent;
            count += 1;
            if distance_squared < half_squared {
                half += sent;
            }
        });
    }
    (whole, half, count)
}

/// Returns the BTDF or BRDF per sr of a measured diffuser for light that leaves into the room with the given cosine; `incident` is the
/// component of the direction of the light that arrives along the normal out of the room.
fn measured_per_sr(table: &MeasuredDiffuser, incident: f64, exit_cosine: f64) -> f64 {
    table.per_sr(incident < 0.0, incident.abs(), exit_cosine)
}

/// Returns the MIS weight of a ray that meets a diffuser along `to_light`; `chosen` is the probability density with which a glossy lobe
/// sampled the direction, `None` if none did.
pub fn opening_weight(chosen: Option<f64>, tube: &TraceableTube, to_light: DVec3) -> f64 {
    chosen.map_or(1.0, |density| density / (density + connection_density(tube, to_light)))
}

/// Returns the MIS weight of a ray that meets a luminaire along `to_light`; `chosen` as in [`opening_weight`].
pub fn luminaire_weight(chosen: Option<f64>, luminaire: &TraceableLuminaire, to_light: DVec3) -> f64 {
    chosen.map_or(1.0, |density| density / (density + connections_to_luminaire(luminaire, to_light)))
}

/// Returns the number of connections per sr along `to_light` from a glossy surface to a luminaire.
fn connections_to_luminaire(luminaire: &TraceableLuminaire, to_light: DVec3) -> f64 {
    (POINT_STRATA * POINT_STRATA) as f64 * luminaire_density(luminaire, to_light)
}

/// Returns the number of connections per sr along `to_light` to a diffuser, as if its photons were even on the opening; it is the density
/// of connections in the balance heuristic.
fn connection_density(tube: &TraceableTube, to_light: DVec3) -> f64 {
    let distance_squared = to_light.length_squared();
    POINT_CONNECTIONS as f64 * distance_squared * distance_squared.sqrt()
        / (tube.frame.up(to_light) * tube.opening.area_m2())
}
