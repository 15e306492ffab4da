//! `skyduct serve`: the service, with its worker in the same process.

use std::io::Write as _;
use std::net::SocketAddr;
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use anyhow::Context;
use jiff::Timestamp;
use tokio::net::TcpListener;
use tokio::runtime::{Builder, Runtime};
use tokio::signal::unix::{SignalKind, signal};
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

use crate::cli::config::{Config, Flags, Role};
use crate::cli::{metrics, telemetry};
use crate::db;
use crate::http::{self, Access, Permits, Readiness, Shared, StudyFiles, Watched};
use crate::present::reader::made_years;
use crate::queue::artifacts::Artifacts;
use crate::queue::deletion::Deletion;
use crate::queue::file_lock::FileLock;
use crate::queue::live::LiveJobs;
use crate::queue::local_files::LocalFiles;
use crate::queue::ownership;
use crate::queue::private_folder::{create_private_folder, make_private_files};
use crate::queue::retention::{self, Deleted, Retention};
use crate::queue::store::Store;
use crate::queue::uploads::Uploads;
use crate::queue::worker::{Worker, WorkerLimits};

/// Longest time in which a stopping service ends open requests and the running pass and gives back the lease.
const STOP_TIME: Duration = Duration::from_secs(8);

#[derive(Debug, Default, clap::Args)]
pub(super) struct ServeArgs {
    /// Address to listen on [default: 127.0.0.1:8080]; port 0 takes a free one
    #[arg(long, value_name = "ADDRESS")]
    pub listen: Option<SocketAddr>,
    /// Folder of the database and the artifacts [default: data]
    #[arg(long, value_name = "DIR")]
    pub data: Option<PathBuf>,
    /// Database as sqlite:FILE [default: skyduct.db in the data folder]
    #[arg(long, value_name = "URL")]
    pub database: Option<String>,
    /// Configuration file (TOML)
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Parts of the service that this process runs [default: all]
    #[arg(long, value_enum)]
    pub role: Option<Role>,
    /// Consent to listening beyond loopback, where everybody can read, start and delete jobs
    #[arg(long)]
    pub insecure: bool,
}

/// Serves until SIGTERM or SIGINT.
pub(super) fn run(args: ServeArgs) -> anyhow::Result<()> {
    let ServeArgs { listen, data, database, config: file, role, insecure } = args;
    let flags = Flags { listen, data, database, role, insecure };
    let config = Config::load(file.as_deref(), &flags)?;
    telemetry::start(&config.log);
    make_private_files();
    let data = config.data.clone();
    let runtime = runtime()?;
    let result = runtime.block_on(async {
        let service = RunningService::start(config).await?;
        let mut stdout = std::io::stdout();
        // the parent process may have closed our standard output
        let url = service.url();
        let _ = writeln!(stdout, "listening on {url}\ndata in {}\npage at {url}/", data.display())
            .and_then(|()| stdout.flush());
        wait_for_signal().await?;
        service.stop().await;
        Ok(())
    });
    // a blocking task that is still running must not delay the exit
    runtime.shutdown_timeout(Duration::from_secs(1));
    result
}

/// Creates the runtime for requests, streams and rows, beside the render threads (one per processor). It has one thread for each
/// four processors, because this work is little and further threads would have nothing to do, but at least two, so that one can
/// answer while the other writes a long answer.
pub fn runtime() -> anyhow::Result<Runtime> {
    let processors = std::thread::available_parallelism().map_or(1, NonZero::get);
    let threads = (processors / 4).max(2);
    Builder::new_multi_thread().worker_threads(threads).enable_all().build().context("the runtime cannot start")
}

/// Waits for SIGTERM or SIGINT; a second signal exits the process immediately.
pub async fn wait_for_signal() -> anyhow::Result<()> {
    let mut terminate = signal(SignalKind::terminate()).context("cannot listen for SIGTERM")?;
    let mut interrupt = signal(SignalKind::interrupt()).context("cannot listen for SIGINT")?;
    tokio::select! {
        _ = terminate.recv() => tracing::info!("SIGTERM: stopping"),
        _ = interrupt.recv() => tracing::info!("SIGINT: stopping"),
    }
    tokio::spawn(async move {
        tokio::select! {
            _ = terminate.recv() => {}
            _ = interrupt.recv() => {}
        }
        std::process::exit(1);
    });
    Ok(())
}

/// Service that runs in this process.
pub struct RunningService {
    /// Address that the interface listens on, with its actual port.
    pub address: SocketAddr,
    shutdown: CancellationToken,
    worker: JoinHandle<()>,
    server: JoinHandle<()>,
    upkeep: JoinHandle<()>,
    store: Arc<dyn Store>,
    /// Lock on the data folder, held as long as the service runs.
    _lock: FileLock,
}

impl RunningService {
    /// Opens the data folder and the database, and starts worker and interface. An error if another process uses the folder,
    /// database and artifacts do not belong together, or the address is taken.
    pub async fn start(config: Config) -> anyhow::Result<Self> {
        create_private_folder(&config.data)
            .with_context(|| format!("the data folder {} cannot be created", config.data.display()))?;
        let lock = lock(&config.data)?;
        let listener =
            TcpListener::bind(config.listen).await.with_context(|| format!("cannot listen on {}", config.listen))?;
        let database = config.database_file()?;
        let store = db::open(&database).await?;
        let result = Self::start_with(config, lock, listener, store.clone()).await;
        if result.is_err() {
            // files that were written beside the database must not be taken for a part of one that is put there next
            store.close().await;
        }
        result
    }

    async fn start_with(
        config: Config,
        lock: FileLock,
        listener: TcpListener,
        store: Arc<dyn Store>,
    ) -> anyhow::Result<Self> {
        let address = listener.local_addr()?;
        let database = config.database_file()?;
        let folder = config.data.join("artifacts");
        let artifacts = Artifacts::new(LocalFiles::open(&folder)?);
        let record = store.record().await?;
        ownership::check(store.as_ref(), &artifacts, &record)
            .await
            .with_context(|| format!("{} and {} cannot be used", database.display(), folder.display()))?;
        let died = record.identity.is_some() && !record.ended_well;
        if died {
            tracing::warn!("the previous process did not shut down cleanly: checking the database for damage");
            store.check().await.with_context(|| format!("{} cannot be used", database.display()))?;
        }
        let sweep = ownership::files_to_sweep(store.as_ref(), &artifacts, &record).await?;
        store.set_serving(true).await?;
        // the lock excludes other processes: any lease was left by one that ended
        let taken_back = store.take_back(died).await?;
        if taken_back.ready > 0 {
            tracing::info!(chunks = taken_back.ready, "chunks left by the previous process are queued again");
        }
        for job in taken_back.failed {
            tracing::error!(%job, "the job failed: the process died repeatedly while rendering it");
        }
        let shutdown = CancellationToken::new();
        let live = Arc::new(LiveJobs::default());
        let uploads = Uploads::new(store.clone(), artifacts.clone());
        let limits = WorkerLimits {
            memory_bytes: config.limits.memory_limit_bytes(),
            open_chunks: config.limits.open_chunks_per_job,
        };
        let worker =
            Worker::new(store.clone(), artifacts.clone(), uploads.clone(), live.clone(), limits, shutdown.clone())
                .context("the render threads cannot start")?;
        let worker = tokio::spawn(worker.run());
        let swept = artifacts.clone();
        tokio::spawn(async move { ownership::sweep(&swept, sweep).await });
        let shared = Arc::new(Shared {
            all: store.clone(),
            all_uploads: uploads,
            artifacts,
            live,
            metrics: metrics::handle()?,
            shutdown: shutdown.clone(),
            permits: Permits::new(&config.limits),
            watched: Watched::default(),
            watched_sets: Watched::default(),
            watched_studies: Watched::default(),
            study_files: StudyFiles::default(),
            years: Arc::new(made_years()),
            queue_was_full: AtomicBool::default(),
            readiness: Readiness::default(),
            limits: config.limits.clone(),
            access: Access {
                listen: address,
                allowed_hosts: config.allowed_hosts.clone(),
                cors_origins: config.cors_origins.clone(),
            },
        });
        let upkeep = tokio::spawn(keep_up(config.retention, shared.clone()));
        let router = http::cors::around(http::router(shared), &config.cors_origins);
        let stop = shutdown.clone();
        let server = tokio::spawn(async move { http::server::serve(listener, router, &config.limits, stop).await });
        tracing::info!(%address, "listening");
        Ok(Self { address, shutdown, worker, server, upkeep, store, _lock: lock })
    }

    /// Returns the address of the interface as `http://...`, without a trailing slash.
    pub fn url(&self) -> String {
        format!("http://{}", self.address)
    }

    /// Stops the service: ends requests and streams, gives back the running chunk, and closes the store.
    pub async fn stop(self) {
        self.shutdown.cancel();
        let ended = async { futures::future::join3(self.server, self.worker, self.upkeep).await };
        let in_time = tokio::time::timeout(STOP_TIME, ended).await.is_ok();
        if let Err(error) = self.store.set_serving(false).await {
            tracing::warn!(%error, "the clean shutdown cannot be recorded: the next start will treat it as a crash");
        }
        if in_time {
            self.store.close().await;
        } else {
            tracing::warn!("the running pass did not end in time; its chunk is rendered again after the next start");
        }
        tracing::info!("stopped");
    }
}

/// Keeps the reserve of the disk, and deletes ended jobs and sets of jobs by the rules of the retention, once a minute, until the service shuts
/// down.
async fn keep_up(retention: Retention, shared: Arc<Shared>) {
    let from = Deletion { store: shared.all.clone(), artifacts: shared.artifacts.clone(), live: shared.live.clone() };
    let mut is_told = false;
    while !shared.shutdown.is_cancelled() {
        match retention.delete(&from, Timestamp::now(), &shared.shutdown).await {
            Ok(Deleted { jobs: 0, sets: 0, uploads: 0 }) => {}
            Ok(Deleted { jobs, sets, uploads }) => {
                tracing::info!(
                    jobs,
                    sets,
                    uploads,
                    "the retention deleted ended jobs and sets of jobs, and unused files"
                )
            }
            Err(error) => tracing::warn!(%error, "the retention could not delete ended jobs"),
        }
        if let Err(error) = shared.all.keep_reserve().await
            && !std::mem::replace(&mut is_told, true)
        {
            tracing::warn!(%error, "no space of the disk can be kept for deletions on a full disk");
        }
        tokio::select! {
            () = shared.shutdown.cancelled() => {}
            () = tokio::time::sleep(retention::PERIOD) => {}
        }
    }
}

/// Locks the data folder for this process: two would render the same jobs, and one would take the other's leases.
fn lock(data: &Path) -> anyhow::Result<FileLock> {
    let file = data.join("lock");
    let lock = FileLock::take(&file).with_context(|| format!("{} cannot be locked", file.display()))?;
    lock.with_context(|| format!("another process serves the data folder {}", data.display()))
}
