//! Normal maps that lack a channel: what of them can be seen in their texels, and what is made of it.
//!
//! Tools keep x and y alone, since z = √(1 − x² − y²): BC5 has two channels, which become red and green without blue;
//! DXT5 keeps y in green and x in alpha, where it has most bits ("DXT5nm"). Where all texels say so, z is made again.

use super::channels::rgba8;
use glam::{Vec2, Vec4};
use image::{DynamicImage, Rgba, Rgba32FImage, RgbaImage};

/// Tolerance for values of a channel that count as the same: JPEG does not keep them quite.
const SAME: f32 = 2.5 / 255.0;
/// Tolerance of a normal's squared length around 1, where z is there: rounding to a byte changes it by 0.016,
/// and filters that made the map leave it shorter.
const OFF: f32 = 0.1;
/// Texels that are looked at to see whether the map points into the surface.
const SAMPLES: usize = 4096;

const FROM_RED_GREEN: &str = "has no z in blue: it is reconstructed from red and green, √(1 − x² − y²)";
const FROM_ALPHA_GREEN: &str = "has x in alpha and y in green, and no z: it is reconstructed from them";
const GREY: &str = "is grey: expected a normal map; relief map normal makes one";
const GREY_ALPHA: &str = "is grey with alpha: expected a normal map, x in red and y in green (or x in alpha)";
const INWARD: &str = "points into the surface: expected z, in blue, above one half";

#[derive(Clone, Copy, PartialEq, Debug)]
enum Layout {
    Whole,
    RedGreen,
    AlphaGreen,
    Grey,
    GreyAlpha,
    Inward,
}

/// The map with z in all texels, and what to say of it.
pub fn with_z(pixels: DynamicImage) -> (DynamicImage, Option<&'static str>) {
    let layout = match &pixels {
        DynamicImage::ImageLuma8(_) | DynamicImage::ImageLuma16(_) => Layout::Grey,
        DynamicImage::ImageLumaA8(_) | DynamicImage::ImageLumaA16(_) => Layout::GreyAlpha,
        DynamicImage::ImageRgb8(image) => layout(image.pixels().map(|p| bytes([p.0[0], p.0[1], p.0[2], 255]))),
        DynamicImage::ImageRgba8(image) => layout(image.pixels().map(|p| bytes(p.0))),
        deep => {
            let image = deep.to_rgba32f();
            layout(image.pixels().map(|p| Vec4::from_array(p.0)))
        }
    };
    let single = pixels.width() * pixels.height() == 1;
    match layout {
        Layout::Whole => (pixels, None),
        Layout::RedGreen => (rebuilt(pixels, |t| Vec2::new(t.x, t.y)), Some(FROM_RED_GREEN)),
        Layout::AlphaGreen => (rebuilt(pixels, |t| Vec2::new(t.w, t.y)), Some(FROM_ALPHA_GREEN)),
        // A texel says little.
        Layout::Grey => (pixels, (!single).then_some(GREY)),
        Layout::GreyAlpha => (pixels, (!single).then_some(GREY_ALPHA)),
        Layout::Inward => (pixels, Some(INWARD)),
    }
}

fn bytes(texel: [u8; 4]) -> Vec4 {
    Vec4::from_array(texel.map(f32::from)) / 255.0
}

fn rebuilt(pixels: DynamicImage, xy: impl Fn(Vec4) -> Vec2) -> DynamicImage {
    let texel = |texel: Vec4| {
        let stored = xy(texel);
        let z = (1.0 - (stored * 2.0 - 1.0).length_squared()).max(0.0).sqrt();
        stored.extend(0.5 * z + 0.5).extend(1.0)
    };
    match pixels {
        DynamicImage::ImageRgb8(_) | DynamicImage::ImageRgba8(_) => {
            let mut image: RgbaImage = rgba8(pixels);
            for p in image.pixels_mut() {
                *p = Rgba(texel(bytes(p.0)).to_array().map(|v| (v * 255.0).round() as u8));
            }
            image.into()
        }
        deep => {
            let deep16 = !matches!(deep, DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_));
            let mut image: Rgba32FImage = deep.into_rgba32f();
            image.pixels_mut().for_each(|p| *p = Rgba(texel(Vec4::from_array(p.0)).to_array()));
            let image = DynamicImage::from(image);
            if deep16 { image.into_rgba16().into() } else { image }
        }
    }
}

/// Finds the layout in a single pass over the texels. It ends early for most maps, whose blue varies.
fn layout(texels: impl ExactSizeIterator<Item = Vec4> + Clone) -> Layout {
    let count = texels.len();
    let Some(first) = texels.clone().next() else { return Layout::Whole };
    let constant = |channel: usize| texels.clone().all(|t| (t[channel] - first[channel]).abs() <= SAME);
    let length = |xy: Vec2, z: f32| (xy * 2.0 - 1.0).length_squared() + (2.0 * z - 1.0).powi(2);
    if texels.clone().all(|t| (t.x - t.y).abs().max((t.y - t.z).abs()) <= SAME) {
        return if constant(3) { Layout::Grey } else { Layout::GreyAlpha };
    }
    if constant(2) {
        let inward = first.z < 0.5 - SAME;
        let varies = !constant(0) || !constant(1);
        let fits = |t: Vec4| length(Vec2::new(t.x, t.y), 0.5) <= 1.0 + OFF;
        // x and y whose z is not what blue has, though they may well be those of a normal.
        let lacks = |t: Vec4| (length(Vec2::new(t.x, t.y), t.z) - 1.0).abs() > OFF;
        if constant(0) && !constant(3) && texels.clone().all(|t| length(Vec2::new(t.w, t.y), 0.5) <= 1.0 + OFF) {
            return Layout::AlphaGreen;
        }
        if inward || varies && texels.clone().all(fits) && texels.clone().any(lacks) {
            return Layout::RedGreen;
        }
        return Layout::Whole;
    }
    // DXT5nm, whose blue may hold what green does.
    let like_green = || texels.clone().all(|t| (t.y - t.z).abs() <= SAME);
    if constant(0) && !constant(3) && like_green() {
        return Layout::AlphaGreen;
    }
    let sampled = texels.step_by((count / SAMPLES).max(1));
    let (inward, all) = sampled.fold((0, 0), |(inward, all), t| (inward + usize::from(t.z < 0.45), all + 1));
    if 2 * inward > all { Layout::Inward } else { Layout::Whole }
}
