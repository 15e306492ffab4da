//! Order of a study: which methods can compute it, which jobs follow, and their runs by a [`Runner`].

use serde_json::Value;

use super::outcome::Refused;
use super::part::JobKey;
use super::picture_request::PictureRequest;
use super::request::{RunKey, StudyRequest};
use crate::document::DocumentErrors;
use crate::present::prepared::Prepared;

/// Place where the jobs of a study run: this process, or a queue.
pub trait Runner {
    /// Reason why a study cannot be run to its end.
    type Error: From<DocumentErrors>;

    /// Prepares a job from its document. Errors have pointers into the document.
    fn prepare(&self, document: &Value) -> Result<Prepared, DocumentErrors>;

    /// Moves the pointers of a document's errors to where the request has the fault; `key` is that of the job, `None` if the
    /// document was prepared to find out whether its method can compute it.
    fn in_request(&self, errors: DocumentErrors, key: Option<&JobKey>) -> DocumentErrors;

    /// Receives the plan before its first job; an error refuses it.
    fn begin(&mut self, plan: &StudyPlan<'_>) -> Result<(), Self::Error>;

    /// Runs a job, or queues it.
    fn run(&mut self, plan: &StudyPlan<'_>, key: JobKey) -> Result<(), Self::Error>;
}

/// Jobs of a study of grids, of views, or of both.
#[derive(Clone, Debug)]
pub struct StudyPlan<'a> {
    grids: Option<&'a StudyRequest>,
    views: Option<&'a PictureRequest>,
    /// Methods that can compute the grids, in the order of the request.
    pub methods: Vec<String>,
    /// Methods that can render the views.
    methods_of_views: Vec<String>,
    /// Methods that cannot compute the grids, or cannot render the views.
    pub refused: Vec<Refused>,
}

/// Runs all jobs of a study of grids, of views, or of both; the numbers of the requests are checked already.
///
/// A fault that does not concern a method under study alone is an error, with a pointer into the request.
pub fn run<R: Runner>(
    grids: Option<&StudyRequest>,
    views: Option<&PictureRequest>,
    runner: &mut R,
) -> Result<(), R::Error> {
    let plan = StudyPlan::new(grids, views, |document| runner.prepare(&document).map(drop));
    let plan = plan.map_err(|errors| runner.in_request(errors, None))?;
    runner.begin(&plan)?;
    plan.keys().into_iter().try_for_each(|key| runner.run(&plan, key))
}

impl<'a> StudyPlan<'a> {
    /// Separates the methods that can compute the study from those that refuse it, each by a document of its own.
    fn new(
        grids: Option<&'a StudyRequest>,
        views: Option<&'a PictureRequest>,
        prepare: impl Fn(Value) -> Result<(), DocumentErrors>,
    ) -> Result<Self, DocumentErrors> {
        let (mut methods, mut methods_of_views, mut refused) = (Vec::new(), Vec::new(), Vec::new());
        if let Some(request) = grids {
            let relative_error = request.relative_errors[0];
            let first = |method: &str| request.run(&RunKey { method: method.to_owned(), relative_error, seed: 0 });
            (methods, refused) = able(&request.methods, |method| prepare(first(method)))?;
        }
        if let Some(request) = views.filter(|request| !request.wanted.seconds.is_empty()) {
            let (able, unable) = able(&request.methods, |method| prepare(request.trial(method)))?;
            let purpose = if grids.is_some() { "for the views: " } else { "" };
            refused.extend(
                unable
                    .into_iter()
                    .map(|Refused { method, reason }| Refused { method, reason: format!("{purpose}{reason}") }),
            );
            methods_of_views = able;
        }
        Ok(Self { grids, views, methods, methods_of_views, refused })
    }

    /// Returns the numbers of references, runs and pictures, those of their reference included.
    pub fn numbers(&self) -> [usize; 3] {
        let reference = self.grids.is_some_and(|request| request.reference.grids.is_none());
        let runs = self.grids.map_or(0, |request| {
            self.methods.len().saturating_mul(request.relative_errors.len()).saturating_mul(request.seeds as usize)
        });
        let pictures = self.views.map_or(0, |request| request.keys(&self.methods_of_views).len());
        [usize::from(reference), runs, pictures]
    }

    /// Returns the keys of all jobs in their order.
    pub fn keys(&self) -> Vec<JobKey> {
        let reference = self.grids.filter(|request| request.reference.grids.is_none()).map(|_| JobKey::default());
        let runs = self.grids.into_iter().flat_map(|request| request.runs(&self.methods));
        let pictures = self.views.into_iter().flat_map(|request| request.keys(&self.methods_of_views));
        reference.into_iter().chain(runs.map(JobKey::run)).chain(pictures.map(JobKey::picture)).collect()
    }

    /// Returns the approximate number of bytes needed to put the pictures of the largest view side by side; zero without pictures.
    pub fn most_bytes_of_pictures(&self) -> f64 {
        self.views.map_or(0.0, |request| request.most_bytes(&request.keys(&self.methods_of_views)))
    }

    /// Returns the document of a job.
    pub fn document(&self, key: &JobKey) -> Value {
        match (&key.run, &key.picture, self.grids, self.views) {
            (_, Some(picture), _, Some(request)) => request.document(picture),
            (Some(run), _, Some(request), _) => request.run(run),
            (_, _, Some(request), _) => request.reference(),
            _ => Value::Null,
        }
    }

    /// Returns the largest number of seconds of rendering for a run or for pictures.
    pub fn most_seconds(&self, key: &JobKey) -> f64 {
        match (&key.picture, self.grids, self.views) {
            (Some(picture), _, Some(request)) => request.most_seconds_of(picture),
            (_, grids, _) => grids.map_or(0.0, |request| request.seconds),
        }
    }
}

/// Separates methods that can compute a document of theirs from those that refuse it, with their reasons.
fn able(
    methods: &[String],
    prepare: impl Fn(&str) -> Result<(), DocumentErrors>,
) -> Result<(Vec<String>, Vec<Refused>), DocumentErrors> {
    let (mut able, mut refused) = (Vec::new(), Vec::new());
    for method in methods {
        match prepare(method) {
            Ok(()) => able.push(method.clone()),
            Err(errors) if errors.0.iter().all(|error| error.pointer.starts_with("/method")) => {
                let reason = errors.0.into_iter().map(|error| error.detail).collect::<Vec<_>>().join("; ");
                refused.push(Refused { method: method.clone(), reason });
            }
            Err(errors) => return Err(errors),
        }
    }
    Ok((able, refused))
}
