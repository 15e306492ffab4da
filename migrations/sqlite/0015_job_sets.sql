-- A set of jobs that were posted together and are deleted together. A study is one of its kinds.
CREATE TABLE job_sets (
    id              TEXT    NOT NULL PRIMARY KEY,   -- UUIDv7: ordered by time
    owner           TEXT    NOT NULL,
    kind            TEXT    NOT NULL,               -- what the set is for: 'jobs' for itself, 'study' for a comparison of its jobs
    name            TEXT,
    about           TEXT    NOT NULL,               -- what its kind keeps beside the jobs (JSON)
    idempotency_key TEXT,
    body_hash       TEXT    NOT NULL,               -- of the canonical body
    created_at      INTEGER NOT NULL
) STRICT;
CREATE INDEX job_sets_by_owner ON job_sets (owner, kind, id);
CREATE INDEX job_sets_by_kind ON job_sets (kind, id);
CREATE UNIQUE INDEX job_sets_by_key ON job_sets (idempotency_key, owner, kind) WHERE idempotency_key IS NOT NULL;
INSERT INTO job_sets (id, owner, kind, name, about, idempotency_key, body_hash, created_at)
    SELECT id, owner, 'study', name,
           '{"request":' || request || ',"refused":' || refused || ',"confidence":' || confidence || '}',
           idempotency_key, body_hash, created_at FROM studies;

-- Its jobs, which are jobs like all others; one that was deleted alone keeps its place.
CREATE TABLE job_set_members (
    set_id TEXT    NOT NULL REFERENCES job_sets (id) ON DELETE CASCADE,
    place  INTEGER NOT NULL,
    job_id TEXT    NOT NULL,
    part   TEXT    NOT NULL,                        -- what the job is for in the set, by its kind (JSON)
    found  TEXT,                                    -- what the set has taken from the job's results, by its kind (JSON)
    PRIMARY KEY (set_id, place)
) STRICT;
CREATE INDEX job_set_members_by_job ON job_set_members (job_id);
INSERT INTO job_set_members (set_id, place, job_id, part, found)
    SELECT study_id, place, job_id, part, found FROM study_jobs;

-- What the documents and plans of its jobs have in common: names and values of fields (JSON).
CREATE TABLE job_set_documents (
    set_id    TEXT NOT NULL PRIMARY KEY REFERENCES job_sets (id) ON DELETE CASCADE,
    submitted TEXT NOT NULL,
    document  TEXT NOT NULL,
    plan      TEXT NOT NULL
) STRICT;
INSERT INTO job_set_documents (set_id, submitted, document, plan)
    SELECT study_id, submitted, document, plan FROM study_documents;

DROP TABLE study_documents;
DROP TABLE study_jobs;
DROP TABLE studies;

-- The set whose common fields the job's submitted, document and plan lack; NULL where they are whole.
ALTER TABLE jobs RENAME COLUMN study_id TO set_id;
