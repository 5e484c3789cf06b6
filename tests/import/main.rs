//! glTF models and images of every kind, against facts known from elsewhere.

#[path = "../common/mod.rs"]
mod common;
mod faults;
mod files;
mod images;
mod meshes;
mod nodes;
mod samples;
mod support;
mod textures;
