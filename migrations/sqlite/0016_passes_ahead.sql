-- Ranges of passes that are computed ahead of their job's chunk, which takes their results in order and then deletes them.
CREATE TABLE passes_ahead (
    job_id      TEXT    NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    pass_from   INTEGER NOT NULL,
    pass_to     INTEGER NOT NULL,
    grids       INTEGER NOT NULL,                       -- 1 if the passes compute the grids
    views       INTEGER NOT NULL,
    -- left: nobody computes it but the chunk
    state       TEXT    NOT NULL CHECK (state IN ('ready', 'leased', 'done', 'left')),
    owner       TEXT,                                   -- the fence: an owner has one range at a time
    lease_until INTEGER,
    key         TEXT,                                   -- the outcomes of the passes
    hash        TEXT,
    PRIMARY KEY (job_id, pass_from)
) STRICT;

-- A chunk is whatever its worker commits; nobody has ever read where it was to end.
ALTER TABLE chunks DROP COLUMN pass_to;
