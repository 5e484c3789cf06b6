//! `relief check`.

use crate::check;
use crate::commands::common::failure::{Failure, say};
use clap::Args;
use std::path::PathBuf;
use systems::Simulation;

#[derive(Args)]
pub struct CheckArgs {
    /// Scenes (.ron), models (.gltf, .glb), images
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
}

pub fn run(args: &CheckArgs) -> Result<(), Failure> {
    let mut errors = 0;
    for file in &args.files {
        let problems = check::check(file, Simulation::new);
        errors += problems.iter().filter(|problem| problem.is_error()).count();
        problems.iter().try_for_each(|problem| say(&problem.to_string()))?;
        if problems.is_empty() {
            say(&format!("{}: ok", file.display()))?;
        }
    }
    if errors == 0 { Ok(()) } else { Err(Failure::said()) }
}
