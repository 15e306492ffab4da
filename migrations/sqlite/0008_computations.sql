-- What the job's results follow from: hash of its document, all defaults filled in, and of the program. NULL where no other job
-- may take its results: those of studies, and from before.
ALTER TABLE jobs ADD COLUMN computation TEXT;

CREATE INDEX jobs_by_computation ON jobs (computation, status) WHERE computation IS NOT NULL;
