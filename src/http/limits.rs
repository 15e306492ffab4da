//! What one client may ask for.

use crate::job::memory::default_limit_bytes;

/// Limits of the service; `config/default.toml` has the defaults.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Longest job document.
    pub document_bytes: usize,
    /// Longest uploaded mesh.
    pub mesh_bytes: usize,
    /// Jobs that may wait; one more is answered 503.
    pub queued_jobs: u64,
    /// Connections at the same time; more wait to be accepted.
    pub connections: usize,
    /// Documents that are checked at the same time; more wait.
    pub preparing: usize,
    /// Bytes that one job may take at its peak; a job that would take more is refused. Absent: three quarters of the memory
    /// that this process may have.
    pub memory_bytes: Option<u64>,
    /// A request's head must have arrived after so many seconds.
    pub header_seconds: u64,
    /// A request must be answered after so many seconds (event streams must have begun).
    pub request_seconds: u64,
}

impl Limits {
    /// Bytes that one job may take at its peak.
    pub fn memory_limit_bytes(&self) -> u64 {
        self.memory_bytes.unwrap_or_else(default_limit_bytes)
    }
}
