//! What stands or hangs in a room, each thing in an upright block around it: to tell where nothing can stand in between.

use glam::{DVec2, DVec3};

use super::box_object::TraceableBox;
use super::luminaire::TraceableLuminaire;
use crate::scene::MeshObject;

/// The blocks around boxes, meshes and hanging luminaires.
#[derive(Debug, Default)]
pub struct Obstacles(Vec<Block>);

/// An upright block, turned about the vertical.
#[derive(Debug)]
struct Block {
    centre: DVec2,
    half: DVec2,
    /// Unit vector along its first side.
    along: DVec2,
    low: f64,
    high: f64,
    /// The box that it is.
    of_box: Option<usize>,
}

impl Obstacles {
    /// Bounding volumes of all boxes, meshes and luminaires.
    pub fn new(boxes: &[TraceableBox], meshes: &[MeshObject], luminaires: &[TraceableLuminaire]) -> Self {
        let mut blocks = Vec::new();
        for (index, object) in boxes.iter().enumerate() {
            let [a, b, _, d] = object.outline();
            let (low, high) = object.span();
            let sides = DVec2::new((b - a).length(), (d - a).length());
            let along = (b - a).normalize_or(DVec2::X);
            blocks.push(Block { centre: 0.5 * (b + d), half: 0.5 * sides, along, low, high, of_box: Some(index) });
        }
        blocks.extend(meshes.iter().filter_map(|object| Block::around(&object.mesh.positions)));
        blocks.extend(luminaires.iter().filter_map(|luminaire| Block::around(&luminaire.corners())));
        Self(blocks)
    }

    /// True if certainly nothing stands between any point within `reach` of `position`, at its height, and any point of
    /// a disc of `radius` around `centre` in the ceiling; box `but_for` is left out.
    pub fn leave_clear(&self, position: DVec3, reach: f64, but_for: Option<usize>, centre: DVec3, radius: f64) -> bool {
        self.0.iter().all(|block| {
            let left_out = but_for.is_some() && block.of_box == but_for;
            left_out || block.leaves_clear(position, reach, centre, radius)
        })
    }
}

impl Block {
    /// Smallest block along the axes around some points; `None` without points.
    fn around(points: &[DVec3]) -> Option<Self> {
        let low = points.iter().copied().reduce(DVec3::min)?;
        let high = points.iter().copied().reduce(DVec3::max)?;
        let (centre, half) = (0.5 * (low + high).truncate(), 0.5 * (high - low).truncate());
        Some(Self { centre, half, along: DVec2::X, low: low.z, high: high.z, of_box: None })
    }

    /// Seen from above, what joins point and disc at the block's heights lies within some distance of a line.
    fn leaves_clear(&self, position: DVec3, reach: f64, centre: DVec3, radius: f64) -> bool {
        let depth = centre.z - position.z;
        if self.high <= position.z || depth <= 0.0 {
            return true;
        }
        let share = |height: f64| ((height - position.z) / depth).clamp(0.0, 1.0);
        let (from, to) = (share(self.low), share(self.high));
        let width = |share: f64| share * radius + (1.0 - share) * reach;
        let reached = self.half + width(from).max(width(to));
        let at = |share: f64| {
            let away = position.truncate().lerp(centre.truncate(), share) - self.centre;
            DVec2::new(away.dot(self.along), self.along.perp_dot(away))
        };
        let (start, end) = (at(from), at(to));
        // shares of the line within the widened block
        let (mut enter, mut leave) = (0f64, 1f64);
        for axis in 0..2 {
            let (a, step) = (start[axis], end[axis] - start[axis]);
            if step == 0.0 {
                if a.abs() > reached[axis] {
                    return true;
                }
                continue;
            }
            let (one, other) = ((-reached[axis] - a) / step, (reached[axis] - a) / step);
            (enter, leave) = (enter.max(one.min(other)), leave.min(one.max(other)));
        }
        enter > leave
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Key, PathRandom, warp};

    /// Wherever a way is called clear, no line from the point to the disc meets the block; and much is called clear.
    #[test]
    fn what_is_called_clear_is_clear() {
        let mut random = PathRandom::new(Key::new(3));
        let mut clear = 0;
        for _ in 0..2000 {
            let mut uniform = |low: f64, high: f64| low + (high - low) * random.uniform();
            let turn = uniform(0.0, 3.0);
            let block = Block {
                centre: DVec2::new(uniform(0.5, 2.5), uniform(0.5, 2.5)),
                half: DVec2::new(uniform(0.1, 0.5), uniform(0.1, 0.5)),
                along: DVec2::from_angle(turn),
                low: uniform(0.0, 0.5),
                high: uniform(0.5, 2.0),
                of_box: None,
            };
            let position = DVec3::new(uniform(0.0, 3.0), uniform(0.0, 3.0), uniform(0.0, 2.0));
            let (centre, radius) = (DVec3::new(uniform(0.5, 2.5), uniform(0.5, 2.5), 2.5), uniform(0.05, 0.4));
            let reach = uniform(0.0, 0.3);
            if !block.leaves_clear(position, reach, centre, radius) {
                continue;
            }
            clear += 1;
            for _ in 0..50 {
                let start = position + (warp::disc(random.uniform2()) * reach).extend(0.0);
                let end = centre + (warp::disc(random.uniform2()) * radius).extend(0.0);
                for step in 0..=100 {
                    let point = start.lerp(end, f64::from(step) / 100.0);
                    let away = point.truncate() - block.centre;
                    let local = DVec2::new(away.dot(block.along), block.along.perp_dot(away));
                    let inside = local.abs().cmplt(block.half).all() && point.z > block.low && point.z < block.high;
                    assert!(!inside, "{block:?} {position} {centre} {radius} {reach}");
                }
            }
        }
        assert!(clear > 1000, "{clear}");
    }
}
