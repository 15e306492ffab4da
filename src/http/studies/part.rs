//! The part that a job has in a study, as it is stored beside the job.

use serde::{Deserialize, Serialize};

use crate::study::picture_request::PictureKey;
use crate::study::request::RunKey;

/// What a job of a study is for, and what is known of it before its first pass.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudyPart {
    /// The run that it is; none of the reference and of pictures.
    pub run: Option<RunKey>,
    /// The pictures that it makes; none of runs and of their reference.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub picture: Option<PictureKey>,
    /// The methods that compute it.
    pub computed_by: String,
    /// Seconds that it took to prepare it when the study was posted.
    pub set_up_seconds: f64,
}
