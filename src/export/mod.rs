//! Outputs of sensors as files in the forms of their fields: the counterpart of [`crate::import`]. Encoders know arrays
//! and plain structs alone, neither entities nor the GPU. The same input gives the same bytes.
//!
//! ```text
//! array      values of one type and a shape; columns, and the records they make together
//! npy, npz   numpy's arrays, one a file or many
//! exr        named channels of half floats, floats and integers
//! cdr        how ROS 2 puts a message into bytes      ros    its messages, and their definitions as text
//! mcap       a log of messages, written as a run goes on; no_mcap: in builds without the feature
//! picture    values of pixels as pictures
//! kitti, semantic_kitti, coco, middlebury    labels, in the files of these data sets
//! ```
//!
//! Errors of encoding are an [`std::io::Error`] whose text says what was expected, so that these functions are called
//! within [`crate::output::write_whole_with`], which adds the file's name.

pub mod array;
pub mod cdr;
mod checks;
pub mod coco;
pub mod exr;
pub mod kitti;
#[cfg_attr(not(feature = "mcap"), path = "no_mcap.rs")]
pub mod mcap;
pub mod middlebury;
pub mod npy;
pub mod npz;
pub mod picture;
pub mod ros;
pub mod semantic_kitti;
