//! Figures as PDF, each on a page of its size: the same shapes as in SVG, in the colours of light paper.
//!
//! Letters are outlines, as in the other formats. Invisible text in Courier, which every viewer has, is laid over each text, so
//! that it can be searched and copied.

use glam::DVec2;
use miniz_oxide::deflate::compress_to_vec_zlib;
use pdf_writer::types::{LineJoinStyle, TextRenderingMode};
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref, Str, TextStr};

use super::colour::Colour;
use super::drawing::{Between, Direction, Drawing, Item, Line, Picture, Shape, Words};
use super::outline::{Outline, Part};
use crate::output::{OutputError, Raster};

/// Points of PDF (72 per inch) per pixel (96 per inch).
const POINTS: f64 = 72.0 / 96.0;

/// Level of deflate: the lowest reduces lines and letters to a third, and higher ones hardly save more.
const LEVEL: u8 = 1;

/// Advance width of every letter of Courier, in sizes of the type.
const COURIER: f64 = 0.6;

/// Resource name of the font of invisible text.
const FONT: Name = Name(b"F");

/// Numbers of the objects that every file has; those of pages, pictures and opacities follow.
const CATALOG: i32 = 1;
const PAGES: i32 = 2;
const COURIER_FONT: i32 = 3;
const INFORMATION: i32 = 4;
const FIRST_FREE: i32 = 5;

/// Writes figures as the pages of a PDF file, which has the title of the first.
pub fn pdf(drawings: &[Drawing]) -> Result<Vec<u8>, OutputError> {
    let mut pdf = Pdf::new();
    pdf.catalog(Ref::new(CATALOG)).pages(Ref::new(PAGES));
    let mut font = pdf.type1_font(Ref::new(COURIER_FONT));
    font.base_font(Name(b"Courier")).encoding_predefined(Name(b"WinAnsiEncoding"));
    font.finish();
    let mut kids = Vec::new();
    let mut free = FIRST_FREE;
    for drawing in drawings {
        let mut page = Page::new(drawing);
        for item in &drawing.items {
            match item {
                Item::Shape(shape) => page.add_shape(shape),
                Item::Words(words) => page.add_words(words),
                Item::Picture(picture) => page.add_picture(picture)?,
            }
        }
        kids.push(Ref::new(free));
        free = page.write(drawing, &mut pdf, free);
    }
    pdf.pages(Ref::new(PAGES)).count(kids.len() as i32).kids(kids);
    let title = drawings.first().map_or("", |drawing| &drawing.title);
    let origin = drawings.iter().map(|drawing| drawing.origin.as_str()).find(|origin| !origin.is_empty());
    let mut information = pdf.document_info(Ref::new(INFORMATION));
    information.title(TextStr(title)).creator(TextStr(origin.unwrap_or("skyduct")));
    information.finish();
    Ok(pdf.finish())
}

/// Content of a page, with the pictures and opacities that it refers to by their index.
struct Page<'a> {
    content: Content,
    pictures: Vec<&'a Picture>,
    /// Opacities in percent.
    opacities: Vec<u8>,
}

impl<'a> Page<'a> {
    fn new(drawing: &Drawing) -> Self {
        let mut content = Content::new();
        // y runs downwards in figures, and upwards in PDF
        let scale = POINTS as f32;
        content.transform([scale, 0.0, 0.0, -scale, 0.0, (POINTS * drawing.size.y) as f32]);
        content.set_line_join(LineJoinStyle::RoundJoin);
        Self { content, pictures: Vec::new(), opacities: Vec::new() }
    }

    fn add_shape(&mut self, shape: &Shape) {
        let opacity = shape.fill.map(|(_, opacity)| (100.0 * opacity).round() as u8).filter(|percent| *percent < 100);
        if let Some(percent) = opacity {
            let name = opacity_name(percent);
            if !self.opacities.contains(&percent) {
                self.opacities.push(percent);
            }
            self.content.save_state();
            self.content.set_parameters(Name(name.as_bytes()));
        }
        if let Some((fill, _)) = shape.fill {
            self.set_fill(fill);
        }
        if let Some(line) = &shape.line {
            self.set_line(line);
        }
        add_path(&mut self.content, &shape.outline);
        match (shape.fill.is_some(), shape.line.is_some()) {
            (true, true) => self.content.fill_nonzero_and_stroke(),
            (true, false) => self.content.fill_nonzero(),
            (false, true) => self.content.stroke(),
            (false, false) => self.content.end_path(),
        };
        if opacity.is_some() {
            self.content.restore_state();
        }
    }

    fn set_fill(&mut self, fill: Colour) {
        let [red, green, blue] = rgb(fill);
        self.content.set_fill_rgb(red, green, blue);
    }

    fn set_line(&mut self, line: &Line) {
        let [red, green, blue] = rgb(line.colour);
        self.content.set_stroke_rgb(red, green, blue);
        self.content.set_line_width(line.width as f32);
        self.content.set_dash_pattern(line.dashes.iter().map(|dash| *dash as f32), 0.0);
    }

    fn add_words(&mut self, words: &Words) {
        let outline = words.outline();
        if let Some(rim) = &words.rim() {
            self.set_line(rim);
            add_path(&mut self.content, &outline);
            self.content.stroke();
        }
        self.set_fill(words.colour);
        add_path(&mut self.content, &outline);
        self.content.fill_nonzero();
        self.add_plain_words(words);
    }

    /// Adds the invisible text, stretched to the width of the outlines, so that both begin and end together.
    fn add_plain_words(&mut self, words: &Words) {
        let letters: Vec<u8> = words.text.chars().map(in_windows_1252).collect();
        if letters.is_empty() || words.size <= 0.0 {
            return;
        }
        let stretch = 100.0 * words.width / (COURIER * words.size * letters.len() as f64);
        let [x, y] = rounded(words.at);
        let content = &mut self.content;
        content.begin_text();
        content.set_text_rendering_mode(TextRenderingMode::Invisible);
        content.set_font(FONT, words.size as f32);
        content.set_horizontal_scaling(stretch as f32);
        content.set_text_matrix(match words.direction {
            Direction::Level => [1.0, 0.0, 0.0, -1.0, x, y],
            Direction::Upwards => [0.0, -1.0, -1.0, 0.0, x, y],
        });
        content.show(Str(&letters));
        content.end_text();
    }

    fn add_picture(&mut self, picture: &'a Picture) -> Result<(), OutputError> {
        let Picture { place, raster, .. } = picture;
        let Raster { width, height, pixels } = raster;
        if width.checked_mul(*height).and_then(|count| count.checked_mul(3)) != Some(pixels.len()) {
            return Err(OutputError::Size { values: pixels.len(), width: *width, height: *height, channels: 3 });
        }
        let (from, size) = (place.from, place.size());
        let name = picture_name(self.pictures.len());
        self.pictures.push(picture);
        self.content.save_state();
        // in PDF a picture is the unit square, with its first row at the top
        self.content.transform([size.x, 0.0, 0.0, -size.y, from.x, from.y + size.y].map(|value| value as f32));
        self.content.x_object(Name(name.as_bytes()));
        self.content.restore_state();
        Ok(())
    }

    /// Writes the page with its objects, whose numbers begin at `number`, that of the page; returns the next free number.
    fn write(self, drawing: &Drawing, pdf: &mut Pdf, number: i32) -> i32 {
        let Self { content, pictures, opacities } = self;
        let (content_number, first_picture) = (number + 1, number + 2);
        let first_opacity = first_picture + pictures.len() as i32;
        let next_free = first_opacity + opacities.len() as i32;
        let [width, height] = (POINTS * drawing.size).to_array().map(|length| length as f32);
        let mut page = pdf.page(Ref::new(number));
        page.media_box(Rect::new(0.0, 0.0, width, height));
        page.parent(Ref::new(PAGES));
        page.contents(Ref::new(content_number));
        let mut resources = page.resources();
        resources.fonts().pair(FONT, Ref::new(COURIER_FONT));
        let mut objects = resources.x_objects();
        for index in 0..pictures.len() {
            objects.pair(Name(picture_name(index).as_bytes()), Ref::new(first_picture + index as i32));
        }
        objects.finish();
        let mut states = resources.ext_g_states();
        for (index, percent) in opacities.iter().enumerate() {
            states.pair(Name(opacity_name(*percent).as_bytes()), Ref::new(first_opacity + index as i32));
        }
        states.finish();
        resources.finish();
        page.finish();
        let compressed = compress_to_vec_zlib(&content.finish(), LEVEL);
        pdf.stream(Ref::new(content_number), &compressed).filter(Filter::FlateDecode);
        for (index, Picture { raster, between, .. }) in pictures.into_iter().enumerate() {
            let compressed = compress_to_vec_zlib(&raster.pixels, LEVEL);
            let mut image = pdf.image_xobject(Ref::new(first_picture + index as i32), &compressed);
            image.filter(Filter::FlateDecode);
            image.width(raster.width as i32).height(raster.height as i32).bits_per_component(8);
            image.interpolate(*between == Between::Blends);
            image.color_space().device_rgb();
        }
        for (index, percent) in opacities.into_iter().enumerate() {
            let opacity = f32::from(percent) / 100.0;
            pdf.ext_graphics(Ref::new(first_opacity + index as i32)).non_stroking_alpha(opacity);
        }
        next_free
    }
}

fn picture_name(index: usize) -> String {
    format!("P{index}")
}

fn opacity_name(percent: u8) -> String {
    format!("O{percent}")
}

fn rgb(colour: Colour) -> [f32; 3] {
    colour.on_light().map(|value| f32::from(value) / 255.0)
}

/// Rounds coordinates to a thousandth of a pixel, which keeps files short.
fn rounded(point: DVec2) -> [f32; 2] {
    point.to_array().map(|value| ((1000.0 * value).round() / 1000.0) as f32)
}

fn add_path(content: &mut Content, outline: &Outline) {
    let mut pen = DVec2::ZERO;
    let mut first = DVec2::ZERO;
    for part in &outline.0 {
        pen = match *part {
            Part::Move(to) => {
                let [x, y] = rounded(to);
                content.move_to(x, y);
                first = to;
                to
            }
            Part::Line(to) => {
                let [x, y] = rounded(to);
                content.line_to(x, y);
                to
            }
            // PDF has cubic curves only
            Part::Quadratic(control, to) => {
                add_curve(content, pen.lerp(control, 2.0 / 3.0), to.lerp(control, 2.0 / 3.0), to);
                to
            }
            Part::Cubic(a, b, to) => {
                add_curve(content, a, b, to);
                to
            }
            Part::Close => {
                content.close_path();
                first
            }
        };
    }
}

fn add_curve(content: &mut Content, a: DVec2, b: DVec2, to: DVec2) {
    let ([ax, ay], [bx, by], [x, y]) = (rounded(a), rounded(b), rounded(to));
    content.cubic_to(ax, ay, bx, by, x, y);
}

/// Returns a letter in Windows-1252 (WinAnsiEncoding in PDF), or a question mark.
fn in_windows_1252(letter: char) -> u8 {
    match letter {
        ' '..='~' | '\u{a0}'..='\u{ff}' => letter as u8,
        '−' => b'-',
        '–' => 0x96,
        '—' => 0x97,
        '…' => 0x85,
        letter if letter.is_whitespace() => b' ',
        _ => b'?',
    }
}

#[cfg(test)]
mod tests {
    use miniz_oxide::inflate::decompress_to_vec_zlib;

    use super::*;
    use crate::figure::drawing::Type;
    use crate::figure::outline::Rectangle;

    /// Returns the inflated streams of a file as text.
    fn streams(file: &[u8]) -> String {
        let positions = |mark: &[u8]| -> Vec<usize> {
            let found = file.windows(mark.len()).enumerate().filter(|(_, window)| *window == mark);
            found.map(|(position, _)| position).collect()
        };
        let (ends, begins) = (positions(b"\nendstream"), positions(b"stream\n"));
        let begins = begins.into_iter().filter(|begin| !file[..*begin].ends_with(b"end"));
        let inflated = begins.zip(ends).map(|(begin, end)| {
            let bytes = decompress_to_vec_zlib(&file[begin + 7..end]).unwrap();
            String::from_utf8_lossy(&bytes).into_owned()
        });
        inflated.collect()
    }

    #[test]
    fn shapes_words_and_pictures_are_written() {
        let mut drawing = Drawing::new(DVec2::new(400.0, 200.0), "a test");
        drawing.line(
            Outline::polyline([DVec2::new(1.0, 2.0), DVec2::new(30.0, 2.123_456)]),
            Line::new(Colour::Fixed([255, 0, 0]), 2.0).dashed(&[3.0, 1.0]),
        );
        drawing.fill(Outline::circle(DVec2::new(50.0, 50.0), 10.0), Colour::Fixed([0, 255, 0]), 0.25);
        drawing.text(DVec2::new(10.0, 90.0), "211 lx ± 0.3 − 1", Type::new(12.0, Colour::Ink));
        drawing.picture(Rectangle::new(100.0, 20.0, 120.0, 30.0), Raster::filled(2, 1, [9, 8, 7]));
        let second = Drawing::new(DVec2::new(40.0, 20.0), "small print");
        let file = pdf(&[drawing, second]).unwrap();
        let plain = String::from_utf8_lossy(&file);
        for part in [
            "%PDF-",
            "/MediaBox [0 0 300 150]",
            "/MediaBox [0 0 30 15]",
            "/Count 2",
            "/ca 0.25",
            "/Width 2",
            "/Courier",
            "(a test)",
            "%%EOF",
        ] {
            assert!(plain.contains(part), "{part} is not in {plain}");
        }
        let content = streams(&file);
        for part in [
            "0.75 0 0 -0.75 0 150 cm",
            "1 0 0 RG\n2 w\n[3 1] 0 d\n1 2 m\n30 2.123 l\nS",
            "/O25 gs",
            "3 Tr\n/F 12 Tf",
            "1 0 0 -1 10 90 Tm",
            "20 0 0 -10 100 30 cm\n/P0 Do",
        ] {
            assert!(content.contains(part), "{part} is not in {content}");
        }
        assert_eq!("±−–中".chars().map(in_windows_1252).collect::<Vec<_>>(), [0xb1, b'-', 0x96, b'?']);
    }

    #[test]
    fn a_picture_of_another_size_than_it_says_is_refused() {
        let mut drawing = Drawing::new(DVec2::new(10.0, 10.0), "");
        let raster = Raster { pixels: vec![0; 5], ..Raster::filled(2, 1, [0; 3]) };
        drawing.picture(Rectangle::new(0.0, 0.0, 1.0, 1.0), raster);
        assert!(matches!(pdf(&[drawing]), Err(OutputError::Size { .. })));
    }
}
