//! Contributions of photons of light tracing to the sensors: connections, and flights that cross cells.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use crate::integrator::photon::connect::{Connection, SensorPlane};
use crate::integrator::photon::emission::{EmittedPhoton, Start};
use crate::integrator::photon::events::{Flight, Origin, Scattering, Visitor};
use crate::optics::Spectrum;
use crate::sampling::PathSamples;
use crate::traceable::obstacles::Shadow;
use crate::traceable::{SurfaceId, TraceableScene};

/// Number of photons for each one that is connected to the sensors from its diffuser: direct light is smooth and needs few of them, the
/// others are traced for the interreflection.
const DIFFUSER_CONNECTIONS: u64 = 4;

/// Illuminance of all sensors in lx, from some photons.
pub struct SensorTally<'a> {
    pub scene: &'a TraceableScene,
    pub sensors: &'a [SensorPlane],
    /// Widest vectors of this machine.
    pub vectors: pulp::Arch,
    /// True if no surface concentrates light, so that the number of connected photons limits the contribution of any of them.
    pub tells_by_number: bool,
    /// True if another estimator counts direct light of luminaires.
    pub but_luminaires: bool,
    /// True if another estimator counts light straight through clear closures.
    pub but_beams: bool,
    /// True until the first flight of the present photon through the room, if it starts in a tube and `but_beams`.
    pub comes_in: bool,
    pub lux: Vec<f64>,
    /// Lower bound of the number of photons behind each sensor of a plane of points: those that were connected to all of them, in rooms
    /// where nothing hides or concentrates light.
    pub connected: Vec<u64>,
    /// True for the planes whose count includes the present photon.
    pub counted: Vec<bool>,
    /// Weight of the present photon's connections from diffusers.
    pub diffuser_weight: f64,
}

/// Fraction of the flux that a photon brings into the room above which it is reflected without Russian roulette: tracing it to the room
/// takes longer than a reflection, and low-discrepancy points stay uniform. With 0.4 the thesis' room takes a sixth longer to an error,
/// with 0.12 as long.
const CERTAIN_ABOVE: f64 = 0.2;

impl<const C: usize> Visitor<C> for SensorTally<'_> {
    const CERTAIN_ABOVE: f64 = CERTAIN_ABOVE;

    fn scattered(&mut self, scattering: &Scattering<'_, C>, samples: &mut PathSamples) {
        let weight = if scattering.diffuser.is_some() { self.diffuser_weight } else { 1.0 };
        self.connect(scattering, weight, samples);
    }

    fn emitted(&mut self, scattering: &Scattering<'_, C>, samples: &mut PathSamples) {
        if !self.but_luminaires {
            self.connect(scattering, self.diffuser_weight, samples);
        }
    }

    fn flew(&mut self, flight: &Flight<C>) {
        if std::mem::take(&mut self.comes_in) && matches!(flight.origin, Origin::Specular) {
            return;
        }
        if matches!(flight.origin, Origin::Luminaire(_)) && self.but_luminaires {
            return;
        }
        for plane in self.sensors.iter().filter(|plane| plane.average) {
            let Some(crossing) = plane.crossing(flight.from, flight.to, self.scene.contact()) else { continue };
            let near = (crossing - flight.from).length_squared() < plane.near_squared;
            if (near || matches!(flight.origin, Origin::Specular | Origin::Lobe(_)))
                && let Some(index) = plane.grid.cell_at(crossing.truncate())
            {
                self.lux[plane.first + index] += flight.flux.luminance() / plane.grid.cell_area_m2();
            }
        }
    }

    fn arrived(&mut self, _: SurfaceId, _: DVec3, _: Spectrum<C>, _: Origin) {}
}

impl SensorTally<'_> {
    /// Prepares for the path of a photon.
    pub fn begin(&mut self, photon: &EmittedPhoton) {
        let connected = photon.of.div_ceil(DIFFUSER_CONNECTIONS);
        self.diffuser_weight = if photon.index < connected { photon.of as f64 / connected as f64 } else { 0.0 };
        self.counted.fill(false);
        self.comes_in = self.but_beams && matches!(photon.start, Start::Tube(_));
    }

    /// Adds the light that a vertex sends straight to the sensors.
    fn connect<const C: usize>(&mut self, scattering: &Scattering<'_, C>, weight: f64, samples: &mut PathSamples) {
        if weight == 0.0 {
            return;
        }
        let per_sr = weight * scattering.outgoing.luminance() / PI;
        for (number, plane) in self.sensors.iter().enumerate() {
            let depth = scattering.position.z - plane.height;
            if depth <= 0.0 {
                continue;
            }
            // one random offset, the same in every cell
            let offset = if plane.average {
                let [u, v] = samples.random.uniform2();
                DVec2::new((u - 0.5) * plane.grid.cell_size_m[0], (v - 0.5) * plane.grid.cell_size_m[1])
            } else {
                DVec2::ZERO
            };
            let connection = Connection {
                vertex: scattering.position - offset.extend(0.0),
                normal: scattering.normal,
                depth,
                per_sr,
                near_squared: if plane.average { plane.near_squared } else { 0.0 },
            };
            let lux = &mut self.lux[plane.first..plane.first + plane.len()];
            // cell averages count a surface's lobe where its flights cross cells
            let lobe = scattering.lobe.as_ref().filter(|_| !plane.average || scattering.diffuser.is_some());
            if lobe.is_none() && per_sr == 0.0 {
                continue;
            }
            let scene = self.scene;
            let all = plane.stride == 1 && lobe.is_none() && !plane.is_cut;
            if all && !scene.obstructed {
                connection.add_to(self.vectors, lux, &plane.x, &plane.y);
                let is_first = !std::mem::replace(&mut self.counted[number], true);
                self.connected[number] += u64::from(is_first && self.tells_by_number && !plane.average);
                continue;
            }
            let start = if plane.stride > 1 { (samples.random.uniform() * plane.stride as f64) as usize } else { 0 };
            let sees = |index: usize| {
                let target = DVec3::new(plane.x[index] + offset.x, plane.y[index] + offset.y, plane.height);
                !(plane.is_cut && scene.is_in_solid(target))
                    && scene.visible(scattering.position, scattering.surface, target, None)
            };
            if lobe.is_some() || plane.is_cut {
                for index in (start..plane.len()).step_by(plane.stride) {
                    let (x, y) = (plane.x[index], plane.y[index]);
                    let of_lobe = lobe.map_or(0.0, |lobe| weight * connection.lobe_illuminance(lobe, x, y));
                    let value = connection.illuminance(x, y) + of_lobe;
                    if value > 0.0 && sees(index) {
                        lux[index] += value * plane.stride as f64;
                    }
                }
                continue;
            }
            let own_box = scattering.surface.and_then(|surface| scene.numbering.box_of(surface));
            let shadows: Vec<Shadow> = match scene.obstructed {
                true => scene.shadows(scattering.position, plane.height, own_box).collect(),
                false => Vec::new(),
            };
            if all && shadows.is_empty() {
                connection.add_to(self.vectors, lux, &plane.x, &plane.y);
                continue;
            }
            plane.add_visible(&connection, self.vectors, &shadows, start, sees, lux);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::photon::events::Lobe;
    use crate::optics::reflection::Lobes;
    use crate::optics::{Oriented, Scatterer, Surface};
    use crate::sampling::Key;
    use crate::scene::{BoxObject, EstimateKind, Face, Grid};
    use crate::traceable::test_rooms::{self, compiled};
    use crate::traceable::{Place, TraceableScene};

    fn planes(grids: &[Grid]) -> Vec<SensorPlane> {
        let mut first = 0;
        let plane = |grid: &Grid| {
            first += grid.len();
            SensorPlane::new(grid, first - grid.len())
        };
        grids.iter().map(plane).collect()
    }

    fn empty<'a>(scene: &'a TraceableScene, sensors: &'a [SensorPlane], diffuser_weight: f64) -> SensorTally<'a> {
        SensorTally {
            scene,
            sensors,
            vectors: pulp::Arch::new(),
            tells_by_number: true,
            connected: vec![0; sensors.len()],
            counted: vec![false; sensors.len()],
            but_luminaires: false,
            but_beams: false,
            comes_in: false,
            lux: vec![0.0; sensors.iter().map(SensorPlane::len).sum()],
            diffuser_weight,
        }
    }

    /// Checks that a Lambertian lobe of some flux lights sensors like Lambertian flux, to rounding; on cells only from a diffuser.
    #[test]
    fn lobes_are_connected() {
        let size = DVec3::new(3.0, 4.0, 2.5);
        let grid = |estimate| Grid::new("grid".into(), 0.5, [7, 5], 0.1, [size.x, size.y], estimate);
        let traceable = compiled(&test_rooms::empty(size, None));
        let sensors = planes(&[grid(EstimateKind::Point), grid(EstimateKind::CellAverage)]);
        let flux = Spectrum([2.0, 3.0, 5.0]);
        let white = Lobes::default().compile(&Surface::diffuse([1.0; 3]));
        let lux = |outgoing: Spectrum<3>, lobed: bool, diffuser: Option<usize>| {
            let incident = DVec3::new(-1.0, 0.2, -0.3).normalize();
            let normal = DVec3::X;
            let scatterer = Scatterer::Surface(Oriented { optics: &white, normal });
            let lobe = lobed.then_some(Lobe { scatterer, incident, flux });
            let position = DVec3::new(0.0, 1.7, 1.9);
            let scattering = Scattering {
                position,
                normal,
                outgoing,
                lobe,
                surface: Some(SurfaceId::of_face(Face::West)),
                diffuser,
            };
            let mut tally = empty(&traceable, &sensors, 4.0);
            tally.scattered(&scattering, &mut PathSamples::new(Key::new(1), 0));
            tally.lux
        };
        for (diffuser, connected) in [(None, 35), (Some(0), 70)] {
            let (truth, lobe) = (lux(flux, false, diffuser), lux(Spectrum::ZERO, true, diffuser));
            for sensor in 0..connected {
                assert!(truth[sensor] > 0.0 || sensor >= 35);
                assert!((lobe[sensor] - truth[sensor]).abs() <= 1e-14 * truth[sensor], "{sensor}");
            }
            assert!(lobe[connected..].iter().all(|lux| *lux == 0.0));
        }
    }

    /// Compares the light of a vertex past boxes, computed for many sensors at a time, with rays to each of them: for few sensors and for a
    /// subset of many, from walls, from the ceiling, and from the side of a box.
    #[test]
    fn boxes_hide_what_rays_do_not_pass() {
        let size = DVec3::new(3.0, 4.0, 2.5);
        let grid = |cells| Grid::new("grid".into(), 0.5, cells, 0.1, [size.x, size.y], EstimateKind::Point);
        let object = |base: DVec3, rotation: f64| BoxObject {
            size: DVec3::new(0.7, 0.4, 1.3),
            base,
            rotation,
            surface: Surface::diffuse([0.5; 3]),
        };
        let mut scene = test_rooms::empty(size, None);
        scene.room.boxes = vec![object(DVec3::new(1.0, 1.2, 0.0), 0.4), object(DVec3::new(2.1, 2.9, 0.3), 1.9)];
        let traceable = compiled(&scene);
        let sensors = planes(&[grid([9, 8]), grid([60, 40])]);
        let (mut hidden, mut seen) = (0, 0);
        let side = traceable.intersect(DVec3::new(0.2, 1.2, 1.0), DVec3::X, None);
        let vertices = [
            (DVec3::new(0.0, 1.7, 1.9), DVec3::X, SurfaceId::of_face(Face::West)),
            (DVec3::new(1.9, 0.0, 0.9), DVec3::Y, SurfaceId::of_face(Face::South)),
            (DVec3::new(1.6, 2.2, 2.5), DVec3::NEG_Z, SurfaceId::of_face(Face::Ceiling)),
            match side.place {
                Place::Surface(surface) => (side.position, side.normal, surface),
                Place::Opening(_) => panic!("a box stands there"),
            },
        ];
        for (position, normal, surface) in vertices {
            let outgoing = Spectrum([100.0]);
            let scattering =
                Scattering { position, normal, outgoing, lobe: None, surface: Some(surface), diffuser: None };
            let mut tally = empty(&traceable, &sensors, 1.0);
            tally.scattered(&scattering, &mut PathSamples::new(Key::new(1), 0));
            for plane in &sensors {
                let lux = &tally.lux[plane.first..plane.first + plane.len()];
                let start = lux.iter().position(|lux| *lux > 0.0).unwrap() % plane.stride;
                let per_sr = outgoing.luminance() / PI;
                let connection = Connection {
                    vertex: position,
                    normal,
                    depth: position.z - plane.height,
                    per_sr,
                    near_squared: 0.0,
                };
                for (index, lux) in lux.iter().enumerate() {
                    let target = DVec3::new(plane.x[index], plane.y[index], plane.height);
                    let visible = traceable.visible(position, Some(surface), target, None);
                    let fraction = if index % plane.stride == start && visible { plane.stride as f64 } else { 0.0 };
                    let expected = fraction * connection.illuminance(target.x, target.y);
                    assert!((lux - expected).abs() <= 1e-12 * expected, "{index} of {position}: {lux} {expected}");
                    seen += usize::from(expected > 0.0);
                    hidden += usize::from(!visible && index % plane.stride == start);
                }
            }
        }
        assert!(sensors[1].stride > 1 && seen > 500 && hidden > 200, "{seen} {hidden}");
    }
}
