//! Sensors of a world, captured: what every sensor that is due after a step measures, as arrays.
//!
//! ```text
//! suite          the sensors of a world by name, and what it takes to capture them
//! camera         what a camera gives, made of what its view drew
//! label_table    entities to the numbers and classes that outputs have for them
//! ```
//!
//! A capture is a function of the state after a step, and of nothing else: all sensors are captured of one frame, and a
//! view's bits do not depend on what is drawn beside it ([`crate::renderer::ViewBatches`]).
//!
//! ```no_run
//! use relief::prelude::*;
//! use relief::sensors::SensorSuite;
//! let mut stage = relief::frames::load_stage("assets/scenes/street.ron".as_ref(), None, &Default::default())?;
//! let mut sensors = SensorSuite::new(&relief::renderer::Gpu::headless()?);
//! stage.simulation.step();
//! let capture = sensors.capture(&mut stage.simulation)?;
//! for sensor in &capture.sensors {
//!     println!("{} at {} ns", sensor.name, capture.nanoseconds);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod camera;
mod label_table;
mod suite;

pub use camera::CameraCapture;
pub use label_table::{LabelTable, Labels};
pub use suite::{Capture, SensorCapture, SensorData, SensorSuite, sensor_names};
