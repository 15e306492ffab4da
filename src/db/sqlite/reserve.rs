//! Reserve of disk space beside the database: on a full disk, the service gives it back to start, to cancel and to delete.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use rustix::fs::{FallocateFlags, fallocate, statvfs};

/// Size in bytes that the reserve has on a disk with room: for the log of large deletions, and the result files of a job that is cancelled.
const SIZE: u64 = 16 << 20;

/// Free bytes of the disk below which the reserve is given back.
const LEAST_FREE: u64 = 4 << 20;

/// File that holds the space; clones share it.
#[derive(Clone)]
pub(super) struct Reserve {
    file: PathBuf,
    /// Free bytes of the disk below which the space is given back.
    least_free: u64,
    /// Locked while the file changes.
    changing: Arc<Mutex<()>>,
}

impl Reserve {
    /// Creates the reserve of a database file; it holds what an earlier process has left.
    pub fn of(database: &Path) -> Self {
        let mut file = database.as_os_str().to_owned();
        file.push("-reserve");
        Self { file: file.into(), least_free: LEAST_FREE, changing: Arc::default() }
    }

    /// Gives the space back if the disk is nearly full.
    pub fn give_if_needed(&self) {
        let _changing = self.changing.lock().unwrap_or_else(PoisonError::into_inner);
        if self.free_bytes().is_ok_and(|free| free < self.least_free) && self.held() > 0 {
            match fs::remove_file(&self.file) {
                Ok(()) => tracing::warn!("the disk is full: space that was kept for this case is used"),
                Err(error) => tracing::error!(%error, "space that was kept for a full disk cannot be used"),
            }
        }
    }

    /// Takes the space from the disk if it is not held, or half of what is free where that is less.
    pub fn keep(&self) -> io::Result<()> {
        let _changing = self.changing.lock().unwrap_or_else(PoisonError::into_inner);
        let held = self.held();
        let size = SIZE.min((self.free_bytes()? + held) / 2);
        if held >= size {
            return Ok(());
        }
        let file = File::options().create(true).append(true).open(&self.file)?;
        Ok(fallocate(file, FallocateFlags::empty(), 0, size)?)
    }

    fn held(&self) -> u64 {
        fs::metadata(&self.file).map_or(0, |file| file.len())
    }

    fn free_bytes(&self) -> io::Result<u64> {
        let folder = self.file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let disk = statvfs(folder)?;
        Ok(disk.f_bavail.saturating_mul(disk.f_frsize))
    }
}

#[cfg(test)]
mod tests {
    use uuid::Uuid;

    use crate::db::sqlite::SqliteStore;
    use crate::queue::store::{JobStore as _, SetStore as _, Store as _, UploadKind, UploadStore as _};

    /// Each change that makes space uses the reserve of a full disk; it is taken again when there is room.
    #[tokio::test]
    async fn what_makes_space_uses_the_reserve() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.db");
        let mut store = SqliteStore::open(&file).await.unwrap();
        let [none, full] = [0, u64::MAX];
        let id = Uuid::nil();
        for change in 0..6 {
            store.keep_reserve().await.unwrap();
            let held = store.reserve.held();
            assert!(held > 0, "the disk of a test has room");
            for least_free in [none, full] {
                store.reserve.least_free = least_free;
                match change {
                    0 => drop(store.cancel(id).await.unwrap()),
                    1 => assert!(!store.delete(id).await.unwrap()),
                    2 => drop(store.cancel_set(id).await.unwrap()),
                    3 => assert!(!store.delete_set(id).await.unwrap()),
                    4 => drop(store.delete_upload(UploadKind::Mesh, "none").await.unwrap()),
                    _ => drop(store.delete_unused_uploads(0).await.unwrap()),
                }
                assert_eq!(store.reserve.held(), if least_free == full { 0 } else { held }, "change {change}");
            }
        }
    }
}
