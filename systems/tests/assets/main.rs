//! What is drawn: meshes as they are made, cut and simplified, and a library that changes.

mod displace;
mod levels;
mod library;
mod split;
mod tangents;
