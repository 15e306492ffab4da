//! Memory check of a job, made before it is accepted, for no later check could save the process.

use std::sync::OnceLock;

use sysinfo::{MemoryRefreshKind, ProcessRefreshKind, ProcessesToUpdate, RefreshKind, System};

use super::prepare::RenderJob;
use crate::document::{DocumentErrors, FieldError};
use crate::plan::MemoryEstimate;

/// Fraction of the machine's memory that one job may take unless the configuration says otherwise: three quarters.
const SHARE: (u64, u64) = (3, 4);

/// Returns the number of bytes that one job may take where nothing is configured: three quarters of the machine's memory, or of what a
/// container, a unit of systemd or a resource limit (`ulimit -v`, `ulimit -d`) leaves of it to this process.
pub fn default_limit_bytes() -> u64 {
    static LIMIT: OnceLock<u64> = OnceLock::new();
    *LIMIT.get_or_init(|| available_bytes() / SHARE.1 * SHARE.0)
}

fn available_bytes() -> u64 {
    let memory = RefreshKind::nothing().with_memory(MemoryRefreshKind::nothing().with_ram());
    // where the machine does not say what it has, only limits count
    let system = System::new_with_specifics(memory).ok();
    let machine = system.as_ref().map(System::total_memory);
    let container = system.as_ref().and_then(System::cgroup_limits).map(|limits| limits.total_memory);
    // that of a systemd unit stands below the root of the groups
    let own = system.and_then(|mut system| {
        let process = sysinfo::get_current_pid().ok()?;
        system.refresh_processes_specifics(ProcessesToUpdate::Some(&[process]), false, ProcessRefreshKind::nothing());
        Some(system.process(process)?.cgroup_limits()?.total_memory)
    });
    let of = |resource: rlimit::Resource| resource.get_soft().ok();
    let limits = [machine, container, own, of(rlimit::Resource::AS), of(rlimit::Resource::DATA)];
    limits.into_iter().flatten().filter(|bytes| *bytes > 0).fold(u64::MAX, u64::min)
}

impl RenderJob {
    /// Estimates the memory that the job takes at its peak, beside the program itself.
    pub fn memory(&self) -> MemoryEstimate {
        crate::plan::memory::estimate(&self.scene, &self.traceable, &self.plan)
    }

    /// Refuses a job that would take more than `limit_bytes`; the error names the part that takes most.
    pub fn check_memory(&self, limit_bytes: u64) -> Result<(), DocumentErrors> {
        let memory = self.memory();
        if memory.total() <= limit_bytes as f64 {
            return Ok(());
        }
        let MemoryEstimate { grids, views, working, meshes } = memory;
        let parts = [
            ("/grids", "grids", grids),
            ("/views", "views", views),
            ("/method", "photons and solvers", working),
            ("/room/objects", "meshes", meshes),
        ];
        let (pointer, ..) = parts.into_iter().max_by(|a, b| a.2.total_cmp(&b.2)).unwrap_or(("", "", 0.0));
        let each = parts.map(|(_, name, bytes)| format!("{name} {}", gigabytes(bytes))).join(", ");
        let detail = format!(
            "the job would take about {} of memory ({each}), but the limit is {}: make its largest part smaller",
            gigabytes(memory.total()),
            gigabytes(limit_bytes as f64)
        );
        Err(FieldError::new(pointer, detail).into())
    }
}

fn gigabytes(bytes: f64) -> String {
    format!("{:.2} GB", bytes / 1e9)
}
