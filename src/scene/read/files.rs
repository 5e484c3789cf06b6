//! The files a scene names, each read once.

use crate::import::{self, Model, Node};
use crate::scene::format::scene::Scene;
use crate::scene::format::sensors;
use crate::scene::format::surfaces::{Map, Material, MeshSource};
use crate::scene::text::faults::unknown;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use systems::assets::{AlphaMode, ImageId, ImageKind, Library};
use systems::describe::Step;
use systems::describe::{Fault, Trail};

/// Contents of a scene's files. A file that failed has a [`Fault`] and is absent.
#[derive(Default)]
pub struct Files {
    pub(super) images: HashMap<(String, ImageKind), ImageId>,
    models: HashMap<String, Model>,
    /// Doubts about images that are hardly what the material's field asks for.
    doubts: Vec<String>,
}

impl Files {
    pub fn model(&self, file: &str) -> Option<&Model> {
        self.models.get(file)
    }

    /// Warnings of parts of models that were left out or corrected, in the order of the file, and of materials that
    /// lack what they ask for.
    pub fn warnings(&self, scene: &Scene) -> Vec<String> {
        let mut files: Vec<&str> = scene.meshes.entries().iter().filter_map(|(_, mesh)| model_file(mesh)).collect();
        files.dedup();
        let of_models = files.iter().filter_map(|file| self.model(file)).flat_map(|m| &m.warnings);
        let of_materials = scene.materials.entries().iter().filter_map(|(name, material)| lacking(name, material));
        let of_meshes = scene.meshes.entries().iter().filter_map(|(name, mesh)| self.lightless(name, mesh));
        of_models
            .map(ToString::to_string)
            .chain(of_meshes)
            .chain(of_materials)
            .chain(self.doubts.iter().cloned())
            .collect()
    }

    /// Doubts about classes that models name and the scene does not have: they may be meant for another program.
    pub fn unknown_classes(&self, scene: &Scene) -> Vec<String> {
        let classes = sensors::classes(&scene.classes);
        let of_file = |(file, model): (&String, &Model)| {
            let unknown = model.unknown_classes(&classes);
            unknown.map(|(place, message)| format!("{file}: {place}: {message}")).collect::<Vec<_>>()
        };
        let mut said: Vec<String> = self.models.iter().flat_map(of_file).collect();
        said.sort_unstable();
        said
    }

    /// Warning of a model whose lights are to cast shadows, and which has none.
    fn lightless(&self, name: &str, mesh: &MeshSource) -> Option<String> {
        let MeshSource::Model(source) = mesh else { return None };
        let model = self.model(&source.file).filter(|_| source.shadows)?;
        let has_none = nodes(model, source.node.as_deref()).all(|node| node.light.is_none());
        has_none.then(|| format!("mesh \"{name}\": shadows has no effect: the model has no lights"))
    }
}

/// Warning of a material whose technique finds nothing to bump it by.
fn lacking(name: &str, material: &Material) -> Option<String> {
    let technique = material.technique;
    let maps = material.maps();
    let missing: Vec<&str> = technique
        .needs()
        .iter()
        .filter_map(|&slot| maps[slot as usize].1.is_none().then_some(maps[slot as usize].0))
        .collect();
    let technique = technique.name();
    let missing_maps = missing.join(" and ");
    let message = || format!("material \"{name}\": technique {technique} has no effect without {missing_maps}");
    (!missing.is_empty()).then(message)
}

fn model_file(mesh: &MeshSource) -> Option<&str> {
    match mesh {
        MeshSource::Model(source) => Some(&source.file),
        _ => None,
    }
}

/// Meaning of a map's texels, by the material's field; of a base map, by what its alpha does. An image whose alpha does
/// different things is there once for each.
pub(super) fn image_kind(field: &str, material: &Material) -> ImageKind {
    match (field, material.alpha_mode) {
        ("base_map", AlphaMode::Blend) => ImageKind::Blended,
        ("base_map", AlphaMode::Mask) => ImageKind::masked(material.alpha_cutoff, material.base_alpha),
        ("base_map" | "emissive_map" | "environment_map", _) => ImageKind::Color,
        ("normal_map", _) => ImageKind::Normal,
        ("height_map", _) => ImageKind::Height,
        _ => ImageKind::Data,
    }
}

/// Reads all images and models that the scene names, in parallel, relative to `folder`.
pub fn read(scene: &Scene, folder: &Path, library: &mut Library) -> (Files, Vec<Fault>) {
    let (mut files, mut faults) = (Files::default(), Vec::new());
    let mut wanted: Vec<(String, ImageKind)> = Vec::new();
    let mut places: HashMap<(String, ImageKind), Trail> = HashMap::new();
    for (i, (name, material)) in scene.materials.entries().iter().enumerate() {
        let at = Trail::default().field("materials").enter(Step::Entry(i), name);
        for (field, map) in material.maps() {
            let Some(map) = map else { continue };
            let key = (map.file.clone(), image_kind(field, material));
            places.entry(key.clone()).or_insert_with(|| {
                wanted.push(key);
                at.field(field)
            });
        }
    }
    let paths: Vec<(PathBuf, ImageKind)> = wanted.iter().map(|(file, kind)| (folder.join(file), *kind)).collect();
    let mut notes: HashMap<(String, ImageKind), Vec<String>> = HashMap::new();
    for (key, read) in wanted.into_iter().zip(import::load_images(&paths)) {
        match read {
            Ok(read) => {
                notes.insert(key.clone(), read.notes);
                files.images.insert(key, library.add_image(read.image));
            }
            Err(error) => faults.extend(places.get(&key).map(|at| at.fault(error))),
        }
    }
    for (i, (name, material)) in scene.materials.entries().iter().enumerate() {
        let at = Trail::default().field("materials").enter(Step::Entry(i), name);
        let image = |map: &Option<Map>, kind| {
            map.as_ref().and_then(|Map(map)| library.image(*files.images.get(&(map.file.clone(), kind))?))
        };
        let horizon = [&material.horizon_map_0, &material.horizon_map_1].map(|map| image(map, ImageKind::Data));
        if let [Some(first), Some(second)] = horizon.map(|image| image.map(|image| (image.width, image.height)))
            && first != second
        {
            let message = format!(
                "expected {}×{} texels, as horizon_map_0 has, found {}×{}",
                first.0, first.1, second.0, second.1
            );
            faults.push(at.field("horizon_map_1").fault(message));
        }
        for (field, map) in material.maps() {
            let of_map = map.and_then(|map| notes.get(&(map.file.clone(), image_kind(field, material))));
            let doubt = |note: &String| format!("material \"{name}\": {field} {note}");
            files.doubts.extend(of_map.into_iter().flatten().map(doubt));
        }
    }
    let mut models: Vec<(&str, Trail)> = Vec::new();
    let mut known = HashSet::new();
    for (i, (name, mesh)) in scene.meshes.entries().iter().enumerate() {
        if let Some(file) = model_file(mesh).filter(|file| known.insert(*file)) {
            models.push((file, Trail::default().field("meshes").enter(Step::Entry(i), name).field("file")));
        }
    }
    let paths: Vec<PathBuf> = models.iter().map(|(file, _)| folder.join(file)).collect();
    for ((file, at), model) in models.into_iter().zip(import::load_models(&paths, folder, library)) {
        match model {
            Ok(model) => _ = files.models.insert(file.into(), model),
            Err(error) => faults.push(at.fault(error)),
        }
    }
    for (i, (name, mesh)) in scene.meshes.entries().iter().enumerate() {
        let MeshSource::Model(source) = mesh else { continue };
        let Some(model) = files.model(&source.file).filter(|_| !source.casts_no_shadow.is_empty()) else { continue };
        let known = material_names(model, library);
        let at = Trail::default().field("meshes").enter(Step::Entry(i), name).field("casts_no_shadow");
        for (i, name) in source.casts_no_shadow.iter().enumerate().filter(|(_, name)| !known.contains(&name.as_str())) {
            faults.push(at.enter(Step::Index(i), "").fault(unknown("material", name, known.iter().copied())));
        }
    }
    (files, faults)
}

/// The images and models that the scene names, each once.
pub fn named(scene: &Scene, folder: &Path) -> Vec<PathBuf> {
    let maps = scene.materials.entries().iter().flat_map(|(_, material)| material.maps());
    let images = maps.filter_map(|(_, map)| map.map(|map| map.file.as_str()));
    let models = scene.meshes.entries().iter().filter_map(|(_, mesh)| model_file(mesh));
    let mut known = HashSet::new();
    images.chain(models).filter(|file| known.insert(*file)).map(|file| folder.join(file)).collect()
}

/// The names of a model's materials, sorted.
pub fn material_names<'l>(model: &Model, library: &'l Library) -> Vec<&'l str> {
    let parts = model.nodes.iter().flat_map(|node| &node.parts);
    let mut names: Vec<&str> =
        parts.filter_map(|&(_, material)| Some(library.material(material)?.name.as_str())).collect();
    names.sort_unstable();
    names.dedup();
    names
}

/// The nodes that a model, or the part of it below a named node, puts into the world.
pub fn nodes<'m>(model: &'m Model, name: Option<&str>) -> impl Iterator<Item = &'m Node> {
    let mut open: Vec<usize> = match name {
        None => model.roots.clone(),
        Some(name) => model.nodes.iter().position(|n| n.name == name).into_iter().collect(),
    };
    // A file's nodes form a forest (the import refuses cycles), so this ends.
    std::iter::from_fn(move || {
        let node = model.nodes.get(open.pop()?)?;
        open.extend(node.children.iter().rev());
        Some(node)
    })
}
