//! Steps and edits: the state of a world and its weather, the records of what is drawn, and frames between steps.

mod interpolation;
mod records;
mod state;
mod weather;

use bevy_ecs::prelude::*;
use glam::{Quat, Vec3};
use proptest::prelude::*;
use systems::Simulation;
use systems::assets::{Library, Material, MaterialId, MeshId, shapes};
use systems::lights::Light;
use systems::space::{Hidden, Interpolation, Transform};
