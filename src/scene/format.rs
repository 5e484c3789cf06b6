//! The scene file as text describes it: plain structs for serde, before names are resolved and files are read.
//!
//! `docs/scenes.md` says what every field means; a test looks for each of them there. Defaults are those of the
//! components and library items that the fields become.

use super::values::{Color, MapSource, Named, Scale};
use serde::Deserialize;
use systems::components as world;
use systems::library as lib;

/// A whole file.
#[derive(Deserialize, Debug, Default)]
#[serde(default, deny_unknown_fields)]
pub struct Scene {
    pub seed: u64,
    pub environment: Environment,
    pub clock: Clock,
    pub materials: Named<Material>,
    pub meshes: Named<MeshSource>,
    pub entities: Vec<Entity>,
    pub generators: Vec<Generator>,
}

#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Environment {
    pub ambient: Color,
    pub zenith: Color,
    pub horizon: Color,
    pub ground: Color,
    pub exposure: f32,
    pub tone_map: ToneMap,
}

impl Default for Environment {
    fn default() -> Self {
        let e = world::Environment::default();
        Self {
            ambient: Color::linear(e.ambient),
            zenith: Color::linear(e.zenith),
            horizon: Color::linear(e.horizon),
            ground: Color::linear(e.ground),
            exposure: e.exposure,
            tone_map: ToneMap::Agx,
        }
    }
}

#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Clock {
    pub step_seconds: f64,
    pub speed: f64,
    pub paused: bool,
}

impl Default for Clock {
    fn default() -> Self {
        let clock = systems::clock::Clock::default();
        Self { step_seconds: clock.step_seconds, speed: clock.speed, paused: clock.paused }
    }
}

/// Enums of the other crate under the names that scene files use.
macro_rules! named_choices {
    ($($name:ident => $target:ty { $($variant:ident),* })*) => {$(
        #[derive(Deserialize, Clone, Copy, Debug, PartialEq)]
        #[serde(rename_all = "snake_case")]
        pub enum $name { $($variant),* }

        impl From<$name> for $target {
            fn from(choice: $name) -> Self {
                match choice { $($name::$variant => <$target>::$variant),* }
            }
        }
    )*};
}

named_choices! {
    ToneMap => world::ToneMap { Clamp, Aces, Agx }
    Shading => lib::Shading { Phong, Blinn, MetallicRoughness, SpecularGlossiness, Unlit }
    Technique => lib::Technique { Off, Normal, PerturbedNormal }
    AlphaMode => lib::AlphaMode { Opaque, Mask, Blend }
    Wrap => lib::Wrap { Repeat, Mirror, Clamp }
    Filter => lib::Filter { Nearest, Linear }
    MipFilter => lib::MipFilter { None, Nearest, Linear }
}

#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Material {
    pub shading: Shading,
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
    pub specular_factor: Color,
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
    pub height_map: Option<MapSource>,
}

impl Default for Material {
    fn default() -> Self {
        let m = lib::Material::default();
        Self {
            shading: Shading::Phong,
            technique: Technique::Normal,
            alpha_mode: AlphaMode::Opaque,
            alpha_cutoff: m.alpha_cutoff,
            double_sided: m.double_sided,
            sampler: Sampler::default(),
            uv: Uv::default(),
            base_factor: Color::linear(m.base_factor.truncate()),
            base_alpha: m.base_factor.w,
            base_map: None,
            normal_scale: m.normal_scale,
            normal_map: None,
            specular_factor: Color::linear(m.specular_factor),
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
            height_map: None,
        }
    }
}

impl Material {
    /// The maps with their field names.
    pub fn maps(&self) -> [(&'static str, Option<&MapSource>); 7] {
        [
            ("base_map", self.base_map.as_ref()),
            ("normal_map", self.normal_map.as_ref()),
            ("specular_map", self.specular_map.as_ref()),
            ("metallic_roughness_map", self.metallic_roughness_map.as_ref()),
            ("occlusion_map", self.occlusion_map.as_ref()),
            ("emissive_map", self.emissive_map.as_ref()),
            ("height_map", self.height_map.as_ref()),
        ]
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
}

/// One entity, or one kind of entity for a generator. `node` counts only within `attach`.
#[derive(Deserialize, Debug, Default)]
#[serde(default, deny_unknown_fields)]
pub struct Entity {
    pub name: Option<String>,
    pub node: Option<String>,
    pub transform: Transform,
    pub mesh: Option<String>,
    pub material: Option<String>,
    pub light: Option<Light>,
    pub camera: Option<Camera>,
    pub spin: Option<Spin>,
    pub figure: Vec<String>,
    pub attach: Vec<Entity>,
    pub children: Vec<Entity>,
}

#[derive(Deserialize, Debug, Default)]
#[serde(default, deny_unknown_fields)]
pub struct Transform {
    pub translation: [f32; 3],
    pub rotation_degrees: Option<[f32; 3]>,
    pub quaternion: Option<[f32; 4]>,
    pub look_at: Option<[f32; 3]>,
    pub scale: Scale,
}

#[derive(Deserialize, Debug)]
#[serde(rename_all = "snake_case")]
pub enum Light {
    Point(PointLight),
    Spot(SpotLight),
    Directional(DirectionalLight),
}

#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct PointLight {
    pub color: Color,
    pub intensity: f32,
    pub range: Option<f32>,
    pub attenuation: [f32; 3],
    pub ambient: Color,
    pub on: bool,
}

impl Default for PointLight {
    fn default() -> Self {
        let light = world::Light::point(1.0, f32::INFINITY);
        Self {
            color: Color::linear(light.color),
            intensity: light.intensity,
            range: None,
            attenuation: light.attenuation.to_array(),
            ambient: Color::linear(light.ambient),
            on: light.enabled,
        }
    }
}

/// Two kinds of cone: `cutoff_degrees` with `exponent`, or `outer_degrees` with `inner_degrees`.
#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct SpotLight {
    pub color: Color,
    pub intensity: f32,
    pub range: Option<f32>,
    pub attenuation: [f32; 3],
    pub ambient: Color,
    pub on: bool,
    pub cutoff_degrees: Option<f32>,
    pub exponent: Option<f32>,
    pub inner_degrees: Option<f32>,
    pub outer_degrees: Option<f32>,
}

impl Default for SpotLight {
    fn default() -> Self {
        let PointLight { color, intensity, range, attenuation, ambient, on } = PointLight::default();
        let cone = (None, None, None, None);
        let (cutoff_degrees, exponent, inner_degrees, outer_degrees) = cone;
        Self {
            color,
            intensity,
            range,
            attenuation,
            ambient,
            on,
            cutoff_degrees,
            exponent,
            inner_degrees,
            outer_degrees,
        }
    }
}

#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct DirectionalLight {
    pub color: Color,
    pub intensity: f32,
    pub ambient: Color,
    pub on: bool,
}

impl Default for DirectionalLight {
    fn default() -> Self {
        let PointLight { color, intensity, ambient, on, .. } = PointLight::default();
        Self { color, intensity, ambient, on }
    }
}

/// Perspective with `fov_y_degrees`, or orthographic with `orthographic_half_height`.
#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Camera {
    pub fov_y_degrees: Option<f32>,
    pub aspect: Option<f32>,
    pub orthographic_half_height: Option<f32>,
    pub near: f32,
    pub far: Option<f32>,
}

impl Default for Camera {
    fn default() -> Self {
        let near = world::Camera::default().near;
        Self { fov_y_degrees: None, aspect: None, orthographic_half_height: None, near, far: None }
    }
}

#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Spin {
    pub axis: [f32; 3],
    pub degrees_per_second: f32,
}

impl Default for Spin {
    fn default() -> Self {
        Self { axis: [0.0, 1.0, 0.0], degrees_per_second: 30.0 }
    }
}

#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct Generator {
    pub place: Place,
    #[serde(default)]
    pub name: Option<String>,
    #[serde(default)]
    pub entity: Entity,
    #[serde(default)]
    pub meshes: Vec<String>,
    #[serde(default)]
    pub materials: Vec<String>,
    #[serde(default)]
    pub lights: Vec<Light>,
    #[serde(default)]
    pub choose: Choose,
    #[serde(default)]
    pub random_yaw: bool,
    #[serde(default = "unit_range")]
    pub random_scale: [f32; 2],
    #[serde(default)]
    pub seed: Option<u64>,
}

fn unit_range() -> [f32; 2] {
    [1.0; 2]
}

#[derive(Deserialize, Clone, Copy, Debug, Default, PartialEq)]
#[serde(rename_all = "snake_case")]
pub enum Choose {
    #[default]
    InTurn,
    Random,
}

#[derive(Deserialize, Debug)]
#[serde(rename_all = "snake_case")]
pub enum Place {
    Grid(Grid),
    Scatter(Scatter),
}

#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct Grid {
    pub counts: [u32; 3],
    #[serde(default = "unit_spacing")]
    pub spacing: [f32; 3],
    #[serde(default)]
    pub center: [f32; 3],
    #[serde(default)]
    pub jitter: [f32; 3],
}

fn unit_spacing() -> [f32; 3] {
    [1.0; 3]
}

#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct Scatter {
    pub region: Region,
    pub count: u32,
    #[serde(default)]
    pub min_distance: f32,
}

#[derive(Deserialize, Debug)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Region {
    Box { min: [f32; 3], max: [f32; 3] },
    Disc { center: [f32; 3], radius: f32 },
}
