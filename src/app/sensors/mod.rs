//! Sensors that are looked at, without a word of how they are shown.
//!
//! ```text
//! choice     what is shown of a sensor
//! dots       points of a lidar over the scene
//! captures   the last captures of these, and their pictures
//! views      what is looked at, and how
//! values     what is under the pointer
//! ```

pub mod captures;
pub mod choice;
pub mod dots;
pub mod values;
pub mod views;
