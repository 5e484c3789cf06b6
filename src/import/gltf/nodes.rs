//! The node hierarchy: a forest, checked as one, with transforms, lights, cameras and instances.

use super::accessors::Accessor;
use super::document::{Document, id_of, items, real, uint, vec3, vec4};
use super::report::{Fault, Read, Report};
use super::shape::whole;
use crate::import::Node;
use bevy_transform::components::Transform;
use glam::{Mat3, Mat4, Quat, Vec3, Vec4};
use serde_json::Value;
use std::collections::BTreeSet;
use std::f32::consts::{FRAC_PI_4, PI};
use systems::components::{Camera, Light, LightKind, Projection};

/// Deeper nesting than any tool writes; despawning recurses through it.
const MAX_DEPTH: usize = 512;
/// Half angle of the widest spot light, radians.
const MAX_CONE: f32 = 85.0 * PI / 180.0;
/// How far a quaternion's length may be from 1: what the reference validator allows.
const UNIT_TOLERANCE: f32 = 0.00769;

/// The nodes with their places, whatever scene they are in.
pub struct Hierarchy {
    pub nodes: Vec<Node>,
    /// `model_from_node`, exact also where a matrix shears.
    pub model_from_node: Vec<Mat4>,
}

/// Reads the hierarchy; meshes come later.
pub fn read(document: &Document, report: &mut Report) -> Read<Hierarchy> {
    let json = document.array("nodes");
    let order = parents_first(json)?;
    let cameras: Vec<Option<Camera>> =
        (0..document.array("cameras").len()).map(|id| camera(document, id, report)).collect();
    let lights = items(&document.root["extensions"]["KHR_lights_punctual"]["lights"]);
    let lights: Vec<Light> = lights.iter().enumerate().map(|(id, json)| light(json, id, report)).collect();
    let mut nodes = Vec::with_capacity(json.len());
    let mut parent_from_node = Vec::with_capacity(json.len());
    for (i, node) in json.iter().enumerate() {
        let place = format!("nodes[{i}]");
        let (transform, matrix) = placement(node, &place, report);
        parent_from_node.push(matrix);
        nodes.push(Node {
            name: super::document::name_or(node, || format!("node {i}")),
            transform,
            children: children(node).collect(),
            camera: id_of(node, "camera").and_then(|id| cameras.get(id)?.clone()),
            light: id_of(&node["extensions"]["KHR_lights_punctual"], "light").and_then(|id| lights.get(id).cloned()),
            ..Node::default()
        });
    }
    let mut model_from_node = parent_from_node;
    for &(parent, node) in &order {
        if let Some(parent) = parent {
            model_from_node[node] = model_from_node[parent] * model_from_node[node];
        }
        if !model_from_node[node].is_finite() {
            return Err(Fault::invalid(format!("nodes[{node}]"), "its place in the scene is not finite"));
        }
    }
    Ok(Hierarchy { nodes, model_from_node })
}

fn children(node: &Value) -> impl Iterator<Item = usize> {
    items(&node["children"]).iter().filter_map(whole).map(|id| id as usize)
}

/// All nodes with their parents, parents before children. Refuses what is not a forest.
fn parents_first(nodes: &[Value]) -> Read<Vec<(Option<usize>, usize)>> {
    let mut parents: Vec<Option<usize>> = vec![None; nodes.len()];
    for (i, node) in nodes.iter().enumerate() {
        for (c, child) in children(node).enumerate() {
            let place = format!("nodes[{i}].children[{c}]");
            if child == i {
                return Err(Fault::invalid(place, "a node cannot be its own child"));
            }
            if let Some(other) = parents[child].replace(i) {
                return Err(Fault::invalid(place, format!("nodes[{child}] is a child of nodes[{other}] already")));
            }
        }
    }
    let mut order = Vec::with_capacity(nodes.len());
    let mut open: Vec<(usize, usize)> = (0..nodes.len()).filter(|&i| parents[i].is_none()).map(|i| (i, 1)).collect();
    while let Some((node, depth)) = open.pop() {
        if depth > MAX_DEPTH {
            let message = format!("nested deeper than {MAX_DEPTH} nodes");
            return Err(Fault::unsupported(format!("nodes[{node}]"), message));
        }
        order.push((parents[node], node));
        open.extend(children(&nodes[node]).map(|child| (child, depth + 1)));
    }
    if order.len() < nodes.len() {
        let mut reached = vec![false; nodes.len()];
        order.iter().for_each(|&(_, node)| reached[node] = true);
        let first = reached.iter().position(|r| !r).unwrap_or(0);
        return Err(Fault::invalid(format!("nodes[{first}]"), "is its own ancestor: the nodes form a cycle"));
    }
    Ok(order)
}

/// The root nodes of the default scene, or of the first where none is named, and the scene's name.
pub fn scene<'a>(document: &'a Document, report: &mut Report) -> (Vec<usize>, Option<&'a str>) {
    let id = uint(&document.root, "scene");
    let mut has_parent = vec![false; document.array("nodes").len()];
    document.array("nodes").iter().flat_map(children).for_each(|child| has_parent[child] = true);
    let mut shown = (Vec::new(), None);
    for (s, scene) in document.array("scenes").iter().enumerate() {
        let mut roots = Vec::new();
        let mut listed = BTreeSet::new();
        for (i, root) in items(&scene["nodes"]).iter().filter_map(whole).map(|n| n as usize).enumerate() {
            let place = format!("scenes[{s}].nodes[{i}]");
            if has_parent[root] {
                report.fault(s == id, Fault::invalid(place, format!("nodes[{root}] is not a root: it has a parent")));
            } else if !listed.insert(root) {
                report.warn(place, format!("nodes[{root}] is listed twice"));
            } else {
                roots.push(root);
            }
        }
        if s == id {
            shown = (roots, scene["name"].as_str());
        }
    }
    if document.array("scenes").is_empty() {
        report.warn("scenes", "the file has no scene: nothing is drawn");
    }
    shown
}

fn placement(node: &Value, place: &str, report: &mut Report) -> (Transform, Mat4) {
    if let Some(columns) = super::document::reals::<16>(node, "matrix") {
        if ["translation", "rotation", "scale"].iter().any(|k| node.get(k).is_some()) {
            report.warn(format!("{place}.matrix"), "translation, rotation and scale beside a matrix are ignored");
        }
        let matrix = Mat4::from_cols_array(&columns);
        if columns[3] != 0.0 || columns[7] != 0.0 || columns[11] != 0.0 || columns[15] != 1.0 {
            report.warn(format!("{place}.matrix"), "expected a last row of 0, 0, 0, 1: treated as such");
        }
        let affine = Mat4::from_cols(
            matrix.x_axis.truncate().extend(0.0),
            matrix.y_axis.truncate().extend(0.0),
            matrix.z_axis.truncate().extend(0.0),
            matrix.w_axis.truncate().extend(1.0),
        );
        let transform = decompose(affine);
        let largest = affine.to_cols_array().into_iter().fold(0.0f32, |m, v| m.max(v.abs()));
        if !transform.to_matrix().abs_diff_eq(affine, 1e-4 * largest) {
            let message = "shears, which translation, rotation and scale cannot express: drawn without the shear";
            report.warn(format!("{place}.matrix"), message);
        }
        return (transform, affine);
    }
    let given = vec4(node, "rotation", Vec4::W);
    let rotation = Quat::from_vec4(given);
    if (given.length() - 1.0).abs() > UNIT_TOLERANCE {
        report
            .warn(format!("{place}.rotation"), format!("expected a unit quaternion, its length is {}", given.length()));
    }
    let rotation = if given.length() > 1e-6 { rotation.normalize() } else { Quat::IDENTITY };
    let transform = Transform {
        translation: vec3(node, "translation", Vec3::ZERO),
        rotation,
        scale: vec3(node, "scale", Vec3::ONE),
    };
    (transform, transform.to_matrix())
}

/// Translation, rotation and scale of an affine matrix; a mirror becomes a negative x scale, shear is lost, and an axis
/// of no length gets a direction that suits the others.
fn decompose(matrix: Mat4) -> Transform {
    let m = Mat3::from_mat4(matrix);
    let mirror = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
    let scale = Vec3::new(m.x_axis.length() * mirror, m.y_axis.length(), m.z_axis.length());
    let across = |axis: Vec3| axis.try_normalize().map(Vec3::any_orthonormal_vector);
    let x = (m.x_axis * mirror).try_normalize().or_else(|| m.y_axis.cross(m.z_axis).try_normalize());
    let x = x.or_else(|| across(m.y_axis)).or_else(|| across(m.z_axis)).unwrap_or(Vec3::X);
    let y = m.y_axis.reject_from_normalized(x).try_normalize().or_else(|| m.z_axis.cross(x).try_normalize());
    let y = y.unwrap_or_else(|| x.any_orthonormal_vector());
    let rotation = Quat::from_mat3(&Mat3::from_cols(x, y, x.cross(y))).normalize();
    Transform { translation: matrix.w_axis.truncate(), rotation, scale }
}

/// KHR_lights_punctual. Its candela and lux light a white diffuse surface to 1/π of what ours do.
fn light(json: &Value, id: usize, report: &mut Report) -> Light {
    let place = format!("extensions.KHR_lights_punctual.lights[{id}]");
    let intensity = real(json, "intensity", 1.0) / PI;
    let range = real(json, "range", f32::INFINITY);
    let light = match json["type"].as_str() {
        Some("directional") => Light::directional(intensity),
        Some("spot") => {
            let spot = &json["spot"];
            if spot.is_null() {
                report.warn(format!("{place}.spot"), "expected for a spot light: the default cone");
            }
            let mut outer = real(spot, "outerConeAngle", FRAC_PI_4);
            let mut inner = real(spot, "innerConeAngle", 0.0);
            if inner >= outer {
                report.warn(format!("{place}.spot"), "expected innerConeAngle to be less than outerConeAngle");
            }
            if outer > MAX_CONE {
                report.warn(format!("{place}.spot.outerConeAngle"), "wider than 85°: drawn as 85°");
                outer = MAX_CONE;
            }
            outer = outer.max(1e-3);
            inner = inner.min(outer * 0.999);
            Light {
                kind: LightKind::Spot { outer, inner: Some(inner), exponent: 0.0 },
                attenuation: Vec3::Z,
                ..Light::point(intensity, range)
            }
        }
        kind => {
            if kind != Some("point") {
                report.warn(format!("{place}.type"), "unknown: drawn as a point light");
            }
            Light { attenuation: Vec3::Z, ..Light::point(intensity, range) }
        }
    };
    light.with_color(vec3(json, "color", Vec3::ONE))
}

fn camera(document: &Document, id: usize, report: &mut Report) -> Option<Camera> {
    let json = &document.root["cameras"][id];
    let place = format!("cameras[{id}]");
    let kind = json["type"].as_str().unwrap_or_default();
    let Some(lens) = json.get(kind).filter(|_| ["perspective", "orthographic"].contains(&kind)) else {
        report.invalid(place, format!("expected the property {kind:?} that its type names"));
        return None;
    };
    if json.get("perspective").is_some() && json.get("orthographic").is_some() {
        report.warn(&*place, format!("only its type, {kind}, is read"));
    }
    let (near, far) = (real(lens, "znear", 0.1), real(lens, "zfar", f32::INFINITY));
    let magnification = real(lens, "ymag", 1.0).abs();
    let angle = real(lens, "yfov", FRAC_PI_4);
    if far <= near {
        report.invalid(format!("{place}.{kind}.zfar"), format!("expected more than znear, {near}"));
    }
    if kind == "orthographic" && (magnification == 0.0 || real(lens, "xmag", 1.0) == 0.0) {
        report.invalid(format!("{place}.{kind}.ymag"), "expected xmag and ymag other than 0");
    }
    if angle >= PI {
        report.invalid(format!("{place}.{kind}.yfov"), "expected an angle below π");
    }
    let projection = match kind {
        "orthographic" => Projection::Orthographic { half_height: magnification },
        _ => Projection::Perspective { fov_y: angle, aspect: lens["aspectRatio"].as_f64().map(|a| a as f32) },
    };
    Some(Camera { projection, near, far })
}

/// EXT_mesh_gpu_instancing: where the node's mesh is drawn, relative to the node.
pub fn instances(document: &Document, node: usize, report: &mut Report) -> Read<Vec<Transform>> {
    let place = format!("nodes[{node}].extensions.EXT_mesh_gpu_instancing.attributes");
    let attributes = &document.root["nodes"][node]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
    let mut instances: Vec<Transform> = Vec::new();
    for key in ["TRANSLATION", "ROTATION", "SCALE"] {
        let Some(id) = id_of(attributes, key) else { continue };
        let accessor = Accessor::new(document, id)?;
        let place = format!("{place}.{key}");
        if instances.is_empty() {
            document.spend(accessor.count.saturating_mul(size_of::<Transform>()), &place)?;
            instances = vec![Transform::IDENTITY; accessor.count];
        } else if instances.len() != accessor.count {
            let message = format!("expected {} elements as the others have, has {}", instances.len(), accessor.count);
            return Err(Fault::invalid(place, message));
        }
        let finite = |values: &[f32]| {
            let fault = || Fault::invalid(&*place, "expected finite numbers");
            values.iter().all(|v| v.is_finite()).then_some(()).ok_or_else(fault)
        };
        if key == "ROTATION" {
            for (instance, q) in instances.iter_mut().zip(accessor.elements::<4, f32>(|v| v as f32)?) {
                finite(&q)?;
                let q = Vec4::from_array(q);
                instance.rotation = q.try_normalize().map_or(Quat::IDENTITY, Quat::from_vec4);
            }
        } else {
            for (instance, v) in instances.iter_mut().zip(accessor.elements::<3, f32>(|v| v as f32)?) {
                finite(&v)?;
                let target = if key == "SCALE" { &mut instance.scale } else { &mut instance.translation };
                *target = Vec3::from_array(v);
            }
        }
    }
    if instances.is_empty() && !attributes.is_null() {
        report.warn(place, "expected TRANSLATION, ROTATION or SCALE: drawn once");
    }
    Ok(instances)
}
