//! What many entities share: meshes, materials and images on the CPU, each behind a small copyable id.
//!
//! An item is added once and its id never changes. Two of the ids are components: an entity with a [`MeshId`] is
//! drawn, with its [`MaterialId`] (the neutral [`MaterialId::DEFAULT`] where it has none). Nothing here knows the GPU;
//! the renderer uploads what it has not seen yet, in id order.

use crate::bounds::{Aabb, Sphere};
use crate::draw_list::MAP_COUNT;
use crate::images::{Image, ImageKind};
use crate::incomplete;
use crate::instances;
use crate::levels::Level;
use crate::object_order;
use crate::selected_lights::SelectedLights;
use crate::split::{Grid, split};
pub use crate::technique::Technique;
use crate::transform::Transform;
use bevy_ecs::lifecycle::HookContext;
use bevy_ecs::prelude::*;
use bevy_ecs::world::DeferredWorld;
use glam::{Affine2, Mat2, Vec2, Vec3, Vec4};
use std::collections::HashMap;

/// Runs when an entity loses its mesh, by itself or with its life.
fn free_slots(mut world: DeferredWorld, context: HookContext) {
    instances::free_slot(world.reborrow(), context);
    object_order::free_place(world, context);
}

/// Names a [`Mesh`] of the [`Library`]. As a component: this entity is drawn with that mesh.
#[derive(Component, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, serde::Serialize, serde::Deserialize)]
#[require(Transform, MaterialId, SelectedLights)]
#[component(on_remove = free_slots, summary_tick)]
pub struct MeshId(pub u32);

/// Names a [`Material`] of the [`Library`]. As a component: the material of a drawn entity.
#[derive(Component, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, serde::Serialize, serde::Deserialize)]
#[component(on_remove = incomplete::lose_material, summary_tick)]
pub struct MaterialId(pub u32);

impl MaterialId {
    /// The neutral grey material that every library starts with.
    pub const DEFAULT: Self = Self(0);
}

impl Default for MaterialId {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Names an [`Image`] of the [`Library`].
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct ImageId(pub u32);

impl ImageId {
    /// 1×1 white colour: stands in for a missing base, emissive or environment map.
    pub const WHITE_COLOR: Self = Self(0);
    /// 1×1 white data: stands in for a missing specular, metallic-roughness, occlusion or height map.
    pub const WHITE_DATA: Self = Self(1);
    /// 1×1 flat normal (0.5, 0.5, 1): stands in for a missing normal map.
    pub const FLAT_NORMAL: Self = Self(2);
    /// 1×1 black data: stands in for a missing horizon map.
    pub const BLACK_DATA: Self = Self(3);
    /// 1×1 offset of nothing (128, 128): stands in for a missing offset map.
    pub const NO_OFFSET: Self = Self(4);
}

/// A triangle list. All filled attribute arrays have one element per vertex.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// For people: panels, warnings, GPU labels.
    pub name: String,
    /// Object space, metres.
    pub positions: Vec<Vec3>,
    /// Object space, unit length.
    pub normals: Vec<Vec3>,
    /// Object space xyz and handedness w = ±1. Empty: the tangents system fills it.
    pub tangents: Vec<Vec4>,
    /// Two sets of texture coordinates, origin at the top left. The first may be empty (no UVs at all), the second
    /// empty (the same as the first).
    pub uvs: [Vec<Vec2>; 2],
    /// Which UV set computed tangents follow: the one that the normal map is placed by. 0 or 1.
    pub tangent_uv_set: usize,
    /// Linear RGBA, multiplied with the base colour. Empty: white.
    pub colors: Vec<Vec4>,
    /// Three per triangle, counter-clockwise seen from the front.
    pub indices: Vec<u32>,
}

impl Mesh {
    /// The axis-aligned box around all positions, object space; empty at the origin where there are none.
    pub fn aabb(&self) -> Aabb {
        Aabb::around(&self.positions)
    }

    /// The UVs that tangents follow; the first set where the second is empty.
    pub fn tangent_uvs(&self) -> &[Vec2] {
        let second = self.tangent_uv_set == 1 && !self.uvs[1].is_empty();
        &self.uvs[usize::from(second)]
    }

    /// Triangles in the mesh.
    pub fn triangle_count(&self) -> usize {
        self.indices.len() / 3
    }
}

/// How a texture coordinate outside 0..1 is read.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
pub enum Wrap {
    /// The image repeats.
    #[default]
    Repeat,
    /// Every second copy is mirrored.
    Mirror,
    /// The edge texel continues.
    Clamp,
}

/// How texels are filtered.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
pub enum Filter {
    /// The nearest texel.
    Nearest,
    /// Bilinear.
    #[default]
    Linear,
}

/// How mip levels are chosen.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
pub enum MipFilter {
    /// Only the full-size level.
    None,
    /// The nearest level.
    Nearest,
    /// Blend of the two nearest levels.
    #[default]
    Linear,
}

/// How a map is sampled; the default repeats with trilinear filtering.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
pub struct Sampler {
    /// Along u.
    pub wrap_u: Wrap,
    /// Along v.
    pub wrap_v: Wrap,
    /// Where a texel covers more than a pixel.
    pub mag: Filter,
    /// Where a pixel covers more than a texel.
    pub min: Filter,
    /// Between mip levels.
    pub mip: MipFilter,
}

/// An image as a material uses it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Map {
    /// The image; its [`ImageKind`] must suit the map: colour for base (blended or masked where the material's alpha
    /// is), emissive and environment maps; normal for normal maps; height for height maps; data else.
    pub image: ImageId,
    /// Wrapping and filtering.
    pub sampler: Sampler,
    /// 0 or 1: which of the mesh's UV sets.
    pub uv_set: u32,
    /// Applied to the mesh's UVs before sampling.
    pub image_from_mesh_uv: Affine2,
}

impl Map {
    /// The whole image over the first UV set, repeating, trilinear.
    pub fn new(image: ImageId) -> Self {
        Self { image, sampler: Sampler::default(), uv_set: 0, image_from_mesh_uv: Affine2::IDENTITY }
    }

    /// Whether it is read elsewhere than at the first UV set as it is.
    pub fn is_transformed(&self) -> bool {
        self.uv_set != 0 || self.image_from_mesh_uv != Affine2::IDENTITY
    }
}

/// The lighting model of a material; the formulas are in `shaders/lighting.wgsl`.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
pub enum Shading {
    /// Diffuse plus Phong's reflected vector: base, specular map and shininess.
    #[default]
    Phong,
    /// As `Phong`, with Blinn's half vector.
    Blinn,
    /// glTF 2.0 metallic-roughness, GGX.
    MetallicRoughness,
    /// KHR_materials_pbrSpecularGlossiness, GGX: diffuse (base), specular (rgb) and glossiness (specular map's alpha).
    SpecularGlossiness,
    /// Base colour only, no light.
    Unlit,
}

/// What base alpha means.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
pub enum AlphaMode {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// Drawn where alpha is at least the material's cut-off.
    Mask,
    /// Blended over what lies behind, sorted back to front.
    Blend,
}

/// A surface. Which fields count depends on `shading`; a missing map stands for the constant 1 (normal: flat; horizon
/// and offset: 0).
#[derive(Clone, PartialEq, Debug)]
pub struct Material {
    /// For people.
    pub name: String,
    /// The lighting model.
    pub shading: Shading,
    /// The bump technique.
    pub technique: Technique,
    /// Opaque, mask or blend.
    pub alpha: AlphaMode,
    /// Mask only: drawn where alpha is at least this.
    pub alpha_cutoff: f32,
    /// Back faces are drawn too, with the normal turned to the eye.
    pub double_sided: bool,
    /// Linear RGBA, times `base_map`, times the vertex colour.
    pub base_factor: Vec4,
    /// sRGB colour, alpha linear.
    pub base_map: Option<Map>,
    /// Scales the x and y of `normal_map` before normalising.
    pub normal_scale: f32,
    /// Tangent space, green up.
    pub normal_map: Option<Map>,
    /// Phong, Blinn: how much is reflected. SpecularGlossiness: the specular colour. MetallicRoughness:
    /// KHR_materials_specular's specularColorFactor.
    pub specular_factor: Vec3,
    /// Times `specular_factor` (rgb). Alpha: glossiness, or KHR_materials_specular's strength.
    pub specular_map: Option<Map>,
    /// MetallicRoughness: KHR_materials_specular's specularFactor.
    pub specular_strength: f32,
    /// Phong, Blinn: the exponent.
    pub shininess: f32,
    /// SpecularGlossiness: times the specular map's alpha.
    pub glossiness: f32,
    /// MetallicRoughness: times the blue of `metallic_roughness_map`.
    pub metallic: f32,
    /// MetallicRoughness: times the green of `metallic_roughness_map`.
    pub roughness: f32,
    /// Blue: metallic; green: roughness.
    pub metallic_roughness_map: Option<Map>,
    /// 0..1: how much of `occlusion_map` is applied to ambient light.
    pub occlusion_strength: f32,
    /// Red: how much ambient light reaches the texel. Not for Phong and Blinn.
    pub occlusion_map: Option<Map>,
    /// Linear RGB, may exceed 1; times `emissive_map`; Phong and Blinn: times the base colour too.
    pub emissive_factor: Vec3,
    /// sRGB colour.
    pub emissive_map: Option<Map>,
    /// Depth of the height map from black to white, in units of the UV square's width.
    pub height_scale_uv: f32,
    /// The height, 0..1, at which the mesh's own surface lies. 1: all is carved into it.
    pub height_rest: f32,
    /// 0 deepest, 1 highest. A missing one is flat, at the mesh's surface.
    pub height_map: Option<Map>,
    /// Emboss: how far from the texel the second height is read, in texels.
    pub emboss_step_texels: f32,
    /// 0..1: how dark the surface's own shadows are, in the techniques that have them.
    pub self_shadow: f32,
    /// Elevation of the horizon over a right angle, 0..1: in directions 0°, 45°, 90°, 135° from image-right toward
    /// image-up (r, g, b, a of the first), and 180° to 315° (the second).
    pub horizon_maps: [Option<Map>; 2],
    /// du (r) and dv (g) of the environment's look-up: 128 is none, 1 and 255 are −1 and 1.
    pub offset_map: Option<Map>,
    /// From (du, dv) to a shift in the environment's disc, whose radius is 1.
    pub offset_matrix: Mat2,
    /// What `PerturbedUv` mirrors, around the whole horizon: sRGB colour, twice as wide as high. Without: the sky.
    pub environment_map: Option<Map>,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: String::new(),
            shading: Shading::Phong,
            technique: Technique::Normal,
            alpha: AlphaMode::Opaque,
            alpha_cutoff: 0.5,
            double_sided: false,
            base_factor: Vec4::ONE,
            base_map: None,
            normal_scale: 1.0,
            normal_map: None,
            specular_factor: default_specular(Shading::Phong),
            specular_map: None,
            specular_strength: 1.0,
            shininess: 32.0,
            glossiness: 1.0,
            metallic: 1.0,
            roughness: 1.0,
            metallic_roughness_map: None,
            occlusion_strength: 1.0,
            occlusion_map: None,
            emissive_factor: Vec3::ZERO,
            emissive_map: None,
            height_scale_uv: 0.02,
            height_rest: 1.0,
            height_map: None,
            emboss_step_texels: 1.0,
            self_shadow: 1.0,
            horizon_maps: [None; 2],
            offset_map: None,
            offset_matrix: Mat2::IDENTITY,
            environment_map: None,
        }
    }
}

/// What a surface reflects where nothing is said: a quarter in the classic models; in glTF's the factors are white.
pub fn default_specular(shading: Shading) -> Vec3 {
    match shading {
        Shading::Phong | Shading::Blinn | Shading::Unlit => Vec3::splat(0.25),
        Shading::MetallicRoughness | Shading::SpecularGlossiness => Vec3::ONE,
    }
}

impl Material {
    /// The defaults of a shading model; [`Material::default`] is Phong's.
    pub fn new(shading: Shading) -> Self {
        Self { shading, specular_factor: default_specular(shading), ..Self::default() }
    }

    /// The maps in the order of [`crate::draw_list::MapSlot`].
    pub fn maps(&self) -> [Option<Map>; MAP_COUNT] {
        [
            self.base_map,
            self.normal_map,
            self.specular_map,
            self.metallic_roughness_map,
            self.occlusion_map,
            self.emissive_map,
            self.height_map,
            self.horizon_maps[0],
            self.horizon_maps[1],
            self.offset_map,
            self.environment_map,
        ]
    }

    /// The UV set that the surface's bumps are placed by, which tangents are to follow; `None` without any. The normal
    /// map's, where other maps are placed otherwise.
    pub fn bump_uv_set(&self) -> Option<usize> {
        let [first, second] = self.horizon_maps;
        let maps = [self.normal_map, self.height_map, first, second, self.offset_map];
        maps.into_iter().flatten().next().map(|map| map.uv_set.min(1) as usize)
    }
}

/// A mesh with what is derived from it when it is added.
#[derive(Clone, Debug)]
pub struct MeshEntry {
    /// The mesh; once `tangents_ready`, with tangents.
    pub mesh: Mesh,
    /// Encloses all positions, object space.
    pub bounds: Sphere,
    /// Set by the tangents system.
    pub tangents_ready: bool,
    /// Levels of detail, the mesh itself first; made by the levels system. Empty until then: the renderer draws only
    /// meshes that have them.
    pub levels: Vec<Level>,
    /// The indices of all levels but the first, which is [`Mesh::indices`].
    pub level_indices: Vec<u32>,
}

/// All meshes, materials and images of a world.
#[derive(Resource, Debug)]
pub struct Library {
    meshes: Vec<MeshEntry>,
    materials: Vec<Material>,
    images: Vec<Image>,
    /// Materials edited since the materials system last looked.
    edited_materials: Vec<MaterialId>,
    /// Meshes that were cut, and their pieces.
    pieces: HashMap<(MeshId, Grid), Vec<MeshId>>,
    /// Whether images lose their texels when a renderer has them.
    drops_texels: bool,
}

impl Default for Library {
    fn default() -> Self {
        let one = |name: &str, kind, rgba: [u8; 4]| Image::rgba8(name, 1, 1, kind, rgba.to_vec());
        Self {
            meshes: Vec::new(),
            materials: vec![Material {
                name: "default".into(),
                base_factor: Vec4::new(0.5, 0.5, 0.5, 1.0),
                ..Material::default()
            }],
            images: vec![
                one("white colour", ImageKind::Color, [255; 4]),
                one("white data", ImageKind::Data, [255; 4]),
                // In half floats, because no byte is exactly 0.5.
                Image::rgba16("flat normal", 1, 1, ImageKind::Normal, &[Vec4::new(0.5, 0.5, 1.0, 1.0)]),
                one("black data", ImageKind::Data, [0; 4]),
                one("no offset", ImageKind::Data, [128, 128, 0, 255]),
            ],
            edited_materials: Vec::new(),
            pieces: HashMap::new(),
            drops_texels: false,
        }
    }
}

impl Library {
    /// Adds a mesh. Its tangents are computed in the next frame where it brings none.
    pub fn add_mesh(&mut self, mesh: Mesh) -> MeshId {
        let bounds = Sphere::around(&mesh.positions);
        self.meshes.push(MeshEntry {
            mesh,
            bounds,
            tangents_ready: false,
            levels: Vec::new(),
            level_indices: Vec::new(),
        });
        MeshId(self.meshes.len() as u32 - 1)
    }

    /// Adds a mesh that is drawn as it is at any distance: one that would take long to simplify.
    pub fn add_mesh_without_levels(&mut self, mesh: Mesh) -> MeshId {
        let whole = Level::whole(&mesh);
        let id = self.add_mesh(mesh);
        self.meshes[id.0 as usize].levels.push(whole);
        id
    }

    /// The pieces of a mesh in the cells of a grid, with the tangents that the whole mesh has; made when they are first
    /// asked for. None for an id of another library.
    pub fn pieces(&mut self, mesh: MeshId, grid: Grid) -> Vec<MeshId> {
        if let Some(pieces) = self.pieces.get(&(mesh, grid)) {
            return pieces.clone();
        }
        let Some(entry) = self.meshes.get_mut(mesh.0 as usize) else { return Vec::new() };
        if !entry.tangents_ready {
            entry.make_tangents();
        }
        if entry.levels.is_empty() {
            // The pieces have levels; what is not drawn itself needs none.
            entry.levels.push(Level::whole(&entry.mesh));
        }
        let pieces: Vec<MeshId> = split(&entry.mesh, grid).into_iter().map(|piece| self.add_mesh(piece)).collect();
        self.pieces.insert((mesh, grid), pieces.clone());
        pieces
    }

    /// Adds a material.
    pub fn add_material(&mut self, material: Material) -> MaterialId {
        self.materials.push(material);
        MaterialId(self.materials.len() as u32 - 1)
    }

    /// Adds an image.
    pub fn add_image(&mut self, image: Image) -> ImageId {
        self.images.push(image);
        ImageId(self.images.len() as u32 - 1)
    }

    /// How many meshes, materials and images there are.
    pub fn sizes(&self) -> [usize; 3] {
        [self.meshes.len(), self.materials.len(), self.images.len()]
    }

    /// Takes back everything added since [`Library::sizes`] was `sizes`: for a loader that fails half-way, before
    /// anything has seen the new ids.
    pub fn truncate(&mut self, [meshes, materials, images]: [usize; 3]) {
        self.meshes.truncate(meshes);
        self.pieces.retain(|_, pieces| pieces.iter().all(|piece| (piece.0 as usize) < meshes));
        self.materials.truncate(materials);
        self.images.truncate(images);
    }

    /// The mesh of an id; `None` for an id of another library.
    pub fn mesh(&self, id: MeshId) -> Option<&MeshEntry> {
        self.meshes.get(id.0 as usize)
    }

    /// The material of an id.
    pub fn material(&self, id: MaterialId) -> Option<&Material> {
        self.materials.get(id.0 as usize)
    }

    /// The material, or the default where there is no such yet.
    pub(crate) fn known_material(&self, id: MaterialId) -> MaterialId {
        if self.material(id).is_some() { id } else { MaterialId::DEFAULT }
    }

    /// The image of an id.
    pub fn image(&self, id: ImageId) -> Option<&Image> {
        self.images.get(id.0 as usize)
    }

    /// Changes a material; what uses it is drawn anew from the next frame on. `false`: no such material.
    pub fn edit_material(&mut self, id: MaterialId, edit: impl FnOnce(&mut Material)) -> bool {
        let Some(material) = self.materials.get_mut(id.0 as usize) else { return false };
        edit(material);
        self.edited_materials.push(id);
        true
    }

    /// All meshes in id order.
    pub fn meshes(&self) -> &[MeshEntry] {
        &self.meshes
    }

    /// All materials in id order.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// All images in id order; the first five are the stand-ins for missing maps.
    pub fn images(&self) -> &[Image] {
        &self.images
    }

    /// All images in id order, to change them before the first frame that draws them.
    pub fn images_mut(&mut self) -> &mut [Image] {
        &mut self.images
    }

    /// Whether images keep their texels when a renderer has them; they do unless told otherwise. Where they do not,
    /// textures are held once instead of twice, and no second renderer can draw them.
    pub fn keep_texels(&mut self, keep: bool) {
        self.drops_texels = !keep;
    }

    /// For renderers: they have the texels of that image now.
    pub fn uploaded(&mut self, id: ImageId) {
        if self.drops_texels
            && let Some(image) = self.images.get_mut(id.0 as usize)
        {
            image.levels = Vec::new();
        }
    }

    /// Whether an image's texels have been taken by a renderer.
    pub fn lacks_texels(&self) -> bool {
        self.images.iter().any(|image| image.levels.is_empty())
    }

    /// Gives images without texels those of the images that have the same ids in `same`, a library of the same files.
    ///
    /// # Errors
    /// The name of the first image that is another one there; then nothing is given back.
    pub fn restore_texels(&mut self, same: Self) -> Result<(), String> {
        let mut others: Vec<Option<Image>> = same.images.into_iter().map(Some).collect();
        let described = |image: &Image| (image.name.clone(), image.width, image.height, image.kind, image.texels);
        let lacking = || self.images.iter().enumerate().filter(|(_, image)| image.levels.is_empty());
        for (id, image) in lacking() {
            let other = others.get(id).and_then(Option::as_ref);
            if other.is_none_or(|other| described(other) != described(image)) {
                return Err(image.name.clone());
            }
        }
        for (image, other) in self.images.iter_mut().zip(&mut others).filter(|(image, _)| image.levels.is_empty()) {
            image.levels = other.take().map(|other| other.levels).unwrap_or_default();
        }
        Ok(())
    }

    /// The meshes whose tangents or levels are still to be made, to do so before the first frame does.
    pub fn unfinished_meshes(&mut self) -> impl Iterator<Item = &mut MeshEntry> {
        self.meshes.iter_mut().filter(|entry| !entry.is_finished())
    }

    pub(crate) fn meshes_mut(&mut self) -> &mut [MeshEntry] {
        &mut self.meshes
    }

    pub(crate) fn has_edited_materials(&self) -> bool {
        !self.edited_materials.is_empty()
    }

    pub(crate) fn take_edited_materials(&mut self) -> Vec<MaterialId> {
        std::mem::take(&mut self.edited_materials)
    }
}
