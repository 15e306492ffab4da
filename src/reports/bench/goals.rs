//! What was set out to be reached, and what was measured.

use std::collections::BTreeMap;

use super::measure::{percent, time};
use crate::figure::ticks::significant;
use crate::reports::page::Table;

/// Something that was set out to be reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Goal {
    S1,
    S1Fine,
    S2,
    S3,
    S3Mesh,
    S3MeshSetUp,
    Chains,
    Cornell,
    Furniture,
    ManyPoints,
    Demo,
    Report,
    Render,
    Http,
    HttpRate,
    Dragged,
}

/// Unit of a number, and which numbers are good.
#[derive(Clone, Copy)]
enum Unit {
    /// Seconds, at most.
    Seconds,
    /// A share, at most.
    Share,
    /// A ratio, at most.
    Times,
    /// Millions of rays for each processor second, at least.
    Megarays,
    /// Jobs a second, at least.
    PerSecond,
}

struct Row {
    goal: Goal,
    case: &'static str,
    peer: &'static str,
    asked: f64,
    unit: Unit,
}

const fn row(goal: Goal, case: &'static str, peer: &'static str, asked: f64, unit: Unit) -> Row {
    Row { goal, case, peer, asked, unit }
}

const ROWS: [Row; 16] = [
    row(Goal::S1, "S1 to 1 %", "Radiance in two stages by an expert 0.39 s; Mitsuba 11.7 s", 1.5e-3, Unit::Seconds),
    row(Goal::S1Fine, "S1 to 0.1 %", "none in a minute", 40e-3, Unit::Seconds),
    row(Goal::S2, "S2, clear closure with sun, to 1 %", "Mitsuba 5.2 s", 15e-3, Unit::Seconds),
    row(Goal::S3, "S3, two bends and a dome in closed form, to 1 %", "Radiance 1.95 s", 4e-3, Unit::Seconds),
    row(
        Goal::S3Mesh,
        "S3 as a mesh of 30 000 triangles, to 1 %",
        "Radiance 1.95 s, Mitsuba 29 s",
        25e-3,
        Unit::Seconds,
    ),
    row(Goal::S3MeshSetUp, "its set-up, the file read", "", 30e-3, Unit::Seconds),
    row(
        Goal::Chains,
        "specular chains in that mesh",
        "Embree 3 robust: 2.2 to 2.7 M rays a second on shared machines, 3.1 on a quiet one, 3.7 with AVX-512",
        3.7,
        Unit::Megarays,
    ),
    row(Goal::Cornell, "Cornell box, 256 x 256, to 10 % per pixel", "pbrt SPPM and Mitsuba 11 s", 0.5, Unit::Seconds),
    row(Goal::Furniture, "S1 with 20 boxes and a chair, over the empty room", "", 2.0, Unit::Times),
    row(Goal::ManyPoints, "S1, 10 000 points to the walls, to 1 %", "", 0.1, Unit::Seconds),
    row(Goal::Demo, "the thesis room with its view, to 1 % and 5 %", "", 0.7, Unit::Seconds),
    row(Goal::Report, "largest share of the tube reports in a job", "", 0.1, Unit::Share),
    row(Goal::Render, "`skyduct render` of S1 to 1 %, seconds on the wall", "Radiance 0.41 s", 15e-3, Unit::Seconds),
    row(Goal::Http, "S1 over HTTP, `POST` to grid, median on the wall", "", 15e-3, Unit::Seconds),
    row(Goal::HttpRate, "such jobs over HTTP", "", 200.0, Unit::PerSecond),
    row(Goal::Dragged, "dragged tube, 16 x 24 points, two tubes, median on the wall", "", 50e-3, Unit::Seconds),
];

/// What was measured of a goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Found {
    Value(f64),
    /// The measurement was ended there.
    MoreThan(f64),
}

/// What was measured.
pub type Measured = BTreeMap<Goal, Found>;

impl Unit {
    fn words(self, value: f64) -> String {
        match self {
            Self::Seconds => time(value),
            Self::Share => percent(value),
            Self::Times => format!("{} times", significant(value, 3)),
            Self::Megarays => format!("{} M rays a second", significant(value, 3)),
            Self::PerSecond => format!("{} a second", significant(value, 3)),
        }
    }

    fn is_at_least(self) -> bool {
        matches!(self, Self::Megarays | Self::PerSecond)
    }

    /// What is said of a number; nothing where it is not known well enough.
    fn verdict(self, found: Found, asked: f64) -> &'static str {
        let reached = match found {
            Found::Value(value) if self.is_at_least() => value >= asked,
            Found::Value(value) => value <= asked,
            Found::MoreThan(value) if value >= asked => self.is_at_least(),
            Found::MoreThan(_) => return "",
        };
        if reached { "reached" } else { "**not reached**" }
    }
}

/// Every goal with what was measured; `embree`: millions of rays for each processor second of Embree on this machine, where it ran.
pub fn table(measured: &Measured, embree: Option<f64>) -> Table {
    let cells = |row: &Row| {
        let asked = embree.filter(|_| row.goal == Goal::Chains).unwrap_or(row.asked);
        let bound = if row.unit.is_at_least() { "at least" } else { "at most" };
        let found = measured.get(&row.goal).copied();
        let verdict = found.map_or("", |found| row.unit.verdict(found, asked));
        let found = match found {
            None => "not measured".to_owned(),
            Some(Found::Value(value)) => row.unit.words(value),
            Some(Found::MoreThan(value)) => format!("more than {}", row.unit.words(value)),
        };
        vec![
            row.case.to_owned(),
            row.peer.to_owned(),
            format!("{bound} {}", row.unit.words(asked)),
            found,
            verdict.to_owned(),
        ]
    };
    Table {
        caption: "What was set out to be reached".to_owned(),
        head: ["case", "best other program", "asked", "measured", ""].map(str::to_owned).into(),
        rows: ROWS.iter().map(cells).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_goal_has_a_row_and_a_verdict() {
        let values = [(Goal::S1, 1.4e-3), (Goal::S2, 16e-3), (Goal::Chains, 3.0), (Goal::HttpRate, 100.0)];
        let mut measured: Measured = values.map(|(goal, value)| (goal, Found::Value(value))).into();
        measured.insert(Goal::Cornell, Found::MoreThan(2.0));
        measured.insert(Goal::ManyPoints, Found::MoreThan(0.05));
        let rows = table(&measured, None).rows;
        let cell = |goal: Goal, column: usize| rows[goal as usize][column].as_str();
        assert_eq!(
            (cell(Goal::S1, 2), cell(Goal::S1, 3), cell(Goal::S1, 4)),
            ("at most 1.50 ms", "1.40 ms", "reached")
        );
        assert_eq!(cell(Goal::S2, 4), "**not reached**");
        assert_eq!(
            (cell(Goal::Chains, 2), cell(Goal::Chains, 4)),
            ("at least 3.70 M rays a second", "**not reached**")
        );
        let beside = &table(&measured, Some(2.9)).rows[Goal::Chains as usize];
        assert_eq!((beside[2].as_str(), beside[4].as_str()), ("at least 2.90 M rays a second", "reached"));
        assert_eq!(cell(Goal::HttpRate, 4), "**not reached**");
        assert_eq!((cell(Goal::Cornell, 3), cell(Goal::Cornell, 4)), ("more than 2.00 s", "**not reached**"));
        assert_eq!((cell(Goal::ManyPoints, 3), cell(Goal::ManyPoints, 4)), ("more than 50.0 ms", ""));
        assert_eq!((cell(Goal::Demo, 3), cell(Goal::Demo, 4)), ("not measured", ""));
        assert!(ROWS.iter().enumerate().all(|(index, row)| row.goal as usize == index));
    }
}
