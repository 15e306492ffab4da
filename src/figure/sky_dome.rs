//! Sky as a dome seen from above: its luminance, the sun, and the sun's path over the day.

use std::f64::consts::FRAC_PI_2;

use glam::{DVec2, DVec3};

use super::colour::{BLACK, Colour, WHITE};
use super::drawing::{Anchor, Drawing, Line, Type};
use super::heading::{Heading, MARGIN};
use super::outline::{Outline, Part, Rectangle};
use super::scale::{BAR_WIDTH, ColourScale, LABEL_WIDTH, Palette};
use crate::output::Raster;

/// Radius of the horizon in a figure, in pixels.
const RADIUS: f64 = 210.0;

/// Number of pixels across the dome: luminance changes little between neighbours, and viewers interpolate them.
const PIXELS: usize = 105;

/// Largest zenith angle of computed pixels, relative to the horizon's: pixels just below the horizon are interpolated with it.
const LOWEST: f64 = 1.0 + 4.0 / PIXELS as f64;

/// Fraction of the dome's pixels within the colour scale: the brightest, around the sun, are beyond it.
const HELD: f64 = 0.995;

/// Altitudes in degrees at which circles are drawn.
const CIRCLES_DEG: [f64; 2] = [30.0, 60.0];

/// Position of the sun in the sky.
#[derive(Clone, Debug, PartialEq)]
pub struct SunAt {
    /// Altitude above the horizon in radians.
    pub altitude: f64,
    /// Azimuth clockwise from north in radians.
    pub azimuth: f64,
    /// Label beside this position (the hour), if any.
    pub label: Option<String>,
}

/// Draws the figure of a sky. `luminance`: cd/m2 toward a unit vector (x east, y north, z up); `sun`: its position; `path`: its
/// positions over the day, in order.
pub fn sky_dome(heading: &Heading, luminance: impl Fn(DVec3) -> f64, sun: Option<&SunAt>, path: &[SunAt]) -> Drawing {
    let left = MARGIN + 24.0 + RADIUS;
    let bar_left = left + RADIUS + 44.0;
    let width = bar_left + BAR_WIDTH + LABEL_WIDTH + 8.0;
    let centre = DVec2::new(left, heading.height(width) + 30.0 + RADIUS);
    let size = DVec2::new(width, centre.y + RADIUS + 34.0);
    let mut drawing = Drawing::new(size, heading.title.as_str());
    heading.draw(&mut drawing);
    let values = dome(luminance);
    let scale = scale_of(&values);
    let mut raster = Raster::filled(PIXELS, PIXELS, [0; 3]);
    for (pixel, value) in values.iter().enumerate() {
        raster.set(pixel % PIXELS, pixel / PIXELS, scale.colour(*value));
    }
    let around = Rectangle { from: centre - RADIUS, to: centre + RADIUS };
    drawing.smooth_picture(around, raster);
    // cover everything below the horizon
    let mut below = Outline(vec![
        Part::Move(around.from - 1.0),
        Part::Line(DVec2::new(around.from.x - 1.0, around.to.y + 1.0)),
        Part::Line(around.to + 1.0),
        Part::Line(DVec2::new(around.to.x + 1.0, around.from.y - 1.0)),
        Part::Close,
    ]);
    below.add_circle(centre, RADIUS);
    drawing.fill(below, Colour::Paper, 1.0);
    let place = |altitude: f64, azimuth: f64| {
        let (sin, cos) = libm::sincos(azimuth);
        centre + RADIUS * (1.0 - altitude.to_degrees() / 90.0) * DVec2::new(sin, -cos)
    };
    for degrees in CIRCLES_DEG {
        let radius = RADIUS * (1.0 - degrees / 90.0);
        drawing.line(Outline::circle(centre, radius), Line::new(WHITE, 0.8).dashed(&[4.0, 4.0]));
        let look = Type::new(11.0, BLACK).anchored(Anchor::Middle).rimmed(WHITE);
        drawing.text_centred(centre + DVec2::new(0.0, radius), format!("{degrees}°"), look);
    }
    drawing.line(Outline::circle(centre, RADIUS), Line::new(Colour::Ink, 1.5));
    for (name, azimuth) in [("N", 0.0), ("E", 90.0), ("S", 180.0), ("W", 270.0f64)] {
        let (sin, cos) = libm::sincos(azimuth.to_radians());
        let at = centre + (RADIUS + 14.0) * DVec2::new(sin, -cos);
        drawing.text_centred(at, name, Type::new(13.0, Colour::Ink).anchored(Anchor::Middle));
    }
    draw_path(&mut drawing, path, &place);
    if let Some(sun) = sun.filter(|sun| sun.altitude > 0.0) {
        let at = place(sun.altitude, sun.azimuth);
        drawing.filled_line(Outline::circle(at, 8.0), Colour::Fixed([255, 220, 60]), Line::new(BLACK, 1.5));
    }
    let bar = Rectangle::new(bar_left, around.from.y + 20.0, bar_left + BAR_WIDTH, around.to.y);
    scale.draw(&mut drawing, bar, "cd/m²");
    drawing
}

/// Returns the centre of a pixel, to the east and north; the horizon has radius 1.
fn place_of(pixel: usize) -> DVec2 {
    let half = 0.5 * PIXELS as f64;
    DVec2::new((pixel % PIXELS) as f64 + 0.5 - half, half - (pixel / PIXELS) as f64 - 0.5) / half
}

/// Computes the luminance of every pixel in cd/m2, top row first: just below the horizon that of the horizon, further down 0.
fn dome(luminance: impl Fn(DVec3) -> f64) -> Vec<f64> {
    let value = |pixel: usize| {
        let place = place_of(pixel);
        let zenith_angle = place.length();
        if zenith_angle > LOWEST {
            return 0.0;
        }
        let (sin, cos) = libm::sincos(FRAC_PI_2 * zenith_angle.min(1.0));
        let level = if zenith_angle > 0.0 { sin / zenith_angle * place } else { DVec2::ZERO };
        luminance(level.extend(cos.max(0.0)))
    };
    (0..PIXELS * PIXELS).map(value).collect()
}

fn scale_of(values: &[f64]) -> ColourScale {
    let above = values.iter().enumerate().filter(|(pixel, _)| place_of(*pixel).length() <= 1.0);
    let mut seen: Vec<f64> = above.map(|(_, value)| *value).filter(|value| value.is_finite()).collect();
    let index = (HELD * seen.len().saturating_sub(1) as f64).round() as usize;
    let held = match seen.is_empty() {
        true => 0.0,
        false => *seen.select_nth_unstable_by(index, f64::total_cmp).1,
    };
    ColourScale::from_zero(held, Palette::Viridis)
}

/// Draws the sun's path above the horizon, with its hours.
fn draw_path(drawing: &mut Drawing, path: &[SunAt], place: &impl Fn(f64, f64) -> DVec2) {
    let mut outline = Outline::default();
    for pair in path.windows(2) {
        // interpolated crossing of the horizon between two positions
        let cut = |from: &SunAt, to: &SunAt| {
            let share = from.altitude / (from.altitude - to.altitude);
            place(0.0, from.azimuth + share * (to.azimuth - from.azimuth))
        };
        let at = |sun: &SunAt| place(sun.altitude, sun.azimuth);
        let [a, b] = [&pair[0], &pair[1]];
        match (a.altitude >= 0.0, b.altitude >= 0.0) {
            (true, true) => outline.add_polyline([at(a), at(b)]),
            (true, false) if a.altitude > 0.0 => outline.add_polyline([at(a), cut(a, b)]),
            (false, true) if b.altitude > 0.0 => outline.add_polyline([cut(a, b), at(b)]),
            _ => {}
        }
    }
    drawing.line(outline.clone(), Line::new(WHITE, 3.5));
    drawing.line(outline, Line::new(BLACK, 1.4));
    for sun in path.iter().filter(|sun| sun.altitude > 0.0) {
        let Some(label) = &sun.label else { continue };
        let at = place(sun.altitude, sun.azimuth);
        drawing.filled_line(Outline::circle(at, 2.5), BLACK, Line::new(WHITE, 1.0));
        let look = Type::new(10.5, BLACK).anchored(Anchor::Middle).rimmed(WHITE);
        drawing.text_centred(at + DVec2::new(0.0, -11.0), label.as_str(), look);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::svg::svg;
    use crate::sky::{CieType, Sky, SkyDistribution, direction};

    #[test]
    fn a_dome_has_its_directions_hours_and_scale() {
        let sun = SunAt { altitude: 0.6, azimuth: 3.0, label: None };
        let cie = CieType::new(12).unwrap();
        let distribution = SkyDistribution::new(cie, direction(sun.altitude, sun.azimuth));
        let sky = Sky::new(distribution, 3000.0);
        let path: Vec<SunAt> = (0..24)
            .map(|hour| {
                let azimuth = (15.0 * f64::from(hour)).to_radians();
                let altitude = -0.6 * azimuth.cos();
                SunAt { altitude, azimuth, label: (hour % 3 == 0).then(|| hour.to_string()) }
            })
            .collect();
        let drawing = sky_dome(&Heading::of("sky"), |direction| sky.luminance(direction), Some(&sun), &path);
        let texts: Vec<&str> = drawing.texts().collect();
        for text in ["sky", "N", "E", "S", "W", "30°", "60°", "9", "12", "15", "cd/m²"] {
            assert!(texts.contains(&text), "{text}: {texts:?}");
        }
        assert!(!texts.contains(&"3"), "below the horizon");
        assert!(!svg(&drawing).unwrap().contains("NaN"));
        sky_dome(&Heading::default(), |_| 0.0, None, &[]);
    }

    #[test]
    fn north_is_up_and_east_is_right() {
        let values = dome(|direction| direction.x + 10.0 * direction.y);
        let at = |x: usize, y: usize| values[y * PIXELS + x];
        assert!(at(PIXELS / 2, 2) > 9.9 && at(PIXELS - 3, PIXELS / 2) > 0.9);
        assert_eq!(at(0, 0), 0.0);
        // the zenith is in the middle, and the horizon goes on a little below itself
        let heights = dome(|direction| direction.z);
        assert!(heights[PIXELS * PIXELS / 2] > 0.9999);
        let just_below = 44 * PIXELS;
        assert!(place_of(just_below).length() > 1.0 && heights[just_below] < 1e-12);
    }
}
