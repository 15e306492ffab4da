//! Files of jobs and uploads in an object store.

use std::collections::HashSet;
use std::ops::Range;
use std::path::Path as FilePath;
use std::sync::Arc;
use std::time::SystemTime;

use bytes::Bytes;
use futures::stream::BoxStream;
use futures::{StreamExt, TryStreamExt};
use object_store::local::LocalFileSystem;
use object_store::path::Path;
use object_store::{GetOptions, GetRange, ObjectStore, ObjectStoreExt, PutMode, PutOptions, PutPayload};
use uuid::Uuid;

use crate::job::store::{Artifact, Lease};

#[derive(Debug, thiserror::Error)]
pub enum ArtifactError {
    #[error("{0} is not there")]
    NotFound(String),
    #[error("{key} is damaged: its hash is not {hash}")]
    Damaged { key: String, hash: String },
    #[error("the artifact store failed: {0}")]
    Failed(String),
}

/// Write-once files. What a key holds never changes, so that a reader never sees half a file or a mix of two.
#[derive(Clone)]
pub struct Artifacts {
    store: Arc<dyn ObjectStore>,
}

/// Characters of the content hash in keys.
const HASH_IN_KEY: usize = 16;

impl Artifacts {
    /// Files below `directory`, which is created when it is not there.
    pub fn on_disk(directory: &FilePath) -> Result<Self, ArtifactError> {
        std::fs::create_dir_all(directory)
            .map_err(|error| ArtifactError::Failed(format!("{}: {error}", directory.display())))?;
        let store = LocalFileSystem::new_with_prefix(directory)
            .map_err(failed)?
            // without it a committed pointer can outlive its file when the power fails
            .with_fsync(true)
            .with_automatic_cleanup(true);
        Ok(Self { store: Arc::new(store) })
    }

    /// Stores a file of a claimed chunk; its key says whose attempt it is from.
    pub async fn put_of_chunk(
        &self,
        lease: &Lease,
        name: &str,
        media_type: &str,
        bytes: Vec<u8>,
    ) -> Result<Artifact, ArtifactError> {
        let hash = blake3::hash(&bytes).to_hex().to_string();
        let flat_name = name.replace('/', "_");
        let key = format!("jobs/{}/{}-{}-{}-{flat_name}", lease.job, lease.chunk, lease.attempt, &hash[..HASH_IN_KEY]);
        let size = bytes.len() as u64;
        self.put(&key, bytes.into()).await?;
        Ok(Artifact { name: name.to_owned(), key, hash, size, media_type: media_type.to_owned() })
    }

    /// Stores a file that is not there yet. A key names its content: when it is there already, it is the same file.
    pub async fn put(&self, key: &str, bytes: Bytes) -> Result<(), ArtifactError> {
        let options = PutOptions { mode: PutMode::Create, ..PutOptions::default() };
        match self.store.put_opts(&path(key)?, PutPayload::from_bytes(bytes), options).await {
            Ok(_) | Err(object_store::Error::AlreadyExists { .. }) => Ok(()),
            Err(error) => Err(failed(error)),
        }
    }

    /// The file, or `range` of it, piece by piece.
    pub async fn stream(
        &self,
        key: &str,
        range: Option<Range<u64>>,
    ) -> Result<BoxStream<'static, Result<Bytes, ArtifactError>>, ArtifactError> {
        let options = GetOptions { range: range.map(GetRange::Bounded), ..GetOptions::default() };
        let result = self.store.get_opts(&path(key)?, options).await.map_err(failed)?;
        Ok(result.into_stream().map_err(failed).boxed())
    }

    pub async fn read(&self, key: &str) -> Result<Bytes, ArtifactError> {
        self.store.get(&path(key)?).await.map_err(failed)?.bytes().await.map_err(failed)
    }

    /// The whole file, after a look whether its content is what was stored.
    pub async fn read_checked(&self, key: &str, hash: &str) -> Result<Bytes, ArtifactError> {
        let bytes = self.read(key).await?;
        if blake3::hash(&bytes).to_hex().as_str() != hash {
            return Err(ArtifactError::Damaged { key: key.to_owned(), hash: hash.to_owned() });
        }
        Ok(bytes)
    }

    /// Deletes a file; one that is not there is no error.
    pub async fn delete(&self, key: &str) -> Result<(), ArtifactError> {
        match self.store.delete(&path(key)?).await {
            Ok(()) | Err(object_store::Error::NotFound { .. }) => Ok(()),
            Err(error) => Err(failed(error)),
        }
    }

    /// Deletes all files of a job.
    pub async fn delete_job(&self, job: Uuid) -> Result<(), ArtifactError> {
        let keys: Vec<Path> = self
            .store
            .list(Some(&path(&format!("jobs/{job}"))?))
            .map_ok(|meta| meta.location)
            .try_collect()
            .await
            .map_err(failed)?;
        for key in keys {
            self.delete(key.as_ref()).await?;
        }
        Ok(())
    }

    /// Deletes files last written before `before` that are not in `keep`: a killed process left them between storing and
    /// committing. Answers how many.
    pub async fn sweep(&self, keep: &HashSet<String>, before: SystemTime) -> Result<u64, ArtifactError> {
        let before_ms = before.duration_since(SystemTime::UNIX_EPOCH).map_or(0, |time| time.as_millis());
        let old: Vec<Path> = self
            .store
            .list(None)
            .try_filter_map(|meta| {
                let written_ms = u128::try_from(meta.last_modified.timestamp_millis()).unwrap_or(0);
                futures::future::ready(Ok((written_ms < before_ms).then_some(meta.location)))
            })
            .try_collect()
            .await
            .map_err(failed)?;
        let mut deleted = 0;
        for key in old.iter().filter(|key| !keep.contains(key.as_ref())) {
            self.delete(key.as_ref()).await?;
            deleted += 1;
        }
        Ok(deleted)
    }

    /// Whether the store answers.
    pub async fn ready(&self) -> Result<(), ArtifactError> {
        match self.store.head(&path("ready")?).await {
            Ok(_) | Err(object_store::Error::NotFound { .. }) => Ok(()),
            Err(error) => Err(failed(error)),
        }
    }
}

fn path(key: &str) -> Result<Path, ArtifactError> {
    Path::parse(key).map_err(|error| ArtifactError::Failed(error.to_string()))
}

fn failed(error: object_store::Error) -> ArtifactError {
    match error {
        object_store::Error::NotFound { path, .. } => ArtifactError::NotFound(path),
        error => ArtifactError::Failed(error.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lease() -> Lease {
        Lease { job: Uuid::now_v7(), chunk: 3, owner: "me".into(), attempt: 2, failures: 0 }
    }

    #[tokio::test]
    async fn files_are_written_once_and_found_again() {
        let directory = tempfile::tempdir().unwrap();
        let artifacts = Artifacts::on_disk(directory.path()).unwrap();
        let lease = lease();
        let artifact =
            artifacts.put_of_chunk(&lease, "grids/a.json", "application/json", b"12345".to_vec()).await.unwrap();
        let again =
            artifacts.put_of_chunk(&lease, "grids/a.json", "application/json", b"12345".to_vec()).await.unwrap();
        assert_eq!(artifact, again);
        assert!(artifact.key.starts_with(&format!("jobs/{}/3-2-{}", lease.job, &artifact.hash[..16])));
        assert_eq!(artifacts.read_checked(&artifact.key, &artifact.hash).await.unwrap().as_ref(), b"12345");
        let part: Vec<Bytes> = artifacts.stream(&artifact.key, Some(1..3)).await.unwrap().try_collect().await.unwrap();
        assert_eq!(part.concat(), b"23");
        std::fs::write(directory.path().join(&artifact.key), b"12346").unwrap();
        assert!(matches!(
            artifacts.read_checked(&artifact.key, &artifact.hash).await,
            Err(ArtifactError::Damaged { .. })
        ));
        artifacts.delete_job(lease.job).await.unwrap();
        assert!(matches!(artifacts.read(&artifact.key).await, Err(ArtifactError::NotFound(_))));
    }

    #[tokio::test]
    async fn the_sweep_takes_old_orphans_only() {
        let directory = tempfile::tempdir().unwrap();
        let artifacts = Artifacts::on_disk(directory.path()).unwrap();
        for key in ["jobs/a/orphan", "jobs/a/kept", "meshes/orphan"] {
            artifacts.put(key, Bytes::from_static(b"x")).await.unwrap();
        }
        let keep = HashSet::from(["jobs/a/kept".to_owned()]);
        assert_eq!(artifacts.sweep(&keep, SystemTime::UNIX_EPOCH).await.unwrap(), 0);
        let later = SystemTime::now() + std::time::Duration::from_secs(60);
        assert_eq!(artifacts.sweep(&keep, later).await.unwrap(), 2);
        artifacts.read("jobs/a/kept").await.unwrap();
    }
}
