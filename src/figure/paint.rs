//! Figures in pixels: the same shapes as in SVG, rasterised with anti-aliasing by tiny-skia.

use tiny_skia::{
    Color, FillRule, FilterQuality, LineCap, LineJoin, Paint, PathBuilder, Pixmap, PixmapPaint, Stroke, StrokeDash,
    Transform,
};

use super::colour::Colour;
use super::drawing::{Between, Drawing, Item, Line, Picture, Shape, Words};
use super::outline::{Outline, Part};
use crate::output::{OutputError, Raster, png};

/// Longest side of a painted figure in pixels.
const LONGEST: f64 = 16_384.0;

/// Pixels per unit of a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// One pixel per unit, at which the sizes of type are nominal.
    Single,
    /// Two pixels per unit, for high-resolution screens and print.
    Double,
}

/// Writes the figure as a PNG file, in the colours of light paper.
pub fn png(drawing: &Drawing, scale: Scale) -> Result<Vec<u8>, OutputError> {
    png::encode_with_origin(&paint(drawing, scale)?, &drawing.origin)
}

/// Paints the figure in pixels, in the colours of light paper.
pub fn paint(drawing: &Drawing, scale: Scale) -> Result<Raster, OutputError> {
    let scale = match scale {
        Scale::Single => 1.0f64,
        Scale::Double => 2.0,
    };
    let [width, height] = (scale * drawing.size).ceil().clamp(glam::DVec2::ONE, glam::DVec2::splat(LONGEST)).to_array();
    let pixmap = Pixmap::new(width as u32, height as u32);
    let mut pixmap = pixmap.ok_or_else(|| OutputError::Plot("the figure has too many pixels".to_owned()))?;
    pixmap.fill(colour(Colour::Paper, 1.0));
    let transform = Transform::from_scale(scale as f32, scale as f32);
    for item in &drawing.items {
        match item {
            Item::Shape(shape) => paint_shape(&mut pixmap, shape, transform),
            Item::Words(words) => paint_words(&mut pixmap, words, transform),
            Item::Picture(picture) => paint_picture(&mut pixmap, picture, transform)?,
        }
    }
    // the paper is opaque, so that premultiplied colours are the colours
    let pixels = pixmap.data().chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
    Ok(Raster { width: width as usize, height: height as usize, pixels })
}

fn paint_shape(pixmap: &mut Pixmap, shape: &Shape, transform: Transform) {
    // an outline without extent, or with numbers beyond f32, has no path
    let Some(path) = path(&shape.outline) else { return };
    if let Some((fill, opacity)) = shape.fill {
        pixmap.fill_path(&path, &paint_of(fill, opacity), FillRule::Winding, transform, None);
    }
    if let Some(line) = &shape.line {
        pixmap.stroke_path(&path, &paint_of(line.colour, 1.0), &stroke(line), transform, None);
    }
}

fn paint_words(pixmap: &mut Pixmap, words: &Words, transform: Transform) {
    let Some(path) = path(&words.outline()) else { return };
    if let Some(rim) = &words.rim() {
        pixmap.stroke_path(&path, &paint_of(rim.colour, 1.0), &stroke(rim), transform, None);
    }
    pixmap.fill_path(&path, &paint_of(words.colour, 1.0), FillRule::Winding, transform, None);
}

fn paint_picture(pixmap: &mut Pixmap, picture: &Picture, transform: Transform) -> Result<(), OutputError> {
    let Raster { width, height, pixels } = &picture.raster;
    let size = || OutputError::Size { values: pixels.len(), width: *width, height: *height, channels: 3 };
    let mut source = Pixmap::new(*width as u32, *height as u32).ok_or_else(size)?;
    for (to, from) in source.data_mut().chunks_exact_mut(4).zip(pixels.chunks_exact(3)) {
        to.copy_from_slice(&[from[0], from[1], from[2], 255]);
    }
    let (from, extent) = (picture.place.from, picture.place.size());
    let stretch = extent / glam::DVec2::new(*width as f64, *height as f64);
    let place = transform.pre_translate(from.x as f32, from.y as f32).pre_scale(stretch.x as f32, stretch.y as f32);
    let quality = match picture.between {
        Between::Edges => FilterQuality::Nearest,
        Between::Blends => FilterQuality::Bilinear,
    };
    let paint = PixmapPaint { quality, ..PixmapPaint::default() };
    pixmap.draw_pixmap(0, 0, source.as_ref(), &paint, place, None);
    Ok(())
}

fn path(outline: &Outline) -> Option<tiny_skia::Path> {
    let mut builder = PathBuilder::new();
    for part in &outline.0 {
        match *part {
            Part::Move(to) => builder.move_to(to.x as f32, to.y as f32),
            Part::Line(to) => builder.line_to(to.x as f32, to.y as f32),
            Part::Quadratic(a, to) => builder.quad_to(a.x as f32, a.y as f32, to.x as f32, to.y as f32),
            Part::Cubic(a, b, to) => {
                builder.cubic_to(a.x as f32, a.y as f32, b.x as f32, b.y as f32, to.x as f32, to.y as f32);
            }
            Part::Close => builder.close(),
        }
    }
    builder.finish()
}

fn colour(colour: Colour, opacity: f64) -> Color {
    let [red, green, blue] = colour.on_light();
    Color::from_rgba8(red, green, blue, (255.0 * opacity).round() as u8)
}

fn paint_of(of: Colour, opacity: f64) -> Paint<'static> {
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    paint.set_color(colour(of, opacity));
    paint
}

fn stroke(line: &Line) -> Stroke {
    let dashes = line.dashes.iter().map(|dash| *dash as f32).collect::<Vec<_>>();
    Stroke {
        width: line.width as f32,
        line_cap: LineCap::Butt,
        line_join: LineJoin::Round,
        dash: if dashes.is_empty() { None } else { StrokeDash::new(dashes, 0.0) },
        ..Stroke::default()
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::figure::outline::Rectangle;

    #[test]
    fn shapes_and_pictures_stand_where_their_coordinates_say() {
        let mut drawing = Drawing::new(DVec2::new(40.0, 30.0), "test");
        drawing.fill(Outline::rectangle(DVec2::new(10.0, 10.0), DVec2::new(20.0, 20.0)), Colour::Fixed([1, 2, 3]), 1.0);
        drawing.line(
            Outline::polyline([DVec2::new(0.0, 25.0), DVec2::new(40.0, 25.0)]),
            Line::new(Colour::Fixed([200, 0, 0]), 2.0),
        );
        let mut raster = Raster::filled(2, 1, [0, 0, 250]);
        raster.set(1, 0, [0, 250, 0]);
        drawing.picture(Rectangle::new(24.0, 4.0, 34.0, 9.0), raster);
        for (scale, times) in [(Scale::Single, 1), (Scale::Double, 2)] {
            let painted = paint(&drawing, scale).unwrap();
            assert_eq!((painted.width, painted.height), (40 * times, 30 * times));
            let at = |x: usize, y: usize| painted.get(x * times, y * times);
            assert_eq!([at(15, 15), at(5, 5), at(21, 15)], [[1, 2, 3], [255; 3], [255; 3]]);
            assert_eq!([at(20, 25), at(20, 28)], [[200, 0, 0], [255; 3]]);
            assert_eq!([at(26, 6), at(32, 6), at(36, 6)], [[0, 0, 250], [0, 250, 0], [255; 3]]);
        }
    }
}
