//! Configuration of the service: defaults, then a file, then the environment, then flags.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use anyhow::Context;
use figment::Figment;
use figment::providers::{Env, Format, Serialized, Toml};
use serde::{Deserialize, Serialize};

use crate::cli::telemetry::Log;
use crate::http::{self, Limits};
use crate::queue::retention::Retention;

const DEFAULTS: &str = include_str!("../../config/default.toml");
const ENVIRONMENT_PREFIX: &str = "SKYDUCT_";

/// Settings of the service; `config/default.toml` has each field with its default.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Address and port of the interface; port 0: any free port.
    pub listen: SocketAddr,
    /// Folder of the database, the artifacts and the lock file.
    pub data: PathBuf,
    /// `sqlite:FILE`; absent: `skyduct.db` in the data folder.
    pub database: Option<String>,
    /// Parts of the service that run in this process; `all` alone is supported.
    pub role: Role,
    /// Origins of other web pages that may call the service, e.g. `https://design.example`.
    pub cors_origins: Vec<String>,
    /// Host names, with or without a port, by which clients may call the service in addition to its own address.
    pub allowed_hosts: Vec<String>,
    /// Consent to serving everybody who can reach an address other than loopback.
    pub insecure: bool,
    /// Level and format of the log.
    pub log: Log,
    /// Limits on the resources that a client can use.
    pub limits: Limits,
    /// Bounds of what is kept of ended jobs.
    #[serde(default)]
    pub retention: Retention,
}

/// Parts of the service that one process runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// Interface and worker in one process.
    All,
    /// Interface only.
    Api,
    /// Worker only.
    Worker,
}

/// Values of the command line; absent flags change nothing.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Flags {
    /// Value of [`Config::listen`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub listen: Option<SocketAddr>,
    /// Value of [`Config::data`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub data: Option<PathBuf>,
    /// Value of [`Config::database`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub database: Option<String>,
    /// Value of [`Config::role`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub role: Option<Role>,
    /// Value of [`Config::insecure`]; only `true` replaces the configuration.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub insecure: bool,
}

impl Config {
    /// Loads the configuration from the defaults, then `file`, then the environment, then `flags`; later ones win. An error if
    /// a value is invalid or out of range, a field is unknown, or the address is beyond loopback without [`Config::insecure`].
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
            anyhow::bail!(
                "role: must be all; api and worker need a database that several processes share, which is not \
                 supported yet"
            );
        }
        if !config.listen.ip().is_loopback() && !config.insecure {
            anyhow::bail!(
                "listen: {}: anybody who reaches this address could read, start and delete jobs, because the service \
                 does not authenticate clients yet; listen on 127.0.0.1 behind a proxy that does, or accept this with \
                 --insecure (insecure = true)",
                config.listen
            );
        }
        for origin in &config.cors_origins {
            http::cors::check_origin(origin).map_err(|reason| anyhow::anyhow!("cors_origins: {reason}"))?;
        }
        for host in &config.allowed_hosts {
            http::check_allowed_host(host).map_err(|reason| anyhow::anyhow!("allowed_hosts: {reason}"))?;
        }
        config.limits.check().map_err(|reason| anyhow::anyhow!("limits.{reason}"))?;
        config.retention.check().map_err(|reason| anyhow::anyhow!("retention.{reason}"))?;
        config.database_file()?;
        Ok(config)
    }

    /// Returns the path of the SQLite file; an error if the database is not SQLite.
    pub fn database_file(&self) -> anyhow::Result<PathBuf> {
        match &self.database {
            None => Ok(self.data.join("skyduct.db")),
            Some(url) => match url.strip_prefix("sqlite:") {
                Some(file) if !file.is_empty() => Ok(file.strip_prefix("//").unwrap_or(file).into()),
                // the value is not printed: it may contain a password
                _ => anyhow::bail!("database: must be sqlite:FILE; no other database is supported yet"),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::telemetry::{LogFormat, LogLevel};

    #[test]
    fn the_defaults_are_complete() {
        let config = Config::load(None, &Flags::default()).unwrap();
        assert_eq!(config.listen.port(), 8080);
        assert_eq!(config.database_file().unwrap(), Path::new("data/skyduct.db"));
        assert_eq!(config.limits.document_bytes, 1 << 20);
        assert_eq!(config.log, Log { level: LogLevel::Info, format: LogFormat::Text });
    }

    #[test]
    fn the_retention_is_checked() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("config.toml");
        assert_eq!(Config::load(None, &Flags::default()).unwrap().retention, Retention::default());
        std::fs::write(&file, "[retention]\ndays = 0.5\nbytes = 1_000").unwrap();
        let kept = Config::load(Some(&file), &Flags::default()).unwrap().retention;
        assert_eq!(kept, Retention { days: Some(0.5), bytes: Some(1000) });
        for days in ["0", "-1", "nan"] {
            std::fs::write(&file, format!("[retention]\ndays = {days}")).unwrap();
            let refused = Config::load(Some(&file), &Flags::default()).unwrap_err().to_string();
            assert!(refused.starts_with("retention.days: must be more than 0"), "{refused}");
        }
    }

    #[test]
    fn a_byte_order_mark_is_no_part_of_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("config.toml");
        std::fs::write(&file, "\u{feff}data = \"elsewhere\"\r\n").unwrap();
        assert_eq!(Config::load(Some(&file), &Flags::default()).unwrap().data, Path::new("elsewhere"));
    }

    #[test]
    fn jobs_that_may_wait_are_checked() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("config.toml");
        for name in ["queued_jobs", "queued_jobs_per_client"] {
            for value in [0, 1_000_001] {
                std::fs::write(&file, format!("[limits]\n{name} = {value}")).unwrap();
                let refused = Config::load(Some(&file), &Flags::default()).unwrap_err().to_string();
                assert_eq!(refused, format!("limits.{name}: must be 1 to 1000000, but is {value}"));
            }
        }
    }

    #[test]
    fn later_layers_win() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("skyduct.toml");
        let text = "listen = \"127.0.0.2:1\"\ndata = \"there\"\ncors_origins = [\"https://design.example\"]\n[limits]\nqueued_jobs = 3\n";
        std::fs::write(&file, text).unwrap();
        let flags = Flags { data: Some("here".into()), ..Flags::default() };
        let config = Config::load(Some(&file), &flags).unwrap();
        assert_eq!(config.listen.port(), 1);
        assert_eq!(config.data, Path::new("here"));
        assert_eq!(config.cors_origins, ["https://design.example"]);
        assert_eq!(config.limits.queued_jobs, 3);
        assert_eq!(config.limits.preparing, 2);
    }

    #[test]
    fn beyond_loopback_is_agreed_to_or_refused() {
        for address in ["0.0.0.0:8080", "[::]:8080", "192.0.2.1:80"] {
            let flags = |insecure| Flags { listen: address.parse().ok(), insecure, ..Flags::default() };
            let refusal = Config::load(None, &flags(false)).unwrap_err().to_string();
            assert!(refusal.contains("--insecure") && refusal.contains(address), "{refusal}");
            assert!(Config::load(None, &flags(true)).unwrap().insecure);
        }
        for address in ["127.0.0.1:8080", "127.1.2.3:0", "[::1]:8080"] {
            let flags = Flags { listen: address.parse().ok(), ..Flags::default() };
            Config::load(None, &flags).unwrap();
        }
    }

    #[test]
    fn what_is_not_understood_is_refused() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("skyduct.toml");
        for text in [
            "lisen = 1",
            "listen = \"x\"",
            "[log]\nlevel = \"loud\"",
            "[log]\nformat = \"xml\"",
            "[limits]\nqueued = 3",
            "cors_origins = [\"design.example/\"]",
            "role = \"api\"",
            "database = \"postgres://x\"",
        ] {
            std::fs::write(&file, text).unwrap();
            assert!(Config::load(Some(&file), &Flags::default()).is_err(), "{text}");
        }
        assert!(Config::load(Some(Path::new("/no/such/file")), &Flags::default()).is_err());
    }

    /// Tests each number of the configuration with absurd values.
    #[test]
    fn limits_out_of_range_are_refused_by_name() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("skyduct.toml");
        let refusal = |text: &str| {
            std::fs::write(&file, text).unwrap();
            format!("{:#}", Config::load(Some(&file), &Flags::default()).expect_err(text))
        };
        let defaults: serde_json::Value = Figment::from(Toml::string(DEFAULTS)).extract().unwrap();
        let mut names: Vec<&str> = defaults["limits"].as_object().unwrap().keys().map(String::as_str).collect();
        assert!(names.len() > 20, "{names:?}");
        names.push("memory_bytes");
        for name in names {
            for value in ["9_000_000_000_000_000_000", "-1", "nan", "inf"] {
                let refused = refusal(&format!("[limits]\n{name} = {value}"));
                assert!(refused.contains(name), "{name} = {value}: {refused}");
            }
            let may_be_none = ["waits", "waits_per_client", "free_bytes"];
            if !may_be_none.contains(&name) {
                let refused = refusal(&format!("[limits]\n{name} = 0"));
                assert!(refused.contains(&format!("limits.{name}: must be ")), "{name}: {refused}");
            }
        }
        let refused = refusal("[limits]\nbody_bytes_per_client = 100_000");
        assert_eq!(refused, "limits.body_bytes_per_client: must be at least document_bytes (1048576), but is 100000");
        let refused = refusal("[limits]\nmesh_bytes = 100_000_000");
        assert_eq!(refused, "limits.upload_bytes_per_client: must be at least mesh_bytes (100000000), but is 67108864");
        for host in ["https://render.example", "", "render.example/x"] {
            assert!(refusal(&format!("allowed_hosts = [{host:?}]")).contains("allowed_hosts: "), "{host}");
        }
    }

    #[test]
    fn passwords_are_in_no_message() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("skyduct.toml");
        for text in [
            "database = \"postgres://a:secret@h/d\"",
            "database = \"a:secret@h\"",
            "cors_origins = [\"https://a:secret@design.example\"]",
            "allowed_hosts = [\"a:secret@render.example\"]",
        ] {
            std::fs::write(&file, text).unwrap();
            let refusal = format!("{:#}", Config::load(Some(&file), &Flags::default()).expect_err(text));
            assert!(!refusal.contains("secret"), "{refusal}");
            assert!(refusal.contains(text.split_once(' ').unwrap().0), "{refusal}");
        }
    }
}
