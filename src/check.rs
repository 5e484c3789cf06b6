//! `relief check`: everything wrong with a file, whatever its kind.

use crate::problem::Problem;
use crate::{import, scene};
use std::path::Path;
use systems::Simulation;

/// Reads a file as what its ending says: a scene (`.ron`), a model (`.gltf`, `.glb`), else an image. `simulation` makes
/// what scenes are loaded into: `Simulation::new`, or a program's own, with its [`scene::SceneFields`].
pub fn check(path: &Path, simulation: fn() -> Simulation) -> Vec<Problem> {
    let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
    match ending.to_str() {
        Some("ron" | "gltf" | "glb") => scene::check(path, simulation),
        _ => import::check_image(path),
    }
}
