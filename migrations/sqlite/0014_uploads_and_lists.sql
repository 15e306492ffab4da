-- Time of a file's last upload, for retention; repeated uploads were not recorded before, so that all count from now.
ALTER TABLE uploads ADD COLUMN uploaded_at INTEGER NOT NULL DEFAULT 0;
UPDATE uploads SET uploaded_at = CAST(unixepoch('subsec') * 1000 AS INTEGER);

-- Equal jobs are looked for among those of one owner.
DROP INDEX jobs_by_computation;
CREATE INDEX jobs_by_computation ON jobs (computation, owner, status) WHERE computation IS NOT NULL;

-- Jobs and studies of an owner, newest first.
CREATE INDEX jobs_by_owner ON jobs (owner, id);
CREATE INDEX jobs_by_owner_and_status ON jobs (owner, status, id);
CREATE INDEX studies_by_owner ON studies (owner, id);
