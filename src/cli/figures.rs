//! Which figures a command saves.

use crate::job::saved_files::SavedFigures;

#[derive(Debug, clap::Args)]
pub struct FiguresArgs {
    /// Formats of the figures: svg, png and pdf, with commas, or none; with pdf there is a report on one sheet, too
    #[arg(long = "figures", value_name = "FORMATS", default_value = SavedFigures::USUAL)]
    pub saved: SavedFigures,
}
