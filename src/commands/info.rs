//! `relief info`.

use crate::commands::common::failure::{Failure, say};
use crate::renderer::Gpu;

pub fn run() -> Result<(), Failure> {
    Ok(say(Gpu::headless()?.describe().trim_end())?)
}
