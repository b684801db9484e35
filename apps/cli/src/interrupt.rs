//! Ctrl-C and the time limit: one question, asked between two steps of work.

use ondelette_io::write::remove_unfinished;
use std::fmt;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// Exit code of a program ended by Ctrl-C (128 + SIGINT).
const ABORTED: i32 = 130;

static SIGNALS: AtomicU32 = AtomicU32::new(0);

/// Why the work stopped early.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reason {
    /// The first Ctrl-C.
    Signal,
    /// `--max-time` is over.
    Time,
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Reason::Signal => "ctrl-c",
            Reason::Time => "max-time",
        })
    }
}

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stop {
    deadline: Option<Instant>,
}

impl Stop {
    /// Counts Ctrl-C from now on; the second one clears `folders` of unfinished files and ends the program.
    pub(crate) fn new(limit: Option<Duration>, folders: Vec<PathBuf>) -> Result<Self, String> {
        ctrlc::set_handler(move || {
            if SIGNALS.fetch_add(1, Ordering::SeqCst) > 0 {
                folders.iter().for_each(|folder| remove_unfinished(folder));
                std::process::exit(ABORTED);
            }
        })
        .map_err(|e| format!("cannot listen for Ctrl-C: {e}"))?;
        // a limit beyond the clock's range is no limit
        Ok(Stop { deadline: limit.and_then(|limit| Instant::now().checked_add(limit)) })
    }

    /// Whether to stop, and why.
    pub(crate) fn asked(self) -> Option<Reason> {
        if self.signalled() {
            return Some(Reason::Signal);
        }
        self.deadline.filter(|&deadline| Instant::now() >= deadline).map(|_| Reason::Time)
    }

    /// Whether there was a Ctrl-C.
    pub(crate) fn signalled(self) -> bool {
        SIGNALS.load(Ordering::SeqCst) > 0
    }
}
