//! glTF 2.0 into a [`Model`]. Folders are floors, each uses those above it:
//!
//! ```text
//! report      faults and warnings
//! files/      the JSON and binary chunk of a file; files that it names
//! document/   schema, and the document that fits it, with bounds-checked access to its data
//! geometry/   meshes in their rest pose
//! materials/  materials, textures, images
//! nodes/      the hierarchy, what its nodes draw, and what sensors call them
//! rules       what nothing else depends on
//! ```
//!
//! All report to one [`report::Report`] and go on, so that loading and checking are the same reading. Nothing joins the
//! library before the whole file has been found sound.
//!
//! The types of the gltf crate and their links are used. Its validation is not: it stops at the first fault of a type
//! without saying where, refuses files that the specification allows, and panics on an index out of range. Nor are its
//! readers of buffers and chunks, which trust every offset.

mod document;
mod files;
mod geometry;
mod materials;
mod nodes;
mod report;
mod rules;

use super::error::ImportError;
use super::file::read_file;
use super::model::{Model, Node};
use crate::problem::Problem;
use document::data::Document;
use document::{shape, typed};
use files::container;
use files::uri::Place;
use materials::material;
use materials::textures::{self, Images};
use nodes::labels::Labels;
use nodes::{far, hierarchy, parts};
use report::{Fault, Read, Report};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use systems::assets::{Image, ImageId, Library, Map, Material, MaterialId, Mesh, MeshId};
use systems::sensors::Classes;

/// A model whose ids count from 0, with the items that they stand for.
pub struct Draft {
    model: Model,
    meshes: Vec<Mesh>,
    materials: Vec<Material>,
    images: Vec<Option<Image>>,
}

/// Reads a model without a library: see [`Draft::join`]. `named_in`: the folder of the file that names it.
pub fn draft(path: &Path, named_in: Option<&Path>) -> Result<Draft, ImportError> {
    let mut report = Report::new(path);
    let draft = read(path, named_in, &mut report).unwrap_or_else(|fault| {
        report.error(fault);
        None
    });
    match (report.errors.into_iter().next(), draft) {
        (None, Some(draft)) => Ok(Draft { model: Model { warnings: report.warnings, ..draft.model }, ..draft }),
        (Some(error), _) => Err(error),
        (None, None) => Err(Fault::invalid("document", "cannot be read").into_error(path)),
    }
}

/// Everything wrong with a model.
pub fn check(path: &Path) -> Vec<Problem> {
    let mut report = Report::new(path);
    match read(path, None, &mut report) {
        Ok(Some(draft)) => {
            let classes = Classes::default();
            draft.model.unknown_classes(&classes).for_each(|(place, message)| report.warn(place, message));
        }
        Ok(None) => {}
        Err(fault) => report.error(fault),
    }
    let errors = report.errors.into_iter().map(Problem::from);
    errors.chain(report.warnings.into_iter().map(Problem::from)).collect()
}

/// The files of a model's buffers and images that there are and that it may read, named by a file of the folder
/// `named_in`; none where the model cannot be read.
pub fn files_named_by(path: &Path, named_in: Option<&Path>) -> Vec<PathBuf> {
    let is_model = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gltf") || e.eq_ignore_ascii_case("glb"));
    let bytes = if is_model { read_file(path) } else { return Vec::new() };
    let root = bytes.ok().and_then(|bytes| container::open(bytes, &mut Report::new(path)).ok());
    let Some((root, _)) = root else { return Vec::new() };
    let place = Place::new(path, named_in);
    let of = |list: &str| root[list].as_array().into_iter().flatten().collect::<Vec<_>>();
    let items = of("buffers").into_iter().chain(of("images"));
    items.filter_map(|item| place.local_file(item["uri"].as_str()?)).collect()
}

/// Reads on after most faults; `Err` or `None` where there is nothing to go on with.
fn read(path: &Path, named_in: Option<&Path>, report: &mut Report) -> Read<Option<Draft>> {
    let bytes = read_file(path).map_err(|error| Fault::unreadable("file", error.to_string()))?;
    let file_bytes = bytes.len();
    let (mut root, bin) = container::open(bytes, report)?;
    check_version(&root, report)?;
    let unfit = shape::check(&root, report);
    if !report.errors.is_empty() {
        // The readers rely on the schema.
        return Ok(None);
    }
    shape::leave_out(&mut root, &unfit);
    let animated = root["animations"].as_array().is_some_and(|animations| !animations.is_empty());
    let rooms = hierarchy::rooms(&root, report);
    let labels = Labels::read(&root);
    let document = Document::new(typed::document(root)?, Place::new(path, named_in), bin, file_bytes);
    rules::check(&document, report);
    let mut hierarchy = hierarchy::read(&document, rooms, report)?;
    let (roots, scene_name) = hierarchy::scene(&document, report);
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name = scene_name.filter(|n| !n.is_empty()).map_or_else(|| stem.into_owned(), str::to_owned);
    let (meshes, used_materials) = parts::read(&document, &mut hierarchy, &roots, report);
    labels.give(&mut hierarchy.nodes, &document, &used_materials);
    let mut images = Images::default();
    let faded = faded(&hierarchy.nodes, &meshes);
    let materials = used_materials.iter().enumerate().map(|(number, id)| {
        let gltf = id.and_then(|id| document.gltf.materials().nth(id));
        let faded = faded.contains(&(number as u32));
        let read = |gltf| material::read(&document, &gltf, faded, &mut images, report);
        gltf.map_or_else(material::default_material, read)
    });
    let materials: Vec<Material> = materials.collect();
    let decoded = images.decode(&document, report);
    textures::check(&document, &images, report);
    document.check_unused_buffers(report);
    note_what_rests(&document, animated, report);
    let classes = labels.classes();
    let model = Model { name, nodes: hierarchy.nodes, roots, classes, warnings: Vec::new() };
    far::check(&model, &meshes, report);
    Ok(Some(Draft { model, meshes, materials, images: decoded }))
}

/// Materials of meshes whose vertices have an alpha of their own.
fn faded(nodes: &[Node], meshes: &[Mesh]) -> BTreeSet<u32> {
    let is_faded: Vec<bool> = meshes.iter().map(|mesh| mesh.colors.iter().any(|color| color.w < 1.0)).collect();
    let parts = nodes.iter().flat_map(|node| &node.parts);
    parts.filter(|(mesh, _)| is_faded[mesh.slot() as usize]).map(|(_, material)| material.slot()).collect()
}

/// Any 2.x loads unless it says that it needs more than 2.0; an empty file needs nothing.
fn check_version(root: &Value, report: &mut Report) -> Read<()> {
    let asset = &root["asset"];
    let version = |key: &str| {
        let (major, minor) = asset[key].as_str()?.split_once('.')?;
        Some((major.parse::<u32>().ok()?, minor.parse::<u32>().ok()?))
    };
    if asset["version"].is_string() && version("version").is_none_or(|(major, _)| major != 2) {
        let message = format!("glTF {} is not supported, only 2.0 is", asset["version"]);
        return Err(Fault::unsupported("asset.version", message));
    }
    if let Some((major, minor)) = version("minVersion").filter(|&v| v != (2, 0)) {
        let message = format!("the file needs glTF {major}.{minor}, 2.0 is supported");
        report.fault(root.get("nodes").is_some(), Fault::unsupported("asset.minVersion", message));
    }
    Ok(())
}

fn note_what_rests(document: &Document, animated: bool, report: &mut Report) {
    let mut primitives = document.gltf.meshes().flat_map(|mesh| mesh.primitives());
    let morphs = primitives.any(|primitive| primitive.morph_targets().len() > 0);
    let skins = document.gltf.skins().len() > 0;
    for (place, what, rests) in
        [("animations", "animations", animated), ("skins", "skins", skins), ("meshes", "morph targets", morphs)]
    {
        if rests {
            report.warn(place, format!("{what} are not played: shown in the rest pose"));
        }
    }
}

impl Draft {
    /// Adds the items to the library and lets the model name them there.
    pub fn join(self, library: &mut Library) -> Model {
        let images = self.images.into_iter().map(|image| image.map(|image| library.add_image(image)));
        let images: Vec<Option<ImageId>> = images.collect();
        let place = |map: Option<Map>| {
            let map = map?;
            Some(Map { image: images.get(map.image.slot() as usize).copied().flatten()?, ..map })
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
            (*mesh, *material) = (meshes[mesh.slot() as usize], materials[material.slot() as usize]);
        }
        model
    }
}
