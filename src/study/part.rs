//! Purposes of the jobs of a study, as they are stored beside the jobs.

use serde::{Deserialize, Serialize};

use super::picture_request::PictureKey;
use super::request::RunKey;

/// Key of a job among those of a study: a run, pictures, or, if neither, the reference of the runs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JobKey {
    /// Run that the job is; `None` for references and pictures.
    pub run: Option<RunKey>,
    /// Pictures that the job makes; `None` for runs and their reference.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub picture: Option<PictureKey>,
}

/// Purpose of a job in a study, with its methods and the time of its preparation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudyPart {
    /// Run or pictures that the job computes.
    #[serde(flatten)]
    pub key: JobKey,
    /// Names of the methods that compute the job.
    pub computed_by: String,
    /// Seconds for which the job was prepared.
    pub set_up_seconds: f64,
}

impl JobKey {
    /// Returns the key of a run.
    pub fn run(key: RunKey) -> Self {
        Self { run: Some(key), picture: None }
    }

    /// Returns the key of a job of pictures.
    pub fn picture(key: PictureKey) -> Self {
        Self { run: None, picture: Some(key) }
    }

    /// True if all runs are compared with the job.
    pub fn is_reference(&self) -> bool {
        self.run.is_none() && self.picture.is_none()
    }
}
