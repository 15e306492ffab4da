//! Part of a sensor's response to a closure that the centroid of the light does not tell: the light of a beam is a pattern of arcs.

use skyduct_physics::integrator::diffuser_source::cells::OpeningReceiver;
use skyduct_physics::scene::Sensor;
use skyduct_physics::traceable::{TraceableScene, TraceableTube};

/// Root mean square over suns of the error of an hour's illuminance, over the beam's flux and the response that is left out. It is 0.21 to 0.25 below
/// pipes of 0.7 m x 0.8 m and 0.7 m x 0.4 m, 0.1 to 0.2 below longer ones, at 1.1 to 4 radii from the closure (40 000 rays through each at 15 suns
/// of random azimuths between 15 and 71 degrees from the axis).
pub(crate) const PATTERN: f64 = 0.25;

/// Distance from a closure, in its radii, beyond which the pattern changes no hour by more than 0.1 %.
const FAR: f64 = 8.0;

/// Number of points along each side of the square that is mapped to a closure.
const POINTS: usize = 8;

/// Computes the root mean square over a closure of the part of a sensor's direct response in lx per lumen that is not linear in the place where the
/// light leaves; 0 below square closures, over which a transition spreads the light, and far away.
pub fn left_out(scene: &TraceableScene, tube: &TraceableTube, sensor: &Sensor) -> f64 {
    let Sensor { position, normal } = *sensor;
    let origin = tube.frame.origin;
    let is_far = position.distance(origin) > FAR * tube.opening.outer_radius();
    if is_far || tube.opening.disc().is_none() {
        return 0.0;
    }
    let receiver = OpeningReceiver::new(position, normal, &tube.frame);
    let (mut linear, mut squares) = ([0.0; 3], 0.0);
    for away in tube.opening.points(POINTS) {
        let lux = receiver.point(origin.truncate() + away).max(0.0);
        if lux == 0.0 || !scene.visible(tube.at(away), None, position, None) {
            continue;
        }
        linear[0] += lux;
        linear[1] += lux * away.x;
        linear[2] += lux * away.y;
        squares += lux * lux;
    }
    let points = (POINTS * POINTS) as f64;
    // the mean square of a coordinate over a disc
    let spread = 0.25 * tube.opening.outer_radius().powi(2);
    let [mean, along_x, along_y] = linear.map(|sum| sum / points);
    (squares / points - mean * mean - (along_x * along_x + along_y * along_y) / spread).max(0.0).sqrt()
}
