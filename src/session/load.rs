//! Scenes as they are loaded: costly results from the cache, textures within a bound.

use crate::import::cache::Cache;
use crate::import::compress::{CompressReport, compress_images};
use crate::import::lattices::keep_lattices;
use crate::import::meshes::finish_meshes;
use crate::problem::Problem;
use crate::scene::{self, LoadedScene, SceneError, SceneFields};
use bevy_ecs::prelude::*;
use serde::{Deserialize, Serialize};
use std::any::Any;
use std::path::Path;
use systems::Simulation;
use systems::assets::Library;
use systems::assets::texture_memory::{self, Reduced};
use systems::weather::Weather;

/// Options of loading a scene.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadOptions {
    /// Makes what the scene is loaded into: `Simulation::new`, or a program's own, with its state, inputs, systems and
    /// [`SceneFields`].
    #[serde(skip, default = "no_own_simulation")]
    pub simulation: fn() -> Simulation,
    /// Images are put into blocks (BC7), a quarter of the memory.
    pub compress: bool,
    /// Results that take long to work out are kept on disk ([`crate::import::cache`]).
    pub cache: bool,
    /// Bytes that textures may take on the GPU; above it the largest are drawn smaller.
    pub texture_bytes: u64,
    /// Images keep their texels when a renderer has them ([`Library::keep_texels`]): several renderers need them.
    pub keep_texels: bool,
    /// In the place of the scene's own seed.
    pub seed: Option<u64>,
    /// Weather that a run begins with, by an input, if it is not replayed and begins from no snapshot.
    pub weather: Option<Weather>,
    /// Called as loading begins; what it returns is dropped when the files are read. For a bar that shows
    /// [`crate::import::progress::counts`], say.
    #[serde(skip)]
    pub watch: Option<fn() -> Box<dyn Any>>,
}

fn no_own_simulation() -> fn() -> Simulation {
    Simulation::new
}

impl Default for LoadOptions {
    fn default() -> Self {
        let texture_bytes = texture_memory::DEFAULT_MEGABYTES << 20;
        Self {
            simulation: Simulation::new,
            compress: false,
            cache: true,
            texture_bytes,
            keep_texels: true,
            seed: None,
            weather: None,
            watch: None,
        }
    }
}

impl LoadOptions {
    /// Hands the texels to the first renderer: they are not held twice.
    pub fn for_one_renderer() -> Self {
        Self { keep_texels: false, ..Self::default() }
    }
}

/// Keeps the textures within a bound and says how large they are.
fn limit_textures(simulation: &mut Simulation, most_bytes: u64) {
    let mut library = simulation.world.resource_mut::<Library>();
    let before = texture_memory::used(&library);
    let megabytes = |bytes: u64| bytes.div_ceil(1 << 20);
    tracing::info!(images = before.images, texels = before.texels, "textures: {} MB", megabytes(before.bytes));
    if before.bytes <= most_bytes {
        return;
    }
    let reduced = texture_memory::limit(&mut library, most_bytes);
    let name = |r: &Reduced| {
        let name = library.image(r.image).map_or("", |image| image.name.as_str());
        format!("{name} {}×{} as {}×{}", r.from.0, r.from.1, r.to.0, r.to.1)
    };
    let mut largest = reduced.clone();
    largest.sort_by_key(|r| std::cmp::Reverse(u64::from(r.from.0) * u64::from(r.from.1)));
    let named: Vec<String> = largest.iter().take(3).map(name).collect();
    tracing::warn!(
        "textures reduced from {} MB to {} MB (limit: {} MB): {} are smaller, among them {}",
        megabytes(before.bytes),
        megabytes(texture_memory::used(&library).bytes),
        most_bytes >> 20,
        reduced.len(),
        named.join(", ")
    );
}

/// Works out costly results for meshes and images, or takes them from the cache of an earlier start.
fn work_out(library: &mut Library, options: &LoadOptions) {
    let cache = options.cache.then(Cache::of_user).flatten();
    if let Some(cache) = &cache {
        finish_meshes(library, cache);
    }
    if options.compress {
        let CompressReport { compressed, kept } = compress_images(library, cache.as_ref());
        tracing::info!(compressed, kept, "images in blocks");
    }
    if let Some(cache) = cache {
        let (hits, written) = cache.counts();
        tracing::info!(from_cache = hits, cached = written, "meshes and images");
        if written > 0 {
            cache.trim();
        }
    }
}

/// The world of a scene; warnings are logged.
pub fn world(path: &Path, options: &LoadOptions) -> Result<(Simulation, LoadedScene), SceneError> {
    let mut simulation = (options.simulation)();
    let watch = options.watch.map(|begin| begin());
    let scene = scene::load_seeded(path, options.seed, &mut simulation)?;
    drop(watch);
    work_out(&mut simulation.world.resource_mut::<Library>(), options);
    if options.cache {
        keep_lattices(&mut simulation.world);
    }
    limit_textures(&mut simulation, options.texture_bytes);
    simulation.world.resource_mut::<Library>().keep_texels(options.keep_texels);
    for warning in &scene.warnings {
        tracing::warn!("{warning}");
    }
    Ok((simulation, scene))
}

/// Reads texels again that a renderer has taken: see [`Session::restore_texels`](super::Session::restore_texels).
pub fn restore_texels(scene: &Path, options: &LoadOptions, simulation: &mut Simulation) -> Result<(), SceneError> {
    if !simulation.library().lacks_texels() {
        return Ok(());
    }
    // With what the program itself put there before the scene was loaded.
    let mut begun = (options.simulation)();
    let fields = begun.world.remove_resource::<SceneFields>().unwrap_or_default();
    let before = begun.world.remove_resource::<Library>().unwrap_or_default();
    let mut read = scene::load_library(scene, &fields, before)?;
    if options.compress {
        compress_images(&mut read, options.cache.then(Cache::of_user).flatten().as_ref());
    }
    if texture_memory::used(&read).bytes > options.texture_bytes {
        texture_memory::limit(&mut read, options.texture_bytes);
    }
    let mut library = simulation.world.resource_mut::<Library>();
    library.bypass_change_detection().restore_texels(read).map_err(|image| {
        let message =
            format!("image {image:?} has changed since it was loaded; the graphics device that had it was lost");
        SceneError::from(Problem::error(scene, message))
    })
}
