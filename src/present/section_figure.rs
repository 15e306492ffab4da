//! Section of a job: a vertical plane through its room and most of its tubes, with what it cuts and sample paths of the light.

use glam::{DVec2, DVec3};

use super::light_paths::{Drawn, Lit, SideView, light_paths};
use super::mesh_outlines;
use super::subject::Subject;
use crate::document::errors::Checks;
use crate::document::outputs::GridDocument;
use crate::document::room::RoomDocument;
use crate::document::room::object::ObjectDocument;
use crate::document::tube::collector::CollectorDocument;
use crate::document::tube::opening::PlacedOpening;
use crate::document::tube::{ParametricTube, TubeDocument};
use crate::document::{JobDocument, Provenance};
use crate::figure::section::{Cover, Section, SideObject, SideTube};
use crate::figure::ticks::short;
use crate::geometry::OpeningFrame;
use crate::geometry::covered::{Edge, polygon};
use crate::scene::Enclosure;
use crate::sky::direction;

/// Distance in m from the plane of a section within which it goes through the centre of an opening that stands along it.
const LEAST_CUT_M: f64 = 1e-9;

/// Vertical plane of a section.
#[derive(Clone, Copy)]
struct Plane {
    /// Horizontal unit vector in the plane: x or y.
    along: DVec2,
    /// Coordinate of the plane across it, in metres.
    at: f64,
}

/// Builds the section along an axis of the room, given with its name, in the plane that goes through the most tubes. `kept` has of each tube
/// the fractions of the light at its collector that arrive at its diffuser and in the room, where they are known.
pub fn section(
    subject: &Subject,
    document: &JobDocument,
    (provenance, kept): (Option<&Provenance>, &[Option<[f64; 2]>]),
    (along, name): (DVec2, &'static str),
) -> Section {
    let enclosure = document.room.enclosure(&mut Checks::default());
    let plane = Plane::through(document, along);
    let faces = enclosure.as_ref().map_or(&[][..], Enclosure::faces);
    let rings = faces.iter().flat_map(|face| face.polygon.rings());
    let room: Vec<Vec<DVec2>> = rings.map(|ring| ring.iter().map(|corner| plane.seen(*corner)).collect()).collect();
    let cuts = faces.iter().flat_map(|face| face.polygon.cut(plane.across().extend(0.0), plane.at));
    let cut: Vec<Edge> = cuts.map(|edge| edge.map(|end| plane.seen(end))).collect();
    let objects = plane.objects(&document.room);
    let of_objects = objects.iter().filter(|object| object.is_cut).flat_map(|object| polygon(&object.outline));
    let [of_mesh_objects, of_mesh_tubes] = [true, false].map(|objects| plane.cut_meshes(subject, objects));
    let obstacles: Vec<Edge> = cut.iter().chain(&of_mesh_objects).copied().chain(of_objects).collect();
    let objects = objects.into_iter().chain(plane.meshes_beside(subject)).collect();
    let cut = [cut, of_mesh_objects, of_mesh_tubes].concat();
    let frame_of = |tube: &TubeDocument| frame_of(tube, enclosure.as_ref());
    let sun = provenance.and_then(|provenance| provenance.sun).filter(|sun| sun.on);
    let position = sun.and_then(|sun| sun.position_deg()).filter(|[altitude_deg, _]| *altitude_deg > 0.0);
    let toward_sun = position.map(|[altitude_deg, azimuth_deg]| {
        direction(altitude_deg.to_radians(), (azimuth_deg - document.room.rotation_deg).to_radians())
    });
    let has_light = document.sky.is_some() || document.annual.is_some();
    let lit = document.tubes.iter().enumerate().filter_map(|(number, tube)| match tube {
        TubeDocument::Parametric(of_cylinders) if has_light && plane.cuts(tube, &frame_of(tube)) => {
            let side = SideView { along, obstacles: &obstacles, opening: frame_of(tube) };
            let of_sky = Drawn::Sky(kept.get(number).copied().flatten());
            Some(light_paths(of_cylinders, &side, toward_sun.map_or(of_sky, Drawn::Sun)))
        }
        TubeDocument::Parametric(_) | TubeDocument::Mesh(_) => None,
    });
    let lit: Vec<Lit> = lit.collect();
    let angles = lit.iter().filter_map(|lit| lit.from_axis).map(f64::to_degrees);
    let of_sky = angles.fold(None, |ends: Option<[f64; 2]>, angle| {
        Some(ends.map_or([angle; 2], |[least, most]| [least.min(angle), most.max(angle)]))
    });
    let light: Vec<_> = lit.into_iter().flat_map(|lit| lit.paths).collect();
    let tubes = document.tubes.iter().map(|tube| {
        let (frame, shape) = (frame_of(tube), tube.opening().shape);
        // along the line in which the plane of the section cuts that of the opening
        let toward = plane.across().extend(0.0).cross(frame.outward()).normalize_or(along.extend(0.0));
        let toward = if toward.dot(along.extend(0.0)) < 0.0 { -toward } else { toward };
        let (mouth, is_cut) = (shape.extent_in(&frame, toward) * plane.seen(toward), plane.cuts(tube, &frame));
        match tube {
            TubeDocument::Parametric(of_cylinders) => {
                SideTube { mouth, is_cut, ..side_of(of_cylinders, &plane, &frame) }
            }
            TubeDocument::Mesh(_) => {
                let (axis, radius) = (vec![plane.seen(frame.origin)], shape.outer_radius());
                SideTube { axis, radius, mouth, cover: Cover::Open, is_cut }
            }
        }
    });
    let level = |grid: &GridDocument| Some((grid.name.clone(), grid.height_m?));
    let of_light = match of_sky {
        _ if light.is_empty() => String::new(),
        None => " · lines: sunlight".to_owned(),
        Some(ends) => {
            let [least, most] = ends.map(|angle| format!("{angle:.0}°"));
            let angle = if least == most { least } else { format!("{least} to {most}") };
            format!(" · lines: skylight from {angle} beside the tube's axis")
        }
    };
    let (across, seen) = if along == DVec2::X { ("y", "seen from −y") } else { ("x", "seen from +x") };
    let at = short((plane.at * 100.0).round() / 100.0);
    let heading = subject.heading(
        format!("Section along {name}, {}", subject.name()),
        vec![
            subject.circumstances(),
            format!("cut at {across} = {at} m, {seen} · thin or dashed: before or behind the cut{of_light}"),
        ],
    );
    Section {
        heading,
        across: name,
        tubes: tubes.collect(),
        objects,
        grids: document.grids.iter().filter_map(level).collect(),
        room,
        cut,
        light,
        sun: toward_sun.map(|toward| DVec2::new(along.dot(toward.truncate()), toward.z)),
    }
}

/// Returns the frame of the opening of a tube; on the floor where the room is not known.
fn frame_of(tube: &TubeDocument, enclosure: Option<&Enclosure>) -> OpeningFrame {
    let opening = enclosure.and_then(|room| PlacedOpening::of(tube, room));
    opening.map_or_else(|| OpeningFrame::level(tube.opening().centre.extend(0.0)), |opening| opening.frame)
}

impl Plane {
    /// Finds the plane through the most tubes of a job (of equal ones that of the first), or through the middle of a room without tubes.
    fn through(document: &JobDocument, along: DVec2) -> Self {
        let [low, high] = document.room.bounds_m().map(DVec3::truncate);
        let middle = Self { along, at: 0.0 }.across().dot(low.midpoint(high));
        let enclosure = document.room.enclosure(&mut Checks::default());
        let frames: Vec<_> = document.tubes.iter().map(|tube| (tube, frame_of(tube, enclosure.as_ref()))).collect();
        let planes = frames.iter().map(|(_, frame)| {
            let plane = Self { along, at: Self { along, at: 0.0 }.across().dot(frame.origin.truncate()) };
            (frames.iter().filter(|(other, frame)| plane.cuts(other, frame)).count(), plane)
        });
        let best = planes.reduce(|best, other| if other.0 > best.0 { other } else { best });
        best.map_or(Self { along, at: middle }, |(_, plane)| plane)
    }

    /// Returns the horizontal unit vector across the plane: y or x.
    fn across(&self) -> DVec2 {
        DVec2::new(self.along.y, self.along.x)
    }

    /// Returns a point of the room as the section shows it.
    fn seen(&self, point: DVec3) -> DVec2 {
        DVec2::new(self.along.dot(point.truncate()), point.z)
    }

    /// True if the plane goes through the opening of a tube.
    fn cuts(&self, tube: &TubeDocument, frame: &OpeningFrame) -> bool {
        let across = self.across().extend(0.0);
        (across.dot(frame.origin) - self.at).abs() < tube.opening().shape.extent_in(frame, across).max(LEAST_CUT_M)
    }

    /// Returns the boxes and the partitions of a room: their sections, or their outlines where the plane does not cut them.
    fn objects(&self, room: &RoomDocument) -> Vec<SideObject> {
        let boxes = room.objects.iter().filter_map(|object| match object {
            ObjectDocument::Box(object) => {
                let bottom = object.position_m[2];
                Some(self.upright(&object.footprint(), [bottom, bottom + object.size_m[2]]))
            }
            ObjectDocument::Mesh(_) => None,
        });
        let partitions = room.partitions.iter();
        let partitions = partitions
            .map(|sheet| self.upright(&[DVec2::from(sheet.from_m), DVec2::from(sheet.to_m)], [0.0, sheet.height_m]));
        boxes.chain(partitions).collect()
    }

    /// Returns the lines in which the plane cuts the meshes of objects, or those of tubes.
    fn cut_meshes(&self, subject: &Subject, objects: bool) -> Vec<Edge> {
        let across = self.across().extend(0.0);
        let edges = subject.meshes.iter().flat_map(|meshes| mesh_outlines::cuts(meshes, objects, across, self.at));
        edges.map(|edge| edge.map(|end| self.seen(end))).collect()
    }

    /// Returns the outlines of the pieces of meshes that the plane does not cut.
    fn meshes_beside(&self, subject: &Subject) -> Vec<SideObject> {
        let across = self.across().extend(0.0);
        let is_cut = |piece: &Vec<DVec3>| {
            let beyond = |corner: &DVec3| corner.dot(across) > self.at;
            piece.iter().any(beyond) && !piece.iter().all(beyond)
        };
        let pieces = subject.meshes.iter().flat_map(mesh_outlines::object_pieces).filter(|piece| !is_cut(piece));
        let outline = |piece: Vec<DVec3>| mesh_outlines::hull(piece.into_iter().map(|corner| self.seen(corner)));
        pieces.map(|piece| SideObject { outline: outline(piece), is_cut: false }).collect()
    }

    /// Returns the side of an upright body or sheet with these corners in plan, and its lower and upper end in metres.
    fn upright(&self, plan: &[DVec2], [bottom, top]: [f64; 2]) -> SideObject {
        let beyond = |corner: DVec2| self.across().dot(corner) - self.at;
        let crossings = polygon(plan).into_iter().filter_map(|[a, b]| {
            let (from, to) = (beyond(a), beyond(b));
            ((from > 0.0) != (to > 0.0)).then(|| a.lerp(b, from / (from - to)))
        });
        let crossings: Vec<DVec2> = crossings.collect();
        let is_cut = !crossings.is_empty();
        let places = if is_cut { &crossings[..] } else { plan };
        let along = places.iter().map(|place| self.along.dot(*place));
        let [left, right] =
            along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)]);
        let outline = [(left, bottom), (right, bottom), (right, top), (left, top)].map(DVec2::from).to_vec();
        SideObject { outline, is_cut }
    }
}

/// Returns the side view of a tube of cylinders, as if it were not cut, with the mouth of its pipe along the section.
fn side_of(tube: &ParametricTube, plane: &Plane, opening: &OpeningFrame) -> SideTube {
    let mut axis = vec![plane.seen(opening.origin)];
    for (segment, lean) in tube.segments.iter().zip(tube.axes(opening.outward())) {
        axis.extend(axis.last().map(|last| *last + segment.length_m * plane.seen(lean)));
    }
    let cover = match tube.collector {
        CollectorDocument::Open => Cover::Open,
        CollectorDocument::Flat(_) => Cover::Flat,
        CollectorDocument::Dome(_) | CollectorDocument::DielectricDome(_) => Cover::Dome,
    };
    let radius = 0.5 * tube.diameter_m;
    SideTube { axis, radius, mouth: radius * DVec2::X, cover, is_cut: false }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::present::subject::tests::document;

    /// Light of the first tube ends at the table below it, and not at that beside the cut; the second tube is not cut.
    #[test]
    fn a_section_is_cut_at_tubes_and_objects() {
        let mut document = document();
        let mut second = document["tubes"][0].clone();
        second["centre_m"] = json!([3.0, 5.0]);
        document["tubes"].as_array_mut().unwrap().push(second);
        let table = |y: f64| {
            json!({ "kind": "box", "size_m": [1.0, 1.0, 0.7], "position_m": [1.5, y, 0.0], "rotation_deg": 45.0,
                    "surface": { "reflectance": 0.5 } })
        };
        document["room"]["objects"] = json!([table(1.5), table(4.0)]);
        let subject = Subject::new(&document, &json!(null));
        let section = section(&subject, subject.document.as_ref().unwrap(), (None, &[]), (DVec2::X, "x"));
        assert!(section.heading.lines[1].starts_with("cut at y = 1.5 m, seen from −y"), "{:?}", section.heading);
        assert_eq!(section.tubes.iter().map(|tube| tube.is_cut).collect::<Vec<_>>(), [true, false]);
        assert_eq!(section.objects.iter().map(|object| object.is_cut).collect::<Vec<_>>(), [true, false]);
        assert_eq!(section.cut.len(), 4, "floor, ceiling and two walls");
        // the section of the table through its middle is a diagonal
        let width = section.objects[0].outline[1].x - section.objects[0].outline[0].x;
        assert!((width - 2.0f64.sqrt()).abs() < 1e-12, "{width}");
        let ends = section.light.iter().filter_map(|path| path.0.last()).map(|point| point.at);
        let below: Vec<DVec2> = ends.filter(|end| (end.x - 1.5).abs() < 0.7 && end.y < 2.0).collect();
        assert!(!below.is_empty() && below.iter().all(|end| (end.y - 0.7).abs() < 1e-12), "{below:?}");
    }
}
