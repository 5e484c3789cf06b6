//! Sensors as data: what a simulated sensor is, without what draws or traces for it.
//!
//! [`LidarSensor`] is a lidar, with the [`Beams`] of a model and how they fire. [`philox`] makes the random numbers of
//! noise, which depend on counters alone.

pub(crate) mod beams;
pub(crate) mod lidar;
pub mod philox;

pub use beams::{Beam, Beams};
pub use lidar::{Columns, LidarNoise, LidarSensor};
