//! Direct light of luminaires, in closed form (Lambert 1760).

use glam::DVec3;
use rayon::prelude::*;

use crate::integrator::photon::connect::SensorPlane;
use crate::sampling::{Key, PathRandom, Stream};
use crate::traceable::TraceableScene;
use crate::traceable::luminaire::TraceableLuminaire;

/// Smallest number of sensors for which one thread computes the closed form: fewer (some tens of ns each) are not worth waking another
/// thread.
const SENSORS_PER_TASK: usize = 64;

/// True if the direct light of luminaires has a closed form: nothing hides it.
pub fn has_closed_form(scene: &TraceableScene) -> bool {
    !scene.luminaires.is_empty() && !scene.luminaires_obstructed
}

/// Computes the direct illuminance in lx at every sensor of point grids; 0 at those of others. `C` channels of light.
pub fn at_points<const C: usize>(scene: &TraceableScene, sensors: &[SensorPlane]) -> Vec<f64> {
    let mut direct = vec![0.0; sensors.last().map_or(0, |last| last.first + last.len())];
    for plane in sensors.iter().filter(|plane| !plane.average) {
        let of_plane = &mut direct[plane.first..plane.first + plane.len()];
        of_plane.par_iter_mut().with_min_len(SENSORS_PER_TASK).enumerate().for_each(|(index, lux)| {
            *lux = illuminance::<C>(scene, DVec3::new(plane.x[index], plane.y[index], plane.height));
        });
    }
    direct
}

/// Adds the direct illuminance in lx at a random point of each cell of a grid of averages. `C` channels of light.
pub fn add_to_cells<const C: usize>(scene: &TraceableScene, plane: &SensorPlane, pass: Key, lux: &mut [f64]) {
    lux.par_iter_mut().with_min_len(SENSORS_PER_TASK).enumerate().for_each(|(index, lux)| {
        let [u, v] = PathRandom::new(pass.stream(Stream::CellPoint, (plane.first + index) as u64)).uniform2();
        let centre = DVec3::new(plane.x[index], plane.y[index], plane.height);
        let offset = DVec3::new((u - 0.5) * plane.grid.cell_size_m[0], (v - 0.5) * plane.grid.cell_size_m[1], 0.0);
        if !(plane.is_cut && scene.is_in_solid(centre + offset)) {
            *lux += illuminance::<C>(scene, centre + offset);
        }
    });
}

/// Returns the direct illuminance in lx at a point that looks up.
fn illuminance<const C: usize>(scene: &TraceableScene, sensor: DVec3) -> f64 {
    let direct = |luminaire: &TraceableLuminaire| luminaire.irradiance::<C>(sensor, DVec3::Z).luminance();
    scene.luminaires.iter().map(direct).sum()
}
