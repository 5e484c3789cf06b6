//! Scene files from text to entities: what loads, what is refused and in which words. And worlds of any origin:
//! vehicles and roads in them, many at a time, data of a caller's own, and what shaders and debug views make of them.

mod cell_view;
mod cells;
#[path = "../common/mod.rs"]
mod common;
mod custom_fields;
mod faults;
mod files;
mod generators;
mod models;
mod own_data;
mod places;
mod rigs;
mod roads;
mod shaders;
mod templates;
mod values;
mod vehicles;
mod weather;
mod worlds;

use crate::common::prelude::*;
use proptest::prelude::*;
use relief::scene::{self, LoadedScene};
use systems::assets::{MeshVariants, Wrap};
use systems::lights::NoShadow;
use systems::sensors::{Class, Classes, Instance};
use systems::space::InheritedHidden;
use systems::space::origin::Origin;

/// A 1×1 m quad (`panel`), and below the rotated, doubled node `arm` a node `lamp`, 1 m up.
const MODEL: &str = r#"{
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
    "nodes": [
        {"name": "panel", "mesh": 0, "translation": [0, 0, 3]},
        {"name": "arm", "children": [2], "scale": [2, 2, 2], "rotation": [0, 0.70710678, 0, 0.70710678]},
        {"name": "lamp", "translation": [0, 1, 0], "mesh": 0}
    ],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
    "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-0.5, -0.5, 0], "max": [0.5, 0.5, 0]},
        {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}
    ],
    "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
    "buffers": [{"byteLength": 60, "uri": "data:application/octet-stream;base64,AAAAvwAAAL8AAAAAAAAAPwAAAL8AAAAAAAAAPwAAAD8AAAAAAAAAvwAAAD8AAAAAAAABAAIAAAACAAMA"}]
}"#;

impl Folder {
    fn with_model() -> Self {
        let folder = Self::new();
        folder.file("model.gltf", MODEL);
        folder
    }

    fn load(&self, text: &str) -> (Simulation, LoadedScene) {
        let mut simulation = Simulation::new();
        let scene = scene::load(&self.file("scene.ron", text), &mut simulation).unwrap_or_else(|e| panic!("{e}"));
        simulation.frame();
        (simulation, scene)
    }

    /// Everything wrong with a scene, without the path.
    fn problems(&self, text: &str) -> Vec<String> {
        self.problems_in(Simulation::new, "scene.ron", text)
    }

    /// Problems of a file, for a program with fields of its own.
    fn problems_in(&self, simulation: fn() -> Simulation, name: &str, text: &str) -> Vec<String> {
        let path = self.file(name, text);
        let start = format!("{}:", path.display());
        let folder = format!("{}/", self.path().display());
        let texts = scene::check(&path, simulation).into_iter().map(|p| p.to_string());
        texts.map(|t| t.strip_prefix(&start).expect("starts with the path").trim().replace(&folder, "")).collect()
    }
}

fn load(text: &str) -> (Simulation, LoadedScene) {
    Folder::with_model().load(text)
}

fn named(world: &mut World, name: &str) -> Entity {
    let mut entities = world.query::<(Entity, &Name)>();
    let found = entities.iter(world).find(|(_, n)| n.as_str() == name).map(|(entity, _)| entity);
    found.unwrap_or_else(|| panic!("no entity {name:?}"))
}

fn all<C: Component + Clone>(world: &mut World) -> Vec<C> {
    world.query::<&C>().iter(world).cloned().collect()
}
