//! Sensors of a world, captured: what every sensor that is due after a step measures, as arrays.
//!
//! ```text
//! world      the sensors of a world: names, which are due, what they measure of what is drawn (drawing), together
//!            (suite), and of several worlds, too
//! tracking   boxes of things in a picture, and where what a pixel shows is in the picture of another time
//! camera     what a camera's views draw, and what its arrays become of that; lenses that bend
//! motion     sensors without pictures, a kind a file, those of programs, too; where sensors were before
//! rays       what the last frame draws, as rays meet it, and the beams of lidars through that
//! captures   what sensors measured, in the axes, and with the labels, that outputs have
//! ```
//!
//! Each of these uses those below it. Nothing here knows of files, or of a window: `data` writes captures, and paints
//! them.
//!
//! A capture is a function of the state after a step, and of nothing else: all sensors are captured of one frame, and a
//! view's bits do not depend on what is drawn beside it ([`crate::renderer::ViewBatches`]). Lidars that sweep, IMUs and
//! GNSS also need where they were when they were due before.
//!
//! Sensors as data are in [`systems::sensors`].
//!
//! ```no_run
//! use relief::prelude::*;
//! use relief::sense::SensorSuite;
//! let mut stage = relief::frames::load_session("assets/scenes/street.ron".as_ref(), None, &Default::default())?;
//! let mut sensors = SensorSuite::new(&relief::renderer::Gpu::headless()?);
//! stage.simulation.step();
//! let capture = sensors.capture(&mut stage.simulation)?;
//! for sensor in &capture.sensors {
//!     println!("{} at {} ns", sensor.name, capture.nanoseconds);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub(crate) mod camera;
pub(crate) mod captures;
pub(crate) mod motion;
pub(crate) mod rays;
pub(crate) mod tracking;
pub(crate) mod world;

pub use captures::boxes::{Motion, ObjectBox};
pub use captures::camera::CameraCapture;
pub use captures::capture::{Capture, FirstColumn, SensorCapture, SensorData};
pub use captures::flow::{Flow, flags};
pub use captures::label_table::entity_of_number;
pub use captures::lidar::{LidarCapture, LidarScan};
pub use captures::pose::Pose;
pub use captures::reading::{OwnedColumn, Reading, Record};
pub use motion::*;
pub use rays::lidar;
pub use rays::objects::Meeting;
pub use rays::scene::{RayScene, RayWarnings};
pub use world::drawing::{Captured, Drawing, Wanted};
pub use world::names::{sensor_name, sensor_name_on, sensor_names};
pub use world::packed::PackPlan;
pub use world::sensors::WorldSensors;
pub use world::suite::SensorSuite;
