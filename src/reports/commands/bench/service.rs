//! Latency and throughput of the service for jobs over loopback.

use std::time::{Duration, Instant};

use anyhow::bail;
use serde_json::Value;

use crate::bench::service::{Latencies, dragged, small_job};
use crate::bench::{Progress, Settings};
use skyduct::cli::client::Client;
use skyduct::cli::config::{Config, Flags};
use skyduct::cli::serve::{RunningService, runtime};
use skyduct::cli::temporary_folder::TemporaryFolder;

/// Number of concurrent clients.
const CLIENTS: usize = 4;

/// Number of requests before the first one that counts.
const WARM_UP: u64 = 3;

/// Longest time in seconds that a request waits for its job.
const WAIT: u32 = 30;

pub fn measure(settings: &Settings, progress: Progress) -> anyhow::Result<Latencies> {
    let runtime = runtime()?;
    let latencies = runtime.block_on(async {
        let folder = TemporaryFolder::new("bench")?;
        let (listen, data) = (Some(([127, 0, 0, 1], 0).into()), Some(folder.path().to_owned()));
        let service = RunningService::start(Config::load(None, &Flags { listen, data, ..Flags::default() })?).await?;
        let latencies = of_service(settings, &service.url(), progress).await;
        service.stop().await;
        latencies
    });
    runtime.shutdown_timeout(Duration::from_secs(1));
    latencies
}

async fn of_service(settings: &Settings, url: &str, progress: Progress<'_>) -> anyhow::Result<Latencies> {
    let client = Client::new(url)?;
    let requests = settings.either(200, 20);
    progress.step(0, 3, "the service: S1");
    let mut one = Vec::new();
    for seed in 0..WARM_UP + requests {
        let seconds = request(&client, &small_job(settings, seed)?).await?;
        one.extend((seed >= WARM_UP).then_some(seconds));
    }
    progress.step(1, 3, "the service: a dragged tube");
    let mut of_dragged = Vec::new();
    for step in 0..requests as u32 {
        of_dragged.push(request(&client, &dragged(step)).await?);
    }
    progress.step(2, 3, "the service: simultaneous clients");
    let jobs_per_second = at_once(settings, &client).await?;
    Ok(Latencies { one, dragged: of_dragged, clients: CLIENTS, jobs_per_second })
}

/// Measures the wall-clock seconds until a job is answered with its grids.
async fn request(client: &Client, document: &Value) -> anyhow::Result<f64> {
    let document = document.to_string().into_bytes();
    let start = Instant::now();
    let job = client.submit_and_wait(document, WAIT).await?;
    let seconds = start.elapsed().as_secs_f64();
    if job["grid_results"].is_object() { Ok(seconds) } else { bail!("a job was not done in time: {}", job["status"]) }
}

/// Measures the jobs answered per second, to clients that send the next request as soon as they have an answer.
async fn at_once(settings: &Settings, client: &Client) -> anyhow::Result<f64> {
    let seconds = settings.either(10.0, 1.0);
    let start = Instant::now();
    let one = |number: usize| async move {
        let mut answered = 0;
        while start.elapsed().as_secs_f64() < seconds {
            // seeds that no other request has
            request(client, &small_job(settings, ((number as u64 + 1) << 32) + answered)?).await?;
            answered += 1;
        }
        anyhow::Ok(answered)
    };
    let answered: u64 = futures::future::try_join_all((0..CLIENTS).map(one)).await?.into_iter().sum();
    Ok(answered as f64 / start.elapsed().as_secs_f64())
}
