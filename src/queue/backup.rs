//! Backup of the artifacts' files in a second folder. They never change, so that a hard link to each is a copy.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use super::private_folder::create_private_folder;

/// Result of copying files.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Copied {
    /// Number of files that were hard-linked on the same disk.
    pub linked: u64,
    /// Number of files that were copied, since the folders are on different disks or the file system has no hard links.
    pub copied: u64,
    /// Keys of files that are missing.
    pub missing: Vec<String>,
}

/// Links each of the files at `keys` below `from` to the same place below `to`, or copies it where no hard link is possible, and waits
/// until all of them are durable.
pub fn copy_files(from: &Path, to: &Path, keys: impl IntoIterator<Item = String>) -> io::Result<Copied> {
    let mut copied = Copied::default();
    let mut folders = BTreeSet::from([to.to_owned()]);
    for key in keys {
        let (source, target) = (from.join(&key), to.join(&key));
        let within = |folder: &&Path| **folder != *to;
        let above: Vec<PathBuf> = target.ancestors().skip(1).take_while(within).map(Path::to_owned).collect();
        if let Some(folder) = above.first().filter(|folder| !folders.contains(*folder)) {
            create_private_folder(folder)?;
        }
        folders.extend(above);
        match fs::hard_link(&source, &target) {
            Ok(()) => copied.linked += 1,
            Err(error) if error.kind() == ErrorKind::NotFound => {
                copied.missing.push(key);
                continue;
            }
            // another disk, a disk without hard links, a file of another user
            Err(_) => match fs::copy(&source, &target) {
                Ok(_) => copied.copied += 1,
                Err(error) if error.kind() == ErrorKind::NotFound => {
                    copied.missing.push(key);
                    continue;
                }
                Err(error) => return Err(error),
            },
        }
        File::open(&target)?.sync_all()?;
    }
    for folder in folders {
        File::open(folder)?.sync_all()?;
    }
    Ok(copied)
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::MetadataExt;

    use super::*;

    #[test]
    fn files_are_linked_and_what_is_missing_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let [from, to] = ["from", "to"].map(|name| folder.path().join(name));
        fs::create_dir_all(from.join("jobs/a")).unwrap();
        fs::create_dir(&to).unwrap();
        fs::write(from.join("jobs/a/x"), b"x").unwrap();
        let copied = copy_files(&from, &to, ["jobs/a/x", "jobs/b/y"].map(String::from)).unwrap();
        assert_eq!(copied, Copied { linked: 1, copied: 0, missing: vec!["jobs/b/y".to_owned()] });
        assert_eq!(fs::metadata(to.join("jobs/a/x")).unwrap().nlink(), 2);
    }
}
