//! Drawn parts of the nodes: meshes and materials, each once, however often the file repeats them.

use super::hierarchy::{self, Hierarchy};
use crate::import::gltf::document::data::Document;
use crate::import::gltf::geometry::meshes::Meshes;
use crate::import::gltf::geometry::pose::Pose;
use crate::import::gltf::materials::textures::Info;
use crate::import::gltf::report::{Fault, FaultKind, Report};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::hash::{DefaultHasher, Hash, Hasher};
use systems::assets::{MaterialId, Mesh, MeshId};

/// Fills the parts and instances of the nodes that the scene shows. Returns the meshes and the materials that they need
/// (`None`: glTF's default), which the ids in the parts number from 0.
pub fn read(
    document: &Document,
    hierarchy: &mut Hierarchy,
    roots: &[usize],
    report: &mut Report,
) -> (Vec<Mesh>, Vec<Option<usize>>) {
    let mut reader = Reader {
        primitives: Meshes::new(document),
        meshes: Vec::new(),
        by_hash: HashMap::new(),
        materials: Vec::new(),
    };
    let mut known = BTreeMap::new();
    let mut shown = BTreeSet::new();
    let nodes = shown_nodes(hierarchy, roots).into_iter().filter_map(|id| document.gltf.nodes().nth(id));
    for (node, mesh) in nodes.filter_map(|node| Some((node.clone(), node.mesh()?))) {
        let id = node.index();
        shown.insert(mesh.index());
        // Nodes share a mesh, but for those that pose it in their own way.
        let own_pose = node.skin().is_some() || node.weights().is_some();
        let parts = known.entry((mesh.index(), own_pose.then_some(id)));
        let parts = parts.or_insert_with(|| {
            let pose = Pose::new(document, &mesh, &node, &hierarchy.model_from_node);
            let pose = pose.unwrap_or_else(|fault| match fault.kind {
                // A node without size, say, is sound glTF.
                FaultKind::Unsupported => {
                    report.warn(fault.place, format!("{}: drawn at its node, without it", fault.message));
                    Pose::default()
                }
                _ => refuse(fault, report),
            });
            reader.parts(&mesh, &pose, report)
        });
        hierarchy.nodes[id].parts.clone_from(parts);
        let instances = hierarchy::instances(document, &node, report);
        let required = document.gltf.extensions_required().any(|name| name == "EXT_mesh_gpu_instancing");
        hierarchy.nodes[id].instances = instances.unwrap_or_else(|fault| {
            if required {
                return refuse(fault, report);
            }
            report.warn(fault.place, format!("{}: drawn once", fault.message));
            Vec::new()
        });
    }
    for mesh in document.gltf.meshes().filter(|mesh| !shown.contains(&mesh.index())) {
        for fault in reader.primitives.read(&mesh, &Pose::default(), report).into_iter().filter_map(Result::err) {
            report.fault(false, fault);
        }
    }
    (reader.meshes, reader.materials)
}

fn refuse<T: Default>(fault: Fault, report: &mut Report) -> T {
    report.error(fault);
    T::default()
}

fn shown_nodes(hierarchy: &Hierarchy, roots: &[usize]) -> Vec<usize> {
    let mut open: Vec<usize> = roots.iter().rev().copied().collect();
    let mut shown = Vec::new();
    while let Some(node) = open.pop() {
        shown.push(node);
        open.extend(hierarchy.nodes[node].children.iter().rev());
    }
    shown
}

struct Reader<'a> {
    primitives: Meshes<'a>,
    meshes: Vec<Mesh>,
    by_hash: HashMap<u64, Vec<usize>>,
    materials: Vec<Option<usize>>,
}

impl Reader<'_> {
    fn parts(&mut self, mesh: &gltf::Mesh, pose: &Pose, report: &mut Report) -> Vec<(MeshId, MaterialId)> {
        let mut parts = Vec::new();
        for (read, primitive) in self.primitives.read(mesh, pose, report).into_iter().zip(mesh.primitives()) {
            match read {
                Ok(None) => {}
                Ok(Some(mut mesh)) => {
                    let normal_texture = primitive.material().normal_texture().map(Info::from);
                    mesh.tangent_uv_set = normal_texture.map_or(0, |info| info.uv_set as usize);
                    parts.push((self.mesh(mesh), self.material(primitive.material().index())));
                }
                Err(fault) => report.error(fault),
            }
        }
        parts
    }

    fn material(&mut self, material: Option<usize>) -> MaterialId {
        let known = self.materials.iter().position(|&m| m == material);
        let id = known.unwrap_or_else(|| {
            self.materials.push(material);
            self.materials.len() - 1
        });
        MaterialId::from_slot(id as u32)
    }

    /// Some exporters write a copy of a mesh for every object; what shares a mesh is drawn together.
    fn mesh(&mut self, mesh: Mesh) -> MeshId {
        let known = self.by_hash.entry(hash(&mesh)).or_default();
        let same = known.iter().copied().find(|&id| same_but_for_name(&self.meshes[id], &mesh));
        let id = same.unwrap_or_else(|| {
            known.push(self.meshes.len());
            self.meshes.push(mesh);
            self.meshes.len() - 1
        });
        MeshId::from_slot(id as u32)
    }
}

fn hash(mesh: &Mesh) -> u64 {
    let mut hasher = DefaultHasher::new();
    mesh.indices.hash(&mut hasher);
    mesh.positions.iter().flat_map(|p| p.to_array()).for_each(|v| v.to_bits().hash(&mut hasher));
    hasher.finish()
}

fn same_but_for_name(a: &Mesh, b: &Mesh) -> bool {
    a.indices == b.indices
        && a.positions == b.positions
        && a.normals == b.normals
        && a.tangents == b.tangents
        && a.uvs == b.uvs
        && a.tangent_uv_set == b.tangent_uv_set
        && a.colors == b.colors
}
