//! Choice of the one opening, of many, that a vertex is connected to, by an estimate of the unoccluded light from each.

use glam::DVec3;

use super::tube::TraceableTube;
use crate::geometry::OpeningFrame;

/// Largest number of groups into which openings are divided; if there are several, each but the last has at least `LEAST_GROUP` openings.
const MOST_GROUPS: usize = 64;
const LEAST_GROUP: usize = 8;

/// Openings of a room, with the power that each sends into it.
#[derive(Clone, Debug)]
pub struct Openings(Vec<Opening>);

#[derive(Clone, Copy, Debug)]
struct Opening {
    frame: OpeningFrame,
    radius: f64,
    /// Power in any unit that is the same for all openings.
    power: f64,
}

impl Openings {
    /// Collects the openings of `tubes`, with `powers` in the order of the tubes.
    pub fn new(tubes: &[TraceableTube], powers: impl IntoIterator<Item = f64>) -> Self {
        let opening = |(tube, power): (&TraceableTube, f64)| {
            let (frame, radius) = (tube.frame, tube.opening.outer_radius());
            Opening { frame, radius, power }
        };
        Self(tubes.iter().zip(powers).map(opening).collect())
    }

    /// Collects the openings of `tubes`, with powers in proportion to their areas.
    pub fn by_area(tubes: &[TraceableTube]) -> Self {
        Self::new(tubes, tubes.iter().map(|tube| tube.opening.area_m2()))
    }

    /// Chooses an opening by a random number in 0..1, and returns its index and the probability of the choice; `None` where no opening
    /// can send light.
    #[inline]
    pub fn choose(&self, position: DVec3, normal: DVec3, number: f64) -> Option<(usize, f64)> {
        let weight = |opening: &Opening| opening.weight(position, normal);
        // sums over some openings each: the weights of one such group are computed twice, and all others once
        let group = self.0.len().div_ceil(MOST_GROUPS).max(LEAST_GROUP);
        let (mut sums, mut all) = ([0.0; MOST_GROUPS], 0.0);
        for (sum, openings) in sums.iter_mut().zip(self.0.chunks(group)) {
            *sum = openings.iter().map(weight).sum::<f64>();
            all += *sum;
        }
        let (mut before, mut last) = (0.0, None);
        for (number_of_group, (sum, openings)) in sums.iter().zip(self.0.chunks(group)).enumerate() {
            if *sum <= 0.0 {
                continue;
            }
            if before + sum <= number * all && before + sum < all {
                before += sum;
                continue;
            }
            for (index, opening) in openings.iter().enumerate() {
                let weight = weight(opening);
                if weight > 0.0 {
                    before += weight;
                    last = Some((number_of_group * group + index, weight / all));
                    if before > number * all {
                        return last;
                    }
                }
            }
        }
        last
    }
}

impl Opening {
    /// Estimates the unoccluded illuminance from the opening at a surface, up to a constant factor; greater than 0 wherever there is any.
    #[inline]
    fn weight(&self, position: DVec3, normal: DVec3) -> f64 {
        self.power * opening_weight(&self.frame, self.radius, position, normal)
    }
}

/// Estimates the unoccluded illuminance from an opening at a surface per power, in 1/m2 and up to a constant factor; greater than 0
/// wherever there is any.
#[inline]
pub fn opening_weight(frame: &OpeningFrame, radius: f64, position: DVec3, normal: DVec3) -> f64 {
    let to_opening = frame.levelled_direction(frame.origin - position);
    let normal = frame.levelled_direction(normal);
    let reach = radius * normal.truncate().length();
    let squared = to_opening.length_squared() + radius * radius;
    (to_opening.dot(normal) + reach).max(0.0) * to_opening.z.max(0.0) / (squared * squared)
}
