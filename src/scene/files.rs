//! The files a scene names, each read once; and what materials and meshes become in the library.

use super::faults::{Fault, Trail, unknown};
use super::format::{self, MeshSource, Sampler, Scene, Uv};
use super::places::Step;
use super::sensors;
use super::values::MapSource;
use crate::import::{self, Model, Node};
use glam::{Affine2, Mat2, UVec2, Vec2};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use systems::assets::ImageKind;
use systems::assets::shapes;
use systems::assets::{AlphaMode, ImageId, Library, Map, Material, MaterialId, Mesh, MeshId, default_specular};
use systems::space::Aabb;
use systems::space::Transform;

/// What the files of a scene contained. A file that failed has a [`Fault`] and is absent.
#[derive(Default)]
pub struct Files {
    images: HashMap<(String, ImageKind), ImageId>,
    models: HashMap<String, Model>,
    /// What to say of images that are hardly what the material's field asks for.
    doubts: Vec<String>,
}

impl Files {
    pub fn model(&self, file: &str) -> Option<&Model> {
        self.models.get(file)
    }

    /// What of the models was left out or corrected, in the order of the file; materials that lack what they ask for.
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

    /// What to say of classes that models name and the scene does not have: they may be meant for another program.
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

    /// What to say of a model whose lights are to cast shadows, and which has none.
    fn lightless(&self, name: &str, mesh: &MeshSource) -> Option<String> {
        let MeshSource::Model(source) = mesh else { return None };
        let model = self.model(&source.file).filter(|_| source.shadows)?;
        let has_none = nodes(model, source.node.as_deref()).all(|node| node.light.is_none());
        has_none.then(|| format!("mesh \"{name}\": shadows has no effect: the model has no lights"))
    }
}

/// What to say of a material whose technique finds nothing to bump it by.
fn lacking(name: &str, material: &format::Material) -> Option<String> {
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

/// What the texels of a map mean, by the material's field; of a base map, by what its alpha does. An image whose alpha
/// does different things is there once for each.
fn image_kind(field: &str, material: &format::Material) -> ImageKind {
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
        let image = |map: &Option<MapSource>, kind| {
            map.as_ref().and_then(|map| library.image(*files.images.get(&(map.file.clone(), kind))?))
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

/// What a mesh of the scene is once it is in the library.
pub enum Shape {
    /// A procedural mesh.
    Mesh(MeshId, Aabb),
    /// A model, or a part of one; the box around it; the materials whose surfaces cast no shadow.
    Model(Model, Aabb, Vec<MaterialId>),
}

/// The scene's materials and meshes by name.
pub struct Items {
    materials: HashMap<String, MaterialId>,
    shapes: HashMap<String, Shape>,
}

impl Items {
    /// Adds a checked scene's materials and procedural meshes to the library.
    pub fn new(scene: &Scene, files: &Files, library: &mut Library) -> Self {
        let materials = scene.materials.entries().iter().map(|(name, source)| {
            let material = material(name, source, &files.images);
            (name.clone(), library.add_material(material))
        });
        let materials = materials.collect();
        let mut shapes = HashMap::new();
        for (name, source) in scene.meshes.entries() {
            let shape = match source {
                MeshSource::Model(source) => {
                    let Some(model) = files.model(&source.file) else { continue };
                    let mut part = part_of(model, source.node.as_deref());
                    for light in part.nodes.iter_mut().filter_map(|node| node.light.as_mut()) {
                        light.shadows = source.shadows;
                    }
                    let bounds = part.bounds(library);
                    let is_named = |material: &MaterialId| {
                        let entry = library.material(*material);
                        entry.is_some_and(|entry| source.casts_no_shadow.contains(&entry.name))
                    };
                    let materials = part.nodes.iter().flat_map(|node| &node.parts).map(|&(_, material)| material);
                    let no_shadow = materials.filter(is_named).collect();
                    Shape::Model(part, bounds, no_shadow)
                }
                _ => {
                    let Some(mesh) = procedural(source) else { continue };
                    let mesh = Mesh { name: name.clone(), ..mesh };
                    let aabb = mesh.aabb();
                    Shape::Mesh(library.add_mesh(mesh), aabb)
                }
            };
            shapes.insert(name.clone(), shape);
        }
        Self { materials, shapes }
    }

    pub fn material(&self, name: Option<&str>) -> Option<MaterialId> {
        self.materials.get(name?).copied()
    }

    pub fn shape(&self, name: &str) -> Option<&Shape> {
        self.shapes.get(name)
    }

    /// The one mesh of a mesh variant, with its own material where it is a model.
    pub fn single_mesh(&self, name: &str) -> Option<(MeshId, MaterialId)> {
        match self.shape(name)? {
            Shape::Mesh(mesh, _) => Some((*mesh, MaterialId::DEFAULT)),
            Shape::Model(model, ..) => nodes(model, None).find_map(|node| node.parts.first().copied()),
        }
    }
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

/// The whole model, or the part below a node: it keeps the size and rotation it has within the model, and is moved to
/// the origin.
fn part_of(model: &Model, name: Option<&str>) -> Model {
    let mut part = model.clone();
    let Some(name) = name else { return part };
    let Some(index) = model.nodes.iter().position(|n| n.name == name) else { return part };
    let placed = model.placed().into_iter().find(|(node, _)| *node == index);
    let model_from_node = placed.map_or(model.nodes[index].transform.compute_affine(), |(_, affine)| affine);
    let (scale, rotation, _) = model_from_node.to_scale_rotation_translation();
    part.nodes[index].transform = Transform { scale, rotation, ..Transform::IDENTITY };
    part.roots = vec![index];
    part.name = name.into();
    part
}

fn procedural(source: &MeshSource) -> Option<Mesh> {
    let repeat = |mesh: Mesh, uv_scale: [f32; 2], tile_metres: Option<f32>| {
        let mesh = shapes::with_uv_scale(mesh, Vec2::from_array(uv_scale));
        if let Some(metres) = tile_metres { shapes::tiled(mesh, metres) } else { mesh }
    };
    Some(match source {
        MeshSource::Plane(m) => {
            let mesh = shapes::plane(Vec2::from_array(m.size), UVec2::from_array(m.segments));
            repeat(mesh, m.uv_scale, m.tile_metres)
        }
        MeshSource::Cube(m) => repeat(shapes::cube(m.size.vec3()), m.uv_scale, m.tile_metres),
        MeshSource::Sphere(m) => repeat(shapes::sphere(m.radius, m.segments, m.rings), m.uv_scale, None),
        MeshSource::Torus(m) => repeat(shapes::torus(m.major, m.minor, m.segments, m.sides), m.uv_scale, None),
        MeshSource::Cylinder(m) => repeat(shapes::cylinder(m.radius, m.height, m.segments), m.uv_scale, None),
        MeshSource::Model(_) => return None,
    })
}

fn material(name: &str, m: &format::Material, images: &HashMap<(String, ImageKind), ImageId>) -> Material {
    let maps = m.maps().map(|(field, source)| {
        let source = source?;
        let image = images.get(&(source.file.clone(), image_kind(field, m)))?;
        Some(map(*image, source, m))
    });
    let [base_map, normal_map, specular_map, metallic_roughness_map, occlusion_map, emissive_map, ..] = maps;
    let [.., height_map, horizon_map_0, horizon_map_1, offset_map, environment_map] = maps;
    Material {
        name: name.into(),
        shading: m.shading,
        technique: m.technique,
        alpha: m.alpha_mode,
        alpha_cutoff: m.alpha_cutoff,
        double_sided: m.double_sided,
        base_factor: m.base_factor.rgb().extend(m.base_alpha),
        base_map,
        normal_scale: m.normal_scale,
        normal_map,
        specular_factor: m.specular_factor.map_or(default_specular(m.shading), |color| color.rgb()),
        specular_map,
        specular_strength: m.specular_strength,
        shininess: m.shininess,
        glossiness: m.glossiness,
        metallic: m.metallic,
        roughness: m.roughness,
        metallic_roughness_map,
        occlusion_strength: m.occlusion_strength,
        occlusion_map,
        emissive_factor: m.emissive_factor.rgb(),
        emissive_map,
        height_scale_uv: m.height_scale_uv,
        height_rest: m.height_rest,
        height_map,
        emboss_step_texels: m.emboss_step_texels,
        self_shadow: m.self_shadow,
        horizon_maps: [horizon_map_0, horizon_map_1],
        offset_map,
        offset_matrix: Mat2::from_cols_array_2d(&m.offset_matrix).transpose(),
        environment_map,
    }
}

fn map(image: ImageId, source: &MapSource, material: &format::Material) -> Map {
    let uv = source.uv.unwrap_or(material.uv);
    Map {
        image,
        sampler: sampler(source.sampler.unwrap_or(material.sampler)),
        uv_set: uv.set,
        image_from_mesh_uv: image_from_mesh_uv(uv),
    }
}

fn sampler(s: Sampler) -> systems::assets::Sampler {
    let default = systems::assets::Sampler::default();
    systems::assets::Sampler {
        wrap_u: s.wrap_u.or(s.wrap).unwrap_or(default.wrap_u),
        wrap_v: s.wrap_v.or(s.wrap).unwrap_or(default.wrap_v),
        mag: s.mag.unwrap_or(default.mag),
        min: s.min.unwrap_or(default.min),
        mip: s.mip.unwrap_or(default.mip),
    }
}

/// Scale, then rotation, then offset, as KHR_texture_transform: a positive angle turns the image clockwise on the
/// surface.
fn image_from_mesh_uv(uv: Uv) -> Affine2 {
    let (sin, cos) = uv.rotation_degrees.to_radians().sin_cos();
    let rotation = Mat2::from_cols(Vec2::new(cos, -sin), Vec2::new(sin, cos));
    let matrix2 = rotation * Mat2::from_diagonal(Vec2::from_array(uv.scale));
    Affine2 { matrix2, translation: Vec2::from_array(uv.offset) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uv_is_scaled_then_turned_then_moved() {
        let uv = Uv { scale: [2.0, 1.0], offset: [10.0, 20.0], rotation_degrees: 90.0, set: 0 };
        let at = image_from_mesh_uv(uv).transform_point2(Vec2::new(1.0, 3.0));
        // Scaled (2, 3); a quarter turn takes +U to −V and +V to +U; moved.
        assert!(at.distance(Vec2::new(13.0, 18.0)) < 1e-5, "{at}");
    }
}
