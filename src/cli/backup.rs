//! `skyduct backup`: copies the data folder of a running service, so that another service can start from the copy.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use uuid::Uuid;

use crate::cli::config::{Config, Flags};
use crate::db::backup::{DatabaseCopy, Missing};
use crate::queue::backup::{Copied, copy_files};
use crate::queue::ownership::NOTE;
use crate::queue::private_folder::{create_private_folder, make_private_files};

#[derive(Debug, clap::Args)]
pub(super) struct BackupArgs {
    /// Folder of the backup; must be empty, or not exist yet
    #[arg(value_name = "FOLDER")]
    pub folder: PathBuf,
    /// Data folder of the service [default: data]
    #[arg(long, value_name = "DIR")]
    pub data: Option<PathBuf>,
    /// Database as sqlite:FILE [default: skyduct.db in the data folder]
    #[arg(long, value_name = "URL")]
    pub database: Option<String>,
    /// Configuration file (TOML) of the service
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
}

/// Copies a snapshot of the database, then the files that it refers to.
pub(super) fn run(args: BackupArgs) -> anyhow::Result<()> {
    let BackupArgs { folder, data, database, config: file } = args;
    // the service is read, not started: its address need not be safe here
    let flags = Flags { data, database, insecure: true, ..Flags::default() };
    let config = Config::load(file.as_deref(), &flags)?;
    let database = config.database_file()?;
    if !database.is_file() {
        bail!("there is no database {}: give the service's data folder with --data", database.display());
    }
    make_private_files();
    make_empty_folder(&folder)?;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    let backup = runtime.context("the runtime cannot start")?.block_on(backup(&config.data, &database, &folder));
    let Backup { jobs, files, missing } =
        backup.with_context(|| format!("the backup in {} is not complete: delete it", folder.display()))?;
    let Copied { linked, copied, .. } = files;
    println!(
        "{jobs} jobs backed up in {}: the database, {linked} files linked and {copied} copied; start a service from \
         it with skyduct serve --data {}",
        folder.display(),
        folder.display()
    );
    if missing.deleted > 0 {
        println!("{} jobs and uploads that were deleted meanwhile are not in the backup", missing.deleted);
    }
    if missing.damaged > 0 {
        bail!(
            "{} result files are missing in {}, and therefore in the backup; everything else is in it",
            missing.damaged,
            config.data.display()
        );
    }
    Ok(())
}

/// Contents of a finished backup.
struct Backup {
    jobs: u64,
    files: Copied,
    missing: Missing,
}

/// Copies database and files. The database gets its final name last, so that no service starts from an incomplete backup: a
/// service refuses a new database beside artifacts that have an identity.
async fn backup(data: &Path, database: &Path, folder: &Path) -> anyhow::Result<Backup> {
    let artifacts = folder.join("artifacts");
    create_private_folder(&artifacts)?;
    // a new identity: two services that continue the same jobs must not take each other's files for their own
    let identity = Uuid::new_v4().to_string();
    fs::write(artifacts.join(NOTE), format!("{identity}\n"))?;
    File::open(artifacts.join(NOTE))?.sync_all()?;
    let part = folder.join("skyduct.db.part");
    let mut copy = DatabaseCopy::make(database, &part).await?;
    let keys = copy.referenced_keys().await?;
    let files = copy_files(&data.join("artifacts"), &artifacts, keys).context("the result files cannot be copied")?;
    let missing = copy.without(&files.missing).await?;
    let jobs = copy.jobs().await?;
    copy.finish(&identity).await?;
    File::open(&part)?.sync_all()?;
    fs::rename(&part, folder.join("skyduct.db"))?;
    File::open(folder)?.sync_all()?;
    Ok(Backup { jobs, files, missing })
}

/// Creates the folder, checks that it is empty, and makes its name durable (it survives a power failure).
fn make_empty_folder(folder: &Path) -> anyhow::Result<()> {
    let unusable = || format!("the folder {} cannot be used", folder.display());
    create_private_folder(folder).with_context(unusable)?;
    if fs::read_dir(folder).with_context(unusable)?.next().is_some() {
        bail!("{} is not empty: a backup needs an empty or new folder", folder.display());
    }
    let path = folder.canonicalize().with_context(unusable)?;
    if let Some(parent) = path.parent() {
        File::open(parent).and_then(|parent| parent.sync_all()).with_context(unusable)?;
    }
    Ok(())
}
