//! `skyduct demo`: a service, one job and its results by a single command.

use std::path::Path;
use std::time::Duration;

use crate::cli::client::Client;
use crate::cli::config::{Config, Flags};
use crate::cli::figures::FiguresArgs;
use crate::cli::results_table::print_results;
use crate::cli::serve::{RunningService, runtime, wait_for_signal};
use crate::cli::submit::submit_and_download;
use crate::cli::temporary_folder::TemporaryFolder;

/// Document of the example room, built in so that the command works in any folder.
const JOB: &str = include_str!("../../examples/thesis_room.json");
const OUT: &str = "out/demo";

#[derive(Debug, clap::Args)]
pub struct DemoArgs {
    /// Exit when the job is done, instead of continuing to serve
    #[arg(long)]
    pub exit: bool,
    #[command(flatten)]
    pub figures: FiguresArgs,
}

/// Starts a service on a free port, submits the built-in job and saves its results.
pub fn run(args: DemoArgs) -> anyhow::Result<()> {
    let runtime = runtime()?;
    let result = runtime.block_on(async {
        let temporary = TemporaryFolder::new("demo")?;
        let flags = Flags {
            listen: Some(([127, 0, 0, 1], 0).into()),
            data: Some(temporary.path().to_owned()),
            ..Flags::default()
        };
        let service = RunningService::start(Config::load(None, &flags)?).await?;
        let shown = tokio::select! {
            shown = show(&service, &args) => shown,
            interrupted = wait_for_signal() => interrupted,
        };
        service.stop().await;
        shown
    });
    runtime.shutdown_timeout(Duration::from_secs(1));
    result
}

async fn show(service: &RunningService, args: &DemoArgs) -> anyhow::Result<()> {
    println!("service: {}", service.url());
    let client = Client::new(&service.url())?;
    let out = Path::new(OUT);
    let job = submit_and_download(&client, JOB.into(), None, false, out, &args.figures.saved).await?;
    println!("results: {}", out.display());
    print_results(&job);
    println!("page:    {}{}", service.url(), job["links"]["page"].as_str().unwrap_or("/"));
    if !args.exit {
        println!("the service keeps running; stop it with Ctrl-C");
        std::future::pending::<()>().await;
    }
    Ok(())
}
