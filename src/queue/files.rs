//! Store of files that are written once: the trait behind the artifacts.

use std::ops::Range;
use std::time::SystemTime;

use async_trait::async_trait;
use bytes::Bytes;
use futures::stream::BoxStream;

use super::durability::Durability;

#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// No file has this key.
    #[error("{0} is missing")]
    NotFound(String),
    #[error("the file {key} is damaged: its hash is not {hash}")]
    Damaged { key: String, hash: String },
    /// Full store; the text is for the log, too.
    #[error("the artifact store is full: {0}")]
    Full(String),
    /// Other failure, for the log: the text may have paths of this machine.
    #[error("the artifact store failed: {0}")]
    Failed(String),
}

/// Key of a file, with the properties that change when it is written to.
#[derive(Clone, Debug, PartialEq)]
pub struct FileInfo {
    /// Path of the file in its store, with `/` between folders.
    pub key: String,
    /// Length in bytes.
    pub size: u64,
    /// Time of the last write.
    pub written: SystemTime,
}

/// Content of a file, piece by piece.
pub type Pieces = BoxStream<'static, Result<Bytes, FileError>>;

/// Store of files. The content of a key never changes, so that a reader never sees half a file or a mix of two.
#[async_trait]
pub trait Files: Send + Sync + 'static {
    /// Writes a whole file; `None` where the key has one already, which stays as it is.
    async fn put(&self, key: &str, bytes: Bytes) -> Result<Option<Durability>, FileError>;
    /// Returns once the files at these keys are durable, all at the same time.
    async fn sync(&self, keys: &[&str]) -> Result<(), FileError>;
    /// Reads a whole file.
    async fn get(&self, key: &str) -> Result<Bytes, FileError>;
    /// Opens a file, or `range` of its bytes.
    async fn open(&self, key: &str, range: Option<Range<u64>>) -> Result<(FileInfo, Pieces), FileError>;
    /// Lists the files in a folder and in those below it.
    async fn list(&self, folder: &str) -> Result<Vec<FileInfo>, FileError>;
    /// Deletes a file; one that is not there is no error.
    async fn delete(&self, key: &str) -> Result<(), FileError>;
    /// Returns the number of bytes that this process can still write.
    fn free_bytes(&self) -> Result<u64, FileError>;
}
