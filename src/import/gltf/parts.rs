//! What the nodes draw: meshes and materials, each once, however often the file repeats them.

use super::document::{Document, id_of, items};
use super::meshes::Meshes;
use super::nodes::{self, Hierarchy};
use super::pose::Pose;
use super::report::Report;
use std::collections::{BTreeMap, HashMap};
use std::hash::{DefaultHasher, Hash, Hasher};
use systems::library::{MaterialId, Mesh, MeshId};

/// Fills the parts and instances of the nodes that the scene shows. Returns the meshes and the materials that they need
/// (`None`: glTF's default), which the ids in the parts number from 0.
pub fn read(
    document: &Document,
    hierarchy: &mut Hierarchy,
    roots: &[usize],
    report: &mut Report,
) -> (Vec<Mesh>, Vec<Option<usize>>) {
    let mut reader = Reader {
        document,
        primitives: Meshes::new(document),
        meshes: Vec::new(),
        by_hash: HashMap::new(),
        materials: Vec::new(),
    };
    let mut known = BTreeMap::new();
    let mut shown = vec![false; document.array("meshes").len()];
    for node in shown_nodes(hierarchy, roots) {
        let json = &document.root["nodes"][node];
        let Some(mesh) = id_of(json, "mesh") else { continue };
        shown[mesh] = true;
        // Nodes share a mesh, but for those that pose it in their own way.
        let own_pose = json.get("skin").is_some() || json.get("weights").is_some();
        let parts = known.entry((mesh, own_pose.then_some(node)));
        let parts = parts.or_insert_with(|| {
            let pose = Pose::new(document, mesh, Some(node), &hierarchy.model_from_node);
            reader.parts(mesh, &pose.unwrap_or_else(|fault| refuse(fault, report)), report)
        });
        hierarchy.nodes[node].parts.clone_from(parts);
        let instances = nodes::instances(document, node, report);
        hierarchy.nodes[node].instances = instances.unwrap_or_else(|fault| refuse(fault, report));
    }
    for mesh in (0..shown.len()).filter(|&mesh| !shown[mesh]) {
        for fault in reader.primitives.read(mesh, &Pose::default(), report).into_iter().filter_map(Result::err) {
            report.fault(false, fault);
        }
    }
    (reader.meshes, reader.materials)
}

fn refuse<T: Default>(fault: super::Fault, report: &mut Report) -> T {
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
    document: &'a Document,
    primitives: Meshes<'a>,
    meshes: Vec<Mesh>,
    by_hash: HashMap<u64, Vec<usize>>,
    materials: Vec<Option<usize>>,
}

impl Reader<'_> {
    fn parts(&mut self, mesh: usize, pose: &Pose, report: &mut Report) -> Vec<(MeshId, MaterialId)> {
        let mut parts = Vec::new();
        let primitives = items(&self.document.root["meshes"][mesh]["primitives"]);
        for (read, primitive) in self.primitives.read(mesh, pose, report).into_iter().zip(primitives) {
            match read {
                Ok(None) => {}
                Ok(Some(mesh)) => parts.push((self.mesh(mesh), self.material(id_of(primitive, "material")))),
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
        MaterialId(id as u32)
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
        MeshId(id as u32)
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
        && a.colors == b.colors
}
