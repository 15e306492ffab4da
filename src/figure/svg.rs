//! A figure as SVG: shapes with sub-pixel coordinates and embedded pictures, nothing that another file must provide.
//!
//! Every text is an outline with its words as its label. Colours of paper and ink change on dark pages by a style; who does
//! not know the style takes the attributes.

use std::fmt::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use glam::DVec2;

use super::colour::Colour;
use super::drawing::{Drawing, Item, Picture, Shape};
use super::outline::{Outline, Part};
use crate::output::{OutputError, png};

/// Colours whose fills and lines have styles.
const STYLED: [Colour; 4] = [Colour::Paper, Colour::Ink, Colour::Muted, Colour::Faint];

/// The figure as SVG text.
pub fn svg(drawing: &Drawing) -> Result<String, OutputError> {
    let mut text = String::new();
    let (width, height) = (number(drawing.size.x), number(drawing.size.y));
    let title = escaped(&drawing.title);
    text += &format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" role=\"img\" \
         aria-label=\"{title}\">\n<title>{title}</title>\n<style>@media (prefers-color-scheme: dark) {{\n"
    );
    for colour in STYLED {
        if let Some(style) = colour.style() {
            let dark = hexadecimal(colour.on_dark());
            text += &format!(".{style} {{ fill: {dark} }} .{style}-line {{ stroke: {dark} }}\n");
        }
    }
    text += "}</style>\n";
    for item in &drawing.items {
        match item {
            Item::Shape(shape) => add_shape(&mut text, shape),
            Item::Picture(picture) => add_picture(&mut text, picture)?,
        }
    }
    text += "</svg>\n";
    Ok(text)
}

fn add_shape(text: &mut String, shape: &Shape) {
    let mut attributes = String::new();
    let mut styles = Vec::new();
    match shape.fill {
        Some((colour, opacity)) => {
            attributes += &format!(" fill=\"{}\"", hexadecimal(colour.on_light()));
            if opacity < 1.0 {
                attributes += &format!(" fill-opacity=\"{}\"", number(opacity));
            }
            styles.extend(colour.style().map(str::to_owned));
        }
        None => attributes += " fill=\"none\"",
    }
    if let Some(line) = &shape.line {
        let (colour, width) = (hexadecimal(line.colour.on_light()), number(line.width));
        attributes += &format!(" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"");
        if !line.dashes.is_empty() {
            let dashes: Vec<String> = line.dashes.iter().map(|dash| number(*dash)).collect();
            attributes += &format!(" stroke-dasharray=\"{}\"", dashes.join(" "));
        }
        styles.extend(line.colour.style().map(|style| format!("{style}-line")));
    }
    if !styles.is_empty() {
        attributes += &format!(" class=\"{}\"", styles.join(" "));
    }
    if let Some(words) = &shape.text {
        attributes += &format!(" role=\"img\" aria-label=\"{}\"", escaped(&words.text));
    }
    *text += &format!("<path{attributes} d=\"{}\"/>\n", path(&shape.outline));
}

fn add_picture(text: &mut String, picture: &Picture) -> Result<(), OutputError> {
    let (from, size) = (picture.place.from, picture.place.size());
    let bytes = STANDARD.encode(png::encode(&picture.raster)?);
    *text += &format!(
        "<image x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" preserveAspectRatio=\"none\" image-rendering=\"pixelated\" \
         href=\"data:image/png;base64,{bytes}\"/>\n",
        number(from.x),
        number(from.y),
        number(size.x),
        number(size.y),
    );
    Ok(())
}

/// An outline as a path.
fn path(outline: &Outline) -> String {
    let mut path = String::new();
    let point = |point: DVec2| format!("{} {}", number(point.x), number(point.y));
    for part in &outline.0 {
        let written = match *part {
            Part::Move(to) => write!(path, "M{}", point(to)),
            Part::Line(to) => write!(path, "L{}", point(to)),
            Part::Quadratic(a, to) => write!(path, "Q{} {}", point(a), point(to)),
            Part::Cubic(a, b, to) => write!(path, "C{} {} {}", point(a), point(b), point(to)),
            Part::Close => write!(path, "Z"),
        };
        debug_assert!(written.is_ok(), "a string takes all");
    }
    path
}

/// A number with at most two decimals: a hundredth of a pixel.
fn number(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

fn hexadecimal([red, green, blue]: [u8; 3]) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// Text as the value of an attribute or an element: XML has no control characters, not even escaped.
pub fn escaped(text: &str) -> String {
    let mut escaped = String::new();
    for character in text.chars() {
        match character {
            '&' => escaped += "&amp;",
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            '"' => escaped += "&quot;",
            '\u{fffe}' | '\u{ffff}' => escaped.push(' '),
            character if character.is_control() => escaped.push(' '),
            character => escaped.push(character),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::drawing::{Line, Type};
    use crate::figure::outline::Rectangle;
    use crate::output::Raster;

    #[test]
    fn shapes_text_and_pictures_are_written() {
        let mut drawing = Drawing::new(DVec2::new(40.0, 20.5), "a < b & \"c\"\n");
        drawing.line(
            Outline::polyline([DVec2::new(0.123_456, -0.001), DVec2::new(1.0, 2.5)]),
            Line::new(Colour::Ink, 1.5).dashed(&[3.0, 2.0]),
        );
        drawing.text(DVec2::new(1.0, 9.0), "<5 lx", Type::new(10.0, Colour::Muted));
        drawing.picture(Rectangle::new(1.0, 2.0, 3.0, 4.0), Raster::filled(2, 2, [9; 3]));
        let svg = svg(&drawing).unwrap();
        for part in [
            "viewBox=\"0 0 40 20.5\"",
            "<title>a &lt; b &amp; &quot;c&quot; </title>",
            "<path fill=\"none\" stroke=\"#1b1f24\" stroke-width=\"1.5\" stroke-linejoin=\"round\" stroke-dasharray=\"3 2\" class=\"ink-line\" d=\"M0.12 0L1 2.5\"/>",
            "class=\"muted\" role=\"img\" aria-label=\"&lt;5 lx\"",
            "<image x=\"1\" y=\"2\" width=\"2\" height=\"2\"",
            "href=\"data:image/png;base64,iVBOR",
        ] {
            assert!(svg.contains(part), "{part} is not in {svg}");
        }
        assert_eq!(drawing.texts().collect::<Vec<_>>(), ["<5 lx"]);
    }
}
