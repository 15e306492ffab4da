//! Steps that bring a database to the present tables: `migrations/sqlite`, in the order of their numbers.

use sqlx::SqlSafeStr;
use sqlx::migrate::{Migration, MigrationType, Migrator};

/// Name and SQL of every step. A step that has ever run must not be changed: its hash is kept in the database.
const STEPS: [(&str, &str); 11] = [
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
    use super::*;

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
