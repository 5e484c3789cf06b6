//! Names that most programs need: `use relief::prelude::*;`.

pub use crate::frames::Headless;
pub use crate::import::load_model;
#[cfg(feature = "vehicles")]
pub use crate::scene::load_vehicle_types;
pub use crate::scene::{EntityField, SceneField, SceneFields};
pub use crate::viewpoint::Viewpoint;
pub use bevy_ecs::prelude::*;
pub use glam::{Quat, UVec2, Vec2, Vec3, Vec4};
pub use systems::Simulation;
pub use systems::assets::{Library, Map, Material, MaterialId, MeshId, Shading, Technique, shapes};
pub use systems::draw::pieces::draw_in_pieces;
pub use systems::draw::{Camera, Environment, Projection, ToneMap};
pub use systems::ecs::clock::Clock;
pub use systems::lights::{Light, LightKind, LightPolicies, LightPolicy};
pub use systems::run::inputs::{Input, Inputs};
pub use systems::run::registry::{EntityRegistry, StateId};
pub use systems::run::state::StateList;
pub use systems::space::{Hidden, Spin, Transform};
#[cfg(feature = "vehicles")]
pub use systems::vehicles::{Controls, Vehicle, VehicleTypes};
