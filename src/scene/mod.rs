//! Scene files: text into entities.
//!
//! ```text
//! format, surfaces, values  the file as serde reads it (RON; docs/scenes.md)
//! files                     the images and models it names, each read once; materials and meshes into the library
//! check, faults, places     names and numbers: every fault at once, with line and column
//! slips                     text that is no RON: what is common, in words that name the field
//! custom_fields             fields that a program adds
//! origin                    places count from it
//! roads, traffic            routes and signals
//! road_warnings, overlaps   what is doubtful of them and of vehicles on them
//! room                      where a generator has put vehicles already
//! vehicle_types             types of vehicles from files of their own
//! vehicles                  what spawning asks for of all these, if the build has vehicles
//! physical                  vehicles as bodies, if the build has physics
//! spawn, generate           entities, and generators' copies of them
//! cells                     rooms and portals
//! sensors, lenses           sensors, and classes of what they see; the lenses of cameras
//! motion_sensors            sensors of motion, and where on Earth a scene is
//! sensor_warnings           what sensors will not give as meant
//! rigs                      entities from files of their own, below those that take them
//! template                  a scene that is read once, and of which any number of worlds are made
//! studio                    light and a camera for what brings none; a glTF file is a scene as well
//! ```
//!
//! Nothing is spawned before everything has been read and checked, so that a scene that fails leaves the world as it
//! was.

mod cells;
mod check;
mod custom_fields;
#[cfg(all(test, feature = "physics"))]
mod docs_test;
mod faults;
mod files;
mod format;
mod generate;
mod lenses;
mod lights;
mod motion_sensors;
#[cfg(feature = "tools")]
pub(crate) use generate::Random;
mod origin;
#[cfg(feature = "vehicles")]
mod overlaps;
mod overrides;
#[cfg(feature = "physics")]
mod physical;
#[cfg(not(feature = "physics"))]
#[cfg_attr(not(feature = "vehicles"), allow(dead_code))]
#[path = "no_physics.rs"]
mod physical;
mod places;
mod rigs;
#[cfg(feature = "vehicles")]
mod road_warnings;
#[cfg_attr(not(feature = "vehicles"), allow(dead_code))]
mod roads;
#[cfg(feature = "vehicles")]
mod room;
mod sensor_warnings;
mod sensors;
mod slips;
mod spawn;
mod studio;
mod surfaces;
mod template;
#[cfg(feature = "vehicles")]
mod traffic;
mod turned_meshes;
mod values;
#[cfg(feature = "vehicles")]
mod vehicle_types;
#[cfg(feature = "vehicles")]
mod vehicles;
#[cfg(not(feature = "vehicles"))]
#[path = "no_vehicles.rs"]
mod vehicles;

pub use custom_fields::{EntityField, SceneField, SceneFields};
pub use overrides::Overrides;
pub use template::Template;
#[cfg(feature = "vehicles")]
pub use vehicle_types::load_vehicle_types;

use crate::import;
use crate::problem::Problem;
use bevy_ecs::prelude::*;
use faults::Fault;
use files::Items;
use ron::error::SpannedError;
use ron::extensions::Extensions;
use serde::de::DeserializeOwned;
use slips::Slip;
use spawn::Spawned;
use std::fmt;
use std::path::{Path, PathBuf};
use systems::Simulation;
use systems::assets::Library;
use systems::draw::Environment;
use systems::ecs::clock::{Clock, Seed};
use systems::run::registry;
use systems::sensors::GeoOrigin;
use systems::space::Aabb;
use systems::space::origin::Origin;

/// Bytes; a scene of a million written-out entities fits.
const LARGEST_FILE: u64 = 256 << 20;

/// What is known of a scene once it is in the world.
#[derive(Clone, Debug, Default)]
pub struct LoadedScene {
    /// The file's name without its extension.
    pub name: String,
    /// Names and entities of the cameras; the first is the one to look through. There is always one.
    pub cameras: Vec<(String, Entity)>,
    /// What a person should know though the scene loaded.
    pub warnings: Vec<String>,
    /// The scene's file and those that it names, in the order of reading; not what models name in turn.
    pub files: Vec<PathBuf>,
    /// What is said by [`check`] alone.
    doubts: Vec<String>,
}

/// Why a scene is refused: the problems, at least one. Its text is the first and how many more there are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneError {
    /// In the order of the file.
    pub problems: Vec<Problem>,
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Some((first, others)) = self.problems.split_first() else { return f.write_str("invalid scene") };
        match others.len() {
            0 => write!(f, "{first}"),
            1 => write!(f, "{first} (and 1 more problem)"),
            n => write!(f, "{first} (and {n} more problems)"),
        }
    }
}

impl std::error::Error for SceneError {}

impl From<Problem> for SceneError {
    fn from(problem: Problem) -> Self {
        Self { problems: vec![problem] }
    }
}

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
/// As [`load`].
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
/// As [`load`].
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
    if let Some(problems) = vehicles::check_types(path) {
        return problems;
    }
    // Into a world of its own: some of it shows only there.
    let mut simulation = simulation();
    let fields = simulation.world.get_resource::<SceneFields>().cloned().unwrap_or_default();
    if let Some(problems) = rigs::check(path, &fields) {
        return problems;
    }
    match load(path, &mut simulation) {
        Ok(mut loaded) => {
            loaded.warnings.append(&mut loaded.doubts);
            loaded.warnings.extend(cells::shared_sheets(&mut simulation));
            loaded.warnings.into_iter().map(|message| Problem::warning(path, message)).collect()
        }
        Err(error) => error.problems,
    }
}

fn is_model(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gltf") || e.eq_ignore_ascii_case("glb"))
}

/// A scene whose files are in the library and which has been checked: spawning it cannot fail.
struct Prepared {
    content: Content,
    origin: Origin,
    warnings: Vec<String>,
    /// What is said by [`check`] alone.
    doubts: Vec<String>,
    files: Vec<PathBuf>,
}

enum Content {
    Scene(Box<format::Scene>, Items, vehicles::Types),
    Model(import::Model),
}

fn prepare(
    path: &Path,
    fields: &SceneFields,
    overrides: &Overrides,
    library: &mut Library,
) -> Result<Prepared, SceneError> {
    if is_model(path) {
        if !overrides.is_empty() {
            let message = "expected a scene (.ron): a model has no clock, geo_origin or environment of its own";
            return Err(problem(path, None, message).into());
        }
        let model = import::load_model(path, library).map_err(|error| import_problem(path, error.into()))?;
        let warnings = model.warnings.iter().map(ToString::to_string).collect();
        let (content, files) = (Content::Model(model), vec![path.to_owned()]);
        return Ok(Prepared { content, origin: Origin::default(), warnings, doubts: Vec::new(), files });
    }
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ron")) {
        return prepare_scene(path, fields, overrides, library);
    }
    Err(problem(path, None, "expected a scene (.ron) or a model (.gltf, .glb)").into())
}

/// Names that several cameras or vehicles have, each of which is told.
const SHARED_NAMES_SHOWN: usize = 8;

/// A line for each name that several cameras or vehicles have; the rest is counted.
fn shared_names(scene: &format::Scene, text: &str) -> Vec<String> {
    let shared = check::names::shared(scene);
    let place = |fault: &Fault| {
        let (line, column) = places::find(text, &fault.steps);
        format!("{} (line {line}, column {column})", fault.place)
    };
    let tell = |name: &check::names::Shared| {
        let mut places: Vec<String> = name.faults.iter().map(place).collect();
        if name.more > 0 {
            places.push(format!("{} more", name.more));
        }
        let message = name.faults.first().map_or("", |fault| &fault.message);
        format!("{}: {message}", listed(&places))
    };
    let mut warnings: Vec<String> = shared.iter().take(SHARED_NAMES_SHOWN).map(tell).collect();
    match shared.len().saturating_sub(SHARED_NAMES_SHOWN) {
        0 => {}
        1 => warnings.push("1 more name is shared by several cameras or vehicles".into()),
        more => warnings.push(format!("{more} more names are shared by several cameras or vehicles")),
    }
    warnings
}

/// `a`, `a and b`, `a, b and c`.
fn listed(all: &[String]) -> String {
    match all {
        [before @ .., last] if !before.is_empty() => format!("{} and {last}", before.join(", ")),
        _ => all.concat(),
    }
}

fn prepare_scene(
    path: &Path,
    fields: &SceneFields,
    overrides: &Overrides,
    library: &mut Library,
) -> Result<Prepared, SceneError> {
    if rigs::is_rig(path) {
        return Err(problem(path, None, "expected a scene, found a rig, which entities of scenes take by `rig`").into());
    }
    let text = read_text(path)?;
    let mut scene = parse::<format::Scene>(&text).map_err(|slip| slip_problem(path, slip))?;
    overrides.apply(&mut scene);
    let mut faults = custom_fields::read(&mut scene, fields, &text).map_err(|slip| slip_problem(path, slip))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let (rigs, mut of_rigs) = rigs::read(&scene, fields, folder);
    scene.rigs = rigs;
    faults.append(&mut of_rigs);
    let (files, mut of_files) = files::read(&scene, folder, library);
    faults.append(&mut of_files);
    faults.extend(check::faults(&scene, &files));
    faults.extend(rigs::faults(&scene, &files));
    let mut vehicles = vehicles::read_types(&scene, folder, library, &mut faults);
    if !faults.is_empty() {
        return Err(SceneError { problems: placed(faults, path, &text) });
    }
    let mut warnings = files.warnings(&scene);
    warnings.append(&mut vehicles.warnings);
    let doubts = files.unknown_classes(&scene);
    warnings.extend(shared_names(&scene, &text));
    let (origin, mut of_places) = origin::move_to_origin(&mut scene);
    warnings.append(&mut of_places);
    let items = Items::new(&scene, &files, library);
    let mut named = vec![path.to_owned()];
    named.extend(files::named(&scene, folder));
    named.append(&mut vehicles.files);
    named.extend(scene.rigs.files());
    let content = Content::Scene(Box::new(scene), items, vehicles.types);
    Ok(Prepared { content, origin: Origin(origin), warnings, doubts, files: named })
}

/// Faults as problems of a file, in the order of its text.
fn placed(faults: Vec<Fault>, path: &Path, text: &str) -> Vec<Problem> {
    if faults.is_empty() {
        return Vec::new();
    }
    let places = places::Places::of(text);
    let at =
        |fault: Fault| Problem { place: fault.place, ..problem(path, Some(places.find(&fault.steps)), fault.message) };
    let mut problems: Vec<Problem> = faults.into_iter().map(at).collect();
    problems.sort_by_key(|problem| problem.line_column);
    problems
}

fn read_text(path: &Path) -> Result<String, Problem> {
    let metadata = std::fs::metadata(path).map_err(|e| problem(path, None, format!("{e}{}", shipped(path, &e))))?;
    if !metadata.is_file() {
        return Err(problem(path, None, "expected a file"));
    }
    if metadata.len() > LARGEST_FILE {
        let size = metadata.len();
        return Err(problem(path, None, format_args!("file too large: {size} bytes, at most {LARGEST_FILE}")));
    }
    let bytes = std::fs::read(path).map_err(|e| problem(path, None, e))?;
    if [[0xff, 0xfe], [0xfe, 0xff]].iter().any(|mark| bytes.starts_with(mark)) || bytes.iter().take(2).any(|b| *b == 0)
    {
        return Err(problem(path, None, "expected UTF-8 text, found UTF-16; save it as UTF-8"));
    }
    let text = String::from_utf8(bytes).map_err(|e| {
        let valid = e.utf8_error().valid_up_to();
        problem(path, None, format_args!("invalid UTF-8 at byte {valid}"))
    })?;
    // Some editors put a mark before the text that says that it is UTF-8.
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}

/// Reads RON as all of this module's text is read.
fn from_ron<T: DeserializeOwned>(text: &str) -> Result<T, SpannedError> {
    let extensions = Extensions::IMPLICIT_SOME | Extensions::UNWRAP_NEWTYPES | Extensions::UNWRAP_VARIANT_NEWTYPES;
    ron::Options::default().with_default_extension(extensions).from_str(text)
}

/// The same, with errors for people.
fn parse<T: DeserializeOwned>(text: &str) -> Result<T, Slip> {
    from_ron(text).map_err(|error| slips::explain(text, &error))
}

fn slip_problem(path: &Path, Slip { line_column, place, message }: Slip) -> Problem {
    Problem { place, ..problem(path, Some(line_column), message) }
}

impl Prepared {
    /// Puts the scene into a world.
    fn instantiate(&self, path: &Path, seed: Option<u64>, simulation: &mut Simulation) -> LoadedScene {
        let bright = matches!(&self.content, Content::Model(model) if model.has_lights());
        let (loaded, model) = self.spawn(path, seed, &mut simulation.world);
        if bright {
            studio::expose(simulation);
        }
        // Not before: to the exposure an object is one, however large.
        if let Some((root, bounds)) = model {
            spawn::cut_model(root, bounds, &mut simulation.world);
        }
        registry::register_all(&mut simulation.world);
        loaded
    }

    /// A model's root and bounds beside the scene. A `seed` takes the place of the scene's own.
    fn spawn(&self, path: &Path, seed: Option<u64>, world: &mut World) -> (LoadedScene, Option<(Entity, Aabb)>) {
        let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        let (mut warnings, mut whole) = (self.warnings.clone(), None);
        world.insert_resource(Origin(self.origin.0));
        let spawned = match &self.content {
            Content::Scene(scene, items, types) => {
                let seed = seed.unwrap_or(scene.seed);
                vehicles::add_types(types, world);
                world.insert_resource(environment(&scene.environment));
                world.insert_resource(clock(&scene.clock));
                world.insert_resource(Seed(seed));
                match scene.geo_origin {
                    Some(on_earth) => world.insert_resource(on_earth.resource()),
                    None => _ = world.remove_resource::<GeoOrigin>(),
                }
                scene.custom.insert_into_world(world);
                spawn::spawn(scene, items, seed, world)
            }
            Content::Model(model) => {
                let bounds = model.bounds(world.resource::<Library>());
                let (root, spawned) = spawn::spawn_model(model, bounds, world);
                whole = Some((root, bounds));
                let environment = if spawned.has_lights { Environment::default() } else { studio::light(world) };
                world.insert_resource(environment);
                world.insert_resource(Clock::default());
                world.insert_resource(Seed(seed.unwrap_or_default()));
                spawned
            }
        };
        let Spawned { mut cameras, bounds, warnings: more, .. } = spawned;
        warnings.extend(more);
        if cameras.is_empty() {
            cameras.push(studio::frame(bounds, world));
        }
        let (files, doubts) = (self.files.clone(), self.doubts.clone());
        (LoadedScene { name, cameras, warnings, files, doubts }, whole)
    }
}

fn environment(e: &format::Environment) -> Environment {
    Environment {
        ambient: e.ambient.rgb(),
        zenith: e.zenith.rgb(),
        horizon: e.horizon.rgb(),
        ground: e.ground.rgb(),
        exposure: e.exposure,
        tone_map: e.tone_map,
    }
}

fn clock(c: &format::Clock) -> Clock {
    let mut clock = Clock::default();
    (clock.step_seconds, clock.speed, clock.paused) = (c.step_seconds, c.speed, c.paused);
    clock
}

/// The folder of the project's own scenes, seen from a checkout.
const SHIPPED: &str = "assets/scenes";

/// A hint for who names a scene of the project by its file's name alone.
fn shipped(path: &Path, error: &std::io::Error) -> String {
    let other = Path::new(SHIPPED).join(path.file_name().unwrap_or_default());
    let is_other = error.kind() == std::io::ErrorKind::NotFound && path.file_name().is_some() && other.is_file();
    if is_other { format!("; did you mean {}?", other.display()) } else { String::new() }
}

fn problem(path: &Path, line_column: Option<(usize, usize)>, message: impl fmt::Display) -> Problem {
    Problem { line_column, ..Problem::error(path, message) }
}

/// The import's problem with a model as the scene's.
fn import_problem(path: &Path, problem: Problem) -> Problem {
    if problem.path == path {
        return problem;
    }
    let place = format!("{}: {}", problem.path.display(), problem.place);
    Problem { path: path.into(), place, ..problem }
}
