//! Check for tubes that pass through each other or through themselves.

use glam::DVec3;

use super::check::{bends, pane};
use super::opening::PlacedOpening;
use super::{ParametricTube, TubeDocument};
use crate::document::errors::Checks;
use crate::geometry::OpeningFrame;
use crate::scene::Enclosure;

/// Depth of overlap, as a fraction of the radius, up to which surfaces count as touching.
const TOUCHING: f64 = 1e-4;

/// Largest number of steps of the search for a common point of two pieces; pieces that need more overlap by less than the
/// tolerance.
const STEPS: usize = 1000;

/// Adds a fault for each parametric tube that overlaps an earlier one, or itself, above its opening in a room; each tube must be valid by
/// itself.
pub(crate) fn check_crossings(tubes: &[TubeDocument], enclosure: &Enclosure, checks: &mut Checks) {
    let cylinders = |(index, document): (usize, &TubeDocument)| match document {
        TubeDocument::Parametric(tube) => {
            let opening = PlacedOpening::of(document, enclosure)?.frame;
            Some((index, pieces(tube, &opening, 1.0), pieces(tube, &opening, -1.0)))
        }
        TubeDocument::Mesh(_) => None,
    };
    let tubes: Vec<(usize, Vec<Piece>, Vec<Piece>)> = tubes.iter().enumerate().filter_map(cylinders).collect();
    for (number, (index, whole, cores)) in tubes.iter().enumerate() {
        let others =
            tubes[..number].iter().flat_map(|(other, pieces, _)| pieces.iter().map(move |piece| (*other, piece)));
        let of_others = others.flat_map(|(other, theirs)| whole.iter().map(move |own| (other, own, theirs)));
        // successive segments meet in a mitre and are not compared
        let of_itself = (2..cores.len()).flat_map(|k| cores[..k - 1].iter().map(move |own| (*index, own, &cores[k])));
        let Some((other, own, theirs)) = of_others.chain(of_itself).find(|(_, own, theirs)| own.crosses(theirs)) else {
            continue;
        };
        let (distance, place) = own.axes_apart(theirs);
        let detail = format!(
            "passes through /tubes/{other}/segments/{}: near {place} m their axes come within {distance:.4} m, but \
             their radii add up to {} m",
            theirs.segment,
            own.radius + theirs.radius
        );
        checks.refuse(format!("/tubes/{index}/segments/{}", own.segment), detail);
    }
}

/// Round cylinder with flat ends that stands for a segment of a tube.
struct Piece {
    segment: usize,
    /// Centre of the lower end in m.
    start: DVec3,
    axis: DVec3,
    length: f64,
    radius: f64,
}

/// Returns the segments of a tube behind its opening as cylinders. At a mitre, where the sides of a segment differ in length, a cylinder ends where
/// the longer side (`ends` 1) or the shorter side (-1) does.
fn pieces(tube: &ParametricTube, opening: &OpeningFrame, ends: f64) -> Vec<Piece> {
    let radius = 0.5 * tube.diameter_m;
    let axes = tube.axes(opening.outward());
    // a pane reaches as far as a mitre of twice its angle
    let bends: Vec<f64> = bends(&axes).into_iter().chain([2.0 * pane(tube, &axes)]).collect();
    let reach = |bend: Option<&f64>| bend.map_or(0.0, |bend| ends * radius * libm::tan(0.5 * bend));
    let mut start = opening.origin;
    let mut pieces = Vec::with_capacity(axes.len());
    for (segment, (axis, of)) in axes.into_iter().zip(&tube.segments).enumerate() {
        let (below, above) =
            (reach(segment.checked_sub(1).and_then(|joint| bends.get(joint))), reach(bends.get(segment)));
        let length = of.length_m + below + above;
        pieces.push(Piece { segment, start: start - below * axis, axis, length, radius });
        start += of.length_m * axis;
    }
    pieces
}

impl Piece {
    /// True if the pieces have a common point, deeper than the tolerance for touching.
    fn crosses(&self, other: &Self) -> bool {
        let middle = |piece: &Self| piece.start + 0.5 * piece.length * piece.axis;
        let reach = |piece: &Self| 0.5 * piece.length.abs() + piece.radius;
        if middle(self).distance(middle(other)) > reach(self) + reach(other) {
            return false;
        }
        let hair = TOUCHING * self.radius.min(other.radius);
        let (one, two) = (self.thinner(hair), other.thinner(hair));
        let mut inside = one.start + 0.5 * one.length * one.axis;
        for _ in 0..STEPS {
            let of_other = two.nearest(inside);
            inside = one.nearest(of_other);
            let apart = inside - of_other;
            let distance = apart.length();
            if distance <= 0.1 * hair {
                return true;
            }
            // this one lies wholly on one side of the plane through its nearest point; if the other one lies wholly on the other
            // side, they are apart
            let across = apart / distance;
            if two.farthest(across) < across.dot(inside) {
                return false;
            }
        }
        false
    }

    /// Returns the distance between the axes in m, and the point midway between them where they are nearest.
    fn axes_apart(&self, other: &Self) -> (f64, DVec3) {
        let (one, two) = (Self { radius: 0.0, ..*self }, Self { radius: 0.0, ..*other });
        let mut own = one.start;
        let mut of_other = two.start;
        for _ in 0..STEPS {
            of_other = two.nearest(own);
            own = one.nearest(of_other);
        }
        let rounded = |place: DVec3| (place * 1e4).round() / 1e4;
        (own.distance(of_other), rounded(0.5 * (own + of_other)))
    }

    fn thinner(&self, by: f64) -> Self {
        let by_length = by.min(0.5 * self.length);
        Self {
            start: self.start + by_length * self.axis,
            length: self.length - 2.0 * by_length,
            radius: self.radius - by,
            ..*self
        }
    }

    /// Returns the point of the cylinder that is nearest to `point`.
    fn nearest(&self, point: DVec3) -> DVec3 {
        let along = (point - self.start).dot(self.axis);
        let from_axis = point - self.start - along * self.axis;
        let onto = from_axis.clamp_length_max(self.radius);
        self.start + along.clamp(0.0, self.length) * self.axis + onto
    }

    /// Returns the largest coordinate of the cylinder's points along a unit vector.
    fn farthest(&self, along: DVec3) -> f64 {
        let lean = self.axis.dot(along);
        let of_disc = self.radius * (1.0 - lean * lean).max(0.0).sqrt();
        along.dot(self.start) + (lean * self.length).max(0.0) + of_disc
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn piece(start: [f64; 3], end: [f64; 3], radius: f64) -> Piece {
        let way = DVec3::from(end) - DVec3::from(start);
        Piece { segment: 0, start: start.into(), axis: way.normalize(), length: way.length(), radius }
    }

    /// Cylinders side by side, across, end to end, and with an end before a side: a thousandth of a radius apart, and
    /// overlapping.
    #[test]
    fn cylinders_that_touch_are_apart() {
        let upright = piece([0.0; 3], [0.0, 0.0, 3.0], 0.2);
        let beside: [fn(f64) -> Piece; 5] = [
            |gap| piece([0.5 + gap, 0.0, -1.0], [0.5 + gap, 0.0, 9.0], 0.3),
            |gap| piece([-4.0, 0.5 + gap, 1.0], [4.0, 0.5 + gap, 2.0], 0.3),
            |gap| piece([0.1, 0.0, 3.0 + gap], [0.1, 0.0, 4.0], 0.3),
            |gap| piece([0.2 + gap, 0.0, 1.5], [9.0, 0.0, 1.5], 0.3),
            |gap| piece([-2.0, 0.0, 3.3 + gap], [2.0, 0.0, 3.3 + gap], 0.3),
        ];
        for (number, beside) in beside.into_iter().enumerate() {
            for (gap, crosses) in [(2e-4, false), (0.0, false), (-2e-4, true), (-0.1, true)] {
                let other = beside(gap);
                assert_eq!([upright.crosses(&other), other.crosses(&upright)], [crosses; 2], "{number}: {gap}");
            }
        }
        let (distance, place) = upright.axes_apart(&beside[1](0.0));
        assert!(
            (distance - 0.5).abs() < 1e-12 && place.distance(DVec3::new(0.0, 0.25, 1.5)) < 1e-9,
            "{distance} {place}"
        );
    }
}
