//! Labels of a file's things for sensors, by its `extras`: `{"class": "road"}` of nodes, meshes and materials, and
//! `{"instance": true}` of nodes and meshes. Modelling programs write custom properties there. Whether a class is one
//! of a scene's is not known here; extras of other forms are other programs'.

use crate::import::gltf::document::data::Document;
use crate::import::model::{NamedClass, Node, NodeLabels};
use serde_json::Value;
use systems::assets::{MaterialId, MeshId};

/// The labels of a file: by index in its lists.
pub struct Labels {
    nodes: Vec<Label>,
    meshes: Vec<Label>,
    materials: Vec<Label>,
}

#[derive(Clone, Default)]
struct Label {
    class: Option<String>,
    is_instance: bool,
}

impl Labels {
    /// Those of a document that fits the schema.
    pub fn read(root: &Value) -> Self {
        let of = |list: &str| root[list].as_array().into_iter().flatten().map(label).collect();
        Self { nodes: of("nodes"), meshes: of("meshes"), materials: of("materials") }
    }

    /// All classes, with their places.
    pub fn classes(&self) -> Vec<NamedClass> {
        let lists = [("nodes", &self.nodes), ("meshes", &self.meshes), ("materials", &self.materials)];
        let all = lists.into_iter().flat_map(|(list, labels)| labels.iter().enumerate().map(move |of| (list, of)));
        let named = |(list, (i, label)): (_, (usize, &Label))| {
            Some(NamedClass { place: format!("{list}[{i}].extras.class"), name: label.class.clone()? })
        };
        all.filter_map(named).collect()
    }

    /// Gives nodes what they are called. `materials`: which of the file's each material of their parts is.
    pub fn give(&self, nodes: &mut [Node], document: &Document, materials: &[Option<usize>]) {
        let none = Label::default();
        for (node, json) in nodes.iter_mut().zip(document.gltf.nodes()) {
            let own = self.nodes.get(json.index()).unwrap_or(&none);
            let mesh = json.mesh().and_then(|mesh| self.meshes.get(mesh.index())).unwrap_or(&none);
            let of_part = |&(_, material): &(MeshId, MaterialId)| {
                let material = materials.get(material.slot() as usize).copied().flatten();
                let material = material.and_then(|id| self.materials.get(id)).unwrap_or(&none);
                material.class.clone().or_else(|| mesh.class.clone())
            };
            node.labels = NodeLabels {
                class: own.class.clone(),
                is_instance: own.is_instance || mesh.is_instance,
                parts: node.parts.iter().map(of_part).collect(),
            };
        }
    }
}

fn label(item: &Value) -> Label {
    let extras = &item["extras"];
    Label { class: extras["class"].as_str().map(str::to_owned), is_instance: extras["instance"] == true }
}
