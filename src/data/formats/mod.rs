//! Forms of files: what becomes of single captures (files, of records), and of a run as a whole (run_writer), begun by
//! its formats (writers). Uses pictures.
//!
//! ```text
//! format        forms, and what they hold
//! files         which files outputs become, and what is in them; box_records, records: those of boxes, and of sensors
//!               other than cameras
//! run_writer    what takes the captures of a run in their order: log, one of ROS 2 (log_boxes); coco, kitti, labels as
//!               these data sets have them; films
//! ```

pub(crate) mod box_records;
pub(crate) mod coco;
pub(crate) mod files;
pub(crate) mod films;
pub(crate) mod format;
mod kitti;
pub(crate) mod log;
mod log_boxes;
mod records;
pub(crate) mod run_writer;
pub(crate) mod writers;
