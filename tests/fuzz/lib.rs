//! Every reader of files as a function of bytes, for damaged files: whatever they hold, a reader ends with a result or
//! one error, within seconds and a bounded memory.
//!
//! ```text
//! lib        the targets by name
//! place      a folder where a file can be read with all that it names
//! models, images, scenes, runs   the targets
//! repair     lengths and checksums made right again, which would hide what lies behind them
//! seeds      sound files to begin with: the project's, its documentation's, those of the test data
//! mutate     a file with some of it changed
//! libfuzzer  the program of scripts/fuzz
//! readers    the tests
//! ```
//!
//! A target panics where something is wrong; what a reader refuses is none of that.

mod images;
mod models;
pub mod mutate;
mod place;
pub mod repair;
mod runs;
mod scenes;
pub mod seeds;

pub use place::Place;

/// A reader of files.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// Name in `scripts/fuzz`.
    pub name: &'static str,
    /// True for text files, false for binary ones.
    pub is_text: bool,
    /// Reads such a file.
    pub read: fn(&Place, &[u8]),
}

/// All of them.
pub const TARGETS: [Target; 17] = [
    text("gltf", models::gltf),
    binary("glb", models::glb),
    binary("png", images::png),
    binary("jpeg", |place, bytes| images::read(place, "jpg", bytes)),
    binary("tga", |place, bytes| images::read(place, "tga", bytes)),
    binary("bmp", |place, bytes| images::read(place, "bmp", bytes)),
    binary("webp", |place, bytes| images::read(place, "webp", bytes)),
    binary("dds", |place, bytes| images::read(place, "dds", bytes)),
    binary("exr", |place, bytes| images::read(place, "exr", bytes)),
    binary("picture", images::compared),
    text("scene", scenes::scene),
    text("vehicles", scenes::vehicle_types),
    text("drawn", scenes::drawn),
    binary("recording", runs::recording),
    binary("replay", runs::replay),
    binary("snapshot", runs::snapshot),
    binary("state", runs::state),
];

const fn text(name: &'static str, read: fn(&Place, &[u8])) -> Target {
    Target { name, is_text: true, read }
}

const fn binary(name: &'static str, read: fn(&Place, &[u8])) -> Target {
    Target { name, is_text: false, read }
}

/// The target of a name.
pub fn target(name: &str) -> Option<Target> {
    TARGETS.into_iter().find(|target| target.name == name)
}
