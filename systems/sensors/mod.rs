//! Sensors as components, and what their outputs call things: no GPU, no files.
//!
//! A [`Sensor`] is an entity with a place, mounted on a vehicle or standing. What it measures is a function of the
//! states after the steps at which it is due, and of nothing else. [`Class`] and [`Instance`] say what outputs call the
//! things that are seen. A camera's [`Lens`] says where it sees what (`lens`), and its [`Exposure`] and
//! [`ImageNoise`] what it makes of light. A [`LidarSensor`] has the [`Beams`] of a
//! model and fires them by its clock. [`philox`] makes the random numbers of noise, which depend on counters alone.

pub(crate) mod beams;
pub(crate) mod components;
pub(crate) mod exposure;
pub(crate) mod labels;
pub(crate) mod lens;
pub(crate) mod lidar;
pub mod philox;

pub use beams::{Beam, Beams};
pub use components::{CameraOutput, CameraOutputs, CameraSensor, Lens, Sensor, SensorKind};
pub use exposure::{Exposure, ImageNoise, LightMeter};
pub use labels::{Class, ClassInfo, Classes, Instance};
pub use lidar::{Columns, LidarNoise, LidarSensor};
