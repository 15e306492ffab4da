//! Bright ring in the ceiling around the diffuser (the thesis' section 6.3).

use std::f64::consts::PI;

use glam::DVec3;
use serde_json::{Value, json};

use super::case::{Case, Tried, try_all};
use super::settings::{Progress, Settings};
use super::views::{Sight, record};
use super::{printed, scenes};
use crate::page::{Check, Figure, ReportError, Section, Table, with_standard_error};
use skyduct::estimate::FilmEstimate;
use skyduct::figure::false_colour::FalseColours;
use skyduct::figure::montage::montage;
use skyduct::geometry::disc::disc_disc_area;
use skyduct::output::png;
use skyduct::statistics::Moments;

/// Passes of the full report, and paths per pixel of path tracing.
const PASSES: u64 = 64;
const PATHS: u64 = 8;

/// Side of the picture relative to that of the other pictures: the ring is narrow.
const ENLARGED: f64 = 1.5;

/// Half the side of the visible part of the ceiling in metres.
const HALF_SIDE_M: f64 = 0.18;

/// Height of the eye in metres.
const EYE_M: f64 = 0.3;

/// Numbers of passes for which the faulty ring is computed.
const AFTER: [u64; 2] = [1, 1024];

/// Inner and outer distances of the rings beyond the rim of the diffuser, in multiples of the thesis' radius.
const RINGS: [[f64; 2]; 2] = [[0.0, 1.0], [1.0, 4.0]];

/// Number of combined standard errors within which photon mapping and path tracing must agree.
const STANDARD_ERRORS: f64 = 4.0;

pub fn sections(settings: &Settings, progress: Progress) -> Result<Vec<Section>, ReportError> {
    let document = scenes::passes(view(settings)?, settings.share(PASSES));
    let sight = Sight::of(&document)?;
    let zones = RINGS.map(|ring| pixels_in(&sight, ring));
    let path_tracing = json!({ "kind": "path_tracing", "samples_per_pixel": PATHS });
    let case = |name: &str, method: Value| Case::new(name, document.clone(), method);
    let cases = vec![
        case("path tracing", path_tracing),
        case("PPM, thesis' settings", scenes::thesis_method("ppm", settings)),
        case("SPPM, thesis' settings", scenes::thesis_method("sppm", settings)),
        case("SPPM, own settings", scenes::own_method("sppm", settings)),
    ];
    let Tried { results: all, left_out } = try_all(cases, |case, prepared| {
        progress(&format!("the ceiling around the diffuser: {}", case.name));
        Ok((case.name, record(prepared, &[], &zones)?))
    })?;
    let Some((_, reference)) = all.first() else { return Err(ReportError::Case(left_out)) };
    let measured = |value: &Moments| with_standard_error(value.mean, value.standard_error(), 4);
    let mut rows: Vec<Vec<String>> = all
        .iter()
        .map(|(name, recording)| [name.clone()].into_iter().chain(recording.zones.iter().map(measured)).collect())
        .collect();
    // light from above on the diffuser, by a method that follows light from the sky
    let at_diffuser = all.iter().filter_map(|(_, recording)| recording.estimate.tubes.first());
    let flux = at_diffuser.map(|tube| tube.at_diffuser).find(|flux| flux.count > 0.0 && flux.mean > 0.0);
    let on_diffuser_lux = flux.map_or(f64::NAN, |flux| flux.mean / (PI * scenes::PIPE_RADIUS_M.powi(2)));
    for passes in AFTER {
        let faulty = RINGS.map(|ring| faulty_luminance(on_diffuser_lux, ring, passes));
        let name = format!("light of the ring if the diffuser's photons count, after {passes} pass(es)");
        rows.push([name].into_iter().chain(faulty.map(|value| format!("{value:.2}"))).collect());
    }
    let mut checks = Vec::new();
    for (name, recording) in all.iter().skip(1) {
        let z = |(value, reference): (&Moments, &Moments)| {
            (value.mean - reference.mean).abs() / libm::hypot(value.standard_error(), reference.standard_error())
        };
        checks.push(Check {
            name: format!("{name}: luminance of the two rings against path tracing"),
            compared: RINGS.len(),
            worst: recording.zones.iter().zip(&reference.zones).map(z).fold(0.0, f64::max),
            limit: STANDARD_ERRORS,
            unit: "combined standard errors",
        });
    }
    let luminances =
        |film: &FilmEstimate| (0..film.m2.len()).map(|pixel| film.luminance_cd_m2(pixel)).collect::<Vec<_>>();
    let ceiling: Vec<f64> = {
        let values = luminances(&reference.film);
        (0..values.len()).filter(|pixel| sight.off_sources(*pixel)).map(|pixel| values[pixel]).collect()
    };
    // the scale is the ceiling's; the diffuser is far beyond it
    let colours = FalseColours::magnitudes(&ceiling.iter().chain(&[0.0]).copied().collect::<Vec<_>>(), 0.0, "cd/m2");
    let mut pictures = Vec::new();
    for (name, recording) in &all {
        let title = name.replace(", thesis' settings", " thesis").replace(", own settings", " own");
        pictures.push((title, colours.paint(sight.size_px, &luminances(&recording.film))?));
    }
    let ratio = faulty_luminance(on_diffuser_lux, RINGS[0], AFTER[1]) / reference.zones[0].mean;
    let radii = AFTER.map(radius_after);
    Ok(vec![Section {
        title: "6. What was left open: the bright ring around the diffuser".to_owned(),
        text: format!(
            "Figures 6.7 and 6.8 show a bright ring in the ceiling around the diffuser that does not fade; the thesis suspects \
             its model or energy of the first radius. The ceiling lies in the plane of the diffuser: their form factor is 0, \
             and all its light is reflected by the room. Photons that arrive on the diffuser from the pipe lie within the \
             0.01 inch of the plane that Appendix A (line 29) allows, so that a disc of the ceiling that reaches over \
             the rim counts them. Below, the luminance of the ceiling in cd/m2 in rings around the diffuser, from 0 to 1 and \
             from 1 to 4 first radii of the thesis (0.3 inch) beyond its rim, over pixels that lie in them whole ({} and {}), \
             after {} passes; then what the ring would show if discs counted the light on the diffuser ({on_diffuser_lux:.0} \
             lx, measured), by the overlap of two discs, with the radius of that pass.{left_out}",
            zones[0].len(),
            zones[1].len(),
            settings.share(PASSES),
        ),
        checks,
        tables: vec![Table {
            caption: "Luminance of the ceiling around the diffuser in cd/m2".to_owned(),
            head: ["method", "0 to 0.3 inch", "0.3 to 1.2 inch"].map(str::to_owned).into(),
            rows,
        }],
        figures: vec![Figure {
            file: "ring.png",
            caption: format!(
                "The ceiling around the diffuser from below in cd/m2, scale of the ceiling: {}.",
                all.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join("; ")
            ),
            bytes: png::encode(&colours.with_scale(&montage(&pictures, 2)?)?)?,
        }],
        conclusion: format!(
            "No ring is there when photons belong to the surface they lie on. A ring of counted diffuser light would be \
             {ratio:.0} times as bright as the ceiling in its mean over the first 0.3 inch even after {} passes, and would \
             not fade: its luminance at the rim does not depend on the radius, which only narrows it, from {:.1} mm to {:.1} \
             mm. The diffuser of the thesis is curved, and only the part of it within 0.01 inch of the ceiling counts: the \
             ring of its figures may be fainter. Light that the diffuser sends down again (section 4.2) brightens the room by the \
             factor in section 4, and no ring.",
            AFTER[1],
            1e3 * radii[0],
            1e3 * radii[1],
        ),
    }])
}

/// Returns the document of the closed room, with a view of the ceiling from under the pipe.
fn view(settings: &Settings) -> Result<Value, ReportError> {
    let mut document = scenes::room()?;
    let middle = 0.5 * scenes::ROOM_M;
    let side = (ENLARGED * settings.size_px as f64) as usize;
    let fov = 2.0 * libm::atan(HALF_SIDE_M / (scenes::ROOM_M - EYE_M));
    // the example's method computes grids only
    scenes::remove(&mut document, "method");
    document["views"] = json!([{
        "name": "ceiling", "eye_m": [middle, middle, EYE_M], "look_at_m": [middle, middle, scenes::ROOM_M],
        "up": [0, 1, 0], "vertical_fov_deg": fov.to_degrees(), "size_px": [side, side],
    }]);
    Ok(document)
}

/// Returns the pixels that lie entirely in a ring, judged by their centres with a margin of half a pixel's diagonal.
fn pixels_in(sight: &Sight, [from, to]: [f64; 2]) -> Vec<usize> {
    let axis = DVec3::new(0.5 * scenes::ROOM_M, 0.5 * scenes::ROOM_M, scenes::ROOM_M);
    // half a pixel's diagonal on the ceiling
    let slack = std::f64::consts::SQRT_2 * HALF_SIDE_M / sight.size_px[1] as f64;
    let within = |pixel: &usize| {
        sight.hit(*pixel).is_some_and(|hit| {
            let beyond = (hit.position - axis).length() - scenes::PIPE_RADIUS_M;
            let [low, high] = [from, to].map(|k| k * printed::INITIAL_RADIUS_M);
            hit.position.z == axis.z && beyond >= low + slack && beyond <= high - slack
        })
    };
    (0..sight.size_px[0] * sight.size_px[1]).filter(within).collect()
}

/// Computes the thesis' radius in m in the pass of this number, with photons in every pass: R_0 sqrt(Gamma(n + alpha) /
/// (Gamma(alpha) Gamma(n + 1))) after n of them, here n = `pass` - 1.
fn radius_after(pass: u64) -> f64 {
    let product: f64 = (1..pass).map(|i| (i as f64 - 1.0 + printed::ALPHA) / i as f64).product();
    printed::INITIAL_RADIUS_M * product.sqrt()
}

/// Computes the mean luminance in cd/m2 of a ring of the ceiling if discs counted the light on the diffuser, from this light
/// alone.
fn faulty_luminance(on_diffuser_lux: f64, [from, to]: [f64; 2], pass: u64) -> f64 {
    const STEPS: usize = 400;
    let (disc, pipe) = (radius_after(pass), scenes::PIPE_RADIUS_M);
    let (mut sum, mut area) = (0.0, 0.0);
    for step in 0..STEPS {
        let beyond = (from + (to - from) * (step as f64 + 0.5) / STEPS as f64) * printed::INITIAL_RADIUS_M;
        let distance = pipe + beyond;
        sum += distance * disc_disc_area(disc, pipe, distance) / (PI * disc * disc);
        area += distance;
    }
    scenes::CEILING_REFLECTANCE / PI * on_diffuser_lux * sum / area
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares R_n / R_0 for alpha = 0.8 with a table, after n passes that all find photons in proportion to their area.
    #[test]
    fn radii_of_the_thesis() {
        for (passes, ratio) in [(10, 0.733266), (200, 0.545495), (1024, 0.463376)] {
            assert!((radius_after(passes + 1) / printed::INITIAL_RADIUS_M - ratio).abs() < 1e-6, "{passes}");
        }
    }

    /// A disc that is small beside the pipe has half of its area on it at the rim.
    #[test]
    fn the_faulty_ring_is_half_as_bright_as_the_diffuser_at_its_rim() {
        let rim = faulty_luminance(1000.0, [0.0, 1e-3], 1_000_001);
        let half = 0.5 * scenes::CEILING_REFLECTANCE / PI * 1000.0;
        assert!((rim / half - 1.0).abs() < 0.02, "{rim} {half}");
        assert_eq!(faulty_luminance(1000.0, [1.0, 4.0], 1), 0.0);
    }
}
