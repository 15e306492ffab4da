//! Report "The thesis, reproduced": the findings of A. Schou in 2012 beside those of this program, and the questions that the
//! thesis left open.
//!
//! All numbers of this program come from live runs; those that the thesis prints are in `printed`. The report contains no
//! times, so that the same settings give the same bytes.

mod boundary;
mod case;
mod causes;
mod cornell;
pub mod distance;
mod excess;
mod methods;
mod photons;
mod printed;
mod progress;
mod ring;
mod scenes;
mod settings;
mod side_by_side;
pub mod update;
mod views;

use crate::page::{Report, ReportError, Section};

use self::settings::{FULL_PASSES, Progress};

pub use self::settings::Settings;

/// Computes the whole report.
pub fn run(settings: &Settings, progress: impl Fn(&str) + Sync) -> Result<Report, ReportError> {
    type Part = fn(&Settings, Progress) -> Result<Vec<Section>, ReportError>;
    let parts: [Part; 6] = [
        cornell::sections,
        methods::sections,
        progress::sections,
        excess::sections,
        ring::sections,
        boundary::sections,
    ];
    let mut sections = Vec::new();
    for part in parts {
        sections.extend(part(settings, &progress)?);
    }
    Ok(Report { name: "thesis", title: "The thesis, reproduced", introduction: introduction(settings), sections })
}

fn introduction(settings: &Settings) -> String {
    let Settings { passes, photons_per_pass, .. } = settings;
    let fewer = if *passes < FULL_PASSES {
        format!(" This is a short run: the report is meant for {FULL_PASSES} passes.")
    } else {
        String::new()
    };
    format!(
        "A. Schou, *Investigation of light pipe simulation algorithms* (B.Sc. thesis, DTU Informatics, IMM-B.Sc-2012-01),\n\
         followed light through a light pipe by progressive photon mapping (PPM) and stochastic progressive photon mapping\n\
         (SPPM), and compared with path tracing and with HOLIGILM. This page repeats its experiments with skyduct {}.\n\
         `cargo run --release -p skyduct-reports -- thesis` runs everything anew and writes it: numbers of the thesis stand with their section or figure, all\n\
         others are computed. A second run gives the same bytes.\n\n\
         The longest series has {passes} passes of {photons_per_pass} photons.{fewer} \"The thesis' settings\" are {} photons\n\
         per pass, a first radius of 0.3 inch ({:.5} m), alpha = {} (its section 6.3), and radii that follow each point's own\n\
         photons, as there (Hachisuka, Ogaki and Jensen 2008), but by the right update; \"own settings\" are as many photons, a\n\
         first radius of a twentieth of the room's shortest edge, alpha = 2/3, and radii by the number of the pass (Knaus and\n\
         Zwicker 2011). Photon mapping here gathers only light that was reflected: light straight from a diffuser or a lamp\n\
         is connected, and kernels are clipped to their surface. PPM looks through {} fixed points of each pixel. Errors\n\
         are standard errors, s.e. for short.",
        skyduct::VERSION,
        printed::PHOTONS_PER_PASS,
        printed::INITIAL_RADIUS_M,
        printed::ALPHA,
        scenes::POINTS_PER_PIXEL,
    )
}
