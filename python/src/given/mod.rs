//! Values that calls are given: read by their names, or refused with errors that name them. Uses errors.

pub mod arguments;
pub mod described;
pub mod light;
pub mod values;
