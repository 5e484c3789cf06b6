//! glTF models and images of every kind, against facts known from elsewhere; and what is kept of them for later starts.

#[path = "../common/mod.rs"]
mod common;
mod compression;
mod faults;
mod files;
mod images;
mod kept_meshes;
mod meshes;
#[path = "../common/models.rs"]
mod models;
mod nodes;
mod samples;
mod support;
mod textures;
