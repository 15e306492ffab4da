//! Reuse of results: a job with the same computation as an ended one takes its results, and is not rendered.

use serde::Deserialize;
use uuid::Uuid;

use super::commit::{Commits, retry};
use super::interrupted::Interrupted;
use crate::present::outputs::progress_image;
use crate::queue::events::{EventData, Image, Pass, Phase};
use crate::queue::files::FileError;
use crate::queue::store::*;

impl Commits {
    /// Ends a job at its first claim with the results of an equal job, copied to files of its own, so that it does not depend on the other
    /// one any more. False where there is no equal job, or where not all of its results are left.
    pub async fn take_over(&self, lease: &Lease) -> Result<bool, Interrupted> {
        if lease.chunk > 0 || lease.cancel_requested {
            return Ok(false);
        }
        let Some(equal) = self.store.ended_equal(lease.job).await? else { return Ok(false) };
        let Some(finished) = self.finished_as(lease, equal).await? else { return Ok(false) };
        let Finished { reports, finish } = finished;
        let completion = Completion::Finish(finish);
        let committed = retry(|| self.store.complete(lease, &reports, &completion)).await?;
        if committed == Committed::LeaseLost {
            return Err(Interrupted::LeaseLost);
        }
        tracing::info!(equal = %equal, "job finished with the results of an equal one");
        metrics::counter!("skyduct_jobs_finished_total", "status" => JobStatus::Succeeded.name()).increment(1);
        metrics::counter!("skyduct_jobs_taken_over_total").increment(1);
        let (commits, lease) = (self.clone(), lease.clone());
        // the next job need not wait for the disk, too
        self.ends.spawn(async move {
            if let Err(error) = commits.settle(&lease, committed).await {
                tracing::error!(%error, job = %lease.job, "the end of the job may not survive a power failure");
            }
        });
        Ok(true)
    }

    /// Reads the end of an equal job as that of this one; `None` where the equal job or one of its files is gone.
    async fn finished_as(&self, lease: &Lease, equal: Uuid) -> Result<Option<Finished>, Interrupted> {
        let Some(Job { head, summary: Some(mut summary), .. }) = self.store.job(equal).await? else { return Ok(None) };
        let events = self.store.events(equal, 0, u32::MAX).await?;
        let Some(stopped_by) = head.stopped_by else { return Ok(None) };
        let mut artifacts = match self.copied(lease, self.store.artifacts(equal).await?).await {
            Ok(artifacts) => artifacts,
            Err(error) => {
                tracing::warn!(%error, equal = %equal, "the files of an equal job cannot be read");
                return Ok(None);
            }
        };
        // where the equal job took its results over itself, the job that was rendered
        if let Some(fields) = summary.as_object_mut() {
            fields.entry("computed_by").or_insert_with(|| equal.to_string().into());
        }
        let (mut reports, mut last_pass) = (Vec::new(), None);
        for Event { name, data, .. } in events {
            if name == Pass::NAME
                && let Ok(pass) = Pass::deserialize(&data)
            {
                last_pass = Some(Box::new(pass.clone()));
                reports.push(Report::Pass(pass));
            } else if name == Image::NAME
                && let Ok(Image { view, passes }) = Image::deserialize(&data)
                && let Some(at) = artifacts.iter().position(|artifact| artifact.name == progress_image(&view, passes))
            {
                reports.push(Report::Image { view, passes, artifact: artifacts.swap_remove(at) });
            } else if name == Phase::NAME
                && let Ok(phase) = Phase::deserialize(&data)
            {
                reports.push(Report::Phase(phase));
            }
        }
        let end = JobEnd::Succeeded { stopped_by, progress: head.progress };
        Ok(Some(Finished { reports, finish: Finish { end, summary: Some(summary), artifacts, last_pass } }))
    }

    /// Copies the files of another job to durable files of this one.
    async fn copied(&self, lease: &Lease, files: Vec<Artifact>) -> Result<Vec<Artifact>, FileError> {
        let mut copies = Vec::with_capacity(files.len());
        // one at a time: a picture may be large
        for file in files {
            copies.push(match file.content {
                Some(_) => file,
                None => {
                    let bytes = self.artifacts.read_artifact(&file).await?;
                    self.artifacts.put_of_chunk(lease, &file.name, &file.media_type, bytes).await?
                }
            });
        }
        let keys: Vec<&str> = copies.iter().map(|file| file.key.as_str()).filter(|key| !key.is_empty()).collect();
        self.artifacts.sync(&keys).await?;
        Ok(copies)
    }
}

/// End of a job, with all reports before it.
struct Finished {
    reports: Vec<Report>,
    finish: Finish,
}
