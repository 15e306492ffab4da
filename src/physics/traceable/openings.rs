//! Choice of the one opening, of many, that a vertex is connected to, by an estimate of the unoccluded light from each.

use glam::DVec3;

use super::tube::TraceableTube;
use crate::geometry::OpeningFrame;

/// Number of openings whose weights are computed together.
const LANES: usize = 8;

/// Number of sums over some openings each: those with the chosen one are computed twice, all others once.
const SUMS: usize = 64;

/// Openings of a room, with the power that each sends into it.
#[derive(Clone, Debug)]
pub struct Openings {
    packets: Vec<Packet>,
    /// Widest vectors of this machine; weights have the same bits as without them, because no multiplication and addition are fused.
    vectors: pulp::Arch,
}

/// Some openings, as plain arrays; unused places have no power.
#[derive(Clone, Copy, Debug)]
struct Packet {
    /// Coordinates of the centres in m.
    origin: [[f64; LANES]; 3],
    /// Coordinates of the unit vectors from the room into the openings.
    up: [[f64; LANES]; 3],
    radius: [f64; LANES],
    /// Power in any unit that is the same for all openings.
    power: [f64; LANES],
}

impl Openings {
    /// Collects the openings of `tubes`, with `powers` in the order of the tubes.
    pub fn new(tubes: &[TraceableTube], powers: impl IntoIterator<Item = f64>) -> Self {
        let mut packets = vec![Packet::UNUSED; tubes.len().div_ceil(LANES)];
        for (number, (tube, power)) in tubes.iter().zip(powers).enumerate() {
            let (packet, lane) = (&mut packets[number / LANES], number % LANES);
            let (origin, up) = (tube.frame.origin.to_array(), tube.frame.outward().to_array());
            for axis in 0..3 {
                packet.origin[axis][lane] = origin[axis];
                packet.up[axis][lane] = up[axis];
            }
            packet.radius[lane] = tube.opening.outer_radius();
            packet.power[lane] = power;
        }
        Self { packets, vectors: pulp::Arch::new() }
    }

    /// Collects the openings of `tubes`, with powers in proportion to their areas.
    pub fn by_area(tubes: &[TraceableTube]) -> Self {
        Self::new(tubes, tubes.iter().map(|tube| tube.opening.area_m2()))
    }

    /// Chooses an opening by a random number in 0..1, and returns its index and the probability of the choice; `None` where no opening
    /// can send light.
    #[inline]
    pub fn choose(&self, position: DVec3, normal: DVec3, number: f64) -> Option<(usize, f64)> {
        self.vectors.dispatch(
            #[inline(always)]
            || self.chosen(position, normal, number),
        )
    }

    /// Does what [`Self::choose`] does, with one instruction set.
    #[inline(always)]
    fn chosen(&self, position: DVec3, normal: DVec3, number: f64) -> Option<(usize, f64)> {
        let per_sum = self.packets.len().div_ceil(SUMS).max(1);
        let (mut sums, mut all) = ([0.0; SUMS], 0.0);
        for (sum, packets) in sums.iter_mut().zip(self.packets.chunks(per_sum)) {
            for packet in packets {
                *sum += packet.weights(position, normal).into_iter().sum::<f64>();
            }
            all += *sum;
        }
        let (mut before, mut last) = (0.0, None);
        for (number_of_sum, (sum, packets)) in sums.iter().zip(self.packets.chunks(per_sum)).enumerate() {
            if *sum <= 0.0 {
                continue;
            }
            if before + sum <= number * all && before + sum < all {
                before += sum;
                continue;
            }
            for (number_of_packet, packet) in packets.iter().enumerate() {
                let first = (number_of_sum * per_sum + number_of_packet) * LANES;
                for (lane, weight) in packet.weights(position, normal).into_iter().enumerate() {
                    if weight > 0.0 {
                        before += weight;
                        last = Some((first + lane, weight / all));
                        if before > number * all {
                            return last;
                        }
                    }
                }
            }
        }
        last
    }
}

impl Packet {
    /// Packet without power.
    const UNUSED: Self =
        Self { origin: [[0.0; LANES]; 3], up: [[0.0; LANES]; 3], radius: [1.0; LANES], power: [0.0; LANES] };

    /// Returns the weight of each opening for a surface: its power times [`opening_weight`].
    #[inline(always)]
    fn weights(&self, position: DVec3, normal: DVec3) -> [f64; LANES] {
        let mut weights = [0.0; LANES];
        for (lane, weight) in weights.iter_mut().enumerate() {
            let [to_opening, up] = [
                [0, 1, 2].map(|axis| self.origin[axis][lane] - position[axis]),
                [0, 1, 2].map(|axis| self.up[axis][lane]),
            ];
            *weight = self.power[lane] * weight_along(to_opening, up, self.radius[lane], normal);
        }
        weights
    }
}

/// Estimates the unoccluded illuminance from an opening at a surface per power, in 1/m2 and up to a constant factor; greater than 0
/// wherever there is any.
#[inline]
pub fn opening_weight(frame: &OpeningFrame, radius: f64, position: DVec3, normal: DVec3) -> f64 {
    weight_along((frame.origin - position).to_array(), frame.outward().to_array(), radius, normal)
}

/// Computes [`opening_weight`] by the vector to the opening's centre and the unit vector out of the room.
#[inline(always)]
fn weight_along([x, y, z]: [f64; 3], [up_x, up_y, up_z]: [f64; 3], radius: f64, normal: DVec3) -> f64 {
    let upright = normal.x * up_x + normal.y * up_y + normal.z * up_z;
    let reach = radius * (1.0 - upright * upright).max(0.0).sqrt();
    let squared = x * x + y * y + z * z + radius * radius;
    let facing = (x * normal.x + y * normal.y + z * normal.z + reach).max(0.0);
    let depth = (x * up_x + y * up_y + z * up_z).max(0.0);
    facing * depth / (squared * squared)
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::optics::Diffuser;
    use crate::scene::{Face, Scene};
    use crate::traceable::test_rooms::{compiled, empty, straight_tube};

    const CEILING: usize = Face::Ceiling as usize;

    /// Checks that the probability of each opening, of one and of many, is its share of all weights, and that the numbers that choose it make
    /// up this probability.
    #[test]
    fn openings_are_chosen_by_their_weights() {
        for count in [1, 7, 8, 700] {
            let mut scene: Scene = empty(DVec3::new(70.0, 10.0, 3.0), None);
            let tube = |number: u32| {
                let centre = DVec2::new(0.5 + f64::from(number % 69), 0.5 + f64::from(number / 69));
                straight_tube((CEILING, centre), [0.9; 3], Diffuser::Clear { transmittance: [0.9; 3] })
            };
            scene.tubes = (0..count).map(tube).collect();
            let tubes = &compiled(&scene).tubes;
            let powers: Vec<f64> = (0..count).map(|tube| f64::from(tube % 5 + u32::from(count == 1))).collect();
            let openings = Openings::new(tubes, powers.iter().copied());
            let (position, normal) = (DVec3::new(3.0, 4.0, 1.0), DVec3::new(0.6, 0.0, 0.8));
            let weight = |tube: usize| {
                powers[tube] * opening_weight(&tubes[tube].frame, tubes[tube].opening.outer_radius(), position, normal)
            };
            let all: f64 = (0..tubes.len()).map(weight).sum();
            let mut found = vec![0.0; tubes.len()];
            let numbers = 100_000;
            for number in 0..numbers {
                let number = (f64::from(number) + 0.5) / f64::from(numbers);
                let (tube, probability) = openings.choose(position, normal, number).unwrap();
                assert!((probability - weight(tube) / all).abs() < 1e-12, "{tube} of {count}");
                found[tube] += 1.0 / f64::from(numbers);
            }
            for (tube, found) in found.into_iter().enumerate() {
                assert!((found - weight(tube) / all).abs() < 2.0 / f64::from(numbers), "{tube} of {count}");
            }
        }
    }
}
