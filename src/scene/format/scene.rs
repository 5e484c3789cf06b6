//! A whole scene, its environment and its clock.

use super::cells::{Cell, Portal};
use super::custom::{self, Custom};
use super::earth::GeoOrigin;
use super::entities::Entity;
use super::generators::Generator;
use super::lights::Lights;
use super::rigs::Rigs;
use super::roads::{Route, Signal, Traffic};
use super::sensors::Class;
use super::surfaces::{Material, MeshSource};
use super::values::{Named, Origin, PieceMetres};
use super::weather::GivenWeather;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use systems::assets::color_text::Color;
use systems::describe::Described;
use systems::{draw, ecs};

/// A whole scene.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(default, remote = "Self")]
#[schemars(deny_unknown_fields)]
pub struct Scene {
    /// Seed of generators without one of their own, and of the simulation's random numbers.
    pub seed: u64,
    /// Point that the world's places count from; chosen where coordinates are [large](#far-from-zero).
    pub origin: Option<Origin>,
    /// Place of the scene on Earth, for GNSS.
    #[schemars(extend("see" = "[geo origin](sensors.md#geo-origin)"))]
    pub geo_origin: Option<GeoOrigin>,
    /// Length beyond which objects are drawn in [pieces](#large-objects) of at most this; 0: never.
    pub piece_metres: PieceMetres,
    /// Choice of the lights in reach that shade objects; by default `enough`.
    #[schemars(extend("see" = "[`(policy, tolerance)`](#lights)"))]
    pub lights: Option<Lights>,
    /// Light from all sides, and the sky.
    #[schemars(extend("see" = "[environment](#environment)"))]
    pub environment: Environment,
    /// Sky, sun and moon: the name of a [preset](weather.md#presets), or its fields; by default the gradient of the
    /// environment.
    pub weather: Option<GivenWeather>,
    /// Steps of the simulation.
    #[schemars(extend("see" = "[clock](#clock)"))]
    pub clock: Clock,
    /// Paths of files of [vehicle types](vehicles.md#files-of-types).
    #[schemars(extend("see" = "list of paths"))]
    pub vehicle_types: Vec<String>,
    /// Appearance of surfaces, by name.
    #[schemars(extend("see" = "named [materials](#material)"))]
    pub materials: Named<Material>,
    /// Shapes, by name.
    #[schemars(extend("see" = "named [meshes](#meshes)"))]
    pub meshes: Named<MeshSource>,
    /// Traffic lights, by name.
    #[schemars(extend("see" = "named [signals](#signal)"))]
    pub signals: Named<Signal>,
    /// Roads on which vehicles drive, by name.
    #[schemars(extend("see" = "named [routes](#route)"))]
    pub routes: Named<Route>,
    /// Rules of the road.
    #[schemars(extend("see" = "[traffic](#traffic)"))]
    pub traffic: Traffic,
    /// Rooms whose walls keep light out, by name: see [portals.md](portals.md).
    #[schemars(extend("see" = "named [cells](#cell)"))]
    pub cells: Named<Cell>,
    /// Doors and windows between cells.
    #[schemars(extend("see" = "list of [portals](#portal)"))]
    pub portals: Vec<Portal>,
    /// Semantic classes that sensors see, by name; none: those of Cityscapes.
    #[schemars(extend("see" = "named [classes](sensors.md#class)"))]
    pub classes: Named<Class>,
    /// Things of the scene.
    #[schemars(extend("see" = "list of [entities](#entity)"))]
    pub entities: Vec<Entity>,
    /// Copies of things.
    #[schemars(extend("see" = "list of [generators](#generator)"))]
    pub generators: Vec<Generator>,
    /// Once they have been read.
    #[serde(skip)]
    pub rigs: Rigs,
    #[serde(skip)]
    pub custom: Custom,
}

impl Described for Scene {}

/// By what serde derives, which is a function of that name.
impl Serialize for Scene {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Self::serialize(self, serializer)
    }
}

/// By what serde derives, which is a function of that name, but for the fields that a program has added.
impl<'de> Deserialize<'de> for Scene {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (scene, custom) = custom::beside(deserializer, |deserializer| Self::deserialize(deserializer))?;
        Ok(Self { custom, ..scene })
    }
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            seed: 0,
            origin: None,
            geo_origin: None,
            piece_metres: PieceMetres(draw::pieces::DEFAULT_METRES),
            lights: None,
            environment: Environment::default(),
            weather: None,
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

/// Light from all sides, the sky, and how pictures are made of light.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Environment {
    /// Light that every surface receives from all sides.
    pub ambient: Color,
    /// Sky straight up.
    pub zenith: Color,
    /// Sky at the horizon.
    pub horizon: Color,
    /// Sky below the horizon.
    pub ground: Color,
    /// Factor of linear colours before the tone map.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub exposure: f32,
    /// By day, exposure follows the sky of an [atmosphere](weather.md): white shows `exposure` in the mean of level
    /// ground and a wall that faces the sun, instead of more. By night it stays as it is.
    pub auto_exposure: bool,
    /// Curve from linear colours to those of a picture.
    pub tone_map: draw::ToneMap,
    /// Illuminance of a surface that a light of intensity 1 lights from 1 m: what sky, sun and moon are measured by.
    #[schemars(range(min = 0.001, max = 1e6), extend("unit" = "lx"))]
    pub lux: f32,
}

impl Described for Environment {}

impl Default for Environment {
    fn default() -> Self {
        let e = draw::Environment::default();
        Self {
            ambient: Color::linear(e.ambient),
            zenith: Color::linear(e.zenith),
            horizon: Color::linear(e.horizon),
            ground: Color::linear(e.ground),
            exposure: e.exposure,
            auto_exposure: e.auto_exposure,
            tone_map: e.tone_map,
            lux: e.lux,
        }
    }
}

/// Fixed steps of the simulation, and how fast a window shows them.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Clock {
    /// Length of a step.
    #[schemars(range(min = 1e-6, max = 1000.0), extend("unit" = "s"))]
    pub step_seconds: f64,
    /// Simulated seconds in a second of a window.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub speed: f64,
    /// Stands still until it is told to go on.
    pub paused: bool,
}

impl Described for Clock {}

impl Default for Clock {
    fn default() -> Self {
        let clock = ecs::clock::Clock::default();
        Self { step_seconds: clock.step_seconds, speed: clock.speed, paused: clock.paused }
    }
}

/// An environment as a resource.
pub fn environment(e: &Environment) -> draw::Environment {
    draw::Environment {
        ambient: e.ambient.rgb(),
        zenith: e.zenith.rgb(),
        horizon: e.horizon.rgb(),
        ground: e.ground.rgb(),
        exposure: e.exposure,
        auto_exposure: e.auto_exposure,
        tone_map: e.tone_map,
        lux: e.lux,
    }
}

/// A clock as a resource.
pub fn clock(c: &Clock) -> ecs::clock::Clock {
    let mut clock = ecs::clock::Clock::default();
    (clock.step_seconds, clock.speed, clock.paused) = (c.step_seconds, c.speed, c.paused);
    clock
}
