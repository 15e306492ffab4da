//! What furniture costs, and points up to the walls.

use serde_json::{Value, json};

use super::case::{Case, Run};
use super::goals::{Found, Goal, Measured};
use super::measure::{Quartiles, percent};
use super::meshes;
use super::scenes::{self, ROOM_M};
use super::settings::{Progress, Settings};
use crate::figure::ticks::significant;
use crate::reports::page::{ReportError, Section, Table};

/// Squares along the faces of the chair's boards: 10 368 triangles.
const NET: u32 = 12;

/// Standard error that is asked for.
const ASKED: f64 = 0.01;

pub fn section(settings: &Settings, progress: Progress, measured: &mut Measured) -> Result<Section, ReportError> {
    let to = |case: Case| case.to(ASKED, settings.longest_job());
    let empty = to(scenes::stored(settings, "S1")?);
    let twenty = to(scenes::boxes(settings, 20)?);
    let mut document = twenty.document.clone();
    if let Some(Value::Array(objects)) = document.pointer_mut("/room/objects") {
        objects.push(json!({
            "kind": "mesh", "mesh": "chair.obj", "unit": "m", "position_m": [0.285 * ROOM_M, 0.285 * ROOM_M, 0.0],
            "surfaces": { "wood": { "reflectance": 0.3 } },
        }));
    }
    let bent = to(Case::with(document.clone(), meshes::bent_chair(NET)));
    let furnished = to(Case::with(document, meshes::chair(NET)));
    let many = to(scenes::points(settings, 100)?);
    let cases = [
        ("S1, empty", empty),
        ("S1, 20 boxes", twenty),
        ("S1, 20 boxes and a chair of 10 368 triangles", furnished),
        ("S1, empty, 100 x 100 points", many),
        ("S1, 20 boxes and a chair of 10 368 triangles that is bent", bent),
    ];
    // interleaved, so that the machine's moods meet all alike
    let repeats = settings.repeats();
    progress.step(0, 1, "furniture, and points to the walls");
    let rounds =
        repeats.run(|seed| cases.iter().map(|(_, case)| case.seed(seed).run()).collect::<Result<Vec<Run>, _>>())?;
    let of_case = |index: usize| rounds.iter().map(move |round| &round[index]);
    let ratio = |index: usize| Quartiles::of(rounds.iter().map(|round| round[index].passes / round[0].passes));
    let row = |(index, (name, _)): (usize, &(&str, Case))| {
        let seconds = Quartiles::of(of_case(index).map(|run| run.passes));
        let met = of_case(index).all(|run| run.met);
        let told = Quartiles::of(of_case(index).map(|run| run.told)).median;
        let ratio = ratio(index);
        vec![
            (*name).to_owned(),
            if met { seconds.as_time() } else { format!("not within {}", seconds.as_time()) },
            format!(
                "{} ({} to {})",
                significant(ratio.median, 3),
                significant(ratio.lower, 3),
                significant(ratio.upper, 3)
            ),
            percent(told),
        ]
    };
    let rows = cases.iter().enumerate().map(row).collect();
    for (goal, index, value) in [(Goal::Furniture, 2, ratio(2).median), (Goal::ManyPoints, 3, seconds_of(&rounds, 3))] {
        let met = of_case(index).all(|run| run.met);
        measured.insert(goal, if met { Found::Value(value) } else { Found::MoreThan(value) });
    }
    Ok(Section {
        title: "Furniture, and points to the walls".to_owned(),
        text: format!(
            "S1 to 1 % with 9 x 9 points on the floor, without and with things between them, and with points 1 cm from the walls. \
             The boards of a straight chair are traced as boxes, those of a bent one triangle by triangle. \
             Ratios are those of runs in turn, median and quartiles; number of turns: {}.",
            rounds.len()
        ),
        tables: vec![Table {
            caption: "Processor time of the passes".to_owned(),
            head: ["case", "processor time", "over the empty room", "told"].map(str::to_owned).into(),
            rows,
        }],
        ..Section::default()
    })
}

fn seconds_of(rounds: &[Vec<Run>], index: usize) -> f64 {
    Quartiles::of(rounds.iter().map(|round| round[index].passes)).median
}
