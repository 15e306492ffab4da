//! Figures of a view: luminance in false colours on a scale for the room's surfaces, and tone-mapped pictures with their exposure.

use super::subject::{Subject, by};
use crate::figure::axes::Spacing;
use crate::figure::scale::{ColourScale, Palette};
use crate::figure::ticks::significant;
use crate::figure::{Drawing, view_picture};
use crate::integrator::backward::room_entry::enter_room;
use crate::output::png::ToneMapping;
use crate::output::seen::SeenView;
use crate::output::{Image, OutputError};
use crate::present::prepared::Prepared;
use crate::scene::View;
use crate::traceable::Place;

/// Ratio of the upper to the lower end of a logarithmic scale.
const DECADES: f64 = 1000.0;

/// Options of a false-colour picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewWishes {
    /// Luminance at the upper end of the scale in cd/m2, above zero; `None` for one that includes 99 % of the pixels that see no source.
    pub scale_end_cd_m2: Option<f64>,
    /// Spacing of luminances along the scale.
    pub spacing: Spacing,
    /// Colours of the scale.
    pub palette: Palette,
}

impl Default for ViewWishes {
    fn default() -> Self {
        Self { scale_end_cd_m2: None, spacing: Spacing::Linear, palette: Palette::Turbo }
    }
}

impl Prepared {
    /// Finds the pixels of a view whose centres see a light source, an opening or the outside: one value per pixel, row by row.
    pub fn sources_seen(&self, view: &View) -> Vec<bool> {
        let [width, height] = view.size_px;
        let sees_source = |pixel: usize| {
            let direction = view.ray_direction((pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5);
            let Some(eye) = enter_room(&self.traceable, view.eye, direction) else { return true };
            match self.traceable.intersect(eye, direction, None).place {
                Place::Opening(_) => true,
                Place::Surface(surface) => {
                    let emits = self.traceable.luminaire(surface).is_some_and(|luminaire| luminaire.emits());
                    // an open face shows the sky
                    emits || self.traceable.optics(surface).is_none()
                }
            }
        };
        (0..width * height).map(sees_source).collect()
    }
}

/// Draws the luminance of a view in false colours.
pub fn false_colour_figure(
    subject: &Subject,
    name: &str,
    view: &SeenView,
    wishes: ViewWishes,
) -> Result<Drawing, OutputError> {
    let end = wishes.scale_end_cd_m2.unwrap_or_else(|| view.room_luminance_cd_m2());
    let scale = ColourScale::from_zero(end, wishes.palette);
    let scale = match wishes.spacing {
        Spacing::Linear => scale,
        Spacing::Logarithmic => ColourScale { from: scale.to / DECADES, spacing: Spacing::Logarithmic, ..scale },
    };
    let brightest = view.luminances.iter().copied().filter(|luminance| luminance.is_finite()).fold(0.0, f64::max);
    let mut lines = vec![subject.circumstances(), of_view(subject, name)];
    if brightest > 1.01 * scale.to {
        let (end, brightest) = (significant(scale.to, 3), significant(brightest, 3));
        lines.push(format!("the scale ends at {end} cd/m²; the brightest pixel has {brightest}"));
    }
    let heading = subject.heading(format!("Luminance, {}", subject.name()), lines);
    view_picture::false_colour(&heading, view.size_px, &view.luminances, &scale)
}

/// Draws a picture as seen by an eye that is adapted to a luminance, which is printed below it. `image` is the view in one or three
/// channels.
pub fn captioned_figure(
    subject: &Subject,
    name: &str,
    image: Image,
    tone: ToneMapping,
) -> Result<Drawing, OutputError> {
    let lines = vec![subject.circumstances(), of_view(subject, name)];
    let heading = subject.heading(format!("View, {}", subject.name()), lines);
    let adaptation = significant(tone.adaptation_cd_m2(), 3);
    let footer = format!("exposure: {adaptation} cd/m² are shown as middle grey");
    Ok(view_picture::captioned(&heading, tone.apply(image)?, &footer))
}

fn of_view(subject: &Subject, name: &str) -> String {
    format!("{name}{}", by(&subject.views_method))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::document::NoFiles;
    use crate::present::prepared::prepare;
    use crate::present::subject::tests::document;

    /// Returns a grey room with a source 100 times as bright in its middle.
    fn seen() -> SeenView {
        let lit = |pixel: usize| (8..12).contains(&(pixel % 20)) && (8..12).contains(&(pixel / 20));
        SeenView {
            size_px: [20, 20],
            luminances: (0..400).map(|pixel| if lit(pixel) { 3000.0 } else { 10.0 + (pixel % 20) as f64 }).collect(),
            sources: (0..400).map(lit).collect(),
        }
    }

    #[test]
    fn the_scale_ends_where_the_room_does() {
        assert_eq!(seen().room_luminance_cd_m2(), 29.0);
        let unknown = SeenView { sources: Vec::new(), ..seen() };
        assert_eq!(unknown.room_luminance_cd_m2(), 3000.0);
        let subject = Subject::new(&document(), &json!(null));
        let drawing = false_colour_figure(&subject, "room", &seen(), ViewWishes::default()).unwrap();
        let texts: Vec<&str> = drawing.texts().collect();
        for text in ["Luminance, bath", "the scale ends at 29.0 cd/m²; the brightest pixel has 3000", "20", "cd/m²"] {
            assert!(texts.contains(&text), "{text}: {texts:?}");
        }
        let wishes =
            ViewWishes { scale_end_cd_m2: Some(5000.0), spacing: Spacing::Logarithmic, palette: Palette::Grey };
        let drawing = false_colour_figure(&subject, "room", &seen(), wishes).unwrap();
        assert!(drawing.texts().any(|text| text == "1000") && !drawing.texts().any(|text| text.contains("ends at")));
    }

    #[test]
    fn an_eye_below_a_tube_sees_its_opening_as_a_source() {
        let mut document = document();
        document["views"] = json!([{ "name": "up", "eye_m": [1.5, 1.5, 1.0], "look_at_m": [1.5, 1.5, 2.7], "up": [0, 1, 0],
                                     "vertical_fov_deg": 60, "size_px": [21, 21] }]);
        let prepared = prepare(document.to_string().as_bytes(), &NoFiles).unwrap();
        let sources = prepared.sources_seen(&prepared.scene.views[0]);
        assert!(sources[10 * 21 + 10] && !sources[0] && !sources[440]);
    }
}
