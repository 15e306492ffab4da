//! Folders in the system's temporary folder, for files that a command needs only while it runs.

use std::path::{Path, PathBuf};

use anyhow::Context;

/// Temporary folder that is deleted when it is dropped.
pub struct TemporaryFolder(PathBuf);

impl TemporaryFolder {
    /// Creates a folder; `purpose` is part of its name.
    pub fn new(purpose: &str) -> anyhow::Result<Self> {
        let folder = std::env::temp_dir().join(format!("skyduct-{purpose}-{}", uuid::Uuid::new_v4()));
        std::fs::create_dir_all(&folder).with_context(|| format!("{} cannot be created", folder.display()))?;
        Ok(Self(folder))
    }

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for TemporaryFolder {
    fn drop(&mut self) {
        // a folder that cannot be deleted stays in the system's temporary folder
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
