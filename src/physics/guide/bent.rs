//! Bent tubes: equal mirror cylinders that meet in mitred elbows.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

use super::transit::{End, Entry, Transit};
use crate::geometry::cylinder::{cosine_of_incidence, distance_to_wall, traverse};
use crate::optics::{Mirror, Spectrum};
use crate::sampling::warp;

/// Largest number of steps of one path that stops at walls and mitre planes one by one; the jumps between elbows count as one each.
const MAX_STEPS: u32 = 100_000;

/// Throughput below which a path is no longer followed: less than the rounding error of any sum.
const NEGLIGIBLE: f64 = 1e-18;

/// A bent guide: cylinders of one radius, from the opening upward.
///
/// Two successive cylinders meet on the ellipse in the plane that bisects their axes. A ray jumps over the bounces between the elbows in
/// closed form, and steps from wall to wall only where a mitre plane may be crossed (docs/physics/tubes.md#mitred-elbows).
#[derive(Clone, Debug, PartialEq)]
pub struct BentGuide {
    /// Radius of all cylinders in m.
    pub radius: f64,
    /// Reflectance of the wall, per bounce.
    pub reflectance: Mirror,
    /// Transmittance of the collector at every angle, linear Rec.709, 0..=1.
    pub collector_transmittance: [f64; 3],
    segments: Vec<Cylinder>,
    /// Normal of the upper end in the frame of the last segment, pointing out, scaled to z = 1.
    end: DVec3,
}

/// Surface that a ray inside a segment meets next.
enum Next {
    Wall,
    LowerEnd,
    UpperEnd,
}

/// A point of a ray's path through a tube.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoursePoint {
    /// Position in the frame of the tube, in m.
    pub position: DVec3,
    /// Number of reflections up to this point, its own included.
    pub bounces: u32,
}

/// One segment; its local frame has z along the axis and the origin in the centre of its lower end.
#[derive(Clone, Debug, PartialEq)]
struct Cylinder {
    origin: DVec3,
    to_local: DMat3,
    length: f64,
    /// Unit normals of the end planes in the local frame, both with z > 0.
    lower_normal: DVec3,
    upper_normal: DVec3,
    /// Heights in m between which (`free_from` to `free_to`) no ray meets an end plane.
    free_from: f64,
    free_to: f64,
}

impl Cylinder {
    /// Returns the surface that a ray from a point inside meets next, and the distance to it in m.
    #[inline]
    fn next(&self, radius: f64, p: DVec3, d: DVec3) -> (Next, f64) {
        let wall = distance_to_wall(radius, p, d);
        let toward_lower = d.dot(self.lower_normal);
        let toward_upper = d.dot(self.upper_normal);
        let lower =
            if toward_lower < 0.0 { (-p.dot(self.lower_normal) / toward_lower).max(0.0) } else { f64::INFINITY };
        let upper = if toward_upper > 0.0 {
            ((DVec3::Z * self.length - p).dot(self.upper_normal) / toward_upper).max(0.0)
        } else {
            f64::INFINITY
        };
        if wall < lower.min(upper) {
            (Next::Wall, wall)
        } else if lower <= upper {
            (Next::LowerEnd, lower)
        } else {
            (Next::UpperEnd, upper)
        }
    }

    fn to_tube(&self, point: DVec3) -> DVec3 {
        self.origin + self.to_local.transpose() * point
    }

    fn to_segment(&self, point: DVec3) -> DVec3 {
        self.to_local * (point - self.origin)
    }
}

/// Reflects a ray at the point `p` of the wall; returns its direction and the cosine of its angle from the wall's normal.
#[inline]
fn reflect(radius: f64, p: DVec3, d: DVec3) -> (DVec3, f64) {
    let normal = p.truncate() * (1.0 / radius);
    let cosine = d.truncate().dot(normal);
    (d - (normal * (2.0 * cosine)).extend(0.0), cosine)
}

impl BentGuide {
    /// Creates a guide from the `segments`, length in metres and unit axis of each, from the opening upward; the first axis is across
    /// the opening, no two successive axes are opposite, and every segment is long enough that its mitre ellipses do not meet.
    pub fn new(radius: f64, segments: &[(f64, DVec3)], reflectance: Mirror, collector_transmittance: [f64; 3]) -> Self {
        let mut origin = DVec3::ZERO;
        let mut cylinders = Vec::with_capacity(segments.len());
        for (index, &(length, axis)) in segments.iter().enumerate() {
            let neighbour = |other: Option<&(f64, DVec3)>| other.map_or(axis, |(_, other)| (axis + *other).normalize());
            let lower_world = if index == 0 { axis } else { neighbour(segments.get(index - 1)) };
            let upper_world = neighbour(segments.get(index + 1));
            let x = warp::around(axis, DVec3::X);
            let y = warp::around(axis, DVec3::Y);
            let to_local = DMat3::from_cols(x, y, axis).transpose();
            // a plane tilted by b/2 reaches r tan(b/2) along the axis
            let reach = |normal: DVec3| radius * normal.truncate().length() / normal.z;
            let (lower_normal, upper_normal) = (to_local * lower_world, to_local * upper_world);
            cylinders.push(Cylinder {
                origin,
                to_local,
                length,
                lower_normal,
                upper_normal,
                free_from: reach(lower_normal),
                free_to: length - reach(upper_normal),
            });
            origin += axis * length;
        }
        Self { radius, reflectance, collector_transmittance, segments: cylinders, end: DVec3::Z }
    }

    /// Returns the guide with its upper end cut by the plane through the end's centre with a unit `normal`, which points out, less than 90
    /// degrees from the last axis.
    pub fn cut(mut self, normal: DVec3) -> Self {
        if let Some(top) = self.segments.last_mut() {
            top.upper_normal = top.to_local * normal;
            self.end = top.upper_normal / top.upper_normal.z;
            top.free_to = top.length - self.radius * self.end.truncate().length();
        }
        self
    }

    /// True if the upper end is not across the axis.
    pub fn is_cut(&self) -> bool {
        self.end != DVec3::Z
    }

    /// Returns the centre of the upper end, and the rotation into a frame with z along the last axis.
    pub(super) fn upper_end(&self) -> (DVec3, DMat3) {
        let centre = |top: &Cylinder| top.origin + top.to_local.transpose() * (DVec3::Z * top.length);
        self.segments.last().map_or((DVec3::ZERO, DMat3::IDENTITY), |top| (centre(top), top.to_local))
    }

    #[inline]
    pub(super) fn entry(&self, point: [f64; 2], direction: DVec3) -> Option<Entry> {
        let top = self.segments.last()?;
        // of the whole end, relative to the area of the cylinder's section
        let cosine = -(top.to_local * direction).dot(self.end);
        (cosine > 0.0).then(|| {
            let across = warp::disc(point) * self.radius;
            let local = across.extend(top.length - across.dot(self.end.truncate()));
            Entry {
                position: top.origin + top.to_local.transpose() * local,
                projected_area_m2: PI * self.radius * self.radius * cosine,
            }
        })
    }

    pub(super) fn down<const C: usize>(&self, position: DVec3, direction: DVec3) -> Transit<C> {
        self.follow(position, direction, End::Top)
    }

    pub(super) fn up<const C: usize>(&self, position: DVec3, direction: DVec3) -> Transit<C> {
        self.follow(position, direction, End::Opening)
    }

    /// Traces the path of a ray from inside the upper end: its start, every reflection and every crossing of a plane between segments, and
    /// its exit; at most `most` points.
    pub fn course(&self, position: DVec3, direction: DVec3, most: usize) -> Vec<CoursePoint> {
        let mut course = vec![CoursePoint { position, bounces: 0 }];
        let Some(mut index) = self.segments.len().checked_sub(1) else { return course };
        let cylinder = &self.segments[index];
        let (mut p, mut d, mut bounces) = (cylinder.to_segment(position), cylinder.to_local * direction, 0);
        while course.len() < most {
            let cylinder = &self.segments[index];
            let (next, distance) = cylinder.next(self.radius, p, d);
            p += d * distance;
            if matches!(next, Next::Wall) {
                (d, _) = reflect(self.radius, p, d);
                bounces += 1;
            }
            let (world_p, world_d) = (cylinder.to_tube(p), cylinder.to_local.transpose() * d);
            course.push(CoursePoint { position: world_p, bounces });
            index = match next {
                Next::Wall => continue,
                Next::LowerEnd if index == 0 => break,
                Next::UpperEnd if index + 1 == self.segments.len() => break,
                Next::LowerEnd => index - 1,
                Next::UpperEnd => index + 1,
            };
            let cylinder = &self.segments[index];
            (p, d) = (cylinder.to_segment(world_p), cylinder.to_local * world_d);
        }
        course
    }

    /// Returns the transmittance of a number of crossings of the collector.
    #[inline]
    fn collected<const C: usize>(&self, crossings: i32) -> Spectrum<C> {
        Spectrum::from_rgb(self.collector_transmittance).map(|t| t.powi(crossings))
    }

    /// Returns the number of bounces beyond which the throughput is negligible; infinite for a perfect mirror.
    fn most_bounces(&self) -> f64 {
        let brightest = self.reflectance.brightest();
        if brightest < 1.0 { libm::log(NEGLIGIBLE) / libm::log(brightest) } else { f64::INFINITY }
    }

    /// Follows light into the guide from one of its ends, which are the same segment in a straight guide.
    fn follow<const C: usize>(&self, position: DVec3, direction: DVec3, from: End) -> Transit<C> {
        let from_top = from == End::Top;
        let mut index = if from_top { self.segments.len() - 1 } else { 0 };
        let mut cylinder = &self.segments[index];
        let mut p = cylinder.to_local * (position - cylinder.origin);
        let mut d = cylinder.to_local * direction;
        let mut bounces = 0.0;
        // throughput so far, where the reflectance differs from bounce to bounce
        let mut left = Spectrum::<C>::ONE;
        let by_angle = matches!(self.reflectance, Mirror::ByAngle(_));
        let most_bounces = self.most_bounces();
        let mut rays = 0;
        let end = loop {
            rays += 1;
            if bounces > most_bounces || (by_angle && left.max() < NEGLIGIBLE) {
                break End::Absorbed;
            }
            if rays > MAX_STEPS {
                break End::Cut;
            }
            if p.z >= cylinder.free_from && p.z <= cylinder.free_to && d.z != 0.0 {
                let axial = if d.z > 0.0 { cylinder.free_to - p.z } else { p.z - cylinder.free_from };
                if axial > 0.0 {
                    let passage = traverse(self.radius, p, d, axial);
                    if by_angle {
                        left *= self.reflectance.power(|| cosine_of_incidence(self.radius, p, d), passage.bounces);
                    }
                    (p, d) = (passage.position, passage.direction);
                    bounces += passage.bounces;
                }
            }
            let (next, distance) = cylinder.next(self.radius, p, d);
            p += d * distance;
            let neighbour = match next {
                Next::Wall => {
                    let cosine;
                    (d, cosine) = reflect(self.radius, p, d);
                    if by_angle {
                        left *= self.reflectance.power(|| cosine, 1.0);
                    }
                    bounces += 1.0;
                    continue;
                }
                Next::LowerEnd if index == 0 => break End::Opening,
                Next::UpperEnd if index + 1 == self.segments.len() => break End::Top,
                Next::LowerEnd => index - 1,
                Next::UpperEnd => index + 1,
            };
            let (world_p, world_d) = (cylinder.to_tube(p), cylinder.to_local.transpose() * d);
            index = neighbour;
            cylinder = &self.segments[index];
            (p, d) = (cylinder.to_segment(world_p), cylinder.to_local * world_d);
        };
        Transit {
            end,
            position: cylinder.to_tube(p),
            direction: cylinder.to_local.transpose() * d,
            // light that enters from outside and leaves at the top again passes the collector twice
            collector: self.collected(i32::from(from_top) + i32::from(end == End::Top)),
            mirrors: match (end, by_angle) {
                (End::Absorbed, _) => Spectrum::ZERO,
                (_, true) => left,
                (_, false) => self.reflectance.power(|| 1.0, bounces),
            },
            entered: true,
            rays,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::guide::StraightGuide;
    use crate::sampling::{Key, PathRandom};

    fn elbow(bend_deg: f64, reflectance: f64) -> BentGuide {
        let (sin, cos) = bend_deg.to_radians().sin_cos();
        let axes = [(0.5, DVec3::Z), (0.5, DVec3::new(sin, 0.0, cos))];
        BentGuide::new(0.127, &axes, [reflectance; 3].into(), [1.0; 3])
    }

    /// Checks that a bend of zero equals the straight tube: same bounces, same rays.
    #[test]
    fn no_bend_equals_straight() {
        let bent = elbow(0.0, 0.98);
        let straight = StraightGuide {
            radius: 0.127,
            length: 1.0,
            reflectance: [0.98; 3].into(),
            collector_transmittance: [1.0; 3],
        };
        let mut random = PathRandom::new(Key::new(2));
        for _ in 0..2000 {
            let d = -warp::cosine_hemisphere(random.uniform2());
            let entry = straight.entry(random.uniform2(), d).unwrap();
            let (a, b) = (bent.down::<1>(entry.position, d), straight.down::<1>(entry.position, d));
            assert_eq!(a.end, End::Opening);
            assert!((a.mirrors.0[0] - b.mirrors.0[0]).abs() < 1e-12);
            assert!((a.position - b.position).length() < 1e-9 && (a.direction - b.direction).length() < 1e-9);
        }
    }

    /// Checks that a cut across the axis changes nothing but roundings, and that an oblique one moves entry points along the axis into its plane.
    #[test]
    fn a_cut_across_the_axis_changes_nothing() {
        let axis = DVec3::new(0.6, 0.0, 0.8);
        let whole = BentGuide::new(0.127, &[(0.5, DVec3::Z), (0.5, axis)], [0.9; 3].into(), [1.0; 3]);
        let normal = DVec3::new(0.0, 0.6, 0.8);
        let (across, oblique) = (whole.clone().cut(axis), whole.clone().cut(normal));
        let end = DVec3::Z * 0.5 + axis * 0.5;
        let mut random = PathRandom::new(Key::new(5));
        for _ in 0..500 {
            let (d, point) = (-warp::cosine_hemisphere(random.uniform2()), random.uniform2());
            let entries = [&whole, &across, &oblique].map(|guide| guide.entry(point, d));
            if let [Some(entry), Some(across), _] = entries {
                assert!((entry.position - across.position).length() < 1e-14);
                assert!((entry.projected_area_m2 / across.projected_area_m2 - 1.0).abs() < 1e-12);
            }
            if let [Some(entry), _, Some(oblique)] = entries {
                assert!((oblique.position - end).dot(normal).abs() < 1e-14);
                assert!((oblique.position - entry.position).cross(axis).length() < 1e-14);
                let area = PI * 0.127 * 0.127 / normal.dot(axis);
                assert!((oblique.projected_area_m2 / (area * -d.dot(normal)) - 1.0).abs() < 1e-12);
            }
        }
        assert!(!whole.is_cut() && oblique.is_cut());
    }

    /// Checks that the path by steps ends where the closed form does, after as many reflections.
    #[test]
    fn a_course_ends_where_the_closed_form_does() {
        let guide = elbow(40.0, 0.9);
        let mut random = PathRandom::new(Key::new(4));
        let mut ends = [0; 2];
        for _ in 0..500 {
            let d = -warp::cosine_hemisphere(random.uniform2());
            let Some(entry) = guide.entry(random.uniform2(), d) else { continue };
            let course = guide.course(entry.position, d, 100_000);
            let transit = guide.down::<1>(entry.position, d);
            if transit.end == End::Absorbed {
                continue;
            }
            let last = course.last().unwrap();
            assert!((last.position - transit.position).length() < 1e-9, "{last:?} {transit:?}");
            assert!((transit.mirrors.0[0] / 0.9f64.powi(last.bounces as i32) - 1.0).abs() < 1e-9);
            ends[usize::from(transit.end == End::Top)] += 1;
        }
        assert!(ends[0] > 100 && ends[1] > 5, "{ends:?}");
        assert_eq!(guide.course(DVec3::Z, -DVec3::Z, 2).len(), 2);
    }

    /// Compares forward and back-reflected isotropic transmission with tests/reference/elbow_transmission.csv; both errors enter the
    /// tolerance of 4 standard errors.
    #[test]
    fn elbows_transmit_and_send_back() {
        let table = [
            (30.0, 1.0, 0.9673, 0.0326),
            (30.0, 0.98, 0.8422, 0.0248),
            (45.0, 0.95, 0.6635, 0.0475),
            (90.0, 1.0, 0.6696, 0.3304),
            (90.0, 0.98, 0.5648, 0.2964),
        ];
        let n = 100_000;
        for (bend, reflectance, forward, back) in table {
            let guide = elbow(bend, reflectance);
            let top = guide.segments[1].to_local.transpose();
            let (mut down, mut up) = (crate::statistics::Moments::default(), crate::statistics::Moments::default());
            let mut random = PathRandom::new(Key::new(11));
            for _ in 0..n {
                let d = -(top * warp::cosine_hemisphere(random.uniform2()));
                let entry = guide.entry(random.uniform2(), d).unwrap();
                let transit = guide.down::<1>(entry.position, d);
                let weight = transit.weight().0[0];
                down.push(if transit.end == End::Opening { weight } else { 0.0 });
                up.push(if transit.end == End::Top { weight } else { 0.0 });
            }
            let reference_error = 2.1e-4; // stderr and cut share of the reference
            for (moments, truth) in [(down, forward), (up, back)] {
                let tolerance = 4.0 * moments.standard_error().hypot(reference_error);
                assert!((moments.mean - truth).abs() < tolerance, "{bend} {reflectance}: {} {truth}", moments.mean);
            }
        }
    }

    /// Checks reciprocity: isotropic light passes an elbow of unequal arms as well from either end.
    #[test]
    fn elbows_are_reciprocal() {
        let (sin, cos) = 60f64.to_radians().sin_cos();
        let axis = DVec3::new(sin, 0.0, cos);
        let guide = BentGuide::new(0.127, &[(0.3, DVec3::Z), (0.8, axis)], [0.95; 3].into(), [1.0; 3]);
        let (mut down, mut up) = (crate::statistics::Moments::default(), crate::statistics::Moments::default());
        let mut random = PathRandom::new(Key::new(5));
        for _ in 0..100_000 {
            let local = warp::cosine_hemisphere(random.uniform2());
            let inward = -warp::around(axis, local);
            let entry = guide.entry(random.uniform2(), inward).unwrap();
            let transit = guide.down::<1>(entry.position, inward);
            down.push(if transit.end == End::Opening { transit.mirrors.0[0] } else { 0.0 });
            let start = (warp::disc(random.uniform2()) * 0.127).extend(0.0);
            let transit = guide.up::<1>(start, warp::cosine_hemisphere(random.uniform2()));
            up.push(if transit.end == End::Top { transit.mirrors.0[0] } else { 0.0 });
        }
        let tolerance = 4.0 * down.standard_error().hypot(up.standard_error());
        assert!((down.mean - up.mean).abs() < tolerance, "{} {} {tolerance}", down.mean, up.mean);
        assert!(down.mean < 0.7 && tolerance < 0.01);
    }
}
