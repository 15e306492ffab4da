//! Configuration of the service: defaults, then a file, then the environment, then flags.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use anyhow::Context;
use figment::Figment;
use figment::providers::{Env, Format, Serialized, Toml};
use serde::{Deserialize, Serialize};

use crate::http::Limits;

const DEFAULTS: &str = include_str!("../../config/default.toml");
const ENVIRONMENT_PREFIX: &str = "SKYDUCT_";

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    pub listen: SocketAddr,
    /// Folder of the database, the artifacts and the lock file.
    pub data: PathBuf,
    /// `sqlite:FILE`; absent: `skyduct.db` in the data folder.
    pub database: Option<String>,
    pub role: Role,
    pub limits: Limits,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// The interface and a worker in one process.
    All,
    /// The interface only.
    Api,
    /// A worker only.
    Worker,
}

/// What the command line says; absent flags change nothing.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Flags {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub listen: Option<SocketAddr>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub data: Option<PathBuf>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub database: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub role: Option<Role>,
}

impl Config {
    pub fn load(file: Option<&Path>, flags: &Flags) -> anyhow::Result<Self> {
        let mut layers = Figment::from(Toml::string(DEFAULTS));
        if let Some(file) = file {
            layers = layers.merge(Toml::file_exact(file));
        }
        let config: Self = layers
            .merge(Env::prefixed(ENVIRONMENT_PREFIX).split("__"))
            .merge(Serialized::defaults(flags))
            .extract()
            .context("the configuration is not valid")?;
        if config.role != Role::All {
            anyhow::bail!("role: api and worker need a database that several processes share: not supported yet");
        }
        config.database_file()?;
        Ok(config)
    }

    /// The SQLite file.
    pub fn database_file(&self) -> anyhow::Result<PathBuf> {
        match &self.database {
            None => Ok(self.data.join("skyduct.db")),
            Some(url) => match url.strip_prefix("sqlite:") {
                Some(file) if !file.is_empty() => Ok(file.strip_prefix("//").unwrap_or(file).into()),
                _ => anyhow::bail!("database: {url}: only sqlite:FILE is supported yet"),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_complete() {
        let config = Config::load(None, &Flags::default()).unwrap();
        assert_eq!(config.listen.port(), 8080);
        assert_eq!(config.database_file().unwrap(), Path::new("data/skyduct.db"));
        assert_eq!(config.limits.document_bytes, 1 << 20);
    }

    #[test]
    fn later_layers_win() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("skyduct.toml");
        std::fs::write(&file, "listen = \"0.0.0.0:1\"\ndata = \"there\"\n[limits]\nqueued_jobs = 3\n").unwrap();
        let flags = Flags { data: Some("here".into()), ..Flags::default() };
        let config = Config::load(Some(&file), &flags).unwrap();
        assert_eq!(config.listen.port(), 1);
        assert_eq!(config.data, Path::new("here"));
        assert_eq!(config.limits.queued_jobs, 3);
        assert_eq!(config.limits.preparing, 2);
    }

    #[test]
    fn what_is_not_understood_is_refused() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("skyduct.toml");
        for text in
            ["lisen = 1", "listen = \"x\"", "[limits]\nqueued = 3", "role = \"api\"", "database = \"postgres://x\""]
        {
            std::fs::write(&file, text).unwrap();
            assert!(Config::load(Some(&file), &Flags::default()).is_err(), "{text}");
        }
        assert!(Config::load(Some(Path::new("/no/such/file")), &Flags::default()).is_err());
    }
}
