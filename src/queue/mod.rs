//! The queue of jobs: the traits that the store implements, the artifacts, and the worker that claims chunks and renders them.

pub mod ahead;
pub(crate) mod artifacts;
pub(crate) mod backup;
pub mod computation;
pub(crate) mod deletion;
pub mod durability;
pub mod events;
pub(crate) mod file_lock;
pub(crate) mod files;
pub mod job_sets;
pub(crate) mod live;
pub(crate) mod local_files;
pub mod new_members;
pub mod owner;
pub(crate) mod ownership;
pub(crate) mod private_folder;
pub mod records;
pub mod retention;
pub mod shared_fields;
pub mod store;
pub(crate) mod to_its_end;
pub(crate) mod uploaded_files;
pub(crate) mod uploads;
pub(crate) mod worker;
