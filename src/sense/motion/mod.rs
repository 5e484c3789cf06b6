//! Sensors without pictures: what a kind is, those of the library and of programs; and where sensors were when they
//! were due before. Uses captures.

mod barometer;
#[cfg(feature = "vehicles")]
mod bodies;
#[cfg(feature = "vehicles")]
mod collisions;
pub(crate) mod custom;
mod gnss;
mod imu;
pub(crate) mod kind;
#[cfg(feature = "vehicles")]
mod lanes;
#[cfg(all(feature = "vehicles", not(feature = "physics")))]
mod no_physics;
#[cfg(not(feature = "vehicles"))]
mod no_vehicles;
#[cfg(feature = "physics")]
mod obstacles;
pub(crate) mod place;
pub(crate) mod track;

pub use barometer::BarometerCapture;
pub use custom::{CustomSensor, add_sensor_kind};
pub use gnss::GnssCapture;
pub use imu::ImuCapture;
pub use kind::{Measuring, ReadingSensor, kind_name, poses_needed, record_schemas};
