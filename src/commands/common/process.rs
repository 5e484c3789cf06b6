//! The process that a command runs in.

use std::ffi::OsString;
use std::process::Command;
use std::time::Instant;

/// The process that a command runs in.
pub struct Process {
    /// When it started.
    pub started: Instant,
    /// The command that starts it anew, before its arguments: a program, and what always follows it. Where it is empty,
    /// nothing is done in processes of its own.
    pub command: Vec<OsString>,
}

impl Process {
    /// The same again, without arguments.
    pub(crate) fn anew(&self) -> Option<Command> {
        let (program, more) = self.command.split_first()?;
        let mut command = Command::new(program);
        command.args(more);
        Some(command)
    }
}
