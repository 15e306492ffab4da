//! Stores of jobs in databases, and the only place with queries. There is one, on SQLite.

mod sqlite;

use std::path::Path;
use std::sync::Arc;

pub use self::sqlite::SqliteStore;
pub(crate) use self::sqlite::backup;
use crate::queue::store::{Store, StoreError};

/// Opens the store in a file, or creates it.
pub async fn open(file: &Path) -> Result<Arc<dyn Store>, StoreError> {
    Ok(Arc::new(SqliteStore::open(file).await?))
}
