//! `relief schema`.

use crate::commands::common::arguments::named;
use crate::commands::common::failure::{Failure, say};
use crate::scene::{SCHEMAS, SchemaOf};
use clap::Args;

#[derive(Args)]
pub struct SchemaArgs {
    /// Kind of file: scene, rig, vehicle-type
    #[arg(value_name = "KIND", default_value = "scene", value_parser = named("kind of file", SCHEMAS))]
    schema: SchemaOf,
}

pub fn run(args: &SchemaArgs) -> Result<(), Failure> {
    Ok(say(&format!("{:#}", (args.schema)()))?)
}
