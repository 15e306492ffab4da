-- Time of a mesh's last upload, for retention.
ALTER TABLE meshes ADD COLUMN uploaded_at INTEGER NOT NULL DEFAULT 0;
UPDATE meshes SET uploaded_at = created_at;
