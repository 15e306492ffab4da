//! Steps that bring a database to the present tables: `migrations/sqlite`, in the order of their numbers.

use sqlx::SqlSafeStr;
use sqlx::migrate::{Migration, MigrationType, Migrator};

/// Name and SQL of every step. A step that has ever run must not be changed: its hash is kept in the database.
const STEPS: [(&str, &str); 17] = [
    ("0001_jobs", include_str!("../../../migrations/sqlite/0001_jobs.sql")),
    ("0002_reliability", include_str!("../../../migrations/sqlite/0002_reliability.sql")),
    ("0003_cpu_seconds", include_str!("../../../migrations/sqlite/0003_cpu_seconds.sql")),
    ("0004_studies", include_str!("../../../migrations/sqlite/0004_studies.sql")),
    ("0005_predictions", include_str!("../../../migrations/sqlite/0005_predictions.sql")),
    ("0006_contents", include_str!("../../../migrations/sqlite/0006_contents.sql")),
    ("0007_study_documents", include_str!("../../../migrations/sqlite/0007_study_documents.sql")),
    ("0008_computations", include_str!("../../../migrations/sqlite/0008_computations.sql")),
    ("0009_clients", include_str!("../../../migrations/sqlite/0009_clients.sql")),
    ("0010_slices", include_str!("../../../migrations/sqlite/0010_slices.sql")),
    ("0011_ends", include_str!("../../../migrations/sqlite/0011_ends.sql")),
    ("0012_owner", include_str!("../../../migrations/sqlite/0012_owner.sql")),
    ("0013_uploads", include_str!("../../../migrations/sqlite/0013_uploads.sql")),
    ("0014_uploads_and_lists", include_str!("../../../migrations/sqlite/0014_uploads_and_lists.sql")),
    ("0015_job_sets", include_str!("../../../migrations/sqlite/0015_job_sets.sql")),
    ("0016_passes_ahead", include_str!("../../../migrations/sqlite/0016_passes_ahead.sql")),
    ("0017_degrees_of_freedom", include_str!("../../../migrations/sqlite/0017_degrees_of_freedom.sql")),
];

/// Returns all steps; a database records those that it has run.
pub(super) fn migrations() -> Migrator {
    let step = |(version, (name, sql)): (i64, (&'static str, &'static str))| {
        let description = name.split_once('_').map_or(name, |(_, words)| words).replace('_', " ");
        Migration::new(version, description.into(), MigrationType::Simple, sql.into_sql_str(), false)
    };
    Migrator::with_migrations((1..).zip(STEPS).map(step).collect())
}

#[cfg(test)]
mod tests {
    use sqlx::{AssertSqlSafe, Connection, SqliteConnection};

    use super::*;
    use crate::db::sqlite::{job_sets, jobs, uploads};
    use crate::queue::owner::Owner;
    use crate::queue::store::{About, AboutMesh, SetKind, UploadKind};

    /// Jobs, studies and meshes from before there were owners are the default owner's, with their keys and everything that belongs to them.
    #[tokio::test]
    async fn what_had_no_owner_is_the_default_owners() {
        let mut database = SqliteConnection::connect("sqlite::memory:").await.unwrap();
        let before = migrations().iter().take(11).cloned().collect();
        Migrator::with_migrations(before).run(&mut database).await.unwrap();
        let id = uuid::Uuid::from_u128(1);
        let rows = format!(
            "INSERT INTO jobs (id, status, submitted, document, plan, warnings, idempotency_key, body_hash, created_at) \
             VALUES ('{id}', 'queued', '{{}}', '{{}}', '{{}}', '[]', 'of a job', '', 1); \
             INSERT INTO events (job_id, seq, name, data, at) VALUES ('{id}', 1, 'queued', '{{}}', 1); \
             INSERT INTO studies (id, request, refused, confidence, idempotency_key, body_hash, created_at) \
             VALUES ('{id}', '{{}}', '[]', 0.95, 'of a study', '', 1); \
             INSERT INTO study_jobs (study_id, place, job_id, part) VALUES ('{id}', 0, '{id}', '{{}}'); \
             INSERT INTO meshes (id, key, size, triangles, materials, created_at) VALUES ('m', 'file', 1, 2, '[\"pipe\"]', 3)"
        );
        sqlx::query(AssertSqlSafe(rows)).execute(&mut database).await.unwrap();
        migrations().run(&mut database).await.unwrap();
        let [theirs, others] = [Owner::default(), Owner::new("other")];
        for (owner, found) in [(&theirs, true), (&others, false)] {
            let job = jobs::job_of_key(&mut database, Some(owner), "of a job").await.unwrap();
            assert_eq!(job.map(|job| job.head.id), found.then_some(id));
            let study = job_sets::of_key(&mut database, Some(owner), SetKind::Study, "of a study").await.unwrap();
            assert_eq!(study.map(|study| study.members.len()), found.then_some(1));
            let mesh = uploads::find(&mut database, Some(owner), UploadKind::Mesh, "m").await.unwrap();
            let about = About::Mesh(AboutMesh { triangles: 2, materials: vec!["pipe".into()] });
            assert_eq!(mesh.map(|mesh| (mesh.key, mesh.about)), found.then(|| ("file".to_owned(), about)));
        }
        let events: i64 = sqlx::query_scalar("SELECT count(*) FROM events").fetch_one(&mut database).await.unwrap();
        assert_eq!(events, 1);
    }

    /// Studies from before there were sets of jobs are sets, with everything that they had; their jobs have their whole documents.
    #[tokio::test]
    async fn studies_are_sets_of_jobs() {
        let mut database = SqliteConnection::connect("sqlite::memory:").await.unwrap();
        let before = migrations().iter().take(14).cloned().collect();
        Migrator::with_migrations(before).run(&mut database).await.unwrap();
        sqlx::query("PRAGMA foreign_keys = ON").execute(&mut database).await.unwrap();
        let [id, job, gone] = [1, 2, 3].map(uuid::Uuid::from_u128);
        let rows = format!(
            "INSERT INTO studies (id, owner, name, request, refused, confidence, idempotency_key, body_hash, created_at) \
             VALUES ('{id}', 'ann', 'n', '{{\"seconds\":1e-05}}', '[{{\"method\":\"m\",\"reason\":\"it''s\"}}]', 0.95, 'k', 'h', 7); \
             INSERT INTO study_documents (study_id, submitted, document, plan) \
             VALUES ('{id}', '{{\"seed\":1}}', '{{\"seed\":1}}', '{{}}'); \
             INSERT INTO study_jobs (study_id, place, job_id, part, found) \
             VALUES ('{id}', 0, '{job}', '{{\"run\":null}}', '{{\"run\":2}}'), ('{id}', 1, '{gone}', '{{}}', NULL); \
             INSERT INTO jobs (id, owner, status, submitted, document, plan, study_id, warnings, body_hash, created_at) \
             VALUES ('{job}', 'ann', 'queued', '{own}', '{own}', '{{\"shared\":[],\"own\":{{}}}}', '{id}', '[]', '', 1)",
            own = "{\"shared\":[\"seed\"],\"own\":{}}"
        );
        sqlx::query(AssertSqlSafe(rows)).execute(&mut database).await.unwrap();
        migrations().run(&mut database).await.unwrap();
        let set = job_sets::job_set(&mut database, Some(&Owner::new("ann")), id).await.unwrap().unwrap();
        assert_eq!((set.kind, set.name.as_deref(), set.body_hash.as_str()), (SetKind::Study, Some("n"), "h"));
        let about: serde_json::Value = serde_json::from_str(&set.about).unwrap();
        let refused = serde_json::json!([{ "method": "m", "reason": "it's" }]);
        let expected = serde_json::json!({ "request": { "seconds": 1e-5 }, "refused": refused, "confidence": 0.95 });
        assert_eq!((set.created_at, about), (7, expected));
        let members: Vec<_> = set.members.iter().map(|member| (member.job, member.found.is_some())).collect();
        assert_eq!(members, [(job, true), (gone, false)]);
        assert_eq!(set.members[0].part, serde_json::json!({ "run": null }));
        let source = jobs::source(&mut database, None, job).await.unwrap().unwrap();
        assert_eq!(source.submitted, r#"{"seed":1}"#);
    }

    #[test]
    fn every_file_of_the_folder_is_a_step() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/migrations/sqlite");
        let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|file| file.unwrap().file_name()).collect();
        files.sort();
        let steps: Vec<_> = STEPS.iter().map(|(name, _)| std::ffi::OsString::from(format!("{name}.sql"))).collect();
        assert_eq!(files, steps);
        for (number, name) in (1..).zip(&files) {
            assert!(name.to_str().unwrap().starts_with(&format!("{number:04}_")), "{name:?}");
        }
    }
}
