//! Values of pixels as pictures, for those who look at them and for programs that read PNG. `None` where there are more
//! or fewer values than pixels. Sizes are widths and heights in pixels.

use super::{coco, kitti};
use image::{DynamicImage, ImageBuffer, Luma, Rgb, RgbImage};

/// 16-bit grey.
pub fn of_grey((width, height): (u32, u32), values: Vec<u16>) -> Option<DynamicImage> {
    ImageBuffer::<Luma<u16>, _>::from_raw(width, height, values).map(Into::into)
}

/// 16-bit colours, three values for each pixel.
pub fn of_color16((width, height): (u32, u32), values: Vec<u16>) -> Option<DynamicImage> {
    ImageBuffer::<Rgb<u16>, _>::from_raw(width, height, values).map(Into::into)
}

/// Distances in metres, 16-bit grey: [`kitti::depth_steps`].
pub fn of_metres(size: (u32, u32), metres: &[f32]) -> Option<DynamicImage> {
    of_grey(size, metres.iter().map(|metres| kitti::depth_steps(*metres)).collect())
}

/// Unit normals, 8 bits: [`rgb_of_normal`].
pub fn of_normals((width, height): (u32, u32), normals: &[[f32; 3]]) -> Option<DynamicImage> {
    let rgb = |normal: &[f32; 3]| rgb_of_normal(*normal);
    RgbImage::from_raw(width, height, normals.iter().flat_map(rgb).collect()).map(Into::into)
}

/// A unit normal, 8 bits: 0.5 + 0.5·n; black where there is none.
pub fn rgb_of_normal(normal: [f32; 3]) -> [u8; 3] {
    let byte = |v: f32| ((v * 0.5 + 0.5) * 255.0).round() as u8;
    if normal == [0.0; 3] { [0; 3] } else { normal.map(byte) }
}

/// The lowest 24 bits of numbers as colours: [`coco::rgb_of_id`].
pub fn of_numbers((width, height): (u32, u32), numbers: impl Iterator<Item = u32>) -> Option<DynamicImage> {
    RgbImage::from_raw(width, height, numbers.flat_map(coco::rgb_of_id).collect()).map(Into::into)
}
