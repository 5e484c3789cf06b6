//! Rooms and the portals between them.

use serde::Deserialize;

/// Name of the outside, where a portal leads to no cell.
pub const OUTSIDE_NAME: &str = "outside";

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
