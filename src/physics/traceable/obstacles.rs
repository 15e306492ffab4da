//! What stands or hangs in a room, each thing in an upright block around it: to tell where nothing can stand in between, and
//! which points of a plane are in the shadow.

use glam::{DVec2, DVec3};

use super::box_object::TraceableBox;
use super::luminaire::TraceableLuminaire;
use crate::scene::MeshObject;

/// Share of a segment's end within which a box counts as touched, not as in between: a sensor on a table sees the room.
pub(super) const ON_TARGET: f64 = 1e-9;

/// The blocks around boxes, meshes and hanging luminaires.
#[derive(Clone, Debug, Default)]
pub struct Obstacles(Vec<Block>);

/// An upright block, turned about the vertical.
#[derive(Clone, Debug)]
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

/// The shadow of a block on a horizontal plane, by light from one point.
///
/// On the way to any point of the plane the light is at the block's heights over the same share of the way. That part of it is
/// a segment, seen from above, and is met by the block unless one of three axes separates them (Ericson 2005, section 5.3.3,
/// without the vertical one).
#[derive(Clone, Copy, Debug)]
pub struct Shadow {
    /// Where the light comes from, in the frame of the block.
    start: DVec2,
    half: DVec2,
    along: DVec2,
    /// Middle of the share of the way, and half of its length.
    middle: f64,
    reach: f64,
    /// The block is no more than the bounds of what throws the shadow.
    pub is_bound: bool,
}

impl Shadow {
    /// True if it hides the light from the point of the plane at this distance to the east and north, in m.
    #[inline(always)]
    pub fn hides(&self, dx: f64, dy: f64) -> bool {
        let (u, v) = (self.along.x * dx + self.along.y * dy, self.along.x * dy - self.along.y * dx);
        let (mx, my) = (self.start.x + self.middle * u, self.start.y + self.middle * v);
        let (hx, hy) = (self.reach * u, self.reach * v);
        let (ax, ay) = (hx.abs(), hy.abs());
        // no short circuits: sensors go through it side by side
        (mx.abs() < self.half.x + ax)
            & (my.abs() < self.half.y + ay)
            & ((mx * hy - my * hx).abs() < self.half.x * ay + self.half.y * ax)
    }
}

impl Obstacles {
    /// The shadows that light from `position` throws on a plane below it; box `but_for`, which it comes from, throws none.
    pub fn shadows(&self, position: DVec3, height: f64, but_for: Option<usize>) -> impl Iterator<Item = Shadow> {
        let others = self.0.iter().filter(move |block| but_for.is_none() || block.of_box != but_for);
        others.filter_map(move |block| block.shadow(position, height))
    }
}

impl Block {
    fn shadow(&self, position: DVec3, height: f64) -> Option<Shadow> {
        let depth = position.z - height;
        let is_bound = self.of_box.is_none();
        // what a bound is drawn around may be flat
        let hair = if is_bound { ON_TARGET * (depth + self.half.length()) } else { 0.0 };
        let share = |z: f64| ((position.z - z) / depth).clamp(0.0, 1.0 - ON_TARGET);
        let (enters, leaves) = (share(self.high + hair), share(self.low - hair));
        if depth <= 0.0 || leaves <= enters {
            return None;
        }
        let away = position.truncate() - self.centre;
        Some(Shadow {
            start: DVec2::new(away.dot(self.along), self.along.perp_dot(away)),
            half: self.half + hair,
            along: self.along,
            middle: 0.5 * (enters + leaves),
            reach: 0.5 * (leaves - enters),
            is_bound,
        })
    }

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
    use crate::scene::BoxObject;

    /// Points of a plane are in the shadow where a ray from them meets the box.
    #[test]
    fn shadows_are_those_of_rays() {
        let mut random = PathRandom::new(Key::new(4));
        let mut hidden = 0;
        for _ in 0..3000 {
            let mut uniform = |low: f64, high: f64| low + (high - low) * random.uniform();
            let base = DVec3::new(uniform(0.5, 2.5), uniform(0.5, 2.5), uniform(0.0, 0.5));
            let size = DVec3::new(uniform(0.1, 0.8), uniform(0.1, 0.8), uniform(0.1, 1.0));
            let surface = crate::optics::Surface::diffuse([0.5; 3]);
            let object = BoxObject { size, base, rotation: uniform(0.0, 7.0), surface };
            let object = TraceableBox::new(&object);
            let position = DVec3::new(uniform(0.0, 3.0), uniform(0.0, 3.0), uniform(0.2, 2.0));
            let height = uniform(0.0, 0.8);
            let sensor = DVec3::new(uniform(0.0, 3.0), uniform(0.0, 3.0), height);
            if position.z <= height || object.contains(sensor) || object.contains(position) {
                continue;
            }
            let met = object.intersect(sensor, position - sensor).is_some_and(|(share, ..)| share < 1.0);
            let (dx, dy) = (sensor.x - position.x, sensor.y - position.y);
            let all = Obstacles::new(&[object], &[], &[]);
            let in_shadow = all.shadows(position, height, None).any(|shadow| shadow.hides(dx, dy));
            assert_eq!(in_shadow, met, "{:?} {position} {sensor}", all.0[0]);
            assert!(all.shadows(position, height, Some(0)).next().is_none());
            hidden += usize::from(met);
        }
        assert!(hidden > 100, "{hidden}");
    }

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
