//! Uploaded meshes: content-addressed OBJ files.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};

use bytes::Bytes;
use tokio::runtime::Handle;
use uuid::Uuid;

use crate::document::MeshSource;
use crate::geometry::TriangleMesh;
use crate::geometry::obj::{ObjError, ObjLimits, parse_obj};
use crate::job::artifacts::{ArtifactError, Artifacts};
use crate::job::store::{Mesh, Store, StoreError};

/// Hexadecimal digits of the content's hash in a mesh id.
const ID_DIGITS: usize = 32;

#[derive(Debug, thiserror::Error)]
pub enum UploadError {
    #[error(transparent)]
    Obj(#[from] ObjError),
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error(transparent)]
    Artifact(#[from] ArtifactError),
    #[error("reading the mesh failed")]
    Panicked,
}

/// Checks and stores an OBJ file; the same content has the same id.
pub async fn upload(store: &dyn Store, artifacts: &Artifacts, bytes: Bytes) -> Result<Mesh, UploadError> {
    let id = blake3::hash(&bytes).to_hex()[..ID_DIGITS].to_owned();
    if let Some(mesh) = store.mesh(&id).await? {
        return Ok(mesh);
    }
    let copy = bytes.clone();
    let parsed = tokio::task::spawn_blocking(move || parse_obj(&copy, ObjLimits::default()))
        .await
        .map_err(|_| UploadError::Panicked)??;
    // a key of its own for each upload: deleting a mesh while it is uploaded anew cannot take the new file
    let key = format!("meshes/{id}-{}.obj", Uuid::now_v7());
    let size = bytes.len() as u64;
    artifacts.put(&key, bytes).await?;
    let triangles = parsed.triangles.len() as u64;
    let new = Mesh { id, key: key.clone(), size, triangles, materials: parsed.materials, created_at: 0 };
    let mesh = store.add_mesh(new).await?;
    if mesh.key != key {
        artifacts.delete(&key).await?;
    }
    Ok(mesh)
}

/// Uploaded meshes by id, for threads outside the async runtime (never inside: it waits for the store).
pub struct UploadedMeshes {
    store: Arc<dyn Store>,
    artifacts: Artifacts,
    runtime: Handle,
    loaded: Mutex<BTreeSet<String>>,
}

impl UploadedMeshes {
    pub fn new(store: Arc<dyn Store>, artifacts: Artifacts, runtime: Handle) -> Self {
        Self { store, artifacts, runtime, loaded: Mutex::default() }
    }

    /// The meshes that were asked for and found.
    pub fn loaded(&self) -> Vec<String> {
        self.loaded.lock().unwrap_or_else(PoisonError::into_inner).iter().cloned().collect()
    }
}

impl MeshSource for UploadedMeshes {
    fn load(&self, id: &str) -> Result<Arc<TriangleMesh>, String> {
        let mesh = self
            .runtime
            .block_on(self.store.mesh(id))
            .map_err(|error| error.to_string())?
            .ok_or_else(|| "there is no uploaded mesh with this id".to_owned())?;
        let bytes = self.runtime.block_on(self.artifacts.read(&mesh.key)).map_err(|error| error.to_string())?;
        let parsed = parse_obj(&bytes, ObjLimits::default()).map_err(|error| error.to_string())?;
        self.loaded.lock().unwrap_or_else(PoisonError::into_inner).insert(mesh.id);
        Ok(Arc::new(parsed))
    }
}
