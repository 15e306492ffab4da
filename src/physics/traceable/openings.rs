//! Which of many openings a vertex is connected to: one, by what each would send there if nothing stood between.

use glam::DVec3;

use super::tube::TraceableTube;

/// Groups of openings, at most, and openings in each of several, at the least.
const MOST_GROUPS: usize = 64;
const LEAST_GROUP: usize = 8;

/// The openings of a room, and what each sends down.
#[derive(Clone, Debug)]
pub struct Openings(Vec<Opening>);

#[derive(Clone, Copy, Debug)]
struct Opening {
    centre: DVec3,
    radius: f64,
    /// In any unit that is the same for all.
    power: f64,
}

impl Openings {
    /// Openings of these powers, in the order of the tubes.
    pub fn new(tubes: &[TraceableTube], powers: impl IntoIterator<Item = f64>) -> Self {
        let opening =
            |(tube, power): (&TraceableTube, f64)| Opening { centre: tube.origin, radius: tube.opening_radius, power };
        Self(tubes.iter().zip(powers).map(opening).collect())
    }

    /// Openings that send as much as they are large.
    pub fn by_area(tubes: &[TraceableTube]) -> Self {
        Self::new(tubes, tubes.iter().map(TraceableTube::opening_area_m2))
    }

    /// One of the openings by a number in 0..1, and the probability by which it was chosen; `None` where no opening can send light.
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
    /// About what it sends to a surface, and more than 0 wherever it sends anything.
    #[inline]
    fn weight(&self, position: DVec3, normal: DVec3) -> f64 {
        self.power * opening_weight(self.centre, self.radius, position, normal)
    }
}

/// About what an opening sends to a surface per power, in 1/m2, and more than 0 wherever it sends anything.
#[inline]
pub fn opening_weight(centre: DVec3, radius: f64, position: DVec3, normal: DVec3) -> f64 {
    let way = centre - position;
    let reach = radius * normal.truncate().length();
    let squared = way.length_squared() + radius * radius;
    (way.dot(normal) + reach).max(0.0) * way.z.max(0.0) / (squared * squared)
}
