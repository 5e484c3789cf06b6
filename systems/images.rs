//! Images on the CPU with their mip levels.
//!
//! Levels are made here rather than on the GPU so that every adapter draws the same texels. Each is a box filter of
//! the one above, weighted exactly where a size is odd: colour in linear light, normals renormalised.

use glam::Vec4;

/// What the texels mean, which decides how they are filtered and decoded.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum ImageKind {
    /// sRGB-encoded colour, linear alpha.
    Color,
    /// Linear values.
    Data,
    /// Tangent-space unit vectors, (0.5, 0.5, 1) flat; linear.
    Normal,
}

/// How texels are stored.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum Texels {
    /// Four bytes per texel.
    Rgba8,
    /// Four half floats per texel: what 16-bit files become. Never sRGB-encoded.
    Rgba16Float,
}

impl Texels {
    /// Bytes of one texel.
    pub fn bytes(self) -> usize {
        match self {
            Self::Rgba8 => 4,
            Self::Rgba16Float => 8,
        }
    }
}

/// An image with all its mip levels, top left first, rows tightly packed.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// For people.
    pub name: String,
    /// Texels.
    pub width: u32,
    /// Texels.
    pub height: u32,
    /// What the texels mean.
    pub kind: ImageKind,
    /// How they are stored.
    pub texels: Texels,
    /// Level 0 is the image itself, the last is 1×1.
    pub levels: Vec<Vec<u8>>,
}

/// Mip levels of an image of that size, down to 1×1.
pub fn level_count(width: u32, height: u32) -> u32 {
    32 - width.max(height).max(1).leading_zeros()
}

/// Width and height of a level.
pub fn level_size(width: u32, height: u32, level: u32) -> (u32, u32) {
    ((width >> level).max(1), (height >> level).max(1))
}

impl Image {
    /// An 8-bit image; `pixels` holds `width · height` RGBA texels. Makes the mip levels.
    ///
    /// # Panics
    /// If a side is 0 or `pixels` has another length.
    pub fn rgba8(name: impl Into<String>, width: u32, height: u32, kind: ImageKind, pixels: Vec<u8>) -> Self {
        Self::with_levels(name.into(), width, height, kind, Texels::Rgba8, pixels)
    }

    /// A 16-bit image, from values 0..1 in linear RGBA (colour is *not* sRGB-encoded). Makes the mip levels.
    ///
    /// # Panics
    /// If a side is 0 or `pixels` has another length than `width · height`.
    pub fn rgba16(name: impl Into<String>, width: u32, height: u32, kind: ImageKind, pixels: &[Vec4]) -> Self {
        let bytes = pixels.iter().flat_map(|p| encode(Texels::Rgba16Float, kind, *p)).collect();
        Self::with_levels(name.into(), width, height, kind, Texels::Rgba16Float, bytes)
    }

    /// Reads one texel of level 0 as linear RGBA; outside coordinates are clamped.
    pub fn texel(&self, x: u32, y: u32) -> Vec4 {
        let index = (y.min(self.height - 1) * self.width + x.min(self.width - 1)) as usize;
        decode(self.texels, self.kind, &self.levels[0][index * self.texels.bytes()..][..self.texels.bytes()])
    }

    fn with_levels(name: String, width: u32, height: u32, kind: ImageKind, texels: Texels, pixels: Vec<u8>) -> Self {
        assert!(width > 0 && height > 0, "an image has at least one texel");
        assert_eq!(pixels.len(), width as usize * height as usize * texels.bytes(), "one element per texel");
        let mut linear: Vec<Vec4> = pixels.chunks_exact(texels.bytes()).map(|t| decode(texels, kind, t)).collect();
        let mut levels = vec![pixels];
        for level in 1..level_count(width, height) {
            linear = halve(&linear, level_size(width, height, level - 1), level_size(width, height, level), kind);
            let mut bytes = Vec::with_capacity(linear.len() * texels.bytes());
            linear.iter().for_each(|&t| bytes.extend(encode(texels, kind, t)));
            levels.push(bytes);
        }
        Self { name, width, height, kind, texels, levels }
    }
}

/// One axis of the box filter: for each target texel the first source texel and the weights of up to three.
fn axis_weights(source: u32, target: u32) -> Vec<(usize, [f32; 3])> {
    let ratio = source as f32 / target as f32;
    (0..target)
        .map(|i| {
            let (start, end) = (i as f32 * ratio, (i + 1) as f32 * ratio);
            let first = start as u32;
            let mut weights = [0.0; 3];
            for (k, weight) in weights.iter_mut().enumerate() {
                let texel = (first + k as u32) as f32;
                *weight = ((end.min(texel + 1.0) - start.max(texel)) / ratio).max(0.0);
            }
            (first as usize, weights)
        })
        .collect()
}

fn halve(source: &[Vec4], (sw, sh): (u32, u32), (tw, th): (u32, u32), kind: ImageKind) -> Vec<Vec4> {
    let (columns, rows) = (axis_weights(sw, tw), axis_weights(sh, th));
    let (last_x, last_y) = (sw as usize - 1, sh as usize - 1);
    let mut target = Vec::with_capacity((tw * th) as usize);
    for &(y0, wy) in &rows {
        for &(x0, wx) in &columns {
            let mut sum = Vec4::ZERO;
            for (ky, &wy) in wy.iter().enumerate() {
                for (kx, &wx) in wx.iter().enumerate() {
                    if wx * wy > 0.0 {
                        sum += source[(y0 + ky).min(last_y) * sw as usize + (x0 + kx).min(last_x)] * (wx * wy);
                    }
                }
            }
            if kind == ImageKind::Normal {
                let normal = (sum.truncate() * 2.0 - 1.0).try_normalize().unwrap_or(glam::Vec3::Z);
                sum = (normal * 0.5 + 0.5).extend(sum.w);
            }
            target.push(sum);
        }
    }
    target
}

fn decode(texels: Texels, kind: ImageKind, bytes: &[u8]) -> Vec4 {
    match texels {
        Texels::Rgba8 => {
            let alpha = f32::from(bytes[3]) / 255.0;
            if kind == ImageKind::Color {
                let table = &*LINEAR_FROM_SRGB8;
                Vec4::new(table[bytes[0] as usize], table[bytes[1] as usize], table[bytes[2] as usize], alpha)
            } else {
                Vec4::new(bytes[0].into(), bytes[1].into(), bytes[2].into(), bytes[3].into()) / 255.0
            }
        }
        Texels::Rgba16Float => Vec4::from_array(std::array::from_fn(|i| {
            half::f16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]]).to_f32()
        })),
    }
}

fn encode(texels: Texels, kind: ImageKind, linear: Vec4) -> impl Iterator<Item = u8> {
    let mut bytes = [0u8; 8];
    match texels {
        Texels::Rgba8 => {
            let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0).round() as u8;
            let color = |v: f32| if kind == ImageKind::Color { srgb8_from_linear(v) } else { byte(v) };
            bytes[..4].copy_from_slice(&[color(linear.x), color(linear.y), color(linear.z), byte(linear.w)]);
        }
        Texels::Rgba16Float => {
            for (i, value) in linear.to_array().into_iter().enumerate() {
                bytes[2 * i..2 * i + 2].copy_from_slice(&half::f16::from_f32(value).to_le_bytes());
            }
        }
    }
    bytes.into_iter().take(texels.bytes())
}

/// The sRGB transfer function, IEC 61966-2-1: encoded value to linear light, both 0..1.
pub fn linear_from_srgb(encoded: f32) -> f32 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

static LINEAR_FROM_SRGB8: std::sync::LazyLock<[f32; 256]> =
    std::sync::LazyLock::new(|| std::array::from_fn(|i| linear_from_srgb(i as f32 / 255.0)));

/// The byte whose linear value is nearest in the encoded domain, by way of a table: mip levels need millions.
fn srgb8_from_linear(linear: f32) -> u8 {
    static TABLE: std::sync::LazyLock<Vec<u8>> = std::sync::LazyLock::new(|| {
        (0..=SRGB_STEPS)
            .map(|i| {
                let l = i as f32 / SRGB_STEPS as f32;
                let e = if l <= 0.003_130_8 { l * 12.92 } else { 1.055 * l.powf(1.0 / 2.4) - 0.055 };
                (e * 255.0).round() as u8
            })
            .collect()
    });
    const SRGB_STEPS: usize = 1 << 14;
    TABLE[(linear.clamp(0.0, 1.0) * SRGB_STEPS as f32).round() as usize]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_bytes_survive_the_round_trip() {
        for byte in 0..=255u8 {
            let linear = LINEAR_FROM_SRGB8[byte as usize];
            assert_eq!(srgb8_from_linear(linear), byte);
        }
    }

    #[test]
    fn a_constant_image_stays_constant_at_every_level_even_with_odd_sizes() {
        let image = Image::rgba8("c", 7, 5, ImageKind::Color, [10, 200, 77, 128].repeat(35));
        assert_eq!(image.levels.len(), 3);
        for level in &image.levels {
            assert!(level.chunks_exact(4).all(|t| t == [10, 200, 77, 128]));
        }
    }

    #[test]
    fn colour_is_averaged_in_linear_light() {
        let image = Image::rgba8("bw", 2, 1, ImageKind::Color, vec![0, 0, 0, 255, 255, 255, 255, 255]);
        assert_eq!(image.levels[1], [188, 188, 188, 255]);
        let data = Image::rgba8("bw", 2, 1, ImageKind::Data, vec![0, 0, 0, 255, 255, 255, 255, 255]);
        assert_eq!(data.levels[1], [128, 128, 128, 255]);
    }

    #[test]
    fn averaged_normals_are_unit_again() {
        let left_right = vec![218, 128, 218, 255, 38, 128, 218, 255]; // ±45° about v
        let image = Image::rgba8("n", 2, 1, ImageKind::Normal, left_right);
        assert_eq!(image.levels[1], [128, 128, 255, 255]);
    }
}
