//! Generators: many copies of one kind of entity, and where these are.

use super::entities::Entity;
use super::roads::Along;
use serde::Deserialize;
use systems::lights::LightDescription;

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
    pub lights: Vec<LightDescription>,
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
