//! glTF 2.0 into a [`Model`].
//!
//! [`container`] yields the JSON, [`schema`] checks its shape and every reference in it, [`document`] and [`accessors`]
//! give bounds-checked access to the data; on these stand [`nodes`], [`pose`], [`meshes`], [`materials`] and
//! [`textures`]. All report to one [`report::Report`] and go on, so that loading and checking are the same reading.
//! Nothing joins the library before the whole file has been found sound.
//!
//! The JSON is read as plain values rather than through the types of a glTF crate: those stop at the first fault
//! without saying where, or refuse files that the specification allows.

mod accessors;
mod container;
mod document;
mod materials;
mod meshes;
mod nodes;
mod pose;
mod report;
mod schema;
mod textures;
mod uri;

pub use uri::read_file;

use super::{ImportError, Model, Problem};
use accessors::Accessor;
use document::{Document, id_of, items};
use meshes::Meshes;
use nodes::Hierarchy;
use pose::Pose;
use report::{Fault, Read, Report};
use std::collections::BTreeMap;
use std::path::Path;
use systems::images::Image;
use systems::library::{ImageId, Library, Map, Material, MaterialId, Mesh, MeshId};
use textures::Images;

/// A model whose ids count from 0, with the items that they stand for.
struct Draft {
    model: Model,
    meshes: Vec<Mesh>,
    materials: Vec<Material>,
    images: Vec<Option<Image>>,
}

/// Reads a model into the library.
pub fn load(path: &Path, library: &mut Library) -> Result<Model, ImportError> {
    let mut report = Report::new(path);
    let draft = read(path, &mut report).unwrap_or_else(|fault| {
        report.error(fault);
        None
    });
    match (report.errors.into_iter().next(), draft) {
        (None, Some(draft)) => Ok(Model { warnings: report.warnings, ..draft.join(library) }),
        (Some(error), _) => Err(error),
        (None, None) => Err(Fault::invalid("document", "cannot be read").into_error(path)),
    }
}

/// Everything wrong with a model.
pub fn check(path: &Path) -> Vec<Problem> {
    let mut report = Report::new(path);
    if let Err(fault) = read(path, &mut report) {
        report.error(fault);
    }
    let errors = report.errors.into_iter().map(Problem::from);
    errors.chain(report.warnings.into_iter().map(Problem::from)).collect()
}

/// Reads on after most faults; `Err` or `None` where there is nothing to go on with.
fn read(path: &Path, report: &mut Report) -> Read<Option<Draft>> {
    let bytes = read_file(path).map_err(|error| Fault::unreadable("file", error.to_string()))?;
    let file_bytes = bytes.len();
    let (root, bin) = container::open(bytes, report)?;
    check_version(&root["asset"])?;
    schema::check(&root, report);
    if !report.errors.is_empty() {
        // The readers rely on the schema.
        return Ok(None);
    }
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    let document = Document::new(root, folder, bin, file_bytes);
    check_accessors(&document, report);
    let mut hierarchy = nodes::read(&document, report)?;
    let (roots, scene_name) = nodes::scene(&document, report);
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name = scene_name.filter(|n| !n.is_empty()).map_or_else(|| stem.into_owned(), str::to_owned);
    let (meshes, used_materials) = read_meshes(&document, &mut hierarchy, &roots, report);
    let mut images = Images::default();
    let materials = used_materials.iter().map(|material| match material {
        Some(id) => materials::read(&document, *id, &mut images, report),
        None => materials::default_material(),
    });
    let materials: Vec<Material> = materials.collect();
    check_uvs(&hierarchy.nodes, &meshes, &materials, report);
    let decoded = images.decode(&document, report);
    textures::check_unused(&document, &images, report);
    document.check_unused_buffers(report);
    note_what_rests(&document, report);
    let model = Model { name, nodes: hierarchy.nodes, roots, warnings: Vec::new() };
    Ok(Some(Draft { model, meshes, materials, images: decoded }))
}

fn check_version(asset: &serde_json::Value) -> Read<()> {
    let version = |key: &str| {
        let (major, minor) = asset[key].as_str()?.split_once('.')?;
        Some((major.parse::<u32>().ok()?, minor.parse::<u32>().ok()?))
    };
    match (version("version"), version("minVersion")) {
        _ if !asset["version"].is_string() => Ok(()), // the schema says so
        (Some((2, _)), None | Some((2, 0))) => Ok(()),
        (Some((2, _)), Some((major, minor))) => {
            Err(Fault::unsupported("asset.minVersion", format!("needs glTF {major}.{minor}; 2.0 is read")))
        }
        _ => Err(Fault::unsupported("asset.version", format!("glTF {}; only 2.0 is read", asset["version"]))),
    }
}

fn check_accessors(document: &Document, report: &mut Report) {
    for id in 0..document.array("accessors").len() {
        match Accessor::new(document, id) {
            Ok(accessor) => accessor.check(report),
            Err(fault) => report.fault(false, fault),
        }
    }
    for id in 0..document.array("bufferViews").len() {
        if let Err(fault) = document.view(id) {
            report.fault(false, fault);
        }
    }
}

/// Reads the meshes that the scene shows, fills the nodes' parts, and returns the materials in use.
fn read_meshes(
    document: &Document,
    hierarchy: &mut Hierarchy,
    roots: &[usize],
    report: &mut Report,
) -> (Vec<Mesh>, Vec<Option<usize>>) {
    let reader = Meshes::new(document);
    let mut meshes = Vec::new();
    let mut materials: Vec<Option<usize>> = Vec::new();
    // A mesh is shared by all nodes that show it in the same pose.
    let mut known: BTreeMap<(usize, Option<usize>), Vec<(MeshId, MaterialId)>> = BTreeMap::new();
    let mut shown = vec![false; document.array("meshes").len()];
    for node in shown_nodes(hierarchy, roots) {
        let json = &document.root["nodes"][node];
        let Some(mesh) = id_of(json, "mesh") else { continue };
        shown[mesh] = true;
        let own_pose = json.get("skin").is_some() || json.get("weights").is_some();
        let key = (mesh, own_pose.then_some(node));
        if !known.contains_key(&key) {
            let mut parts = Vec::new();
            let pose = Pose::new(document, mesh, Some(node), &hierarchy.model_from_node);
            let pose = pose.unwrap_or_else(|fault| {
                report.error(fault);
                Pose::default()
            });
            let primitives = items(&document.root["meshes"][mesh]["primitives"]);
            for (read, primitive) in reader.read(mesh, &pose, report).into_iter().zip(primitives) {
                match read {
                    Ok(None) => {}
                    Ok(Some(mesh)) => {
                        let material = index_of(&mut materials, id_of(primitive, "material"));
                        parts.push((MeshId(meshes.len() as u32), MaterialId(material as u32)));
                        meshes.push(mesh);
                    }
                    Err(fault) => report.error(fault),
                }
            }
            known.insert(key, parts);
        }
        hierarchy.nodes[node].parts.clone_from(&known[&key]);
        hierarchy.nodes[node].instances = nodes::instances(document, node, report).unwrap_or_else(|fault| {
            report.error(fault);
            Vec::new()
        });
    }
    for mesh in (0..shown.len()).filter(|&mesh| !shown[mesh]) {
        for fault in reader.read(mesh, &Pose::default(), report).into_iter().filter_map(Result::err) {
            report.fault(false, fault);
        }
    }
    (meshes, materials)
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

fn index_of<T: PartialEq>(list: &mut Vec<T>, item: T) -> usize {
    list.iter().position(|known| *known == item).unwrap_or_else(|| {
        list.push(item);
        list.len() - 1
    })
}

/// Names meshes whose material samples UVs that they lack.
fn check_uvs(nodes: &[super::Node], meshes: &[Mesh], materials: &[Material], report: &mut Report) {
    for (mesh, material) in nodes.iter().flat_map(|n| &n.parts) {
        let (mesh, material) = (&meshes[mesh.0 as usize], &materials[material.0 as usize]);
        for map in material.maps().into_iter().flatten() {
            if mesh.uvs[0].is_empty() || (map.uv_set == 1 && mesh.uvs[1].is_empty()) {
                let message = format!("its material {:?} needs TEXCOORD_{}", material.name, map.uv_set);
                report.warn(format!("mesh {:?}", mesh.name), message);
            }
        }
    }
}

fn note_what_rests(document: &Document, report: &mut Report) {
    let morphs = document.array("meshes").iter().flat_map(|m| items(&m["primitives"]));
    let morphs = morphs.filter(|p| p.get("targets").is_some()).count();
    for (place, count) in
        [("animations", document.array("animations").len()), ("skins", document.array("skins").len()), ("meshes", morphs)]
    {
        let what = if place == "meshes" { "morph targets" } else { place };
        if count > 0 {
            report.warn(place, format!("{what} are not played: shown in the rest pose"));
        }
    }
}

impl Draft {
    /// Adds the items to the library and lets the model name them there.
    fn join(self, library: &mut Library) -> Model {
        let images = self.images.into_iter().map(|image| image.map(|image| library.add_image(image)));
        let images: Vec<Option<ImageId>> = images.collect();
        let place = |map: Option<Map>| {
            let map = map?;
            Some(Map { image: images.get(map.image.0 as usize).copied().flatten()?, ..map })
        };
        let materials = self.materials.into_iter().map(|m| {
            library.add_material(Material {
                base_map: place(m.base_map),
                normal_map: place(m.normal_map),
                specular_map: place(m.specular_map),
                metallic_roughness_map: place(m.metallic_roughness_map),
                occlusion_map: place(m.occlusion_map),
                emissive_map: place(m.emissive_map),
                ..m
            })
        });
        let materials: Vec<MaterialId> = materials.collect();
        let meshes: Vec<MeshId> = self.meshes.into_iter().map(|mesh| library.add_mesh(mesh)).collect();
        let mut model = self.model;
        for (mesh, material) in model.nodes.iter_mut().flat_map(|node| &mut node.parts) {
            (*mesh, *material) = (meshes[mesh.0 as usize], materials[material.0 as usize]);
        }
        model
    }
}
