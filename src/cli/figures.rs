//! Choice of the figures that a command saves.

use crate::present::saved_files::SavedFigures;

#[derive(Debug, clap::Args)]
pub struct FiguresArgs {
    /// Formats of the figures: svg, png and pdf, separated by commas, or none; with pdf, a report is saved, too
    #[arg(long = "figures", value_name = "FORMATS", default_value = SavedFigures::USUAL)]
    pub saved: SavedFigures,
}
