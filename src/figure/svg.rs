//! Figures as SVG: shapes with sub-pixel coordinates and embedded pictures, without references to other files.
//!
//! The outline of each glyph is stored once per file; every text is a group of glyphs with the text as its label. A style
//! changes the colours of paper and ink on dark pages; viewers that do not support it use the attributes.

use std::collections::BTreeMap;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use glam::DVec2;

use super::colour::Colour;
use super::drawing::{Between, Direction, Drawing, Item, Line, Picture, RIM_WIDTH, Shape, Words};
use super::letters::{self, UNITS};
use super::outline::{Outline, Part};
use crate::output::{OutputError, png};

/// Colours whose fills and lines have CSS classes.
const STYLED: [Colour; 4] = [Colour::Paper, Colour::Ink, Colour::Muted, Colour::Faint];

/// Writes the figure as SVG.
pub fn svg(drawing: &Drawing) -> Result<String, OutputError> {
    let mut text = String::with_capacity(1 << 16);
    text += "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"";
    add_number(&mut text, drawing.size.x);
    text += "\" height=\"";
    add_number(&mut text, drawing.size.y);
    text += "\" viewBox=\"0 0 ";
    add_point(&mut text, drawing.size);
    let title = escaped(&drawing.title);
    for part in ["\" role=\"img\" aria-label=\"", &title, "\">\n<title>", &title, "</title>\n"] {
        text += part;
    }
    if !drawing.origin.is_empty() {
        text += &format!("<metadata>{}</metadata>\n", escaped(&drawing.origin));
    }
    text += "<style>@media (prefers-color-scheme: dark) {\n";
    for colour in STYLED {
        if let Some(style) = colour.style() {
            let dark = hexadecimal(colour.on_dark());
            text += &format!(".{style} {{ fill: {dark} }} .{style}-line {{ stroke: {dark} }}\n");
        }
    }
    text += "}</style>\n";
    add_letters(&mut text, drawing);
    for item in &drawing.items {
        match item {
            Item::Shape(shape) => add_shape(&mut text, shape),
            Item::Words(words) => add_words(&mut text, words),
            Item::Picture(picture) => add_picture(&mut text, picture)?,
        }
    }
    text += "</svg>\n";
    Ok(text)
}

/// Writes the outlines of all glyphs that the figure uses. The ids and outlines are the same in all figures, so that several
/// figures may be embedded in one page.
fn add_letters(text: &mut String, drawing: &Drawing) {
    let letters = drawing.texts().flat_map(str::chars).map(letters::letter).filter(|letter| !letter.path.is_empty());
    let letters: BTreeMap<u32, &str> = letters.map(|letter| (letter.code, letter.path)).collect();
    if letters.is_empty() {
        return;
    }
    *text += "<defs>\n";
    for (code, path) in letters {
        *text += &format!("<path id=\"letter-{code:x}\" d=\"{path}\"/>\n");
    }
    *text += "</defs>\n";
}

fn add_words(text: &mut String, words: &Words) {
    let place = |text: &mut String| {
        *text += " transform=\"translate(";
        add_point(text, words.at);
        // seven decimals: a hundredth of a pixel at the end of the longest line
        *text += &format!(") scale({:.7})", words.size / UNITS);
        if words.direction == Direction::Upwards {
            *text += " rotate(-90)";
        }
        *text += "\">";
        let mut pen = 0.0;
        for character in words.text.chars() {
            let letter = letters::letter(character);
            if !letter.path.is_empty() {
                *text += &format!("<use href=\"#letter-{:x}\" x=\"", letter.code);
                add_number(text, pen);
                *text += "\"/>";
            }
            pen += letter.advance;
        }
        *text += "</g>\n";
    };
    if let Some(rim) = words.rim {
        *text += "<g fill=\"none\"";
        add_line(text, &Line::new(rim, RIM_WIDTH * UNITS));
        add_styles(text, None, Some(rim));
        place(text);
    }
    *text += "<g";
    add_fill(text, words.colour, 1.0);
    add_styles(text, Some(words.colour), None);
    for part in [" role=\"img\" aria-label=\"", &escaped(&words.text), "\""] {
        *text += part;
    }
    place(text);
}

fn add_shape(text: &mut String, shape: &Shape) {
    *text += "<path";
    match shape.fill {
        Some((colour, opacity)) => add_fill(text, colour, opacity),
        None => *text += " fill=\"none\"",
    }
    if let Some(line) = &shape.line {
        add_line(text, line);
    }
    add_styles(text, shape.fill.map(|(colour, _)| colour), shape.line.as_ref().map(|line| line.colour));
    *text += " d=\"";
    add_path(text, &shape.outline);
    *text += "\"/>\n";
}

fn add_fill(text: &mut String, colour: Colour, opacity: f64) {
    for part in [" fill=\"", &hexadecimal(colour.on_light()), "\""] {
        *text += part;
    }
    if opacity < 1.0 {
        add_attribute(text, "fill-opacity", [opacity]);
    }
}

fn add_line(text: &mut String, line: &Line) {
    for part in [" stroke=\"", &hexadecimal(line.colour.on_light()), "\""] {
        *text += part;
    }
    add_attribute(text, "stroke-width", [line.width]);
    *text += " stroke-linejoin=\"round\"";
    if !line.dashes.is_empty() {
        add_attribute(text, "stroke-dasharray", line.dashes.iter().copied());
    }
}

/// Writes the CSS classes of a fill and a line, where they have any.
fn add_styles(text: &mut String, fill: Option<Colour>, line: Option<Colour>) {
    let fill = fill.and_then(Colour::style);
    let line = line.and_then(Colour::style).map(|style| format!("{style}-line"));
    let styles: Vec<&str> = fill.into_iter().chain(line.as_deref()).collect();
    if !styles.is_empty() {
        for part in [" class=\"", &styles.join(" "), "\""] {
            *text += part;
        }
    }
}

/// Writes an attribute that is a list of numbers.
fn add_attribute(text: &mut String, name: &str, numbers: impl IntoIterator<Item = f64>) {
    for part in [" ", name, "=\""] {
        *text += part;
    }
    for (index, number) in numbers.into_iter().enumerate() {
        if index > 0 {
            text.push(' ');
        }
        add_number(text, number);
    }
    text.push('"');
}

fn add_picture(text: &mut String, picture: &Picture) -> Result<(), OutputError> {
    let (from, size) = (picture.place.from, picture.place.size());
    *text += "<image";
    for (name, value) in [("x", from.x), ("y", from.y), ("width", size.x), ("height", size.y)] {
        add_attribute(text, name, [value]);
    }
    *text += " preserveAspectRatio=\"none\"";
    if picture.between == Between::Edges {
        *text += " image-rendering=\"pixelated\"";
    }
    *text += " href=\"data:image/png;base64,";
    STANDARD.encode_string(png::encode(&picture.raster)?, text);
    *text += "\"/>\n";
    Ok(())
}

/// Writes an outline as path data.
fn add_path(text: &mut String, outline: &Outline) {
    for part in &outline.0 {
        let (command, points): (char, &[DVec2]) = match part {
            Part::Move(to) => ('M', &[*to]),
            Part::Line(to) => ('L', &[*to]),
            Part::Quadratic(a, to) => ('Q', &[*a, *to]),
            Part::Cubic(a, b, to) => ('C', &[*a, *b, *to]),
            Part::Close => ('Z', &[]),
        };
        text.push(command);
        for (index, point) in points.iter().enumerate() {
            if index > 0 {
                text.push(' ');
            }
            add_point(text, *point);
        }
    }
}

fn add_point(text: &mut String, point: DVec2) {
    add_number(text, point.x);
    text.push(' ');
    add_number(text, point.y);
}

/// Writes a number with at most two decimals: a hundredth of a pixel.
fn add_number(text: &mut String, value: f64) {
    let hundredths = (100.0 * value).round();
    if hundredths.is_nan() || hundredths.abs() >= 1e15 {
        // a number that no valid figure contains: written all the same, so that the error is visible
        *text += &value.to_string();
        return;
    }
    let mut rest = hundredths.abs() as u64;
    if hundredths < 0.0 {
        text.push('-');
    }
    // digits from the last one, without trailing zeros
    let mut digits = [0u8; 20];
    let mut first = digits.len();
    let mut place = 0;
    while rest > 0 || place < 3 {
        let digit = b'0' + (rest % 10) as u8;
        rest /= 10;
        let is_decimal = place < 2;
        place += 1;
        if is_decimal && digit == b'0' && first == digits.len() {
            continue;
        }
        first -= 1;
        digits[first] = digit;
        if place == 2 {
            first -= 1;
            digits[first] = b'.';
        }
    }
    text.extend(digits[first..].iter().map(|digit| char::from(*digit)));
}

fn hexadecimal([red, green, blue]: [u8; 3]) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// Escapes text as the value of an attribute or an element; control characters, which XML does not allow, become spaces.
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
            "class=\"muted\" role=\"img\" aria-label=\"&lt;5 lx\" transform=\"translate(1 9) scale(0.0048828)\"><use href=\"#letter-3c\" x=\"0\"/>",
            "<image x=\"1\" y=\"2\" width=\"2\" height=\"2\"",
            "href=\"data:image/png;base64,iVBOR",
        ] {
            assert!(svg.contains(part), "{part} is not in {svg}");
        }
        assert_eq!(drawing.texts().collect::<Vec<_>>(), ["<5 lx"]);
    }

    #[test]
    fn numbers_have_as_many_decimals_as_they_need_and_two_at_most() {
        for (value, written) in [
            (0.0, "0"),
            (-0.004, "0"),
            (12.0, "12"),
            (100.0, "100"),
            (-1.5, "-1.5"),
            (0.05, "0.05"),
            (-0.5, "-0.5"),
            (10.1, "10.1"),
            (123_456.789, "123456.79"),
            (f64::NAN, "NaN"),
        ] {
            let mut text = String::new();
            add_number(&mut text, value);
            assert_eq!(text, written);
        }
    }

    /// The outline of a letter is written once, however often it is used, and each use begins where the letter before it ends.
    #[test]
    fn letters_are_drawn_once() {
        let mut drawing = Drawing::new(DVec2::new(40.0, 20.0), "");
        let look = Type::new(20.48, Colour::Ink);
        drawing.text(DVec2::new(1.0, 9.0), "l l", look.rimmed(Colour::Paper));
        drawing.text(DVec2::new(5.0, 9.0), "l", look.upwards());
        drawing.text(DVec2::new(5.0, 9.0), " ", look);
        let svg = svg(&drawing).unwrap();
        assert_eq!(svg.matches("<path id=\"letter-6c\" d=\"M").count(), 1, "{svg}");
        let second = letters::width("l ", UNITS);
        assert_eq!(svg.matches(&format!("<use href=\"#letter-6c\" x=\"{second}\"/>")).count(), 2, "{svg}");
        assert_eq!(svg.matches("<use").count(), 5, "{svg}");
        assert!(svg.contains("translate(5 9) scale(0.0100000) rotate(-90)\">"), "{svg}");
        assert!(
            svg.contains("stroke-width=\"573.44\" stroke-linejoin=\"round\" class=\"paper-line\" transform"),
            "{svg}"
        );
    }
}
