//! Sensors: cameras whose lenses bend and whose pictures are noisy, lidar, sensors of motion, and the files of all.

mod calibration;
mod camera_noise;
#[path = "../common/mod.rs"]
mod common;
mod export;
mod lenses;
mod lidar;
mod motion_sensors;
mod sensor_files;
mod sensor_formats;
mod sensor_levels;
mod sensor_log;
