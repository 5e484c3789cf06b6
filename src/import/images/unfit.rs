//! Images that are refused: damaged, too large, or in no known format.

use image::{ImageError, ImageFormat};
use std::error::Error;
use std::fmt;

/// Texels along one side.
pub const MAX_SIDE: u32 = 16384;
/// Texels of one image. Decoding takes some 10 bytes for each; those of more than eight bits count twice, and take 14
/// for each count.
pub const MAX_TEXELS: u64 = 8192 * 8192;

/// The common name of a format.
pub fn name(format: ImageFormat) -> &'static str {
    match format {
        ImageFormat::Png => "PNG",
        ImageFormat::Jpeg => "JPEG",
        ImageFormat::Bmp => "BMP",
        ImageFormat::WebP => "WebP",
        ImageFormat::Dds => "DDS",
        ImageFormat::OpenExr => "OpenEXR",
        ImageFormat::Tga => "TGA",
        _ => "image",
    }
}

/// Reasons for which bytes are no image.
#[derive(Debug)]
pub enum Unfit {
    /// Not one of the known formats.
    UnknownFormat,
    /// Damaged or too large.
    Damaged(String),
}

impl fmt::Display for Unfit {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::UnknownFormat => f.write_str("expected a PNG, JPEG, TGA, BMP, WebP, DDS or OpenEXR image"),
            Self::Damaged(message) => f.write_str(message),
        }
    }
}

/// An error of the image crate, without its own names of formats.
pub fn damaged(format: ImageFormat, error: &ImageError) -> Unfit {
    let why = match error {
        ImageError::Limits(_) => return too_large("it"),
        ImageError::Decoding(error) => error.source().map_or_else(|| "it is damaged".into(), ToString::to_string),
        error => error.to_string(),
    };
    Unfit::Damaged(format!("the {} cannot be decoded: {why}", name(format)))
}

/// An image of more texels than are read.
pub fn too_large(what: &str) -> Unfit {
    Unfit::Damaged(format!(
        "{what} is too large: at most {MAX_SIDE} texels along a side and {MAX_TEXELS} in all are read, half of that \
         where they have more than 8 bits"
    ))
}
