//! Figure of a tube: the transmission of its collector and guide for sunlight at every altitude.

use super::subject::Subject;
use crate::document::result::tube_report::TubeReport;
use crate::document::result::{FluxResult, TubeResult};
use crate::figure::Drawing;
use crate::figure::axes::Axis;
use crate::figure::curves::{Series, curves};
use crate::figure::ticks::{Steps, fixed, significant, with_error};
use crate::plan::GuideKind;

/// Draws the transmission of beams against the sun's altitude, with the tube's fluxes above it.
pub fn tube_figure(subject: &Subject, report: &TubeReport) -> Drawing {
    let heading = subject.heading(
        format!("Tube {}, {}", report.tube + 1, subject.name()),
        vec![subject.circumstances(), fluxes(report)],
    );
    let beam = &report.beam;
    let factor = report.coverage_factor.unwrap_or_default();
    let series = |name: String, values: &[f64], errors: &[f64]| {
        let line: Vec<_> = beam.altitude_deg.iter().copied().zip(values.iter().copied()).collect();
        Series {
            name,
            marks: line.clone(),
            line,
            errors: errors.iter().map(|error| factor * error).collect(),
            dashed: false,
        }
    };
    let azimuth = format!("sun {}° clockwise from the room's +y axis", fixed(beam.azimuth_deg, 1));
    let mut all = vec![series(azimuth, &beam.transmission, &beam.standard_error)];
    if report.guide != GuideKind::ClosedFormStraight.code() {
        let (mean, errors) = (&beam.azimuth_mean_transmission, &beam.azimuth_mean_standard_error);
        all.push(series("mean over azimuths".to_owned(), mean, errors));
    }
    let altitude = Axis::linear("altitude of the sun in degrees", [0.0, 90.0], 6, Steps::Sexagesimal);
    let transmission =
        Axis::linear("transmission of collector and guide; bars: 95 % intervals", [0.0, 1.0], 5, Steps::Decimal);
    curves(&heading, &all, altitude, transmission)
}

/// Writes the fluxes that arrive and leave, and the efficiency, in one line.
fn fluxes(report: &TubeReport) -> String {
    let lumens = |name: &str, flux: Option<FluxResult>| {
        let flux = flux?;
        Some(match flux.half_interval_lm() {
            Some(half) => format!("{name} {} lm (95 %)", with_error(flux.flux_lm, half)),
            None => format!("{name} {} lm", significant(flux.flux_lm, 4)),
        })
    };
    let flux = &report.flux;
    let pieces = [
        lumens("at the collector", flux.at_collector),
        lumens("at the diffuser", flux.at_diffuser),
        lumens("into the room", flux.into_room),
        efficiency(flux),
    ];
    pieces.into_iter().flatten().collect::<Vec<_>>().join(" · ")
}

/// Writes the fraction of the light at the collector that enters the room, with half the width of its interval; `None` without light.
pub fn efficiency(flux: &TubeResult) -> Option<String> {
    let percent = 100.0 * flux.transmission_efficiency?;
    let half = flux.into_room?.coverage_factor.zip(flux.transmission_efficiency_standard_error);
    let half = half.map(|(factor, error)| 100.0 * factor * error).filter(|half| *half > 1e-9 * percent);
    let words = half.map_or_else(|| significant(percent, 3), |half| with_error(percent, half));
    Some(format!("efficiency {words} %"))
}
