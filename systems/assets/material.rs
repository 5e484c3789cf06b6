//! Materials: what a surface looks like, the maps that say so, and the component that names one.

use super::image::ImageId;
use super::slots::slot_id;
use super::technique::Technique;
use bevy_ecs::prelude::*;
use glam::{Affine2, Mat2, Vec3, Vec4};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Names a [`Material`] of the [`Library`](crate::assets::Library). As a component: the material of a drawn entity.
#[derive(Component, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Serialize, Deserialize)]
#[component(summary_tick)]
pub struct MaterialId(u32);
slot_id!(MaterialId);

impl MaterialId {
    /// The neutral grey material that every library starts with.
    pub const DEFAULT: Self = Self::from_slot(0);
}

impl Default for MaterialId {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Reading of a texture coordinate outside 0..1.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Wrap {
    /// The image repeats.
    #[default]
    Repeat,
    /// Every second copy is mirrored.
    Mirror,
    /// The edge texel continues.
    Clamp,
}

/// Filtering of texels within a mip level.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Filter {
    /// The nearest texel.
    Nearest,
    /// Bilinear.
    #[default]
    Linear,
}

/// Choice of mip levels.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MipFilter {
    /// Only the full-size level.
    None,
    /// The nearest level.
    Nearest,
    /// Blend of the two nearest levels.
    #[default]
    Linear,
}

/// Sampling of a map; the default repeats with trilinear filtering.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
pub struct Sampler {
    /// Along u.
    pub wrap_u: Wrap,
    /// Along v.
    pub wrap_v: Wrap,
    /// Magnification: a texel covers more than a pixel.
    pub mag: Filter,
    /// Minification: a pixel covers more than a texel.
    pub min: Filter,
    /// Between mip levels.
    pub mip: MipFilter,
}

/// An image as a material uses it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Map {
    /// The image; its [`ImageKind`](crate::assets::ImageKind) must suit the map: colour for base (blended or masked
    /// where the material's alpha is), emissive and environment maps; normal for normal maps; height for height maps;
    /// data else.
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

    /// Tells if it is read elsewhere than at the first UV set as it is.
    pub fn is_transformed(&self) -> bool {
        self.uv_set != 0 || self.image_from_mesh_uv != Affine2::IDENTITY
    }
}

/// The maps of a material, in the order of its bindings.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(usize)]
pub enum MapSlot {
    /// Base colour.
    Base,
    /// Tangent-space normals.
    Normal,
    /// Specular.
    Specular,
    /// Metallic (b) and roughness (g).
    MetallicRoughness,
    /// Ambient occlusion (r).
    Occlusion,
    /// Emissive colour.
    Emissive,
    /// Height (r).
    Height,
    /// Horizon in the first four directions.
    Horizon0,
    /// Horizon in the other four.
    Horizon1,
    /// Offsets of the environment's look-up (rg).
    Offset,
    /// Environment.
    Environment,
}

/// Number of [`MapSlot`]s.
pub const MAP_COUNT: usize = 11;

/// The lighting model of a material; the formulas are in `shaders/lighting.wgsl`.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Shading {
    /// Diffuse plus Phong's reflected vector: base, specular map and shininess.
    #[default]
    Phong,
    /// `Phong` with Blinn's half vector.
    Blinn,
    /// glTF 2.0 metallic-roughness, GGX.
    MetallicRoughness,
    /// KHR_materials_pbrSpecularGlossiness, GGX: diffuse (base), specular (rgb) and glossiness (specular map's alpha).
    SpecularGlossiness,
    /// Base colour only, no light.
    Unlit,
}

/// Meaning of base alpha.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
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
    /// Panorama that `PerturbedUv` mirrors, around the whole horizon: sRGB colour, twice as wide as high. `None`: the
    /// sky.
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

/// Default specular colour of a shading model: a quarter in the classic models; in glTF's the factors are white.
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

    /// The maps in the order of [`MapSlot`].
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

    /// The maps in the order of [`MapSlot`], to be changed.
    pub fn maps_mut(&mut self) -> [&mut Option<Map>; MAP_COUNT] {
        let [first_horizon, second_horizon] = &mut self.horizon_maps;
        [
            &mut self.base_map,
            &mut self.normal_map,
            &mut self.specular_map,
            &mut self.metallic_roughness_map,
            &mut self.occlusion_map,
            &mut self.emissive_map,
            &mut self.height_map,
            first_horizon,
            second_horizon,
            &mut self.offset_map,
            &mut self.environment_map,
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
