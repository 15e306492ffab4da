//! Files of jobs and uploads in an object store.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::error::Error;
use std::io;
use std::ops::Range;
use std::path::{Path as FilePath, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, SystemTime};

use bytes::Bytes;
use futures::stream::{self, BoxStream};
use futures::{StreamExt, TryStreamExt};
use object_store::local::LocalFileSystem;
use object_store::path::Path;
use object_store::{GetOptions, GetRange, ObjectMeta, ObjectStore, ObjectStoreExt, PutMode, PutOptions, PutPayload};
use uuid::Uuid;

use crate::queue::private_folder::create_private_folder;
use crate::queue::store::{Artifact, Lease};

#[derive(Debug, thiserror::Error)]
pub enum ArtifactError {
    /// No file has this key.
    #[error("{0} is missing")]
    NotFound(String),
    #[error("the file {key} is damaged: its hash is not {hash}")]
    Damaged { key: String, hash: String },
    /// Full disk; the text is for the log, too.
    #[error("the artifact store is full: {0}")]
    Full(String),
    /// Other failure, for the log: the text may have paths of this machine.
    #[error("the artifact store failed: {0}")]
    Failed(String),
}

/// Store of write-once files. The content of a key never changes, so that a reader never sees half a file or a mix of two.
#[derive(Clone)]
pub struct Artifacts {
    store: Arc<LocalFileSystem>,
    root: PathBuf,
    /// Large files whose content was verified, with their size and time of change then.
    checked: Arc<Mutex<HashMap<String, Seen>>>,
    /// Folders of [`FOLDERS`] whose entry in the top folder is certainly on the disk.
    top_folders: Arc<Mutex<HashSet<String>>>,
}

/// Properties of a file that change when somebody writes to it.
#[derive(Clone, PartialEq)]
struct Seen {
    size: u64,
    modified_ms: i64,
}

/// A file that nothing points to.
#[derive(Clone, Debug)]
pub struct Orphan {
    pub key: String,
    pub written: SystemTime,
}

/// Folders of the files that rows point to; notes of the store lie beside them.
const FOLDERS: [&str; 2] = ["jobs", "meshes"];

/// Size in bytes up to which a file is hashed each time it is served. A larger one is hashed once, and again when its size or time of
/// change differs: a flipped bit that leaves both as they were is found in the smaller files only.
const ALWAYS_CHECKED_BYTES: u64 = 1 << 20;

/// Number of large files that are remembered as verified; then all are forgotten.
const MOST_REMEMBERED: usize = 10_000;

/// Number of characters of the content hash in keys.
const HASH_IN_KEY: usize = 16;

impl Artifacts {
    /// Opens the files below `directory`, which is created when it is not there, for this user only.
    pub fn on_disk(directory: &FilePath) -> Result<Self, ArtifactError> {
        let unusable =
            |error: &dyn std::fmt::Display| ArtifactError::Failed(format!("{}: {error}", directory.display()));
        create_private_folder(directory).map_err(|error| unusable(&error))?;
        let root = directory.canonicalize().map_err(|error| unusable(&error))?;
        // files are brought to the disk by `make_durable`, many at once
        let store = LocalFileSystem::new_with_prefix(&root)
            .map_err(|error| unusable(&error))?
            .with_fsync(false)
            .with_automatic_cleanup(true);
        Ok(Self { store: Arc::new(store), root, checked: Arc::default(), top_folders: Arc::default() })
    }

    /// Stores a file of a claimed chunk; its key has the job, the chunk and the attempt. The file survives the end of the process, and
    /// after [`Self::make_durable`] a power failure.
    pub async fn put_of_chunk(
        &self,
        lease: &Lease,
        name: &str,
        media_type: &str,
        bytes: Bytes,
    ) -> Result<Artifact, ArtifactError> {
        let hash = blake3::hash(&bytes).to_hex().to_string();
        let flat_name = name.replace('/', "_");
        let key = format!("jobs/{}/{}-{}-{}-{flat_name}", lease.job, lease.chunk, lease.attempt, &hash[..HASH_IN_KEY]);
        let size = bytes.len() as u64;
        match self.put_if_absent(&key, bytes.clone()).await {
            Ok(true) => {}
            Ok(false) => {
                // left by an attempt that the store forgot in a power failure: the file may be cut short
                if self.read_checked(&key, &hash).await.is_err() {
                    self.delete(&key).await?;
                    self.put_if_absent(&key, bytes).await?;
                }
            }
            Err(error) => return Err(error),
        }
        Ok(Artifact { name: name.to_owned(), key, hash, size, media_type: media_type.to_owned(), content: None })
    }

    /// Stores a file durably, unless it is there already: a key names its content, so that it is the same file then.
    pub async fn put(&self, key: &str, bytes: Bytes) -> Result<(), ArtifactError> {
        self.put_if_absent(key, bytes).await?;
        self.make_durable(&[key]).await
    }

    async fn put_if_absent(&self, key: &str, bytes: Bytes) -> Result<bool, ArtifactError> {
        let options = PutOptions { mode: PutMode::Create, ..PutOptions::default() };
        match self.store.put_opts(&path(key)?, PutPayload::from_bytes(bytes), options).await {
            Ok(_) => Ok(true),
            Err(object_store::Error::AlreadyExists { .. }) => Ok(false),
            Err(error) => Err(failed(key, error)),
        }
    }

    /// Waits until these files and the folders that lead to them are on the disk: all at the same time, which costs the disk little more
    /// than one. The top folder changes only when one of [`FOLDERS`] is created in it, and is waited for once.
    pub async fn make_durable(&self, keys: &[impl AsRef<str>]) -> Result<(), ArtifactError> {
        let mut paths = BTreeSet::new();
        let mut top_folders = HashSet::new();
        for key in keys {
            let file = self.root.join(key.as_ref());
            let folders = file.ancestors().skip(1).take_while(|folder| *folder != self.root);
            paths.extend(folders.map(FilePath::to_owned));
            paths.insert(file);
            top_folders.extend(key.as_ref().split_once('/').map(|(folder, _)| folder.to_owned()));
        }
        let known = self.top_folders.lock().unwrap_or_else(PoisonError::into_inner).is_superset(&top_folders);
        if !known || keys.iter().any(|key| !key.as_ref().contains('/')) {
            paths.insert(self.root.clone());
        }
        let synced = paths.into_iter().map(|path| {
            tokio::task::spawn_blocking(move || std::fs::File::open(path).and_then(|file| file.sync_all()))
        });
        for synced in futures::future::join_all(synced).await {
            synced
                .map_err(|error| ArtifactError::Failed(error.to_string()))?
                .map_err(|error| failure(&error, format!("a file cannot be flushed to the disk: {error}")))?;
        }
        if !known {
            self.top_folders.lock().unwrap_or_else(PoisonError::into_inner).extend(top_folders);
        }
        Ok(())
    }

    /// Returns the file, or `range` of its bytes, piece by piece.
    pub async fn stream(
        &self,
        artifact: &Artifact,
        range: Option<Range<u64>>,
    ) -> Result<BoxStream<'static, Result<Bytes, ArtifactError>>, ArtifactError> {
        let key = artifact.key.as_str();
        if let Some(content) = &artifact.content {
            let at = |position: u64| usize::try_from(position).unwrap_or(usize::MAX).min(content.len());
            let piece = range.map_or(content.clone(), |range| content.slice(at(range.start)..at(range.end)));
            return Ok(stream::iter([Ok(piece)]).boxed());
        }
        let options = GetOptions { range: range.map(GetRange::Bounded), ..GetOptions::default() };
        let result = self.store.get_opts(&path(key)?, options).await.map_err(|error| failed(key, error))?;
        let key = key.to_owned();
        Ok(result.into_stream().map_err(move |error| failed(&key, error)).boxed())
    }

    pub async fn read(&self, key: &str) -> Result<Bytes, ArtifactError> {
        let failed = |error| failed(key, error);
        self.store.get(&path(key)?).await.map_err(failed)?.bytes().await.map_err(failed)
    }

    /// Checks that the file is as it was stored. A small one is read anew each time, a large one when it may have changed since.
    pub async fn check(&self, artifact: &Artifact) -> Result<(), ArtifactError> {
        if let Some(content) = &artifact.content {
            return check_hash(content, &artifact.name, &artifact.hash);
        }
        let key = &artifact.key;
        let meta = self.store.head(&path(key)?).await.map_err(|error| failed(key, error))?;
        let seen = Seen { size: meta.size, modified_ms: meta.last_modified.timestamp_millis() };
        let damaged = || ArtifactError::Damaged { key: key.clone(), hash: artifact.hash.clone() };
        if seen.size != artifact.size {
            return Err(damaged());
        }
        let large = artifact.size > ALWAYS_CHECKED_BYTES;
        if large && self.checked.lock().unwrap_or_else(PoisonError::into_inner).get(key) == Some(&seen) {
            return Ok(());
        }
        let mut hasher = blake3::Hasher::new();
        let mut pieces = self.stream(artifact, None).await?;
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
            checked.insert(key.clone(), seen);
        }
        Ok(())
    }

    /// Reads a whole file of a job, and checks that its content is as it was stored.
    pub async fn read_artifact(&self, artifact: &Artifact) -> Result<Bytes, ArtifactError> {
        match &artifact.content {
            Some(content) => check_hash(content, &artifact.name, &artifact.hash).map(|()| content.clone()),
            None => self.read_checked(&artifact.key, &artifact.hash).await,
        }
    }

    /// Reads the whole file at a key, and checks that its content is as it was stored.
    pub async fn read_checked(&self, key: &str, hash: &str) -> Result<Bytes, ArtifactError> {
        let bytes = self.read(key).await?;
        check_hash(&bytes, key, hash)?;
        Ok(bytes)
    }

    /// Deletes a file; one that is not there is no error.
    pub async fn delete(&self, key: &str) -> Result<(), ArtifactError> {
        match self.store.delete(&path(key)?).await {
            Ok(()) | Err(object_store::Error::NotFound { .. }) => Ok(()),
            Err(error) => Err(failed(key, error)),
        }
    }

    /// Deletes all files of a job.
    pub async fn delete_job(&self, job: Uuid) -> Result<(), ArtifactError> {
        let folder = format!("jobs/{job}");
        for meta in self.list(&folder).await? {
            self.delete(meta.location.as_ref()).await?;
        }
        Ok(())
    }

    async fn list(&self, folder: &str) -> Result<Vec<ObjectMeta>, ArtifactError> {
        self.store.list(Some(&path(folder)?)).try_collect().await.map_err(|error| failed(folder, error))
    }

    /// Finds the files that are not in `keep`.
    pub async fn orphans(&self, keep: &HashSet<String>) -> Result<Vec<Orphan>, ArtifactError> {
        let mut orphans = Vec::new();
        for folder in FOLDERS {
            let files = self.list(folder).await?.into_iter().filter(|meta| !keep.contains(meta.location.as_ref()));
            orphans.extend(files.map(|meta| Orphan {
                key: meta.location.to_string(),
                written: SystemTime::UNIX_EPOCH
                    + Duration::from_millis(u64::try_from(meta.last_modified.timestamp_millis()).unwrap_or(0)),
            }));
        }
        Ok(orphans)
    }

    /// Checks whether any of these files is there, and whether any file is there at all.
    pub async fn presence(&self, keys: &HashSet<String>) -> Result<Presence, ArtifactError> {
        let mut presence = Presence::default();
        for folder in FOLDERS {
            let prefix = path(folder)?;
            let mut files = self.store.list(Some(&prefix));
            while let Some(meta) = files.try_next().await.map_err(|error| failed(folder, error))? {
                presence.any = true;
                if keys.contains(meta.location.as_ref()) {
                    return Ok(Presence { any: true, known: true });
                }
            }
        }
        Ok(presence)
    }

    /// Reads a one-line note of the folder about itself; `None` if there is none.
    pub async fn note(&self, name: &str) -> Result<Option<String>, ArtifactError> {
        match self.read(name).await {
            Ok(bytes) => Ok(Some(String::from_utf8_lossy(&bytes).trim().to_owned())),
            Err(ArtifactError::NotFound(_)) => Ok(None),
            Err(error) => Err(error),
        }
    }

    pub async fn set_note(&self, name: &str, text: &str) -> Result<(), ArtifactError> {
        self.put(name, format!("{text}\n").into()).await
    }

    /// Proves that files can be written, by writing and deleting one.
    pub async fn ready(&self) -> Result<(), ArtifactError> {
        let name = format!("ready-{}", Uuid::new_v4());
        self.put_if_absent(&name, Bytes::from_static(b"ready\n")).await?;
        self.delete(&name).await
    }

    /// Returns the number of bytes that this process can still write to the file system of the files.
    pub fn free_bytes(&self) -> Result<u64, ArtifactError> {
        let system = rustix::fs::statvfs(&self.root).map_err(|error| ArtifactError::Failed(error.to_string()))?;
        Ok(system.f_bavail.saturating_mul(system.f_frsize))
    }
}

/// Result of a search for a set of files.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Presence {
    pub any: bool,
    /// True if at least one of the requested files is there.
    pub known: bool,
}

fn check_hash(content: &[u8], key: &str, hash: &str) -> Result<(), ArtifactError> {
    if blake3::hash(content).to_hex().as_str() == hash {
        return Ok(());
    }
    Err(ArtifactError::Damaged { key: key.to_owned(), hash: hash.to_owned() })
}

fn path(key: &str) -> Result<Path, ArtifactError> {
    Path::parse(key).map_err(|error| ArtifactError::Failed(error.to_string()))
}

fn failed(key: &str, error: object_store::Error) -> ArtifactError {
    match error {
        object_store::Error::NotFound { .. } => ArtifactError::NotFound(key.to_owned()),
        error => failure(&error, error.to_string()),
    }
}

/// Makes an error with `text`: [`ArtifactError::Full`] where the disk or the quota of its user is full, or where files may not be as long.
fn failure(error: &(dyn Error + 'static), text: String) -> ArtifactError {
    let causes = std::iter::successors(Some(error), |error| (**error).source());
    let kinds = causes.filter_map(|cause| cause.downcast_ref::<io::Error>()).map(io::Error::kind);
    let is_full = |kind: io::ErrorKind| {
        matches!(kind, io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded | io::ErrorKind::FileTooLarge)
    };
    if kinds.into_iter().any(is_full) { ArtifactError::Full(text) } else { ArtifactError::Failed(text) }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let artifacts = Artifacts::on_disk(directory.path()).unwrap();
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
        assert!(matches!(
            artifacts.read_checked(&artifact.key, &artifact.hash).await,
            Err(ArtifactError::Damaged { .. })
        ));
        artifacts.delete_job(lease.job).await.unwrap();
        assert!(matches!(artifacts.read(&artifact.key).await, Err(ArtifactError::NotFound(_))));
    }

    /// Content that the store keeps itself is served like a file, and damage to it is detected.
    #[tokio::test]
    async fn content_beside_its_name_is_a_file_like_others() {
        let directory = tempfile::tempdir().unwrap();
        let artifacts = Artifacts::on_disk(directory.path()).unwrap();
        let kept = Artifact::in_store("grids/a.json".into(), "application/json", Bytes::from_static(b"12345"));
        assert_eq!((kept.size, artifacts.read_artifact(&kept).await.unwrap().as_ref()), (5, b"12345".as_slice()));
        artifacts.check(&kept).await.unwrap();
        for (range, expected) in [(None, b"12345".as_slice()), (Some(1..3), b"23"), (Some(3..9), b"45")] {
            let pieces: Vec<Bytes> = artifacts.stream(&kept, range).await.unwrap().try_collect().await.unwrap();
            assert_eq!(pieces.concat(), expected);
        }
        let damaged = Artifact { content: Some(Bytes::from_static(b"12346")), ..kept };
        assert!(matches!(artifacts.check(&damaged).await, Err(ArtifactError::Damaged { .. })));
        assert!(matches!(artifacts.read_artifact(&damaged).await, Err(ArtifactError::Damaged { .. })));
    }

    #[test]
    fn a_full_disk_is_told_from_other_failures() {
        let of = |kind: io::ErrorKind| {
            let source = Box::new(io::Error::from(kind));
            failed("x", object_store::Error::Generic { store: "x", source })
        };
        for kind in [io::ErrorKind::StorageFull, io::ErrorKind::QuotaExceeded, io::ErrorKind::FileTooLarge] {
            assert!(matches!(of(kind), ArtifactError::Full(_)), "{kind}");
        }
        assert!(matches!(of(io::ErrorKind::PermissionDenied), ArtifactError::Failed(_)));
    }

    #[tokio::test]
    async fn a_file_that_was_cut_short_is_written_again() {
        let directory = tempfile::tempdir().unwrap();
        let artifacts = Artifacts::on_disk(directory.path()).unwrap();
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
        let artifacts = Artifacts::on_disk(directory.path()).unwrap();
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
            assert!(matches!(artifacts.check(&artifact).await, Err(ArtifactError::Damaged { .. })), "{name}");
            std::fs::write(&file, &bytes[1..]).unwrap();
            assert!(matches!(artifacts.check(&artifact).await, Err(ArtifactError::Damaged { .. })), "{name}");
            std::fs::remove_file(&file).unwrap();
            let Err(ArtifactError::NotFound(key)) = artifacts.check(&artifact).await else { panic!("{name}") };
            assert_eq!(key, artifact.key, "no path of the machine");
        }
    }

    #[tokio::test]
    async fn orphans_are_what_nothing_points_to() {
        let directory = tempfile::tempdir().unwrap();
        let artifacts = Artifacts::on_disk(directory.path()).unwrap();
        for key in ["jobs/a/orphan", "jobs/a/kept", "meshes/orphan"] {
            artifacts.put(key, Bytes::from_static(b"x")).await.unwrap();
        }
        artifacts.set_note("identity", "me").await.unwrap();
        let keep = HashSet::from(["jobs/a/kept".to_owned()]);
        let mut orphans: Vec<String> =
            artifacts.orphans(&keep).await.unwrap().into_iter().map(|orphan| orphan.key).collect();
        orphans.sort();
        assert_eq!(orphans, ["jobs/a/orphan", "meshes/orphan"]);
        assert_eq!(artifacts.presence(&keep).await.unwrap(), Presence { any: true, known: true });
        assert_eq!(artifacts.presence(&HashSet::new()).await.unwrap(), Presence { any: true, known: false });
        assert_eq!(artifacts.note("identity").await.unwrap().as_deref(), Some("me"));
        artifacts.ready().await.unwrap();
        assert!(artifacts.free_bytes().unwrap() > 0);
    }
}
