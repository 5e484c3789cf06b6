//! Colours and masks of surfaces on the CPU: base maps as rays and stand-ins read them.
//!
//! A map is read in one level, the finest of a size that the reader says: a beam is wider than a texel nearly
//! everywhere, and levels keep how much of a mask is open. It is filtered as its sampler says where a texel covers more
//! than a pixel.

use super::blocks;
use super::color::{LINEAR_FROM_SRGB8, srgb_from_linear};
use super::image::{Image, Texels, level_size};
use super::material::{Filter, Sampler, Wrap};
use glam::{Vec2, Vec4};

/// An image as rays read it.
#[derive(Debug)]
pub struct Texture {
    width: u32,
    height: u32,
    /// sRGB and alpha.
    texels: Vec<[u8; 4]>,
}

impl Texture {
    /// Texture of a map, of at most so many texels along a side; `None` where the image has lost its texels.
    pub fn new(image: &Image, most: u32) -> Option<Self> {
        let sizes = (0..).zip(&image.levels).map(|(i, level)| (level_size(image.width, image.height, i), level));
        let ((width, height), level) = sizes.into_iter().find(|((w, h), _)| *w.max(h) <= most)?;
        let bytes = match image.texels {
            Texels::Rgba8 => level.clone(),
            Texels::Bc7 => blocks::decode(level, width, height),
            Texels::Rgba16Float => {
                let channels = level.as_chunks::<2>().0.iter().map(|&bytes| half::f16::from_le_bytes(bytes).to_f32());
                let channels: Vec<f32> = channels.collect();
                channels.as_chunks::<4>().0.iter().flat_map(|&rgba| stored(Vec4::from_array(rgba))).collect()
            }
            Texels::R32Float => {
                let heights = level.as_chunks::<4>().0.iter().map(|&bytes| f32::from_le_bytes(bytes));
                heights.flat_map(|red| stored(Vec4::new(red, 0.0, 0.0, 1.0))).collect()
            }
        };
        let mut texels = bytes.as_chunks::<4>().0.to_vec();
        if !image.kind.is_color() && matches!(image.texels, Texels::Rgba8 | Texels::Bc7) {
            texels.iter_mut().for_each(|texel| *texel = stored(Vec4::from_array(texel.map(f32::from)) / 255.0));
        }
        Some(Self { width, height, texels })
    }

    /// Linear RGBA at a place of the image.
    pub fn sample(&self, uv: Vec2, sampler: &Sampler) -> Vec4 {
        let at = uv * Vec2::new(self.width as f32, self.height as f32);
        let column = |x: f32| wrapped(x, self.width, sampler.wrap_u);
        let row = |y: f32| wrapped(y, self.height, sampler.wrap_v);
        if sampler.mag == Filter::Nearest {
            return self.texel(column(at.x.floor()), row(at.y.floor()));
        }
        let corner = (at - 0.5).floor();
        let Vec2 { x, y } = at - 0.5 - corner;
        let columns = [column(corner.x), column(corner.x + 1.0)];
        let along = |row: u32| self.texel(columns[0], row).lerp(self.texel(columns[1], row), x);
        along(row(corner.y)).lerp(along(row(corner.y + 1.0)), y)
    }

    #[inline]
    fn texel(&self, x: u32, y: u32) -> Vec4 {
        let [r, g, b, a] = self.texels[(y * self.width + x) as usize];
        let linear = |byte: u8| LINEAR_FROM_SRGB8[usize::from(byte)];
        Vec4::new(linear(r), linear(g), linear(b), f32::from(a) / 255.0)
    }
}

/// Linear RGBA in bytes.
fn stored(linear: Vec4) -> [u8; 4] {
    let [r, g, b, a] = linear.clamp(Vec4::ZERO, Vec4::ONE).to_array();
    [srgb_from_linear(r), srgb_from_linear(g), srgb_from_linear(b), a].map(|value| (value * 255.0 + 0.5) as u8)
}

/// Texel along a side of so many that is read for one that may lie outside.
fn wrapped(at: f32, side: u32, wrap: Wrap) -> u32 {
    let (at, side) = (at as i64, i64::from(side));
    let inside = match wrap {
        // Most sides are powers of two, and divisions take long.
        Wrap::Repeat if side & (side - 1) == 0 => at & (side - 1),
        Wrap::Clamp => at.clamp(0, side - 1),
        Wrap::Repeat => at.rem_euclid(side),
        Wrap::Mirror => {
            let there = at.rem_euclid(2 * side);
            there.min(2 * side - 1 - there)
        }
    };
    inside as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assets::image::ImageKind;

    #[test]
    fn texels_are_read_as_samplers_say() {
        // Black, white.
        let image = Image::rgba8("steps", 2, 1, ImageKind::Color, vec![0, 0, 0, 255, 255, 255, 255, 255]);
        let texture = Texture::new(&image, 1024).expect("texels");
        let sampler = |wrap, mag| Sampler { wrap_u: wrap, wrap_v: wrap, mag, ..Sampler::default() };
        let red = |u: f32, wrap, mag| texture.sample(Vec2::new(u, 0.5), &sampler(wrap, mag)).x;
        // Centres of texels, and half-way between them.
        for (u, expected) in [(0.25, 0.0), (0.5, 0.5), (0.75, 1.0), (1.0, 0.5), (1.25, 0.0), (-0.25, 1.0)] {
            assert_eq!(red(u, Wrap::Repeat, Filter::Linear), expected, "{u}");
        }
        for (u, expected) in [(0.1, 0.0), (0.6, 1.0), (1.1, 1.0), (1.6, 0.0), (-0.1, 0.0), (-0.6, 1.0)] {
            assert_eq!(red(u, Wrap::Mirror, Filter::Nearest), expected, "{u}");
        }
        assert_eq!((red(-3.0, Wrap::Clamp, Filter::Linear), red(7.0, Wrap::Clamp, Filter::Linear)), (0.0, 1.0));
        assert!(texture.sample(Vec2::new(f32::NAN, 0.5), &Sampler::default()).is_nan());
    }

    #[test]
    fn every_way_of_storing_gives_the_colour() {
        let color = Vec4::new(0.5, 0.25, 1.0, 0.5);
        let half_floats = Image::rgba16("half", 4, 4, ImageKind::Blended, &[color; 16]);
        let bytes = stored(color);
        let plain = Image::rgba8("bytes", 4, 4, ImageKind::Blended, bytes.repeat(16));
        let mut packed = plain.clone();
        packed.texels = Texels::Bc7;
        packed.levels = vec![blocks::encode(&bytes.repeat(16), 4, 4)];
        let linear = (color * 255.0 + 0.5).to_array().map(|value| value as u8);
        let data = Image::rgba8("data", 4, 4, ImageKind::Data, linear.repeat(16));
        for image in [half_floats, plain, packed, data] {
            let found = Texture::new(&image, 1024).expect("texels").sample(Vec2::splat(0.4), &Sampler::default());
            // A byte of sRGB is at most 0.009 of linear light; two of them for what was stored twice, and by BC7.
            assert!(found.abs_diff_eq(color, 0.018), "{}: {found}", image.name);
        }
    }

    #[test]
    fn large_images_are_read_in_a_smaller_level_and_released_ones_not_at_all() {
        let mut image = Image::rgba8("large", 2048, 4, ImageKind::Color, vec![255; 2048 * 4 * 4]);
        let texture = Texture::new(&image, 1024).expect("texels");
        assert_eq!((texture.width, texture.height), (1024, 2));
        image.levels.clear();
        assert!(Texture::new(&image, 1024).is_none());
    }
}
