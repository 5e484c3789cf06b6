//! In place of `vehicle_types` in a build without vehicles: there are none.

use super::format::scene::Scene;
use crate::problem::Problem;
use bevy_ecs::prelude::*;
use std::path::{Path, PathBuf};
use systems::assets::Library;
use systems::describe::Fault;

/// None.
#[derive(Default)]
pub struct Types;

/// Contents of a scene's files of types.
#[derive(Default)]
pub struct Loaded {
    pub types: Types,
    pub warnings: Vec<String>,
    pub files: Vec<PathBuf>,
}

pub fn read_types(_: &Scene, _: &Path, _: &mut Library, _: &mut Vec<Fault>) -> Loaded {
    Loaded::default()
}

pub fn check_types(_: &Path) -> Option<Vec<Problem>> {
    None
}

pub fn add_types(_: &Types, _: &mut World) {}
