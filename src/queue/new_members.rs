//! Jobs that are to be queued as one set: what they have in common is kept once, and the rest of them is bounded.

use serde::Serialize;
use serde_json::{Map, Value};

use super::shared_fields::{OwnFields, SharedFields};
use crate::document::result::{Known, PlanResult};
use crate::document::{FieldError, FieldErrorCode, Warning};
use crate::present::prepared::Prepared;

/// Largest number of bytes that the jobs of one set have in their rows and first events beside the fields that they share.
const MOST_BYTES: usize = 16 << 20;

/// Jobs of a set that is to be queued, without the fields that they have in common.
#[derive(Clone, Default)]
pub struct NewMembers {
    /// Fields that the documents of the jobs have in common as they are posted.
    pub submitted: SharedFields,
    /// Fields that the documents of the jobs have in common with defaults filled in.
    pub document: SharedFields,
    /// Fields that the plans of the jobs have in common.
    pub plan: SharedFields,
    /// Jobs in their order.
    pub list: Vec<NewMember>,
    /// Bytes that the jobs have beside the fields that they share.
    bytes: usize,
}

/// Job to be queued with a set; its own fields are those of [`super::records::NewJob`] without those of the set.
#[derive(Clone)]
pub struct NewMember {
    /// Name of the job, free text from its document.
    pub name: Option<String>,
    /// Purpose of the job in the set, by the set's kind.
    pub part: Value,
    /// Document of the job as it would be posted.
    pub submitted: OwnFields,
    /// Document of the job with all defaults filled in.
    pub document: OwnFields,
    /// Plan: what is simulated and what is not, and why.
    pub plan: OwnFields,
    /// Results that are known before the first pass.
    pub known: Known,
    /// Notes on the document and on its methods.
    pub warnings: Vec<Warning>,
    /// Identity of the computation, equal for jobs with equal results; `None` where no other job's results can be used.
    pub computation: Option<String>,
}

impl NewMembers {
    /// Divides a job, prepared from its document, into the fields that it shares with the jobs before, and its own; it is not yet one
    /// of the set, has no part in it, and takes no other job's results.
    pub fn divide(&mut self, document: &Value, prepared: &Prepared) -> NewMember {
        NewMember {
            name: prepared.name.clone(),
            part: Value::Null,
            submitted: self.submitted.divide(fields(document.clone())),
            document: self.document.divide(fields(prepared.document.clone())),
            plan: self.plan.divide(fields(to_value(&PlanResult::from(&prepared.plan)))),
            known: prepared.known(),
            warnings: prepared.warnings.clone(),
            computation: None,
        }
    }

    /// Adds a job. If all jobs together would be too long, refuses the field of the request at `pointer`.
    pub fn push(&mut self, member: NewMember, pointer: &str) -> Result<(), FieldError> {
        let own = [to_value(&member.submitted), to_value(&member.document), to_value(&member.plan)];
        // the last two are in an event, too
        let beside = [to_value(&member.known), to_value(&member.warnings)];
        let lengths = own.iter().chain(&beside).chain(&beside).map(|value| value.to_string().len());
        self.bytes += lengths.sum::<usize>();
        if self.bytes > MOST_BYTES {
            let detail = format!(
                "the documents of the jobs, without their common fields, may take {} MB in all, but those of {} jobs \
                 take more: request fewer or shorter ones",
                MOST_BYTES >> 20,
                self.list.len() + 1
            );
            return Err(FieldError::new(pointer, detail).coded(FieldErrorCode::TooMany));
        }
        self.list.push(member);
        Ok(())
    }
}

impl NewMember {
    /// Returns the job with another seed.
    pub fn with_seed(&self, seed: u64) -> Self {
        let mut member = self.clone();
        member.submitted.set("seed", seed.into());
        member.document.set("seed", seed.into());
        member
    }
}

/// Returns the fields of a document or a plan.
fn fields(document: Value) -> Map<String, Value> {
    match document {
        Value::Object(fields) => fields,
        _ => Map::new(),
    }
}

/// Converts a value to JSON; our own types always serialise.
fn to_value(value: &impl Serialize) -> Value {
    serde_json::to_value(value).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::provenance::Provenance;
    use crate::document::result::ExternalIlluminance;

    /// Jobs are added up to a number of bytes that they do not share, whatever makes them long.
    #[test]
    fn what_jobs_do_not_share_is_bounded() {
        let mut members = NewMembers::default();
        let provenance =
            Provenance { zenith: None, sun: None, refraction: None, interreflection: true, guides: Vec::new() };
        let [submitted, document, plan] = [(); 3].map(|()| members.plan.divide(Map::new()));
        let mut member = NewMember {
            name: None,
            part: Value::Null,
            submitted,
            document,
            plan,
            known: Known::new(provenance, ExternalIlluminance { sky: 0.0, sun: 0.0 }),
            warnings: Vec::new(),
            computation: None,
        };
        // with the rest of the job a little more than a fifth of what all may have
        member.document.set("name", "x".repeat(MOST_BYTES / 5).into());
        for _ in 0..4 {
            members.push(member.clone(), "/jobs").unwrap();
        }
        let error = members.push(member, "/jobs").unwrap_err();
        assert_eq!((error.pointer.as_str(), error.code), ("/jobs", FieldErrorCode::TooMany));
        assert!(error.detail.contains("16 MB in all, but those of 5 jobs"), "{}", error.detail);
        assert_eq!(members.list.len(), 4);
    }
}
