//! Forms of files: what becomes of single captures (files, of records), and of a run as a whole (log, coco, kitti,
//! nuscenes, films). Uses pictures.
//!
//! ```text
//! format        a form: what it holds, and how its files are made; of a program, too
//! files         PNG, numpy's and OpenEXR; box_records, records: what is in them of boxes, and of sensors other than
//!               cameras
//! log           a log of ROS 2 (log_boxes); coco, kitti, nuscenes: labels as these data sets have them; films
//! parts         JSON files of a run, put together of those of its parts
//! run_folder    what one of these writes into the folder of a run
//! writers       the list of all of these; those of a run, begun
//! ```

pub(crate) mod box_records;
pub(crate) mod coco;
pub(crate) mod files;
pub(crate) mod films;
pub(crate) mod format;
mod kitti;
pub(crate) mod log;
mod log_boxes;
mod nuscenes;
pub(crate) mod parts;
mod records;
mod run_folder;
pub(crate) mod writers;
