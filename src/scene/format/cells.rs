//! Rooms and the portals between them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use systems::describe::Described;
use systems::space::FARTHEST;

/// Name of the outside, where a portal leads to no cell.
pub const OUTSIDE_NAME: &str = "outside";

/// A convex room: a box by two corners, or the hull of a convex mesh.
#[derive(Serialize, Deserialize, JsonSchema, Debug, Default)]
#[serde(default, deny_unknown_fields)]
pub struct Cell {
    /// Corners of a box: those of the least and the largest coordinates.
    #[schemars(inner(inner(range(min = -FARTHEST, max = FARTHEST))), extend("unit" = "m"))]
    pub r#box: Option<[[f64; 3]; 2]>,
    /// Name of a convex mesh, of which the walls are the planes; instead of a box.
    pub hull: Option<String>,
    /// Place of the mesh's origin.
    #[schemars(inner(range(min = -FARTHEST, max = FARTHEST)), extend("unit" = "m"))]
    pub translation: [f64; 3],
}

impl Described for Cell {}

/// A convex polygon between two cells, or a cell and outside.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(deny_unknown_fields)]
pub struct Portal {
    /// Names of the two cells; one of them may be `outside`.
    pub between: [String; 2],
    /// Corners in their order around it.
    #[schemars(length(min = 3, max = 64), inner(inner(range(min = -FARTHEST, max = FARTHEST))))]
    #[schemars(extend("unit" = "m", "of" = "corners"))]
    pub polygon: Vec<[f64; 3]>,
    /// Name in lists; by default those of the two cells.
    #[serde(default)]
    pub name: Option<String>,
    /// Openness: 0 shut, 1 open; from a half on all the light comes through.
    #[serde(default = "all_open")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub open: f32,
    /// Leaf and motion of a door.
    #[serde(default)]
    #[schemars(extend("see" = "[door](#door)"))]
    pub door: Option<Door>,
}

impl Described for Portal {}

impl Described for Door {}

fn all_open() -> f32 {
    1.0
}

/// Motion of a portal, and of the leaf in it.
#[derive(Serialize, Deserialize, JsonSchema, Debug, Default)]
#[serde(default, deny_unknown_fields)]
pub struct Door {
    /// Name of an entity that moves with it: its place in the file is that of the shut door.
    pub leaf: Option<String>,
    /// Turn of the leaf about its +Y when open.
    #[schemars(range(min = -180.0, max = 180.0), extend("unit" = "°"))]
    pub swing_degrees: f32,
    /// Way of the leaf when open.
    #[schemars(inner(range(min = -1000.0, max = 1000.0)), extend("unit" = "m"))]
    pub slide: [f32; 3],
    /// Time from opening to opening; 0: it does not move by itself.
    #[schemars(range(min = 0.0, max = 1e6), extend("unit" = "s"))]
    pub period_seconds: f32,
    /// Time that it is ahead of the clock.
    #[schemars(range(min = -1e6, max = 1e6), extend("unit" = "s"))]
    pub phase_seconds: f32,
}
