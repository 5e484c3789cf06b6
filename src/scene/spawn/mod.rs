//! A checked scene becomes entities. Uses all other floors.
//!
//! ```text
//! spawner, placement  what spawning works with; where an entity goes and what it looks like
//! entities            an entity of the file, with what is below it
//! generate, random    generators' copies
//! pieces              large objects
//! cells               rooms and portals
//! signal_heads        lamps of signals
//! vehicles/           vehicles and routes, if the build has vehicles
//! physical            vehicles as bodies, if the build has physics
//! studio              light and a camera for what brings none
//! light_warnings, sensor_warnings  what will not be as meant
//! ```

mod below;
pub mod cells;
mod entities;
mod generate;
mod light_warnings;
#[cfg(feature = "physics")]
mod physical;
#[cfg(not(feature = "physics"))]
#[cfg_attr(not(feature = "vehicles"), allow(dead_code))]
#[path = "no_physics.rs"]
mod physical;
pub mod pieces;
mod placement;
pub mod random;
mod sensor_warnings;
#[cfg(feature = "vehicles")]
mod signal_heads;
pub mod spawner;
pub mod studio;
mod turned_meshes;
#[cfg(feature = "vehicles")]
mod vehicles;
#[cfg(not(feature = "vehicles"))]
#[path = "no_vehicles.rs"]
mod vehicles;

use crate::import::Model;
use crate::name::SceneEntities;
use crate::scene::format::scene::Scene;
use crate::scene::format::sensors;
use crate::scene::read::items::Items;
use below::cameras_below;
use bevy_ecs::prelude::*;
use placement::Placement;
use random::Random;
#[cfg(feature = "vehicles")]
use signal_heads::LitGlass;
use spawner::{Spawned, Spawner};
use std::collections::HashMap;
use systems::lights::LightPolicies;
use systems::space::{Aabb, Transform};
use turned_meshes::TurnedMeshes;

/// Spawns the whole scene. `seed`: of all that is random in it.
pub fn spawn(scene: &Scene, items: &Items, seed: u64, world: &mut World) -> Spawned {
    let mut spawner = Spawner {
        items,
        rigs: &scene.rigs,
        world,
        piece_metres: scene.piece_metres.0,
        large: Vec::new(),
        model_cameras: Vec::new(),
        turned: TurnedMeshes::default(),
        #[cfg(feature = "vehicles")]
        unknown_types: Vec::new(),
        #[cfg(feature = "vehicles")]
        glass: LitGlass::default(),
        found: Spawned::default(),
    };
    spawner.world.insert_resource(sensors::classes(&scene.classes));
    spawner.found.warnings = vehicles::insert(scene, seed, spawner.world);
    if let Some(lights) = scene.lights {
        spawner.world.insert_resource(LightPolicies::same(lights.policy()));
    }
    let mut listed = SceneEntities::default();
    for (i, entity) in scene.entities.iter().enumerate() {
        listed.0.insert(spawner.entity(entity, &Placement::of(entity), None), i);
    }
    spawner.world.insert_resource(listed);
    let mut seeds = Random::new(seed);
    for (i, generator) in scene.generators.iter().enumerate() {
        spawner.generator(i, generator, seeds.bits());
    }
    let in_cells = cells::spawn(Some((scene, items)), spawner.world);
    spawner.found.warnings.extend(in_cells);
    spawner.cut();
    spawner.found.warnings.extend(vehicles::warnings(spawner.world));
    spawner.found.warnings.extend(light_warnings::shadows_without_end(spawner.world));
    spawner.found.warnings.extend(light_warnings::too_many_suns(spawner.world));
    spawner.found.warnings.extend(sensor_warnings::warnings(spawner.world));
    let Spawner { model_cameras, mut found, .. } = spawner;
    found.warnings.extend(shared_names(&found.cameras, &model_cameras));
    found.cameras.extend(model_cameras);
    found
}

/// A word about each name of a model's camera that an earlier one has; the scene's own have been checked.
fn shared_names(own: &[(String, Entity)], of_models: &[(String, Entity)]) -> Vec<String> {
    let mut counts: HashMap<&str, usize> = own.iter().map(|(name, _)| (name.as_str(), 1)).collect();
    let mut shared = Vec::new();
    for (name, _) in of_models.iter().filter(|(name, _)| !name.is_empty()) {
        let count = counts.entry(name).or_default();
        *count += 1;
        if *count == 2 {
            shared.push(format!("duplicate camera name {name:?} in a model: the name selects the first camera only"));
        }
    }
    shared
}

/// Spawns a model as a whole scene; returns its root, too.
pub fn spawn_model(model: &Model, bounds: Aabb, world: &mut World) -> (Entity, Spawned) {
    let root = model.spawn(world, Transform::IDENTITY);
    let cameras = cameras_below(world, root);
    let mut warnings = shared_names(&[], &cameras);
    warnings.extend(cells::spawn(None, world));
    let bounds = (bounds != Aabb::default()).then_some(bounds);
    (root, Spawned { cameras, bounds, has_lights: model.has_lights(), warnings })
}
