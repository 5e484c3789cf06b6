//! Arguments and messages that several commands share.
//!
//! ```text
//! arguments  how values of options are read;  view: options of several commands
//! progress   bars on a terminal
//! failure    messages and exit codes
//! process    the process that a command runs in
//! display    a command without a window asks no display for anything
//! log        warnings and errors on standard error
//! ```

pub mod arguments;
pub mod display;
pub mod failure;
pub mod log;
pub mod process;
pub mod progress;
pub mod view;
