//! Uploaded meshes: content-addressed OBJ files.

use std::collections::{BTreeSet, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bytes::Bytes;
use tokio::runtime::Handle;

use crate::annual::weather::{self, Weather};
use crate::document::FileSource;
use crate::geometry::TriangleMesh;
use crate::geometry::obj::{ObjLimits, parse_obj_until};
use crate::output::npy::{self, Array};
use crate::queue::artifacts::Artifacts;
use crate::queue::owner::Owner;
use crate::queue::store::{About, AboutMesh, Store, UploadKind, UploadedFile};
use crate::queue::uploads::{UploadError, Uploads};

/// Memory in bytes for parsed meshes that are kept for the next job.
const KEPT_BYTES: usize = 128 << 20;

/// Uploaded meshes of a service; clones share the meshes that are kept in memory.
#[derive(Clone)]
pub struct Meshes {
    uploads: Uploads,
    kept: Arc<Mutex<KeptMeshes>>,
}

impl Meshes {
    pub fn new(store: Arc<dyn Store>, artifacts: Artifacts) -> Self {
        Self { uploads: Uploads::new(store, artifacts), kept: Arc::new(Mutex::new(KeptMeshes::new(KEPT_BYTES))) }
    }

    /// Returns the meshes as another view of the store has them.
    pub fn seen_by(&self, store: Arc<dyn Store>) -> Self {
        Self { uploads: self.uploads.seen_by(store), kept: self.kept.clone() }
    }

    /// Returns the uploaded files of all kinds.
    pub fn uploads(&self) -> &Uploads {
        &self.uploads
    }

    /// Checks and stores an OBJ file, as [`Uploads::add`] does, and keeps the mesh in memory.
    pub async fn upload(
        &self,
        owner: Owner,
        bytes: Bytes,
        permits: impl Send + 'static,
    ) -> Result<UploadedFile, UploadError> {
        let read = |bytes: &[u8], cancel: &AtomicBool| -> Result<_, UploadError> {
            let mesh = parse_obj_until(bytes, ObjLimits::default(), cancel)?;
            let about = AboutMesh { triangles: mesh.triangles.len() as u64, materials: mesh.materials.clone() };
            Ok((Arc::new(mesh), About::Mesh(about)))
        };
        let (file, parsed) = self.uploads.add(owner, UploadKind::Mesh, bytes, permits, read).await?;
        if let Some(parsed) = parsed {
            lock(&self.kept).keep(&file.id, parsed);
        }
        Ok(file)
    }

    /// Returns the meshes for a document that is prepared outside the async runtime (never inside: it blocks on the store).
    pub fn for_document(&self, runtime: Handle, cancel: Arc<AtomicBool>) -> UploadedMeshes {
        UploadedMeshes { meshes: self.clone(), runtime, cancel, loaded: Mutex::default() }
    }
}

/// Uploaded meshes by id, for one document.
pub struct UploadedMeshes {
    meshes: Meshes,
    runtime: Handle,
    cancel: Arc<AtomicBool>,
    loaded: Mutex<BTreeSet<String>>,
}

impl UploadedMeshes {
    /// Returns the ids of the files that were requested and found.
    pub fn loaded(&self) -> Vec<String> {
        lock(&self.loaded).iter().cloned().collect()
    }

    /// Finds a file of a kind.
    fn file(&self, kind: UploadKind, id: &str) -> Result<UploadedFile, String> {
        let file = self.runtime.block_on(self.meshes.uploads.find(kind, id)).map_err(unreadable)?;
        file.ok_or_else(|| format!("there is no uploaded {} with this id", kind.noun()))
    }

    /// Reads a file of a kind, which the document then uses.
    fn content(&self, kind: UploadKind, id: &str) -> Result<Bytes, String> {
        let file = self.file(kind, id)?;
        let bytes = self.runtime.block_on(self.meshes.uploads.content(&file)).map_err(unreadable)?;
        lock(&self.loaded).insert(file.id);
        Ok(bytes)
    }

    fn parsed(&self, mesh: &UploadedFile) -> Result<Arc<TriangleMesh>, String> {
        if let Some(kept) = lock(&self.meshes.kept).get(&mesh.id) {
            return Ok(kept);
        }
        let bytes = self.runtime.block_on(self.meshes.uploads.content(mesh)).map_err(unreadable)?;
        let parsed = parse_obj_until(&bytes, ObjLimits::default(), &self.cancel).map_err(|error| error.to_string())?;
        let parsed = Arc::new(parsed);
        lock(&self.meshes.kept).keep(&mesh.id, parsed.clone());
        Ok(parsed)
    }
}

impl FileSource for UploadedMeshes {
    fn load(&self, id: &str) -> Result<Arc<TriangleMesh>, String> {
        let mesh = self.file(UploadKind::Mesh, id)?;
        let parsed = self.parsed(&mesh)?;
        lock(&self.loaded).insert(mesh.id);
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

/// Cache of the most recently used meshes, as many as fit into a number of bytes.
struct KeptMeshes {
    most_bytes: usize,
    /// Meshes, the most recently used one first.
    meshes: VecDeque<(String, Arc<TriangleMesh>)>,
}

impl KeptMeshes {
    fn new(most_bytes: usize) -> Self {
        Self { most_bytes, meshes: VecDeque::new() }
    }

    fn get(&mut self, id: &str) -> Option<Arc<TriangleMesh>> {
        let place = self.meshes.iter().position(|(kept, _)| kept == id)?;
        let found = self.meshes.remove(place)?;
        let mesh = found.1.clone();
        self.meshes.push_front(found);
        Some(mesh)
    }

    fn keep(&mut self, id: &str, mesh: Arc<TriangleMesh>) {
        if mesh_bytes(&mesh) > self.most_bytes {
            return;
        }
        self.meshes.retain(|(kept, _)| kept != id);
        self.meshes.push_front((id.to_owned(), mesh));
        let mut bytes = 0;
        let fitting = self.meshes.iter().take_while(|(_, mesh)| {
            bytes += mesh_bytes(mesh);
            bytes <= self.most_bytes
        });
        let fitting = fitting.count();
        self.meshes.truncate(fitting);
    }
}

fn mesh_bytes(mesh: &TriangleMesh) -> usize {
    let names: usize = mesh.materials.iter().map(|name| size_of::<String>() + name.len()).sum();
    size_of_val(mesh.positions.as_slice())
        + size_of_val(mesh.triangles.as_slice())
        + size_of_val(mesh.triangle_materials.as_slice())
        + names
}

/// Locks a mutex, also after a panic of another thread: the data behind these locks is never left half changed.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_meshes_used_last_are_kept_as_long_as_they_fit() {
        let mesh = |triangles: usize| {
            let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_owned();
            let mut mesh = crate::geometry::obj::parse_obj(text.as_bytes(), ObjLimits::default()).unwrap();
            mesh.triangles = vec![[0, 1, 2]; triangles];
            Arc::new(mesh)
        };
        let small = mesh_bytes(&mesh(10));
        let mut kept = KeptMeshes::new(2 * small);
        kept.keep("a", mesh(10));
        kept.keep("b", mesh(10));
        assert!(kept.get("a").is_some());
        kept.keep("c", mesh(10));
        assert!(kept.get("b").is_none() && kept.get("a").is_some() && kept.get("c").is_some());
        kept.keep("c", mesh(10));
        assert_eq!(kept.meshes.len(), 2);
        // it would push everything else out and still not fit
        kept.keep("d", mesh(1000));
        assert!(kept.get("d").is_none() && kept.get("c").is_some());
    }
}
