//! Energy loss at boundaries: gather discs that reach over a wall (PPM's flat-disc estimate, the thesis' section 6.1).

use std::f64::consts::PI;

use glam::DVec3;

use super::case::Case;
use super::photons::FloorPhotons;
use super::scenes;
use super::settings::{Progress, Settings};
use super::views::first_radius_m;
use crate::page::{Check, Figure, ReportError, Section, Table, with_standard_error};
use crate::run::render_all;
use skyduct::figure::Heading;
use skyduct::figure::axes::Axis;
use skyduct::figure::curves::{Series, curves};
use skyduct::figure::svg::svg;
use skyduct::figure::ticks::Steps;
use skyduct::integrator::photon_map::domain::Domain;
use skyduct::integrator::photon_map::grid::PhotonGrid;
use skyduct::scene::Face;
use skyduct::statistics::Moments;
use skyduct::traceable::SurfaceId;

/// Passes in the full report.
const PASSES: u64 = 128;

/// Cells of the grid along x, fine enough for six of them within a radius of the wall, and along y.
const CELLS: [usize; 2] = [121, 5];

/// Number of sensors along x that are compared, counted from the wall.
const COMPARED: usize = 8;

/// Tolerances of the difference between measured and expected ratios: a number of standard errors, and a fraction for the
/// illuminance's change along y within a disc, which the expectation leaves out.
const STANDARD_ERRORS: f64 = 4.0;
const LEFT_OUT: f64 = 0.003;

/// Number of strips of a disc over which the illuminance is averaged.
const STRIPS: usize = 400;

/// Returns the fraction of a disc that lies on a surface when its centre is `x` radii from a straight edge.
fn inside_share(x: f64) -> f64 {
    if x >= 1.0 { 1.0 } else { 1.0 - (libm::acos(x) - x * (1.0 - x * x).sqrt()) / PI }
}

/// Averages a function of x, in radii from the edge, over the part of a disc around `x` that lies on the surface.
fn mean_on_disc(x: f64, value: impl Fn(f64) -> f64) -> f64 {
    let (mut sum, mut area) = (0.0, 0.0);
    for strip in 0..STRIPS {
        let offset = 2.0 * (strip as f64 + 0.5) / STRIPS as f64 - 1.0;
        if x + offset >= 0.0 {
            let chord = (1.0 - offset * offset).sqrt();
            sum += chord * value(x + offset);
            area += chord;
        }
    }
    sum / area
}

/// Interpolates linearly between values at equal steps, the first at half a step, and extrapolates beyond the ends.
fn between(values: &[f64], step: f64, x: f64) -> f64 {
    let position = (x / step - 0.5).max(-0.5);
    let low = (position.max(0.0) as usize).min(values.len() - 2);
    values[low] + (position - low as f64) * (values[low + 1] - values[low])
}

pub fn sections(settings: &Settings, progress: Progress) -> Result<Vec<Section>, ReportError> {
    progress("energy at the boundaries");
    let document = scenes::floor(CELLS, true)?;
    let radius = first_radius_m(&serde_json::Value::Null, scenes::ROOM_M);
    let truth_case = Case::new("HOLIGILM", document.clone(), "holigilm".into());
    let prepared = truth_case.prepare().map_err(ReportError::Case)?;
    let truth = render_all(&prepared, |_| {})?;
    let (Some(grid), Some(truth)) = (prepared.grids().first(), truth.grids.first()) else {
        return Err(ReportError::Case("a job without a grid".to_owned()));
    };
    let photons = FloorPhotons::new(&document, settings.photons_per_pass, 1)?;
    let domain = Domain::horizontal_plane(&photons.traceable, 0.0);
    let whole_area = PI * radius * radius;
    let mut whole = vec![Moments::default(); COMPARED];
    let mut clipped = whole.clone();
    for pass in 0..settings.share(PASSES) {
        let map = PhotonGrid::new(&photons.pass(pass), radius);
        for i in 0..COMPARED {
            let (mut by_whole, mut by_clipped) = (0.0, 0.0);
            for j in 0..CELLS[1] {
                let point = DVec3::new(grid.x_m[i], grid.y_m[j], 0.0);
                let flux = map.gather(point, radius, SurfaceId::of_face(Face::Floor)).0;
                let lux = truth.illuminance_lux(j * CELLS[0] + i);
                by_whole += flux.0[0] / whole_area / lux / CELLS[1] as f64;
                by_clipped += flux.0[0] / domain.area(point, radius) / lux / CELLS[1] as f64;
            }
            whole[i].push(by_whole);
            clipped[i].push(by_clipped);
        }
    }
    let x = |i: usize| grid.x_m[i] / radius;
    let profile: Vec<f64> = (0..CELLS[0])
        .map(|i| (0..CELLS[1]).map(|j| truth.illuminance_lux(j * CELLS[0] + i)).sum::<f64>() / CELLS[1] as f64)
        .collect();
    // a clipped disc lies to one side of its centre, so that its mean differs from the illuminance there
    let step = grid.cell_size_m[0] / radius;
    let one_sided = |i: usize| mean_on_disc(x(i), |x| between(&profile, step, x)) / profile[i];
    let expected_whole = |i: usize| inside_share(x(i)) * one_sided(i);
    let measured = |value: &Moments| with_standard_error(value.mean, value.standard_error(), 4);
    let row = |i: usize| {
        vec![
            format!("{:.3}", x(i)),
            format!("{:.4}", inside_share(x(i))),
            format!("{:.4}", expected_whole(i)),
            measured(&whole[i]),
            format!("{:.4}", one_sided(i)),
            measured(&clipped[i]),
        ]
    };
    let deviation = |value: &Moments, expected: f64| {
        let allowed = STANDARD_ERRORS * value.standard_error() + LEFT_OUT;
        (value.mean - expected).abs() / allowed
    };
    let worst = |values: &[Moments], expected: &dyn Fn(usize) -> f64| {
        (0..COMPARED).map(|i| deviation(&values[i], expected(i))).fold(0.0, f64::max)
    };
    let unit = "of four standard errors and 0.3 %";
    let checks = vec![
        Check {
            name: "whole discs: measured over true illuminance against the closed form".to_owned(),
            compared: COMPARED,
            worst: worst(&whole, &expected_whole),
            limit: 1.0,
            unit,
        },
        Check {
            name: "clipped discs: measured over true illuminance against the mean on the clipped disc".to_owned(),
            compared: COMPARED,
            worst: worst(&clipped, &one_sided),
            limit: 1.0,
            unit,
        },
    ];
    let marks = |values: &[Moments]| (0..COMPARED).map(|i| (x(i), values[i].mean)).collect();
    let expected = |value: &dyn Fn(usize) -> f64| (0..COMPARED).map(|i| (x(i), value(i))).collect();
    let closed = |x: f64| (x, inside_share(x));
    let series = [
        Series {
            name: "whole discs".to_owned(),
            line: expected(&expected_whole),
            marks: marks(&whole),
            ..Series::default()
        },
        Series {
            name: "clipped discs".to_owned(),
            line: expected(&one_sided),
            marks: marks(&clipped),
            ..Series::default()
        },
        Series {
            name: "share of the disc inside".to_owned(),
            line: (0..=130).map(|k| closed(f64::from(k) / 100.0)).collect(),
            ..Series::default()
        },
    ];
    let distance = Axis::linear("distance from the wall in radii", [0.0, 1.3], 7, Steps::Decimal);
    let ratio = Axis::linear("measured over true illuminance", [0.4, 1.1], 7, Steps::Decimal);
    let heading = Heading::of("Discs of density estimation beside a wall");
    let figure = svg(&curves(&heading, &series, distance, ratio))?;
    let printed_shares = [0.0, 0.1, 0.25, 0.5, 0.75].map(closed);
    Ok(vec![Section {
        title: "7. What was left open: energy at the boundaries".to_owned(),
        text: format!(
            "A disc at x radii from a straight edge has the share 1 - (acos x - x sqrt(1 - x^2)) / pi of its area on the \
             surface: {}, and a quarter in a right-angled corner. Divided by the area of the whole disc, as equation 5.11 \
             does, the estimate is too small by that factor, and a smaller radius only narrows the dark rim. Measured on \
             the floor near the west wall of the room of section 2 with interreflection: photons of {} passes, gathered \
             within {radius:.4} m around {} points at each distance, all light by density estimation as in the thesis; the \
             true illuminance is HOLIGILM's. A clipped disc lies to one side of its centre and sees the gradient there: expected values \
             are the share inside and the mean of HOLIGILM's illuminance over the disc. That bias grows with the radius and \
             vanishes with it, unlike the lost share.",
            printed_shares.map(|(x, share)| format!("{share:.4} at x = {x}")).join(", "),
            settings.share(PASSES),
            CELLS[1],
        ),
        checks,
        tables: vec![Table {
            caption: "Measured over true illuminance by the distance from the wall in radii".to_owned(),
            head: [
                "x",
                "share inside",
                "whole disc, expected",
                "whole disc, measured",
                "clipped disc, expected",
                "clipped disc, measured",
            ]
            .map(str::to_owned)
            .into(),
            rows: (0..COMPARED).map(row).collect(),
        }],
        figures: vec![Figure {
            file: "boundary.svg",
            caption: "Illuminance near a wall, measured with whole and with clipped discs, over the true one."
                .to_owned(),
            bytes: figure.into_bytes(),
        }],
        conclusion: format!(
            "The floor's mean loses {:.2} % by whole discs of 0.3 inch: the boundaries explain a dark rim in the pictures, \
             but no difference of means between the methods, and none upward.",
            100.0 * mean_loss(super::printed::INITIAL_RADIUS_M / scenes::ROOM_M),
        ),
    }])
}

/// Returns the fraction of the light that whole discs lose on a square floor; `radius` in sides of the floor: four rims of one
/// radius, whose mean loss is the integral of 1 - [`inside_share`], 2 / (3 pi).
pub fn mean_loss(radius: f64) -> f64 {
    4.0 * radius * 2.0 / (3.0 * PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_of_the_closed_form() {
        for (x, share) in [(0.0, 0.5), (0.1, 0.5636), (0.25, 0.6575), (0.5, 0.8045), (0.75, 0.9279), (1.0, 1.0)] {
            assert!((inside_share(x) - share).abs() < 0.5e-4, "{x}");
        }
        let steps = 100_000;
        let integral: f64 = (0..steps).map(|k| 1.0 - inside_share((f64::from(k) + 0.5) / f64::from(steps))).sum();
        // the centroid of a half disc, and a whole one
        assert!((mean_on_disc(0.0, |x| x) - 4.0 / (3.0 * PI)).abs() < 1e-4);
        assert!((mean_on_disc(1.5, |x| x) - 1.5).abs() < 1e-9);
        assert_eq!([0.0, 1.0, 2.0].map(|x| between(&[1.0, 3.0, 7.0], 1.0, x)), [0.0, 2.0, 5.0]);
        assert!((mean_loss(0.25) - integral / f64::from(steps)).abs() < 1e-6);
    }
}
