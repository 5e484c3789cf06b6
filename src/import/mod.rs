//! Files into library items: images (`images/`) and glTF models (`gltf/`). What takes long to work out of them is kept
//! ([`cache`]): images in blocks ([`compress`]), tangents and levels of meshes ([`meshes`]).
//!
//! Everything is checked here, strictly, so that a frame has nothing left to refuse. A fault that touches what we
//! read is an [`ImportError`] that names the file, the place in it and what was expected; one that does not is a
//! [`Warning`] beside the model.

pub mod cache;
pub mod compress;
mod error;
mod file;
mod gltf;
mod images;
pub mod lattices;
pub mod meshes;
mod model;
pub mod progress;

pub use error::{ImportError, Warning};
pub(crate) use file::read_file;
pub use images::levels::ReadImage;
pub(crate) use model::RoomPart;
pub use model::{Model, NamedClass, Node, NodeLabels, RoomRole};

use crate::problem::Problem;
use bevy_tasks::ComputeTaskPool;
use std::path::{Path, PathBuf};
use systems::assets::{Image, ImageKind, Library};
use systems::ecs::parallel::map_in_parallel;

/// Reads an image file with its mip levels.
pub fn load_image(path: &Path, kind: ImageKind) -> Result<Image, ImportError> {
    read_image(path, kind).map(|read| read.image)
}

/// Loads an image as [`load_image`] does, with notes on it.
pub fn read_image(path: &Path, kind: ImageKind) -> Result<ReadImage, ImportError> {
    images::load(path, kind)
}

/// The pixels of an image file as they are stored.
pub fn load_pixels(path: &Path) -> Result<image::DynamicImage, ImportError> {
    images::pixels(path)
}

/// Reads image files in parallel; the results are in the order of the requests.
pub fn load_images(requests: &[(PathBuf, ImageKind)]) -> Vec<Result<ReadImage, ImportError>> {
    systems::set_threads(None);
    progress::expect(requests.len());
    map_in_parallel(requests.iter(), |(path, kind)| {
        let image = images::load(path, *kind);
        progress::done(1);
        image
    })
}

/// Reads a glTF file (`.gltf` or `.glb`) and the files below its folder that it names; its meshes, materials and images
/// join the library, or nothing does.
pub fn load_model(path: &Path, library: &mut Library) -> Result<Model, ImportError> {
    Ok(gltf::draft(path, None)?.join(library))
}

/// Reads glTF files in parallel. They join the library in the order of the requests, whichever is read first. They may
/// name files below the folder that holds both them and `named_in`, the folder of the file that names them.
pub fn load_models(paths: &[PathBuf], named_in: &Path, library: &mut Library) -> Vec<Result<Model, ImportError>> {
    systems::set_threads(None);
    let mut models = Vec::with_capacity(paths.len());
    // A few at once: each may take much memory while its images are decoded.
    for paths in paths.chunks(ComputeTaskPool::get().thread_num().max(1)) {
        let drafts = map_in_parallel(paths.iter(), |path| gltf::draft(path, Some(named_in)));
        models.extend(drafts.into_iter().map(|draft| Ok(draft?.join(library))));
    }
    models
}

/// Those files, and the files that they name in turn and may read, to find out whether any of them
/// changed: buffers and images of `.gltf` and `.glb` files; of others, none. The first names the others, in its folder.
pub fn with_files_named_by(files: &[PathBuf]) -> impl Iterator<Item = PathBuf> {
    let named_in = files.first().and_then(|file| file.parent());
    let of = move |file: &PathBuf| std::iter::once(file.clone()).chain(gltf::files_named_by(file, named_in));
    files.iter().flat_map(of)
}

/// Everything wrong with a glTF file, errors first.
pub fn check_model(path: &Path) -> Vec<Problem> {
    gltf::check(path)
}

/// Faults of an image file, if any.
pub fn check_image(path: &Path) -> Vec<Problem> {
    load_image(path, ImageKind::Data).err().map(Problem::from).into_iter().collect()
}
