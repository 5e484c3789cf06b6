//! Sensors as components, and what their outputs call things: no GPU, no files.
//!
//! A [`Sensor`] is an entity with a place, mounted on a vehicle or standing. What it measures is a function of the
//! states after the steps at which it is due, and of nothing else. [`Class`] and [`Instance`] say what outputs call the
//! things that are seen. A camera's [`Lens`] says where it sees what (`lens`), and its [`Exposure`] and [`ImageNoise`]
//! what it makes of light. A [`LidarSensor`] has the [`Beams`] of a model and fires them by its clock. An [`ImuSensor`]
//! and a [`GnssSensor`] measure how they move and where on Earth they are ([`wgs84`](crate::space::wgs84)), a [`BarometerSensor`] the
//! pressure there. A [`LaneSensor`] and a [`CollisionSensor`] measure what is below and beside a vehicle. [`philox`]
//! makes the random numbers of noise, which depend on counters alone.

pub(crate) mod barometer;
pub(crate) mod beams;
pub mod collision;
pub(crate) mod components;
pub(crate) mod exposure;
pub(crate) mod gnss;
pub(crate) mod imu;
pub(crate) mod labels;
pub(crate) mod lane;
pub(crate) mod lens;
mod lens_text;
pub(crate) mod lidar;
pub mod philox;

pub use barometer::{BarometerNoise, BarometerSensor};
pub use beams::{Beam, Beams};
pub use collision::CollisionSensor;
pub use components::{CameraOutput, CameraOutputs, CameraSensor, Lens, Rate, Sensor, SensorKind};
pub use exposure::{Exposure, ImageNoise, LightMeter};
pub use gnss::{GnssNoise, GnssReading, GnssSensor};
pub use imu::{ImuNoise, ImuReading, ImuSensor};
pub use labels::{Class, ClassInfo, Classes, Instance};
pub use lane::{LaneReading, LaneSensor};
pub use lidar::{Columns, LidarNoise, LidarSensor};
