//! The commands.

pub mod mesh_files;
pub mod plan;
pub mod progress;
pub mod render;

/// Daylight through tubular daylight devices: illuminance grids and views with their errors.
#[derive(Debug, clap::Parser)]
#[command(name = "skyduct", version)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, clap::Subcommand)]
pub enum Command {
    /// Render a job document without a server
    Render(render::RenderArgs),
    /// Say what of a job document would be simulated and what not, and why
    Plan(plan::PlanArgs),
}

impl Command {
    pub fn run(self) -> anyhow::Result<()> {
        match self {
            Self::Render(args) => render::run(args),
            Self::Plan(args) => plan::run(args),
        }
    }
}
