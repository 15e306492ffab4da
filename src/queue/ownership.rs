//! Check that the artifacts belong to the database, and deletion of files that nothing points to.
//!
//! The database and the folder of the artifacts hold the same identity. A start with another database, or with a new one, is refused, so
//! that nothing is rendered, served or deleted for the wrong one. An older copy of the right database (a restored backup) has the right
//! identity, but no rows for the newest files: those are kept for ever.

use std::collections::HashSet;
use std::time::{Duration, SystemTime};

use uuid::Uuid;

use crate::queue::artifacts::Artifacts;
use crate::queue::files::{FileError, FileInfo};
use crate::queue::store::{Store, StoreError, StoreRecord};

/// Name of the note with the identity, in the folder of the artifacts.
pub const NOTE: &str = "identity";

/// Age at which a file that nothing points to is deleted; a younger one may belong to a commit in progress.
const SWEEP_AGE: Duration = Duration::from_secs(24 * 3600);

/// Longest time between two writes of a process to its database while it writes files, differences between the clocks of file systems
/// included.
const WRITES_APART: Duration = Duration::from_secs(600);

#[derive(Debug, thiserror::Error)]
pub enum OwnershipError {
    #[error(
        "the artifacts belong to another database ({note}; this one is {identity}): start with that database, or with another \
         data folder. If they do belong together, delete the file {NOTE} among the artifacts"
    )]
    Differs { note: String, identity: String },
    #[error(
        "the artifacts belong to a database ({note}), but this database has no identity: it is new, or a copy made \
         before databases had one. Start with the database that they belong to, or with another data folder. If they \
         do belong together, delete the file {NOTE} among the artifacts"
    )]
    Unknown { note: String },
    #[error(
        "the database knows none of the stored artifacts: restore the database that they belong to, or start with \
         another data folder"
    )]
    Foreign,
    #[error(
        "the database refers to artifacts, but none of them exists: restore their folder. To continue without them, \
         write the line {identity} into a file {NOTE} in the folder of the artifacts"
    )]
    Gone { identity: String },
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error(transparent)]
    Files(#[from] FileError),
}

/// Checks that the artifacts belong to the store, and writes the identity down where it is missing.
pub async fn check(store: &dyn Store, artifacts: &Artifacts, record: &StoreRecord) -> Result<(), OwnershipError> {
    let note = artifacts.note(NOTE).await?.filter(|note| !note.is_empty());
    let identity = match (&record.identity, note) {
        (Some(identity), Some(note)) if *identity == note => return Ok(()),
        (Some(identity), Some(note)) => return Err(OwnershipError::Differs { note, identity: identity.clone() }),
        // a folder without files may belong to a store that keeps all of its results in rows: two stores with one identity would delete
        // each other's files
        (None, Some(note)) => return Err(OwnershipError::Unknown { note }),
        (identity, None) => identity.clone(),
    };
    let named = store.referenced_keys().await?;
    let files = artifacts.all().await?;
    let is_known = files.is_empty() || files.iter().any(|file| named.contains(&file.key));
    if !is_known && !knows_a_job(store, &files).await? {
        return Err(OwnershipError::Foreign);
    }
    let new = identity.clone().unwrap_or_else(|| Uuid::new_v4().to_string());
    if identity.is_none() {
        store.set_identity(&new).await?;
    }
    if files.is_empty() && !named.is_empty() {
        return Err(OwnershipError::Gone { identity: new });
    }
    Ok(artifacts.set_note(NOTE, &new).await?)
}

/// True if a folder of files belongs to a job in the store, though no row names the files.
async fn knows_a_job(store: &dyn Store, files: &[FileInfo]) -> Result<bool, StoreError> {
    let jobs: HashSet<Uuid> = files.iter().filter_map(|file| file.key.split('/').nth(1)?.parse().ok()).collect();
    for job in jobs {
        if store.job_head(job).await?.is_some() {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Returns the files to delete: nothing points to them, and they are older than a day. `record` is the store's record from before this
/// process wrote to it.
pub async fn files_to_sweep(
    store: &dyn Store,
    artifacts: &Artifacts,
    record: &StoreRecord,
) -> Result<Vec<FileInfo>, OwnershipError> {
    let named = store.referenced_keys().await?;
    let mut orphans = artifacts.all().await?;
    orphans.retain(|file| !named.contains(&file.key));
    let now = SystemTime::now();
    let newest_write = from_milliseconds(record.newest_write_ms) + WRITES_APART;
    let unknown = orphans.iter().filter(|orphan| orphan.written > newest_write).count();
    if unknown > 0 {
        tracing::warn!(
            unknown,
            "files are newer than the database, which seems to be an older copy: all present files are kept"
        );
        let now_ms = now.duration_since(SystemTime::UNIX_EPOCH).map_or(0, |now| now.as_millis());
        store.set_sweep_from(i64::try_from(now_ms).unwrap_or(i64::MAX)).await?;
        return Ok(Vec::new());
    }
    let sweep_from = from_milliseconds(record.sweep_from_ms);
    let old = now - SWEEP_AGE;
    orphans.retain(|orphan| orphan.written < old && orphan.written >= sweep_from);
    Ok(orphans)
}

fn from_milliseconds(milliseconds: i64) -> SystemTime {
    SystemTime::UNIX_EPOCH + Duration::from_millis(u64::try_from(milliseconds).unwrap_or(0))
}

/// Logs these files, and deletes them.
pub async fn sweep(artifacts: &Artifacts, files: Vec<FileInfo>) {
    if files.is_empty() {
        return;
    }
    let keys: Vec<&str> = files.iter().take(10).map(|file| file.key.as_str()).collect();
    tracing::warn!(files = files.len(), first = ?keys, "deleting files that are older than a day and that no job or \
                                                        mesh uses");
    for file in &files {
        if let Err(error) = artifacts.delete(&file.key).await {
            tracing::warn!(%error, key = file.key, "deleting a file failed");
        }
    }
}
