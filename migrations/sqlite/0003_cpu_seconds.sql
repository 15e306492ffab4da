-- Processor seconds of the threads that rendered, beside every time on the wall; NULL where they are not known.
ALTER TABLE passes ADD COLUMN cpu_seconds REAL;
ALTER TABLE jobs ADD COLUMN cpu_seconds REAL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN merged_cpu_seconds REAL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN previous_cpu_seconds REAL DEFAULT 0;
UPDATE jobs SET cpu_seconds = NULL WHERE seconds > 0;
UPDATE jobs SET merged_cpu_seconds = NULL WHERE merged_seconds > 0;
UPDATE jobs SET previous_cpu_seconds = NULL WHERE previous_seconds > 0;
