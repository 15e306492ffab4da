-- What each method would take, as a pilot foretold before the job ran (JSON); NULL where nobody asked.
ALTER TABLE jobs ADD COLUMN predictions TEXT;
