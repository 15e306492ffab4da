//! Text in pixels, for montages, painted with the same glyphs as in figures.

use glam::DVec2;

use super::colour::Colour;
use super::drawing::{Drawing, Type};
use super::letters;
use super::paint::{Scale, paint};
use crate::output::{OutputError, Raster};

/// Size of the type in pixels.
const SIZE: f64 = 15.0;

/// Height of a line of text in pixels.
pub const LINE_PX: usize = 20;

/// Returns the width of a text in pixels.
pub fn width_px(text: &str) -> usize {
    (letters::width(text, SIZE).ceil() as usize).max(1)
}

/// Writes a text on white with its upper left corner at (`x`, `y`), clipped at the edges of the picture.
pub fn write(picture: &mut Raster, x: usize, y: usize, text: &str) -> Result<(), OutputError> {
    let mut drawing = Drawing::new(DVec2::new(width_px(text) as f64, LINE_PX as f64), text);
    let base = DVec2::new(0.0, 0.5 * (LINE_PX as f64 + letters::CAPITAL_HEIGHT * SIZE));
    drawing.text(base, text, Type::new(SIZE, Colour::Ink));
    let words = paint(&drawing, Scale::Single)?;
    if x < picture.width && y < picture.height {
        picture.draw(x, y, &words);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_ink_on_white_where_they_shall_be() {
        let mut picture = Raster::filled(60, 40, [255; 3]);
        write(&mut picture, 10, 12, "PPM").unwrap();
        write(&mut picture, 70, 12, "beyond").unwrap();
        let dark = |x: usize, y: usize| picture.get(x, y)[0] < 128;
        assert!((10..10 + width_px("PPM")).any(|x| (12..12 + LINE_PX).any(|y| dark(x, y))));
        assert!((0..60).all(|x| (0..12).all(|y| !dark(x, y))) && (0..10).all(|x| (0..40).all(|y| !dark(x, y))));
    }
}
