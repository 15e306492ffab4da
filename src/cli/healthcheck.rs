//! `skyduct healthcheck`: checks that a service is ready, for a container's health check.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, bail};

use crate::cli::config::{Config, Flags};

/// Longest wait for an answer.
const PATIENCE: Duration = Duration::from_secs(3);

#[derive(Debug, clap::Args)]
pub struct HealthcheckArgs {
    /// Address of the service [default: the configured address, on this machine]
    #[arg(long, value_name = "URL")]
    pub server: Option<String>,
    /// Configuration file (TOML) of the service
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
}

/// Succeeds (exit status 0) if the service answers that it is ready.
pub fn run(args: HealthcheckArgs) -> anyhow::Result<()> {
    let server = match args.server {
        Some(server) => server,
        // the service is asked, not started: its address need not be safe here
        None => url_of(Config::load(args.config.as_deref(), &Flags { insecure: true, ..Flags::default() })?.listen),
    };
    let url = format!("{}/readyz", server.trim_end_matches('/'));
    // an error means that there is a provider already
    let _ = rustls::crypto::ring::default_provider().install_default();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    runtime.context("the runtime cannot start")?.block_on(async {
        let client = reqwest::Client::builder().timeout(PATIENCE).no_proxy().build()?;
        let response = client.get(&url).send().await.with_context(|| format!("{url} does not answer"))?;
        if !response.status().is_success() {
            bail!("{url} answers {}", response.status());
        }
        Ok(())
    })
}

/// Returns the URL of a service on this machine; loopback for one that listens on all addresses.
fn url_of(listen: SocketAddr) -> String {
    let address = match listen.ip() {
        IpAddr::V4(Ipv4Addr::UNSPECIFIED) => Ipv4Addr::LOCALHOST.into(),
        IpAddr::V6(Ipv6Addr::UNSPECIFIED) => Ipv6Addr::LOCALHOST.into(),
        address => address,
    };
    format!("http://{}", SocketAddr::new(address, listen.port()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_service_on_all_addresses_is_asked_on_loopback() {
        for (listen, url) in [
            ("0.0.0.0:8080", "http://127.0.0.1:8080"),
            ("[::]:80", "http://[::1]:80"),
            ("192.0.2.1:8080", "http://192.0.2.1:8080"),
        ] {
            assert_eq!(url_of(listen.parse().unwrap()), url);
        }
    }
}
