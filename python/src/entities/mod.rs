//! Entities of a world: the base class first, then those of its kinds, then what is mounted. Uses worlds, lenses of
//! captures, and what calls are given.

pub mod classes;
pub mod entity;
pub mod light;
mod mounted;
pub mod mounting;
mod own;
pub mod portal;
pub mod sensor;
pub mod vehicle;
