//! Motion sensors: IMU and GNSS, lanes and collisions; and where sensors were when they were due before. Uses captures.

#[cfg(feature = "vehicles")]
mod bodies;
#[cfg(feature = "vehicles")]
pub(crate) mod collisions;
#[cfg(feature = "vehicles")]
pub(crate) mod lanes;
#[cfg(all(feature = "vehicles", not(feature = "physics")))]
mod no_physics;
#[cfg(not(feature = "vehicles"))]
pub(crate) mod no_vehicles;
#[cfg(feature = "physics")]
mod obstacles;
pub(crate) mod place;
pub(crate) mod readings;
pub(crate) mod track;
