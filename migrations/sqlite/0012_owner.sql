-- Owner of jobs, studies and uploaded meshes: nobody else sees them. There is one until clients have keys.
ALTER TABLE jobs ADD COLUMN owner TEXT NOT NULL DEFAULT 'default';
ALTER TABLE studies ADD COLUMN owner TEXT NOT NULL DEFAULT 'default';

-- Keys of requests are unique for each owner. The columns from before, unique for all, cannot be dropped: they stay empty.
ALTER TABLE jobs RENAME COLUMN idempotency_key TO unscoped_key;
ALTER TABLE jobs ADD COLUMN idempotency_key TEXT;
UPDATE jobs SET idempotency_key = unscoped_key, unscoped_key = NULL WHERE unscoped_key IS NOT NULL;
CREATE UNIQUE INDEX jobs_by_key ON jobs (idempotency_key, owner) WHERE idempotency_key IS NOT NULL;
ALTER TABLE studies RENAME COLUMN idempotency_key TO unscoped_key;
ALTER TABLE studies ADD COLUMN idempotency_key TEXT;
UPDATE studies SET idempotency_key = unscoped_key, unscoped_key = NULL WHERE unscoped_key IS NOT NULL;
CREATE UNIQUE INDEX studies_by_key ON studies (idempotency_key, owner) WHERE idempotency_key IS NOT NULL;

-- Equal meshes of two owners are two rows with a file each.
CREATE TABLE meshes_of_owners (
    owner      TEXT    NOT NULL,
    id         TEXT    NOT NULL,                        -- of the content
    key        TEXT    NOT NULL,
    size       INTEGER NOT NULL,
    triangles  INTEGER NOT NULL,
    materials  TEXT    NOT NULL,
    created_at INTEGER NOT NULL,
    PRIMARY KEY (id, owner)
) STRICT;
INSERT INTO meshes_of_owners (owner, id, key, size, triangles, materials, created_at)
    SELECT 'default', id, key, size, triangles, materials, created_at FROM meshes;
DROP TABLE meshes;
ALTER TABLE meshes_of_owners RENAME TO meshes;
