//! Sample paths of light in a tube, as lines for a section: their course from wall to wall, and the fraction of the light that is left.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use crate::document::tube::ParametricTube;
use crate::document::tube::collector::CollectorDocument;
use crate::figure::section::{LightPath, PathPoint};
use crate::geometry::OpeningFrame;
use crate::geometry::covered::Edge;
use crate::guide::BentGuide;
use crate::guide::bent::CoursePoint;
use crate::optics::Spectrum;
use crate::optics::scatter::{Scatter, SheetSide};

/// Starting points of lines in the mouth of a tube, in radii from its axis.
const PLACES: [f64; 5] = [-0.8, -0.4, 0.0, 0.4, 0.8];

/// Starting points of lines of light from the sky, in radii from the axis; each has two directions.
const PLACES_OF_SKY: [f64; 3] = [-0.6, 0.0, 0.6];

/// Angles in radians from the axis of the directions in which scattered light is drawn.
const SCATTERED: [f64; 5] = [-1.05, -0.5, 0.0, 0.5, 1.05];

/// Angle in radians from the tube's axis of the light of the sky that is drawn where no fluxes are known: 26 degrees.
const FROM_AXIS: f64 = 0.45;

/// Angles in radians among which that of the light of the sky is chosen: every half degree up to 80.
const STEP_FROM_AXIS: f64 = PI / 360.0;
const MOST_STEPS: usize = 160;

/// Fraction of the light by which angles are as good as the best one.
const NEAR: f64 = 0.01;

/// Largest number of points of a line: light that still continues then has met hundreds of walls.
const MOST_POINTS: usize = 300;

/// Least way to an obstacle, in steps of a line: the opening lies in the ceiling.
const NEAREST: f64 = 1e-9;

/// Fraction of the light below which a line ends.
const LEAST_SHARE: f64 = 0.005;

/// Room below a tube as a section shows it.
#[derive(Clone, Copy, Debug)]
pub struct SideView<'a> {
    /// Horizontal unit vector of the section.
    pub along: DVec2,
    /// Lines in metres at which light ends: faces and objects in the plane of the section.
    pub obstacles: &'a [Edge],
    /// Centre and plane of the tube's opening.
    pub opening: OpeningFrame,
}

/// Light that a section draws.
#[derive(Clone, Copy, Debug)]
pub enum Drawn {
    /// Light of the sun, toward which the vector points.
    Sun(DVec3),
    /// Light of the sky, with the fractions of the light at the collector that arrive at the diffuser and in the room, where they are known.
    Sky(Option<[f64; 2]>),
}

/// Lines of light, and the angle from the tube's axis in radians of those of the sky.
#[derive(Clone, Debug, Default)]
pub struct Lit {
    /// Lines through the tube, then those below its diffuser.
    pub paths: Vec<LightPath>,
    /// Angle of skylight; `None` for light of the sun, and without lines.
    pub from_axis: Option<f64>,
}

/// Traces lines of light through a tube into the room. Those of the sky come at the angle at which as much of them arrives at the diffuser as of
/// the sky's whole light, and have below it what that has. Returns no lines for domes that refract the light.
pub fn light_paths(tube: &ParametricTube, side: &SideView<'_>, light: Drawn) -> Lit {
    let collector = match &tube.collector {
        CollectorDocument::DielectricDome(_) => return Lit::default(),
        other => other.collector().transmittance(),
    };
    let axes = tube.axes(side.opening.outward());
    let axes: Vec<(f64, DVec3)> = tube.segments.iter().map(|segment| segment.length_m).zip(axes).collect();
    let Some((_, last)) = axes.last() else { return Lit::default() };
    let top: DVec3 = axes.iter().map(|(length, axis)| *length * *axis).sum();
    let mirror = tube.reflectance.mirror();
    let reflectance = mirror.brightest();
    let guide = BentGuide::new(0.5 * tube.diameter_m, &axes, mirror, collector);
    // across the mouth, as near to the plane of the section as it comes
    let level = side.along.extend(0.0);
    let across = (level - level.dot(*last) * *last).normalize_or_zero();
    let lean = |angle: f64| -(libm::cos(angle) * *last + libm::sin(angle) * across);
    let scene = Lines { side, tube, reflectance, entering: Spectrum::<1>::from_rgb(collector).0[0] };
    let courses = |directions: &[DVec3], places: &[f64]| -> Vec<Vec<CoursePoint>> {
        let entering = directions.iter().filter(|light| light.dot(*last) < 0.0);
        let from = |light: &DVec3| {
            let light = *light;
            places.iter().map(move |place| (top + *place * guide.radius * across, light)).collect::<Vec<_>>()
        };
        entering.flat_map(from).map(|(start, light)| guide.course(start, light, MOST_POINTS)).collect()
    };
    let of_sky = |angle: f64| courses(&[lean(angle), lean(-angle)], &PLACES_OF_SKY);
    let (courses, from_axis) = match light {
        Drawn::Sun(sun) => (courses(&[-sun], &PLACES), None),
        Drawn::Sky(None) => (of_sky(FROM_AXIS), Some(FROM_AXIS)),
        Drawn::Sky(Some([at_diffuser, _])) => {
            let differs = |angle: f64| {
                let courses = of_sky(angle);
                let arriving: f64 = courses.iter().map(|course| scene.arriving(course)).sum();
                (arriving / courses.len().max(1) as f64 - at_diffuser).abs()
            };
            let angles = (1..=MOST_STEPS).map(|step| step as f64 * STEP_FROM_AXIS);
            let found: Vec<(f64, f64)> = angles.map(|angle| (differs(angle), angle)).collect();
            let least = found.iter().fold(f64::INFINITY, |least, (differs, _)| least.min(*differs));
            // bends give the same light to several angles
            let angle =
                found.iter().find(|(differs, _)| *differs <= least + NEAR).map_or(FROM_AXIS, |(_, angle)| *angle);
            (of_sky(angle), Some(angle))
        }
    };
    let (mut paths, mut diffused) = (Vec::new(), Vec::new());
    for course in &courses {
        let (path, left) = scene.path(course);
        paths.push(path);
        diffused.push(left);
    }
    let diffused = diffused.iter().sum::<f64>() / diffused.len().max(1) as f64;
    let through = tube.closure_shape.map_or(1.0, |shape| shape.transition_transmittance);
    let below = match light {
        // a clear closure scatters nothing
        Drawn::Sky(Some([_, into_room])) if diffused > 0.0 => into_room,
        _ => through * diffused,
    };
    paths.extend(scene.scattered(below));
    Lit { from_axis: from_axis.filter(|_| !paths.is_empty()), paths }
}

/// Properties that the lines of one tube have in common.
struct Lines<'a> {
    side: &'a SideView<'a>,
    tube: &'a ParametricTube,
    /// Reflectance of the wall per bounce, at its brightest angle and colour.
    reflectance: f64,
    /// Fraction that enters through the collector.
    entering: f64,
}

impl Lines<'_> {
    fn place(&self, position: DVec3) -> DVec2 {
        let centre = self.side.opening.origin;
        let along = |place: DVec3| self.side.along.dot(place.truncate());
        DVec2::new(along(centre) + along(position), centre.z + position.z)
    }

    /// Returns the fraction of a ray's light that is left after a number of bounces.
    fn left(&self, bounces: u32) -> f64 {
        self.entering * libm::pow(self.reflectance, f64::from(bounces))
    }

    /// Returns the fraction of a ray's light that arrives at the closure; 0 where it went back up, or is still on its way.
    fn arriving(&self, course: &[CoursePoint]) -> f64 {
        course.last().filter(|last| last.position.z <= 1e-9).map_or(0.0, |last| self.left(last.bounces))
    }

    /// Returns the line of a ray, as long as enough of its light is left, and the fraction that the diffuser scatters.
    fn path(&self, course: &[CoursePoint]) -> (LightPath, f64) {
        let share = |bounces: u32| self.left(bounces);
        let point = |point: &CoursePoint| PathPoint { at: self.place(point.position), share: share(point.bounces) };
        let points: Vec<PathPoint> = course.iter().map(point).take_while(|point| point.share >= LEAST_SHARE).collect();
        let path = LightPath(points);
        let [.., before, last] = course else { return (path, 0.0) };
        // it went back up, has faded, or is still on its way
        if path.0.len() < course.len() || self.side.opening.up(last.position) > 1e-9 {
            return (path, 0.0);
        }
        let arriving = share(last.bounces);
        let diffuser = self.tube.diffuser.diffuser();
        let opening = &self.side.opening;
        let place = opening.levelled_direction(last.position).truncate();
        let closure = diffuser.at(place.length()).turned(opening.turn());
        let from = (before.position - last.position).normalize_or_zero();
        match closure.unscattered::<1>() {
            Some(Spectrum([passed])) => (self.onward(path, before, last, arriving * passed), 0.0),
            None => {
                let Spectrum([passed]) = Scatter::<1>::albedo(&closure, from, SheetSide::Other);
                (path, arriving * passed)
            }
        }
    }

    /// Continues a line straight into the room.
    fn onward(&self, mut path: LightPath, before: &CoursePoint, last: &CoursePoint, share: f64) -> LightPath {
        let (from, to) = (self.place(before.position), self.place(last.position));
        if let Some(end) = self.end_in_room(to, to - from) {
            path.0.extend([PathPoint { at: to, share }, PathPoint { at: end, share }]);
        }
        path
    }

    /// Returns the unit vector in the section along which the opening faces, as far as it is seen.
    fn facing(&self) -> DVec2 {
        let normal = self.side.opening.normal();
        DVec2::new(self.side.along.dot(normal.truncate()), normal.z).normalize_or(DVec2::NEG_Y)
    }

    /// Returns lines from the middle of the opening into the room, each with the fraction that the diffuser sends into the room.
    fn scattered(&self, share: f64) -> Vec<LightPath> {
        let from = self.place(DVec3::ZERO);
        let scattered = SCATTERED.iter().filter(|_| share >= LEAST_SHARE).filter_map(|angle| {
            let facing = self.facing();
            let end = self.end_in_room(from, libm::sin(*angle) * facing.perp() + libm::cos(*angle) * facing)?;
            Some(LightPath(vec![PathPoint { at: from, share }, PathPoint { at: end, share }]))
        });
        scattered.collect()
    }

    /// Finds the point where a line from the opening first meets an obstacle; `None` where it does not go into the room.
    fn end_in_room(&self, from: DVec2, toward: DVec2) -> Option<DVec2> {
        let meets = |[a, b]: &Edge| {
            let (edge, to_edge) = (*b - *a, *a - from);
            let across = toward.perp_dot(edge);
            let (distance, share) = (to_edge.perp_dot(edge) / across, to_edge.perp_dot(toward) / across);
            (across != 0.0 && distance > NEAREST && (0.0..=1.0).contains(&share)).then_some(distance)
        };
        let distances = self.side.obstacles.iter().filter_map(meets);
        let nearest = distances.min_by(f64::total_cmp).filter(|_| toward.dot(self.facing()) > 0.0);
        nearest.map(|distance| from + distance * toward)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::sky::direction;

    fn tube(diffuser: serde_json::Value, tilt_deg: f64) -> ParametricTube {
        serde_json::from_value(json!({
            "centre_m": [1.5, 1.0], "diameter_m": 0.4, "reflectance": 0.9,
            "segments": [{ "length_m": 1.0 }, { "length_m": 1.0, "tilt_deg": tilt_deg, "azimuth_deg": 90 }],
            "collector": { "kind": "flat", "transmittance": 0.8 }, "diffuser": diffuser
        }))
        .unwrap()
    }

    /// Floor, two walls and the ceiling of a room of 4 m x 3 m.
    const ROOM: [Edge; 4] = [
        [DVec2::ZERO, DVec2::new(4.0, 0.0)],
        [DVec2::new(4.0, 0.0), DVec2::new(4.0, 3.0)],
        [DVec2::new(4.0, 3.0), DVec2::new(0.0, 3.0)],
        [DVec2::new(0.0, 3.0), DVec2::ZERO],
    ];

    const SIDE: SideView<'static> =
        SideView { along: DVec2::X, obstacles: &ROOM, opening: OpeningFrame::level(DVec3::new(1.5, 1.0, 3.0)) };

    /// Light along the axis of a straight tube meets no wall: all of it passes the pane, and half of it the diffuser.
    #[test]
    fn light_straight_down_loses_what_pane_and_diffuser_keep() {
        let lambertian = tube(json!({ "kind": "lambertian", "transmittance": 0.5 }), 0.0);
        let paths = light_paths(&lambertian, &SIDE, Drawn::Sun(DVec3::Z)).paths;
        assert_eq!(paths.len(), PLACES.len() + SCATTERED.len());
        let straight = &paths[2].0;
        assert_eq!(straight[0].at, DVec2::new(1.5, 5.0));
        assert_eq!(straight.last().unwrap().at, DVec2::new(1.5, 3.0));
        assert!(straight.iter().all(|point| (point.share - 0.8).abs() < 1e-12));
        let scattered = &paths[PLACES.len() + 2].0;
        assert!((scattered[1].at - DVec2::new(1.5, 0.0)).length() < 1e-12 && (scattered[1].share - 0.4).abs() < 1e-12);
    }

    /// Light below an opening ends on a table top.
    #[test]
    fn light_ends_at_objects() {
        let table = [ROOM.to_vec(), vec![[DVec2::new(0.0, 0.7), DVec2::new(4.0, 0.7)]]].concat();
        let side = SideView { obstacles: &table, ..SIDE };
        let lambertian = tube(json!({ "kind": "lambertian", "transmittance": 0.5 }), 0.0);
        let paths = light_paths(&lambertian, &side, Drawn::Sun(DVec3::Z)).paths;
        let below = paths[PLACES.len()..].iter().map(|path| path.0[1].at);
        assert!(below.clone().count() == SCATTERED.len() && below.into_iter().all(|end| end.y > 0.7 - 1e-12));
        assert!((paths[PLACES.len() + 2].0[1].at - DVec2::new(1.5, 0.7)).length() < 1e-12);
    }

    /// Walls take a tenth each; a clear closure lets light pass on to the floor or a wall.
    #[test]
    fn walls_take_their_share_and_clear_closures_let_light_on() {
        let clear = tube(json!({ "kind": "clear", "transmittance": 0.5 }), 30.0);
        let sun = direction(0.8, 1.2);
        let paths = light_paths(&clear, &SIDE, Drawn::Sun(sun)).paths;
        assert_eq!(paths.len(), PLACES.len());
        for path in &paths {
            assert!(path.0.windows(2).all(|pair| pair[1].share <= pair[0].share), "{path:?}");
            let last = path.0.last().unwrap();
            let on_edge = last.at.y.abs() < 1e-9 || last.at.x.abs() < 1e-9 || (last.at.x - 4.0).abs() < 1e-9;
            assert!(on_edge || last.at.y > 3.0, "{last:?}");
        }
        let below = tube(json!({ "kind": "open" }), 30.0);
        // from below the horizon of the mouth nothing enters
        assert!(light_paths(&below, &SIDE, Drawn::Sun(direction(0.1, 4.7))).paths.is_empty());
        assert!(!light_paths(&below, &SIDE, Drawn::Sky(None)).paths.is_empty());
    }

    /// A pane that passes 0.8 and bounces that keep 0.9 each: 0.8 x 0.9^2 arrive after two bounces, and the diffuser sends on what is known.
    #[test]
    fn light_of_the_sky_has_what_all_of_it_has() {
        let lambertian = tube(json!({ "kind": "lambertian", "transmittance": 0.5 }), 0.0);
        let lit = light_paths(&lambertian, &SIDE, Drawn::Sky(Some([0.8 * 0.81, 0.3])));
        let (through, below) = lit.paths.split_at(2 * PLACES_OF_SKY.len());
        let arriving = through.iter().map(|path| path.0.last().unwrap().share).sum::<f64>() / through.len() as f64;
        assert!((arriving - 0.648).abs() < 0.02, "{arriving}");
        // two bounces take between one width and three of a pipe of 2 m by 0.4 m
        let slope = libm::tan(lit.from_axis.unwrap());
        assert!(slope > 0.2 && slope < 0.6, "{slope}");
        assert!(below.len() == SCATTERED.len() && below.iter().all(|path| path.0[0].share == 0.3));
    }
}
