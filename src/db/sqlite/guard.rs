//! Checks before a database is used: no other process has it, and SQLite is new enough.

use std::fs::File;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use crate::queue::file_lock::FileLock;
use crate::queue::store::StoreError;

/// Oldest version of SQLite that is accepted: older ones can corrupt the database when a checkpoint meets a WAL reset.
const OLDEST_SQLITE: (u32, u32, u32) = (3, 51, 3);

/// Locks a file beside the database, whose path must be free of links. SQLite's own locks last for single transactions only.
pub(super) fn lock(database: &Path) -> Result<FileLock, StoreError> {
    let mut path = database.as_os_str().to_owned();
    path.push(".lock");
    let path = Path::new(&path);
    let lock = FileLock::take(path).map_err(|error| StoreError::Failed(format!("{}: {error}", path.display())))?;
    lock.ok_or_else(|| StoreError::Failed(format!("another process serves the database {}", database.display())))
}

/// Refuses a file with several names (hard links): log and lock are written beside one name, and a process that uses another name
/// does not see them.
pub(super) fn check_names(file: &File, path: &Path) -> Result<(), StoreError> {
    let failed = |reason: String| StoreError::Failed(format!("{}: {reason}", path.display()));
    match file.metadata().map_err(|error| failed(error.to_string()))?.nlink() {
        0 | 1 => Ok(()),
        names => Err(failed(format!(
            "the file has {names} names (hard links), but a database must have only one: remove the others, or copy \
             the file"
        ))),
    }
}

/// Refuses a version of SQLite that could damage the database.
pub(super) fn check_version(version: &str) -> Result<(), StoreError> {
    let mut numbers = version.split('.').map(|part| part.parse::<u32>().unwrap_or(0));
    let mut next = || numbers.next().unwrap_or(0);
    let found = (next(), next(), next());
    if found < OLDEST_SQLITE {
        let (major, minor, patch) = OLDEST_SQLITE;
        return Err(StoreError::Failed(format!(
            "the program is linked to SQLite {version}, but needs {major}.{minor}.{patch} or newer"
        )));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::check_version;

    #[test]
    fn old_sqlite_is_refused() {
        for version in ["3.51.3", "3.51.10", "3.52.0", "4.0.0"] {
            assert!(check_version(version).is_ok(), "{version}");
        }
        for version in ["3.51.2", "3.40.1", "3.6.23.1", "", "x"] {
            assert!(check_version(version).is_err(), "{version}");
        }
    }
}
