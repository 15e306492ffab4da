//! Plan of a room: outline, objects, openings of tubes, lengths of walls, and an arrow to north.

use glam::{DVec2, DVec3};

use super::axes::Axes;
use super::colour::{BLACK, Colour, WHITE};
use super::drawing::{Anchor, Drawing, Line, Type};
use super::labels::{Taken, half_size};
use super::outline::{Outline, Part, Rectangle};
use super::ticks::short;
use crate::geometry::OpeningFrame;
use crate::geometry::covered::{enclosed_area, polygon};
use crate::scene::OpeningShape;

/// Shortest wall whose length is written beside it, in pixels.
const LEAST_MEASURED: f64 = 30.0;

/// Size in pixels of the squares along a partition that labels keep clear of.
const PARTITION_STEP: f64 = 4.0;

/// Contents of a plan of a room.
#[derive(Clone, Debug, PartialEq)]
pub struct RoomPlan {
    /// Outlines (counter-clockwise) and holes (clockwise) of the floor in metres.
    pub rings: Vec<Vec<DVec2>>,
    /// Azimuth of the y axis (drawn upwards), clockwise from north in degrees.
    pub rotation_deg: f64,
    /// Openings of tubes: frame in metres, and shape.
    pub tubes: Vec<(OpeningFrame, OpeningShape)>,
    /// Outlines of objects in metres.
    pub objects: Vec<Vec<DVec2>>,
}

impl RoomPlan {
    /// Returns the plan of a rectangle, without tubes and objects.
    pub fn rectangle(from: DVec2, to: DVec2) -> Self {
        let corners = vec![from, DVec2::new(to.x, from.y), to, DVec2::new(from.x, to.y)];
        Self { rings: vec![corners], rotation_deg: 0.0, tubes: Vec::new(), objects: Vec::new() }
    }

    /// Returns the least and the greatest corner of the bounds in metres.
    pub fn bounds(&self) -> [DVec2; 2] {
        let corners = || self.rings.iter().flatten().copied();
        [corners().fold(DVec2::INFINITY, DVec2::min), corners().fold(DVec2::NEG_INFINITY, DVec2::max)]
    }

    /// Covers the parts of a rectangle that lie outside of all outlines or in a hole of one.
    pub fn cover_outside(&self, drawing: &mut Drawing, axes: &Axes, place: Rectangle) {
        let (outlines, holes): (Vec<_>, Vec<_>) = self.rings.iter().partition(|ring| is_outline(ring.as_slice()));
        if outlines.is_empty() {
            return;
        }
        // y points down in the figure, where outlines run against the rectangle, so that the windings cancel inside
        let mut cover = Outline::rectangle(place.from, place.to);
        cover.0.extend(outlines.into_iter().flat_map(|ring| Outline::polygon(ring_at(ring, axes)).0));
        drawing.fill(cover, Colour::Paper, 1.0);
        for hole in holes {
            drawing.fill(Outline::polygon(ring_at(hole, axes)), Colour::Faint, 1.0);
        }
    }

    /// Draws objects and openings of tubes.
    pub fn draw_objects_and_tubes(&self, drawing: &mut Drawing, axes: &Axes) {
        for object in &self.objects {
            let outline = Outline::polygon(object.iter().map(|point| axes.at(point.x, point.y)));
            drawing.line(outline.clone(), Line::new(WHITE, 3.0));
            drawing.line(outline, Line::new(BLACK, 1.2).dashed(&[5.0, 3.0]));
        }
        let scale = metre(axes);
        for (frame, opening) in &self.tubes {
            let place = |away: DVec2| (frame.origin + frame.direction_in_room(away.extend(0.0))).truncate();
            let at = |place: DVec2| axes.at(place.x, place.y);
            let centre = at(frame.origin.truncate());
            let radius = opening.outer_radius();
            let outline = match opening.corners() {
                Some(corners) => Outline::polygon(ring_at(&corners.map(place), axes)),
                None if frame.is_level() => Outline::circle(centre, radius * scale),
                None => {
                    Outline::ellipse(centre, [DVec2::X, DVec2::Y].map(|toward| at(place(radius * toward)) - centre))
                }
            };
            drawing.line(outline.clone(), Line::new(WHITE, 4.0));
            drawing.line(outline, Line::new(BLACK, 2.0));
        }
    }

    /// Draws the walls.
    pub fn draw_outline(&self, drawing: &mut Drawing, axes: &Axes) {
        for ring in &self.rings {
            drawing.line(Outline::polygon(ring_at(ring, axes)), Line::new(Colour::Ink, 2.0));
        }
    }

    /// Writes the lengths of the outer walls beside them, outside of the room; those along the left and the lower end are read from the axes.
    pub fn draw_lengths(&self, drawing: &mut Drawing, axes: &Axes, taken: &mut Taken) {
        let [low, _] = self.bounds();
        let within = Rectangle { from: DVec2::ZERO, to: drawing.size };
        for ring in self.rings.iter().filter(|ring| is_outline(ring)) {
            for (from, to) in ring.iter().zip(ring.iter().cycle().skip(1)) {
                let lies_at_an_axis = (0..2).any(|axis| from[axis] == to[axis] && from[axis] == low[axis]);
                let (a, b) = (axes.at(from.x, from.y), axes.at(to.x, to.y));
                if lies_at_an_axis || a.distance(b) < LEAST_MEASURED {
                    continue;
                }
                // to the right of the edge; y points down in the figure
                let out = (b - a).normalize().perp();
                let look = Type::new(11.0, Colour::Muted).rimmed(Colour::Paper);
                let look = if out.x.abs() > 0.9 { look.upwards() } else { look };
                let text = format!("{} m", short((from.distance(*to) * 100.0).round() / 100.0));
                let aside = 3.0 + half_size(&text, look).dot(out.abs());
                let places = [0.5, 0.35, 0.65].map(|share| a.lerp(b, share) + aside * out);
                taken.write(drawing, &within, (&text, look), places.into_iter());
            }
        }
    }

    /// Takes the places of the tubes' rings.
    pub fn take_tubes(&self, axes: &Axes, taken: &mut Taken) {
        for (frame, opening) in &self.tubes {
            let (at, half) = (axes.at(frame.origin.x, frame.origin.y), extent(frame, opening) * metre(axes) + 2.0);
            taken.add(Rectangle { from: at - half, to: at + half });
        }
    }

    /// Takes the places along partitions, which are objects of two corners.
    pub fn take_partitions(&self, axes: &Axes, taken: &mut Taken) {
        for object in &self.objects {
            if let [from, to] = object[..] {
                let [from, to] = [from, to].map(|end| axes.at(end.x, end.y));
                let steps = (from.distance(to) / PARTITION_STEP).ceil().max(1.0) as usize;
                for step in 0..=steps {
                    let at = from.lerp(to, step as f64 / steps as f64);
                    taken.add(Rectangle { from: at - 0.5 * PARTITION_STEP, to: at + 0.5 * PARTITION_STEP });
                }
            }
        }
    }

    /// Writes the numbers of the tubes, counted from 1, beside their openings, where there is room.
    pub fn draw_tube_numbers(&self, drawing: &mut Drawing, axes: &Axes, taken: &mut Taken) {
        let look = Type::new(12.0, BLACK).rimmed(WHITE);
        for (index, (frame, opening)) in self.tubes.iter().enumerate() {
            let at = axes.at(frame.origin.x, frame.origin.y);
            let number = (index + 1).to_string();
            // no bare number, which would be the value of a line
            for text in [format!("tube {number}"), format!("#{number}")] {
                let aside = half_size(&text, look) + extent(frame, opening) * metre(axes) + 3.0;
                let places = [DVec2::Y, -DVec2::Y, DVec2::X, -DVec2::X].map(|side| at + side * aside);
                if taken.write(drawing, &axes.within, (&text, look), places.into_iter()) {
                    break;
                }
            }
        }
    }
}

/// Returns the length of a metre in a figure, in pixels.
fn metre(axes: &Axes) -> f64 {
    axes.within.size().x / (axes.x.to - axes.x.from)
}

/// True if a ring is an outline: it runs counter-clockwise.
fn is_outline(ring: &[DVec2]) -> bool {
    enclosed_area(&polygon(ring)) > 0.0
}

fn ring_at(ring: &[DVec2], axes: &Axes) -> Vec<DVec2> {
    ring.iter().map(|corner| axes.at(corner.x, corner.y)).collect()
}

/// Draws an arrow toward north; `rotation_deg`: azimuth of the direction that is drawn upwards.
pub fn draw_north(drawing: &mut Drawing, centre: DVec2, rotation_deg: f64) {
    let (sin, cos) = libm::sincos(-rotation_deg.to_radians());
    // clockwise seen from above
    let turned = |x: f64, y: f64| centre + DVec2::new(x * cos + y * sin, x * sin - y * cos);
    let arrow = Outline(vec![
        Part::Move(turned(0.0, 20.0)),
        Part::Line(turned(7.0, -12.0)),
        Part::Line(turned(0.0, -6.0)),
        Part::Line(turned(-7.0, -12.0)),
        Part::Close,
    ]);
    drawing.fill(arrow, Colour::Ink, 1.0);
    let letter = Type::new(12.0, Colour::Ink).anchored(Anchor::Middle);
    drawing.text_centred(turned(0.0, 29.0), "N", letter);
}

/// Returns half of the extents of an opening in plan along x and y in metres.
fn extent(frame: &OpeningFrame, opening: &OpeningShape) -> DVec2 {
    DVec2::new(opening.extent_in(frame, DVec3::X), opening.extent_in(frame, DVec3::Y))
}
