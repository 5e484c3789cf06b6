//! Pixels with four channels.
//!
//! Formats are converted by what is generic in the image crate, and so compiled with this crate: the rest of it is not
//! optimised (Cargo.toml).

use image::buffer::ConvertBuffer;
use image::{DynamicImage, ImageBuffer, Rgba, RgbaImage};

/// Pixels of eight bits a channel.
pub fn rgba8(pixels: DynamicImage) -> RgbaImage {
    match pixels {
        DynamicImage::ImageLuma8(pixels) => pixels.convert(),
        DynamicImage::ImageLumaA8(pixels) => pixels.convert(),
        DynamicImage::ImageRgb8(pixels) => pixels.convert(),
        pixels => pixels.into_rgba8(),
    }
}

/// Pixels of sixteen bits a channel.
pub fn rgba16(pixels: DynamicImage) -> ImageBuffer<Rgba<u16>, Vec<u16>> {
    match pixels {
        DynamicImage::ImageLuma16(pixels) => pixels.convert(),
        DynamicImage::ImageLumaA16(pixels) => pixels.convert(),
        DynamicImage::ImageRgb16(pixels) => pixels.convert(),
        pixels => pixels.into_rgba16(),
    }
}
