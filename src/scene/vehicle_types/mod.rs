//! Types of vehicles from files: text, and the models that it names, into [`VehicleTypes`].
//!
//! ```text
//! format        the file as serde reads it (RON; docs/vehicles.md)
//! check         names of nodes, numbers: every fault at once, with line and column
//! assemble      a model's nodes into the parts of a type
//! placed_model  what a model draws at its nodes
//! outline       what is drawn at a wheel's node, seen along its axle: hub and radius
//! wheels        which nodes are one wheel
//! lamps         which way lamps shine
//! ```

pub(super) mod assemble;
mod check;
pub(super) mod format;
mod lamps;
mod outline;
mod placed_model;
mod wheels;

use super::{SceneError, parse, placed, read_text, slip_problem};
use crate::import::{self, Model};
use crate::problem::Problem;
use crate::scene::faults::{Fault, Trail};
use crate::scene::places::Step;
use bevy_ecs::prelude::*;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use systems::Simulation;
use systems::assets::Library;
use systems::vehicles::{VehicleType, VehicleTypes};

/// Types that were read, and what a person should know of them.
#[derive(Default)]
pub(super) struct Loaded {
    pub types: Vec<VehicleType>,
    pub warnings: Vec<String>,
    /// What was read.
    pub files: Vec<PathBuf>,
}

impl Loaded {
    /// Notes the types of another file that take the place of one of the same name.
    pub fn warn_of_replaced(&mut self, file: &str, other: &Self) {
        for name in other.types.iter().map(|new| &new.name) {
            if self.types.iter().any(|known| known.name == *name) {
                let warning = format!("{file}: {name:?} replaces the vehicle type of that name in an earlier file");
                self.warnings.push(warning);
            }
        }
    }

    pub fn extend(&mut self, other: Self) {
        self.types.extend(other.types);
        self.warnings.extend(other.warnings);
        self.files.extend(other.files);
    }
}

/// Whether a file holds types of vehicles and not a scene: `vehicles.ron`, or anything that ends in `.vehicles.ron`.
pub(super) fn is_file_of_types(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    name == "vehicles.ron" || name.ends_with(".vehicles.ron")
}

/// Adds the types of a file (`vehicles.ron`) to the world; returns warnings.
///
/// # Errors
/// Everything that is wrong with the file and the models it names; then nothing is added.
pub fn load_vehicle_types(path: &Path, simulation: &mut Simulation) -> Result<Vec<String>, SceneError> {
    let world = &mut simulation.world;
    let loaded = world.resource_scope(|_, mut library: Mut<Library>| {
        let before = library.revisions();
        read(path, &mut library).inspect_err(|_| library.take_back(before))
    });
    let Loaded { types, warnings, .. } = loaded.map_err(|problems| SceneError { problems })?;
    let mut all = world.resource_mut::<VehicleTypes>();
    types.into_iter().for_each(|vehicle_type| _ = all.add(vehicle_type));
    Ok(warnings)
}

/// Reads a file and its models into the library.
pub(super) fn read(path: &Path, library: &mut Library) -> Result<Loaded, Vec<Problem>> {
    let text = read_text(path).map_err(|problem| vec![problem])?;
    let source = parse::<format::VehicleTypes>(&text);
    let source = source.map_err(|slip| vec![slip_problem(path, slip)])?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let (models, mut faults) = read_models(&source, folder, library);
    faults.extend(check::faults(&source, &models, library));
    if !faults.is_empty() {
        return Err(placed(faults, path, &text));
    }
    let mut loaded = Loaded { files: vec![path.to_owned()], ..Loaded::default() };
    let named = source.types.entries().iter().map(|(_, vehicle_type)| folder.join(&vehicle_type.model));
    loaded.files.extend(named);
    for (name, source) in source.types.entries() {
        let Some(model) = models.get(&source.model) else { continue };
        loaded.types.push(assemble::assemble(name, source, model, library, &mut loaded.warnings));
    }
    loaded.warnings.extend(models.values().flat_map(|model| &model.warnings).map(ToString::to_string));
    loaded.warnings.sort();
    Ok(loaded)
}

/// The models that the types name, each read once.
fn read_models(
    source: &format::VehicleTypes,
    folder: &Path,
    library: &mut Library,
) -> (HashMap<String, Model>, Vec<Fault>) {
    let mut wanted: Vec<(&str, Trail)> = Vec::new();
    for (i, (name, vehicle_type)) in source.types.entries().iter().enumerate() {
        if !wanted.iter().any(|(file, _)| *file == vehicle_type.model) {
            let at = Trail::default().field("types").enter(Step::Entry(i), name).field("model");
            wanted.push((&vehicle_type.model, at));
        }
    }
    let paths: Vec<PathBuf> = wanted.iter().map(|(file, _)| folder.join(file)).collect();
    let (mut models, mut faults) = (HashMap::new(), Vec::new());
    for ((file, at), model) in wanted.into_iter().zip(import::load_models(&paths, folder, library)) {
        match model {
            Ok(model) => _ = models.insert(file.to_owned(), model),
            Err(error) => faults.push(at.fault(error)),
        }
    }
    (models, faults)
}
