//! Upright blocks around everything that stands or hangs in a room: they show where nothing can occlude, and which points of a plane are
//! in shadow.

use glam::{DVec2, DVec3};
use smallvec::SmallVec;

use super::block::{Block, ON_TARGET};
use super::box_bounds::BoxBounds;
use super::box_object::TraceableBox;
use super::enclosure::TraceableEnclosure;
use super::luminaire::TraceableLuminaire;
use super::mesh_bounds::blocks_around;
use super::tube::TraceableTube;
use crate::geometry::OpeningFrame;
use crate::geometry::placement::Placement;
use crate::scene::{Instances, MeshObject};

/// Upright blocks around boxes, meshes, hanging luminaires and openings, and faces that can occlude.
#[derive(Clone, Debug, Default)]
pub struct Obstacles {
    blocks: Vec<Block>,
    /// Bounds of the blocks, widened for lines to openings of up to a radius in m, and that radius; `None` where there is no opening.
    toward_openings: Option<(BoxBounds, f64)>,
}

impl Obstacles {
    /// Builds the blocks around all boxes, meshes and luminaires, around faces that can stand in between, and around openings that hang.
    pub fn new(
        boxes: &[TraceableBox],
        meshes: &[MeshObject],
        luminaires: &[TraceableLuminaire],
        enclosure: &TraceableEnclosure,
        tubes: &[TraceableTube],
    ) -> Self {
        let mut blocks = Vec::new();
        for (index, object) in boxes.iter().enumerate() {
            let [a, b, _, d] = object.outline();
            let (low, high) = object.span();
            let sides = DVec2::new((b - a).length(), (d - a).length());
            let along = (b - a).normalize_or(DVec2::X);
            blocks.push(Block { centre: 0.5 * (b + d), half: 0.5 * sides, along, low, high, of_box: Some(index) });
        }
        let copies = |of: &Instances| {
            let parts = blocks_around(&of.mesh);
            let at = |place: &Placement| parts.iter().map(|part| place.bounds(*part)).collect::<Vec<_>>();
            of.placements.iter().flat_map(at).collect::<Vec<_>>()
        };
        let parts = meshes
            .iter()
            .flat_map(|object| blocks_around(&object.mesh).into_iter().chain(object.instances.iter().flat_map(copies)));
        blocks.extend(parts.filter_map(|corners| Block::around(&corners)));
        blocks.extend(luminaires.iter().filter_map(|luminaire| Block::around(&luminaire.corners())));
        blocks.extend(enclosure.hiding().filter_map(|face| Block::around(&face.corners().collect::<Vec<_>>())));
        blocks.extend(tubes.iter().filter(|tube| tube.hangs).filter_map(|tube| {
            let reach = DVec2::splat(tube.opening.extent_along(DVec2::X)).extend(0.0);
            Block::around(&[tube.frame.origin - reach, tube.frame.origin + reach])
        }));
        let toward_openings = None;
        Self { blocks, toward_openings }.toward_openings(tubes, enclosure)
    }

    /// Adds the widened bounds that speed up queries about the openings of the room's tubes.
    fn toward_openings(self, tubes: &[TraceableTube], enclosure: &TraceableEnclosure) -> Self {
        let widest = tubes.iter().map(|tube| tube.opening.outer_radius()).reduce(f64::max);
        let [floor, _] = enclosure.bounds().map(|corner| corner.z);
        let lowest = tubes.iter().map(|tube| tube.frame.origin.z).fold(f64::INFINITY, f64::min);
        let spans = |radius: f64| -> Vec<_> {
            self.blocks.iter().map(|block| block.widened(radius, [floor, lowest])).collect()
        };
        let toward_openings = widest.map(|radius| (BoxBounds::new(&spans(radius), enclosure.scale_m()), radius));
        Self { toward_openings, ..self }
    }

    /// True if certainly nothing stands between any point within `reach` of `position`, at its height, and any point within `radius` of the
    /// centre of an opening before which it lies; box `but_for` is left out.
    pub fn leave_clear(
        &self,
        position: DVec3,
        reach: f64,
        but_for: Option<usize>,
        opening: &OpeningFrame,
        radius: f64,
    ) -> bool {
        let centre = opening.origin;
        let leaves_clear = |block: &Block| {
            let left_out = but_for.is_some() && block.of_box == but_for;
            left_out || block.leaves_opening_clear(position, reach, opening, radius)
        };
        match &self.toward_openings {
            Some((bounds, widest)) if reach == 0.0 && radius <= *widest && opening.is_level() => bounds
                .met(position, centre - position, 1.0)
                .into_iter()
                .all(|number| leaves_clear(&self.blocks[number])),
            _ => self.blocks.iter().all(leaves_clear),
        }
    }
}

/// Obstacles that may stand between a point and an opening.
#[derive(Clone, Debug)]
pub struct Between {
    from: DVec2,
    /// Shadows of boxes on the plane of a level opening.
    shadows: SmallVec<[Shadow; 4]>,
    /// True if something else may occlude, of which only the bounds are stored.
    pub is_more: bool,
}

impl Between {
    /// True if a box hides a point of the opening.
    #[inline]
    pub fn hides(&self, point: DVec2) -> bool {
        let away = point - self.from;
        self.shadows.iter().any(|shadow| shadow.hides(away.x, away.y))
    }
}

/// The shadow of a block on a horizontal plane, by light from one point below or above it.
///
/// On the segments from the light to all points of the plane, the block's heights span the same range of fractions. That part of a
/// segment, seen from above, is met by the block unless one of three axes separates them (Ericson 2005, section 5.3.3, without the
/// vertical one).
#[derive(Clone, Copy, Debug)]
pub struct Shadow {
    /// Position of the light in the frame of the block.
    start: DVec2,
    half: DVec2,
    along: DVec2,
    /// Middle of the range of fractions at which a segment passes the block's heights; `reach` is half of its length.
    middle: f64,
    reach: f64,
    /// Bounds of the shadow: distances in m to the north of the light.
    pub north: [f64; 2],
    /// True if the block is only the bounds of the object that casts the shadow.
    pub is_bound: bool,
}

impl Shadow {
    /// True if the block hides the light from the point of the plane at this distance from the light to the east and north, in m.
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
    /// Finds the obstacles that may stand between a point and any point within `radius` of the centre of an opening before which it lies.
    pub fn between(&self, position: DVec3, opening: &OpeningFrame, radius: f64) -> Between {
        let centre = opening.origin;
        let mut between = Between { from: position.truncate(), shadows: SmallVec::new(), is_more: false };
        let mut add = |block: &Block| {
            if !block.leaves_opening_clear(position, 0.0, opening, radius) {
                match block.is_bound() || !opening.is_level() {
                    true => between.is_more = true,
                    false => between.shadows.extend(block.shadow(position, centre.z)),
                }
            }
        };
        match &self.toward_openings {
            Some((bounds, widest)) if radius <= *widest && opening.is_level() => {
                let met = bounds.met(position, centre - position, 1.0);
                met.into_iter().for_each(|number| add(&self.blocks[number]));
            }
            _ => self.blocks.iter().for_each(add),
        }
        between
    }

    /// Finds the shadows that light from `position` casts on the horizontal plane at `height`; box `but_for`, from which the light comes,
    /// casts none.
    pub fn shadows(&self, position: DVec3, height: f64, but_for: Option<usize>) -> impl Iterator<Item = Shadow> {
        let others = self.blocks.iter().filter(move |block| but_for.is_none() || block.of_box != but_for);
        others.filter_map(move |block| block.shadow(position, height))
    }
}

impl Block {
    fn shadow(&self, position: DVec3, height: f64) -> Option<Shadow> {
        let depth = position.z - height;
        let is_bound = self.is_bound();
        // the object inside a bound may be flat
        let hair = if is_bound { ON_TARGET * (depth.abs() + self.half.length()) } else { 0.0 };
        let fraction = |z: f64| ((position.z - z) / depth).clamp(0.0, 1.0 - ON_TARGET);
        let (of_top, of_base) = (fraction(self.high + hair), fraction(self.low - hair));
        let (enters, leaves) = (of_top.min(of_base), of_top.max(of_base));
        if depth == 0.0 || leaves <= enters {
            return None;
        }
        let away = position.truncate() - self.centre;
        let half = self.half + hair;
        // the shadow of a point is the farther away the nearer to the light the ray passes it
        let wide =
            (self.along.y.abs() * half.x + self.along.x.abs() * half.y) * (1.0 + ON_TARGET) + ON_TARGET * depth.abs();
        let (south, north) = (-away.y - wide, -away.y + wide);
        Some(Shadow {
            start: DVec2::new(away.dot(self.along), self.along.perp_dot(away)),
            half,
            along: self.along,
            middle: 0.5 * (enters + leaves),
            reach: 0.5 * (leaves - enters),
            north: [
                if south < 0.0 { south / enters } else { south / leaves },
                if north > 0.0 { north / enters } else { north / leaves },
            ],
            is_bound,
        })
    }

    /// Returns the lowest and highest corner of the axis-aligned block around this one.
    fn bounds(&self) -> [DVec3; 2] {
        let (along, half) = (self.along.abs(), self.half);
        let wide = DVec2::new(along.x * half.x + along.y * half.y, along.y * half.x + along.x * half.y);
        [(self.centre - wide).extend(self.low), (self.centre + wide).extend(self.high)]
    }

    /// Returns bounds of the block that are widened for a disc of `radius` at the height `opening` or above it: where any line from a
    /// point above the `floor` to the disc meets the block, the line from that point to the disc's centre meets these bounds.
    fn widened(&self, radius: f64, [floor, opening]: [f64; 2]) -> [DVec3; 2] {
        let [low, high] = self.bounds();
        // the lower the block, the less lines to the disc have spread
        let by = DVec2::splat(radius * ((high.z - floor) / (opening - floor)).clamp(0.0, 1.0)).extend(0.0);
        [low - by, high + by]
    }

    /// Returns the smallest axis-aligned block around some points; `None` without points.
    fn around(points: &[DVec3]) -> Option<Self> {
        let low = points.iter().copied().reduce(DVec3::min)?;
        let high = points.iter().copied().reduce(DVec3::max)?;
        let (centre, half) = (0.5 * (low + high).truncate(), 0.5 * (high - low).truncate());
        Some(Self { centre, half, along: DVec2::X, low: low.z, high: high.z, of_box: None })
    }

    /// True if no line from points within `reach` of `position` to points within `radius` of the centre of an opening meets the block.
    fn leaves_opening_clear(&self, position: DVec3, reach: f64, opening: &OpeningFrame, radius: f64) -> bool {
        if opening.is_level() {
            return self.leaves_clear(position, reach, opening.origin, radius);
        }
        // all such lines lie within the larger of the two distances from the line between the centres
        let [low, high] = self.bounds();
        let wide = DVec3::splat(reach.max(radius));
        let (low, high) = (low - wide - position, high + wide - position);
        let along = opening.origin - position;
        let (mut enter, mut leave) = (0f64, 1f64);
        for axis in 0..3 {
            if along[axis] == 0.0 {
                if low[axis] > 0.0 || high[axis] < 0.0 {
                    return true;
                }
                continue;
            }
            let (one, other) = (low[axis] / along[axis], high[axis] / along[axis]);
            (enter, leave) = (enter.max(one.min(other)), leave.min(one.max(other)));
        }
        enter > leave
    }

    /// True if no line between points within `reach` of `position` and a level disc meets the block: seen from above, all such lines at
    /// the block's heights lie within some distance of one line.
    fn leaves_clear(&self, position: DVec3, reach: f64, centre: DVec3, radius: f64) -> bool {
        let depth = centre.z - position.z;
        if self.high <= position.z || self.low >= centre.z || depth <= 0.0 {
            return true;
        }
        let fraction = |height: f64| ((height - position.z) / depth).clamp(0.0, 1.0);
        let (from, to) = (fraction(self.low), fraction(self.high));
        let width = |fraction: f64| fraction * radius + (1.0 - fraction) * reach;
        let reached = self.half + width(from).max(width(to));
        let at = |fraction: f64| {
            let away = position.truncate().lerp(centre.truncate(), fraction) - self.centre;
            DVec2::new(away.dot(self.along), self.along.perp_dot(away))
        };
        let (start, end) = (at(from), at(to));
        // fractions of the line within the widened block
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

    fn room(size: DVec3) -> TraceableEnclosure {
        TraceableEnclosure::new(&crate::scene::Enclosure::cuboid(size, [None; 6]))
    }

    /// A point of a plane below or above the light is in shadow exactly where a ray from it to the light meets the box.
    #[test]
    fn shadows_are_those_of_rays() {
        let mut random = PathRandom::new(Key::new(4));
        let mut hidden = [0; 2];
        for number in 0..6000 {
            let is_above = number % 2;
            let mut uniform = |low: f64, high: f64| low + (high - low) * random.uniform();
            let base = DVec3::new(uniform(0.5, 2.5), uniform(0.5, 2.5), uniform(0.0, 0.5));
            let size = DVec3::new(uniform(0.1, 0.8), uniform(0.1, 0.8), uniform(0.1, 1.0));
            let surface = crate::optics::Surface::diffuse([0.5; 3]);
            let object = BoxObject { size, base, rotation: uniform(0.0, 7.0), surface };
            let object = TraceableBox::new(&object);
            let position = DVec3::new(uniform(0.0, 3.0), uniform(0.0, 3.0), uniform(0.2, 2.0));
            let height = uniform(0.0, 0.8) + f64::from(is_above);
            let sensor = DVec3::new(uniform(0.0, 3.0), uniform(0.0, 3.0), height);
            if (position.z <= height) != (is_above == 1) || object.contains(sensor) || object.contains(position) {
                continue;
            }
            let met = object.intersect(sensor, position - sensor).is_some_and(|(fraction, ..)| fraction < 1.0);
            let (dx, dy) = (sensor.x - position.x, sensor.y - position.y);
            let all = Obstacles::new(&[object], &[], &[], &room(DVec3::splat(3.0)), &[]);
            let within = |shadow: &Shadow| shadow.north[0] <= dy && dy <= shadow.north[1];
            let mut shadows = all.shadows(position, height, None);
            let in_shadow = shadows.any(|shadow| shadow.hides(dx, dy) && within(&shadow));
            assert_eq!(in_shadow, met, "{:?} {position} {sensor}", all.blocks[0]);
            assert!(all.shadows(position, height, Some(0)).next().is_none());
            hidden[is_above as usize] += usize::from(met);
        }
        assert!(hidden.iter().all(|hidden| *hidden > 50), "{hidden:?}");
    }

    /// Every ray from a point reaches a disc that is called clear from there. The filter by bounds calls clear at least all discs that
    /// are called clear without it.
    #[test]
    fn clear_discs_are_seen_whole() {
        let size = DVec3::new(3.0, 3.0, 2.5);
        let mut random = PathRandom::new(Key::new(6));
        let mut counts = [0; 2];
        let surface = crate::optics::Surface::diffuse([0.5; 3]);
        for _ in 0..3000 {
            let mut uniform = |low: f64, high: f64| low + (high - low) * random.uniform();
            let boxes: Vec<TraceableBox> = (0..3)
                .map(|_| {
                    let base = DVec3::new(uniform(0.5, 2.5), uniform(0.5, 2.5), uniform(0.0, 0.5));
                    let size = DVec3::new(uniform(0.1, 0.8), uniform(0.1, 0.8), uniform(0.1, 1.5));
                    TraceableBox::new(&BoxObject { size, base, rotation: uniform(0.0, 7.0), surface })
                })
                .collect();
            let position = DVec3::new(uniform(0.0, 3.0), uniform(0.0, 3.0), uniform(0.0, 1.0));
            let (centre, radius) = (DVec3::new(uniform(0.5, 2.5), uniform(0.5, 2.5), size.z), uniform(0.05, 0.4));
            if boxes.iter().any(|object| object.contains(position)) {
                continue;
            }
            let obstacles = Obstacles::new(&boxes, &[], &[], &room(size), &[]);
            let spans: Vec<_> = obstacles.blocks.iter().map(|block| block.widened(radius, [0.0, size.z])).collect();
            let filtered = Obstacles {
                toward_openings: Some((BoxBounds::new(&spans, size.length()), radius)),
                ..obstacles.clone()
            };
            let clear = obstacles.leave_clear(position, 0.0, None, &OpeningFrame::level(centre), radius);
            let filtered = filtered.leave_clear(position, 0.0, None, &OpeningFrame::level(centre), radius);
            assert!(filtered || !clear);
            let mut reaches = || {
                let point = centre + (warp::disc(random.uniform2()) * radius).extend(0.0);
                boxes.iter().all(|object| object.intersect(position, point - position).is_none_or(|(t, ..)| t >= 1.0))
            };
            let seen = (0..50).filter(|_| reaches()).count();
            assert!(!filtered || seen == 50, "{position} {centre} {radius} {boxes:?}");
            counts[usize::from(filtered)] += 1;
        }
        assert!(counts.iter().all(|count| *count > 50), "{counts:?}");
    }

    /// A disc is called clear only where no line from the points to the disc meets the block; and much is called clear.
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
