//! Doing it.

mod constraints;
pub(crate) mod design;
pub(crate) mod edit;
pub(crate) mod fit;
pub(crate) mod info;
mod intrinsic;
pub(crate) mod light;
pub(crate) mod probe;
pub(crate) mod relight;
mod shape_input;
mod shape_output;
mod stiffness;
pub(crate) mod verify;

use ondelette_io::ReadError;
use ondelette_io::onl::OnlError;
use ondelette_io::write::WriteError;
use ondelette_radiosity::SolveError;
use std::fmt;
use std::io::{self, Write};

/// How a run ended that gave a valid result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// As asked.
    Done,
    /// Stopped early, or the tolerance is missed.
    Unfinished,
}

/// Why nothing was done: one sentence with cause and remedy.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Refusal(String);

impl Refusal {
    pub(crate) fn new(message: impl Into<String>) -> Self {
        Refusal(message.into())
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl From<String> for Refusal {
    fn from(message: String) -> Self {
        Refusal(message)
    }
}

macro_rules! refusal_from {
    ($($error:ty),*) => {$(
        impl From<$error> for Refusal {
            fn from(error: $error) -> Self {
                // what a user's file or system said may hold line ends; a message is one line
                Refusal(error.to_string().split_whitespace().collect::<Vec<_>>().join(" "))
            }
        }
    )*};
}
refusal_from!(ReadError, WriteError, OnlError, SolveError);

/// Says something to the person at the terminal. If nobody listens, the work goes on.
pub(crate) fn tell(message: impl fmt::Display) {
    let _ = writeln!(io::stderr().lock(), "{message}");
}

/// Writes data to standard output. Whoever closes the pipe has seen enough: that is no error.
fn print(text: &str) -> Result<(), Refusal> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => {
            Err(Refusal(format!("cannot write to standard output: {e}")))
        }
        _ => Ok(()),
    }
}
