//! Stores of jobs in databases, and the only place with queries. There is one, on SQLite.

mod sqlite;

pub use self::sqlite::SqliteStore;
pub(crate) use self::sqlite::backup;
