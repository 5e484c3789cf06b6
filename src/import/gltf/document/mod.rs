//! JSON that fits the schema, as types, with bounds-checked access to its data. Uses `report` and `files`.

pub mod accessors;
pub mod data;
mod schema;
pub mod shape;
pub mod typed;
