//! Uploaded meshes: content-addressed OBJ files.

use std::collections::{BTreeSet, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use bytes::Bytes;
use tokio::runtime::Handle;
use uuid::Uuid;

use crate::document::MeshSource;
use crate::engine::cancel::CancelOnDrop;
use crate::geometry::TriangleMesh;
use crate::geometry::obj::{ObjError, ObjLimits, parse_obj_until};
use crate::queue::artifacts::Artifacts;
use crate::queue::files::FileError;
use crate::queue::owner::Owner;
use crate::queue::store::{Mesh, Store, StoreError};

/// Hexadecimal digits of the content's hash in a mesh id.
const ID_DIGITS: usize = 32;

/// Longest time for which an uploaded file is read.
const READ_TIME: Duration = Duration::from_secs(10);

/// Memory in bytes for parsed meshes that are kept for the next job.
const KEPT_BYTES: usize = 128 << 20;

#[derive(Debug, thiserror::Error)]
pub enum UploadError {
    #[error(transparent)]
    Obj(#[from] ObjError),
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error(transparent)]
    Artifact(#[from] FileError),
    #[error("reading the mesh failed")]
    Panicked,
}

/// Uploaded meshes of a service; clones share the meshes that are kept in memory.
#[derive(Clone)]
pub struct Meshes {
    store: Arc<dyn Store>,
    artifacts: Artifacts,
    kept: Arc<Mutex<KeptMeshes>>,
}

impl Meshes {
    pub fn new(store: Arc<dyn Store>, artifacts: Artifacts) -> Self {
        Self { store, artifacts, kept: Arc::new(Mutex::new(KeptMeshes::new(KEPT_BYTES))) }
    }

    /// Returns the meshes as another view of the store has them.
    pub fn seen_by(&self, store: Arc<dyn Store>) -> Self {
        Self { store, ..self.clone() }
    }

    /// Checks and stores an OBJ file of an owner, who must be the one that the store is seen by; the same content has the same id.
    ///
    /// `permits` are held until reading ends, even when the caller is dropped before; reading is cancelled when the caller is dropped, and
    /// after [`READ_TIME`].
    pub async fn upload(&self, owner: Owner, bytes: Bytes, permits: impl Send + 'static) -> Result<Mesh, UploadError> {
        let id = blake3::hash(&bytes).to_hex()[..ID_DIGITS].to_owned();
        if let Some(mesh) = self.store.mesh_uploaded_again(&id).await? {
            return Ok(mesh);
        }
        let parsed = Arc::new(read(bytes.clone(), permits).await?);
        // a key of its own for each upload: deleting a mesh while it is uploaded anew cannot take the new file
        let key = format!("meshes/{id}-{}.obj", Uuid::now_v7());
        let size = bytes.len() as u64;
        self.artifacts.put(&key, bytes).await?;
        let triangles = parsed.triangles.len() as u64;
        let materials = parsed.materials.clone();
        let mesh = Mesh { owner, id, key: key.clone(), size, triangles, materials, created_at: 0 };
        let mesh = self.store.add_mesh(mesh).await?;
        if mesh.key != key {
            self.artifacts.delete(&key).await?;
        }
        lock(&self.kept).keep(&mesh.id, parsed);
        Ok(mesh)
    }

    /// Returns the meshes for a document that is prepared outside the async runtime (never inside: it blocks on the store).
    pub fn for_document(&self, runtime: Handle, cancel: Arc<AtomicBool>) -> UploadedMeshes {
        UploadedMeshes { meshes: self.clone(), runtime, cancel, loaded: Mutex::default() }
    }
}

async fn read(bytes: Bytes, permits: impl Send + 'static) -> Result<TriangleMesh, UploadError> {
    let cancel = CancelOnDrop::default();
    let flag = cancel.flag();
    let mut reading = tokio::task::spawn_blocking(move || {
        let _permits = permits;
        parse_obj_until(&bytes, ObjLimits::default(), &flag)
    });
    let read = match tokio::time::timeout(READ_TIME, &mut reading).await {
        Ok(read) => read,
        Err(_) => {
            // it answers with the line that it has reached
            cancel.flag().store(true, Ordering::Relaxed);
            reading.await
        }
    };
    Ok(read.map_err(|_| UploadError::Panicked)??)
}

/// Uploaded meshes by id, for one document.
pub struct UploadedMeshes {
    meshes: Meshes,
    runtime: Handle,
    cancel: Arc<AtomicBool>,
    loaded: Mutex<BTreeSet<String>>,
}

impl UploadedMeshes {
    /// Returns the ids of the meshes that were requested and found.
    pub fn loaded(&self) -> Vec<String> {
        lock(&self.loaded).iter().cloned().collect()
    }

    fn parsed(&self, mesh: &Mesh) -> Result<Arc<TriangleMesh>, String> {
        if let Some(kept) = lock(&self.meshes.kept).get(&mesh.id) {
            return Ok(kept);
        }
        let bytes = self.runtime.block_on(self.meshes.artifacts.read(&mesh.key)).map_err(unreadable)?;
        let parsed = parse_obj_until(&bytes, ObjLimits::default(), &self.cancel).map_err(|error| error.to_string())?;
        let parsed = Arc::new(parsed);
        lock(&self.meshes.kept).keep(&mesh.id, parsed.clone());
        Ok(parsed)
    }
}

impl MeshSource for UploadedMeshes {
    fn load(&self, id: &str) -> Result<Arc<TriangleMesh>, String> {
        let mesh = self.runtime.block_on(self.meshes.store.mesh(id)).map_err(unreadable)?;
        let mesh = mesh.ok_or_else(|| "there is no uploaded mesh with this id".to_owned())?;
        let parsed = self.parsed(&mesh)?;
        lock(&self.loaded).insert(mesh.id);
        Ok(parsed)
    }

    fn is_cancelled(&self) -> bool {
        self.cancel.load(Ordering::Relaxed)
    }
}

/// Logs why a mesh cannot be read, and returns a message for the client, without the reason, which may name files.
fn unreadable(error: impl std::fmt::Display) -> String {
    tracing::error!(%error, "a mesh cannot be read");
    "the service cannot read this mesh now; try again later".to_owned()
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
