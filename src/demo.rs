//! Where the demo scene is.

use std::path::{Path, PathBuf};

const SCENE: &str = "assets/scenes/town.ron";

/// The demo scene: below the working directory, beside the binary or above it, or where the project was built.
pub fn scene_path() -> PathBuf {
    let here = PathBuf::from(SCENE);
    let beside = std::env::current_exe().ok();
    let above = beside.iter().flat_map(|exe| exe.ancestors().skip(1)).map(|folder| folder.join(SCENE));
    let built = Path::new(env!("CARGO_MANIFEST_DIR")).join(SCENE);
    std::iter::once(here.clone()).chain(above).chain([built]).find(|path| path.exists()).unwrap_or(here)
}
