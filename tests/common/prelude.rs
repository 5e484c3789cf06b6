//! Names that most tests need: `use crate::common::prelude::*;`.

#![allow(unused_imports, reason = "each program uses some")]

pub use super::{Folder, assert_has, asset, cases, only, random, with_gpu};
pub use bevy_ecs::name::Name;
pub use glam::{Affine3A, DVec2, DVec3, EulerRot};
pub use proptest::prelude::RngExt;
pub use proptest::test_runner::TestRng;
pub use relief::prelude::*;
pub use relief::renderer::{
    DebugView, Gpu, Occlusion, OutputSet, PICTURE_FORMAT, Renderer, Settings, SingleView, ViewPlan, picture_texture,
    read_texture,
};
pub use relief::sense::{Capture, SensorSuite};
pub use relief::session::{LoadOptions, Session};
pub use serde_json::{Value, json};
pub use std::collections::BTreeMap;
pub use std::fs;
pub use std::path::{Path, PathBuf};
pub use systems::assets::levels::LevelOfDetail;
pub use systems::assets::{AlphaMode, Image, ImageId, ImageKind, Mesh};
pub use systems::draw::{Intrinsics, View};
pub use systems::lights::SelectedLights;
pub use systems::run::registry::register_all;
pub use systems::sensors::{CameraOutput, CameraSensor, Lens, LidarSensor, Sensor};
pub use systems::space::GlobalTransform;
