//! Image files and embedded images, with limits that a damaged header cannot exceed.

use super::gltf::read_file;
use super::{ImportError, ReadImage, dds, exr, normal_map};
use glam::{Vec3, Vec4};
use image::buffer::ConvertBuffer;
use image::{DynamicImage, ImageBuffer, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits, Rgba, RgbaImage};
use std::error::Error;
use std::io::Cursor;
use std::path::Path;
use systems::assets::color::linear_from_srgb;
use systems::assets::{Image, ImageKind};

/// Texels along one side.
const MAX_SIDE: u32 = 16384;
/// Texels of one image. Decoding takes some 10 bytes for each; those of more than eight bits count twice, and take 14
/// for each count.
pub const MAX_TEXELS: u64 = 8192 * 8192;
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

/// What people call the format.
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

/// Why bytes are no image.
#[derive(Debug)]
pub enum Unfit {
    /// Not one of the known formats.
    UnknownFormat,
    /// Damaged or too large.
    Damaged(String),
}

impl std::fmt::Display for Unfit {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::UnknownFormat => f.write_str("expected a PNG, JPEG, TGA, BMP, WebP, DDS or OpenEXR image"),
            Self::Damaged(message) => f.write_str(message),
        }
    }
}

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

/// What the image crate says of a file, without its own names of formats.
pub fn damaged(format: ImageFormat, error: &ImageError) -> Unfit {
    let why = match error {
        ImageError::Limits(_) => return too_large("it"),
        ImageError::Decoding(error) => error.source().map_or_else(|| "it is damaged".into(), ToString::to_string),
        error => error.to_string(),
    };
    Unfit::Damaged(format!("the {} cannot be decoded: {why}", name(format)))
}

fn too_large(what: &str) -> Unfit {
    Unfit::Damaged(format!(
        "{what} is too large: at most {MAX_SIDE} texels along a side and {MAX_TEXELS} in all are read, half of that \
         where they have more than 8 bits"
    ))
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

fn decode_as(bytes: &[u8], format: ImageFormat) -> Result<DynamicImage, Unfit> {
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

/// With four channels. Formats are converted by what is generic in the image crate, and so compiled with this crate:
/// the rest of it is not optimised (Cargo.toml).
pub fn rgba8(pixels: DynamicImage) -> RgbaImage {
    match pixels {
        DynamicImage::ImageLuma8(pixels) => pixels.convert(),
        DynamicImage::ImageLumaA8(pixels) => pixels.convert(),
        DynamicImage::ImageRgb8(pixels) => pixels.convert(),
        pixels => pixels.into_rgba8(),
    }
}

fn rgba16(pixels: DynamicImage) -> ImageBuffer<Rgba<u16>, Vec<u16>> {
    match pixels {
        DynamicImage::ImageLuma16(pixels) => pixels.convert(),
        DynamicImage::ImageLumaA16(pixels) => pixels.convert(),
        DynamicImage::ImageRgb16(pixels) => pixels.convert(),
        pixels => pixels.into_rgba16(),
    }
}

/// Eight bits stay eight bits; what has more becomes linear half floats, heights floats. Normal maps that lack z get
/// it. What floats have beyond 0 to 1 stays in colours alone.
pub fn with_levels(name: &str, kind: ImageKind, pixels: DynamicImage) -> ReadImage {
    let (width, height) = (pixels.width(), pixels.height());
    let mut notes = Vec::new();
    let pixels = match kind {
        ImageKind::Normal => {
            let (pixels, note) = normal_map::with_z(pixels);
            notes.extend(note.map(str::to_owned));
            pixels
        }
        _ => pixels,
    };
    if kind == ImageKind::Height && !is_grey(&pixels) {
        notes.push("is not a grey image: red is used as the height".into());
    }
    let image = match pixels {
        DynamicImage::ImageLuma8(_)
        | DynamicImage::ImageLumaA8(_)
        | DynamicImage::ImageRgb8(_)
        | DynamicImage::ImageRgba8(_) => Image::rgba8(name, width, height, kind, rgba8(pixels).into_raw()),
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            let mut texels: Vec<Vec4> = pixels.into_rgba32f().pixels().map(|p| Vec4::from_array(p.0)).collect();
            notes.extend(within_bounds(kind, &mut texels));
            deep(name, (width, height), kind, texels)
        }
        pixels => {
            let linear = |v: f32| if kind.is_color() { linear_from_srgb(v) } else { v };
            let stored = rgba16(pixels);
            let texels = stored.pixels().map(|p| {
                let [r, g, b, a] = p.0.map(|v| f32::from(v) / 65535.0);
                Vec3::new(linear(r), linear(g), linear(b)).extend(a)
            });
            deep(name, (width, height), kind, texels.collect())
        }
    };
    ReadImage { image, notes }
}

fn deep(name: &str, (width, height): (u32, u32), kind: ImageKind, texels: Vec<Vec4>) -> Image {
    if kind != ImageKind::Height {
        return Image::rgba16(name, width, height, kind, &texels);
    }
    let heights: Vec<f32> = texels.iter().map(|texel| texel.x).collect();
    Image::heights(name, width, height, &heights)
}

/// Keeps floats within what the map can hold; returns what to say of values that it cannot. Colours may exceed 1.
fn within_bounds(kind: ImageKind, texels: &mut [Vec4]) -> Option<String> {
    let most = if kind.is_color() { half::f16::MAX.to_f32() } else { 1.0 };
    let (mut lowest, mut highest, mut unknown) = (0.0f32, 0.0f32, false);
    for texel in texels {
        let read = if kind == ImageKind::Height { 1 } else { 3 };
        for value in texel.to_array().into_iter().take(read) {
            (lowest, highest) = (lowest.min(value), highest.max(value));
            unknown |= value.is_nan();
        }
        let known = Vec4::from_array(texel.to_array().map(|value| if value.is_nan() { 0.0 } else { value }));
        *texel = known.clamp(Vec4::ZERO, Vec4::new(most, most, most, 1.0));
    }
    if unknown {
        return Some("has values that are NaN: they are read as 0".into());
    }
    let beyond = lowest < 0.0 || highest > most;
    beyond.then(|| format!("has values from {lowest} to {highest}: they are clamped to 0 to {most}"))
}

/// Whether red, green and blue are about the same: JPEG may leave grey a little apart.
fn is_grey(pixels: &DynamicImage) -> bool {
    let about = |[r, g, b]: [u8; 3]| r.abs_diff(g) <= 2 && g.abs_diff(b) <= 2;
    match pixels {
        DynamicImage::ImageRgb8(image) => image.pixels().all(|p| about(p.0)),
        DynamicImage::ImageRgba8(image) => image.pixels().all(|p| about([p.0[0], p.0[1], p.0[2]])),
        DynamicImage::ImageLuma8(_)
        | DynamicImage::ImageLumaA8(_)
        | DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA16(_) => true,
        deep => deep.to_rgb8().pixels().all(|p| about(p.0)),
    }
}
