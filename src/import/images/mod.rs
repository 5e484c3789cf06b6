//! Image files and embedded images.
//!
//! ```text
//! unfit       images that are refused; limits
//! dds, exr    formats that are read here, or not as a whole
//! decode      bytes of any format into pixels
//! channels    pixels with four channels
//! normal_map  normal maps that lack a channel
//! levels      pixels into an image with its mip levels
//! ```

pub mod channels;
mod dds;
pub mod decode;
mod exr;
pub mod levels;
mod normal_map;
pub mod unfit;

use super::error::ImportError;
use super::file::read_file;
use decode::{decode_as, guess};
use image::{DynamicImage, ImageFormat};
use levels::{ReadImage, with_levels};
use std::path::Path;
use systems::assets::ImageKind;
use unfit::Unfit;

/// Reads an image file.
pub fn load(path: &Path, kind: ImageKind) -> Result<ReadImage, ImportError> {
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    pixels(path).map(|pixels| with_levels(&name, kind, pixels))
}

/// The pixels of an image file as they are.
pub fn pixels(path: &Path) -> Result<DynamicImage, ImportError> {
    let bytes = read_file(path).map_err(|error| ImportError::Unreadable {
        path: path.to_owned(),
        place: "file".into(),
        message: error.to_string(),
    })?;
    let format = guess(&bytes, ImageFormat::from_path(path).ok());
    let pixels = format.ok_or(Unfit::UnknownFormat).and_then(|format| decode_as(&bytes, format));
    pixels.map_err(|unfit| ImportError::Invalid {
        path: path.to_owned(),
        place: if format.is_some() { "image data".into() } else { "byte 0".into() },
        message: unfit.to_string(),
    })
}
