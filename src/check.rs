//! `relief check`: everything wrong with a file, whatever its kind.

use crate::problem::Problem;
use crate::{import, scene};
use std::path::Path;

/// Reads a file as what its ending says: a scene (`.ron`), a model (`.gltf`, `.glb`), else an image.
pub fn check(path: &Path) -> Vec<Problem> {
    let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
    match ending.to_str() {
        Some("ron" | "gltf" | "glb") => scene::check(path),
        _ => import::check_image(path),
    }
}
