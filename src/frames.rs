//! Frames to files: `relief render`.
//!
//! Frame n is the world after n steps of its clock. The range asked for is reached by stepping, drawn frame by frame,
//! and each picture is written whole, so that an interrupted run can be resumed by what is there.

mod error;

pub use error::FrameError;

use crate::animation::{self, Animation};
use crate::frame_time::FrameTime;
use crate::import;
use crate::import::cache::Cache;
use crate::import::compress::{CompressReport, compress_images};
use crate::import::meshes::finish_meshes;
use crate::import::progress;
use crate::output;
use crate::problem::Problem;
use crate::recording::{RecordingError, RunFiles, Stepper};
use crate::renderer::{Gpu, Settings, SingleView};
use crate::scene;
use crate::video;
use crate::viewpoint::Viewpoint;
use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use glam::DVec3;
use image::buffer::ConvertBuffer;
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use systems::Simulation;
use systems::assets::texture_memory::Reduced;
use systems::assets::{Library, MeshId, texture_memory};
use systems::draw::View;
use systems::draw::pieces::{PieceOf, WholeMesh};
use systems::ecs::clock::{Clock, SPEEDS};
use systems::space::origin::Origin;

/// A kind of picture that is written for each frame.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, clap::ValueEnum)]
pub enum OutputKind {
    /// The tone-mapped picture, 8-bit sRGB.
    Color,
    /// Distance along the viewing direction: 16-bit grey, 1/256 m per step, 0 where there is nothing or it is farther
    /// than 255.99 m (the convention of the KITTI data set).
    Depth,
    /// World-space shading normal, 8 bits: 0.5 + 0.5·n.
    Normal,
    /// Entity ids as 24-bit colour (red lowest byte), 0 for nothing; `ids.json` names them.
    Id,
}

impl OutputKind {
    fn name(self) -> &'static str {
        match self {
            Self::Color => "color",
            Self::Depth => "depth",
            Self::Normal => "normal",
            Self::Id => "id",
        }
    }
}

/// What to render.
#[derive(Clone, Debug)]
pub struct FrameJob {
    /// Scene file or model.
    pub scene: PathBuf,
    /// Where the pictures go; made if missing.
    pub folder: PathBuf,
    /// Which frames.
    pub frames: Frames,
    /// Pixels.
    pub size: (u32, u32),
    /// The name of the camera, or `chase NAME`, `driver NAME` of a vehicle; `None`: the scene's first camera.
    pub camera: Option<String>,
    /// Kinds of pictures.
    pub outputs: Vec<OutputKind>,
    /// How to draw.
    pub settings: Settings,
    /// How lights are chosen.
    pub lights: systems::lights::LightPolicy,
    /// Leaves frames alone whose pictures are all there.
    pub resume: bool,
    /// How the scene is loaded.
    pub load: LoadOptions,
    /// A film of the colour frames, made when they are all there; its rate is that of the scene's clock.
    pub video: Option<PathBuf>,
    /// What the run begins from and is kept in.
    pub run: RunFiles,
    /// Takes the steps at the speed of the scene's clock rather than as fast as possible.
    pub realtime: bool,
}

impl FrameJob {
    fn picture(&self, kind: OutputKind, frame: u64) -> PathBuf {
        self.folder.join(format!("{}_{frame:05}.png", kind.name()))
    }

    fn names_of_ids(&self) -> Option<PathBuf> {
        self.outputs.contains(&OutputKind::Id).then(|| self.folder.join("ids.json"))
    }

    /// Whether a file is one that may be written beside what the run is kept in.
    fn writes(&self, path: &Path) -> bool {
        // What is made where ffmpeg is missing, too.
        let instead = |film: &PathBuf| Animation::of(film).is_none().then(|| animation::instead_of(film));
        let films = self.video.iter().flat_map(|film| std::iter::once(film.clone()).chain(instead(film)));
        films.into_iter().any(|film| output::is_same(path, &film)) || self.writes_beside_film(path)
    }

    /// Whether a file may be a picture of the run, or has the names of ids.
    fn writes_beside_film(&self, path: &Path) -> bool {
        let path = &output::real(path);
        let is_picture = |kind: &OutputKind| {
            let name = path.file_name().and_then(OsStr::to_str);
            let number = name.and_then(|name| name.strip_prefix(kind.name())?.strip_prefix('_')?.strip_suffix(".png"));
            let frame = number.and_then(|number| number.parse().ok()).filter(|&frame| self.may_draw(frame));
            frame.is_some_and(|frame| output::is_same(path, &self.picture(*kind, frame)))
        };
        self.names_of_ids().is_some_and(|names| output::is_same(path, &names)) || self.outputs.iter().any(is_picture)
    }

    /// Whether a frame may be one of the run's, as far as that is known before its files are read.
    fn may_draw(&self, frame: u64) -> bool {
        let begins_at_0 = self.run.from_snapshot.is_none() && self.run.replay.is_none();
        match &self.frames {
            Frames::Range(range) => range.contains(&frame),
            Frames::First(count) => !begins_at_0 || frame < *count,
            Frames::All => !begins_at_0 || frame == 0,
        }
    }
}

/// Frames of a run. Frame n shows the state after n steps.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Frames {
    /// So many, from where the run begins: 0, or a snapshot's step.
    First(u64),
    /// These.
    Range(Range<u64>),
    /// All of a recording; without one, the first.
    All,
}

impl Frames {
    /// The numbers, of a run whose first and last steps are known, the last of a recording only.
    fn numbers(&self, first: u64, last: Option<u64>) -> Result<Range<u64>, FrameError> {
        let wanted = match self {
            Self::First(count) => first..first + count,
            Self::Range(range) => range.clone(),
            Self::All => first..last.unwrap_or(first) + 1,
        };
        if wanted.start < first {
            return Err(FrameError::NoFrames { wanted, known: format!("begins with frame {first}") });
        }
        match last {
            Some(last) if wanted.end > last + 1 => {
                Err(FrameError::NoFrames { wanted, known: format!("ends with frame {last}") })
            }
            _ => Ok(wanted),
        }
    }

    /// The first that is known to be wanted.
    fn start(&self) -> u64 {
        if let Self::Range(range) = self { range.start } else { 0 }
    }
}

/// A scene that is loaded, with the camera it is seen from.
pub struct Stage {
    /// The world.
    pub simulation: Simulation,
    /// What the loader said of it.
    pub scene: scene::LoadedScene,
    /// What is looked through.
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

/// How a scene is loaded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LoadOptions {
    /// Whether images are put into blocks (BC7), a quarter of the memory.
    pub compress: bool,
    /// Whether results that take long to work out are kept on disk ([`crate::import::cache`]).
    pub cache: bool,
    /// Bytes that textures may take on the GPU; above it the largest are drawn smaller.
    pub texture_bytes: u64,
    /// Whether images keep their texels when a renderer has them ([`Library::keep_texels`]): what more than one
    /// renderer draws needs them.
    pub keep_texels: bool,
}

impl Default for LoadOptions {
    fn default() -> Self {
        let texture_bytes = texture_memory::DEFAULT_MEGABYTES << 20;
        Self { compress: false, cache: true, texture_bytes, keep_texels: true }
    }
}

impl LoadOptions {
    /// What the first renderer takes with it: texels are not held twice.
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
        "textures of {} MB are drawn in {} MB, as --texture-memory {} says: {} are smaller, among them {}",
        megabytes(before.bytes),
        megabytes(texture_memory::used(&library).bytes),
        most_bytes >> 20,
        reduced.len(),
        named.join(", ")
    );
}

/// What takes long to work out of meshes and images, and may have been kept from an earlier start.
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
    let mut simulation = Simulation::new();
    let bar = progress::Bar::on_terminal();
    let scene = scene::load(path, &mut simulation)?;
    drop(bar);
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
    let mut read = scene::load_library(scene)?;
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

/// A renderer without a window, for a few pictures of a world in hand.
pub struct Headless {
    /// Draws.
    pub renderer: SingleView,
    /// How to draw.
    pub settings: Settings,
}

impl Headless {
    /// Opens the best adapter.
    ///
    /// # Errors
    /// [`FrameError::Gpu`].
    pub fn new() -> Result<Self, FrameError> {
        Ok(Self { renderer: SingleView::new(&Gpu::headless()?), settings: Settings::default() })
    }

    /// Brings the world's draw list up to date and draws it as seen from a camera's entity, or another viewpoint, in
    /// 8-bit sRGB.
    ///
    /// # Errors
    /// [`FrameError::Render`].
    pub fn draw(
        &mut self,
        simulation: &mut Simulation,
        from: impl Into<Viewpoint>,
        size: (u32, u32),
    ) -> Result<image::RgbaImage, FrameError> {
        simulation.frame();
        let view = from.into().view(&simulation.world, size);
        self.renderer.prepare(simulation, &view, &self.settings)?;
        let picture = self.renderer.draw_picture();
        self.renderer.gpu().check()?;
        Ok(picture)
    }
}

/// Begins the run of a stage that has just been loaded: see [`Stepper::begin`].
///
/// # Errors
/// [`FrameError::Recording`].
pub fn begin_run(stage: &mut Stage, scene: &Path, files: &RunFiles, from: u64) -> Result<Stepper, FrameError> {
    let stepper = Stepper::begin(files, (scene, &stage.scene.files), from, &mut stage.simulation)?;
    if let (Some(path), Some(recording)) = (&files.replay, stepper.recording().filter(|r| !r.is_whole())) {
        let last = recording.steps().1;
        tracing::warn!("{}: the recording was cut short; it ends with step {last}", path.display());
    }
    Ok(stepper)
}

/// Steps at the speed of the clock.
struct Pace {
    began: Instant,
    first: u64,
    seconds_per_step: f64,
}

impl Pace {
    fn begin(clock: &Clock) -> Self {
        let seconds_per_step = clock.step_seconds / clock.speed.clamp(*SPEEDS.start(), *SPEEDS.end());
        Self { began: Instant::now(), first: clock.step, seconds_per_step }
    }

    /// Waits until a step is due; one that is late is not waited for.
    fn wait(&self, step: u64) {
        let due = Duration::from_secs_f64((step - self.first) as f64 * self.seconds_per_step);
        std::thread::sleep(due.saturating_sub(self.began.elapsed()));
    }
}

/// Renders a job; `progress` is called after each frame with how many are done, and of how many. Returns the files
/// written.
///
/// # Errors
/// [`FrameError`]; pictures written before stay.
pub fn render_frames(job: &FrameJob, mut progress: impl FnMut(u64, u64)) -> Result<Vec<PathBuf>, FrameError> {
    if let Some(path) = job.run.written().find(|path| job.writes(path)) {
        return Err(RecordingError::taken(path).into());
    }
    if let Some(film) = &job.video {
        if job.writes_beside_film(film) {
            return Err(RecordingError::taken(film).into());
        }
        video::check(film)?;
    }
    let begun_from: Vec<PathBuf> = job.run.replay.iter().chain(&job.run.from_snapshot).cloned().collect();
    check_outputs(&begun_from, |path| job.writes(path))?;
    // The driver and its pipelines take their time; the scene loads meanwhile.
    let opening = std::thread::spawn(|| Gpu::headless().map(|gpu| SingleView::new(&gpu)));
    let stage = load_stage(&job.scene, job.camera.as_deref(), &job.load);
    let renderer = opening.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    let mut stage = stage?;
    let mut renderer = renderer?;
    stage.check_outputs(|path| job.writes(path))?;
    let mut stepper = begin_run(&mut stage, &job.scene, &job.run, job.frames.start())?;
    let now = stage.simulation.world.resource::<Clock>().step;
    let (first, last) = stepper.recording().map_or((now, None), |recording| {
        let (first, last) = recording.steps();
        (first, Some(last))
    });
    let frames = job.frames.numbers(first, last)?;
    output::make_folder(&job.folder)?;
    let frame_time = FrameTime::of(stage.simulation.world.resource::<Clock>().step_seconds);
    if let Some(film) = &job.video {
        video::warn_of_times(film, frames.clone(), frame_time);
    }
    stage.simulation.world.insert_resource(job.lights);
    let settings = job.settings.for_files();
    let step_of = |simulation: &Simulation| simulation.world.resource::<Clock>().step;
    let pace = job.realtime.then(|| Pace::begin(stage.simulation.world.resource()));
    let mut written = Vec::new();
    for frame in frames.clone() {
        while step_of(&stage.simulation) < frame {
            pace.iter().for_each(|pace| pace.wait(step_of(&stage.simulation) + 1));
            stepper.step(&mut stage.simulation)?;
        }
        let is_missing = |kind: &OutputKind| !job.resume || !is_written(&job.picture(*kind, frame), job.size);
        let missing: Vec<_> = job.outputs.iter().copied().filter(is_missing).collect();
        if !missing.is_empty() {
            stage.simulation.frame();
            let view = stage.viewpoint.view(&stage.simulation.world, job.size);
            renderer.prepare(&mut stage.simulation, &view, &settings)?;
            let pictures = pictures(&mut renderer, &view, &missing);
            renderer.gpu().check()?;
            for (kind, picture) in pictures {
                let path = job.picture(kind, frame);
                output::write_png(&path, &picture)?;
                written.push(path);
            }
        }
        progress(frame + 1 - frames.start, frames.end - frames.start);
    }
    stepper.finish(&mut stage.simulation)?;
    if let Some(path) = &job.run.save_snapshot {
        stepper.save_snapshot(path, &mut stage.simulation)?;
        written.push(path.clone());
    }
    if let Some(names) = job.names_of_ids() {
        output::write_whole(&names, names_of_ids(&mut stage.simulation.world).as_bytes())?;
        written.push(names);
    }
    if let Some(film) = &job.video {
        written.push(video::encode(film, &job.folder, frames, frame_time)?);
    }
    Ok(written)
}

/// Whether a whole picture of that size is there: one that was cut short, by others than this program, lacks its end.
fn is_written(path: &Path, size: (u32, u32)) -> bool {
    // The last chunk of a PNG file: no data, its name, and the checksum of that (PNG specification, 11.2.5).
    const END: [u8; 12] = *b"\0\0\0\0IEND\xAE\x42\x60\x82";
    let mut end = [0; END.len()];
    let read_end = |mut file: File| {
        file.seek(SeekFrom::End(-(END.len() as i64)))?;
        file.read_exact(&mut end)
    };
    let is_whole = File::open(path).and_then(read_end).is_ok() && end == END;
    is_whole && image::image_dimensions(path).is_ok_and(|found| found == size)
}

fn pictures(renderer: &mut SingleView, view: &View, kinds: &[OutputKind]) -> Vec<(OutputKind, image::DynamicImage)> {
    let mut pictures = Vec::new();
    if kinds.contains(&OutputKind::Color) {
        let rgb: image::RgbImage = renderer.draw_picture().convert();
        pictures.push((OutputKind::Color, rgb.into()));
    }
    if kinds.iter().all(|&kind| kind == OutputKind::Color) {
        return pictures;
    }
    let Some(outputs) = renderer.draw_outputs() else { return pictures };
    let (gpu, width, height) = (renderer.gpu(), outputs.width, outputs.height);
    for &kind in kinds {
        let picture: Option<image::DynamicImage> = match kind {
            OutputKind::Color => continue,
            OutputKind::Depth => {
                let step = |metres: f32| if metres < 255.99 { (metres * 256.0).round() as u16 } else { 0 };
                let depths = outputs.depths(gpu, view).into_iter().map(step).collect();
                image::ImageBuffer::<image::Luma<u16>, _>::from_raw(width, height, depths).map(Into::into)
            }
            OutputKind::Normal => {
                let byte = |v: f32| ((v * 0.5 + 0.5) * 255.0).round() as u8;
                let rgb = |n: [f32; 3]| if n == [0.0; 3] { [0; 3] } else { n.map(byte) };
                let normals = outputs.normals(gpu).into_iter().flat_map(rgb).collect();
                image::RgbImage::from_raw(width, height, normals).map(Into::into)
            }
            OutputKind::Id => {
                let rgb = |id: Option<u32>| {
                    let [r, g, b, _] = id.map_or(0, |id| id + 1).to_le_bytes();
                    [r, g, b]
                };
                let ids = outputs.entities(gpu).into_iter().flat_map(rgb).collect();
                image::RgbImage::from_raw(width, height, ids).map(Into::into)
            }
        };
        pictures.extend(picture.map(|picture| (kind, picture)));
    }
    pictures
}

/// JSON: the id in the picture → the entity's name, its parent's where it has none; `origin`, where it is not zero:
/// where the world's places count from, in the scene's coordinates.
fn names_of_ids(world: &mut World) -> String {
    type Drawn = (Or<(With<MeshId>, With<WholeMesh>)>, Without<PieceOf>);
    let mut drawn = world.query_filtered::<Entity, Drawn>();
    let entities: Vec<Entity> = drawn.iter(world).collect();
    let names: BTreeMap<u32, String> =
        entities.into_iter().map(|entity| (entity.index().index() + 1, name_of(world, entity))).collect();
    let origin = world.resource::<Origin>().0;
    let origin = (origin != DVec3::ZERO).then(|| format!("  \"origin\": {}", serde_json::json!(origin.to_array())));
    let quoted = names.iter().map(|(id, name)| format!("  \"{id}\": {}", serde_json::Value::from(name.as_str())));
    let quoted: Vec<String> = origin.into_iter().chain(quoted).collect();
    format!("{{\n{}\n}}\n", quoted.join(",\n"))
}

/// An entity's name for people: its own, else its nearest named ancestor's, else its id.
pub fn name_of(world: &World, entity: Entity) -> String {
    let mut next = Some(entity);
    while let Some(current) = next {
        if let Some(name) = world.get::<Name>(current) {
            return name.as_str().to_owned();
        }
        next = world.get::<ChildOf>(current).map(ChildOf::parent);
    }
    format!("entity {}", entity.index())
}
