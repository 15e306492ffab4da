//! Part of a job in a study, as it is stored beside the job.

use serde::{Deserialize, Serialize};

use crate::study::picture_request::PictureKey;
use crate::study::request::RunKey;

/// Purpose of a job in a study, with its methods and the time of its preparation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudyPart {
    /// Run that the job is; `None` for references and pictures.
    pub run: Option<RunKey>,
    /// Pictures that the job makes; `None` for runs and their reference.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub picture: Option<PictureKey>,
    /// Names of the methods that compute the job.
    pub computed_by: String,
    /// Seconds for which the job was prepared when the study was posted.
    pub set_up_seconds: f64,
}
