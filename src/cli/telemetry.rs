//! The log: lines on standard error, for people or for programs.

use std::io::IsTerminal;

use serde::{Deserialize, Serialize};
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::SubscriberExt as _;
use tracing_subscriber::util::SubscriberInitExt as _;
use tracing_subscriber::{fmt, registry};

/// Level and format of the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Log {
    /// Least severe lines that are written.
    pub level: LogLevel,
    /// Format of the lines.
    pub format: LogFormat,
}

/// Severity from which on lines are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LogLevel {
    /// Failures.
    Error,
    /// Beside failures: what may become one.
    Warn,
    /// Beside warnings: the start and the end of the service and of every job.
    Info,
    /// Beside that: every request.
    Debug,
    /// Everything.
    Trace,
}

/// Formats of the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LogFormat {
    /// Lines for people.
    Text,
    /// One JSON object per line.
    Json,
}

/// Log of commands that end by themselves: their results are on standard output, the log is for what went wrong.
pub const OF_COMMANDS: Log = Log { level: LogLevel::Warn, format: LogFormat::Text };

impl LogLevel {
    /// Filter in the syntax of `RUST_LOG`: levels of targets. Libraries log at `info` at most: their lines below that would
    /// bury ours.
    fn directives(self) -> &'static str {
        match self {
            Self::Error => "error",
            Self::Warn => "warn",
            Self::Info => "info",
            Self::Debug => "info,skyduct=debug,tower_http=debug",
            Self::Trace => "info,skyduct=trace,tower_http=trace",
        }
    }
}

/// Writes the log from now on; the first call in a process counts. `RUST_LOG`, when it is set and can be read, says what
/// is logged instead of `log.level`.
pub fn start(log: &Log) {
    let asked = std::env::var("RUST_LOG").ok().filter(|directives| !directives.is_empty());
    let asked = asked.and_then(|directives| directives.parse::<Targets>().ok());
    let filter = asked.or_else(|| log.level.directives().parse().ok()).unwrap_or_default();
    let lines = fmt::layer().with_writer(std::io::stderr);
    let started = match log.format {
        LogFormat::Text => registry().with(filter).with(lines.with_ansi(coloured())).try_init(),
        LogFormat::Json => registry().with(filter).with(lines.json().flatten_event(true)).try_init(),
    };
    // an error means that the process has a log already
    let _ = started;
}

/// Colours are for people, who can decline them (<https://no-color.org>).
fn coloured() -> bool {
    std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_level_can_be_read() {
        for level in [LogLevel::Error, LogLevel::Warn, LogLevel::Info, LogLevel::Debug, LogLevel::Trace] {
            assert!(level.directives().parse::<Targets>().is_ok(), "{level:?}");
        }
    }
}
