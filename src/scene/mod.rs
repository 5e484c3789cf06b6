//! Scene files: text into entities.
//!
//! Folders are floors, each uses those above it:
//!
//! ```text
//! text/           reading RON; places in a text, and faults there
//! format/         the file as serde reads it (RON; docs/scenes.md), and what each of it is as a component
//! read/           what a file names: images, models, rigs, fields of a program; places that count from an origin
//! check/          names and numbers: every fault at once
//! vehicle_types/  types of vehicles from files of their own
//! spawn/          a checked scene becomes entities
//! prepare, prepared  all of these in order; the scene that comes out, and its worlds
//! schema          JSON schemas of files
//! template        a scene that is read once, and of which any number of worlds are made
//! ```
//!
//! Nothing is spawned before everything has been read and checked, so that a scene that fails leaves the world as it
//! was.

mod check;
#[cfg(all(test, feature = "physics"))]
mod docs_tables_test;
#[cfg(test)]
mod docs_test;
mod error;
mod format;
mod prepare;
mod prepared;
mod read;
mod schema;
mod spawn;
mod template;
mod text;
#[cfg(feature = "vehicles")]
mod vehicle_types;
#[cfg(not(feature = "vehicles"))]
#[path = "no_vehicle_types.rs"]
mod vehicle_types;

pub use error::SceneError;
pub(crate) use format::sensors::read_with_rate;
pub use format::weather::preset as weather_preset;
pub use prepared::LoadedScene;
pub use read::custom_fields::{EntityField, SceneField, SceneFields};
pub use read::overrides::Overrides;
pub use schema::{SCHEMAS, SchemaOf};
#[cfg(feature = "tools")]
pub(crate) use spawn::random::Random;
pub use template::Template;
#[cfg(feature = "vehicles")]
pub use vehicle_types::load_vehicle_types;

use crate::import;
use crate::problem::Problem;
use bevy_ecs::prelude::*;
use prepare::{import_problem, is_model, prepare};
use std::path::Path;
use systems::Simulation;
use systems::assets::Library;

/// Loads a scene file (`.ron`), or a glTF file (`.gltf`, `.glb`) as a whole scene, into the world.
///
/// The scene's environment and clock replace the world's. Fields that the program adds are those of the world's
/// [`SceneFields`]. A glTF file without lights gets a neutral rig. A scene without a camera gets one that sees
/// everything.
pub fn load(path: &Path, simulation: &mut Simulation) -> Result<LoadedScene, SceneError> {
    load_seeded(path, None, simulation)
}

/// [`load`] with another seed than the scene's own, in all that is random in it but generators with seeds of their own.
///
/// # Errors
/// Those of [`load`].
pub fn load_seeded(path: &Path, seed: Option<u64>, simulation: &mut Simulation) -> Result<LoadedScene, SceneError> {
    let world = &mut simulation.world;
    let fields = world.get_resource::<SceneFields>().cloned().unwrap_or_default();
    let prepared = world.resource_scope(|_, mut library: Mut<Library>| {
        let before = library.revisions();
        prepare(path, &fields, &Overrides::default(), &mut library).inspect_err(|_| library.take_back(before))
    })?;
    Ok(prepared.instantiate(path, seed, simulation))
}

/// A library with the meshes, materials and images that [`load`] adds to it, under the same ids, without a world.
///
/// # Errors
/// Those of [`load`].
pub fn load_library(path: &Path, fields: &SceneFields, mut library: Library) -> Result<Library, SceneError> {
    prepare(path, fields, &Overrides::default(), &mut library)?;
    Ok(library)
}

/// Everything wrong with a scene file (or a glTF file as one). Empty: nothing is. `simulation` makes what scenes are
/// loaded into: `Simulation::new`, or a program's own, with its [`SceneFields`].
pub fn check(path: &Path, simulation: fn() -> Simulation) -> Vec<Problem> {
    if is_model(path) {
        return import::check_model(path).into_iter().map(|p| import_problem(path, p)).collect();
    }
    if let Some(problems) = vehicle_types::check_types(path) {
        return problems;
    }
    // Into a world of its own: some of it shows only there.
    let mut simulation = simulation();
    let fields = simulation.world.get_resource::<SceneFields>().cloned().unwrap_or_default();
    if let Some(problems) = check::rigs::check(path, &fields) {
        return problems;
    }
    match load(path, &mut simulation) {
        Ok(mut loaded) => {
            loaded.warnings.append(&mut loaded.doubts);
            loaded.warnings.extend(spawn::cells::shared_sheets(&mut simulation));
            loaded.warnings.into_iter().map(|message| Problem::warning(path, message)).collect()
        }
        Err(error) => error.problems,
    }
}
