//! Excess of 17 % of the thesis' photon mapping over HOLIGILM, and its hot pixels (section 6.2).

use std::f64::consts::PI;

use glam::DVec3;
use rayon::prelude::*;
use serde_json::Value;

use super::causes::{Causes, causes, interpolated, mean_of};
use super::photons::FloorPhotons;
use super::printed::{ALPHA, ILLUMINANCE_PASSES, INITIAL_RADIUS_M, PPM, SPPM};
use super::settings::{Progress, Settings};
use super::side_by_side::side_by_side;
use super::update::{Faults, HitPoint, Uniform, uniform};
use super::{printed, scenes};
use crate::page::{Figure, ReportError, Section, Table, with_standard_error};
use skyduct::figure::false_colour::FalseColours;
use skyduct::figure::montage::montage;
use skyduct::integrator::photon_map::grid::{LiesOn, PhotonGrid};
use skyduct::output::png;
use skyduct::sampling::Key;
use skyduct::scene::Face;
use skyduct::traceable::SurfaceId;

/// Expected photons per first disc and pass for which updates are simulated, descending.
const EXPECTED: [f64; 6] = [0.44, 0.2, 0.1, 0.05, 0.02, 0.01];

/// Update rules that are compared.
const RULES: [(&str, Faults); 3] =
    [("as printed", Faults::PRINTED), ("as printed, whole counts", Faults::PRINTED_WHOLE), ("right", Faults::NONE)];

/// Relative distance to a factor of the thesis within which a cause counts as fitting.
const NEAR: f64 = 0.02;

/// Number of the cases of [`EXPECTED`], from the first, that are also run on the floor under the pipe.
const ON_FLOOR: usize = 3;

/// Area of the first gather disc in m2.
const FIRST_AREA_M2: f64 = PI * INITIAL_RADIUS_M * INITIAL_RADIUS_M;

/// Passes over which the photons on the floor are counted.
const COUNTED_PASSES: u64 = 8;

pub fn sections(settings: &Settings, progress: Progress) -> Result<Vec<Section>, ReportError> {
    progress("causes of the excess over HOLIGILM");
    let causes = causes(settings)?;
    progress("the printed update under uniform light");
    let simulated = simulate(settings);
    let needed = [PPM, SPPM].map(|thesis| needed_photons(&simulated, thesis.excess()));
    progress("the printed update on the floor under the pipe");
    let floor = Floor::new(settings)?;
    let numbers = EXPECTED.into_iter().take(ON_FLOOR).chain(needed[0]);
    let live: Vec<Live> = numbers.map(|expected| floor.update(settings, expected)).collect::<Result<_, _>>()?;
    let excess = excess_section(&causes, &simulated, &floor);
    Ok(vec![excess, pixels_section(settings, &simulated, needed, &floor, &live)?])
}

/// Simulates every rule for each number of photons per first disc and pass.
fn simulate(settings: &Settings) -> Vec<(f64, Vec<Uniform>)> {
    let key = Key::new(24);
    let cases: Vec<(usize, f64)> = EXPECTED.into_iter().enumerate().collect();
    side_by_side(cases, |(number, expected)| {
        let of_rule = |(_, faults): (&str, Faults)| {
            uniform(expected, ILLUMINANCE_PASSES, ALPHA, faults, settings.discs, key.child(number as u64))
        };
        (expected, RULES.map(of_rule).into())
    })
}

/// Computes the photons per first disc and pass at which the printed rule has this factor, by interpolating ln of the number
/// against ln of the excess.
fn needed_photons(simulated: &[(f64, Vec<Uniform>)], factor: f64) -> Option<f64> {
    let points: Vec<(f64, f64)> = simulated
        .iter()
        .filter(|(_, rules)| rules[0].ratio.mean > 1.0)
        .map(|(expected, rules)| (libm::log(rules[0].ratio.mean - 1.0), libm::log(*expected)))
        .collect();
    interpolated(&points, libm::log(factor - 1.0)).map(libm::exp)
}

/// Floor of the room with direct light alone.
struct Floor {
    document: Value,
    /// Photons per first disc and pass if all photons of a pass enter the collector.
    expected_at_full: f64,
    /// True mean illuminance in lx.
    true_lux: f64,
}

/// Illuminances that the rules compute from the same photons on one floor.
struct Live {
    photons: u64,
    /// Photons expected per first disc and pass.
    expected: f64,
    points: usize,
    /// Illuminance of every point in lx, by rule.
    rules: Vec<Vec<f64>>,
}

impl Floor {
    fn new(settings: &Settings) -> Result<Self, ReportError> {
        let document = scenes::floor([settings.cells; 2], false)?;
        let mut truth = document.clone();
        truth["method"] = "holigilm".into();
        let full = FloorPhotons::new(&document, settings.photons_per_pass, 2)?;
        let arrived: usize = (0..COUNTED_PASSES).map(|pass| full.pass(pass).len()).sum();
        let per_disc = FIRST_AREA_M2 / (scenes::ROOM_M * scenes::ROOM_M);
        let expected_at_full = arrived as f64 / COUNTED_PASSES as f64 * per_disc;
        Ok(Self { document, expected_at_full, true_lux: mean_of(&truth)? })
    }

    /// Applies all rules to the same photons, of which a first disc gets `expected` per pass.
    fn update(&self, settings: &Settings, expected: f64) -> Result<Live, ReportError> {
        let share = expected / self.expected_at_full;
        let photons = ((settings.photons_per_pass as f64 * share).round() as u64).max(1);
        let source = FloorPhotons::new(&self.document, photons, 3)?;
        let points = settings.points;
        let mut hits = vec![[HitPoint::default(); RULES.len()]; points * points];
        let floor = SurfaceId::of_face(Face::Floor).number();
        for pass in 1..=settings.share(ILLUMINANCE_PASSES) {
            let map = PhotonGrid::new(&source.pass(pass), INITIAL_RADIUS_M);
            hits.par_iter_mut().enumerate().for_each(|(index, rules)| {
                let at = |k: usize| (k as f64 + 0.5) * scenes::ROOM_M / points as f64;
                let centre = DVec3::new(at(index % points), at(index / points), 0.0);
                let mut near = Vec::new();
                map.for_each_within(centre, INITIAL_RADIUS_M, |on, flux, distance_squared| {
                    if on == floor {
                        near.push((distance_squared, flux.0[0]));
                    }
                });
                for (point, (_, faults)) in rules.iter_mut().zip(RULES) {
                    let radius = point.radius() * INITIAL_RADIUS_M;
                    let (mut found, mut flux) = (0.0, 0.0);
                    for (_, of_photon) in near.iter().filter(|(squared, _)| *squared < radius * radius) {
                        found += 1.0;
                        flux += of_photon;
                    }
                    // the flux of a pass is that of the scene: it counts as one emission
                    point.update(found, flux, pass as f64, ALPHA, faults);
                }
            });
        }
        let of_rule = |rule: usize| hits.iter().map(|rules| rules[rule].shown() / FIRST_AREA_M2).collect();
        let expected = self.expected_at_full * photons as f64 / settings.photons_per_pass as f64;
        Ok(Live { photons, expected, points, rules: (0..RULES.len()).map(of_rule).collect() })
    }
}

impl Live {
    fn mean(&self, rule: usize) -> f64 {
        self.rules[rule].iter().sum::<f64>() / self.rules[rule].len() as f64
    }

    /// Returns the highest value and its point.
    fn highest(&self, rule: usize) -> (f64, [usize; 2]) {
        let values = self.rules[rule].iter().enumerate();
        let (index, value) =
            values.max_by(|a, b| a.1.total_cmp(b.1)).map_or((0, 0.0), |(index, value)| (index, *value));
        (value, [index % self.points, index / self.points])
    }
}

fn excess_section(causes: &Causes, simulated: &[(f64, Vec<Uniform>)], floor: &Floor) -> Section {
    let verdict = |factor: f64| {
        let near = |thesis: &printed::Illuminance| (factor / thesis.excess() - 1.0).abs() <= NEAR;
        match (near(&PPM), near(&SPPM)) {
            (false, false) => "no",
            _ => "yes",
        }
    };
    let mut rows: Vec<Vec<String>> = causes
        .list
        .iter()
        .map(|cause| vec![cause.name.clone(), format!("{:.3}", cause.factor()), verdict(cause.factor()).to_owned()])
        .collect();
    for (rule, (name, _)) in RULES.into_iter().enumerate().take(2) {
        for (expected, rules) in simulated {
            let factor = rules[rule].ratio.mean;
            rows.push(vec![
                format!("the update {name}, {expected} photons per first disc and pass"),
                format!("{factor:.3}"),
                verdict(factor).to_owned(),
            ]);
        }
    }
    let fitting: Vec<&str> =
        causes.list.iter().filter(|cause| verdict(cause.factor()) == "yes").map(|cause| cause.name.as_str()).collect();
    let alone = if fitting.is_empty() {
        "None of the changes of the scene fits by itself".to_owned()
    } else {
        format!("Of the changes of the scene these fit by themselves: {}", fitting.join("; "))
    };
    let reflectance = causes.reflectance.map_or(String::new(), |reflectance| {
        format!(
            " Interreflection would give the {:.1} % of PPM in a room whose surfaces all reflect {reflectance:.2}.",
            100.0 * (PPM.excess() - 1.0)
        )
    });
    Section {
        title: "4. What was left open: photon mapping above HOLIGILM".to_owned(),
        text: format!(
            "The thesis' mean illuminances are {:.1} % (PPM) and {:.1} % (SPPM) above HOLIGILM's (section 6.2), and it \
             suspects the zenith luminance or the model. Each cause below is computed with everything else unchanged: \
             changes of the scene by this program's HOLIGILM ({:.2} lx before, direct light alone), the update of Appendix A \
             by simulation under uniform light (next section). A cause fits when its factor is within {:.0} % of {:.3} or \
             {:.3}.",
            100.0 * (PPM.excess() - 1.0),
            100.0 * (SPPM.excess() - 1.0),
            floor.true_lux,
            100.0 * NEAR,
            PPM.excess(),
            SPPM.excess(),
        ),
        tables: vec![Table {
            caption: "Factor on the mean illuminance of the floor".to_owned(),
            head: ["cause", "factor", "fits"].map(str::to_owned).into(),
            rows,
        }],
        conclusion: format!(
            "{alone}.{reflectance} The update raises the mean at few photons per disc, PPM and SPPM share it and differ from \
             HOLIGILM alike, and it makes hot pixels, which no change of the scene does; the next section weighs how much \
             of the difference it can be. The thesis states neither the reflectances of its room nor the \
             time zone of its 3 PM; for HOLIGILM's mean an hour later, {:.0} % of the light at the collector would have to come \
             into the room.",
            100.0 * causes.transmission_later,
        ),
        ..Section::default()
    }
}

fn pixels_section(
    settings: &Settings,
    simulated: &[(f64, Vec<Uniform>)],
    needed: [Option<f64>; 2],
    floor: &Floor,
    live: &[Live],
) -> Result<Section, ReportError> {
    let first = uniform(EXPECTED[0], 1, ALPHA, Faults::PRINTED, settings.discs, Key::new(23)).ratio;
    let colours = FalseColours::illuminance_up_to(printed::ILLUMINANCE_BOUND_LUX);
    let mut maps = Vec::new();
    if let Some(live) = live.last() {
        for (rule, title) in ["as printed", "whole counts", "right"].into_iter().enumerate() {
            maps.push((title.to_owned(), colours.heat_map([live.points; 2], &live.rules[rule])?));
        }
    }
    let points = live.first().map_or(0, |live| live.points);
    Ok(Section {
        title: "5. What was left open: hot pixels".to_owned(),
        text: format!(
            "Appendix A scales the flux to the new radius but divides by the area of the old one (lines 41 to 47): after the first pass \
             the value is alpha times the right one, here {}. It refreshes a pixel only in passes that find a \
             photon (line 21): a pixel whose disc has become small keeps a value that was divided by fewer emitted photons. And \
             its accumulated count is declared a whole number (section 5.5.2), which keeps pixels that find one photon at a time at N \
             = 0 while their radius shrinks. The first table has {} discs under uniform light after {ILLUMINANCE_PASSES} \
             passes with alpha = {ALPHA}: mean over the true value, the highest disc, and the mean radius over the first one. \
             The second has the same rules on photons traced through the pipe to {points} x {points} points of the floor.",
            with_standard_error(first.mean, first.standard_error(), 4),
            settings.discs,
        ),
        tables: vec![uniform_table(simulated), floor_table(floor, live)],
        figures: vec![Figure {
            file: "update.png",
            caption: format!(
                "The floor by the update as printed, as printed with whole counts, and right, from the same photons, {:.3} \
                 per first disc and pass; upper bound {} lx as in figures 6.4 and 6.5.",
                live.last().map_or(f64::NAN, |live| live.expected),
                printed::ILLUMINANCE_BOUND_LUX
            ),
            bytes: png::encode(&colours.with_scale(&montage(&maps, 3)?)?)?,
        }],
        conclusion: judgement(settings, simulated, needed, floor, live),
        ..Section::default()
    })
}

fn uniform_table(simulated: &[(f64, Vec<Uniform>)]) -> Table {
    let mut head = vec!["photons per first disc and pass".to_owned()];
    for (name, _) in RULES {
        head.extend([name.to_owned(), "highest".to_owned(), "radius".to_owned()]);
    }
    let row = |(expected, rules): &(f64, Vec<Uniform>)| {
        let mut row = vec![expected.to_string()];
        for Uniform { ratio, highest, radius } in rules {
            row.push(with_standard_error(ratio.mean, ratio.standard_error(), 4));
            row.push(format!("{highest:.1}"));
            row.push(format!("{radius:.3}"));
        }
        row
    };
    Table { caption: "The update under uniform light".to_owned(), head, rows: simulated.iter().map(row).collect() }
}

fn floor_table(floor: &Floor, live: &[Live]) -> Table {
    let printed_row = |thesis: &printed::Illuminance| {
        vec![
            format!("the thesis, {}", thesis.method),
            String::new(),
            thesis.mean_lux.to_string(),
            format!("{:.3}", thesis.excess()),
            thesis.highest_lux.to_string(),
            format!("{:.2}", thesis.highest_lux / thesis.mean_lux),
            thesis.highest_at.map_or(String::new(), |[x, y]| format!("pixel ({x}, {y})")),
        ]
    };
    let mut rows = vec![printed_row(&PPM), printed_row(&SPPM)];
    for live in live {
        for (rule, (name, _)) in RULES.into_iter().enumerate() {
            let (mean, (highest, [x, y])) = (live.mean(rule), live.highest(rule));
            rows.push(vec![
                name.to_owned(),
                format!("{:.3} ({})", live.expected, live.photons),
                format!("{mean:.3}"),
                format!("{:.3}", mean / floor.true_lux),
                format!("{highest:.1}"),
                format!("{:.2}", highest / mean),
                format!("point ({x}, {y})"),
            ]);
        }
    }
    Table {
        caption: format!(
            "The update on the floor under the pipe, direct light alone, true mean {:.3} lx; photons per first disc and \
             pass, and in brackets those of a pass that enter the collector",
            floor.true_lux
        ),
        head: ["rule", "photons", "mean in lx", "over HOLIGILM", "highest in lx", "highest over mean", "at"]
            .map(str::to_owned)
            .into(),
        rows,
    }
}

/// Describes how much of the excess the update can explain, by the mean and by the hottest pixel.
fn judgement(
    settings: &Settings,
    simulated: &[(f64, Vec<Uniform>)],
    needed: [Option<f64>; 2],
    floor: &Floor,
    live: &[Live],
) -> String {
    let hottest = |live: &Live, rule: usize| live.highest(rule).0 / live.mean(rule);
    let of_thesis = PPM.highest_lux / PPM.mean_lux;
    let [for_ppm, for_sppm] = needed.map(|needed| needed.map_or("no number".to_owned(), |n| format!("{n:.3}")));
    let mut text = format!(
        "By the mean: the printed update exceeds the true value by the thesis' factor at {for_ppm} photons per first disc and \
         pass (PPM) and {for_sppm} (SPPM). With all {} photons in the collector a first disc on the floor would get {:.2}; but \
         the thesis aims its photons from the sky at the bounding circle of its model (sections 3.1 and 5.4), and does not \
         say how many of them miss the collector.",
        settings.photons_per_pass, floor.expected_at_full,
    );
    if let Some(live) = live.last() {
        text += &format!(
            " On the floor that number gives {:.3} times HOLIGILM's mean, and a highest value of {:.2} times the mean, where the \
             thesis has {of_thesis:.2}; the right update of the same photons has {:.2} by noise alone, and {:.3} times the true \
             mean.",
            live.mean(0) / floor.true_lux,
            hottest(live, 0),
            hottest(live, 2),
            live.mean(2) / floor.true_lux,
        );
    }
    let mut shares = vec![PPM.excess() - 1.0];
    for (rule, (name, _)) in RULES.into_iter().enumerate().take(2) {
        let by_hottest: Vec<(f64, f64)> =
            live.iter().map(|live| (libm::log(hottest(live, rule)), libm::log(live.expected))).collect();
        let by_number: Vec<(f64, f64)> =
            simulated.iter().rev().map(|(expected, rules)| (libm::log(*expected), rules[rule].ratio.mean)).collect();
        let photons = interpolated(&by_hottest, libm::log(of_thesis));
        let Some((photons, factor)) =
            photons.and_then(|photons| Some((libm::exp(photons), interpolated(&by_number, photons)?)))
        else {
            continue;
        };
        text += &format!(
            " By the hottest pixel, the update {name}: it has the thesis' {of_thesis:.2} at about {photons:.2} photons, where it \
             raises the mean by {:.1} % and leaves a factor of {:.3} to the scene.",
            100.0 * (factor - 1.0),
            PPM.excess() / factor,
        );
        shares.push(factor - 1.0);
    }
    let [least, most] =
        [f64::min, f64::max].map(|pick| 100.0 * shares.iter().copied().reduce(pick).unwrap_or(f64::NAN));
    text += &format!(
        " So the update explains at least {least:.0} and at most all of the {most:.1} % that PPM is above HOLIGILM, the more \
         the fewer of its photons came into the pipe."
    );
    text + " The highest of many pixels is a rough measure, and the thesis does not print how many it had. Values that are \
            computed from flux, radius and emitted photons when they are read have neither fault: here passes with \
            scheduled radii keep no state, and radii per point only themselves and their counts."
}
