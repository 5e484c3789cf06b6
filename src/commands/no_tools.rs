//! Stands in for the commands of the feature `tools` where the program is built without it: each says so.

use crate::commands::common::failure::Failure;
use crate::commands::common::process::Process;
use clap::{Args, Subcommand};
use std::ffi::OsString;

/// Any arguments, which nothing reads.
#[derive(Args)]
#[command(disable_help_flag = true)]
pub struct AnyArgs {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    arguments: Vec<OsString>,
}

#[derive(Subcommand)]
pub enum Tool {
    /// Not built in: needs the feature "tools"
    Lights(AnyArgs),
    /// Not built in: needs the feature "tools"
    Shadows(AnyArgs),
    /// Not built in: needs the feature "tools"
    Gallery(AnyArgs),
    /// Not built in: needs the feature "tools"
    Compare(AnyArgs),
    /// Not built in: needs the feature "tools"
    Bench(AnyArgs),
    /// Not built in: needs the feature "tools"
    Map(AnyArgs),
}

impl Tool {
    /// Refuses it by name.
    pub fn run(self, _process: &Process) -> Result<(), Failure> {
        let (name, AnyArgs { arguments: _ }) = match self {
            Self::Lights(args) => ("lights", args),
            Self::Shadows(args) => ("shadows", args),
            Self::Gallery(args) => ("gallery", args),
            Self::Compare(args) => ("compare", args),
            Self::Bench(args) => ("bench", args),
            Self::Map(args) => ("map", args),
        };
        Err(Failure::bad_input(format!(
            "relief {name}: not built in, as this program was built without the feature \"tools\"; cargo build --release \
             builds all of it"
        )))
    }
}
