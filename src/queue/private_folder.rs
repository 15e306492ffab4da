//! Private folders and files of the service: for its user only, and durable.

use std::fs;
use std::io;
use std::os::unix::fs::DirBuilderExt;
use std::path::{Path, PathBuf};

use rustix::fs::Mode;

/// Makes all files and folders that this process creates from now on private to its user, whichever library creates them.
pub fn make_private_files() {
    rustix::process::umask(Mode::RWXG | Mode::RWXO);
}

/// Creates a folder that only this user can enter, with its parents; an existing one stays as it is. Each folder is then durably in its
/// parent: it survives a power failure.
pub fn create_private_folder(folder: &Path) -> io::Result<()> {
    let changed = folders_with_news(folder);
    fs::DirBuilder::new().recursive(true).mode(0o700).create(folder)?;
    for folder in changed {
        match fs::File::open(&folder) {
            // a folder of another user, who created what is in it
            Err(error) if error.kind() == io::ErrorKind::PermissionDenied => {}
            opened => opened?.sync_all()?,
        }
    }
    Ok(())
}

/// Returns the folders that get a new entry when `folder` is created. Its parent is always one of them: an earlier process may have ended
/// before it was synced.
fn folders_with_news(folder: &Path) -> Vec<PathBuf> {
    let mut folders = Vec::new();
    for above in folder.ancestors().skip(1) {
        let above = if above.as_os_str().is_empty() { Path::new(".") } else { above };
        folders.push(above.to_owned());
        if above.is_dir() {
            break;
        }
    }
    folders
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_are_synced_into_which_others_come() {
        let directory = tempfile::tempdir().unwrap();
        let root = directory.path();
        let [a, b, c] = ["a", "a/b", "a/b/c"].map(|path| root.join(path));
        assert_eq!(folders_with_news(&c), [b.clone(), a.clone(), root.to_owned()]);
        create_private_folder(&a).unwrap();
        assert_eq!(folders_with_news(&c), [b.clone(), a.clone()]);
        create_private_folder(&c).unwrap();
        create_private_folder(&c).unwrap();
        assert_eq!(folders_with_news(&c), [b]);
        assert_eq!(folders_with_news(Path::new("data")), [Path::new(".")]);
        assert!(folders_with_news(Path::new("/")).is_empty());
    }
}
