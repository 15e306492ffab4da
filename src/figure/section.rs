//! Vertical section through a room, its roof and its tubes, seen from the south or from the east.

use glam::DVec2;

use super::axes::{self, Axes, Axis, beyond_ends, ticks_in};
use super::colour::{Colour, SERIES};
use super::drawing::{Anchor, Drawing, Line, Type};
use super::heading::Heading;
use super::outline::{Outline, Part, Rectangle};
use super::scale::{BAR_WIDTH, ColourScale, Palette};
use super::ticks::Steps;
use crate::geometry::covered::{Edge, enclosed_area, polygon};

/// Largest width and height of the section in pixels.
const MOST: DVec2 = DVec2::new(640.0, 560.0);

/// Widths in pixels of the lines of no light and of all light.
const THINNEST: f64 = 0.6;
const THICKEST: f64 = 2.2;

/// Height in pixels of the colour bar for the remaining fraction of the light, and of its title above it.
const BAR_HEIGHT: f64 = 120.0;
const BAR_TITLE: f64 = 24.0;

/// Height in pixels of the arrow from the sun with its name.
const SUN_HEIGHT: f64 = 126.0;

/// Title of the upright axis.
const HEIGHT_TITLE: &str = "height in metres";

/// Tube from the side, in metres: x to the right, y up from the floor.
#[derive(Clone, Debug, PartialEq)]
pub struct SideTube {
    /// Points of the axis, from the opening outwards.
    pub axis: Vec<DVec2>,
    /// Radius of the pipe in metres.
    pub radius: f64,
    /// Way from the axis to the rim of the closure in metres; along x above a level opening.
    pub mouth: DVec2,
    /// Cover of the upper end.
    pub cover: Cover,
    /// True if the plane of the section goes through the tube; others are drawn thin.
    pub is_cut: bool,
}

/// Object from the side.
#[derive(Clone, Debug, PartialEq)]
pub struct SideObject {
    /// Outline in metres: its section where it is cut, else its outline before or behind the section.
    pub outline: Vec<DVec2>,
    /// True if the plane of the section goes through the object.
    pub is_cut: bool,
}

/// Cover of the upper end of a tube.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cover {
    /// No cover.
    Open,
    /// Flat pane.
    Flat,
    /// Hemispherical dome.
    Dome,
}

/// Point of a light path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathPoint {
    /// Position in metres: x to the right, y up from the floor.
    pub at: DVec2,
    /// Fraction of the light that remains from here on, 0..1.
    pub share: f64,
}

/// Light path with the remaining fraction of the light along it.
#[derive(Clone, Debug, PartialEq)]
pub struct LightPath(pub Vec<PathPoint>);

/// Section of a room with its tubes, ready to be drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// Title and lines above the figure.
    pub heading: Heading,
    /// Name of the axis that runs to the right.
    pub across: &'static str,
    /// Faces of the room in metres, each a polygon seen from the side.
    pub room: Vec<Vec<DVec2>>,
    /// Lines in metres along which the plane of the section cuts the faces.
    pub cut: Vec<Edge>,
    /// Tubes seen from the side.
    pub tubes: Vec<SideTube>,
    /// Objects seen from the side.
    pub objects: Vec<SideObject>,
    /// Heights of grids above the floor in metres, with their names.
    pub grids: Vec<(String, f64)>,
    /// Light paths.
    pub light: Vec<LightPath>,
    /// Direction to the sun projected onto the plane of the section (right, up); shorter than 1 where the sun is not in the
    /// plane.
    pub sun: Option<DVec2>,
}

impl Section {
    /// Draws the figure.
    pub fn draw(&self) -> Drawing {
        let [low, high] = self.ends();
        let extent = (high - low).max(DVec2::splat(1e-3));
        let scale = (MOST / extent).min_element();
        let width = (axes::LEFT + scale * extent.x + 150.0).max(520.0);
        let beside = beyond_ends(HEIGHT_TITLE, scale * extent.y);
        let from = DVec2::new(axes::LEFT, self.heading.height(width) + 16.0 + beside);
        let scale_of_light = ColourScale::from_zero(100.0, Palette::Turbo);
        let within = Rectangle { from, to: from + scale * extent };
        let below_sun = if self.sun.is_some() { from.y + SUN_HEIGHT } else { from.y };
        let bar_top = (within.to.y - BAR_HEIGHT).max(below_sun + BAR_TITLE);
        let below_all = if self.light.is_empty() { below_sun } else { bar_top + BAR_HEIGHT };
        let size = DVec2::new(width, (within.to.y + beside).max(below_all - axes::BELOW + 8.0) + axes::BELOW + 4.0);
        let mut drawing = Drawing::new(size, self.heading.title.as_str());
        self.heading.draw(&mut drawing);
        let axes = Axes {
            within,
            x: Axis::linear(
                format!("{} in metres", self.across),
                [low.x, high.x],
                ticks_in(scale * extent.x),
                Steps::Decimal,
            ),
            y: Axis::linear(HEIGHT_TITLE, [low.y, high.y], ticks_in(scale * extent.y), Steps::Decimal),
        };
        axes.draw(&mut drawing);
        self.draw_room(&mut drawing, &axes);
        // light paths are drawn first, so that the walls of the tubes are on top
        for path in &self.light {
            draw_light(&mut drawing, &axes, path, &scale_of_light);
        }
        if !self.light.is_empty() {
            let from = DVec2::new(within.to.x + 34.0, bar_top);
            let bar = Rectangle { from, to: from + DVec2::new(BAR_WIDTH, BAR_HEIGHT) };
            scale_of_light.draw(&mut drawing, bar, "remaining light, %");
        }
        for tube in &self.tubes {
            draw_tube(&mut drawing, &axes, tube);
        }
        if let Some(sun) = self.sun {
            self.draw_sun(&mut drawing, &axes, sun);
        }
        drawing
    }

    /// Returns the lower left and upper right corner of the drawn region in metres.
    fn ends(&self) -> [DVec2; 2] {
        let [mut low, mut high] = self.room_ends();
        for tube in &self.tubes {
            for point in &tube.axis {
                low = low.min(*point - tube.radius.max(tube.mouth.length()));
                high = high.max(*point + 2.0 * tube.radius);
            }
        }
        for end in self.cut.iter().flatten() {
            (low, high) = (low.min(*end), high.max(*end));
        }
        let rim = 0.04 * (high - low).max_element();
        [DVec2::new(low.x - rim, 0.0), high + rim]
    }

    /// Returns the lower left and upper right corner of the room in metres.
    fn room_ends(&self) -> [DVec2; 2] {
        let corners = || self.room.iter().flatten().copied();
        [corners().fold(DVec2::INFINITY, DVec2::min), corners().fold(DVec2::NEG_INFINITY, DVec2::max)]
    }

    fn draw_room(&self, drawing: &mut Drawing, axes: &Axes) {
        let at = |point: DVec2| axes.at(point.x, point.y);
        let outline = |face: &Vec<DVec2>| Outline::polygon(face.iter().map(|corner| at(*corner)));
        // what is seen from its edge has no area
        let has_area = |face: &&Vec<DVec2>| enclosed_area(&polygon(face)).abs() > 1e-9;
        self.room.iter().filter(has_area).for_each(|face| drawing.fill(outline(face), Colour::Paper, 1.0));
        self.room.iter().for_each(|face| drawing.line(outline(face), Line::new(Colour::Muted, 0.8)));
        for object in &self.objects {
            let line = match object.is_cut {
                true => Line::new(Colour::Ink, 1.5),
                false => Line::new(Colour::Muted, 0.8).dashed(&[4.0, 3.0]),
            };
            if object.is_cut && has_area(&&object.outline) {
                drawing.fill(outline(&object.outline), Colour::Faint, 1.0);
            }
            drawing.line(outline(&object.outline), line);
        }
        for edge in &self.cut {
            drawing.line(Outline::polyline(edge.map(at)), Line::new(Colour::Ink, 2.5));
        }
        for (name, height) in &self.grids {
            let [low, high] = self.room_ends();
            let [left, right] = [at(DVec2::new(low.x, *height)), at(DVec2::new(high.x, *height))];
            drawing.line(Outline::polyline([left, right]), Line::new(SERIES[0], 1.2).dashed(&[6.0, 4.0]));
            let look = Type::new(11.0, SERIES[0]).rimmed(Colour::Paper);
            drawing.text(left + DVec2::new(8.0, -5.0), name.as_str(), look);
        }
    }

    /// Draws an arrow from the sun toward the roof.
    fn draw_sun(&self, drawing: &mut Drawing, axes: &Axes, sun: DVec2) {
        let Some(toward) = DVec2::new(sun.x, -sun.y).try_normalize() else { return };
        let corner = DVec2::new(axes.within.to.x + 58.0, axes.within.from.y + 60.0);
        let from = corner + 34.0 * toward;
        let to = corner - 34.0 * toward;
        let yellow = Colour::Fixed([230, 159, 0]);
        drawing.line(Outline::polyline([from, to]), Line::new(yellow, 2.0));
        let side = toward.perp();
        let head = [to, to + 10.0 * toward + 5.0 * side, to + 10.0 * toward - 5.0 * side];
        drawing.fill(Outline::polygon(head), yellow, 1.0);
        drawing.filled_line(Outline::circle(from, 8.0), Colour::Fixed([255, 220, 60]), Line::new(yellow, 1.5));
        let look = Type::new(11.0, Colour::Muted).anchored(Anchor::Middle);
        drawing.text(corner + DVec2::new(0.0, 62.0), "sun", look);
    }
}

/// Draws a light path, each segment in the colour of the fraction of the light that remains on it, and wider where this is more.
fn draw_light(drawing: &mut Drawing, axes: &Axes, path: &LightPath, scale: &ColourScale) {
    let points = &path.0;
    let mut first = 0;
    // segments of equal colour are one line, up to the point at which the next colour begins
    for run in points.chunk_by(|a, b| a.share == b.share) {
        let end = (first + run.len() + 1).min(points.len());
        let line = points[first..end].iter().map(|point| axes.at(point.at.x, point.at.y));
        let share = run[0].share;
        let look = Line::new(Colour::Fixed(scale.colour(100.0 * share)), THINNEST + (THICKEST - THINNEST) * share);
        drawing.line(Outline::polyline(line), look);
        first += run.len();
    }
}

/// Draws the walls of the pipe, its cover, and the diffuser in the opening.
fn draw_tube(drawing: &mut Drawing, axes: &Axes, tube: &SideTube) {
    let at = |point: DVec2| axes.at(point.x, point.y);
    let (ink, width) = if tube.is_cut { (Colour::Ink, 1.0) } else { (Colour::Muted, 0.5) };
    let normals = normals(&tube.axis, tube.mouth.normalize_or(DVec2::X));
    let side = |sign: f64| -> Vec<DVec2> {
        tube.axis.iter().zip(&normals).map(|(point, normal)| *point + sign * tube.radius * *normal).collect()
    };
    let (left, right) = (side(-1.0), side(1.0));
    let (Some(first), Some(last)) = (tube.axis.first(), left.last().zip(right.last())) else { return };
    if tube.axis.len() > 1 {
        let walls = left.iter().chain(right.iter().rev()).map(|point| at(*point));
        if tube.is_cut {
            drawing.fill(Outline::polygon(walls), SERIES[4], 0.25);
        }
        for wall in [&left, &right] {
            drawing.line(Outline::polyline(wall.iter().map(|point| at(*point))), Line::new(ink, 1.8 * width));
        }
    }
    let [a, b] = [at(*last.0), at(*last.1)];
    match tube.cover {
        Cover::Open => {}
        Cover::Flat => drawing.line(Outline::polyline([a, b]), Line::new(SERIES[0], 2.5 * width)),
        Cover::Dome => drawing.line(half_circle(a, b), Line::new(SERIES[0], 2.0 * width)),
    }
    let ends = [-1.0, 1.0].map(|sign| at(*first + sign * tube.mouth));
    drawing.line(Outline::polyline(ends), Line::new(SERIES[1], 4.0 * width));
}

/// Returns the normals of a polyline at its points, to the right of its direction. Between segments they are lengthened to the
/// mitre, so that offset walls are parallel to the axis (up to a turn of 120°); the first is along the mouth, where the pipe ends.
fn normals(axis: &[DVec2], mouth: DVec2) -> Vec<DVec2> {
    let along = |index: usize| -> DVec2 {
        let before =
            index.checked_sub(1).map_or(DVec2::ZERO, |before| (axis[index] - axis[before]).normalize_or_zero());
        let after = axis.get(index + 1).map_or(DVec2::ZERO, |after| (*after - axis[index]).normalize_or_zero());
        let middle = (before + after).try_normalize().unwrap_or(DVec2::Y);
        // the mitre of a turn by more than 120° would be too long
        let lean = middle.dot(if before == DVec2::ZERO { middle } else { before }).max(0.5);
        middle / lean
    };
    // a pipe ends in the plane of its opening, and square at the top
    (0..axis.len()).map(|index| if index == 0 { mouth } else { -along(index).perp() }).collect()
}

/// Returns the upper half of the circle whose diameter joins two points.
fn half_circle(a: DVec2, b: DVec2) -> Outline {
    let (centre, arm) = (a.midpoint(b), 0.5 * (b - a));
    let up = DVec2::new(arm.y, -arm.x);
    let quarter = 0.552_284_749_830_793_4;
    Outline(vec![
        Part::Move(a),
        Part::Cubic(a + quarter * up, centre + up - quarter * arm, centre + up),
        Part::Cubic(centre + up + quarter * arm, b + quarter * up, b),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::drawing::Item;
    use crate::figure::svg::svg;

    /// In a long and low section the sun stands above the scale of light, and the title of the upright axis below the heading.
    #[test]
    fn nothing_covers_the_sun_of_a_low_room() {
        let section = Section {
            heading: Heading::of("Section"),
            across: "x",
            room: vec![[(0.0, 0.0), (60.0, 0.0), (60.0, 2.5), (0.0, 2.5)].map(DVec2::from).to_vec()],
            cut: Vec::new(),
            tubes: Vec::new(),
            objects: Vec::new(),
            grids: Vec::new(),
            light: vec![LightPath(vec![PathPoint { at: DVec2::new(5.0, 2.5), share: 0.5 }])],
            sun: Some(DVec2::new(-0.5, 0.6)),
        };
        let drawing = section.draw();
        let words = |text: &str| {
            let found = drawing.items.iter().find_map(|item| match item {
                Item::Words(words) if words.text == text => Some(words),
                _ => None,
            });
            found.unwrap_or_else(|| panic!("no {text}"))
        };
        assert!(words("remaining light, %").at.y - words("sun").at.y > 12.0);
        let title = words("height in metres");
        assert!(title.at.y - title.width > words("Section").at.y, "{title:?}");
        assert!(words("0").at.y < drawing.size.y && words("remaining light, %").at.y + BAR_HEIGHT < drawing.size.y);
    }

    #[test]
    fn a_section_shows_room_roof_and_tubes() {
        let straight = SideTube {
            axis: vec![DVec2::new(1.0, 2.7), DVec2::new(1.0, 3.9)],
            radius: 0.175,
            mouth: 0.175 * DVec2::X,
            cover: Cover::Dome,
            is_cut: true,
        };
        let bent = SideTube {
            axis: vec![DVec2::new(3.0, 2.7), DVec2::new(3.0, 3.2), DVec2::new(3.4, 3.9)],
            radius: 0.175,
            mouth: 0.25 * DVec2::X,
            cover: Cover::Flat,
            is_cut: false,
        };
        let mouth = SideTube {
            axis: vec![DVec2::new(2.0, 2.7)],
            radius: 0.1,
            mouth: 0.1 * DVec2::X,
            cover: Cover::Open,
            is_cut: true,
        };
        let section = Section {
            heading: Heading::of("Section"),
            across: "x",
            room: vec![[(0.0, 0.0), (4.0, 0.0), (4.0, 2.7), (0.0, 2.7)].map(DVec2::from).to_vec()],
            cut: vec![[DVec2::ZERO, DVec2::new(0.0, 2.7)]],
            tubes: vec![straight, bent, mouth],
            objects: [true, false]
                .map(|is_cut| SideObject {
                    outline: [(0.0, 0.0), (1.0, 0.0), (1.0, 0.6), (0.0, 0.6)].map(DVec2::from).to_vec(),
                    is_cut,
                })
                .to_vec(),
            grids: vec![("workplane".to_owned(), 0.8)],
            light: vec![LightPath(
                [(1.1, 3.9, 0.9), (0.9, 3.3, 0.8), (1.0, 2.7, 0.8), (1.2, 0.0, 0.4)]
                    .map(|(x, y, share)| PathPoint { at: DVec2::new(x, y), share })
                    .to_vec(),
            )],
            sun: Some(DVec2::new(-0.5, 0.6)),
        };
        let drawing = section.draw();
        let texts: Vec<&str> = drawing.texts().collect();
        for text in ["Section", "x in metres", "height in metres", "workplane", "sun", "2.0", "4.0"] {
            assert!(texts.contains(&text), "{text}: {texts:?}");
        }
        assert!(!svg(&drawing).unwrap().contains("NaN"));
    }

    #[test]
    fn walls_of_a_straight_pipe_are_upright_and_end_square() {
        let normals = normals(&[DVec2::ZERO, DVec2::new(0.0, 1.0), DVec2::new(0.0, 2.0)], DVec2::X);
        assert!(normals.iter().all(|normal| normal.distance(DVec2::X) < 1e-12), "{normals:?}");
        let elbow = super::normals(&[DVec2::ZERO, DVec2::new(0.0, 1.0), DVec2::new(1.0, 2.0)], DVec2::X);
        assert!((elbow[1].x - 1.0).abs() < 1e-12, "the wall below the elbow is upright: {elbow:?}");
    }
}
