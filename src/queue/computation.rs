//! Identity of a computation, the same for jobs with equal documents, all defaults filled in, and the same program.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::sync::LazyLock;

use serde_json::Value;

use crate::document::canonical::write_canonical;

/// Hash of this program; `None` where it cannot be read. Results do not depend on the machine, but other programs may compute other
/// results.
static PROGRAM: LazyLock<Option<blake3::Hash>> = LazyLock::new(|| {
    let hash = || -> io::Result<blake3::Hash> {
        let mut hasher = blake3::Hasher::new();
        // the file that runs, also when another one has its name by now
        let program = File::open("/proc/self/exe").or_else(|_| File::open(std::env::current_exe()?))?;
        hasher.update_reader(program)?;
        Ok(hasher.finalize())
    };
    hash()
        .inspect_err(
            |error| tracing::warn!(%error, "the program file cannot be read, so results of equal jobs are not reused"),
        )
        .ok()
});

/// Returns the identity of this program's computation for a document with its defaults filled in; `None` where the program cannot be read,
/// so that no job counts as equal.
pub fn computation(document: &Value) -> Option<String> {
    let program = (*PROGRAM)?;
    let mut hashing = BufWriter::new(blake3::Hasher::new());
    let written = hashing.write_all(program.as_bytes()).and_then(|()| write_canonical(document, &mut hashing));
    let hasher = written.and_then(|()| hashing.into_inner().map_err(io::IntoInnerError::into_error));
    Some(hasher.ok()?.finalize().to_hex().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::canonical::canonical_hash;

    #[test]
    fn a_computation_is_of_a_document_and_of_the_program() {
        let document = serde_json::json!({ "seed": 1 });
        let here = computation(&document).unwrap();
        assert_eq!(computation(&document), Some(here.clone()));
        assert_ne!(here, canonical_hash(&document).unwrap());
        assert_ne!(computation(&serde_json::json!({ "seed": 2 })), Some(here));
    }
}
