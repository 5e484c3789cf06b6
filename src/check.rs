//! `relief check`: everything wrong with a file, whatever its kind.

use crate::import::{self, Severity};
use crate::scene;
use std::fmt;
use std::path::Path;

/// One thing wrong with a file; its text names file, place and what was expected.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    severity: Severity,
    text: String,
}

impl Problem {
    /// Whether the file is refused for it.
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// Reads a file as what its ending says: a scene (`.ron`), a model (`.gltf`, `.glb`), else an image.
pub fn check(path: &Path) -> Vec<Problem> {
    let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
    match ending.to_str() {
        Some("ron") => texts(scene::check(path), |p| p.severity),
        Some("gltf" | "glb") => texts(import::check_model(path), |p| p.severity),
        _ => texts(import::check_image(path), |p| p.severity),
    }
}

fn texts<P: fmt::Display>(problems: Vec<P>, severity: impl Fn(&P) -> Severity) -> Vec<Problem> {
    problems.iter().map(|p| Problem { severity: severity(p), text: p.to_string() }).collect()
}
