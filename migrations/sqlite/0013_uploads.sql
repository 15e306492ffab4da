-- Uploaded files of two kinds: meshes and weather. The content of a file in short is JSON by its kind.
ALTER TABLE meshes RENAME TO uploads;
ALTER TABLE uploads ADD COLUMN kind TEXT NOT NULL DEFAULT 'mesh';
ALTER TABLE uploads ADD COLUMN about TEXT NOT NULL DEFAULT '{}';
UPDATE uploads SET about = json_object('triangles', triangles, 'materials', json(materials));
ALTER TABLE uploads DROP COLUMN triangles;
ALTER TABLE uploads DROP COLUMN materials;
ALTER TABLE job_meshes RENAME TO job_uploads;
ALTER TABLE job_uploads RENAME COLUMN mesh_id TO upload_id;
DROP INDEX job_meshes_by_mesh;
CREATE INDEX job_uploads_by_upload ON job_uploads (upload_id);
