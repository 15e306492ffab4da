//! Number of photons behind each sensor's value in light tracing, from which an estimate detects that they are few.

use std::f64::consts::PI;

use crate::integrator::PhotonCount;
use crate::integrator::photon::connect::SensorPlane;
use crate::integrator::photon_map::domain::Domain;
use crate::integrator::photon_map::maps::LEAST_KERNEL;
use crate::optics::SurfaceOptics;
use crate::traceable::TraceableScene;

/// Quantities from which the photon counts of a scene's sensors follow.
#[derive(Clone, Debug, Default)]
pub struct Counting {
    /// True for every sensor that photons can be connected to: it is not inside an object, and some surface scatters light to it.
    reachable: Vec<bool>,
    /// Illuminance in lx by one photon of a pass that carries 1 lm, at a distance of half the room's shortest edge.
    one_lux_per_lm: f64,
}

impl Counting {
    /// Prepares for passes of this number of `photons`; `straight` if some connections start where light enters the room.
    pub fn new(scene: &TraceableScene, sensors: &[SensorPlane], straight: bool, photons: u64) -> Self {
        let distance = 0.5 * scene.enclosure.shortest_edge_m();
        let one_lux_per_lm = 1.0 / (photons.max(1) as f64 * PI * distance * distance);
        Self { reachable: reachable(scene, sensors, straight), one_lux_per_lm }
    }

    /// Returns the photon counts of each sensor in a pass, from its illuminance by photons alone, the number of them that were `connected`
    /// to all sensors of its plane, and their `flux` in the room in lm: a sensor that the pass lights found at least one photon.
    pub fn photons(&self, sensors: &[SensorPlane], lux: &[f64], connected: &[u64], flux: f64) -> Vec<PhotonCount> {
        let one_lux = flux * self.one_lux_per_lm;
        let of_plane = |(plane, connected): (&SensorPlane, &u64)| {
            let sensors = plane.first..plane.first + plane.len();
            let found = (*connected).max(1) as f64;
            lux[sensors.clone()].iter().zip(&self.reachable[sensors]).map(move |(lux, reachable)| PhotonCount {
                found: if *lux > 0.0 { found } else { 0.0 },
                one_lux: if *reachable { one_lux } else { 0.0 },
                brightest_lux: 0.0,
            })
        };
        sensors.iter().zip(connected).flat_map(of_plane).collect()
    }
}

fn reachable(scene: &TraceableScene, sensors: &[SensorPlane], straight: bool) -> Vec<bool> {
    let reflects = |surface: &SurfaceOptics| surface.gathers() || surface.is_specular();
    let scatters = !scene.is_dark() && (straight || (scene.interreflection && scene.all_optics().any(reflects)));
    let of_plane = |SensorPlane { grid, average, .. }: &SensorPlane| -> Vec<bool> {
        if !scatters || !scene.obstructed {
            return vec![scatters; grid.len()];
        }
        let plane = Domain::horizontal_plane(scene, grid.height_m);
        let reach =
            if *average { 0.5 * libm::hypot(grid.cell_size_m[0], grid.cell_size_m[1]) } else { scene.coinciding() };
        let within = |sensor| plane.area(grid.centre(sensor), reach) > LEAST_KERNEL * PI * reach * reach;
        (0..grid.len()).map(within).collect()
    };
    sensors.iter().flat_map(of_plane).collect()
}
