//! Materials and meshes of a scene in the library.

use super::files::{Files, image_kind, nodes};
use crate::import::Model;
use crate::scene::format::scene::Scene;
use crate::scene::format::surfaces::{self, MapSource, MeshSource, Uv};
use glam::{Affine2, Mat2, UVec2, Vec2};
use std::collections::HashMap;
use systems::assets::{
    ImageId, ImageKind, Library, Map, Material, MaterialId, Mesh, MeshId, Sampler, default_specular, shapes,
};
use systems::space::{Aabb, Transform};

/// A mesh of the scene in the library.
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

fn material(name: &str, m: &surfaces::Material, images: &HashMap<(String, ImageKind), ImageId>) -> Material {
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

fn map(image: ImageId, source: &MapSource, material: &surfaces::Material) -> Map {
    let uv = source.uv.unwrap_or(material.uv);
    Map {
        image,
        sampler: sampler(source.sampler.unwrap_or(material.sampler)),
        uv_set: uv.set,
        image_from_mesh_uv: image_from_mesh_uv(uv),
    }
}

fn sampler(s: surfaces::Sampler) -> Sampler {
    let default = Sampler::default();
    Sampler {
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
