//! Files of jobs and uploads: their keys, and the checks that they are as they were stored.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use bytes::Bytes;
use futures::{StreamExt, TryStreamExt, stream};
use uuid::Uuid;

use super::durability::Durability;
use super::files::{FileError, FileInfo, Files, Pieces};
use super::store::{Artifact, Lease};

/// Files of jobs and uploads, in any store of files.
#[derive(Clone)]
pub struct Artifacts {
    files: Arc<dyn Files>,
    /// Large files whose content was verified, by key, as they were then.
    checked: Arc<Mutex<HashMap<String, FileInfo>>>,
}

/// Folders of the files that rows point to; notes of the store lie beside them.
const FOLDERS: [&str; 5] = ["jobs", "meshes", "weather", "arrays", "models"];

/// Size in bytes up to which a file is hashed each time it is served. A larger one is hashed once, and again when its size or time of
/// change differs: a flipped bit that leaves both as they were is found in the smaller files only.
const ALWAYS_CHECKED_BYTES: u64 = 1 << 20;

/// Number of large files that are remembered as verified; then all are forgotten.
const MOST_REMEMBERED: usize = 10_000;

/// Number of characters of the content hash in keys.
const HASH_IN_KEY: usize = 16;

impl Artifacts {
    /// Keeps the artifacts in these files.
    pub fn new(files: impl Files) -> Self {
        Self { files: Arc::new(files), checked: Arc::default() }
    }

    /// Stores a file of a claimed chunk; its key has the job, the chunk and the attempt. The file is durable after [`Self::sync`].
    pub async fn put_of_chunk(
        &self,
        lease: &Lease,
        name: &str,
        media_type: &str,
        bytes: Bytes,
    ) -> Result<Artifact, FileError> {
        let hash = blake3::hash(&bytes).to_hex().to_string();
        let flat_name = name.replace('/', "_");
        let key = format!("jobs/{}/{}-{}-{}-{flat_name}", lease.job, lease.chunk, lease.attempt, &hash[..HASH_IN_KEY]);
        let size = bytes.len() as u64;
        // one that is there was left by an attempt that the store forgot in a power failure: it may be cut short
        if self.files.put(&key, bytes.clone()).await?.is_none() && self.read_checked(&key, &hash).await.is_err() {
            self.delete(&key).await?;
            self.files.put(&key, bytes).await?;
        }
        Ok(Artifact { name: name.to_owned(), key, hash, size, media_type: media_type.to_owned(), content: None })
    }

    /// Stores a file durably, unless it is there already: a key names its content, so that it is the same file then.
    pub async fn put(&self, key: &str, bytes: Bytes) -> Result<(), FileError> {
        match self.files.put(key, bytes).await? {
            Some(Durability::Committed) => Ok(()),
            Some(Durability::Buffered) | None => self.files.sync(&[key]).await,
        }
    }

    /// Waits until these files are durable.
    pub async fn sync(&self, keys: &[impl AsRef<str>]) -> Result<(), FileError> {
        let keys: Vec<&str> = keys.iter().map(AsRef::as_ref).collect();
        self.files.sync(&keys).await
    }

    /// Returns the file, or `range` of its bytes, piece by piece.
    pub async fn stream(&self, artifact: &Artifact, range: Option<Range<u64>>) -> Result<Pieces, FileError> {
        if let Some(content) = &artifact.content {
            let at = |position: u64| usize::try_from(position).unwrap_or(usize::MAX).min(content.len());
            let piece = range.map_or(content.clone(), |range| content.slice(at(range.start)..at(range.end)));
            return Ok(stream::iter([Ok(piece)]).boxed());
        }
        Ok(self.files.open(&artifact.key, range).await?.1)
    }

    pub async fn read(&self, key: &str) -> Result<Bytes, FileError> {
        self.files.get(key).await
    }

    /// Checks that the file is as it was stored. A small one is read anew each time, a large one when it may have changed since.
    pub async fn check(&self, artifact: &Artifact) -> Result<(), FileError> {
        if let Some(content) = &artifact.content {
            return check_hash(content, &artifact.name, &artifact.hash);
        }
        let key = &artifact.key;
        let (info, mut pieces) = self.files.open(key, None).await?;
        let damaged = || FileError::Damaged { key: key.clone(), hash: artifact.hash.clone() };
        if info.size != artifact.size {
            return Err(damaged());
        }
        let large = artifact.size > ALWAYS_CHECKED_BYTES;
        if large && self.checked.lock().unwrap_or_else(PoisonError::into_inner).get(key) == Some(&info) {
            return Ok(());
        }
        let mut hasher = blake3::Hasher::new();
        while let Some(piece) = pieces.try_next().await? {
            hasher.update(&piece);
        }
        if hasher.finalize().to_hex().as_str() != artifact.hash {
            return Err(damaged());
        }
        if large {
            let mut checked = self.checked.lock().unwrap_or_else(PoisonError::into_inner);
            if checked.len() >= MOST_REMEMBERED {
                checked.clear();
            }
            checked.insert(key.clone(), info);
        }
        Ok(())
    }

    /// Reads a whole file of a job, and checks that its content is as it was stored.
    pub async fn read_artifact(&self, artifact: &Artifact) -> Result<Bytes, FileError> {
        match &artifact.content {
            Some(content) => check_hash(content, &artifact.name, &artifact.hash).map(|()| content.clone()),
            None => self.read_checked(&artifact.key, &artifact.hash).await,
        }
    }

    /// Reads the whole file at a key, and checks that its content is as it was stored.
    pub async fn read_checked(&self, key: &str, hash: &str) -> Result<Bytes, FileError> {
        let bytes = self.read(key).await?;
        check_hash(&bytes, key, hash)?;
        Ok(bytes)
    }

    /// Deletes a file; one that is not there is no error.
    pub async fn delete(&self, key: &str) -> Result<(), FileError> {
        self.files.delete(key).await
    }

    /// Deletes all files of a job.
    pub async fn delete_job(&self, job: Uuid) -> Result<(), FileError> {
        for file in self.files.list(&format!("jobs/{job}")).await? {
            self.delete(&file.key).await?;
        }
        Ok(())
    }

    /// Lists the files to which rows may point.
    pub async fn all(&self) -> Result<Vec<FileInfo>, FileError> {
        let mut all = Vec::new();
        for folder in FOLDERS {
            all.extend(self.files.list(folder).await?);
        }
        Ok(all)
    }

    /// Reads a one-line note of the store about itself; `None` if there is none.
    pub async fn note(&self, name: &str) -> Result<Option<String>, FileError> {
        match self.read(name).await {
            Ok(bytes) => Ok(Some(String::from_utf8_lossy(&bytes).trim().to_owned())),
            Err(FileError::NotFound(_)) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Writes a note in place of the one that is there.
    pub async fn set_note(&self, name: &str, text: &str) -> Result<(), FileError> {
        self.delete(name).await?;
        self.put(name, format!("{text}\n").into()).await
    }

    /// Proves that files can be written, by writing and deleting one.
    pub async fn ready(&self) -> Result<(), FileError> {
        let name = format!("ready-{}", Uuid::new_v4());
        self.files.put(&name, Bytes::from_static(b"ready\n")).await?;
        self.delete(&name).await
    }

    /// Returns the number of bytes that this process can still write.
    pub fn free_bytes(&self) -> Result<u64, FileError> {
        self.files.free_bytes()
    }
}

fn check_hash(content: &[u8], key: &str, hash: &str) -> Result<(), FileError> {
    if blake3::hash(content).to_hex().as_str() == hash {
        return Ok(());
    }
    Err(FileError::Damaged { key: key.to_owned(), hash: hash.to_owned() })
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, SystemTime};

    use super::*;
    use crate::queue::local_files::LocalFiles;

    fn lease() -> Lease {
        Lease {
            job: Uuid::now_v7(),
            chunk: 3,
            owner: "me".into(),
            attempt: 2,
            failures: 0,
            others_wait: false,
            slices: 0,
            cancel_requested: false,
        }
    }

    #[tokio::test]
    async fn files_are_written_once_and_found_again() {
        let directory = tempfile::tempdir().unwrap();
        let artifacts = Artifacts::new(LocalFiles::open(directory.path()).unwrap());
        let lease = lease();
        let artifact = artifacts
            .put_of_chunk(&lease, "grids/a.json", "application/json", Bytes::from_static(b"12345"))
            .await
            .unwrap();
        let again = artifacts
            .put_of_chunk(&lease, "grids/a.json", "application/json", Bytes::from_static(b"12345"))
            .await
            .unwrap();
        assert_eq!(artifact, again);
        assert!(artifact.key.starts_with(&format!("jobs/{}/3-2-{}", lease.job, &artifact.hash[..16])));
        assert_eq!(artifacts.read_checked(&artifact.key, &artifact.hash).await.unwrap().as_ref(), b"12345");
        let part: Vec<Bytes> = artifacts.stream(&artifact, Some(1..3)).await.unwrap().try_collect().await.unwrap();
        assert_eq!(part.concat(), b"23");
        std::fs::write(directory.path().join(&artifact.key), b"12346").unwrap();
        assert!(matches!(artifacts.read_checked(&artifact.key, &artifact.hash).await, Err(FileError::Damaged { .. })));
        artifacts.delete_job(lease.job).await.unwrap();
        assert!(matches!(artifacts.read(&artifact.key).await, Err(FileError::NotFound(_))));
    }

    /// Content that the store keeps itself is served like a file, and damage to it is detected.
    #[tokio::test]
    async fn content_beside_its_name_is_a_file_like_others() {
        let directory = tempfile::tempdir().unwrap();
        let artifacts = Artifacts::new(LocalFiles::open(directory.path()).unwrap());
        let kept = Artifact::in_store("grids/a.json".into(), "application/json", Bytes::from_static(b"12345"));
        assert_eq!((kept.size, artifacts.read_artifact(&kept).await.unwrap().as_ref()), (5, b"12345".as_slice()));
        artifacts.check(&kept).await.unwrap();
        for (range, expected) in [(None, b"12345".as_slice()), (Some(1..3), b"23"), (Some(3..9), b"45")] {
            let pieces: Vec<Bytes> = artifacts.stream(&kept, range).await.unwrap().try_collect().await.unwrap();
            assert_eq!(pieces.concat(), expected);
        }
        let damaged = Artifact { content: Some(Bytes::from_static(b"12346")), ..kept };
        assert!(matches!(artifacts.check(&damaged).await, Err(FileError::Damaged { .. })));
        assert!(matches!(artifacts.read_artifact(&damaged).await, Err(FileError::Damaged { .. })));
    }

    #[tokio::test]
    async fn a_file_that_was_cut_short_is_written_again() {
        let directory = tempfile::tempdir().unwrap();
        let artifacts = Artifacts::new(LocalFiles::open(directory.path()).unwrap());
        let lease = lease();
        let put = || artifacts.put_of_chunk(&lease, "state", "application/octet-stream", Bytes::from_static(b"12345"));
        let artifact = put().await.unwrap();
        std::fs::write(directory.path().join(&artifact.key), b"12").unwrap();
        assert_eq!(put().await.unwrap(), artifact);
        artifacts.check(&artifact).await.unwrap();
    }

    #[tokio::test]
    async fn damage_is_seen_in_small_and_large_files() {
        let directory = tempfile::tempdir().unwrap();
        let artifacts = Artifacts::new(LocalFiles::open(directory.path()).unwrap());
        for (name, size) in [("small", 100), ("large", 3 << 20)] {
            let bytes = vec![7_u8; size];
            let artifact = artifacts.put_of_chunk(&lease(), name, "x/y", bytes.clone().into()).await.unwrap();
            artifacts.check(&artifact).await.unwrap();
            artifacts.check(&artifact).await.unwrap();
            let file = directory.path().join(&artifact.key);
            let mut flipped = bytes.clone();
            flipped[size / 2] ^= 1;
            std::fs::write(&file, &flipped).unwrap();
            // coarse clocks
            let later = SystemTime::now() + Duration::from_secs(2);
            std::fs::File::options().write(true).open(&file).unwrap().set_modified(later).unwrap();
            assert!(matches!(artifacts.check(&artifact).await, Err(FileError::Damaged { .. })), "{name}");
            std::fs::write(&file, &bytes[1..]).unwrap();
            assert!(matches!(artifacts.check(&artifact).await, Err(FileError::Damaged { .. })), "{name}");
            std::fs::remove_file(&file).unwrap();
            let Err(FileError::NotFound(key)) = artifacts.check(&artifact).await else { panic!("{name}") };
            assert_eq!(key, artifact.key, "no path of the machine");
        }
    }

    #[tokio::test]
    async fn notes_are_no_files_of_jobs() {
        let directory = tempfile::tempdir().unwrap();
        let artifacts = Artifacts::new(LocalFiles::open(directory.path()).unwrap());
        assert_eq!(artifacts.all().await.unwrap(), []);
        for key in ["jobs/a/b", "meshes/c", "models/d"] {
            artifacts.put(key, Bytes::from_static(b"x")).await.unwrap();
        }
        std::fs::write(directory.path().join("identity"), "").unwrap();
        artifacts.set_note("identity", "me").await.unwrap();
        let keys: Vec<String> = artifacts.all().await.unwrap().into_iter().map(|file| file.key).collect();
        assert_eq!(keys, ["jobs/a/b", "meshes/c", "models/d"]);
        assert_eq!(artifacts.note("identity").await.unwrap().as_deref(), Some("me"));
        artifacts.ready().await.unwrap();
        assert!(artifacts.free_bytes().unwrap() > 0);
    }
}
