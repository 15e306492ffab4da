//! Durability of writes to stores of rows and of files.

/// Durability of a write that has returned. It survives the end of the process in either case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Durability {
    /// Durable: the write survives a power failure.
    Committed,
    /// Not durable before a `sync` of its store: a power failure may lose the write, with all such writes after it.
    Buffered,
}
