//! Log: lines on standard error, as text for people or as JSON for programs.

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
    /// Failures, and warnings of what may become one.
    Warn,
    /// Warnings, and the start and the end of the service and of every job.
    Info,
    /// Every request, beside the lines of `Info`.
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

/// Log of all commands but the service: warnings and errors only, because results go to standard output.
pub const OF_COMMANDS: Log = Log { level: LogLevel::Warn, format: LogFormat::Text };

impl LogLevel {
    /// Returns the filter in the syntax of `RUST_LOG`: levels of targets. Libraries log at `info` at most, because their lines
    /// below that would bury those of skyduct.
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

/// Starts the log; only the first call in a process has an effect. `RUST_LOG`, if it is set and valid, replaces `log.level`.
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

/// True if the log is coloured: on a terminal, unless `NO_COLOR` is set (<https://no-color.org>).
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
