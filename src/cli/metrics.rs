//! Metrics of `/metrics`, with their descriptions.

use std::sync::OnceLock;

use metrics::{describe_counter, describe_gauge, describe_histogram};
use metrics_exporter_prometheus::{BuildError, Matcher, PrometheusBuilder, PrometheusHandle};
use metrics_process::Collector;

/// Upper bounds of the buckets of histograms, in seconds.
const SECONDS: [f64; 9] = [0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0];

const COUNTERS: [(&str, &str); 7] = [
    (
        "skyduct_event_reads_total",
        "Reads of events from the database, by who reads: the reader of all streams of a job, or one stream",
    ),
    ("skyduct_http_requests_total", "Requests that were answered, by method, route and status"),
    (
        "skyduct_jobs_finished_total",
        "Jobs that workers ended since the process started, by status; those cancelled or deleted while they waited are not counted",
    ),
    ("skyduct_jobs_submitted_total", "Jobs that were queued since the process started, those of sets included"),
    ("skyduct_jobs_taken_over_total", "Jobs that reused the results of an equal one since the process started"),
    ("skyduct_passes_total", "Passes that were rendered since the process started"),
    (
        "skyduct_refused_total",
        "Requests and connections that a limit refused, by its setting and by whether it is that of a client or of \
         the service",
    ),
];

const GAUGES: [(&str, &str); 11] = [
    ("skyduct_body_bytes", "Bytes of posted documents that are held now"),
    ("skyduct_disk_free_bytes", "Free bytes of the disk of the artifacts"),
    ("skyduct_event_streams", "Event streams that are open now"),
    ("skyduct_job_photons", "Photons of the job whose chunk ended last, from its first pass on"),
    ("skyduct_jobs", "Jobs that wait or run now, by status"),
    ("skyduct_stored_bytes", "Bytes of the files of all jobs"),
    ("skyduct_uploads", "Uploads in progress"),
    ("skyduct_waits", "Posts that wait for the end of their job now"),
    ("skyduct_watched_jobs", "Jobs whose events are read now for open streams"),
    ("skyduct_watched_job_sets", "Sets of jobs whose events are read now for open streams"),
    ("skyduct_watched_studies", "Studies whose events are read now for open streams"),
];

const HISTOGRAMS: [(&str, &str); 3] = [
    (
        "skyduct_http_request_seconds",
        "Time from receiving a request's head to sending the head of its answer, by route",
    ),
    ("skyduct_job_seconds", "Render time of jobs that ended, by status"),
    ("skyduct_job_wait_seconds", "Time from a job's submission to its first pass"),
];

/// Upper ends of the classes of the histograms of jobs in seconds.
const SECONDS_OF_JOBS: [f64; 11] = [0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 600.0, 3600.0];

/// Returns the handle of the process' metrics recorder, which the first call installs and all services in the process share.
pub(super) fn handle() -> Result<PrometheusHandle, BuildError> {
    static HANDLE: OnceLock<PrometheusHandle> = OnceLock::new();
    if let Some(handle) = HANDLE.get() {
        return Ok(handle.clone());
    }
    let recorder = PrometheusBuilder::new()
        .set_buckets_for_metric(Matcher::Suffix("_seconds".into()), &SECONDS)?
        .set_buckets_for_metric(Matcher::Prefix("skyduct_job_".into()), &SECONDS_OF_JOBS)?
        .build_recorder();
    let handle = HANDLE.get_or_init(|| recorder.handle()).clone();
    // an error means that another service in this process was first, whose handle is used
    if metrics::set_global_recorder(recorder).is_ok() {
        COUNTERS.into_iter().for_each(|(name, words)| describe_counter!(name, words));
        GAUGES.into_iter().for_each(|(name, words)| describe_gauge!(name, words));
        HISTOGRAMS.into_iter().for_each(|(name, words)| describe_histogram!(name, words));
        Collector::default().describe();
    }
    Ok(handle)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::Path;

    use super::*;

    /// Collects the names of all metrics that source files below a folder write.
    fn written(folder: &Path, found: &mut BTreeSet<String>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                written(&path, found);
            } else if path.extension().is_some_and(|it| it == "rs") {
                let text = std::fs::read_to_string(&path).unwrap();
                let after =
                    ["counter!(\"", "gauge!(\"", "histogram!(\""].into_iter().flat_map(|it| text.split(it).skip(1));
                found.extend(after.filter_map(|rest| Some(rest.split_once('"')?.0.to_owned())));
            }
        }
    }

    #[test]
    fn every_metric_is_described() {
        let mut found = BTreeSet::new();
        written(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &mut found);
        found.retain(|name| name.starts_with("skyduct_"));
        let described = COUNTERS.iter().chain(&GAUGES).chain(&HISTOGRAMS).map(|(name, _)| (*name).to_owned());
        assert_eq!(found, described.collect());
    }
}
