//! Assets: creation, cutting and simplification of meshes, and a library that changes.

mod displace;
mod levels;
mod library;
mod split;
mod tangents;
