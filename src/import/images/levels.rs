//! Decoded pixels become an image with its mip levels.

use super::channels::{rgba8, rgba16};
use super::normal_map;
use glam::{Vec3, Vec4};
use image::DynamicImage;
use systems::assets::color::linear_from_srgb;
use systems::assets::{Image, ImageKind};

/// An image, and what a person should know of it: phrases about it, such as "is grey: expected a normal map".
#[derive(Clone, Debug)]
pub struct ReadImage {
    /// With its mip levels.
    pub image: Image,
    /// Notes on contents that are hardly as meant, or were corrected.
    pub notes: Vec<String>,
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

/// Tells if red, green and blue are about the same: JPEG may leave grey a little apart.
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
