//! Types of vehicles from files: text, and the models that it names, into [`VehicleTypes`].
//! Uses `text`, `format`, `read` and `check`.
//!
//! ```text
//! check         names of nodes, numbers: every fault at once, with line and column
//! roles         the nodes that a type names
//! assemble      a model's nodes into the parts of a type
//! placed_model  what a model draws at its nodes
//! outline       what is drawn at a wheel's node, seen along its axle: hub and radius
//! wheels        which nodes are one wheel
//! lamps         which way lamps shine
//! ```

mod assemble;
mod check;
mod lamps;
mod outline;
mod placed_model;
mod roles;
mod wheels;

use super::error::SceneError;
use super::format::scene::Scene;
use super::format::vehicle_types as format;
use super::text::file::{placed, read_text, slip_problem};
use super::text::parse::parse;
use crate::import::{self, Model};
use crate::problem::Problem;
use bevy_ecs::prelude::*;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use systems::Simulation;
use systems::assets::Library;
use systems::describe::Step;
use systems::describe::{Fault, Trail};
use systems::vehicles::{VehicleType, VehicleTypes};

/// The types of a scene's files.
pub type Types = Vec<VehicleType>;

/// Types that were read, and what a person should know of them.
#[derive(Default)]
pub struct Loaded {
    pub types: Vec<VehicleType>,
    pub warnings: Vec<String>,
    /// Files that were read.
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

/// Tells if a file holds types of vehicles and not a scene: `vehicles.ron`, or anything that ends in `.vehicles.ron`.
fn is_file_of_types(path: &Path) -> bool {
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

/// Reads the files of types that a scene names.
pub fn read_types(scene: &Scene, folder: &Path, library: &mut Library, faults: &mut Vec<Fault>) -> Loaded {
    let mut vehicles = Loaded::default();
    for (i, file) in scene.vehicle_types.iter().enumerate() {
        match read(&folder.join(file), library) {
            Ok(loaded) => {
                vehicles.warn_of_replaced(file, &loaded);
                vehicles.extend(loaded);
            }
            Err(problems) => {
                let at = Trail::default().field("vehicle_types").enter(Step::Index(i), "");
                faults.extend(problems.into_iter().map(|problem| at.fault(problem)));
            }
        }
    }
    vehicles
}

/// Problems of a file, if it is one of types.
pub fn check_types(path: &Path) -> Option<Vec<Problem>> {
    is_file_of_types(path).then(|| match read(path, &mut Library::default()) {
        Ok(loaded) => loaded.warnings.into_iter().map(|message| Problem::warning(path, message)).collect(),
        Err(problems) => problems,
    })
}

/// Adds types to those of the world.
pub fn add_types(types: &Types, world: &mut World) {
    let mut all = world.resource_mut::<VehicleTypes>();
    types.iter().for_each(|vehicle_type| _ = all.add(vehicle_type.clone()));
}

/// Reads a file and its models into the library.
fn read(path: &Path, library: &mut Library) -> Result<Loaded, Vec<Problem>> {
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
