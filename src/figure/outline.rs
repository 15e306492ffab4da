//! Outlines: lines and curves in the plane of a figure, in pixels at single size, x to the right and y down.

use glam::DVec2;

/// Distance of the control points of a cubic curve that approximates a quarter of a circle, over the radius: 4/3 (sqrt(2) - 1);
/// its error is 0.03 %.
const QUARTER: f64 = 0.552_284_749_830_793_4;

/// Command of an outline, which continues from the end of the one before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Part {
    /// Start of a new subpath at this point.
    Move(DVec2),
    /// Straight line to this point.
    Line(DVec2),
    /// Quadratic Bézier curve: its control point and its end.
    Quadratic(DVec2, DVec2),
    /// Cubic Bézier curve: its control points and its end.
    Cubic(DVec2, DVec2, DVec2),
    /// Straight line back to the start of the subpath.
    Close,
}

/// Subpaths of lines and curves, which are filled (non-zero winding), drawn as lines, or both.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outline(pub Vec<Part>);

impl Outline {
    /// Joins points by straight lines as an open subpath; empty with fewer than two points.
    pub fn polyline(points: impl IntoIterator<Item = DVec2>) -> Self {
        let mut outline = Self::default();
        outline.add_polyline(points);
        outline
    }

    /// Joins points by straight lines, and the last with the first.
    pub fn polygon(points: impl IntoIterator<Item = DVec2>) -> Self {
        let mut outline = Self::polyline(points);
        if !outline.0.is_empty() {
            outline.0.push(Part::Close);
        }
        outline
    }

    /// Returns the rectangle between two opposite corners.
    pub fn rectangle(a: DVec2, b: DVec2) -> Self {
        Self::polygon([a, DVec2::new(b.x, a.y), b, DVec2::new(a.x, b.y)])
    }

    /// Returns a circle of four cubic curves.
    pub fn circle(centre: DVec2, radius: f64) -> Self {
        let mut outline = Self::default();
        outline.add_circle(centre, radius);
        outline
    }

    /// Returns an ellipse of four cubic curves, given by two conjugate half diameters.
    pub fn ellipse(centre: DVec2, diameters: [DVec2; 2]) -> Self {
        let mut outline = Self::default();
        outline.add_ellipse(centre, diameters);
        outline
    }

    /// Adds an open subpath of straight lines; adds nothing with fewer than two points.
    pub fn add_polyline(&mut self, points: impl IntoIterator<Item = DVec2>) {
        let mut points = points.into_iter();
        let (Some(first), Some(second)) = (points.next(), points.next()) else { return };
        self.0.extend([Part::Move(first), Part::Line(second)]);
        self.0.extend(points.map(Part::Line));
    }

    /// Adds a circle.
    pub fn add_circle(&mut self, centre: DVec2, radius: f64) {
        self.add_ellipse(centre, [DVec2::new(radius, 0.0), DVec2::new(0.0, radius)]);
    }

    fn add_ellipse(&mut self, centre: DVec2, [east, south]: [DVec2; 2]) {
        self.0.push(Part::Move(centre + east));
        for (from, to) in [(east, south), (south, -east), (-east, -south), (-south, east)] {
            self.0.push(Part::Cubic(centre + from + QUARTER * to, centre + to + QUARTER * from, centre + to));
        }
        self.0.push(Part::Close);
    }

    /// Adds the part of a straight line between two points that is within a rectangle.
    pub fn add_clipped_line(&mut self, from: DVec2, to: DVec2, within: &Rectangle) {
        if let Some((from, to)) = within.clip(from, to) {
            self.add_polyline([from, to]);
        }
    }

    /// Adds the parts of a polyline that are within a rectangle. A point that is not finite interrupts the line.
    pub fn add_clipped(&mut self, points: impl IntoIterator<Item = DVec2>, within: &Rectangle) {
        let mut before: Option<DVec2> = None;
        let mut joined = None;
        for point in points {
            let piece = before.filter(|before| before.is_finite() && point.is_finite());
            if let Some((from, to)) = piece.and_then(|before| within.clip(before, point)) {
                if joined != Some(from) {
                    self.0.push(Part::Move(from));
                }
                self.0.push(Part::Line(to));
                joined = Some(to);
            }
            before = Some(point);
        }
    }

    /// Returns the outline with every point mapped by `place`.
    pub fn mapped(&self, place: impl Fn(DVec2) -> DVec2) -> Self {
        let part = |part: &Part| match *part {
            Part::Move(to) => Part::Move(place(to)),
            Part::Line(to) => Part::Line(place(to)),
            Part::Quadratic(a, to) => Part::Quadratic(place(a), place(to)),
            Part::Cubic(a, b, to) => Part::Cubic(place(a), place(b), place(to)),
            Part::Close => Part::Close,
        };
        Self(self.0.iter().map(part).collect())
    }
}

/// Rectangle of a figure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectangle {
    /// Upper left corner.
    pub from: DVec2,
    /// Lower right corner.
    pub to: DVec2,
}

impl Rectangle {
    /// Creates a rectangle from its left, upper, right and lower edge.
    pub fn new(left: f64, top: f64, right: f64, bottom: f64) -> Self {
        Self { from: DVec2::new(left, top), to: DVec2::new(right, bottom) }
    }

    /// Returns width and height.
    pub fn size(&self) -> DVec2 {
        self.to - self.from
    }

    /// True if the point is within the rectangle or on its edge.
    pub fn contains(&self, point: DVec2) -> bool {
        point.cmpge(self.from).all() && point.cmple(self.to).all()
    }

    /// Returns the part of a straight line that is within the rectangle, by the slab method: between the fractions of its
    /// length at which it enters the last slab and leaves the first.
    fn clip(&self, from: DVec2, to: DVec2) -> Option<(DVec2, DVec2)> {
        let along = to - from;
        let (mut enters, mut leaves) = (0.0f64, 1.0f64);
        for (start, step, low, high) in
            [(from.x, along.x, self.from.x, self.to.x), (from.y, along.y, self.from.y, self.to.y)]
        {
            if step == 0.0 {
                if start < low || start > high {
                    return None;
                }
                continue;
            }
            let [first, second] = [(low - start) / step, (high - start) / step];
            enters = enters.max(first.min(second));
            leaves = leaves.min(first.max(second));
        }
        let at = |share: f64| match share {
            0.0 => from,
            1.0 => to,
            _ => from + share * along,
        };
        (enters < leaves).then(|| (at(enters), at(leaves)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, y: f64) -> DVec2 {
        DVec2::new(x, y)
    }

    #[test]
    fn lines_end_at_the_edge() {
        let within = Rectangle::new(0.0, 0.0, 10.0, 10.0);
        let mut outline = Outline::default();
        outline.add_clipped([at(-5.0, 5.0), at(5.0, 5.0), at(5.0, 15.0), at(20.0, 15.0), at(20.0, 5.0)], &within);
        let expected = [Part::Move(at(0.0, 5.0)), Part::Line(at(5.0, 5.0)), Part::Line(at(5.0, 10.0))];
        assert_eq!(outline.0, expected);
        let mut none = Outline::default();
        none.add_clipped([at(f64::NAN, 5.0), at(5.0, 5.0), at(f64::INFINITY, 5.0)], &within);
        none.add_clipped([at(11.0, 0.0), at(11.0, 9.0)], &within);
        assert_eq!(none.0, []);
    }

    #[test]
    fn circles_are_round() {
        let circle = Outline::circle(at(3.0, 4.0), 2.0);
        let mut start = at(5.0, 4.0);
        for part in &circle.0 {
            if let Part::Cubic(a, b, end) = *part {
                for step in 0..=10 {
                    let t = f64::from(step) / 10.0;
                    let point = start * (1.0 - t).powi(3)
                        + a * (3.0 * t * (1.0 - t).powi(2))
                        + b * (3.0 * t * t * (1.0 - t))
                        + end * t.powi(3);
                    assert!((point.distance(at(3.0, 4.0)) / 2.0 - 1.0).abs() < 3e-4);
                }
                start = end;
            }
        }
        assert_eq!(start, at(5.0, 4.0));
    }
}
