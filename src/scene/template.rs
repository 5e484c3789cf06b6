//! A scene that is read once, and of which any number of worlds are made.
//!
//! Worlds share its meshes and images: each has a clone of the template's [`Library`], whose items are copied where a
//! world changes them, and no sooner.

use super::error::SceneError;
use super::prepare::prepare;
use super::prepared::{Content, LoadedScene, Prepared};
use super::read::custom_fields::SceneFields;
use super::read::overrides::Overrides;
use crate::import::cache::Cache;
use crate::import::lattices::keep_lattices;
use crate::import::meshes::finish_meshes;
use std::fmt;
use std::path::{Path, PathBuf};
use systems::Simulation;
use systems::assets::{Library, MeshEntry};
use systems::ecs::parallel::in_parallel;

/// A scene in memory.
pub struct Template {
    path: PathBuf,
    overrides: Overrides,
    prepared: Prepared,
    /// With tangents and levels of all meshes, lest each world makes them.
    library: Library,
}

impl Template {
    /// Reads a scene file, or a glTF file as one.
    ///
    /// # Errors
    /// [`SceneError`]: everything that is wrong with it.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        Self::load_with(path, &Overrides::default())
    }

    /// [`Self::load`] with other fields than the scene's own.
    ///
    /// # Errors
    /// The same as [`Self::load`].
    pub fn load_with(path: &Path, overrides: &Overrides) -> Result<Self, SceneError> {
        let mut library = Simulation::new().world.remove_resource::<Library>().unwrap_or_default();
        let prepared = prepare(path, &SceneFields::default(), overrides, &mut library)?;
        if let Some(cache) = Cache::of_user() {
            finish_meshes(&mut library, &cache);
            cache.trim();
        }
        let template = Self { path: path.to_owned(), overrides: overrides.clone(), prepared, library };
        // Spawning cuts large meshes into pieces, which later worlds find in their library.
        let (mut first, _) = template.instantiate(None);
        let mut library = first.world.remove_resource::<Library>().unwrap_or_default();
        let unfinished: Vec<&mut MeshEntry> = library.unfinished_meshes().collect();
        in_parallel(unfinished.into_iter(), MeshEntry::finish);
        Ok(Self { library, ..template })
    }

    /// A world of the scene, as it begins. A `seed` takes the place of the scene's own, in all that is random in it but
    /// generators with seeds of their own.
    pub fn instantiate(&self, seed: Option<u64>) -> (Simulation, LoadedScene) {
        let mut simulation = Simulation::new();
        simulation.world.insert_resource(self.library.clone());
        keep_lattices(&mut simulation.world);
        let loaded = self.prepared.instantiate(&self.path, seed, &mut simulation);
        (simulation, loaded)
    }

    /// The file that it was read from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Fields in the place of the scene's own.
    pub fn overrides(&self) -> &Overrides {
        &self.overrides
    }

    /// The scene's own seed.
    pub fn seed(&self) -> u64 {
        match &self.prepared.content {
            Content::Scene(scene, ..) => scene.seed,
            Content::Model(_) => 0,
        }
    }

    /// The scene's file and those that it names, in the order of reading; not what models name in turn.
    pub fn files(&self) -> &[PathBuf] {
        &self.prepared.files
    }
}

impl fmt::Debug for Template {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("Template").field("path", &self.path).finish_non_exhaustive()
    }
}
