-- What the documents and plans of a study's jobs have in common: names and values of fields (JSON).
CREATE TABLE study_documents (
    study_id  TEXT NOT NULL PRIMARY KEY REFERENCES studies (id) ON DELETE CASCADE,
    submitted TEXT NOT NULL,
    document  TEXT NOT NULL,
    plan      TEXT NOT NULL
) STRICT;

-- The study whose common fields the job's submitted, document and plan lack; NULL where they are whole, as those of single
-- jobs and of studies from before.
ALTER TABLE jobs ADD COLUMN study_id TEXT;
-- The few numbers that the job's results are to its study, once somebody has looked after its end (JSON).
ALTER TABLE study_jobs ADD COLUMN found TEXT;
