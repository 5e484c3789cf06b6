//! Appearance of surfaces: materials, their maps, and meshes.

use super::values::{SMALLEST, Scale};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use std::borrow::Cow;
use std::fmt;
use systems::assets::color_text::Color;
use systems::assets::{self, AlphaMode, Filter, MAP_COUNT, MipFilter, Shading, Technique, Wrap};
use systems::describe::Described;
use systems::space::LARGEST;

/// Most segments of a procedural mesh in one direction.
const MOST_SEGMENTS: u32 = 1024;
/// Most repetitions of an image.
const MOST_TILES: f64 = 1e4;

/// A surface.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Material {
    /// Lighting model.
    pub shading: Shading,
    /// Technique of its bumps.
    #[schemars(extend("see" = "see below"))]
    pub technique: Technique,
    /// Meaning of alpha, which is that of `base_map` times `base_alpha`.
    pub alpha_mode: AlphaMode,
    /// `mask`: least alpha that is drawn.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub alpha_cutoff: f32,
    /// Draws back faces, too.
    pub double_sided: bool,
    /// Sampler of all its maps.
    #[schemars(extend("see" = "[sampler](#sampler)"))]
    pub sampler: Sampler,
    /// Texture coordinates of all its maps.
    #[schemars(extend("see" = "[uv](#uv)"))]
    pub uv: Uv,
    /// Colour; times `base_map`.
    pub base_factor: Color,
    /// Alpha; times that of `base_map`.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub base_alpha: f32,
    /// Colour in sRGB, and alpha.
    pub base_map: Option<Map>,
    /// Strength of `normal_map`; negative turns bumps into dents.
    #[schemars(range(min = -100.0, max = 100.0))]
    pub normal_scale: f32,
    /// Normals in tangent space, green up, linear; alpha is not read.
    pub normal_map: Option<Map>,
    /// Reflected part of light; times `specular_map`; none: 0.25 for `phong` and `blinn`, white for the glTF models.
    pub specular_factor: Option<Color>,
    /// `metallic_roughness`: specularFactor of KHR_materials_specular.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub specular_strength: f32,
    /// Reflected part, linear; `specular_glossiness`: alpha is glossiness.
    pub specular_map: Option<Map>,
    /// `phong`, `blinn`: exponent; larger is a smaller highlight.
    #[schemars(range(min = 0.0, max = 1e5))]
    pub shininess: f32,
    /// `specular_glossiness`: glossiness; times the map's alpha.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub glossiness: f32,
    /// `metallic_roughness`: metallic part; times the map's blue.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub metallic: f32,
    /// `metallic_roughness`: roughness; times the map's green.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub roughness: f32,
    /// Roughness in green, metallic part in blue, linear.
    pub metallic_roughness_map: Option<Map>,
    /// Strength of `occlusion_map`.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub occlusion_strength: f32,
    /// Part of the ambient light that reaches the texel in red, linear; not for `phong`, `blinn`.
    pub occlusion_map: Option<Map>,
    /// Glow of its own; times `emissive_map`; with `phong`, `blinn` times the base colour, too.
    pub emissive_factor: Color,
    /// Glow in sRGB; give an `emissive_factor` with it.
    pub emissive_map: Option<Map>,
    /// Depth from black to white of `height_map`, in widths of the image.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub height_scale_uv: f32,
    /// Height at which the mesh's own surface lies; 1: everything is carved into it.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub height_rest: f32,
    /// Heights, linear; 0 deepest, 1 highest.
    pub height_map: Option<Map>,
    /// `emboss`: distance from the texel at which the second height is read.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub emboss_step_texels: f32,
    /// Darkness of the bumps' own shadows, in techniques that have them.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub self_shadow: f32,
    /// Horizon in directions 0°, 45°, 90°, 135°, linear; `relief map horizon` makes both.
    pub horizon_map_0: Option<Map>,
    /// Horizon in directions 180°, 225°, 270°, 315°, linear.
    pub horizon_map_1: Option<Map>,
    /// Shifts du (red) and dv (green) of `perturbed_uv`, linear, 128 is none; `relief map offset` makes it.
    pub offset_map: Option<Map>,
    /// Rows of a matrix from (du, dv) to a shift in `perturbed_uv`'s mirror.
    #[schemars(inner(inner(range(min = -10.0, max = 10.0))))]
    pub offset_matrix: [[f32; 2]; 2],
    /// Mirror image of `perturbed_uv` in sRGB, all around, twice as wide as high; none: the sky.
    pub environment_map: Option<Map>,
}

impl Described for Material {}

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
            ("base_map", &self.base_map),
            ("normal_map", &self.normal_map),
            ("specular_map", &self.specular_map),
            ("metallic_roughness_map", &self.metallic_roughness_map),
            ("occlusion_map", &self.occlusion_map),
            ("emissive_map", &self.emissive_map),
            ("height_map", &self.height_map),
            ("horizon_map_0", &self.horizon_map_0),
            ("horizon_map_1", &self.horizon_map_1),
            ("offset_map", &self.offset_map),
            ("environment_map", &self.environment_map),
        ]
        .map(|(name, map)| (name, map.as_ref().map(|Map(source)| source)))
    }
}

/// A map: a path, or a path with settings of its own.
#[derive(Serialize, Debug)]
pub struct Map(pub MapSource);

/// An image, and settings that differ from the material's.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(deny_unknown_fields)]
pub struct MapSource {
    /// Path: PNG, JPEG, TGA, BMP, WebP, DDS or OpenEXR; see [images](#images).
    #[schemars(extend("see" = "path"))]
    pub file: String,
    /// Sampler of this map; by default the material's.
    #[serde(default)]
    #[schemars(extend("see" = "[sampler](#sampler)"))]
    pub sampler: Option<Sampler>,
    /// Texture coordinates of this map; by default the material's.
    #[serde(default)]
    #[schemars(extend("see" = "[uv](#uv)"))]
    pub uv: Option<Uv>,
}

impl Described for MapSource {}

/// By hand and not `untagged`, which would lose the place and the nearest name of an unknown field.
impl<'de> Deserialize<'de> for Map {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct PathOrFields;
        impl<'de> Visitor<'de> for PathOrFields {
            type Value = Map;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("the path of an image or (file: \"path\", …)")
            }

            fn visit_str<E>(self, file: &str) -> Result<Map, E> {
                Ok(Map(MapSource { file: file.into(), sampler: None, uv: None }))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Map, A::Error> {
                MapSource::deserialize(MapAccessDeserializer::new(map)).map(Map)
            }
        }
        deserializer.deserialize_any(PathOrFields)
    }
}

impl JsonSchema for Map {
    fn schema_name() -> Cow<'static, str> {
        "Map".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let fields = generator.subschema_for::<MapSource>();
        json_schema!({ "anyOf": [{ "type": "string" }, fields], "see": "[map](#map)" })
    }
}

/// Reading of an image between and beyond its texels.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, Default)]
#[serde(default, deny_unknown_fields)]
pub struct Sampler {
    /// Continuation outside of the image, in both directions; `repeat` where none is given.
    pub wrap: Option<Wrap>,
    /// Continuation along u only.
    pub wrap_u: Option<Wrap>,
    /// Continuation along v only.
    pub wrap_v: Option<Wrap>,
    /// Filter where a texel covers more than a pixel; by default `linear`.
    pub mag: Option<Filter>,
    /// Filter where a pixel covers more than a texel; by default `linear`.
    pub min: Option<Filter>,
    /// Filter between mip levels; by default `linear`.
    pub mip: Option<MipFilter>,
}

impl Described for Sampler {}

/// Texture coordinates of a map.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Uv {
    /// Repetitions of the image along u and v.
    #[schemars(inner(range(min = -MOST_TILES, max = MOST_TILES)))]
    pub scale: [f32; 2],
    /// Shift in widths and heights of the image.
    #[schemars(inner(range(min = -MOST_TILES, max = MOST_TILES)))]
    pub offset: [f32; 2],
    /// Turn about the top left corner.
    #[schemars(range(min = -1e6, max = 1e6), extend("unit" = "°"))]
    pub rotation_degrees: f32,
    /// Set of the mesh's coordinates.
    #[schemars(range(min = 0, max = 1))]
    pub set: u32,
}

impl Described for Uv {}

impl Default for Uv {
    fn default() -> Self {
        Self { scale: [1.0; 2], offset: [0.0; 2], rotation_degrees: 0.0, set: 0 }
    }
}

/// A procedural mesh, or a model.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(rename_all = "snake_case")]
pub enum MeshSource {
    /// A rectangle in XZ, seen from above.
    Plane(Plane),
    /// A box.
    Cube(Cube),
    /// A ball.
    Sphere(Sphere),
    /// A ring around the Y axis.
    Torus(Torus),
    /// A cylinder along the Y axis, with both caps.
    Cylinder(Cylinder),
    /// A glTF file.
    Model(ModelSource),
}

impl Described for MeshSource {}

/// A rectangle in XZ, seen from above (+Y).
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Plane {
    /// Lengths along x and z.
    #[schemars(inner(range(min = SMALLEST, max = LARGEST)), extend("unit" = "m"))]
    pub size: [f32; 2],
    /// Quads along x and z.
    #[schemars(inner(range(min = 1, max = MOST_SEGMENTS)))]
    pub segments: [u32; 2],
    /// Repetitions of the image along u and v.
    #[schemars(inner(range(min = -MOST_TILES, max = MOST_TILES)))]
    pub uv_scale: [f32; 2],
    /// Length after which the image repeats; `uv_scale` times as often.
    #[schemars(range(min = 0.001, max = 1e6), extend("unit" = "m"))]
    pub tile_metres: Option<f32>,
}

impl Described for Plane {}

impl Default for Plane {
    fn default() -> Self {
        Self { size: [1.0; 2], segments: [1; 2], uv_scale: [1.0; 2], tile_metres: None }
    }
}

/// A box; each face shows the whole image.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Cube {
    /// Lengths along the axes.
    #[schemars(extend("minimum" = SMALLEST, "maximum" = LARGEST, "unit" = "m"))]
    pub size: Scale,
    /// Repetitions of the image along u and v.
    #[schemars(inner(range(min = -MOST_TILES, max = MOST_TILES)))]
    pub uv_scale: [f32; 2],
    /// Length after which the image repeats; `uv_scale` times as often.
    #[schemars(range(min = 0.001, max = 1e6), extend("unit" = "m"))]
    pub tile_metres: Option<f32>,
}

impl Described for Cube {}

impl Default for Cube {
    fn default() -> Self {
        Self { size: Scale::default(), uv_scale: [1.0; 2], tile_metres: None }
    }
}

/// A ball.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Sphere {
    /// Radius.
    #[schemars(range(min = SMALLEST, max = LARGEST), extend("unit" = "m"))]
    pub radius: f32,
    /// Segments around.
    #[schemars(range(min = 3, max = MOST_SEGMENTS))]
    pub segments: u32,
    /// Rings from pole to pole.
    #[schemars(range(min = 2, max = MOST_SEGMENTS))]
    pub rings: u32,
    /// Repetitions of the image along u and v.
    #[schemars(inner(range(min = -MOST_TILES, max = MOST_TILES)))]
    pub uv_scale: [f32; 2],
}

impl Described for Sphere {}

impl Default for Sphere {
    fn default() -> Self {
        Self { radius: 0.5, segments: 48, rings: 24, uv_scale: [1.0; 2] }
    }
}

/// A ring around the Y axis.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Torus {
    /// Radius from the axis to the middle of the tube.
    #[schemars(range(min = SMALLEST, max = LARGEST), extend("unit" = "m"))]
    pub major: f32,
    /// Radius of the tube.
    #[schemars(range(min = SMALLEST, max = LARGEST), extend("unit" = "m"))]
    pub minor: f32,
    /// Segments around the axis.
    #[schemars(range(min = 3, max = MOST_SEGMENTS))]
    pub segments: u32,
    /// Segments around the tube.
    #[schemars(range(min = 3, max = MOST_SEGMENTS))]
    pub sides: u32,
    /// Repetitions of the image along u and v.
    #[schemars(inner(range(min = -MOST_TILES, max = MOST_TILES)))]
    pub uv_scale: [f32; 2],
}

impl Described for Torus {}

impl Default for Torus {
    fn default() -> Self {
        Self { major: 0.5, minor: 0.2, segments: 64, sides: 32, uv_scale: [1.0; 2] }
    }
}

/// A cylinder along the Y axis, with both caps.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Cylinder {
    /// Radius.
    #[schemars(range(min = SMALLEST, max = LARGEST), extend("unit" = "m"))]
    pub radius: f32,
    /// Height.
    #[schemars(range(min = SMALLEST, max = LARGEST), extend("unit" = "m"))]
    pub height: f32,
    /// Segments around.
    #[schemars(range(min = 3, max = MOST_SEGMENTS))]
    pub segments: u32,
    /// Repetitions of the image along u and v.
    #[schemars(inner(range(min = -MOST_TILES, max = MOST_TILES)))]
    pub uv_scale: [f32; 2],
}

impl Described for Cylinder {}

impl Default for Cylinder {
    fn default() -> Self {
        Self { radius: 0.5, height: 1.0, segments: 48, uv_scale: [1.0; 2] }
    }
}

/// A glTF file, with its materials, lights and cameras.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(deny_unknown_fields)]
pub struct ModelSource {
    /// Path: `.gltf` or `.glb`.
    #[schemars(extend("see" = "path"))]
    pub file: String,
    /// Name of the only node that is taken, with those below it. It is moved to the origin, and keeps its size and
    /// turn.
    #[serde(default)]
    pub node: Option<String>,
    /// Has its lights [cast shadows](#lights).
    #[serde(default)]
    pub shadows: bool,
    /// Names of its materials whose surfaces cast no shadow: the glass around a lamp.
    #[serde(default)]
    pub casts_no_shadow: Vec<String>,
}

impl Described for ModelSource {}
