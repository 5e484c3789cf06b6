//! The samples, and glTF documents made here.

use crate::common::{self, prelude::*};
use base64::Engine;
use relief::import::{ImportError, Model};

pub fn files_below(folder: &Path, extensions: &[&str]) -> Vec<PathBuf> {
    let (mut files, mut open) = (Vec::new(), vec![folder.to_owned()]);
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|e| extensions.contains(&e.to_str().unwrap())) {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}

pub fn load(path: &str) -> Option<(Model, Library)> {
    let mut library = Library::default();
    let model = load_model(&common::test_data()?.join(path), &mut library).unwrap();
    Some((model, library))
}

pub fn node<'a>(model: &'a Model, name: &str) -> &'a relief::import::Node {
    model.nodes.iter().find(|n| n.name == name).unwrap()
}

pub fn material<'a>(library: &'a Library, name: &str) -> &'a Material {
    library.materials().map(|(_, material)| material).find(|m| m.name == name).unwrap()
}

/// A glTF document of one triangle; `change` edits it before it is written.
pub fn with_triangle(change: impl FnOnce(&mut Value)) -> Result<(Model, Library), ImportError> {
    let positions = [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mut document = json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                        "min": [0, 0, 0], "max": [1, 1, 0] }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [buffer(&floats(positions.as_flattened()))],
    });
    change(&mut document);
    load_document(&document)
}

pub fn load_document(document: &Value) -> Result<(Model, Library), ImportError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("made.gltf");
    std::fs::write(&path, document.to_string()).unwrap();
    let mut library = Library::default();
    load_model(&path, &mut library).map(|model| (model, library))
}

pub fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

pub fn buffer(bytes: &[u8]) -> Value {
    let mut buffer = uri_of(bytes);
    buffer["byteLength"] = json!(bytes.len());
    buffer
}

pub fn push(document: &mut Value, array: &str, item: Value) -> usize {
    let array = document.as_object_mut().unwrap().entry(array).or_insert(json!([])).as_array_mut().unwrap();
    array.push(item);
    array.len() - 1
}

/// Adds a buffer, its view and an accessor of it.
pub fn push_accessor(document: &mut Value, bytes: &[u8], mut accessor: Value) -> usize {
    let buffer = push(document, "buffers", buffer(bytes));
    let view = push(document, "bufferViews", json!({ "buffer": buffer, "byteLength": bytes.len() }));
    accessor["bufferView"] = json!(view);
    push(document, "accessors", accessor)
}

/// Adds an accessor of floats; `kind`: as glTF has it, `VEC3`.
pub fn push_floats(document: &mut Value, values: &[f32], kind: &str) -> usize {
    let width = kind.trim_start_matches("VEC").parse().unwrap_or(1);
    let accessor = json!({ "componentType": 5126, "count": values.len() / width, "type": kind });
    push_accessor(document, &floats(values), accessor)
}

/// Gives the triangle a material.
pub fn set_material(document: &mut Value, material: Value) {
    document["materials"] = json!([material]);
    document["meshes"][0]["primitives"][0]["material"] = json!(0);
}

/// Gives the file lights, and the first of them to the first node.
pub fn set_lights(document: &mut Value, lights: Value) {
    document["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    document["extensions"] = json!({ "KHR_lights_punctual": { "lights": lights } });
    document["nodes"][0]["extensions"] = json!({ "KHR_lights_punctual": { "light": 0 } });
}

pub fn first_mesh(library: &Library) -> &Mesh {
    &library.mesh_in_slot(0).unwrap().1.mesh
}

pub fn uri_of(bytes: &[u8]) -> Value {
    let data = base64::engine::general_purpose::STANDARD.encode(bytes);
    json!({ "uri": format!("data:application/octet-stream;base64,{data}") })
}

pub fn png_of(rgb: [u8; 3]) -> Value {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::RgbImage::from_pixel(4, 4, image::Rgb(rgb)).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    uri_of(&bytes.into_inner())
}
