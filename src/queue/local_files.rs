//! Files in a folder of the local disk.

use std::collections::BTreeSet;
use std::error::Error;
use std::fs::File;
use std::io;
use std::ops::Range;
use std::path::{Path as FilePath, PathBuf};

use async_trait::async_trait;
use bytes::Bytes;
use futures::{StreamExt, TryStreamExt};
use object_store::local::LocalFileSystem;
use object_store::path::Path;
use object_store::{GetOptions, GetRange, ObjectMeta, ObjectStore, ObjectStoreExt, PutMode, PutOptions, PutPayload};

use super::durability::Durability;
use super::files::{FileError, FileInfo, Files, Pieces};
use super::private_folder::create_private_folder;

/// Files below one folder.
pub struct LocalFiles {
    store: LocalFileSystem,
    root: PathBuf,
}

impl LocalFiles {
    /// Opens the files below `folder`, which is created when it is not there, for this user only.
    pub fn open(folder: &FilePath) -> Result<Self, FileError> {
        let unusable = |error: &dyn std::fmt::Display| FileError::Failed(format!("{}: {error}", folder.display()));
        create_private_folder(folder).map_err(|error| unusable(&error))?;
        let root = folder.canonicalize().map_err(|error| unusable(&error))?;
        // `sync` brings files to the disk, many at once
        let store = LocalFileSystem::new_with_prefix(&root)
            .map_err(|error| unusable(&error))?
            .with_fsync(false)
            .with_automatic_cleanup(true);
        Ok(Self { store, root })
    }
}

#[async_trait]
impl Files for LocalFiles {
    async fn put(&self, key: &str, bytes: Bytes) -> Result<Option<Durability>, FileError> {
        let options = PutOptions { mode: PutMode::Create, ..PutOptions::default() };
        match self.store.put_opts(&path(key)?, PutPayload::from_bytes(bytes), options).await {
            Ok(_) => Ok(Some(Durability::Buffered)),
            Err(object_store::Error::AlreadyExists { .. }) => Ok(None),
            Err(error) => Err(failed(key, error)),
        }
    }

    /// Waits until these files and the folders that lead to them are on the disk: all at the same time, which costs the disk little more
    /// than one.
    async fn sync(&self, keys: &[&str]) -> Result<(), FileError> {
        let mut paths = BTreeSet::new();
        for key in keys {
            let file = self.root.join(key);
            paths.extend(file.ancestors().take_while(|folder| folder.starts_with(&self.root)).map(FilePath::to_owned));
        }
        let synced = paths
            .into_iter()
            .map(|path| tokio::task::spawn_blocking(move || File::open(path).and_then(|file| file.sync_all())));
        for synced in futures::future::join_all(synced).await {
            synced
                .map_err(|error| FileError::Failed(error.to_string()))?
                .map_err(|error| failure(&error, format!("a file cannot be flushed to the disk: {error}")))?;
        }
        Ok(())
    }

    async fn get(&self, key: &str) -> Result<Bytes, FileError> {
        let failed = |error| failed(key, error);
        self.store.get(&path(key)?).await.map_err(failed)?.bytes().await.map_err(failed)
    }

    async fn open(&self, key: &str, range: Option<Range<u64>>) -> Result<(FileInfo, Pieces), FileError> {
        let options = GetOptions { range: range.map(GetRange::Bounded), ..GetOptions::default() };
        let found = self.store.get_opts(&path(key)?, options).await.map_err(|error| failed(key, error))?;
        let (info, key) = (info(&found.meta), key.to_owned());
        Ok((info, found.into_stream().map_err(move |error| failed(&key, error)).boxed()))
    }

    async fn list(&self, folder: &str) -> Result<Vec<FileInfo>, FileError> {
        let files = self.store.list(Some(&path(folder)?)).map_ok(|meta| info(&meta));
        files.try_collect().await.map_err(|error| failed(folder, error))
    }

    async fn delete(&self, key: &str) -> Result<(), FileError> {
        match self.store.delete(&path(key)?).await {
            Ok(()) | Err(object_store::Error::NotFound { .. }) => Ok(()),
            Err(error) => Err(failed(key, error)),
        }
    }

    fn free_bytes(&self) -> Result<u64, FileError> {
        let system = rustix::fs::statvfs(&self.root).map_err(|error| FileError::Failed(error.to_string()))?;
        Ok(system.f_bavail.saturating_mul(system.f_frsize))
    }
}

fn info(meta: &ObjectMeta) -> FileInfo {
    FileInfo { key: meta.location.to_string(), size: meta.size, written: meta.last_modified.into() }
}

fn path(key: &str) -> Result<Path, FileError> {
    Path::parse(key).map_err(|error| FileError::Failed(error.to_string()))
}

fn failed(key: &str, error: object_store::Error) -> FileError {
    match error {
        object_store::Error::NotFound { .. } => FileError::NotFound(key.to_owned()),
        error => failure(&error, error.to_string()),
    }
}

/// Makes an error with `text`: [`FileError::Full`] where the disk or the quota of its user is full, or where files may not be as long.
fn failure(error: &(dyn Error + 'static), text: String) -> FileError {
    let causes = std::iter::successors(Some(error), |error| (**error).source());
    let kinds = causes.filter_map(|cause| cause.downcast_ref::<io::Error>()).map(io::Error::kind);
    let is_full = |kind: io::ErrorKind| {
        matches!(kind, io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded | io::ErrorKind::FileTooLarge)
    };
    if kinds.into_iter().any(is_full) { FileError::Full(text) } else { FileError::Failed(text) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_disk_is_told_from_other_failures() {
        let of = |kind: io::ErrorKind| {
            let source = Box::new(io::Error::from(kind));
            failed("x", object_store::Error::Generic { store: "x", source })
        };
        for kind in [io::ErrorKind::StorageFull, io::ErrorKind::QuotaExceeded, io::ErrorKind::FileTooLarge] {
            assert!(matches!(of(kind), FileError::Full(_)), "{kind}");
        }
        assert!(matches!(of(io::ErrorKind::PermissionDenied), FileError::Failed(_)));
    }
}
