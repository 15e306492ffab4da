-- Jobs in the order in which they ended, for retention and for deletion of many.
CREATE INDEX jobs_by_end ON jobs (finished_at) WHERE finished_at IS NOT NULL;
