//! Rules of glTF that reading does not depend on: a file that breaks one loads, with a warning.
//!
//! What reading does depend on is checked where it is read. Here are also the faults of views and accessors that
//! nothing may use.

use super::accessors::{Accessor, Component};
use super::document::{Document, id_of, items, uint};
use super::report::Report;
use super::shape::declared;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

const VERTEX_TARGET: usize = 34962;
const INDEX_TARGET: usize = 34963;

/// Warns of all of them.
pub fn check(document: &Document, report: &mut Report) {
    views_and_accessors(document, report);
    let uv_sets: Vec<BTreeSet<String>> = document.array("materials").iter().map(uv_sets).collect();
    for (m, mesh) in document.array("meshes").iter().enumerate() {
        let primitives = items(&mesh["primitives"]);
        let targets = |p: &Value| items(&p["targets"]).len();
        if primitives.windows(2).any(|pair| targets(&pair[0]) != targets(&pair[1])) {
            report.warn(format!("meshes[{m}].primitives"), "expected as many morph targets in each");
        }
        for (p, primitive) in primitives.iter().enumerate() {
            let place = format!("meshes[{m}].primitives[{p}]");
            indices(document, primitive, &place, report);
            attributes(document, primitive, &place, report);
            let material = id_of(primitive, "material");
            for name in material.and_then(|id| uv_sets.get(id)).into_iter().flatten() {
                if primitive["attributes"].get(name).is_none() {
                    report.warn(format!("{place}.attributes"), format!("its material needs {name}"));
                }
            }
        }
    }
    shared_views(document, report);
    for (n, node) in document.array("nodes").iter().enumerate() {
        node_and_mesh(document, node, &format!("nodes[{n}]"), report);
    }
    for (s, skin) in document.array("skins").iter().enumerate() {
        if id_of(skin, "inverseBindMatrices").is_some_and(|id| stride(document, id).is_some()) {
            report.warn(format!("skins[{s}].inverseBindMatrices"), "its buffer view may have no byteStride");
        }
    }
    if declared(&document.root, "extensionsUsed", "KHR_mesh_quantization")
        && !declared(&document.root, "extensionsRequired", "KHR_mesh_quantization")
    {
        report.warn("extensionsUsed", "KHR_mesh_quantization must be listed in extensionsRequired too");
    }
}

fn views_and_accessors(document: &Document, report: &mut Report) {
    for (id, view) in document.array("bufferViews").iter().enumerate() {
        if !uint(view, "byteStride").is_multiple_of(4) {
            report.warn(format!("bufferViews[{id}].byteStride"), "expected a multiple of 4 bytes");
        }
        if let Err(fault) = document.view(id) {
            report.fault(false, fault);
        }
    }
    for id in 0..document.array("accessors").len() {
        match Accessor::new(document, id) {
            Ok(accessor) => accessor.check(report),
            Err(fault) => report.fault(false, fault),
        }
    }
}

fn view(document: &Document, accessor: usize) -> &Value {
    let view = id_of(&document.root["accessors"][accessor], "bufferView");
    view.map_or(&Value::Null, |view| &document.root["bufferViews"][view])
}

fn stride(document: &Document, accessor: usize) -> Option<usize> {
    id_of(view(document, accessor), "byteStride")
}

fn indices(document: &Document, primitive: &Value, place: &str, report: &mut Report) {
    let Some(id) = id_of(primitive, "indices") else { return };
    if stride(document, id).is_some() {
        report.warn(format!("{place}.indices"), "its buffer view may have no byteStride");
    }
    if uint(view(document, id), "target") == VERTEX_TARGET {
        report.warn(format!("{place}.indices"), "its buffer view is declared for vertices");
    }
}

fn attributes(document: &Document, primitive: &Value, place: &str, report: &mut Report) {
    let Some(attributes) = primitive["attributes"].as_object() else { return };
    let sets = |semantic: &str| attributes.keys().filter(|name| name.starts_with(semantic)).count();
    if sets("JOINTS_") != sets("WEIGHTS_") {
        report.warn(format!("{place}.attributes"), "expected as many sets of joints as of weights");
    }
    for name in attributes.keys() {
        let Some(id) = id_of(&primitive["attributes"], name) else { continue };
        let place = format!("{place}.attributes.{name}");
        if uint(view(document, id), "target") == INDEX_TARGET {
            report.warn(&*place, "its buffer view is declared for indices");
        }
        let Ok(accessor) = Accessor::new(document, id) else { continue };
        if accessor.component == Component::U32 {
            report.warn(&*place, "glTF does not allow 32-bit integers in attributes");
        }
        let json = &document.root["accessors"][id];
        if name == "POSITION" && (items(&json["min"]).is_empty() || items(&json["max"]).is_empty()) {
            report.warn(place, "expected min and max");
        }
    }
}

/// The attributes that a material's textures are placed by.
fn uv_sets(material: &Value) -> BTreeSet<String> {
    let mut open = vec![material];
    let mut names = BTreeSet::new();
    while let Some(value) = open.pop() {
        if value.get("index").is_some() {
            let transform = id_of(&value["extensions"]["KHR_texture_transform"], "texCoord");
            names.insert(format!("TEXCOORD_{}", transform.unwrap_or(uint(value, "texCoord"))));
        }
        open.extend(value.as_object().into_iter().flat_map(|o| o.values()).filter(|v| v.is_object()));
    }
    names
}

/// Vertex attributes that share a view must say how far apart their elements are.
fn shared_views(document: &Document, report: &mut Report) {
    let mut users: BTreeMap<usize, usize> = BTreeMap::new();
    for primitive in document.array("meshes").iter().flat_map(|mesh| items(&mesh["primitives"])) {
        let targets = items(&primitive["targets"]).iter().chain([&primitive["attributes"]]);
        for attributes in targets {
            for name in attributes.as_object().into_iter().flat_map(|a| a.keys()) {
                let Some(id) = id_of(attributes, name) else { continue };
                let Some(view) = id_of(&document.root["accessors"][id], "bufferView") else { continue };
                let known = *users.entry(view).or_insert(id);
                if known != id && document.root["bufferViews"][view].get("byteStride").is_none() {
                    let message = format!("expected, since accessors[{known}] and accessors[{id}] share the view");
                    report.warn(format!("bufferViews[{view}].byteStride"), message);
                }
            }
        }
    }
}

fn node_and_mesh(document: &Document, node: &Value, place: &str, report: &mut Report) {
    let Some(mesh) = id_of(node, "mesh") else {
        for key in ["skin", "weights"].into_iter().filter(|key| node.get(key).is_some()) {
            report.warn(format!("{place}.{key}"), "has no meaning without a mesh");
        }
        return;
    };
    let primitives = items(&document.root["meshes"][mesh]["primitives"]);
    let targets = primitives.first().map_or(0, |p| items(&p["targets"]).len());
    let weights = items(&node["weights"]).len();
    if node.get("weights").is_some() && weights != targets {
        report
            .warn(format!("{place}.weights"), format!("expected {targets}, one for each morph target, has {weights}"));
    }
    if node.get("skin").is_some() && primitives.iter().any(|p| p["attributes"].get("JOINTS_0").is_none()) {
        report.warn(format!("{place}.skin"), format!("meshes[{mesh}] has no joints: drawn at its node"));
    }
}
