-- Who posted a job: clients take turns.
ALTER TABLE jobs ADD COLUMN client TEXT NOT NULL DEFAULT '';
ALTER TABLE chunks ADD COLUMN client TEXT NOT NULL DEFAULT '';
CREATE INDEX chunks_of_client ON chunks (client, line, turn) WHERE state <> 'done';

-- Of equal turns, who came first is first.
DROP INDEX chunks_open;
CREATE INDEX chunks_open ON chunks (line, turn) WHERE state <> 'done';
