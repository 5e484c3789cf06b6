//! Rules of glTF that reading does not depend on: a file that breaks one loads, with a warning.
//!
//! Rules that reading does depend on are checked where it reads. Here are also the faults of views and accessors that
//! nothing may use.

use super::document::accessors::Accessor;
use super::document::data::{Document, id_of};
use super::files::uri;
use super::materials::material;
use super::report::Report;
use gltf::buffer::Target;
use gltf::json::validation::Checked;
use gltf::mesh::Semantic;
use serde_json::Value;
use std::collections::BTreeMap;

/// Warns of all of them.
pub fn check(document: &Document, report: &mut Report) {
    views_and_accessors(document, report);
    let buffers = document.json().buffers.iter().map(|buffer| ("buffers", buffer.uri.as_deref())).enumerate();
    let images = document.json().images.iter().map(|image| ("images", image.uri.as_deref())).enumerate();
    for (id, (list, uri)) in buffers.chain(images) {
        if uri.is_some_and(uri::has_backslashes) {
            report.warn(format!("{list}[{id}].uri"), "has backslashes, which are read as /: URIs have / alone");
        }
    }
    for mesh in document.gltf.meshes() {
        let place = format!("meshes[{}].primitives", mesh.index());
        let targets: Vec<usize> = mesh.primitives().map(|primitive| primitive.morph_targets().len()).collect();
        if targets.windows(2).any(|pair| pair[0] != pair[1]) {
            report.warn(&*place, "expected as many morph targets in each");
        }
        for primitive in mesh.primitives() {
            let place = format!("{place}[{}]", primitive.index());
            indices(document, &primitive, &place, report);
            attributes(document, &primitive, &format!("{place}.attributes"), report);
        }
    }
    shared_views(document, report);
    document.gltf.nodes().for_each(|node| node_and_mesh(&node, report));
    for skin in document.gltf.skins() {
        if skin.inverse_bind_matrices().is_some_and(|accessor| has_stride(document, accessor.index())) {
            let place = format!("skins[{}].inverseBindMatrices", skin.index());
            report.warn(place, "its buffer view may have no byteStride");
        }
    }
    let required = document.gltf.extensions_required().any(|name| name == "KHR_mesh_quantization");
    if document.quantized && !required {
        report.warn("extensionsUsed", "KHR_mesh_quantization must be listed in extensionsRequired too");
    }
}

fn views_and_accessors(document: &Document, report: &mut Report) {
    for id in 0..document.gltf.views().len() {
        if document.stride(id).is_some_and(|stride| !stride.is_multiple_of(4)) {
            report.warn(format!("bufferViews[{id}].byteStride"), "expected a multiple of 4 bytes");
        }
        if let Err(fault) = document.view(id) {
            report.fault(false, fault);
        }
    }
    for id in 0..document.gltf.accessors().len() {
        match Accessor::new(document, id) {
            Ok(accessor) => accessor.check(report),
            Err(fault) => report.fault(false, fault),
        }
    }
}

fn view_of(document: &Document, accessor: usize) -> Option<usize> {
    id_of(document.json().accessors[accessor].buffer_view)
}

fn has_stride(document: &Document, accessor: usize) -> bool {
    view_of(document, accessor).is_some_and(|view| document.stride(view).is_some())
}

/// Tells if the view behind an accessor is declared for that use.
fn is_for(document: &Document, accessor: usize, target: Target) -> bool {
    let view = view_of(document, accessor).map(|view| &document.json().buffer_views[view]);
    view.is_some_and(|view| view.target == Some(Checked::Valid(target)))
}

fn indices(document: &Document, primitive: &gltf::Primitive, place: &str, report: &mut Report) {
    let Some(id) = primitive.indices().map(|accessor| accessor.index()) else { return };
    if has_stride(document, id) {
        report.warn(format!("{place}.indices"), "its buffer view may have no byteStride");
    }
    if is_for(document, id, Target::ArrayBuffer) {
        report.warn(format!("{place}.indices"), "its buffer view is declared for vertices");
    }
}

fn attributes(document: &Document, primitive: &gltf::Primitive, place: &str, report: &mut Report) {
    let (mut joints, mut weights) = (0, 0);
    for (semantic, accessor) in primitive.attributes() {
        let (id, place) = (accessor.index(), format!("{place}.{}", semantic.to_string()));
        let before = match semantic {
            Semantic::TexCoords(set) => set.checked_sub(1).map(Semantic::TexCoords),
            Semantic::Colors(set) => set.checked_sub(1).map(Semantic::Colors),
            Semantic::Joints(set) => {
                joints += 1;
                set.checked_sub(1).map(Semantic::Joints)
            }
            Semantic::Weights(set) => {
                weights += 1;
                set.checked_sub(1).map(Semantic::Weights)
            }
            _ => None,
        };
        if let Some(before) = before.filter(|before| primitive.get(before).is_none()) {
            report.warn(&*place, format!("without {}", before.to_string()));
        }
        if is_for(document, id, Target::ElementArrayBuffer) {
            report.warn(&*place, "its buffer view is declared for indices");
        }
        let json = &document.json().accessors[id];
        let stated = |bound: &Option<Value>| bound.as_ref().and_then(Value::as_array).is_some_and(|b| !b.is_empty());
        if semantic == Semantic::Positions && !(stated(&json.min) && stated(&json.max)) {
            report.warn(place, "expected min and max");
        }
    }
    if joints != weights {
        report.warn(place, "expected as many sets of joints as of weights");
    }
    for info in material::textures(&primitive.material()) {
        let semantic = Semantic::TexCoords(info.uv_set);
        if primitive.get(&semantic).is_none() {
            report.warn(place, format!("its material needs {}", semantic.to_string()));
        }
    }
}

/// Vertex attributes that share a view must say how far apart their elements are.
fn shared_views(document: &Document, report: &mut Report) {
    let mut users: BTreeMap<usize, usize> = BTreeMap::new();
    for primitive in document.gltf.meshes().flat_map(|mesh| mesh.primitives()) {
        let targets = primitive.morph_targets().flat_map(|t| [t.positions(), t.normals(), t.tangents()]).flatten();
        for accessor in targets.chain(primitive.attributes().map(|(_, accessor)| accessor)) {
            let id = accessor.index();
            let Some(view) = view_of(document, id) else { continue };
            let known = *users.entry(view).or_insert(id);
            if known != id && document.stride(view).is_none() {
                let message = format!("expected, since accessors[{known}] and accessors[{id}] share the view");
                report.warn(format!("bufferViews[{view}].byteStride"), message);
            }
        }
    }
}

fn node_and_mesh(node: &gltf::Node, report: &mut Report) {
    let place = format!("nodes[{}]", node.index());
    let Some(mesh) = node.mesh() else {
        for (key, given) in [("skin", node.skin().is_some()), ("weights", node.weights().is_some())] {
            if given {
                report.warn(format!("{place}.{key}"), "has no meaning without a mesh");
            }
        }
        return;
    };
    let targets = mesh.primitives().next().map_or(0, |primitive| primitive.morph_targets().len());
    if let Some(weights) = node.weights().filter(|weights| weights.len() != targets) {
        let message = format!("expected {targets}, one for each morph target, found {}", weights.len());
        report.warn(format!("{place}.weights"), message);
    }
    if node.skin().is_some() && mesh.primitives().any(|primitive| primitive.get(&Semantic::Joints(0)).is_none()) {
        report.warn(format!("{place}.skin"), format!("meshes[{}] has no joints: drawn at its node", mesh.index()));
    }
}
