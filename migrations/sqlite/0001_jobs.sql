-- Only TEXT, INTEGER (64 bits: BIGINT on PostgreSQL) and REAL (DOUBLE PRECISION): rows decode alike on both.
-- Times are milliseconds since 1970 by the database's clock.

CREATE TABLE jobs (
    id                  TEXT    NOT NULL PRIMARY KEY,   -- UUIDv7: ordered by time
    name                TEXT,
    status              TEXT    NOT NULL CHECK (status IN ('queued', 'running', 'succeeded', 'failed', 'cancelled')),
    submitted           TEXT    NOT NULL,               -- the document as it was posted
    document            TEXT    NOT NULL,               -- as understood, all defaults filled in
    plan                TEXT    NOT NULL,
    warnings            TEXT    NOT NULL,
    idempotency_key     TEXT    UNIQUE,
    body_hash           TEXT    NOT NULL,               -- of the canonical body
    cancel              INTEGER NOT NULL DEFAULT 0,
    next_seq            INTEGER NOT NULL DEFAULT 1,     -- sequence number of the next event
    chunks_done         INTEGER NOT NULL DEFAULT 0,
    merged_seconds      REAL    NOT NULL DEFAULT 0,     -- render seconds of the merged chunks
    passes              INTEGER NOT NULL DEFAULT 0,
    photons             INTEGER NOT NULL DEFAULT 0,
    rays                INTEGER NOT NULL DEFAULT 0,
    seconds             REAL    NOT NULL DEFAULT 0,
    relative_error      REAL,
    view_relative_error REAL,
    state_key           TEXT,                           -- the merged state after chunk chunks_done - 1
    state_hash          TEXT,
    stopped_by          TEXT,
    summary             TEXT,
    problem             TEXT,
    created_at          INTEGER NOT NULL,
    started_at          INTEGER,
    finished_at         INTEGER
) STRICT;

CREATE INDEX jobs_by_status ON jobs (status, id);

-- A chunk is a range of passes. The row of the next one appears when its predecessor is done, because that decides
-- whether there is a next one.
CREATE TABLE chunks (
    job_id      TEXT    NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    idx         INTEGER NOT NULL,
    pass_from   INTEGER NOT NULL,
    pass_to     INTEGER NOT NULL,
    state       TEXT    NOT NULL CHECK (state IN ('ready', 'leased', 'done')),
    attempt     INTEGER NOT NULL DEFAULT 0,             -- with owner: the fence
    failures    INTEGER NOT NULL DEFAULT 0,
    owner       TEXT,
    lease_until INTEGER,
    error       TEXT,
    PRIMARY KEY (job_id, idx)
) STRICT;

CREATE INDEX chunks_open ON chunks (state, job_id, idx) WHERE state <> 'done';

CREATE TABLE events (
    job_id TEXT    NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    seq    INTEGER NOT NULL,
    name   TEXT    NOT NULL,
    data   TEXT    NOT NULL,
    at     INTEGER NOT NULL,
    PRIMARY KEY (job_id, seq)
) STRICT;

-- The convergence table: one row a pass, however often the pass was rendered.
CREATE TABLE passes (
    job_id              TEXT    NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    pass                INTEGER NOT NULL,
    seconds             REAL    NOT NULL,
    photons             INTEGER NOT NULL,
    rays                INTEGER NOT NULL,
    relative_error      REAL,
    view_relative_error REAL,
    mean_lux            REAL,
    PRIMARY KEY (job_id, pass)
) STRICT;

CREATE TABLE artifacts (
    job_id     TEXT    NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    name       TEXT    NOT NULL,
    key        TEXT    NOT NULL,
    hash       TEXT    NOT NULL,
    size       INTEGER NOT NULL,
    media_type TEXT    NOT NULL,
    PRIMARY KEY (job_id, name)
) STRICT;

CREATE TABLE meshes (
    id         TEXT    NOT NULL PRIMARY KEY,            -- of the content
    key        TEXT    NOT NULL,
    size       INTEGER NOT NULL,
    triangles  INTEGER NOT NULL,
    materials  TEXT    NOT NULL,
    created_at INTEGER NOT NULL
) STRICT;

CREATE TABLE job_meshes (
    job_id  TEXT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    mesh_id TEXT NOT NULL,
    PRIMARY KEY (job_id, mesh_id)
) STRICT;

CREATE INDEX job_meshes_by_mesh ON job_meshes (mesh_id);
