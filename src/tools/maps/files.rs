//! Maps from and to files.
//!
//! Integers are read as 0..1, floats (OpenEXR, some DDS) as they are. Maps are
//! written as PNG of 8 or 16 bits, or as OpenEXR of 32-bit floats.

use super::{MapError, Raster};
use crate::import;
use crate::name::named;
use crate::output::{self, OutputError};
use bytemuck::cast_slice;
use glam::Vec3;
use image::{DynamicImage, ImageBuffer, ImageFormat, Pixel};
use std::io::Cursor;
use std::path::Path;
use systems::assets::color::linear_from_srgb;
use systems::lights::LUMINANCE;

named! {
    /// Channel of an image that is read as one value per texel.
    pub enum Channel {
        /// Red
        R = "r",
        /// Green
        G = "g",
        /// Blue
        B = "b",
        /// Alpha; 1 in an image without alpha
        A = "a",
        /// 0.2126 r + 0.7152 g + 0.0722 b of the values as stored
        Luminance = "luminance",
    }
}

named! {
    /// Bits of each value of a PNG file.
    #[derive(Default)]
    pub enum Bits {
        /// 8 bits
        #[default]
        Eight = "8",
        /// 16 bits
        Sixteen = "16",
    }
}

/// An image as it is stored: 1 channel (grey), 2 (grey, alpha), 3 or 4.
///
/// # Errors
/// [`MapError::Import`]; [`MapError::Refused`] where a value is no finite number.
pub fn read(path: &Path) -> Result<Raster, MapError> {
    let (raster, _) = read_as_is(path)?;
    Ok(raster)
}

/// An image's colour in linear light, 3 channels: integers are sRGB, floats are linear already.
///
/// # Errors
/// Same as [`read`].
pub fn read_color(path: &Path) -> Result<Raster, MapError> {
    let (raster, is_float) = read_as_is(path)?;
    let linear = |v: f32| if is_float { v } else { linear_from_srgb(v) };
    Ok(map_texels(&raster, 3, |texel, to| {
        let rgb = rgb(texel).map(linear);
        to.copy_from_slice(&rgb);
    }))
}

/// One value per texel: the channel asked for, else what all of red, green and blue hold. They may be 2/255 apart, as
/// JPEG leaves them.
///
/// # Errors
/// Same as [`read`]; [`MapError::NotGrey`] for a colour image where no channel is asked for.
pub fn read_grey(path: &Path, channel: Option<Channel>) -> Result<Raster, MapError> {
    if let Some(channel) = channel {
        return read_channel(path, channel);
    }
    let raster = read(path)?;
    let is_grey = |texel: &[f32]| {
        let [r, g, b] = rgb(texel);
        (r - g).abs().max((r - b).abs()).max((g - b).abs()) <= 2.0 / 255.0
    };
    if let Some(index) = raster.values.chunks_exact(raster.channels).position(|texel| !is_grey(texel)) {
        let (x, y) = (index % raster.width, index / raster.width);
        return Err(MapError::NotGrey { path: path.to_owned(), texel: (x, y) });
    }
    Ok(map_texels(&raster, 1, |texel, to| to[0] = texel[0]))
}

/// One channel; of a grey image its grey, or its alpha.
///
/// # Errors
/// Same as [`read`].
pub fn read_channel(path: &Path, channel: Channel) -> Result<Raster, MapError> {
    Ok(map_texels(&read(path)?, 1, |texel, to| to[0] = pick(texel, channel)))
}

/// Checks, before the work, that a map can be written under that name, with so many bits if given.
///
/// # Errors
/// [`MapError::Refused`] for another ending than .png or .exr, [`MapError::Option`] for bits of an .exr,
/// [`MapError::Output`].
pub fn check_output(path: &Path, bits: Option<Bits>) -> Result<(), MapError> {
    if format(path)? == ImageFormat::OpenExr && bits.is_some() {
        let message = format!("{} holds 32-bit floats; expected a name that ends in .png", path.display());
        return Err(MapError::option("bits", message));
    }
    Ok(output::check_file(path)?)
}

/// Writes a map of 1, 3 or 4 channels, whole or not at all.
///
/// # Errors
/// [`MapError::Refused`] for another ending than .png or .exr, [`MapError::Output`].
pub fn write(path: &Path, map: &Raster, bits: Bits) -> Result<(), MapError> {
    if format(path)? == ImageFormat::Png {
        return Ok(output::write_png(path, &integers(map, bits))?);
    }
    let mut bytes = Cursor::new(Vec::new());
    let encoded = floats(map).write_to(&mut bytes, ImageFormat::OpenExr);
    encoded.map_err(|source| OutputError::Encode { path: path.to_owned(), source })?;
    Ok(output::write_whole(path, bytes.get_ref())?)
}

fn format(path: &Path) -> Result<ImageFormat, MapError> {
    match ImageFormat::from_path(path) {
        Ok(format @ (ImageFormat::Png | ImageFormat::OpenExr)) => Ok(format),
        _ => Err(MapError::refused(path, "expected a file name that ends in .png or .exr")),
    }
}

fn read_as_is(path: &Path) -> Result<(Raster, bool), MapError> {
    let pixels = import::load_pixels(path)?;
    let (width, height) = (pixels.width() as usize, pixels.height() as usize);
    let is_float = matches!(pixels, DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_));
    let channels = usize::from(pixels.color().channel_count());
    let values = match usize::from(pixels.color().bytes_per_pixel()) / channels {
        1 => pixels.as_bytes().iter().map(|&v| f32::from(v) / 255.0).collect(),
        2 => cast_slice::<u8, u16>(pixels.as_bytes()).iter().map(|&v| f32::from(v) / 65535.0).collect(),
        _ => cast_slice(pixels.as_bytes()).to_vec(),
    };
    let raster = Raster { width, height, channels, values };
    if let Some(index) = raster.values.iter().position(|value| !value.is_finite()) {
        let (x, y) = (index / channels % width, index / channels / width);
        return Err(MapError::refused(path, format!("expected finite numbers; texel ({x}, {y}) has another")));
    }
    Ok((raster, is_float))
}

fn rgb(texel: &[f32]) -> [f32; 3] {
    if texel.len() < 3 { [texel[0]; 3] } else { [texel[0], texel[1], texel[2]] }
}

fn pick(texel: &[f32], channel: Channel) -> f32 {
    let [r, g, b] = rgb(texel);
    match channel {
        Channel::R => r,
        Channel::G => g,
        Channel::B => b,
        Channel::A => {
            if texel.len().is_multiple_of(2) {
                texel[texel.len() - 1]
            } else {
                1.0
            }
        }
        Channel::Luminance => Vec3::new(r, g, b).dot(LUMINANCE),
    }
}

fn map_texels(from: &Raster, channels: usize, map: impl Fn(&[f32], &mut [f32]) + Sync) -> Raster {
    let stride = from.width * from.channels;
    let fill = |y: usize, row: &mut [f32]| {
        let source = from.values[y * stride..][..stride].chunks_exact(from.channels);
        row.chunks_exact_mut(channels).zip(source).for_each(|(to, texel)| map(texel, to));
    };
    Raster::from_rows((from.width, from.height, channels), fill, &|_| {})
}

/// 0..1 to 0..=largest, to the nearest.
fn quantized(value: f32, largest: f32) -> f32 {
    (value.clamp(0.0, 1.0) * largest + 0.5).floor()
}

fn integers(map: &Raster, bits: Bits) -> DynamicImage {
    let image = match bits {
        Bits::Eight => {
            let values = map.values.iter().map(|&v| quantized(v, 255.0) as u8).collect();
            match map.channels {
                1 => buffer(map, values).map(DynamicImage::ImageLuma8),
                3 => buffer(map, values).map(DynamicImage::ImageRgb8),
                _ => buffer(map, values).map(DynamicImage::ImageRgba8),
            }
        }
        Bits::Sixteen => {
            let values = map.values.iter().map(|&v| quantized(v, 65535.0) as u16).collect();
            match map.channels {
                1 => buffer(map, values).map(DynamicImage::ImageLuma16),
                3 => buffer(map, values).map(DynamicImage::ImageRgb16),
                _ => buffer(map, values).map(DynamicImage::ImageRgba16),
            }
        }
    };
    image.unwrap_or_default()
}

/// OpenEXR as it is written here has red, green and blue: grey is in all three.
fn floats(map: &Raster) -> DynamicImage {
    let image = match map.channels {
        1 => buffer(map, map.values.iter().flat_map(|&v| [v; 3]).collect()).map(DynamicImage::ImageRgb32F),
        3 => buffer(map, map.values.clone()).map(DynamicImage::ImageRgb32F),
        _ => buffer(map, map.values.clone()).map(DynamicImage::ImageRgba32F),
    };
    image.unwrap_or_default()
}

fn buffer<P: Pixel>(map: &Raster, values: Vec<P::Subpixel>) -> Option<ImageBuffer<P, Vec<P::Subpixel>>> {
    ImageBuffer::from_raw(map.width as u32, map.height as u32, values)
}
