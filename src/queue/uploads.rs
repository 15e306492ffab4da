//! Uploaded files of all kinds: checked, stored by their content, deleted.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use bytes::Bytes;
use uuid::Uuid;

use crate::annual::weather::WeatherError;
use crate::document::FieldError;
use crate::document::hbjson::read_report;
use crate::document::weather::read_weather;
use crate::engine::cancel::CancelOnDrop;
use crate::geometry::TriangleMesh;
use crate::geometry::obj::{ObjError, ObjLimits, parse_obj_until};
use crate::output::npy::{self, NotAnArray};
use crate::queue::artifacts::Artifacts;
use crate::queue::files::FileError;
use crate::queue::owner::Owner;
use crate::queue::store::{About, AboutArray, AboutMesh, Store, StoreError, UploadKind, UploadedFile};

/// Hexadecimal digits of the content's hash in an id.
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
    Weather(#[from] WeatherError),
    #[error(transparent)]
    Array(#[from] NotAnArray),
    #[error(transparent)]
    Model(#[from] FieldError),
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error(transparent)]
    Artifact(#[from] FileError),
    #[error("reading the file failed")]
    Panicked,
}

/// Uploaded files of a service; clones share the meshes that are kept in memory.
#[derive(Clone)]
pub struct Uploads {
    store: Arc<dyn Store>,
    artifacts: Artifacts,
    kept: Arc<Mutex<KeptMeshes>>,
}

impl Uploads {
    pub fn new(store: Arc<dyn Store>, artifacts: Artifacts) -> Self {
        Self { store, artifacts, kept: Arc::new(Mutex::new(KeptMeshes::new(KEPT_BYTES))) }
    }

    /// Returns the files as another view of the store has them.
    pub fn seen_by(&self, store: Arc<dyn Store>) -> Self {
        Self { store, ..self.clone() }
    }

    /// Checks and stores a file of an owner, who must be the one that the store is seen by; the same content has the same id. A mesh is kept in
    /// memory.
    ///
    /// `permits` are held until reading ends, even when the caller is dropped before; the reading of a mesh is cancelled by its flag when the caller
    /// is dropped, and after [`READ_TIME`]; other files are read to their end.
    pub async fn add(
        &self,
        owner: Owner,
        kind: UploadKind,
        bytes: Bytes,
        permits: impl Send + 'static,
    ) -> Result<UploadedFile, UploadError> {
        let id = blake3::hash(&bytes).to_hex()[..ID_DIGITS].to_owned();
        if let Some(file) = self.store.uploaded_again(kind, &id).await? {
            return Ok(file);
        }
        let content = bytes.clone();
        let (about, mesh) = in_time(permits, move |cancel| read(kind, &content, cancel)).await?;
        let (folder, ending) = match kind {
            UploadKind::Mesh => ("meshes", "obj"),
            UploadKind::Weather => ("weather", "txt"),
            UploadKind::Array => ("arrays", "npy"),
            UploadKind::Model => ("models", "json"),
        };
        // a key of its own for each upload: deleting a file while it is uploaded anew cannot take the new one
        let key = format!("{folder}/{id}-{}.{ending}", Uuid::now_v7());
        let size = bytes.len() as u64;
        self.artifacts.put(&key, bytes).await?;
        let file = UploadedFile { owner, id, key: key.clone(), size, about, created_at: 0 };
        let file = self.store.add_upload(file).await?;
        if file.key != key {
            self.artifacts.delete(&key).await?;
        }
        if let Some(mesh) = mesh {
            self.keep_mesh(&file.id, mesh);
        }
        Ok(file)
    }

    /// Returns the record of a file; none if there is none of this kind.
    pub async fn find(&self, kind: UploadKind, id: &str) -> Result<Option<UploadedFile>, StoreError> {
        self.store.upload(kind, id).await
    }

    /// Reads the content of a file.
    pub async fn content(&self, file: &UploadedFile) -> Result<Bytes, FileError> {
        self.artifacts.read(&file.key).await
    }

    /// Returns the mesh of a file if it is kept in memory.
    pub fn kept_mesh(&self, id: &str) -> Option<Arc<TriangleMesh>> {
        lock(&self.kept).get(id)
    }

    /// Keeps the mesh of a file in memory.
    pub fn keep_mesh(&self, id: &str, mesh: Arc<TriangleMesh>) {
        lock(&self.kept).keep(id, mesh);
    }
}

/// Checks a file, and returns its content in short, and the mesh if it is one.
fn read(
    kind: UploadKind,
    bytes: &[u8],
    cancel: &AtomicBool,
) -> Result<(About, Option<Arc<TriangleMesh>>), UploadError> {
    let about = match kind {
        UploadKind::Mesh => {
            let mesh = parse_obj_until(bytes, ObjLimits::default(), cancel)?;
            let about = AboutMesh { triangles: mesh.triangles.len() as u64, materials: mesh.materials.clone() };
            return Ok((About::Mesh(about), Some(Arc::new(mesh))));
        }
        UploadKind::Weather => About::Weather(Box::new(read_weather(bytes)?.1)),
        UploadKind::Array => {
            let [rows, columns] = npy::decode(bytes)?.shape.map(|number| number as u64);
            About::Array(AboutArray { rows, columns })
        }
        UploadKind::Model => About::Model(read_report(bytes)?),
    };
    Ok((about, None))
}

/// Reads a file off the async threads, for [`READ_TIME`] at most.
async fn in_time<T: Send + 'static>(
    permits: impl Send + 'static,
    read: impl FnOnce(&AtomicBool) -> Result<T, UploadError> + Send + 'static,
) -> Result<T, UploadError> {
    let cancel = CancelOnDrop::default();
    let flag = cancel.flag();
    let mut reading = tokio::task::spawn_blocking(move || {
        let _permits = permits;
        read(&flag)
    });
    let read = match tokio::time::timeout(READ_TIME, &mut reading).await {
        Ok(read) => read,
        Err(_) => {
            // a mesh answers with the line that was reached
            cancel.flag().store(true, Ordering::Relaxed);
            reading.await
        }
    };
    read.map_err(|_| UploadError::Panicked)?
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
