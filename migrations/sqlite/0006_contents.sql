-- Small files beside their names: a file of its own, and the waits for the disk that it needs, cost more than they hold. NULL
-- where the file is in the folder of the artifacts, at its key.
ALTER TABLE artifacts ADD COLUMN content BLOB;
