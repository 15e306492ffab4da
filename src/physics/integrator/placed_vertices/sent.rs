//! What a point on a surface sends to sensors, relative to what they get in all.

use glam::DVec3;

/// A sensor as importance sees it.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// Position in m.
    pub position: DVec3,
    /// Squared distance in m2 below which no vertex is connected to it.
    pub near_squared: f64,
}

/// Sensors whose shares are summed up side by side: the same on every processor.
const LANES: usize = 8;

/// Sensors by coordinates, whole groups of them.
pub struct Sensors {
    /// Height in m of the lowest one.
    pub lowest: f64,
    groups: Vec<Group>,
    vectors: pulp::Arch,
}

/// Some sensors, and nobody where there are fewer.
#[derive(Clone, Copy, Default)]
struct Group {
    x: [f64; LANES],
    y: [f64; LANES],
    z: [f64; LANES],
    near_squared: [f64; LANES],
    /// One over the illuminance in lx; 0 of nobody.
    needs: [f64; LANES],
}

impl Sensors {
    /// `need` is one over the illuminance in lx at a position.
    pub fn new<'a>(sensors: impl Iterator<Item = &'a Target>, need: impl Fn(DVec3) -> f64) -> Self {
        let mut all = Self { lowest: f64::INFINITY, groups: Vec::new(), vectors: pulp::Arch::new() };
        for (number, Target { position, near_squared }) in sensors.enumerate() {
            let lane = number % LANES;
            if lane == 0 {
                all.groups.push(Group::default());
            }
            if let Some(group) = all.groups.last_mut() {
                (group.x[lane], group.y[lane], group.z[lane]) = (*position).into();
                (group.near_squared[lane], group.needs[lane]) = (*near_squared, need(*position));
            }
            all.lowest = all.lowest.min(position.z);
        }
        all
    }

    /// What a point sends to the sensors: root of the sum of the squares of their illuminances, each times its need. `normal` is the
    /// unit normal at the point, where it faces one way.
    pub fn sent(&self, point: DVec3, normal: Option<DVec3>) -> f64 {
        let groups = &self.groups;
        let squares = match normal {
            Some(normal) => self.vectors.dispatch(Squares::<true> { groups, point, normal }),
            None => self.vectors.dispatch(Squares::<false> { groups, point, normal: DVec3::ZERO }),
        };
        squares.iter().sum::<f64>().sqrt()
    }
}

/// Sums by lane of the squares of what a point sends to each sensor, if it `FACES` one way.
struct Squares<'a, const FACES: bool> {
    groups: &'a [Group],
    point: DVec3,
    normal: DVec3,
}

impl<const FACES: bool> pulp::NullaryFnOnce for Squares<'_, FACES> {
    type Output = [f64; LANES];

    // no closures: they would be compiled without vector instructions
    #[inline(always)]
    fn call(self) -> [f64; LANES] {
        let Self { groups, point, normal } = self;
        let mut sums = [0.0; LANES];
        for group in groups {
            for (lane, sum) in sums.iter_mut().enumerate() {
                let (x, y, down) = (group.x[lane] - point.x, group.y[lane] - point.y, point.z - group.z[lane]);
                let squared = x * x + y * y + down * down;
                let cosine = if FACES { x * normal.x + y * normal.y - down * normal.z } else { squared.sqrt() };
                let cosines = cosine.max(0.0) * down.max(0.0);
                let connected = (cosines > 0.0) & (squared >= group.near_squared[lane]);
                let share = cosines / (squared * squared) * group.needs[lane];
                let share = if connected { share } else { 0.0 };
                *sum += share * share;
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As the sum over sensors one by one, for a point that faces one way and one that may face any; what is behind the point, above
    /// it or too near gets nothing.
    #[test]
    fn groups_of_sensors_are_sensors_one_by_one() {
        let target = |number: u32| {
            let [x, y, z] = [3, 5, 7].map(|step| f64::from(number * step % 11) * 0.3);
            Target { position: DVec3::new(x, y, z), near_squared: if number.is_multiple_of(4) { 2.0 } else { 0.0 } }
        };
        let need = |position: DVec3| 1.0 + position.x;
        for count in [1, 7, 8, 9, 29] {
            let targets: Vec<Target> = (0..count).map(target).collect();
            let sensors = Sensors::new(targets.iter(), need);
            assert_eq!(sensors.lowest, targets.iter().map(|target| target.position.z).fold(9.0, f64::min));
            for point in [DVec3::new(1.0, 1.1, 2.0), DVec3::new(0.3, 0.2, 0.5), targets[0].position] {
                for normal in [Some(DVec3::NEG_Z), Some(DVec3::new(0.6, 0.0, -0.8)), None] {
                    let one = |target: &Target| {
                        let way = target.position - point;
                        let cosine = normal.map_or(way.length(), |normal| way.dot(normal));
                        let is_lit = way.z < 0.0 && cosine > 0.0 && way.length_squared() >= target.near_squared;
                        let lux = if is_lit { cosine * -way.z / way.length_squared().powi(2) } else { 0.0 };
                        (lux * need(target.position)).powi(2)
                    };
                    let expected = targets.iter().map(one).sum::<f64>().sqrt();
                    let sent = sensors.sent(point, normal);
                    assert!(
                        (sent - expected).abs() <= 1e-12 * expected,
                        "{count} {point} {normal:?}: {sent} {expected}"
                    );
                }
            }
        }
    }
}
