-- Jobs in the order in which they ended, for retention and for deletion of many.
CREATE INDEX jobs_by_end ON jobs (finished_at) WHERE finished_at IS NOT NULL;

-- The study of a job, by the job.
CREATE INDEX study_jobs_by_job ON study_jobs (job_id);
