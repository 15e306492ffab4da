-- Slices that the job has had in the short lane without an end of its chunk.
ALTER TABLE jobs ADD COLUMN slices INTEGER NOT NULL DEFAULT 0;
