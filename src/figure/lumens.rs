//! Flow diagram (Sankey) of the flux of a tube from the collector into the room: losses branch off, and widths are proportional
//! to lumens.

use glam::DVec2;

use super::colour::Colour;
use super::drawing::{Drawing, Type};
use super::heading::Heading;
use super::outline::{Outline, Part};
use super::ticks::{significant, with_error};

/// Width in pixels of the stream of the greatest flux.
const WIDEST: f64 = 170.0;

/// Width in pixels of the narrowest stream that is drawn.
const NARROWEST: f64 = 1.0;

const WIDTH: f64 = 680.0;
const LEFT: f64 = 60.0;
const BEND: f64 = 14.0;
const STRAIGHT: f64 = 54.0;
const LIGHT: Colour = Colour::Fixed([240, 190, 70]);
const LOST: Colour = Colour::Fixed([170, 178, 186]);

/// Stage of the light's path through a tube.
#[derive(Clone, Debug, PartialEq)]
pub struct Stage {
    /// Name of the stage.
    pub name: String,
    /// Flux at this stage in lm.
    pub flux_lm: f64,
    /// Half width of the 95 % confidence interval of the flux in lm, where it was estimated.
    pub half_interval_lm: Option<f64>,
    /// Name of the loss between the stage before and this one.
    pub loss: String,
}

/// Draws the stream from the first stage to the last; where the flux rises, no loss is drawn.
pub fn lumens(heading: &Heading, stages: &[Stage]) -> Drawing {
    let most = stages.iter().map(|stage| stage.flux_lm).fold(0.0, f64::max);
    let width = |flux: f64| if most > 0.0 { (WIDEST * flux / most).max(NARROWEST) } else { NARROWEST };
    let widths: Vec<f64> = stages.iter().map(|stage| width(stage.flux_lm)).collect();
    let mut y = heading.height(WIDTH) + 30.0;
    let drops: Vec<f64> = widths.windows(2).map(|pair| (pair[0] - pair[1]).max(0.0)).collect();
    let height = y + drops.iter().map(|drop| 2.0 * STRAIGHT + BEND + drop).sum::<f64>() + STRAIGHT + 50.0;
    let mut drawing = Drawing::new(DVec2::new(WIDTH, height), heading.title.as_str());
    heading.draw(&mut drawing);
    let right = LEFT + WIDEST + 110.0;
    for (index, stage) in stages.iter().enumerate() {
        let wide = widths[index];
        let before = index.checked_sub(1).map(|before| (&stages[before], drops[before]));
        if let Some((before, drop)) = before {
            let lost = before.flux_lm - stage.flux_lm;
            let end = y + BEND + drop;
            if lost > 0.0 {
                drawing.fill(branch(LEFT + wide, drop.max(NARROWEST), y, right), LOST, 0.8);
                let share = 100.0 * lost / stages[0].flux_lm;
                let text = format!("{}: {} lm, {} %", stage.loss, significant(lost, 3), significant(share, 2));
                let at = DVec2::new(right + 34.0, y + BEND + 0.5 * drop);
                drawing.text_centred(at, text, Type::new(12.0, Colour::Muted));
            }
            let below = end + STRAIGHT;
            drawing.fill(Outline::rectangle(DVec2::new(LEFT, y), DVec2::new(LEFT + wide, below)), LIGHT, 1.0);
            y = below;
        }
        let flux = match stage.half_interval_lm.filter(|half| *half > 0.0) {
            Some(half) => format!("{} lm (95 %)", with_error(stage.flux_lm, half)),
            None => format!("{} lm", significant(stage.flux_lm, 4)),
        };
        let text = format!("{}: {flux}", stage.name);
        let at = DVec2::new(LEFT + wide + 14.0, y + 14.0);
        drawing.fill(Outline::rectangle(DVec2::new(LEFT, y), DVec2::new(LEFT + wide, y + STRAIGHT)), LIGHT, 1.0);
        drawing.fill(
            Outline::rectangle(DVec2::new(LEFT - 8.0, y), DVec2::new(LEFT + wide + 8.0, y + 2.0)),
            Colour::Ink,
            1.0,
        );
        drawing.text(at, text, Type::new(13.0, Colour::Ink));
        y += STRAIGHT;
    }
    if let Some(wide) = widths.last() {
        let [a, b] = [DVec2::new(LEFT - 8.0, y), DVec2::new(LEFT + wide + 8.0, y)];
        let tip = DVec2::new(LEFT + 0.5 * wide, y + (0.35 * wide).clamp(8.0, 34.0));
        drawing.fill(Outline::polygon([a, b, tip]), LIGHT, 1.0);
    }
    drawing
}

/// Returns the outline of a branch of width `wide` that leaves downwards at x = `left` and y, bends to the right and ends in an
/// arrow at `right`.
fn branch(left: f64, wide: f64, y: f64, right: f64) -> Outline {
    let at = DVec2::new;
    let (near, far) = (BEND, BEND + wide);
    let centre = at(left + wide + BEND, y);
    let quarter = 0.552_284_749_830_793_4;
    let head = (0.4 * wide).clamp(5.0, 20.0);
    let (upper, lower) = (y + near, y + far);
    Outline(vec![
        Part::Move(at(left, y)),
        Part::Cubic(at(left, y + quarter * far), at(centre.x - quarter * far, lower), at(centre.x, lower)),
        Part::Line(at(right, lower)),
        Part::Line(at(right, lower + 4.0)),
        Part::Line(at(right + head, 0.5 * (upper + lower))),
        Part::Line(at(right, upper - 4.0)),
        Part::Line(at(right, upper)),
        Part::Line(at(centre.x, upper)),
        Part::Cubic(
            at(centre.x - quarter * near, upper),
            at(centre.x - near, y + quarter * near),
            at(centre.x - near, y),
        ),
        Part::Close,
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::svg::svg;

    #[test]
    fn losses_are_what_is_missing() {
        let stage = |name: &str, flux_lm: f64, loss: &str| Stage {
            name: name.to_owned(),
            flux_lm,
            half_interval_lm: Some(4.2),
            loss: loss.to_owned(),
        };
        let stages = [
            stage("at the collector", 6000.0, ""),
            stage("at the diffuser", 4800.0, "collector and guide"),
            stage("into the room", 2884.0, "diffuser"),
        ];
        let drawing = lumens(&Heading::of("Lumens of tube 0"), &stages);
        let texts: Vec<&str> = drawing.texts().collect();
        for text in [
            "at the collector: 6000.0 ± 4.2 lm (95 %)",
            "collector and guide: 1200 lm, 20 %",
            "diffuser: 1920 lm, 32 %",
            "into the room: 2884.0 ± 4.2 lm (95 %)",
        ] {
            assert!(texts.contains(&text), "{text}: {texts:?}");
        }
        assert!(!svg(&lumens(&Heading::default(), &[])).unwrap().contains("NaN"));
        assert!(
            !svg(&lumens(&Heading::default(), &[stage("a", 0.0, ""), stage("b", 0.0, "")])).unwrap().contains("NaN")
        );
    }
}
