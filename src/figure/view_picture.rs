//! Figure of a view of a room: heading, picture with square pixels, and colour scale.

use glam::DVec2;

use super::colour::Colour;
use super::drawing::{Drawing, Line, Type};
use super::heading::{Heading, MARGIN};
use super::outline::{Outline, Rectangle};
use super::scale::{BAR_WIDTH, ColourScale, LABEL_WIDTH};
use crate::output::{OutputError, Raster};

/// Smallest width of a picture in a figure in pixels: narrower ones are enlarged by a whole factor.
const LEAST_WIDTH: f64 = 480.0;

/// Shortest colour bar in pixels.
const LEAST_BAR: f64 = 200.0;

const FOOTER_SIZE: f64 = 12.0;

/// Draws luminances in cd/m2, top row first, in the colours of a scale.
pub fn false_colour(
    heading: &Heading,
    [width, height]: [usize; 2],
    luminances: &[f64],
    scale: &ColourScale,
) -> Result<Drawing, OutputError> {
    if width == 0 || height == 0 || width.checked_mul(height) != Some(luminances.len()) {
        return Err(OutputError::Size { values: luminances.len(), width, height, channels: 1 });
    }
    let mut raster = Raster::filled(width, height, [0; 3]);
    for (pixel, luminance) in luminances.iter().enumerate() {
        raster.set(pixel % width, pixel / width, scale.colour(*luminance));
    }
    let (mut drawing, place) = framed(heading, raster, BAR_WIDTH + LABEL_WIDTH + 16.0, LEAST_BAR + 30.0);
    let left = place.to.x + 16.0;
    let bottom = place.to.y.max(place.from.y + LEAST_BAR + 30.0) - 6.0;
    let bar = Rectangle::new(left, place.from.y + 24.0, left + BAR_WIDTH, bottom.min(place.from.y + 480.0));
    scale.draw(&mut drawing, bar, "cd/m²");
    Ok(drawing)
}

/// Draws a tone-mapped picture, with a line below it that states the exposure.
pub fn captioned(heading: &Heading, raster: Raster, footer: &str) -> Drawing {
    let (mut drawing, place) = framed(heading, raster, 0.0, 0.0);
    let at = DVec2::new(place.from.x, place.to.y + 18.0);
    drawing.size.y += 20.0;
    // the figure was enlarged after its paper was drawn
    let below = Rectangle::new(0.0, place.to.y + 1.0, drawing.size.x, drawing.size.y);
    drawing.fill(Outline::rectangle(below.from, below.to), Colour::Paper, 1.0);
    drawing.text(at, footer, Type::new(FOOTER_SIZE, Colour::Muted));
    drawing
}

/// Creates a figure with a picture below its heading, and `right` pixels of room to the right of it; returns the picture's
/// rectangle, too.
fn framed(heading: &Heading, raster: Raster, right: f64, least_height: f64) -> (Drawing, Rectangle) {
    let pixels = DVec2::new(raster.width as f64, raster.height as f64);
    let times = (LEAST_WIDTH / pixels.x).ceil().max(1.0);
    let width = MARGIN + times * pixels.x + right + MARGIN;
    let from = DVec2::new(MARGIN, heading.height(width) + 8.0);
    let place = Rectangle { from, to: from + times * pixels };
    let size = DVec2::new(width, place.to.y.max(from.y + least_height) + MARGIN);
    let mut drawing = Drawing::new(size, heading.title.as_str());
    heading.draw(&mut drawing);
    drawing.picture(place, raster);
    drawing.line(Outline::rectangle(place.from, place.to), Line::new(Colour::Muted, 1.0));
    (drawing, place)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::scale::Palette;

    #[test]
    fn pictures_are_enlarged_by_whole_numbers_and_have_a_scale() {
        let scale = ColourScale::from_zero(40.0, Palette::Turbo);
        let drawing = false_colour(&Heading::of("room"), [200, 100], &[10.0; 20_000], &scale).unwrap();
        let texts: Vec<&str> = drawing.texts().collect();
        assert_eq!(texts, ["room", "0", "10", "20", "30", "40", "cd/m²"]);
        let crate::figure::drawing::Item::Picture(picture) = &drawing.items[2] else {
            panic!("{:?}", drawing.items[2])
        };
        assert_eq!(picture.place.size(), DVec2::new(600.0, 300.0));
        assert!(false_colour(&Heading::of("room"), [2, 2], &[1.0; 3], &scale).is_err());
    }

    #[test]
    fn an_exposure_is_printed() {
        let drawing = captioned(&Heading::of("room"), Raster::filled(480, 10, [9; 3]), "grey at 20 cd/m²");
        assert!(drawing.texts().any(|text| text == "grey at 20 cd/m²"));
    }
}
