//! Page on the cost of each effect of light.

use std::path::Path;

use serde_json::{Value, json};

use super::case::{Case, Run, all_met, passes};
use super::measure::{Quartiles, on_one_thread, time};
use super::performance::machine;
use super::scenes;
use super::settings::{Progress, Settings};
use crate::page::{Report, ReportError, Section, Table};
use skyduct::estimate::Estimate;
use skyduct::figure::ticks::significant;
use skyduct::plan::EffectKind;
use skyduct::present::prepared::Prepared;

/// Standard error to which all jobs run: some milliseconds of work.
const ASKED: f64 = 0.005;

/// Scenes of an effect, each with its name and document.
struct Subject {
    kind: EffectKind,
    /// Scene that does not call for the effect.
    without: (&'static str, Value),
    /// Scene that calls for the effect.
    with: (&'static str, Value),
    /// Scene with something else in place of the effect, where this cannot be switched off.
    instead: Option<(&'static str, Value)>,
}

/// Measures all effects.
pub fn run(settings: &Settings, progress: Progress) -> Result<Report, ReportError> {
    let subjects = subjects(settings)?;
    let all = subjects.len();
    let (mut in_vain, mut called_for) = (Vec::new(), Vec::new());
    on_one_thread(|| {
        for (number, subject) in subjects.iter().enumerate() {
            let name = subject.kind.name();
            progress.step(2 * number, 2 * all, &format!("{name}, in a scene that does not call for it"));
            in_vain.push(in_vain_row(settings, subject)?);
            progress.step(2 * number + 1, 2 * all, &format!("{name}, in a scene that calls for it"));
            called_for.push(called_for_row(settings, subject)?);
        }
        Ok(())
    })?;
    let head = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
    let introduction = format!(
        "What each effect of light costs where a scene calls for it, and where it does not. `cargo run --release -p \
         skyduct-reports -- bench effects` measures everything anew and writes this page: skyduct {}, {}. Times are \
         processor seconds of the passes of one job on one thread, to a standard error of 0.5 % at 95 %. The jobs of \
         a row run in turn, so that changes in the machine's speed affect all of them alike; ratios are medians over \
         the turns, with quartiles.{}",
        skyduct::VERSION,
        machine(),
        settings.remark()
    );
    let sections = vec![
        Section {
            title: "Where a scene does not call for it".to_owned(),
            text: "The effect switched off, left to the plan (`auto`), and switched on. An effect that is off costs \
                   nothing if the ratios are 1 within their quartiles, and changes nothing if all values have the \
                   same bits."
                .to_owned(),
            tables: vec![Table {
                caption: "Cost over that of `auto`".to_owned(),
                head: head(&["effect", "scene", "method", "`auto`", "off", "on", "bits off", "bits on"]),
                rows: in_vain,
            }],
            ..Section::default()
        },
        Section {
            title: "Where a scene calls for it".to_owned(),
            text: "The same scene with the effect and without it: switched off or, where the scene cannot do without \
                   it, replaced by something else. `auto` may choose another method then."
                .to_owned(),
            tables: vec![Table {
                caption: "Cost with and without".to_owned(),
                head: head(&[
                    "effect",
                    "scene",
                    "with",
                    "method",
                    "without it",
                    "without",
                    "method",
                    "with over without",
                ]),
                rows: called_for,
            }],
            ..Section::default()
        },
    ];
    Ok(Report { name: "effects", title: "What effects cost", introduction, sections })
}

fn subjects(settings: &Settings) -> Result<Vec<Subject>, ReportError> {
    let stored = |name: &str| Ok::<_, ReportError>(scenes::stored(settings, name)?.document);
    let plain = stored("S1")?;
    let changed = |change: &dyn Fn(&mut Value)| {
        let mut document = plain.clone();
        change(&mut document);
        document
    };
    let lit = scenes::with_luminaire(plain.clone());
    let mut only_lamp = lit.clone();
    only_lamp["tubes"] = json!([]);
    let black = changed(&|document| {
        for surface in ["floor", "walls", "ceiling"] {
            document["room"]["surfaces"][surface]["reflectance"] = 0.into();
        }
    });
    let sunny = changed(&|document| document["sky"]["direct_normal_illuminance_lux"] = 60_000.into());
    let clear =
        changed(&|document| document["tubes"][0]["diffuser"] = json!({ "kind": "clear", "transmittance": 0.6 }));
    let mut bent_clear = stored("S3")?;
    bent_clear["tubes"][0]["diffuser"] = json!({ "kind": "clear", "transmittance": 0.6 });
    let reddish = changed(&|document| {
        document["room"]["surfaces"]["floor"]["reflectance"] = json!([0.3, 0.2, 0.1]);
    });
    let glossy = changed(&|document| {
        document["room"]["surfaces"]["floor"] = json!({ "reflectance": 0.2, "specular": 0.1, "roughness": 0.3 });
    });
    let hilly = changed(&|document| document["surroundings"] = json!({ "horizon": [[0, 10], [120, 40], [200, 5]] }));
    let furnished = scenes::boxes(settings, 4)?.document;
    let subject = |kind, without, with, instead| Subject { kind, without, with, instead };
    // the match makes the compiler ask for the scenes of a new effect
    let of = |kind: EffectKind| match kind {
        EffectKind::Sky => subject(kind, ("a lamp, no tube", only_lamp.clone()), ("S1 with a lamp", lit.clone()), None),
        EffectKind::Sun => subject(kind, ("S1", plain.clone()), ("S1 in the sun", sunny.clone()), None),
        EffectKind::Luminaires => subject(kind, ("S1", plain.clone()), ("S1 with a lamp", lit.clone()), None),
        EffectKind::Interreflection => {
            subject(kind, ("S1, black surfaces", black.clone()), ("S1", plain.clone()), None)
        }
        EffectKind::Objects => subject(kind, ("S1", plain.clone()), ("S1 with 4 boxes", furnished.clone()), None),
        EffectKind::SpecularClosure => subject(
            kind,
            ("S1", plain.clone()),
            ("S1 with a clear sheet", clear.clone()),
            Some(("a Lambertian sheet instead", plain.clone())),
        ),
        EffectKind::GuideReturn => {
            subject(kind, ("S1", plain.clone()), ("S3 with a clear sheet", bent_clear.clone()), None)
        }
        EffectKind::Colour => subject(
            kind,
            ("S1", plain.clone()),
            ("S1 with a red floor", reddish.clone()),
            Some(("a grey floor instead", plain.clone())),
        ),
        EffectKind::Glossy => subject(kind, ("S1", plain.clone()), ("S1 with a glossy floor", glossy.clone()), None),
        EffectKind::Horizon => subject(
            kind,
            ("S1", plain.clone()),
            ("S1 behind a horizon", hilly.clone()),
            Some(("no horizon instead", plain.clone())),
        ),
    };
    Ok(EffectKind::ALL.into_iter().map(of).collect())
}

/// Prepares a document with an effect `off`, `auto` or `on` for rendering.
fn prepared(settings: &Settings, document: &Value, kind: EffectKind, switch: &str) -> Result<Prepared, ReportError> {
    let mut document = document.clone();
    document["effects"] = json!({ kind.name(): switch });
    Case::beside(document, Path::new(".")).to(ASKED, settings.longest_job()).prepare()
}

/// Renders jobs in turn, and returns the runs of each.
fn in_turn(settings: &Settings, jobs: &[&Prepared]) -> Result<Vec<Vec<Run>>, ReportError> {
    let mut repeats = settings.repeats();
    repeats.most *= 3;
    let rounds = repeats.run(|round| {
        // each round begins with another job
        let first = round as usize % jobs.len();
        let mut order: Vec<usize> = (0..jobs.len()).collect();
        order.rotate_left(first);
        let mut runs = order
            .into_iter()
            .map(|job| Ok((job, Run::of(jobs[job], 0.0)?)))
            .collect::<Result<Vec<_>, ReportError>>()?;
        runs.sort_by_key(|(job, _)| *job);
        Ok(runs)
    })?;
    let mut of_jobs: Vec<Vec<Run>> = jobs.iter().map(|_| Vec::new()).collect();
    for (job, run) in rounds.into_iter().flatten() {
        of_jobs[job].push(run);
    }
    Ok(of_jobs)
}

fn in_vain_row(settings: &Settings, subject: &Subject) -> Result<Vec<String>, ReportError> {
    let Subject { kind, without: (scene, document), .. } = subject;
    let job = |switch: &str| prepared(settings, document, *kind, switch);
    let [auto, off, on] = [job("auto")?, job("off")?, job("on")?];
    let runs = in_turn(settings, &[&auto, &off, &on])?;
    let bits = |other: usize| {
        let same = same_bits(&runs[0][0].estimate, &runs[other][0].estimate);
        if same { "equal" } else { "**differ**" }
    };
    // effects of absent sources of light, of closures and of colours stay off where the scene does not call for them
    let on_in_vain = if kind.can_be_followed_in_vain() { "" } else { " (off nevertheless)" };
    Ok(vec![
        kind.name().to_owned(),
        (*scene).to_owned(),
        auto.method_names(),
        cost(&runs[0]),
        ratio(&runs[1], &runs[0]),
        format!("{}{on_in_vain}", ratio(&runs[2], &runs[0])),
        bits(1).to_owned(),
        bits(2).to_owned(),
    ])
}

fn called_for_row(settings: &Settings, subject: &Subject) -> Result<Vec<String>, ReportError> {
    let Subject { kind, with: (scene, document), instead, .. } = subject;
    let with = prepared(settings, document, *kind, "auto")?;
    let (how, without) = match instead {
        None => ("switched off", prepared(settings, document, *kind, "off")?),
        Some((how, document)) => (*how, prepared(settings, document, *kind, "auto")?),
    };
    let runs = in_turn(settings, &[&with, &without])?;
    Ok(vec![
        kind.name().to_owned(),
        (*scene).to_owned(),
        cost(&runs[0]),
        with.method_names(),
        how.to_owned(),
        cost(&runs[1]),
        without.method_names(),
        // no ratio of jobs that were cut short
        if runs.iter().all(|runs| all_met(runs)) { ratio(&runs[0], &runs[1]) } else { String::new() },
    ])
}

/// Formats the median time of jobs.
fn cost(runs: &[Run]) -> String {
    let seconds = time(passes(runs).median);
    if all_met(runs) { seconds } else { format!("not within {seconds}") }
}

/// Formats median and quartiles of the ratios of runs of the same rounds.
fn ratio(runs: &[Run], over: &[Run]) -> String {
    let ratios = runs.iter().zip(over).map(|(run, over)| run.passes / over.passes);
    let Quartiles { lower, median, upper } = Quartiles::of(ratios);
    let [lower, median, upper] = [lower, median, upper].map(|ratio| significant(ratio, 3));
    format!("{median} ({lower} to {upper})")
}

/// True if all values of two estimates have the same bits.
fn same_bits(a: &Estimate, b: &Estimate) -> bool {
    let bits = |estimate: &Estimate| {
        let mut bits = vec![estimate.passes, estimate.photons];
        estimate.clone().for_each_value(&mut |value| bits.push(value.to_bits()));
        bits
    };
    bits(a) == bits(b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use skyduct::integrator::{GridPass, Pass};

    fn settings() -> Settings {
        Settings {
            quick: true,
            reference: Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/reference"),
            beside: None,
        }
    }

    /// One scene must call for its effect, and the other must not: otherwise a row would be meaningless.
    #[test]
    fn scenes_call_for_their_effects_and_the_others_do_not() {
        let settings = settings();
        for Subject { kind, without, with, instead } in subjects(&settings).unwrap() {
            let calls = |document: &Value| {
                let prepared = prepared(&settings, document, kind, "auto").unwrap();
                prepared.plan.effects.list.iter().any(|effect| effect.kind == kind && effect.called_for)
            };
            assert!(!calls(&without.1), "{}: {}", kind.name(), without.0);
            assert!(calls(&with.1), "{}: {}", kind.name(), with.0);
            assert_eq!(instead.is_some(), !kind.can_be_left_out());
            assert!(instead.is_none_or(|(_, document)| !calls(&document)), "{}", kind.name());
        }
    }

    #[test]
    fn bits_differ_by_the_last_digit() {
        let estimate = |lux: f64| {
            let mut estimate =
                Estimate { grids: vec![skyduct::estimate::GridEstimate::empty(1)], ..Estimate::default() };
            let grid = GridPass { illuminance: vec![lux], ..GridPass::default() };
            estimate.push(Some(&Pass { grids: vec![grid], ..Pass::default() }), None);
            estimate
        };
        assert!(same_bits(&estimate(1.0), &estimate(1.0)));
        assert!(!same_bits(&estimate(1.0), &estimate(1.0 + f64::EPSILON)));
    }
}
