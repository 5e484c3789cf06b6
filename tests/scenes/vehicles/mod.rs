//! Vehicle types, and vehicles in scenes: their wheels and lamps.

mod lamps;
mod types;
mod wheels;

use crate::common;
use crate::common::prelude::*;
use base64::Engine;
use relief::scene;
use std::f32::consts::PI;
use systems::physics;
use systems::vehicles::lamps::{Lamp, LampKind};
use systems::vehicles::parts::{Movement, MovingPart, Part};
use systems::vehicles::{Headlights, ManualControl, Motion, VehicleNumber, VehicleType, VehicleTypeId};

/// A cart: four wheels of half a metre's radius whose middle is far from the model's origin, a lamp below the turned
/// node `arm`, and a body in the material `coat`. Each mesh is a quad of 1 m across the X axis.
const CART: &str = r#"{
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
    "nodes": [
        {"name": "root", "children": [1, 2, 3, 4, 5, 6], "translation": [5, 1, 7]},
        {"name": "body", "mesh": 0, "translation": [0, 1.5, 1.5], "scale": [1, 1, 4]},
        {"name": "front left", "mesh": 1, "translation": [0.7, 0, 2.5]},
        {"name": "front right", "mesh": 1, "translation": [-0.7, 0, 2.5]},
        {"name": "rear left", "mesh": 1, "translation": [0.6, 0, 0]},
        {"name": "rear right", "mesh": 1, "translation": [-0.6, 0, 0]},
        {"name": "arm", "children": [7], "rotation": [0, 1, 0, 0]},
        {"name": "lamp", "mesh": 1, "translation": [0, 1, -3.5]}
    ],
    "materials": [{"name": "coat"}, {"name": "rubber"}],
    "meshes": [
        {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]},
        {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 1}]}
    ],
    "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, -0.5, -0.5], "max": [0, 0.5, 0.5]},
        {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}
    ],
    "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
    "buffers": [{"byteLength": 60, "uri": "data:application/octet-stream;base64,AAAAAAAAAL8AAAC/AAAAAAAAAD8AAAC/AAAAAAAAAD8AAAA/AAAAAAAAAL8AAAA/AAABAAIAAAACAAMA"}]
}"#;

const TYPES: &str = r#"(types: {
    "cart": (
        model: "cart.gltf",
        wheels: [(nodes: ["front left", "front right"], steers: true, radius: 0.5), (nodes: ["rear left", "rear right"], radius: 0.4)],
        lamps: [(nodes: ["lamp"], kind: head, light: spot(intensity: 9, range: 20, outer_degrees: 30))],
        paint: (materials: ["coat"], colors: [(1, 0, 0), (0, 0, 1)]),
        limits: (speed_kmh: 36),
    ),
})"#;

impl Folder {
    /// With the model of the cart.
    fn with_cart() -> Self {
        let folder = Self::with_model();
        folder.file("cart.gltf", CART);
        folder
    }

    fn types(&self, text: &str) -> (Simulation, Vec<String>) {
        let mut simulation = Simulation::new();
        let warnings = load_vehicle_types(&self.file("vehicles.ron", text), &mut simulation);
        (simulation, warnings.unwrap_or_else(|e| panic!("{e}")))
    }

    fn problems_of(&self, text: &str) -> Vec<String> {
        self.problems_in(Simulation::new, "vehicles.ron", text)
    }
}

fn find(simulation: &Simulation, name: &str) -> (VehicleTypeId, VehicleType) {
    let types = simulation.world.resource::<VehicleTypes>();
    let id = types.find(name).expect("a type");
    (id, types.get(id).clone())
}

fn near(a: Vec3, b: Vec3) {
    assert!(a.distance(b) < 1e-4, "{a} is not {b}");
}

// ---- Models made here: wheels and lamps as other people leave them ----

/// A model of meshes, each of some primitives in a material of its own, `tyre` the first. Nodes name meshes by number.
fn model(meshes: &[Vec<Mesh>], nodes: Value) -> String {
    let (mut bytes, mut views, mut accessors) = (Vec::<u8>::new(), Vec::new(), Vec::new());
    let mut accessor = |data: &[u8], component: u32, kind: &str, count: usize, low: Vec3, high: Vec3| {
        views.push(json!({ "buffer": 0, "byteOffset": bytes.len(), "byteLength": data.len() }));
        bytes.extend_from_slice(data);
        let mut accessor =
            json!({ "bufferView": views.len() - 1, "componentType": component, "type": kind, "count": count });
        if kind == "VEC3" {
            (accessor["min"], accessor["max"]) = (json!(low.to_array()), json!(high.to_array()));
        }
        accessors.push(accessor);
        accessors.len() - 1
    };
    let mut primitive = |(number, mesh): (usize, &Mesh)| {
        let low = mesh.positions.iter().fold(Vec3::INFINITY, |a, &b| a.min(b));
        let high = mesh.positions.iter().fold(Vec3::NEG_INFINITY, |a, &b| a.max(b));
        let (positions, indices) = (bytemuck::cast_slice(&mesh.positions), bytemuck::cast_slice(&mesh.indices));
        json!({
            "attributes": { "POSITION": accessor(positions, 5126, "VEC3", mesh.positions.len(), low, high) },
            "indices": accessor(indices, 5125, "SCALAR", mesh.indices.len(), low, high),
            "material": number.min(1),
        })
    };
    let meshes: Vec<Value> = meshes
        .iter()
        .map(|mesh| json!({ "primitives": mesh.iter().enumerate().map(&mut primitive).collect::<Vec<_>>() }))
        .collect();
    let children = nodes.as_array().expect("nodes").iter().filter_map(|node| node["children"].as_array()).flatten();
    let below: Vec<u64> = children.filter_map(Value::as_u64).collect();
    let count = nodes.as_array().map_or(0, Vec::len) as u64;
    let data = base64::engine::general_purpose::STANDARD.encode(&bytes);
    json!({
        "asset": { "version": "2.0" }, "scene": 0,
        "scenes": [{ "nodes": (0..count).filter(|node| !below.contains(node)).collect::<Vec<_>>() }],
        "nodes": nodes, "meshes": meshes, "accessors": accessors, "bufferViews": views,
        "materials": [{ "name": "tyre" }, { "name": "rim" }],
        "buffers": [{ "byteLength": bytes.len(), "uri": format!("data:application/octet-stream;base64,{data}") }],
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "spot", "spot": {} }] } },
    })
    .to_string()
}

fn block(size: Vec3, at: Vec3) -> Mesh {
    moved(shapes::cube(size), Affine3A::from_translation(at))
}

fn moved(mut mesh: Mesh, by: Affine3A) -> Mesh {
    mesh.positions.iter_mut().for_each(|p| *p = by.transform_point3(*p));
    mesh
}
