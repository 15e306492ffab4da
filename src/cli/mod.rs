//! The commands.

pub mod client;
pub mod config;
pub mod demo;
pub mod serve;
pub mod submit;

/// A command line.
#[derive(Debug, clap::Parser)]
#[command(name = "skyduct", version)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, clap::Subcommand)]
pub enum Command {
    Serve(serve::ServeArgs),
    Submit(submit::SubmitArgs),
    Demo(demo::DemoArgs),
}
