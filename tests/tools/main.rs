//! Tools that measure and compare, and those that make maps.

mod bench;
#[path = "../common/mod.rs"]
mod common;
mod compare_techniques;
mod gallery;
mod light_error;
mod map_bake;
mod map_bake_files;
mod map_oracle;
mod map_tile;
mod map_tools;
mod maps;
#[path = "../common/models.rs"]
mod models;
mod shadow_truth;
mod sky_error;
mod specular_aa;

use crate::common::prelude::*;
use relief::tools::frame_error::FrameErrorJob;

/// Error of a scene's first frame, seen by its first camera.
fn frame_job(scene: &Path, folder: &Path, size: (u32, u32)) -> FrameErrorJob {
    FrameErrorJob {
        load: LoadOptions::for_one_renderer(),
        scene: scene.to_owned(),
        folder: folder.to_owned(),
        frame: 0,
        size,
        camera: None,
        technique: None,
    }
}
