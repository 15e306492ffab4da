//! Labels of a figure, each at a place where it covers neither another label nor a mark.

use glam::DVec2;

use super::drawing::{Anchor, Direction, Drawing, Type};
use super::letters;
use super::outline::Rectangle;

/// Space around a label in pixels.
const SPACE: DVec2 = DVec2::new(3.0, 2.0);

/// Regions of a figure that labels and marks take.
#[derive(Clone, Debug, Default)]
pub struct Taken(Vec<Rectangle>);

impl Taken {
    /// Takes a region.
    pub fn add(&mut self, region: Rectangle) {
        self.0.push(region);
    }

    /// Returns the distance in pixels of a point from the middle of the nearest region that is taken.
    pub fn clearance(&self, point: DVec2) -> f64 {
        self.0.iter().map(|region| region.from.midpoint(region.to).distance(point)).fold(f64::INFINITY, f64::min)
    }

    /// Writes a text around the first of `places` at which it lies within a rectangle and covers nothing that is taken; false if there is
    /// none.
    pub fn write(
        &mut self,
        drawing: &mut Drawing,
        within: &Rectangle,
        (text, look): (&str, Type),
        mut places: impl Iterator<Item = DVec2>,
    ) -> bool {
        let half = half_size(text, look);
        let region = |at: DVec2| Rectangle { from: at - half, to: at + half };
        let is_free = |at: &DVec2| {
            let label = region(*at);
            within.contains(label.from) && within.contains(label.to) && !self.0.iter().any(|other| meet(&label, other))
        };
        let Some(at) = places.find(is_free) else { return false };
        self.add(region(at));
        let look = look.anchored(Anchor::Middle);
        match look.direction {
            Direction::Level => drawing.text_centred(at, text, look),
            Direction::Upwards => {
                drawing.text(at + DVec2::new(0.5 * letters::CAPITAL_HEIGHT * look.size, 0.0), text, look);
            }
        }
        true
    }
}

/// Returns half the width and half the height in pixels that a text takes.
pub fn half_size(text: &str, look: Type) -> DVec2 {
    let level = 0.5 * DVec2::new(letters::width(text, look.size), look.size) + SPACE;
    match look.direction {
        Direction::Level => level,
        Direction::Upwards => DVec2::new(level.y, level.x),
    }
}

fn meet(a: &Rectangle, b: &Rectangle) -> bool {
    a.from.cmplt(b.to).all() && b.from.cmplt(a.to).all()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::colour::BLACK;

    #[test]
    fn a_label_moves_to_the_first_free_place() {
        let mut drawing = Drawing::new(DVec2::splat(200.0), "");
        let within = Rectangle { from: DVec2::ZERO, to: DVec2::splat(200.0) };
        let mut taken = Taken::default();
        let places = [20.0, 60.0, 62.0, 100.0].map(|y| DVec2::new(80.0, y));
        let mut write =
            |text: &str| taken.write(&mut drawing, &within, (text, Type::new(12.0, BLACK)), places.into_iter());
        assert!(write("one") && write("two") && write("three") && !write("four"));
        let mut outside = Taken::default();
        assert!(!outside.write(&mut drawing, &within, ("beyond", Type::new(12.0, BLACK)), [DVec2::ZERO].into_iter()));
        assert_eq!(drawing.texts().collect::<Vec<_>>(), ["one", "two", "three"]);
    }
}
