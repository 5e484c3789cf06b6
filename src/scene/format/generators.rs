//! Generators: many copies of one kind of entity, and where these are.

use super::entities::Entity;
use super::roads::Along;
use super::values::SMALLEST;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use systems::describe::{Described, Fault, Trail};
use systems::lights::LightDescription;
use systems::space::{FARTHEST, LARGEST};

/// Entities of a scene.
pub const MOST_ENTITIES: u32 = 4_000_000;

/// Many copies of one entity.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(deny_unknown_fields)]
pub struct Generator {
    /// Places of the copies.
    pub place: Place,
    /// Name, which copies have with their number; by default `generator` and its number.
    #[serde(default)]
    pub name: Option<String>,
    /// Entity that is copied, with its children; its transform applies within each copy.
    #[serde(default)]
    #[schemars(extend("see" = "[entity](#entity)"))]
    pub entity: Entity,
    /// Names of meshes: alternatives to the entity's mesh.
    #[serde(default)]
    pub meshes: Vec<String>,
    /// Names of materials: alternatives to the entity's material.
    #[serde(default)]
    pub materials: Vec<String>,
    /// Lights: alternatives to the entity's light.
    #[serde(default)]
    #[schemars(extend("see" = "list of [lights](#lights)"))]
    pub lights: Vec<LightDescription>,
    /// Vehicle types of copies: alternatives to the entity's `vehicle`, which says only what differs otherwise.
    #[serde(default)]
    pub vehicles: Vec<String>,
    /// Choice of alternatives; in turn, materials go on when all meshes have had one, so that every pair comes up.
    #[serde(default)]
    pub choose: Choose,
    /// Turns each copy about Y at random.
    #[serde(default)]
    pub random_yaw: bool,
    /// Least and most scale of copies.
    #[serde(default)]
    pub random_scale: RandomScale,
    /// Seed; by default from the scene's.
    #[serde(default)]
    pub seed: Option<u64>,
}

impl Described for Generator {}

/// Least and most scale of copies.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug)]
pub struct RandomScale(#[schemars(inner(range(min = SMALLEST, max = LARGEST)))] pub [f32; 2]);

impl Default for RandomScale {
    fn default() -> Self {
        Self([1.0; 2])
    }
}

impl Described for RandomScale {
    fn check_whole(&self) -> Vec<Fault> {
        let Self([least, most]) = self;
        let message = || format!("expected (least, most), found ({least}, {most}); write ({most}, {least})");
        (least > most).then(|| Trail::default().fault(message())).into_iter().collect()
    }
}

/// Choice of alternatives.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, Default, PartialEq)]
#[serde(rename_all = "snake_case")]
pub enum Choose {
    /// In the order of their lists.
    #[default]
    InTurn,
    /// At random.
    Random,
}

/// Places of copies.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(rename_all = "snake_case")]
pub enum Place {
    /// In rows.
    Grid(Grid),
    /// At random.
    Scatter(Scatter),
    /// Along routes.
    Along(Along),
}

impl Described for Place {}

/// Places in rows along the axes.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(deny_unknown_fields)]
pub struct Grid {
    /// Copies along each axis, at least 1; in order along x, then z, then y.
    pub counts: [u32; 3],
    /// Distances from one to the next.
    #[serde(default = "unit_spacing")]
    #[schemars(inner(range(min = -FARTHEST, max = FARTHEST)), extend("unit" = "m"))]
    pub spacing: [f32; 3],
    /// Middle of the whole grid; by default the scene's `origin`.
    #[serde(default)]
    #[schemars(inner(range(min = -FARTHEST, max = FARTHEST)), extend("unit" = "m"))]
    pub center: Option<[f64; 3]>,
    /// Greatest random move of each copy, in both directions.
    #[serde(default)]
    #[schemars(inner(range(min = 0.0, max = FARTHEST)), extend("unit" = "m"))]
    pub jitter: [f32; 3],
}

impl Described for Grid {}

fn unit_spacing() -> [f32; 3] {
    [1.0; 3]
}

/// Places at random in a region.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(deny_unknown_fields)]
pub struct Scatter {
    /// Region of the copies: `box(min: (x, y, z), max: (x, y, z))`, or `disc(center: (x, y, z), radius: metres)`.
    pub region: Region,
    /// Number of copies.
    #[schemars(range(min = 1, max = MOST_ENTITIES))]
    pub count: u32,
    /// Least distance between any two copies; where there is no more room, there are fewer, and a warning.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = FARTHEST), extend("unit" = "m"))]
    pub min_distance: f32,
}

impl Described for Scatter {}

/// A part of space.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Region {
    /// A box by two corners.
    Box {
        /// Corner of the least coordinates.
        #[schemars(inner(range(min = -FARTHEST, max = FARTHEST)), extend("unit" = "m"))]
        min: [f64; 3],
        /// Corner of the largest coordinates.
        #[schemars(inner(range(min = -FARTHEST, max = FARTHEST)), extend("unit" = "m"))]
        max: [f64; 3],
    },
    /// A disc, flat in XZ.
    Disc {
        /// Middle.
        #[schemars(inner(range(min = -FARTHEST, max = FARTHEST)), extend("unit" = "m"))]
        center: [f64; 3],
        /// Radius.
        #[schemars(range(min = SMALLEST, max = FARTHEST), extend("unit" = "m"))]
        radius: f32,
    },
}
