//! Text on standard output.

use std::io::{ErrorKind, Write as _};

/// Prints a text; it is no error if the reader of a pipe has seen enough.
pub(super) fn print(text: &str) -> anyhow::Result<()> {
    match std::io::stdout().write_all(text.as_bytes()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => Ok(written?),
    }
}
