//! Jobs of the report, some of which this program may refuse.

use std::path::Path;

use serde_json::Value;

use super::side_by_side::side_by_side;
use crate::page::ReportError;
use crate::run::prepare;
use skyduct::present::prepared::Prepared;

/// Job of the report: its name and its document.
pub struct Case {
    pub name: String,
    pub document: Value,
}

impl Case {
    pub fn new(name: &str, mut document: Value, method: Value) -> Self {
        document["method"] = method;
        Self { name: name.to_owned(), document }
    }

    /// Prepares the job for rendering; the error is the reason why this program refuses it.
    pub fn prepare(&self) -> Result<Prepared, String> {
        prepare(&self.document, Path::new("")).map_err(|errors| errors.to_string().replace('\n', "; "))
    }
}

/// Results of some cases in order, and a sentence for each case that this program refuses.
pub struct Tried<T> {
    pub results: Vec<T>,
    pub left_out: String,
}

/// Runs the cases that this program accepts, two at a time; an error if it refuses all of them.
pub fn try_all<T: Send>(
    cases: Vec<Case>,
    work: impl Fn(Case, &Prepared) -> Result<T, ReportError> + Sync,
) -> Result<Tried<T>, ReportError> {
    let outcomes = side_by_side(cases, |case| match case.prepare() {
        Ok(prepared) => work(case, &prepared).map(Ok),
        Err(reason) => Ok(Err(format!(" {} is left out: {reason}.", case.name))),
    });
    let mut tried = Tried { results: Vec::new(), left_out: String::new() };
    for outcome in outcomes {
        match outcome? {
            Ok(result) => tried.results.push(result),
            Err(reason) => tried.left_out += &reason,
        }
    }
    if tried.results.is_empty() { Err(ReportError::Case(tried.left_out)) } else { Ok(tried) }
}
