//! Encoded images into pixels, with limits that a damaged header cannot exceed.

use super::unfit::{MAX_SIDE, MAX_TEXELS, Unfit, damaged, too_large};
use super::{dds, exr};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::io::Cursor;

/// Bytes that a decoder may take.
const MAX_ALLOC: u64 = 512 << 20;

/// Formats that are read; TGA last, for it has no signature and is known by its extension alone.
const FORMATS: [ImageFormat; 7] = [
    ImageFormat::Png,
    ImageFormat::Jpeg,
    ImageFormat::Bmp,
    ImageFormat::WebP,
    ImageFormat::Dds,
    ImageFormat::OpenExr,
    ImageFormat::Tga,
];

/// The format by content, else by what the name or media type says.
pub fn guess(bytes: &[u8], by_name: Option<ImageFormat>) -> Option<ImageFormat> {
    let by_content = image::guess_format(bytes).ok();
    by_content.or(by_name.filter(|&f| f == ImageFormat::Tga)).filter(|f| FORMATS.contains(f))
}

fn reader(bytes: &[u8], format: ImageFormat) -> ImageReader<Cursor<&[u8]>> {
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::no_limits();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_ALLOC);
    reader.limits(limits);
    reader
}

/// Looks at the header only. Returns the number of texels, twice that where they have more than eight bits.
pub fn texels(bytes: &[u8], by_name: Option<ImageFormat>) -> Result<u64, Unfit> {
    texels_as(bytes, guess(bytes, by_name).ok_or(Unfit::UnknownFormat)?)
}

fn texels_as(bytes: &[u8], format: ImageFormat) -> Result<u64, Unfit> {
    let ((width, height), deep) = match format {
        ImageFormat::Dds => {
            let header = dds::Header::new(bytes)?;
            ((header.width as usize, header.height as usize), header.is_deep())
        }
        ImageFormat::OpenExr => (exr::size(bytes)?, true),
        _ => {
            let decoder = reader(bytes, format).into_decoder().map_err(|error| damaged(format, &error))?;
            let ((width, height), color) = (decoder.dimensions(), decoder.color_type());
            ((width as usize, height as usize), color.bytes_per_pixel() > color.channel_count())
        }
    };
    if width == 0 || height == 0 {
        return Err(Unfit::Damaged(format!("expected at least one texel, the size is {width}×{height}")));
    }
    let texels = (width as u64).saturating_mul(height as u64).saturating_mul(if deep { 2 } else { 1 });
    if width.max(height) > MAX_SIDE as usize || texels > MAX_TEXELS {
        return Err(too_large(&format!("{width}×{height}")));
    }
    Ok(texels)
}

/// Decodes all of it.
pub fn decode(bytes: &[u8], by_name: Option<ImageFormat>) -> Result<DynamicImage, Unfit> {
    decode_as(bytes, guess(bytes, by_name).ok_or(Unfit::UnknownFormat)?)
}

/// Decodes all of what is in that format.
pub fn decode_as(bytes: &[u8], format: ImageFormat) -> Result<DynamicImage, Unfit> {
    texels_as(bytes, format)?;
    let pixels = match format {
        ImageFormat::Dds => dds::Header::new(bytes)?.decode(bytes)?,
        ImageFormat::OpenExr => exr::decode(bytes)?,
        _ => reader(bytes, format).decode().map_err(|error| damaged(format, &error))?,
    };
    if pixels.width() == 0 || pixels.height() == 0 {
        return Err(Unfit::Damaged("the image has no texels".into()));
    }
    Ok(pixels)
}
