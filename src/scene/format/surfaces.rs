//! Appearance of surfaces: materials, their maps, and meshes.

use super::values::{Scale, names, one_of};
use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::fmt;
use systems::assets::color_text::Color;
use systems::assets::{self, AlphaMode, Filter, MAP_COUNT, MipFilter, Shading, Technique, Wrap};

fn technique<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Technique, D::Error> {
    const NAMES: [&str; Technique::ALL.len()] = names(&Technique::ALL);
    one_of(&Technique::ALL, &NAMES, deserializer)
}

#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Material {
    pub shading: Shading,
    #[serde(deserialize_with = "technique")]
    pub technique: Technique,
    pub alpha_mode: AlphaMode,
    pub alpha_cutoff: f32,
    pub double_sided: bool,
    pub sampler: Sampler,
    pub uv: Uv,
    pub base_factor: Color,
    pub base_alpha: f32,
    pub base_map: Option<MapSource>,
    pub normal_scale: f32,
    pub normal_map: Option<MapSource>,
    pub specular_factor: Option<Color>,
    pub specular_strength: f32,
    pub specular_map: Option<MapSource>,
    pub shininess: f32,
    pub glossiness: f32,
    pub metallic: f32,
    pub roughness: f32,
    pub metallic_roughness_map: Option<MapSource>,
    pub occlusion_strength: f32,
    pub occlusion_map: Option<MapSource>,
    pub emissive_factor: Color,
    pub emissive_map: Option<MapSource>,
    pub height_scale_uv: f32,
    pub height_rest: f32,
    pub height_map: Option<MapSource>,
    pub emboss_step_texels: f32,
    pub self_shadow: f32,
    pub horizon_map_0: Option<MapSource>,
    pub horizon_map_1: Option<MapSource>,
    pub offset_map: Option<MapSource>,
    pub offset_matrix: [[f32; 2]; 2],
    pub environment_map: Option<MapSource>,
}

impl Default for Material {
    fn default() -> Self {
        let m = assets::Material::default();
        Self {
            shading: m.shading,
            technique: m.technique,
            alpha_mode: m.alpha,
            alpha_cutoff: m.alpha_cutoff,
            double_sided: m.double_sided,
            sampler: Sampler::default(),
            uv: Uv::default(),
            base_factor: Color::linear(m.base_factor.truncate()),
            base_alpha: m.base_factor.w,
            base_map: None,
            normal_scale: m.normal_scale,
            normal_map: None,
            specular_factor: None,
            specular_strength: m.specular_strength,
            specular_map: None,
            shininess: m.shininess,
            glossiness: m.glossiness,
            metallic: m.metallic,
            roughness: m.roughness,
            metallic_roughness_map: None,
            occlusion_strength: m.occlusion_strength,
            occlusion_map: None,
            emissive_factor: Color::linear(m.emissive_factor),
            emissive_map: None,
            height_scale_uv: m.height_scale_uv,
            height_rest: m.height_rest,
            height_map: None,
            emboss_step_texels: m.emboss_step_texels,
            self_shadow: m.self_shadow,
            horizon_map_0: None,
            horizon_map_1: None,
            offset_map: None,
            offset_matrix: m.offset_matrix.transpose().to_cols_array_2d(),
            environment_map: None,
        }
    }
}

impl Material {
    /// The maps with their field names.
    pub fn maps(&self) -> [(&'static str, Option<&MapSource>); MAP_COUNT] {
        [
            ("base_map", self.base_map.as_ref()),
            ("normal_map", self.normal_map.as_ref()),
            ("specular_map", self.specular_map.as_ref()),
            ("metallic_roughness_map", self.metallic_roughness_map.as_ref()),
            ("occlusion_map", self.occlusion_map.as_ref()),
            ("emissive_map", self.emissive_map.as_ref()),
            ("height_map", self.height_map.as_ref()),
            ("horizon_map_0", self.horizon_map_0.as_ref()),
            ("horizon_map_1", self.horizon_map_1.as_ref()),
            ("offset_map", self.offset_map.as_ref()),
            ("environment_map", self.environment_map.as_ref()),
        ]
    }
}

/// A map: a path, or a path with what differs from the material's `sampler` and `uv`.
#[derive(Debug)]
pub struct MapSource {
    pub file: String,
    pub sampler: Option<Sampler>,
    pub uv: Option<Uv>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MapFields {
    file: String,
    #[serde(default)]
    sampler: Option<Sampler>,
    #[serde(default)]
    uv: Option<Uv>,
}

/// By hand and not `untagged`, which would lose the place and the nearest name of an unknown field.
impl<'de> Deserialize<'de> for MapSource {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct PathOrFields;
        impl<'de> Visitor<'de> for PathOrFields {
            type Value = MapSource;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("the path of an image or (file: \"path\", …)")
            }

            fn visit_str<E>(self, file: &str) -> Result<MapSource, E> {
                Ok(MapSource { file: file.into(), sampler: None, uv: None })
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<MapSource, A::Error> {
                let MapFields { file, sampler, uv } = MapFields::deserialize(MapAccessDeserializer::new(map))?;
                Ok(MapSource { file, sampler, uv })
            }
        }
        deserializer.deserialize_any(PathOrFields)
    }
}

/// `wrap` is both directions at once.
#[derive(Deserialize, Clone, Copy, Debug, Default)]
#[serde(default, deny_unknown_fields)]
pub struct Sampler {
    pub wrap: Option<Wrap>,
    pub wrap_u: Option<Wrap>,
    pub wrap_v: Option<Wrap>,
    pub mag: Option<Filter>,
    pub min: Option<Filter>,
    pub mip: Option<MipFilter>,
}

#[derive(Deserialize, Clone, Copy, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Uv {
    pub scale: [f32; 2],
    pub offset: [f32; 2],
    pub rotation_degrees: f32,
    pub set: u32,
}

impl Default for Uv {
    fn default() -> Self {
        Self { scale: [1.0; 2], offset: [0.0; 2], rotation_degrees: 0.0, set: 0 }
    }
}

#[derive(Deserialize, Debug)]
#[serde(rename_all = "snake_case")]
pub enum MeshSource {
    Plane(Plane),
    Cube(Cube),
    Sphere(Sphere),
    Torus(Torus),
    Cylinder(Cylinder),
    Model(ModelSource),
}

#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Plane {
    pub size: [f32; 2],
    pub segments: [u32; 2],
    pub uv_scale: [f32; 2],
    pub tile_metres: Option<f32>,
}

impl Default for Plane {
    fn default() -> Self {
        Self { size: [1.0; 2], segments: [1; 2], uv_scale: [1.0; 2], tile_metres: None }
    }
}

#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Cube {
    pub size: Scale,
    pub uv_scale: [f32; 2],
    pub tile_metres: Option<f32>,
}

impl Default for Cube {
    fn default() -> Self {
        Self { size: Scale::default(), uv_scale: [1.0; 2], tile_metres: None }
    }
}

#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Sphere {
    pub radius: f32,
    pub segments: u32,
    pub rings: u32,
    pub uv_scale: [f32; 2],
}

impl Default for Sphere {
    fn default() -> Self {
        Self { radius: 0.5, segments: 48, rings: 24, uv_scale: [1.0; 2] }
    }
}

#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Torus {
    pub major: f32,
    pub minor: f32,
    pub segments: u32,
    pub sides: u32,
    pub uv_scale: [f32; 2],
}

impl Default for Torus {
    fn default() -> Self {
        Self { major: 0.5, minor: 0.2, segments: 64, sides: 32, uv_scale: [1.0; 2] }
    }
}

#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Cylinder {
    pub radius: f32,
    pub height: f32,
    pub segments: u32,
    pub uv_scale: [f32; 2],
}

impl Default for Cylinder {
    fn default() -> Self {
        Self { radius: 0.5, height: 1.0, segments: 48, uv_scale: [1.0; 2] }
    }
}

#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct ModelSource {
    pub file: String,
    #[serde(default)]
    pub node: Option<String>,
    #[serde(default)]
    pub shadows: bool,
    #[serde(default)]
    pub casts_no_shadow: Vec<String>,
}
