-- Who this store is and how its last process ended; one row, absent until the first start that knows of it.
CREATE TABLE store (
    only_row   INTEGER NOT NULL PRIMARY KEY CHECK (only_row = 1),
    identity   TEXT    NOT NULL,               -- the same in the folder of the artifacts: whose files they are
    serving    INTEGER NOT NULL DEFAULT 0,     -- 1 from a start to the end: a start that finds it follows a crash
    written_at INTEGER NOT NULL,               -- no older than the newest file that this database may name, give or take minutes
    sweep_from INTEGER NOT NULL DEFAULT 0      -- files that were written before are never swept
) STRICT;

-- The state before the last one: what a job falls back to when the last one is damaged.
ALTER TABLE jobs ADD COLUMN previous_state_key TEXT;
ALTER TABLE jobs ADD COLUMN previous_state_hash TEXT;
ALTER TABLE jobs ADD COLUMN previous_seconds REAL NOT NULL DEFAULT 0;

-- Waiting chunks are taken by line (0: of cancelled jobs, 1: first chunks, 2: later ones), then by turn; chunks of old
-- databases come first.
ALTER TABLE chunks ADD COLUMN line INTEGER NOT NULL DEFAULT 1;
ALTER TABLE chunks ADD COLUMN turn INTEGER NOT NULL DEFAULT 0;
-- The last pass that any attempt at the chunk has reported, and whether the newest attempt got further than all before it.
ALTER TABLE chunks ADD COLUMN reached INTEGER NOT NULL DEFAULT 0;
ALTER TABLE chunks ADD COLUMN progressed INTEGER NOT NULL DEFAULT 0;
-- Attempts in a row whose process died without getting further.
ALTER TABLE chunks ADD COLUMN deaths INTEGER NOT NULL DEFAULT 0;

-- The old index could not be used: SQLite does not see that state = 'ready' implies its condition.
DROP INDEX chunks_open;
CREATE INDEX chunks_open ON chunks (line, turn, job_id) WHERE state <> 'done';
