//! A scene as it is loaded: its world, its camera, and the run that begins with it.

use super::FrameError;
use crate::import;
use crate::import::cache::Cache;
use crate::import::compress::{CompressReport, compress_images};
use crate::import::meshes::finish_meshes;
use crate::problem::Problem;
use crate::recording::{Recording, RunFiles, Stepper};
use crate::scene;
use crate::viewpoint::Viewpoint;
use bevy_ecs::prelude::*;
use serde::{Deserialize, Serialize};
use std::any::Any;
use std::path::{Path, PathBuf};
use systems::Simulation;
use systems::assets::Library;
use systems::assets::texture_memory::{self, Reduced};

/// A scene that is loaded, with the camera it is seen from.
pub struct Stage {
    /// The world.
    pub simulation: Simulation,
    /// Report of the loader.
    pub scene: scene::LoadedScene,
    /// Viewpoint of the frames.
    pub viewpoint: Viewpoint,
}

impl Stage {
    /// Makes sure that no output is a file that the scene was made from.
    ///
    /// # Errors
    /// [`FrameError::Overwrites`].
    pub fn check_outputs(&self, is_output: impl Fn(&Path) -> bool) -> Result<(), FrameError> {
        check_outputs(&self.scene.files, is_output)
    }
}

/// Makes sure that no output is one of the files that are read, or is named by one.
///
/// # Errors
/// [`FrameError::Overwrites`].
pub fn check_outputs(read: &[PathBuf], is_output: impl Fn(&Path) -> bool) -> Result<(), FrameError> {
    match import::with_files_named_by(read).find(|path| is_output(path)) {
        Some(path) => Err(FrameError::Overwrites { path }),
        None => Ok(()),
    }
}

/// Options of loading a scene.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadOptions {
    /// Makes what the scene is loaded into: `Simulation::new`, or a program's own, with its state, inputs, systems and
    /// [`scene::SceneFields`].
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
    /// Called as loading begins; what it returns is dropped when the files are read. For a bar that shows
    /// [`import::progress::counts`], say.
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

/// Loads a scene and finds its camera; warnings are logged.
///
/// # Errors
/// [`FrameError::Scene`], [`FrameError::NoCamera`].
pub fn load_stage(path: &Path, camera: Option<&str>, options: &LoadOptions) -> Result<Stage, FrameError> {
    let mut simulation = (options.simulation)();
    let watch = options.watch.map(|begin| begin());
    let scene = scene::load_seeded(path, options.seed, &mut simulation)?;
    drop(watch);
    work_out(&mut simulation.world.resource_mut::<Library>(), options);
    limit_textures(&mut simulation, options.texture_bytes);
    simulation.world.resource_mut::<Library>().keep_texels(options.keep_texels);
    for warning in &scene.warnings {
        tracing::warn!("{warning}");
    }
    let found = match camera {
        None => scene.cameras.first().map(|&(_, camera)| Viewpoint::Camera(camera)),
        Some(wanted) => Viewpoint::find(wanted, &scene.cameras, &mut simulation.world),
    };
    let Some(viewpoint) = found else {
        let known = scene.cameras.iter().map(|(name, _)| name.clone()).collect();
        let wanted = camera.unwrap_or_default().to_owned();
        return Err(FrameError::NoCamera { scene: path.to_owned(), wanted, known });
    };
    Ok(Stage { simulation, scene, viewpoint })
}

/// Gives images that a renderer has taken the texels of ([`Library::keep_texels`]) their texels again, from the files
/// that the world was loaded from: for another renderer, where that one's device was lost.
///
/// # Errors
/// [`FrameError::Scene`]: the files cannot be read any more, or have changed.
pub fn restore_texels(scene: &Path, options: &LoadOptions, simulation: &mut Simulation) -> Result<(), FrameError> {
    if !simulation.library().lacks_texels() {
        return Ok(());
    }
    // With what the program itself put there before the scene was loaded.
    let mut begun = (options.simulation)();
    let fields = begun.world.remove_resource::<scene::SceneFields>().unwrap_or_default();
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
        scene::SceneError::from(Problem::error(scene, message)).into()
    })
}

/// Begins the run of a stage that has just been loaded: see [`Stepper::begin`].
///
/// # Errors
/// [`FrameError::Recording`].
pub fn begin_run(stage: &mut Stage, scene: &Path, files: &RunFiles, from: u64) -> Result<Stepper, FrameError> {
    let stepper = Stepper::begin(files, (scene, &stage.scene.files), from, &mut stage.simulation)?;
    stepper.recording().and_then(Recording::warning).into_iter().for_each(|warning| tracing::warn!("{warning}"));
    Ok(stepper)
}
