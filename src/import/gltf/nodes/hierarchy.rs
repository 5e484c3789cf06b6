//! The node hierarchy: a forest, checked as one, with transforms, lights, cameras and instances.

use crate::import::gltf::document::accessors::Accessor;
use crate::import::gltf::document::data::{Document, id_of, name_or};
use crate::import::gltf::report::{Fault, Read, Report};
use crate::import::model::{Node, RoomRole};
use glam::{Mat3, Mat4, Quat, Vec3, Vec4};
use gltf::json::camera::Type as Lens;
use gltf::json::extensions::scene::khr_lights_punctual as punctual;
use gltf::json::validation::Checked;
use serde::Deserialize;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::f32::consts::{FRAC_PI_4, PI};
use systems::draw::{Camera, Projection};
use systems::lights::{Light, LightKind};
use systems::space::Transform;

/// Deeper nesting than any tool writes; despawning recurses through it.
const MAX_DEPTH: usize = 512;
/// Half angles of the narrowest and the widest spot light, radians.
const MIN_CONE: f32 = 1e-3;
const MAX_CONE: f32 = 85.0 * PI / 180.0;
/// Tolerance of a quaternion's length around 1: that of the reference validator.
const UNIT_TOLERANCE: f32 = 0.00769;

/// The nodes with their places, whatever scene they are in.
pub struct Hierarchy {
    pub nodes: Vec<Node>,
    /// `model_from_node`, exact also where a matrix shears.
    pub model_from_node: Vec<Mat4>,
}

/// Reads the hierarchy, with what nodes are in place of objects; meshes come later.
pub fn read(document: &Document, mut rooms: BTreeMap<usize, RoomRole>, report: &mut Report) -> Read<Hierarchy> {
    let children: Vec<Vec<usize>> =
        document.gltf.nodes().map(|node| node.children().map(|child| child.index()).collect()).collect();
    let order = parents_first(&children)?;
    let cameras = document.json().cameras.iter().enumerate();
    let cameras: Vec<Option<Camera>> = cameras.map(|(id, json)| camera(json, id, report)).collect();
    let lights = document.json().extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
    let lights = lights.into_iter().flat_map(|extension| &extension.lights).enumerate();
    let lights: Vec<Light> = lights.map(|(id, json)| light(json, id, report)).collect();
    let (mut nodes, mut parent_from_node) = (Vec::new(), Vec::new());
    for (node, children) in document.gltf.nodes().zip(children) {
        let (transform, matrix) = placement(document, &node, report);
        if !transform.is_finite() {
            return Err(Fault::invalid(format!("nodes[{}]", node.index()), "its transform in the scene is not finite"));
        }
        parent_from_node.push(matrix);
        nodes.push(Node {
            name: name_or(node.name(), || format!("node {}", node.index())),
            transform,
            children,
            camera: node.camera().and_then(|camera| cameras[camera.index()].clone()),
            room: rooms.remove(&node.index()),
            light: node.light().and_then(|light| lights.get(light.index()).cloned()),
            ..Node::default()
        });
    }
    let mut model_from_node = parent_from_node;
    for &(parent, node) in &order {
        if let Some(parent) = parent {
            model_from_node[node] = model_from_node[parent] * model_from_node[node];
        }
        if !model_from_node[node].is_finite() {
            return Err(Fault::invalid(format!("nodes[{node}]"), "its transform in the scene is not finite"));
        }
    }
    keep_aim(&mut nodes, &order, &model_from_node);
    Ok(Hierarchy { nodes, model_from_node })
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum RoomExtras {
    Cell(String),
    Portal(Vec<String>),
}

/// Roles of nodes in place of objects, by their index, from `extras.relief`. Other extras are other programs'.
pub fn rooms(root: &Value, report: &mut Report) -> BTreeMap<usize, RoomRole> {
    let nodes = root["nodes"].as_array().into_iter().flatten().enumerate();
    let of_node = |(index, node): (usize, &Value)| {
        let extras = &node["extras"]["relief"];
        let mut warn = |message: String| {
            report.warn(format!("nodes[{index}].extras.relief"), message);
            None
        };
        let role = match RoomExtras::deserialize(extras) {
            _ if extras.is_null() => None,
            Ok(RoomExtras::Cell(name)) => Some(RoomRole::Cell(name)),
            Ok(RoomExtras::Portal(names)) => match <[String; 2]>::try_from(names) {
                Ok(names) => Some(RoomRole::Portal(Some(names))),
                Err(names) if names.is_empty() => Some(RoomRole::Portal(None)),
                Err(names) => warn(format!("expected the names of two cells, or none, found {}", names.len())),
            },
            Err(error) => warn(error.to_string()),
        };
        Some((index, role?))
    };
    nodes.filter_map(of_node).collect()
}

/// The shear of a matrix is lost to the transforms of nodes. Cameras and lights stay where they are and look where they
/// looked all the same: their own transforms make up for what was lost above them.
fn keep_aim(nodes: &mut [Node], order: &[(Option<usize>, usize)], model_from_node: &[Mat4]) {
    let mut without_shear = vec![Mat4::IDENTITY; nodes.len()];
    for &(parent, index) in order {
        let model_from_parent = parent.map_or(Mat4::IDENTITY, |parent| without_shear[parent]);
        let node = &mut nodes[index];
        let (is, should) = (model_from_parent * node.transform.to_matrix(), model_from_node[index]);
        let largest = should.to_cols_array().into_iter().fold(0.0f32, |m, v| m.max(v.abs()));
        let is_aimed = node.camera.is_some() || node.light.is_some();
        if is_aimed
            && !is.abs_diff_eq(should, 1e-4 * largest)
            && let Some(parent_from_model) = model_from_parent.try_inverse()
        {
            let [_, y, z, origin] = (parent_from_model * should).to_cols_array_2d().map(|c| Vec4::from(c).truncate());
            let scale = node.transform.scale;
            let at = Transform { translation: origin, scale, ..Transform::IDENTITY };
            node.transform = at.looking_to(-z * scale.z.signum(), y * scale.y.signum());
        }
        without_shear[index] = model_from_parent * node.transform.to_matrix();
    }
}

/// All nodes with their parents, parents before children. Refuses what is not a forest.
fn parents_first(children: &[Vec<usize>]) -> Read<Vec<(Option<usize>, usize)>> {
    let count = children.len();
    let mut parents: Vec<Option<usize>> = vec![None; count];
    for (i, children) in children.iter().enumerate() {
        for (c, &child) in children.iter().enumerate() {
            let place = format!("nodes[{i}].children[{c}]");
            if child == i {
                return Err(Fault::invalid(place, "a node cannot be its own child"));
            }
            if let Some(other) = parents[child].replace(i) {
                return Err(Fault::invalid(place, format!("nodes[{child}] is a child of nodes[{other}] already")));
            }
        }
    }
    let mut order = Vec::with_capacity(count);
    let mut open: Vec<(usize, usize)> = (0..count).filter(|&i| parents[i].is_none()).map(|i| (i, 1)).collect();
    while let Some((node, depth)) = open.pop() {
        if depth > MAX_DEPTH {
            let message = format!("nested deeper than {MAX_DEPTH} nodes");
            return Err(Fault::unsupported(format!("nodes[{node}]"), message));
        }
        order.push((parents[node], node));
        open.extend(children[node].iter().map(|&child| (child, depth + 1)));
    }
    if order.len() < count {
        let mut reached = vec![false; count];
        order.iter().for_each(|&(_, node)| reached[node] = true);
        let first = reached.iter().position(|r| !r).unwrap_or(0);
        return Err(Fault::invalid(format!("nodes[{first}]"), "is its own ancestor: the nodes form a cycle"));
    }
    Ok(order)
}

/// The root nodes of the default scene, or of the first where none is named, and the scene's name.
pub fn scene<'a>(document: &'a Document, report: &mut Report) -> (Vec<usize>, Option<&'a str>) {
    let shown_id = id_of(document.json().scene).unwrap_or(0);
    let mut has_parent = vec![false; document.gltf.nodes().len()];
    document.gltf.nodes().flat_map(|node| node.children()).for_each(|child| has_parent[child.index()] = true);
    let mut shown = (Vec::new(), None);
    for scene in document.gltf.scenes() {
        let id = scene.index();
        let mut roots = Vec::new();
        let mut listed = BTreeSet::new();
        for (i, root) in scene.nodes().map(|node| node.index()).enumerate() {
            let place = format!("scenes[{id}].nodes[{i}]");
            if has_parent[root] {
                let fault = Fault::invalid(place, format!("nodes[{root}] is not a root: it has a parent"));
                report.fault(id == shown_id, fault);
            } else if !listed.insert(root) {
                report.warn(place, format!("nodes[{root}] is listed twice"));
            } else {
                roots.push(root);
            }
        }
        if id == shown_id {
            shown = (roots, scene.name());
        }
    }
    if document.gltf.scenes().len() == 0 {
        report.warn("scenes", "the file has no scene: nothing is drawn");
    }
    shown
}

fn placement(document: &Document, node: &gltf::Node, report: &mut Report) -> (Transform, Mat4) {
    let place = format!("nodes[{}]", node.index());
    let (translation, rotation, scale) = match node.transform() {
        gltf::scene::Transform::Matrix { matrix } => {
            let json = &document.json().nodes[node.index()];
            if json.translation.is_some() || json.rotation.is_some() || json.scale.is_some() {
                let message = "translation, rotation and scale beside a matrix are ignored";
                report.warn(format!("{place}.matrix"), message);
            }
            return matrix_placement(Mat4::from_cols_array_2d(&matrix), &place, report);
        }
        gltf::scene::Transform::Decomposed { translation, rotation, scale } => (translation, rotation, scale),
    };
    let length = Vec4::from_array(rotation).length();
    if (length - 1.0).abs() > UNIT_TOLERANCE {
        report.warn(format!("{place}.rotation"), format!("expected a unit quaternion, its length is {length}"));
    }
    let rotation = if length > 1e-6 { Quat::from_array(rotation).normalize() } else { Quat::IDENTITY };
    let (translation, scale) = (Vec3::from_array(translation), Vec3::from_array(scale));
    let transform = Transform { translation, rotation, scale };
    (transform, transform.to_matrix())
}

fn matrix_placement(matrix: Mat4, place: &str, report: &mut Report) -> (Transform, Mat4) {
    if matrix.row(3) != Vec4::W {
        report.warn(format!("{place}.matrix"), "expected a last row of 0, 0, 0, 1: treated as such");
    }
    let mut affine = matrix;
    (affine.x_axis.w, affine.y_axis.w, affine.z_axis.w, affine.w_axis.w) = (0.0, 0.0, 0.0, 1.0);
    let transform = decompose(affine);
    let largest = affine.to_cols_array().into_iter().fold(0.0f32, |m, v| m.max(v.abs()));
    if !transform.to_matrix().abs_diff_eq(affine, 1e-4 * largest) {
        let message = "shears, which translation, rotation and scale cannot express: drawn without the shear";
        report.warn(format!("{place}.matrix"), message);
    }
    (transform, affine)
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
fn light(json: &punctual::Light, id: usize, report: &mut Report) -> Light {
    let place = format!("extensions.KHR_lights_punctual.lights[{id}]");
    let (intensity, range) = (json.intensity / PI, json.range.unwrap_or(f32::INFINITY));
    let point = Light { attenuation: Vec3::Z, ..Light::point(intensity, range) };
    let light = match json.type_ {
        Checked::Valid(punctual::Type::Directional) => Light::directional(intensity),
        Checked::Valid(punctual::Type::Spot) => Light { kind: cone(json.spot.as_ref(), &place, report), ..point },
        Checked::Valid(punctual::Type::Point) => point,
        Checked::Invalid => {
            report.warn(format!("{place}.type"), "unknown: drawn as a point light");
            point
        }
    };
    light.with_color(Vec3::from_array(json.color))
}

fn cone(spot: Option<&punctual::Spot>, place: &str, report: &mut Report) -> LightKind {
    if spot.is_none() {
        report.warn(format!("{place}.spot"), "expected for a spot light: the default cone");
    }
    let (inner, outer) = spot.map_or((0.0, FRAC_PI_4), |spot| (spot.inner_cone_angle, spot.outer_cone_angle));
    if inner >= outer {
        report.warn(format!("{place}.spot"), "expected innerConeAngle to be less than outerConeAngle");
    }
    if outer > MAX_CONE {
        report.warn(format!("{place}.spot.outerConeAngle"), "wider than 85°: drawn as 85°");
    }
    if outer < MIN_CONE {
        report.warn(format!("{place}.spot.outerConeAngle"), "narrower than 0.06°: drawn as 0.06°");
    }
    let outer = outer.clamp(MIN_CONE, MAX_CONE);
    LightKind::Spot { outer, inner: Some(inner.min(outer)), exponent: 0.0 }
}

fn camera(json: &gltf::json::Camera, id: usize, report: &mut Report) -> Option<Camera> {
    let place = format!("cameras[{id}]");
    let camera = match (json.type_, &json.perspective, &json.orthographic) {
        (Checked::Valid(Lens::Perspective), Some(lens), _) => {
            if lens.yfov >= PI {
                report.warn(format!("{place}.perspective.yfov"), "expected an angle below π: left out");
                return None;
            }
            let projection = Projection::Perspective { fov_y: lens.yfov, aspect: lens.aspect_ratio };
            Camera { projection, near: lens.znear, far: lens.zfar.unwrap_or(f32::INFINITY) }
        }
        (Checked::Valid(Lens::Orthographic), _, Some(lens)) => {
            if lens.ymag == 0.0 || lens.xmag == 0.0 {
                report.warn(format!("{place}.orthographic.ymag"), "expected xmag and ymag other than 0: left out");
                return None;
            }
            if lens.ymag < 0.0 || lens.xmag < 0.0 {
                report
                    .warn(format!("{place}.orthographic"), "expected xmag and ymag above 0: drawn without their signs");
            }
            let aspect = Some((lens.xmag / lens.ymag).abs()).filter(|aspect| aspect.is_normal());
            let projection = Projection::Orthographic { half_height: lens.ymag.abs(), aspect };
            Camera { projection, near: lens.znear, far: lens.zfar }
        }
        _ => {
            report.warn(place, "expected the property that its type names, perspective or orthographic: left out");
            return None;
        }
    };
    let kind = if matches!(camera.projection, Projection::Perspective { .. }) { "perspective" } else { "orthographic" };
    if camera.far <= camera.near {
        report.warn(format!("{place}.{kind}.zfar"), format!("expected more than znear, {}: left out", camera.near));
        return None;
    }
    if json.perspective.is_some() && json.orthographic.is_some() {
        report.warn(place, format!("only its type, {kind}, is read"));
    }
    Some(camera)
}

/// EXT_mesh_gpu_instancing: where the node's mesh is drawn, relative to the node.
pub fn instances(document: &Document, node: &gltf::Node, report: &mut Report) -> Read<Vec<Transform>> {
    let Some(extension) = node.extension_value("EXT_mesh_gpu_instancing") else { return Ok(Vec::new()) };
    let place = format!("nodes[{}].extensions.EXT_mesh_gpu_instancing.attributes", node.index());
    let mut instances: Vec<Transform> = Vec::new();
    for key in ["TRANSLATION", "ROTATION", "SCALE"] {
        let Some(id) = extension["attributes"][key].as_u64() else { continue };
        let accessor = Accessor::new(document, id as usize)?;
        let place = format!("{place}.{key}");
        if instances.is_empty() {
            document.spend(accessor.count.saturating_mul(size_of::<Transform>()), &place)?;
            instances = vec![Transform::IDENTITY; accessor.count];
        } else if instances.len() != accessor.count {
            let message = format!("expected {} elements as the others have, found {}", instances.len(), accessor.count);
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
    if instances.is_empty() {
        report.warn(place, "expected TRANSLATION, ROTATION or SCALE: drawn once");
    }
    Ok(instances)
}
