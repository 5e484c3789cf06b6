//! The scene file as text describes it: plain structs for serde, before names are resolved and files are read.
//! Materials and meshes are in [`super::surfaces`], lights in [`super::lights`].
//!
//! `docs/scenes.md` says what every field means; a test looks for each of them there. Defaults are those of the
//! components and library items that the fields become.

use super::custom_fields::{self, Custom};
pub use super::lights::Light;
pub use super::motion_sensors::GeoOrigin;
use super::rigs::Rigs;
pub use super::roads::*;
pub use super::sensors::{Class, Sensor};
pub use super::surfaces::*;
use super::values::{Color, Named, Scale, names, one_of};
use serde::{Deserialize, Deserializer};
use systems::draw;
use systems::lights::LightPolicy;

/// A whole file.
#[derive(Deserialize, Debug)]
#[serde(default, remote = "Self")]
pub struct Scene {
    pub seed: u64,
    pub origin: Option<[f64; 3]>,
    pub geo_origin: Option<GeoOrigin>,
    pub piece_metres: f32,
    pub lights: Option<Lights>,
    pub environment: Environment,
    pub clock: Clock,
    pub vehicle_types: Vec<String>,
    pub materials: Named<Material>,
    pub meshes: Named<MeshSource>,
    pub signals: Named<Signal>,
    pub routes: Named<Route>,
    pub traffic: Traffic,
    pub cells: Named<Cell>,
    pub portals: Vec<Portal>,
    pub classes: Named<Class>,
    pub entities: Vec<Entity>,
    pub generators: Vec<Generator>,
    /// Once they have been read.
    #[serde(skip)]
    pub rigs: Rigs,
    #[serde(skip)]
    pub custom: Custom,
}

/// By what serde derives, which is a function of that name, but for the fields that a program has added.
impl<'de> Deserialize<'de> for Scene {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (scene, custom) = custom_fields::beside(deserializer, |deserializer| Self::deserialize(deserializer))?;
        Ok(Self { custom, ..scene })
    }
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            seed: 0,
            origin: None,
            geo_origin: None,
            piece_metres: systems::draw::pieces::DEFAULT_METRES,
            lights: None,
            environment: Environment::default(),
            clock: Clock::default(),
            vehicle_types: Vec::new(),
            materials: Named::default(),
            meshes: Named::default(),
            signals: Named::default(),
            routes: Named::default(),
            traffic: Traffic::default(),
            cells: Named::default(),
            portals: Vec::new(),
            classes: Named::default(),
            entities: Vec::new(),
            generators: Vec::new(),
            rigs: Rigs::default(),
            custom: Custom::default(),
        }
    }
}

#[derive(Deserialize, Clone, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Environment {
    pub ambient: Color,
    pub zenith: Color,
    pub horizon: Color,
    pub ground: Color,
    pub exposure: f32,
    #[serde(deserialize_with = "tone_map")]
    pub tone_map: draw::ToneMap,
}

fn tone_map<'de, D: Deserializer<'de>>(deserializer: D) -> Result<draw::ToneMap, D::Error> {
    const NAMES: [&str; draw::ToneMap::ALL.len()] = names(&draw::ToneMap::ALL);
    one_of(&draw::ToneMap::ALL, &NAMES, deserializer)
}

impl Default for Environment {
    fn default() -> Self {
        let e = draw::Environment::default();
        Self {
            ambient: Color::linear(e.ambient),
            zenith: Color::linear(e.zenith),
            horizon: Color::linear(e.horizon),
            ground: Color::linear(e.ground),
            exposure: e.exposure,
            tone_map: e.tone_map,
        }
    }
}

/// Which of the lights in reach shade objects.
#[derive(Deserialize, Debug, Clone, Copy)]
#[serde(default, deny_unknown_fields)]
pub struct Lights {
    #[serde(deserialize_with = "light_policy")]
    policy: LightPolicy,
    pub tolerance: Option<f32>,
}

fn light_policy<'de, D: Deserializer<'de>>(deserializer: D) -> Result<LightPolicy, D::Error> {
    const NAMES: [&str; LightPolicy::ALL.len()] = names(&LightPolicy::ALL);
    one_of(&LightPolicy::ALL, &NAMES, deserializer)
}

impl Default for Lights {
    fn default() -> Self {
        Self { policy: LightPolicy::ENOUGH, tolerance: None }
    }
}

impl Lights {
    /// As the component has it.
    pub fn policy(&self) -> LightPolicy {
        match (self.policy, self.tolerance) {
            (LightPolicy::Enough(_), Some(tolerance)) => LightPolicy::Enough(tolerance),
            (policy, _) => policy,
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
        let clock = systems::ecs::clock::Clock::default();
        Self { step_seconds: clock.step_seconds, speed: clock.speed, paused: clock.paused }
    }
}

/// A convex room: a box by two corners, or the hull of a convex mesh.
#[derive(Deserialize, Debug, Default)]
#[serde(default, deny_unknown_fields)]
pub struct Cell {
    pub r#box: Option<[[f64; 3]; 2]>,
    pub hull: Option<String>,
    pub translation: [f64; 3],
}

/// A convex polygon between two cells, or a cell and outside.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct Portal {
    pub between: [String; 2],
    pub polygon: Vec<[f64; 3]>,
    #[serde(default)]
    pub name: Option<String>,
    #[serde(default = "all_open")]
    pub open: f32,
    #[serde(default)]
    pub door: Option<Door>,
}

fn all_open() -> f32 {
    1.0
}

#[derive(Deserialize, Debug, Default)]
#[serde(default, deny_unknown_fields)]
pub struct Door {
    pub leaf: Option<String>,
    pub swing_degrees: f32,
    pub slide: [f32; 3],
    pub period_seconds: f32,
    pub phase_seconds: f32,
}

/// One entity, or one kind of entity for a generator. `node` counts only within `attach`.
#[derive(Deserialize, Debug, Default)]
#[serde(default, remote = "Self")]
pub struct Entity {
    pub name: Option<String>,
    pub node: Option<String>,
    pub transform: Transform,
    pub mesh: Option<String>,
    pub material: Option<String>,
    pub piece_metres: Option<f32>,
    pub lights: Option<Lights>,
    pub light: Option<Light>,
    pub camera: Option<Camera>,
    pub sensor: Option<Sensor>,
    pub class: Option<String>,
    pub instance: Option<bool>,
    pub spin: Option<Spin>,
    pub vehicle: Option<Vehicle>,
    pub signal_head: Option<SignalHead>,
    pub ground: bool,
    pub obstacle: Option<Obstacle>,
    pub hidden: bool,
    pub casts_shadows: CastsShadows,
    pub figure: Vec<String>,
    pub rig: Option<String>,
    pub attach: Vec<Entity>,
    pub children: Vec<Entity>,
    #[serde(skip)]
    pub custom: Custom,
}

/// As [`Scene`] is read.
impl<'de> Deserialize<'de> for Entity {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (entity, custom) = custom_fields::beside(deserializer, |deserializer| Self::deserialize(deserializer))?;
        Ok(Self { custom, ..entity })
    }
}

/// So unless a scene says otherwise.
#[derive(Deserialize, Clone, Copy, Debug)]
pub struct CastsShadows(pub bool);

impl Default for CastsShadows {
    fn default() -> Self {
        Self(true)
    }
}

#[derive(Deserialize, Debug, Default)]
#[serde(default, deny_unknown_fields)]
pub struct Transform {
    pub translation: Option<[f64; 3]>,
    pub rotation_degrees: Option<[f32; 3]>,
    pub quaternion: Option<[f32; 4]>,
    pub look_at: Option<[f64; 3]>,
    pub scale: Scale,
}

/// What physical vehicles bump into.
#[derive(Deserialize, Clone, Copy, Debug)]
#[serde(rename_all = "snake_case")]
pub enum Obstacle {
    Box,
    Mesh,
}

/// Perspective with `fov_y_degrees`, or orthographic with `orthographic_half_height`; either may have a shape.
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
        let near = draw::Camera::default().near;
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
    pub vehicles: Vec<String>,
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
    Along(Along),
}

#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct Grid {
    pub counts: [u32; 3],
    #[serde(default = "unit_spacing")]
    pub spacing: [f32; 3],
    #[serde(default)]
    pub center: Option<[f64; 3]>,
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
    Box { min: [f64; 3], max: [f64; 3] },
    Disc { center: [f64; 3], radius: f32 },
}
