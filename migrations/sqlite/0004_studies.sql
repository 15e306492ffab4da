-- A study: jobs that are compared with each other.
CREATE TABLE studies (
    id              TEXT    NOT NULL PRIMARY KEY,   -- UUIDv7: ordered by time
    name            TEXT,
    request         TEXT    NOT NULL,               -- as understood, all defaults filled in
    refused         TEXT    NOT NULL,               -- the methods that refuse the job, with their reasons
    confidence      REAL    NOT NULL,               -- of its errors and intervals
    idempotency_key TEXT    UNIQUE,
    body_hash       TEXT    NOT NULL,               -- of the canonical body
    created_at      INTEGER NOT NULL
) STRICT;

-- Its jobs, which are jobs like all others; one that was deleted alone keeps its place.
CREATE TABLE study_jobs (
    study_id TEXT    NOT NULL REFERENCES studies (id) ON DELETE CASCADE,
    place    INTEGER NOT NULL,
    job_id   TEXT    NOT NULL,
    part     TEXT    NOT NULL,                      -- which part it has in the study
    PRIMARY KEY (study_id, place)
) STRICT;
