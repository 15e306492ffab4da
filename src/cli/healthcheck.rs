//! `skyduct healthcheck`: whether a service is ready, for a container's health check.

use std::time::Duration;

use anyhow::{Context, bail};

#[derive(Debug, clap::Args)]
pub struct HealthcheckArgs {
    /// Address of the service
    #[arg(long, value_name = "URL", default_value = "http://127.0.0.1:8080")]
    pub server: String,
}

/// Exit status 0 when the service answers that it is ready.
pub fn run(args: HealthcheckArgs) -> anyhow::Result<()> {
    // an error means that there is a provider already
    let _ = rustls::crypto::ring::default_provider().install_default();
    let url = format!("{}/readyz", args.server.trim_end_matches('/'));
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_all().build().context("the runtime cannot start")?;
    runtime.block_on(async {
        let client = reqwest::Client::builder().timeout(Duration::from_secs(3)).no_proxy().build()?;
        let response = client.get(&url).send().await.with_context(|| format!("{url} does not answer"))?;
        if !response.status().is_success() {
            bail!("{url} answers {}: {}", response.status(), response.text().await.unwrap_or_default());
        }
        Ok(())
    })
}
