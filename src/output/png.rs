//! Pictures as PNG.

use super::error::OutputError;
use super::whole::write_whole;
use std::path::Path;

/// Encodes a picture as PNG and writes it whole.
///
/// # Errors
/// [`OutputError`].
pub fn write_png(path: &Path, picture: &image::DynamicImage) -> Result<(), OutputError> {
    let bytes = encode_png(picture).map_err(|source| OutputError::Encode { path: path.to_owned(), source })?;
    write_whole(path, &bytes)
}

/// Bytes of a PNG file of a picture.
///
/// # Errors
/// Pictures that PNG has no form for.
pub fn encode_png(picture: &image::DynamicImage) -> image::ImageResult<Vec<u8>> {
    use image::codecs::png::{CompressionType, FilterType, PngEncoder};
    let mut bytes = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive);
    picture.write_with_encoder(encoder)?;
    Ok(bytes)
}
