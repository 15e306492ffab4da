//! Sensors from which boxes may hide a part of an opening, and what they get of the light that leaves it.
//!
//! Seen from one sensor, the shadows of its boxes stay where they are while photons change: each sensor asks a few boxes about all
//! photons, several at once.

use glam::{DVec2, DVec3};

use crate::traceable::obstacles::Shadow;

/// Photons that are looked at side by side: the same sums on every processor.
const LANES: usize = 8;

/// Photons that leave an opening, whole groups of them; those that there are not have no light.
#[derive(Debug)]
pub struct Leaving {
    /// Distances to the east and north of the opening's middle in m.
    x: Vec<[f64; LANES]>,
    y: Vec<[f64; LANES]>,
    /// Intensities straight down in cd.
    per_sr: Vec<[f64; LANES]>,
}

/// A sensor with the boxes that may hide a part of an opening.
#[derive(Debug)]
pub struct BehindBoxes {
    /// Its place in the order of the targets.
    pub place: usize,
    /// Its distance to the east and north of the opening's middle, and below it, in m.
    pub away: DVec2,
    pub depth: f64,
    /// Shadows of the boxes by light from the opening's middle.
    pub shadows: Vec<Shadow>,
}

impl Leaving {
    /// Photons by their positions and intensities straight down in cd; `middle`: that of the opening.
    pub fn new(photons: impl Iterator<Item = (DVec3, f64)>, middle: DVec3) -> Self {
        let mut leaving = Self { x: Vec::new(), y: Vec::new(), per_sr: Vec::new() };
        for (number, (position, intensity)) in photons.enumerate() {
            let lane = number % LANES;
            for (numbers, value) in [
                (&mut leaving.x, position.x - middle.x),
                (&mut leaving.y, position.y - middle.y),
                (&mut leaving.per_sr, intensity),
            ] {
                if lane == 0 {
                    numbers.push([0.0; LANES]);
                }
                if let Some(last) = numbers.last_mut() {
                    last[lane] = value;
                }
            }
        }
        leaving
    }
}

impl BehindBoxes {
    /// The illuminance in lx that it gets of all photons.
    pub fn lux(&self, photons: &Leaving, vectors: pulp::Arch) -> f64 {
        let Self { away, depth, shadows, .. } = self;
        let mut sums = [0.0; LANES];
        vectors.dispatch(
            #[inline(always)]
            || {
                for ((x, y), per_sr) in photons.x.iter().zip(&photons.y).zip(&photons.per_sr) {
                    let mut seen = *per_sr;
                    for shadow in shadows {
                        for lane in 0..LANES {
                            let (x, y) = (x[lane], y[lane]);
                            let hides = shadow.of_light_beside(x, y).hides(away.x - x, away.y - y);
                            seen[lane] = if hides { 0.0 } else { seen[lane] };
                        }
                    }
                    for lane in 0..LANES {
                        let (dx, dy) = (away.x - x[lane], away.y - y[lane]);
                        let distance_squared = dx * dx + dy * dy + depth * depth;
                        sums[lane] += seen[lane] * (depth * depth) / (distance_squared * distance_squared);
                    }
                }
            },
        );
        let [a, b, c, d, e, f, g, h] = sums;
        ((a + b) + (c + d)) + ((e + f) + (g + h))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::Surface;
    use crate::sampling::{Key, PathRandom, warp};
    use crate::scene::BoxObject;
    use crate::traceable::TraceableBox;
    use crate::traceable::obstacles::{DiscView, Obstacles};

    /// Sensors get the photons to which a ray meets no box, and nothing of the others, for any number of these.
    #[test]
    fn photons_are_seen_where_rays_meet_no_box() {
        let mut random = PathRandom::new(Key::new(61));
        let (middle, radius, height) = (DVec3::new(1.4, 1.6, 2.5), 0.3, 0.1);
        let (mut hidden, mut seen) = (0, 0);
        for round in 0..400 {
            let mut uniform = |low: f64, high: f64| low + (high - low) * random.uniform();
            let object = |number: usize| {
                let size = DVec3::new(uniform(0.1, 0.6), uniform(0.1, 0.6), uniform(0.1, 1.2));
                let base = DVec3::new(uniform(0.5, 2.5), uniform(0.5, 2.5), uniform(0.0, 0.5));
                let rotation = if number == 0 { 0.0 } else { uniform(0.0, 7.0) };
                TraceableBox::new(&BoxObject { size, base, rotation, surface: Surface::diffuse([0.5; 3]) })
            };
            let boxes: Vec<TraceableBox> = (0..4).map(object).collect();
            let sensor = DVec3::new(uniform(0.0, 3.0), uniform(0.0, 3.0), height);
            let obstacles = Obstacles::new(&boxes, &[], &[]);
            let DiscView::Partly(in_the_way) = obstacles.view_of_disc(sensor, middle, radius) else { continue };
            if boxes.iter().any(|object| object.contains(sensor)) {
                continue;
            }
            let shadows = obstacles.shadows_of(&in_the_way, middle, height).unwrap();
            let (away, depth) = ((sensor - middle).truncate(), middle.z - height);
            let behind = BehindBoxes { place: 0, away, depth, shadows };
            let photons: Vec<(DVec3, f64)> = (0..1 + round % 19)
                .map(|_| (middle + (warp::disc(random.uniform2()) * radius).extend(0.0), random.uniform()))
                .collect();
            let sees = |photon: &DVec3| {
                let meets =
                    |object: &TraceableBox| object.intersect(sensor, *photon - sensor).is_some_and(|(t, ..)| t < 1.0);
                !boxes.iter().any(meets)
            };
            let mut expected = 0.0;
            for (photon, per_sr) in &photons {
                if sees(photon) {
                    expected += per_sr * depth * depth / (*photon - sensor).length_squared().powi(2);
                    seen += 1;
                } else {
                    hidden += 1;
                }
            }
            let lux = behind.lux(&Leaving::new(photons.into_iter(), middle), pulp::Arch::new());
            assert!((lux - expected).abs() <= 1e-12 * expected, "{round}: {lux} {expected}");
        }
        assert!(hidden > 200 && seen > 200, "{hidden} {seen}");
    }
}
