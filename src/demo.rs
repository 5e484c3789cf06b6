//! Paths of the scenes and textures that come with the program.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

const DEMO: &str = "assets/scenes/town.ron";
const TECHNIQUES: &str = "assets/scenes/techniques.ron";

/// The folder of an installed package: [`install_folder`].
static PACKAGE: OnceLock<PathBuf> = OnceLock::new();

/// The demo scene.
pub fn scene_path() -> PathBuf {
    shipped(DEMO)
}

/// The scene of all bump techniques.
pub fn techniques_path() -> PathBuf {
    shipped(TECHNIQUES)
}

/// Has [`shipped`] look into the folder of an installed package, outside of which its program lies. The first counts.
pub fn install_folder(folder: PathBuf) {
    _ = PACKAGE.set(folder);
}

/// A file that comes with the program: below the working directory, in the installed package, beside the binary or
/// above it, or where the project was built.
pub fn shipped(file: &str) -> PathBuf {
    let here = PathBuf::from(file);
    let beside = std::env::current_exe().ok();
    let above = beside.iter().flat_map(|exe| exe.ancestors().skip(1)).map(|folder| folder.join(file));
    let built = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    let installed = PACKAGE.get().map(|folder| folder.join(file));
    std::iter::once(here.clone())
        .chain(installed)
        .chain(above)
        .chain([built])
        .find(|path| path.exists())
        .unwrap_or(here)
}
