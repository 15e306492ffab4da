//! What one client may ask for.

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
    /// A request's head must have arrived after so many seconds.
    pub header_seconds: u64,
    /// A request must be answered after so many seconds (event streams must have begun).
    pub request_seconds: u64,
}
