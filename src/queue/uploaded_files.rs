//! Uploaded files that a document names, read while it is prepared.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use bytes::Bytes;
use tokio::runtime::Handle;

use crate::annual::weather::{self, Weather};
use crate::document::FileSource;
use crate::geometry::TriangleMesh;
use crate::geometry::obj::{ObjLimits, parse_obj_until};
use crate::output::npy::{self, Array};
use crate::queue::store::{UploadKind, UploadedFile};
use crate::queue::uploads::Uploads;

/// Uploaded files by id, for one document.
pub struct UploadedFiles {
    uploads: Uploads,
    runtime: Handle,
    cancel: Arc<AtomicBool>,
    loaded: Mutex<BTreeSet<String>>,
}

impl Uploads {
    /// Returns the files for a document that is prepared outside the async runtime (never inside: it blocks on the store).
    pub fn for_document(&self, runtime: Handle, cancel: Arc<AtomicBool>) -> UploadedFiles {
        UploadedFiles { uploads: self.clone(), runtime, cancel, loaded: Mutex::default() }
    }
}

impl UploadedFiles {
    /// Returns the ids of the files that were requested and found.
    pub fn loaded(&self) -> Vec<String> {
        self.loaded.lock().unwrap_or_else(PoisonError::into_inner).iter().cloned().collect()
    }

    fn uses(&self, id: String) {
        self.loaded.lock().unwrap_or_else(PoisonError::into_inner).insert(id);
    }

    /// Finds a file of a kind.
    fn file(&self, kind: UploadKind, id: &str) -> Result<UploadedFile, String> {
        let file = self.runtime.block_on(self.uploads.find(kind, id)).map_err(unreadable)?;
        file.ok_or_else(|| format!("there is no uploaded {} with this id", kind.noun()))
    }

    /// Reads a file of a kind, which the document then uses.
    fn content(&self, kind: UploadKind, id: &str) -> Result<Bytes, String> {
        let file = self.file(kind, id)?;
        let bytes = self.runtime.block_on(self.uploads.content(&file)).map_err(unreadable)?;
        self.uses(file.id);
        Ok(bytes)
    }

    fn parsed(&self, mesh: &UploadedFile) -> Result<Arc<TriangleMesh>, String> {
        if let Some(kept) = self.uploads.kept_mesh(&mesh.id) {
            return Ok(kept);
        }
        let bytes = self.runtime.block_on(self.uploads.content(mesh)).map_err(unreadable)?;
        let parsed = parse_obj_until(&bytes, ObjLimits::default(), &self.cancel).map_err(|error| error.to_string())?;
        let parsed = Arc::new(parsed);
        self.uploads.keep_mesh(&mesh.id, parsed.clone());
        Ok(parsed)
    }
}

impl FileSource for UploadedFiles {
    fn load(&self, id: &str) -> Result<Arc<TriangleMesh>, String> {
        let mesh = self.file(UploadKind::Mesh, id)?;
        let parsed = self.parsed(&mesh)?;
        self.uses(mesh.id);
        Ok(parsed)
    }

    fn weather(&self, id: &str) -> Result<Arc<Weather>, String> {
        weather::read(&self.content(UploadKind::Weather, id)?).map(Arc::new).map_err(|error| error.to_string())
    }

    fn array(&self, id: &str) -> Result<Arc<Array>, String> {
        npy::decode(&self.content(UploadKind::Array, id)?).map(Arc::new).map_err(|error| error.to_string())
    }

    fn model(&self, id: &str) -> Result<Vec<u8>, String> {
        Ok(self.content(UploadKind::Model, id)?.to_vec())
    }

    fn is_cancelled(&self) -> bool {
        self.cancel.load(Ordering::Relaxed)
    }
}

/// Logs why an uploaded file cannot be read, and returns a message for the client, without the reason, which may name files.
fn unreadable(error: impl std::fmt::Display) -> String {
    tracing::error!(%error, "an uploaded file cannot be read");
    "the service cannot read this file now; try again later".to_owned()
}
