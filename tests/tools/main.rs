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
mod specular_aa;
