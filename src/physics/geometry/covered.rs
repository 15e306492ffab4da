//! Union of planar figures, clipped to another figure.

use glam::DVec2;

/// An edge of a figure, in the figure's plane. The inside of a set of edges is defined by the even-odd rule: points from which a half line
/// crosses an odd number of edges.
pub type Edge = [DVec2; 2];

/// Computes the part of a figure that the union of `covers` covers, as its edges, counter-clockwise.
///
/// Figures are closed outlines with holes; directions of their edges do not count, and covers may overlap each other and reach out of the
/// `outline`. Edges nearer to each other than `tolerance` (in the unit of the edges) are merged, and parts narrower than a few tolerances
/// are lost.
///
/// A square of which another one covers a corner:
///
/// ```
/// use glam::DVec2;
/// use skyduct_physics::geometry::covered::{covered, enclosed_area, rectangle};
///
/// let outline = rectangle(DVec2::ZERO, DVec2::ONE);
/// let cover = rectangle(DVec2::splat(0.75), DVec2::splat(2.0));
/// assert!((enclosed_area(&covered(&outline, &[cover], 1e-9)) - 0.0625).abs() < 1e-15);
/// ```
pub fn covered(outline: &[Edge], covers: &[Vec<Edge>], tolerance: f64) -> Vec<Edge> {
    let (low, high) = bounds(covers.iter().flatten());
    let margin = DVec2::splat(4.0 * tolerance);
    let (low, high) = (low - margin, high + margin);
    let near: Vec<Edge> = outline
        .iter()
        .chain(covers.iter().flatten())
        .filter(|[a, b]| a.max(*b).cmpge(low).all() && a.min(*b).cmple(high).all())
        .copied()
        .collect();
    let inside = |p: DVec2| contains(outline, p) && covers.iter().any(|cover| contains(cover, p));
    let mut kept: Vec<Edge> = Vec::new();
    for edge in &near {
        for [a, b] in pieces(*edge, &near, tolerance) {
            // far enough from the edge that another one on it does not come between
            let across = (b - a).normalize_or_zero().perp() * (4.0 * tolerance);
            let middle = 0.5 * (a + b);
            let piece = match (inside(middle + across), inside(middle - across)) {
                (true, false) => [a, b],
                (false, true) => [b, a],
                _ => continue,
            };
            let same = |other: &Edge| (0..2).all(|k| (other[k] - piece[k]).length() <= 4.0 * tolerance);
            if !kept.iter().any(same) {
                kept.push(piece);
            }
        }
    }
    kept
}

/// Returns the area that directed edges enclose, positive for counter-clockwise edges.
pub fn enclosed_area(edges: &[Edge]) -> f64 {
    edges.iter().map(|[a, b]| 0.5 * a.perp_dot(*b)).sum()
}

/// Returns the area of the part of a figure that lies within a rectangle; the edges have the inside on their left.
///
/// ```
/// use glam::DVec2;
/// use skyduct_physics::geometry::covered::{area_in_rectangle, polygon};
///
/// let triangle = polygon(&[DVec2::ZERO, DVec2::new(2.0, 0.0), DVec2::new(0.0, 2.0)]);
/// assert!((area_in_rectangle(&triangle, DVec2::splat(0.5), DVec2::splat(3.0)) - 0.5).abs() < 1e-15);
/// ```
pub fn area_in_rectangle(edges: &[Edge], low: DVec2, high: DVec2) -> f64 {
    // Green's theorem for the abscissa from the left side, cut off at the right one
    let of_edge = |[a, b]: &Edge| {
        let (rise, from, to) = (b.y - a.y, a.y.clamp(low.y, high.y), b.y.clamp(low.y, high.y));
        if rise == 0.0 || from == to {
            return 0.0;
        }
        let at = |y: f64| a.x + (y - a.y) / rise * (b.x - a.x) - low.x;
        let (start, end, width) = (at(from), at(to), high.x - low.x);
        // mean over the piece of max(0, x) - max(0, x - width)
        let mean = |over: f64| {
            let (start, end) = (start - over, end - over);
            match (start > 0.0, end > 0.0) {
                (true, true) => 0.5 * (start + end),
                (false, false) => 0.0,
                _ => 0.5 * start.max(end).powi(2) / (start - end).abs(),
            }
        };
        (to - from) * (mean(0.0) - mean(width))
    };
    edges.iter().map(of_edge).sum()
}

/// Returns the edges of an axis-aligned rectangle, counter-clockwise.
pub fn rectangle(low: DVec2, high: DVec2) -> Vec<Edge> {
    polygon(&[low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)])
}

/// Returns the edges of a polygon in the order of its corners.
pub fn polygon(corners: &[DVec2]) -> Vec<Edge> {
    (0..corners.len()).map(|k| [corners[k], corners[(k + 1) % corners.len()]]).collect()
}

/// True if a half line from `point` crosses an odd number of edges.
pub fn contains(edges: &[Edge], point: DVec2) -> bool {
    let crosses = |[a, b]: &&Edge| {
        let (a, b) = (*a - point, *b - point);
        (a.y > 0.0) != (b.y > 0.0) && a.x + a.y / (a.y - b.y) * (b.x - a.x) > 0.0
    };
    edges.iter().filter(crosses).count() % 2 == 1
}

/// Returns the distance of a point from the nearest of some edges; infinite without edges.
pub fn distance(edges: &[Edge], point: DVec2) -> f64 {
    let to_edge = |[a, b]: &Edge| {
        let along = *b - *a;
        let share = ((point - *a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        point.distance(a.lerp(*b, share))
    };
    edges.iter().map(to_edge).fold(f64::INFINITY, f64::min)
}

/// True if an edge of one figure crosses one of another.
pub fn cross(figure: &[Edge], other: &[Edge]) -> bool {
    figure.iter().any(|edge| other.iter().any(|with| crossing(*edge, *with).is_some()))
}

/// Returns the lowest and highest corner of the bounding rectangle of edges.
pub fn bounds<'a>(edges: impl Iterator<Item = &'a Edge>) -> (DVec2, DVec2) {
    let start = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    edges.fold(start, |(low, high), [a, b]| (low.min(*a).min(*b), high.max(*a).max(*b)))
}

/// Cuts an edge at the points in which others cross it, end on it or lie on it; pieces shorter than `tolerance` are dropped.
fn pieces([a, b]: Edge, others: &[Edge], tolerance: f64) -> Vec<Edge> {
    let along = b - a;
    let length = along.length();
    if length <= tolerance {
        return Vec::new();
    }
    let unit = along / length;
    let (low, high) = (a.min(b) - tolerance, a.max(b) + tolerance);
    let mut cuts = vec![0.0, length];
    for [c, d] in others {
        if c.max(*d).cmplt(low).any() || c.min(*d).cmpgt(high).any() {
            continue;
        }
        let on_it = [c, d].map(|p| (*p - a, unit.perp_dot(*p - a)));
        cuts.extend(on_it.iter().filter(|(_, beside)| beside.abs() <= tolerance).map(|(to, _)| unit.dot(*to)));
        cuts.extend(crossing([a, b], [*c, *d]).map(|fraction| fraction * length));
    }
    cuts.retain(|cut| (0.0..=length).contains(cut));
    cuts.sort_unstable_by(f64::total_cmp);
    let pair = |pair: &[f64]| (pair[1] - pair[0] > tolerance).then(|| [a + unit * pair[0], a + unit * pair[1]]);
    cuts.dedup_by(|later, earlier| *later - *earlier <= tolerance);
    cuts.windows(2).filter_map(pair).collect()
}

/// Returns the position along the edge from `a` (0) to `b` (1) at which the edge from `c` to `d` crosses it, if it does.
pub fn crossing([a, b]: Edge, [c, d]: Edge) -> Option<f64> {
    let (along, across) = (b - a, d - c);
    let (from, to) = (along.perp_dot(c - a), along.perp_dot(d - a));
    let (start, end) = (across.perp_dot(a - c), across.perp_dot(b - c));
    ((from > 0.0) != (to > 0.0) && (start > 0.0) != (end > 0.0)).then(|| start / (start - end))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOLERANCE: f64 = 1e-9;

    fn area(outline: &[Edge], covers: &[Vec<Edge>]) -> f64 {
        enclosed_area(&covered(outline, covers, TOLERANCE))
    }

    fn square(x: f64, y: f64, side: f64) -> Vec<Edge> {
        rectangle(DVec2::new(x, y), DVec2::new(x + side, y + side))
    }

    /// Checks a cover inside, overhanging, flush with one edge and with all, beyond, and touching from outside.
    #[test]
    fn one_cover() {
        let outline = square(0.0, 0.0, 1.0);
        let cases = [
            (square(0.2, 0.3, 0.5), 0.25),
            (square(0.5, 0.5, 2.0), 0.25),
            (square(0.0, 0.25, 0.5), 0.25),
            (square(0.0, 0.0, 1.0), 1.0),
            (square(-3.0, -3.0, 9.0), 1.0),
            (square(1.0, 0.0, 1.0), 0.0),
            (square(2.0, 0.0, 1.0), 0.0),
        ];
        for (cover, expected) in cases {
            let turned: Vec<Edge> = cover.iter().map(|[a, b]| [*b, *a]).collect();
            for cover in [cover, turned] {
                let found = area(&outline, std::slice::from_ref(&cover));
                assert!((found - expected).abs() < 1e-8, "{cover:?}: {found}, {expected}");
            }
        }
    }

    /// Checks that several covers count once: overlapping, side by side with a common edge, repeated, and one within the other.
    #[test]
    fn several_covers() {
        let outline = square(0.0, 0.0, 1.0);
        let cases = [
            (vec![square(0.1, 0.1, 0.4), square(0.3, 0.3, 0.4)], 0.28),
            (vec![square(0.1, 0.1, 0.4), square(0.5, 0.1, 0.4)], 0.32),
            (vec![square(0.1, 0.1, 0.4), square(0.1, 0.1, 0.4)], 0.16),
            (vec![square(0.1, 0.1, 0.4), square(0.1, 0.1, 0.2)], 0.16),
            (vec![square(0.1, 0.1, 0.4), square(0.2, 0.2, 0.1)], 0.16),
        ];
        for (covers, expected) in cases {
            let found = area(&outline, &covers);
            assert!((found - expected).abs() < 1e-8, "{covers:?}: {found}, {expected}");
        }
    }

    /// Checks covers and outlines with holes: a frame covers everything except its hole, and a framed outline is covered everywhere except
    /// in its hole.
    #[test]
    fn holes() {
        let frame: Vec<Edge> = square(0.0, 0.0, 1.0).into_iter().chain(square(0.25, 0.25, 0.5)).collect();
        assert!((area(&square(-1.0, -1.0, 3.0), std::slice::from_ref(&frame)) - 0.75).abs() < 1e-8);
        assert!((area(&frame, &[square(0.0, 0.0, 0.5)]) - 0.1875).abs() < 1e-8);
    }

    /// Checks that a half plane through the middle of a square covers half of it at any angle.
    #[test]
    fn any_angle() {
        let outline = square(-1.0, -1.0, 2.0);
        for degrees in 0..72 {
            let turn = DVec2::from_angle((5.0 * f64::from(degrees)).to_radians());
            let half = [DVec2::new(-9.0, 0.0), DVec2::new(9.0, 0.0), DVec2::new(9.0, 9.0), DVec2::new(-9.0, 9.0)];
            let found = area(&outline, &[polygon(&half.map(|p| turn.rotate(p)))]);
            assert!((found - 2.0).abs() < 1e-7, "{degrees}: {found}");
        }
    }
}
