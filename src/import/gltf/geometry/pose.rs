//! The rest pose: morph targets at their default weights, skins at their joints' places in the file.

use crate::import::gltf::document::accessors::Accessor;
use crate::import::gltf::document::data::Document;
use crate::import::gltf::report::{Fault, Read};
use glam::{Mat3, Mat4, Vec3, Vec4};
use gltf::Semantic;

/// Morph weights and skin matrices of a mesh at a node.
#[derive(Default)]
pub struct Pose {
    /// One per morph target; missing ones are 0.
    pub weights: Vec<f32>,
    /// Matrices of the node's skin, one per joint.
    pub node_from_bind: Option<Vec<Mat4>>,
}

impl Pose {
    /// The pose of a mesh at a node.
    pub fn new(document: &Document, mesh: &gltf::Mesh, node: &gltf::Node, model_from_node: &[Mat4]) -> Read<Self> {
        let weights = node.weights().or(mesh.weights()).unwrap_or_default().to_vec();
        let skin = node.skin();
        let node_from_bind =
            skin.map(|skin| node_from_bind(document, &skin, node.index(), model_from_node)).transpose()?;
        Ok(Self { weights, node_from_bind })
    }
}

/// A skinned mesh ignores its node's place (glTF 2.0, section 3.7.3.3), so that is divided out again.
fn node_from_bind(document: &Document, skin: &gltf::Skin, node: usize, model_from_node: &[Mat4]) -> Read<Vec<Mat4>> {
    let joints: Vec<usize> = skin.joints().map(|joint| joint.index()).collect();
    let mut inverse_bind = vec![Mat4::IDENTITY; joints.len()];
    if let Some(accessor) = skin.inverse_bind_matrices() {
        let matrices = Accessor::new(document, accessor.index())?.elements::<16, f32>(|v| v as f32)?;
        if matrices.len() < joints.len() {
            let message = format!("expected a matrix for each of {} joints, found {}", joints.len(), matrices.len());
            return Err(Fault::invalid(format!("skins[{}].inverseBindMatrices", skin.index()), message));
        }
        for (target, matrix) in inverse_bind.iter_mut().zip(&matrices) {
            *target = Mat4::from_cols_array(matrix);
        }
    }
    let place = format!("nodes[{node}].skin");
    let node_from_model = model_from_node[node].try_inverse();
    let node_from_model = node_from_model
        .ok_or_else(|| Fault::unsupported(place, "the node's matrix cannot be inverted for its skin"))?;
    let posed = joints.iter().zip(inverse_bind);
    Ok(posed.map(|(&joint, bind)| node_from_model * model_from_node[joint] * bind).collect())
}

/// The attributes that a pose changes.
pub struct Posed {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub tangents: Vec<Vec4>,
}

impl Posed {
    /// Adds a morph target's deltas to the attribute.
    pub fn add(&mut self, attribute: &Semantic, weight: f32, deltas: impl Iterator<Item = Vec3>) {
        match attribute {
            Semantic::Positions => self.positions.iter_mut().zip(deltas).for_each(|(p, d)| *p += d * weight),
            Semantic::Normals => self.normals.iter_mut().zip(deltas).for_each(|(n, d)| *n += d * weight),
            _ => self.tangents.iter_mut().zip(deltas).for_each(|(t, d)| *t += (d * weight).extend(0.0)),
        }
    }

    /// Moves a vertex by the weighted mean of its joints' matrices.
    pub fn skin(&mut self, vertex: usize, joints: impl Iterator<Item = (Mat4, f32)>) {
        let (mut matrix, mut total) = (Mat4::ZERO, 0.0);
        for (joint, weight) in joints.filter(|&(_, w)| w > 0.0) {
            matrix += joint * weight;
            total += weight;
        }
        if total <= 0.0 {
            return;
        }
        matrix *= 1.0 / total;
        self.positions[vertex] = matrix.transform_point3(self.positions[vertex]);
        let linear = Mat3::from_mat4(matrix);
        if let Some(normal) = self.normals.get_mut(vertex) {
            // The cofactor matrix is the inverse transpose up to a factor, and exists for every matrix.
            let cofactor = Mat3::from_cols(
                linear.y_axis.cross(linear.z_axis),
                linear.z_axis.cross(linear.x_axis),
                linear.x_axis.cross(linear.y_axis),
            );
            *normal = (cofactor * *normal * linear.determinant().signum()).normalize_or(*normal);
        }
        if let Some(tangent) = self.tangents.get_mut(vertex) {
            *tangent = (linear * tangent.truncate()).normalize_or(tangent.truncate()).extend(tangent.w);
        }
    }
}
