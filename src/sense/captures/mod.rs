//! Captures: arrays and readings that sensors measured, the axes and poses that these have, and the labels of entities.
//! Uses `systems`, and `export` for the forms of values.

pub(crate) mod axes;
pub(crate) mod boxes;
pub(crate) mod camera;
pub(crate) mod capture;
pub(crate) mod flow;
pub(crate) mod label_table;
pub(crate) mod lidar;
pub(crate) mod pose;
pub(crate) mod reading;
