//! Source of the files that a document names: meshes, models, weather and arrays.

use std::sync::Arc;

use crate::annual::weather::Weather;

use crate::geometry::TriangleMesh;
use crate::output::npy::Array;

/// Source of the files that a document names: uploads by id, or files beside the job file.
pub trait FileSource {
    /// Returns the mesh in the units of its file. The error is one sentence that says why there is none, with the line of the
    /// file where possible.
    fn load(&self, id: &str) -> Result<Arc<TriangleMesh>, String> {
        Err(format!("no mesh has the id {id:?}"))
    }

    /// Returns the weather of a file. The error is one sentence that says why there is none, with line and field where possible.
    fn weather(&self, id: &str) -> Result<Arc<Weather>, String> {
        Err(format!("no weather file has the id {id:?}"))
    }

    /// Returns the text of a Honeybee model. The error is one sentence that says why there is none.
    fn model(&self, name: &str) -> Result<Vec<u8>, String> {
        Err(format!("no model has the name {name:?}"))
    }

    /// Returns an array of numbers. The error is one sentence that says why there is none.
    fn array(&self, id: &str) -> Result<Arc<Array>, String> {
        Err(format!("no array has the id {id:?}"))
    }

    /// True if the document's preparation was cancelled, so that it should end soon.
    fn is_cancelled(&self) -> bool {
        false
    }
}

/// Source without files.
pub struct NoFiles;

impl FileSource for NoFiles {}
