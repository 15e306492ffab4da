//! Uploaded files of all kinds: checked, stored by their content, deleted.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use bytes::Bytes;
use uuid::Uuid;

use crate::annual::weather::WeatherError;
use crate::document::FieldError;
use crate::document::hbjson::read_report;
use crate::document::weather::read_weather;
use crate::engine::cancel::CancelOnDrop;
use crate::geometry::obj::ObjError;
use crate::output::npy::{self, NotAnArray};
use crate::queue::artifacts::Artifacts;
use crate::queue::files::FileError;
use crate::queue::owner::Owner;
use crate::queue::store::{About, AboutArray, Store, StoreError, UploadKind, UploadedFile};

/// Hexadecimal digits of the content's hash in an id.
const ID_DIGITS: usize = 32;

/// Longest time for which an uploaded file is read.
const READ_TIME: Duration = Duration::from_secs(10);

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

/// Uploaded files of a service.
#[derive(Clone)]
pub struct Uploads {
    store: Arc<dyn Store>,
    artifacts: Artifacts,
}

impl Uploads {
    pub fn new(store: Arc<dyn Store>, artifacts: Artifacts) -> Self {
        Self { store, artifacts }
    }

    /// Returns the files as another view of the store has them.
    pub fn seen_by(&self, store: Arc<dyn Store>) -> Self {
        Self { store, artifacts: self.artifacts.clone() }
    }

    /// Checks and stores a file of an owner, who must be the one that the store is seen by; the same content has the same id. Returns what
    /// `read` has made of it, too, unless the file was there.
    ///
    /// `permits` are held until reading ends, even when the caller is dropped before; the reading of a mesh is cancelled by its flag when the caller
    /// is dropped, and after [`READ_TIME`]; other files are read to their end.
    pub async fn add<T: Send + 'static>(
        &self,
        owner: Owner,
        kind: UploadKind,
        bytes: Bytes,
        permits: impl Send + 'static,
        read: impl FnOnce(&[u8], &AtomicBool) -> Result<(T, About), UploadError> + Send + 'static,
    ) -> Result<(UploadedFile, Option<T>), UploadError> {
        let id = blake3::hash(&bytes).to_hex()[..ID_DIGITS].to_owned();
        if let Some(file) = self.store.uploaded_again(kind, &id).await? {
            return Ok((file, None));
        }
        let (parsed, about) = in_time(bytes.clone(), permits, read).await?;
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
        Ok((file, Some(parsed)))
    }

    /// Checks and stores a file of which only what `read` tells of it is kept, as [`Self::add`] does.
    pub async fn add_described(
        &self,
        owner: Owner,
        kind: UploadKind,
        bytes: Bytes,
        permits: impl Send + 'static,
        read: fn(&[u8]) -> Result<About, UploadError>,
    ) -> Result<UploadedFile, UploadError> {
        Ok(self.add(owner, kind, bytes, permits, move |bytes, _| Ok(((), read(bytes)?))).await?.0)
    }

    /// Returns the record of a file; none if there is none of this kind.
    pub async fn find(&self, kind: UploadKind, id: &str) -> Result<Option<UploadedFile>, StoreError> {
        self.store.upload(kind, id).await
    }

    /// Reads the content of a file.
    pub async fn content(&self, file: &UploadedFile) -> Result<Bytes, FileError> {
        self.artifacts.read(&file.key).await
    }
}

/// Reads weather.
pub fn about_weather(bytes: &[u8]) -> Result<About, UploadError> {
    let (_, report) = read_weather(bytes)?;
    Ok(About::Weather(Box::new(report)))
}

/// Reads an array.
pub fn about_array(bytes: &[u8]) -> Result<About, UploadError> {
    let [rows, columns] = npy::decode(bytes)?.shape.map(|number| number as u64);
    Ok(About::Array(AboutArray { rows, columns }))
}

/// Reads a Honeybee model.
pub fn about_model(bytes: &[u8]) -> Result<About, UploadError> {
    Ok(About::Model(read_report(bytes)?))
}

/// Reads a file off the async threads, for [`READ_TIME`] at most.
async fn in_time<T: Send + 'static>(
    bytes: Bytes,
    permits: impl Send + 'static,
    read: impl FnOnce(&[u8], &AtomicBool) -> Result<T, UploadError> + Send + 'static,
) -> Result<T, UploadError> {
    let cancel = CancelOnDrop::default();
    let flag = cancel.flag();
    let mut reading = tokio::task::spawn_blocking(move || {
        let _permits = permits;
        read(&bytes, &flag)
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
