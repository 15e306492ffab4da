//! `skyduct hbjson`: prints a room of a Honeybee model as the `room` of a job document.

use std::path::PathBuf;

use super::print::print;
use crate::document::hbjson::{HbjsonRoom, read_room};
use crate::document::{DocumentErrors, FieldError};

#[derive(Debug, clap::Args)]
pub(super) struct HbjsonArgs {
    /// Honeybee model (HBJSON)
    #[arg(value_name = "MODEL.hbjson")]
    pub model: PathBuf,
    /// Identifier or display name of the room; may be left out if the model has one room
    #[arg(long, value_name = "NAME")]
    pub room: Option<String>,
}

/// Prints the room as JSON with `faces`, and the notes about it to standard error. Faults of the model, and of the faces of its room, are
/// [`DocumentErrors`].
pub(super) fn run(args: HbjsonArgs) -> anyhow::Result<()> {
    let bytes = std::fs::read(&args.model).map_err(|error| {
        let detail = format!("{} cannot be read: {error}", args.model.display());
        DocumentErrors::from(FieldError::new("", detail))
    })?;
    let HbjsonRoom { faces, notes, .. } = read_room(&bytes, args.room.as_deref())?;
    for note in notes {
        eprintln!("warning: {note}");
    }
    // a line for each face, which serde's pretty form would spread over dozens
    let faces: Vec<String> = faces.iter().map(serde_json::to_string).collect::<Result<_, _>>()?;
    let text = format!("{{ \"faces\": [\n  {}\n] }}\n", faces.join(",\n  "));
    print(&text)
}
