//! Sensors of a world, captured: what every sensor that is due after a step measures, as arrays.
//!
//! ```text
//! suite          what it takes to capture the sensors of a world: what they are (world_sensors) and what draws them
//!                (drawing), for several worlds together, too; capture: what they measured
//! camera         what a camera gives, made of the pixels that its view drew; of a lens that bends, of faces (lens_map)
//!                whose pixels are re-sampled (resample) and developed on the CPU
//! lidar          the beams of a lidar through what is drawn, into arrays
//! rays           what the last frame draws, as rays meet it: a tree over the boxes of objects, and one for each mesh
//!                (ray_meshes); with colours and masks (texels)
//! motion         IMU and GNSS, and where sensors were before
//! lanes          in which lane a vehicle is; collisions: what touches it
//! label_table    entities to the numbers and classes that outputs have for them
//! tracking       what boxes and flow need beside pictures: drawn_parts, where everything is; things, what has boxes
//! boxes          boxes of things in a picture, by outline and outer_vertices
//! flow           where what a pixel shows is in the picture of another time
//! dataset        the sensors of a run as files: `relief render --sensors`
//! files          which files outputs become, and what is in them (box_records); description, manifest: those of a
//!                whole data set
//! run_writer     what is written of a run as a whole: log, one of ROS 2 (log_boxes); coco, kitti, labels as these
//!                data sets have them; films. axes: those that these and other outputs have
//! merge          the data sets of the parts of a run, put together
//! records        what sensors other than cameras give, as files
//! pictures       values of outputs as colours (colors), for those who look at them
//! ```
//!
//! A capture is a function of the state after a step, and of nothing else: all sensors are captured of one frame, and a
//! view's bits do not depend on what is drawn beside it ([`crate::renderer::ViewBatches`]). Lidars that sweep, IMUs and
//! GNSS also need where they were when they were due before.
//!
//! What sensors are as data is in [`systems::sensors`].
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

mod axes;
mod box_records;
mod boxes;
mod camera;
mod capture;
mod coco;
#[cfg(feature = "vehicles")]
mod collisions;
mod colors;
mod dataset;
mod description;
mod develop;
mod drawing;
mod drawn_parts;
mod files;
mod films;
mod flow;
mod kitti;
mod label_table;
#[cfg(feature = "vehicles")]
mod lanes;
mod lens_map;
pub mod lidar;
mod log;
mod log_boxes;
mod manifest;
mod merge;
mod motion;
#[cfg(not(feature = "vehicles"))]
mod no_vehicles;
mod numbers;
mod outer_vertices;
mod outline;
pub mod pictures;
mod pixels;
mod ray_meshes;
mod ray_objects;
mod rays;
mod records;
mod resample;
mod run_writer;
mod suite;
mod texels;
mod things;
mod tracking;
mod world_sensors;

pub use box_records::encode as boxes_as_npy;
pub use boxes::{Motion, ObjectBox};
pub use camera::CameraCapture;
pub use capture::{Capture, LidarCapture, SensorCapture, SensorData};
pub(crate) use dataset::steps_before;
pub use dataset::{PartOfRun, SensorJob, render_sensors};
pub use drawing::{Captured, Drawing, Wanted};
pub use files::FileFormat;
pub use flow::{Flow, flags};
pub use label_table::entity_of_number;
pub use lidar::{LidarScan, Pose};
pub(crate) use merge::{PartFiles, is_of_run, merge};
pub use motion::{GnssCapture, ImuCapture};
pub use rays::{Meeting, RayScene, RayWarnings};
pub use suite::SensorSuite;
pub use world_sensors::{WorldSensors, sensor_name, sensor_name_on, sensor_names};
