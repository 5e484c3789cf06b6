//! Scenes that were read and checked, and the worlds that are made of them.

use super::format;
use super::format::scene::Scene;
use super::read::items::Items;
use super::spawn::pieces::cut_model;
use super::spawn::spawner::Spawned;
use super::spawn::{self, studio};
use super::vehicle_types::{self, Types};
use crate::import::Model;
use bevy_ecs::prelude::*;
use std::path::{Path, PathBuf};
use systems::Simulation;
use systems::assets::Library;
use systems::draw::Environment;
use systems::ecs::clock::{Clock, Seed};
use systems::run::registry;
use systems::space::origin::Origin;
use systems::space::{Aabb, GeoOrigin};
use systems::weather::WeatherTimeline;

/// A scene that is in the world: its cameras, and what a person should know.
#[derive(Clone, Debug, Default)]
pub struct LoadedScene {
    /// The file's name without its extension.
    pub name: String,
    /// Names and entities of the cameras; the first is the one to look through. There is always one.
    pub cameras: Vec<(String, Entity)>,
    /// Warnings about a scene that loaded.
    pub warnings: Vec<String>,
    /// The scene's file and those that it names, in the order of reading; not what models name in turn.
    pub files: Vec<PathBuf>,
    /// Doubts that [`check`](super::check) alone tells.
    pub(super) doubts: Vec<String>,
}

/// A scene whose files are in the library and which has been checked: spawning it cannot fail.
pub struct Prepared {
    pub content: Content,
    pub origin: Origin,
    pub warnings: Vec<String>,
    /// Doubts that [`check`](super::check) alone tells.
    pub doubts: Vec<String>,
    pub files: Vec<PathBuf>,
}

/// Things to spawn.
pub enum Content {
    Scene(Box<Scene>, Items, Types),
    Model(Model),
}

impl Prepared {
    /// Puts the scene into a world.
    pub fn instantiate(&self, path: &Path, seed: Option<u64>, simulation: &mut Simulation) -> LoadedScene {
        let bright = matches!(&self.content, Content::Model(model) if model.has_lights());
        let (loaded, model) = self.spawn(path, seed, &mut simulation.world);
        if bright {
            studio::expose(simulation);
        }
        // Not before: to the exposure an object is one, however large.
        if let Some((root, bounds)) = model {
            cut_model(root, bounds, &mut simulation.world);
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
                vehicle_types::add_types(types, world);
                world.insert_resource(format::scene::environment(&scene.environment));
                world.insert_resource(WeatherTimeline::new(scene.weather.clone().unwrap_or_default().0));
                world.insert_resource(format::scene::clock(&scene.clock));
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
                world.insert_resource(WeatherTimeline::default());
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
