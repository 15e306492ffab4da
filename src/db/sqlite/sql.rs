//! Parts of all statements: whose rows they see, the database's clock, and the meaning of its errors.

use std::time::Duration;

use sqlx::query::Query;
use sqlx::sqlite::{SqliteArguments, SqliteRow};
use sqlx::{Decode, Row, Sqlite, SqliteExecutor, Type};

use crate::queue::owner::Owner;
use crate::queue::store::{Lease, StoreError};

/// Statement with its bound values.
pub(super) type Statement<'q> = Query<'q, Sqlite, SqliteArguments>;

/// Runs a statement, and reads its row if it has one.
pub(super) async fn one<T>(
    statement: Statement<'_>,
    database: impl SqliteExecutor<'_>,
    read: impl Fn(&SqliteRow) -> Result<T, StoreError>,
) -> Result<Option<T>, StoreError> {
    statement.fetch_optional(database).await.map_err(store_error)?.as_ref().map(read).transpose()
}

/// Runs a statement, and reads all of its rows.
pub(super) async fn all<T>(
    statement: Statement<'_>,
    database: impl SqliteExecutor<'_>,
    read: impl Fn(&SqliteRow) -> Result<T, StoreError>,
) -> Result<Vec<T>, StoreError> {
    statement.fetch_all(database).await.map_err(store_error)?.iter().map(read).collect()
}

/// Runs a statement that counts, and returns the number.
pub(super) async fn count_of(statement: Statement<'_>, database: impl SqliteExecutor<'_>) -> Result<u64, StoreError> {
    let counted: Option<i64> = one(statement, database, first).await?;
    Ok(counted.map_or(0, i64::unsigned_abs))
}

/// Reads the first column of a row.
pub(super) fn first<T: for<'r> Decode<'r, Sqlite> + Type<Sqlite>>(row: &SqliteRow) -> Result<T, StoreError> {
    row.try_get(0).map_err(store_error)
}

/// Runs a statement, and returns the number of rows that it has changed.
pub(super) async fn run(statement: Statement<'_>, database: impl SqliteExecutor<'_>) -> Result<u64, StoreError> {
    Ok(statement.execute(database).await.map_err(store_error)?.rows_affected())
}

/// Owner whose rows a statement may see; `None` for all, as the worker, the retention and the start of the service see them.
pub(super) type Scope<'a> = Option<&'a Owner>;

/// SQL condition for the rows of the owner $2, or of all where it is null.
macro_rules! in_scope {
    () => {
        "owner = coalesce($2, owner)"
    };
}
pub(crate) use in_scope;

/// SQL condition for the rows that belong to the job $1, if it is in the scope $2.
macro_rules! of_job_in_scope {
    () => {
        "job_id = (SELECT id FROM jobs WHERE id = $1 AND owner = coalesce($2, owner))"
    };
}
pub(crate) use of_job_in_scope;

/// SQL condition for the chunk of a lease, whose values [`of_lease`] binds to $1 to $4; false once the lease is lost.
macro_rules! held {
    () => {
        "job_id = $1 AND idx = $2 AND owner = $3 AND attempt = $4 AND state = 'leased'"
    };
}
pub(crate) use held;

/// Makes a statement with the condition `held!`.
pub(super) fn of_lease<'q>(sql: &'static str, lease: &'q Lease) -> Statement<'q> {
    sqlx::query(sql).bind(lease.job.to_string()).bind(signed(lease.chunk)).bind(&lease.owner).bind(lease.attempt)
}

/// SQL expression for the milliseconds since 1970 by the database's clock, the only clock with which leases are compared.
macro_rules! now_ms {
    () => {
        "CAST(unixepoch('subsec') * 1000 AS INTEGER)"
    };
}
pub(crate) use now_ms;

/// SQL condition that the job of a chunk `c` does not wait for an equal job of its owner that is running and whose results it will take.
macro_rules! waits_for_none {
    () => {
        "NOT EXISTS (SELECT 1 FROM jobs j JOIN jobs e ON e.computation = j.computation AND e.status = 'running' \
         AND e.owner = j.owner WHERE j.id = c.job_id AND j.status = 'queued' AND e.cancel = 0)"
    };
}
pub(crate) use waits_for_none;

/// Returns the value of $2 in statements with a scope.
pub(super) fn bound(scope: Scope<'_>) -> Option<&str> {
    scope.map(Owner::name)
}

/// Converts a count for a column, which is signed; counts never come near 2^63.
pub(super) fn signed(value: u64) -> i64 {
    i64::try_from(value).unwrap_or(i64::MAX)
}

/// Returns a duration in the unit of the database's clock.
pub(super) fn milliseconds(duration: Duration) -> i64 {
    i64::try_from(duration.as_millis()).unwrap_or(i64::MAX)
}

/// Converts an error of the database: unavailable if it may pass when tried again, failed if not.
pub(super) fn store_error(error: sqlx::Error) -> StoreError {
    let unavailable = match &error {
        sqlx::Error::PoolTimedOut | sqlx::Error::PoolClosed | sqlx::Error::Io(_) => true,
        // the connection is of no use, the next one may be
        sqlx::Error::WorkerCrashed | sqlx::Error::InvalidSavePointStatement | sqlx::Error::BeginFailed => true,
        // SQLITE_BUSY, SQLITE_LOCKED, SQLITE_NOMEM, SQLITE_READONLY, SQLITE_IOERR, SQLITE_FULL, SQLITE_CANTOPEN; the low
        // byte is the primary code
        sqlx::Error::Database(database) => database
            .code()
            .and_then(|code| code.parse::<u32>().ok())
            .is_some_and(|code| matches!(code & 0xff, 5..=8 | 10 | 13 | 14)),
        _ => false,
    };
    if unavailable { StoreError::Unavailable(error.to_string()) } else { StoreError::Failed(error.to_string()) }
}
