//! Images on the CPU with their mip levels.
//!
//! Levels are made here rather than on the GPU so that every adapter draws the same texels. Each is a box filter of
//! the one above, weighted exactly where a size is odd: colour in linear light, and by its alpha where that hides it
//! (`alpha.rs`); normals renormalised, and in alpha how far those that they are the mean of spread (`spread`).

use super::alpha;
use super::color::{LINEAR_FROM_SRGB8, srgb_from_linear};
use super::slots::slot_id;
use glam::{Vec3, Vec4};

/// Names an [`Image`] of the [`Library`](crate::assets::Library).
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct ImageId(u32);
slot_id!(ImageId);

impl ImageId {
    /// 1×1 white colour: stands in for a missing base, emissive or environment map.
    pub const WHITE_COLOR: Self = Self::from_slot(0);
    /// 1×1 white data: stands in for a missing specular, metallic-roughness, occlusion or height map.
    pub const WHITE_DATA: Self = Self::from_slot(1);
    /// 1×1 flat normal (0.5, 0.5, 1): stands in for a missing normal map.
    pub const FLAT_NORMAL: Self = Self::from_slot(2);
    /// 1×1 black data: stands in for a missing horizon map.
    pub const BLACK_DATA: Self = Self::from_slot(3);
    /// 1×1 offset of nothing (128, 128): stands in for a missing offset map.
    pub const NO_OFFSET: Self = Self::from_slot(4);
}

/// Meaning of the texels, which decides how they are filtered and decoded.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum ImageKind {
    /// sRGB-encoded colour; linear alpha, which is a value by itself and hides nothing.
    Color,
    /// sRGB-encoded colour, seen as much as its linear alpha says: of what is blended.
    Blended,
    /// sRGB-encoded colour, seen where its alpha is at least so many 255ths: of what a mask cuts out.
    Masked {
        /// The least byte that is seen, 1 to 255.
        least: u8,
    },
    /// Linear values.
    Data,
    /// Tangent-space unit vectors, (0.5, 0.5, 1) flat; linear. Alpha is made with the levels, whatever it was: 1 − how
    /// far the normals of the finest level spread that a texel stands for, so 1 in that level.
    Normal,
    /// Heights, 0 deepest to 1 highest; linear. Red alone is read.
    Height,
}

impl ImageKind {
    /// Tells if texels are colour, which eight bits hold sRGB-encoded.
    pub fn is_color(self) -> bool {
        matches!(self, Self::Color | Self::Blended | Self::Masked { .. })
    }

    /// The kind of a base map whose alpha counts as a mask with this cut-off. `base_alpha`: what its alpha is
    /// multiplied with before. Where nothing or everything is cut out, alpha hides nothing by itself.
    pub fn masked(cutoff: f32, base_alpha: f32) -> Self {
        let least = (cutoff / base_alpha * 255.0).ceil();
        if (1.0..=255.0).contains(&least) { Self::Masked { least: least as u8 } } else { Self::Color }
    }
}

/// Storage format of texels.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum Texels {
    /// Four bytes per texel.
    Rgba8,
    /// Four half floats per texel: what files of more than 8 bits become. Never sRGB-encoded.
    Rgba16Float,
    /// A float per texel: heights of more than 8 bits, of which half floats would make steps.
    R32Float,
    /// BC7: 16 bytes for 4 × 4 texels. The sides of the image are multiples of 4.
    Bc7,
}

impl Texels {
    /// Texels along the side of a block, and its bytes. Without compression a block is a texel.
    pub fn block(self) -> (u32, usize) {
        match self {
            Self::Rgba8 | Self::R32Float => (1, 4),
            Self::Rgba16Float => (1, 8),
            Self::Bc7 => (4, 16),
        }
    }

    /// Bytes of a row of blocks.
    pub fn row_bytes(self, width: u32) -> usize {
        let (side, bytes) = self.block();
        width.div_ceil(side) as usize * bytes
    }

    /// Bytes of a level.
    pub fn level_bytes(self, width: u32, height: u32) -> usize {
        self.row_bytes(width) * height.div_ceil(self.block().0) as usize
    }
}

/// An image with all its mip levels, top left first, rows tightly packed.
#[derive(Clone, PartialEq)]
pub struct Image {
    /// For people.
    pub name: String,
    /// Texels.
    pub width: u32,
    /// Texels.
    pub height: u32,
    /// Meaning of the texels.
    pub kind: ImageKind,
    /// Storage format.
    pub texels: Texels,
    /// Level 0 is the image itself, the last is 1×1. None once a renderer has taken the texels
    /// ([`crate::assets::Library::keep_texels`]).
    pub levels: Vec<Vec<u8>>,
}

/// Without the texels, which would be millions of numbers.
impl std::fmt::Debug for Image {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let Self { name, width, height, kind, texels, .. } = self;
        write!(f, "Image {{ {name:?}, {width}x{height}, {kind:?}, {texels:?} }}")
    }
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
        let mut bytes = Vec::with_capacity(pixels.len() * Rgba16Float::BYTES);
        pixels.iter().for_each(|&pixel| Rgba16Float.encode(pixel, &mut bytes));
        Self::with_levels(name.into(), width, height, kind, Texels::Rgba16Float, bytes)
    }

    /// A height map of floats, `heights` 0..1, one per texel. Makes the mip levels.
    ///
    /// # Panics
    /// If a side is 0 or there are not `width · height` heights.
    pub fn heights(name: impl Into<String>, width: u32, height: u32, heights: &[f32]) -> Self {
        let bytes = heights.iter().flat_map(|height| height.to_le_bytes()).collect();
        Self::with_levels(name.into(), width, height, ImageKind::Height, Texels::R32Float, bytes)
    }

    /// Bytes of all levels, also of an image whose texels a renderer has taken.
    pub fn bytes(&self) -> u64 {
        self.level_sizes().map(|(width, height)| self.texels.level_bytes(width, height) as u64).sum()
    }

    /// Texels of all levels, also of an image whose texels a renderer has taken.
    pub fn texel_count(&self) -> u64 {
        self.level_sizes().map(|(width, height)| u64::from(width) * u64::from(height)).sum()
    }

    fn level_sizes(&self) -> impl Iterator<Item = (u32, u32)> {
        (0..level_count(self.width, self.height)).map(|level| level_size(self.width, self.height, level))
    }

    /// Makes the second level the first; `false` where there is none.
    pub(crate) fn drop_finest_level(&mut self) -> bool {
        let side = self.texels.block().0;
        let (width, height) = level_size(self.width, self.height, 1);
        if self.levels.len() < 2 || !width.is_multiple_of(side) || !height.is_multiple_of(side) {
            return false;
        }
        self.levels.remove(0);
        (self.width, self.height) = (width, height);
        true
    }

    fn with_levels(name: String, width: u32, height: u32, kind: ImageKind, texels: Texels, pixels: Vec<u8>) -> Self {
        assert!(width > 0 && height > 0, "an image has at least one texel");
        assert_eq!(pixels.len(), texels.level_bytes(width, height), "one element per texel");
        let mut image = Self { name, width, height, kind, texels, levels: vec![pixels] };
        match texels {
            Texels::Rgba8 => image.add_levels(&Rgba8::new(kind)),
            Texels::Rgba16Float => image.add_levels(&Rgba16Float),
            Texels::R32Float => image.add_levels(&R32Float),
            Texels::Bc7 => unreachable!("images are made of texels"),
        }
        image
    }

    fn add_levels<S: Store>(&mut self, store: &S) {
        if matches!(self.kind, ImageKind::Blended | ImageKind::Masked { .. })
            && alpha::is_opaque(store, &self.levels[0])
        {
            self.kind = ImageKind::Color;
        }
        if self.kind == ImageKind::Normal {
            self.levels[0].chunks_exact_mut(S::BYTES).for_each(|texel| S::set_alpha(texel, 1.0));
        }
        for level in 1..level_count(self.width, self.height) {
            let (from, to) =
                (level_size(self.width, self.height, level - 1), level_size(self.width, self.height, level));
            let level = halve(store, &self.levels[level as usize - 1], from, to, self.kind);
            self.levels.push(level);
        }
        if let ImageKind::Blended | ImageKind::Masked { .. } = self.kind {
            alpha::color_what_is_clear(store, &mut self.levels, (self.width, self.height));
        }
        if let ImageKind::Masked { least } = self.kind {
            alpha::keep_coverage(store, &mut self.levels, least);
        }
    }
}

/// Codec of a texel; a type rather than a value, so that the filter's inner loop has no branch.
pub(crate) trait Store {
    const BYTES: usize;
    fn decode(&self, bytes: &[u8]) -> Vec4;
    fn encode(&self, linear: Vec4, bytes: &mut Vec<u8>);
    /// The alpha of a stored texel alone.
    fn alpha(bytes: &[u8]) -> f32;
    /// Stores another alpha, 0..1.
    fn set_alpha(bytes: &mut [u8], alpha: f32);
}

struct Rgba8 {
    /// By channel: stored byte to linear value.
    linear: [&'static [f32; 256]; 4],
    /// Linear colour in `SRGB_STEPS` to byte; none for linear storage.
    srgb: Option<&'static [u8]>,
}

impl Rgba8 {
    fn new(kind: ImageKind) -> Self {
        let color = kind.is_color();
        let channel: &'static [f32; 256] = if color { &LINEAR_FROM_SRGB8 } else { &LINEAR_FROM_UNORM8 };
        Self {
            linear: [channel, channel, channel, &LINEAR_FROM_UNORM8],
            srgb: color.then(|| SRGB8_FROM_LINEAR.as_slice()),
        }
    }
}

impl Store for Rgba8 {
    const BYTES: usize = 4;

    fn decode(&self, bytes: &[u8]) -> Vec4 {
        Vec4::from_array(std::array::from_fn(|channel| self.linear[channel][bytes[channel] as usize]))
    }

    fn encode(&self, linear: Vec4, bytes: &mut Vec<u8>) {
        let scaled = linear.clamp(Vec4::ZERO, Vec4::ONE);
        let [r, g, b, a] = (scaled * 255.0 + 0.5).to_array().map(|v| v as u8);
        bytes.extend(match self.srgb {
            None => [r, g, b, a],
            Some(table) => {
                let [r, g, b, _] = (scaled * SRGB_STEPS as f32 + 0.5).to_array().map(|v| table[v as usize]);
                [r, g, b, a]
            }
        });
    }

    fn alpha(bytes: &[u8]) -> f32 {
        f32::from(bytes[3]) / 255.0
    }

    fn set_alpha(bytes: &mut [u8], alpha: f32) {
        bytes[3] = (alpha.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    }
}

struct Rgba16Float;

impl Store for Rgba16Float {
    const BYTES: usize = 8;

    fn decode(&self, bytes: &[u8]) -> Vec4 {
        Vec4::from_array(std::array::from_fn(|i| half::f16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]]).to_f32()))
    }

    fn encode(&self, linear: Vec4, bytes: &mut Vec<u8>) {
        linear.to_array().into_iter().for_each(|v| bytes.extend(half::f16::from_f32(v).to_le_bytes()));
    }

    fn alpha(bytes: &[u8]) -> f32 {
        half::f16::from_le_bytes([bytes[6], bytes[7]]).to_f32()
    }

    fn set_alpha(bytes: &mut [u8], alpha: f32) {
        bytes[6..8].copy_from_slice(&half::f16::from_f32(alpha.clamp(0.0, 1.0)).to_le_bytes());
    }
}

/// In red; without alpha.
struct R32Float;

impl Store for R32Float {
    const BYTES: usize = 4;

    fn decode(&self, bytes: &[u8]) -> Vec4 {
        Vec4::new(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]), 0.0, 0.0, 1.0)
    }

    fn encode(&self, linear: Vec4, bytes: &mut Vec<u8>) {
        bytes.extend(linear.x.to_le_bytes());
    }

    fn alpha(_: &[u8]) -> f32 {
        1.0
    }

    fn set_alpha(_: &mut [u8], _: f32) {}
}

/// One axis of the box filter: for each target texel the first source texel and the weights of so many.
fn axis_weights<const TAPS: usize>(source: u32, target: u32) -> Vec<(usize, [f32; TAPS])> {
    let ratio = source as f32 / target as f32;
    (0..target)
        .map(|i| {
            // Rounded, the last one's end may lie behind the image.
            let (start, end) = (i as f32 * ratio, ((i + 1) as f32 * ratio).min(source as f32));
            let first = start as u32;
            let mut weights = [0.0; TAPS];
            for (k, weight) in weights.iter_mut().enumerate() {
                let texel = (first + k as u32) as f32;
                *weight = ((end.min(texel + 1.0) - start.max(texel)) / ratio).max(0.0);
            }
            (first as usize, weights)
        })
        .collect()
}

/// The exponent of the lobe (n·h)^s whose peak a level keeps, see [`spread`]: that of usual highlights.
const KEPT_LOBE: f32 = 64.0;

/// Spread of the normals that a smaller level merges into one texel, given with their weights, 0 to 1. It is the sine
/// of the angle by which normals would lean in all directions alike to widen a highlight as much.
///
/// Normals that lie about theirs as a bell curve widen by the variance of their slopes (Olano, Baker: "LEAN Mapping",
/// 2010; the sum of both axes). Most surfaces have flat tops and steep joints instead. Their highlight is less wide: a
/// part of the normals has all of it. So the variance is no more than that of the bell curve whose highlight has the same
/// peak: Σ w exp(−½ s d²/(1 + ½ s t))/(1 + ½ s t) = 1/(1 + ½ s t′), with each texel's own variance t and slope d
/// from the mean.
fn spread(normal: Vec3, texels: &[(Vec4, f32)]) -> f32 {
    let (mut mean, mut peak) = (Vec3::ZERO, 0.0);
    for &(texel, weight) in texels {
        let (own, variance) = (unit(texel.truncate()), slope_variance(1.0 - texel.w));
        mean += own * (weight / (1.0 + variance).sqrt());
        let cosine = own.dot(normal).max(0.05);
        let (away, wider) = (1.0 / (cosine * cosine) - 1.0, 1.0 + 0.5 * KEPT_LOBE * variance);
        peak += weight * (-0.5 * KEPT_LOBE * away / wider).exp() / wider;
    }
    let (exact, by_peak) = (1.0 / mean.length_squared() - 1.0, 2.0 / KEPT_LOBE * (1.0 / peak - 1.0));
    let variance = exact.min(by_peak).clamp(0.0, MOST_VARIANCE);
    (variance / (1.0 + variance)).sqrt()
}

/// The variance of slopes, the sum of both axes', of normals that spread so far.
fn slope_variance(spread: f32) -> f32 {
    let square = spread * spread;
    (square / (1.0 - square).max(f32::EPSILON)).min(MOST_VARIANCE)
}

/// Normals along the surface have slopes without end.
const MOST_VARIANCE: f32 = 50.0;

/// Weights of texels in the box filter.
const EVENLY: u8 = 0;
const BY_ALPHA: u8 = 1;
const AS_NORMALS: u8 = 2;

/// The level below: from stored texels to stored texels, without a copy of the image in floats between.
fn halve<S: Store>(store: &S, source: &[u8], from: (u32, u32), to: (u32, u32), kind: ImageKind) -> Vec<u8> {
    // Even sides, as nearly all are, need two texels and not three: a loop of known length, and three times as fast.
    match (from == (2 * to.0, 2 * to.1), kind) {
        (true, ImageKind::Blended | ImageKind::Masked { .. }) => filter::<S, 2, BY_ALPHA>(store, source, from, to),
        (false, ImageKind::Blended | ImageKind::Masked { .. }) => filter::<S, 3, BY_ALPHA>(store, source, from, to),
        (true, ImageKind::Normal) => filter::<S, 2, AS_NORMALS>(store, source, from, to),
        (false, ImageKind::Normal) => filter::<S, 3, AS_NORMALS>(store, source, from, to),
        (true, _) => filter::<S, 2, EVENLY>(store, source, from, to),
        (false, _) => filter::<S, 3, EVENLY>(store, source, from, to),
    }
}

/// [`halve`] where a target texel takes up to so many source texels along an axis. Where all of a target's texels are
/// clear, their colours count alike.
fn filter<S: Store, const TAPS: usize, const WEIGHED: u8>(
    store: &S,
    source: &[u8],
    (sw, sh): (u32, u32),
    (tw, th): (u32, u32),
) -> Vec<u8> {
    let (columns, rows) = (axis_weights::<TAPS>(sw, tw), axis_weights::<TAPS>(sh, th));
    let stride = sw as usize * S::BYTES;
    let mut target = Vec::with_capacity((tw * th) as usize * S::BYTES);
    for &(y0, wy) in &rows {
        for &(x0, wx) in &columns {
            let (mut sum, mut seen) = (Vec4::ZERO, Vec4::ZERO);
            let (mut taps, mut count) = ([(Vec4::ZERO, 0.0); 9], 0);
            for (ky, &wy) in wy.iter().enumerate().filter(|(_, w)| TAPS == 2 || **w > 0.0) {
                let row = &source[(y0 + ky) * stride..][..stride];
                for (kx, &wx) in wx.iter().enumerate().filter(|(_, w)| TAPS == 2 || **w > 0.0) {
                    let stored = store.decode(&row[(x0 + kx) * S::BYTES..][..S::BYTES]);
                    let texel = stored * (wx * wy);
                    sum += texel;
                    if WEIGHED == BY_ALPHA {
                        seen += texel * (texel.w / (wx * wy));
                    }
                    if WEIGHED == AS_NORMALS {
                        taps[count] = (stored, wx * wy);
                        count += 1;
                    }
                }
            }
            if WEIGHED == BY_ALPHA && sum.w > 0.0 {
                sum = (seen.truncate() / sum.w).extend(sum.w);
            }
            if WEIGHED == AS_NORMALS {
                let normal = unit(sum.truncate());
                sum = (normal * 0.5 + 0.5).extend(1.0 - spread(normal, &taps[..count]));
            }
            store.encode(sum, &mut target);
        }
    }
    target
}

/// The normal that a normal map's colour stands for.
fn unit(color: Vec3) -> Vec3 {
    (color * 2.0 - 1.0).try_normalize().unwrap_or(Vec3::Z)
}

static LINEAR_FROM_UNORM8: std::sync::LazyLock<[f32; 256]> =
    std::sync::LazyLock::new(|| std::array::from_fn(|i| i as f32 / 255.0));

/// Steps of the table from linear light to sRGB bytes: fine enough that every byte survives the round trip.
const SRGB_STEPS: usize = 1 << 14;

static SRGB8_FROM_LINEAR: std::sync::LazyLock<Vec<u8>> = std::sync::LazyLock::new(|| {
    (0..=SRGB_STEPS).map(|i| (srgb_from_linear(i as f32 / SRGB_STEPS as f32) * 255.0).round() as u8).collect()
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_made_of_texels_that_there_are() {
        for side in (3..=16_384u32).step_by(2) {
            let weights = axis_weights::<3>(side, side / 2);
            for &(first, weights) in weights.iter().rev().take(8) {
                let behind =
                    weights.iter().zip(first..).find(|&(weight, texel)| *weight > 0.0 && texel >= side as usize);
                assert_eq!(behind, None, "side {side}");
            }
        }
    }

    #[test]
    fn srgb_bytes_survive_the_round_trip() {
        let store = Rgba8::new(ImageKind::Color);
        for byte in 0..=255u8 {
            let mut bytes = Vec::new();
            store.encode(store.decode(&[byte; 4]), &mut bytes);
            assert_eq!(bytes, [byte; 4]);
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
        // sin 45°, by the angle that the bytes have: 90 / 127.5 both ways.
        assert_eq!(image.levels[1], [128, 128, 255, 75]);
    }

    #[test]
    fn levels_keep_how_far_the_normals_of_the_finest_spread() {
        // Alike in pairs, so that the second level adds nothing; alpha in files does not count.
        let (left, right) = ([38, 128, 218, 9], [218, 128, 218, 200]);
        let wide = |texel: [u8; 4]| (Vec4::from_array(texel.map(f32::from)) / 255.0).with_w(1.0);
        let image = Image::rgba8("n", 4, 1, ImageKind::Normal, [left, left, right, right].concat());
        assert_eq!(
            image.levels[0],
            [[38, 128, 218, 255]; 2].into_iter().chain([[218, 128, 218, 255]; 2]).flatten().collect::<Vec<_>>()
        );
        assert_eq!(image.levels[1], [38, 128, 218, 255, 218, 128, 218, 255]);
        assert_eq!(image.levels[2], [128, 128, 255, 75]);
        // A quarter left, the rest right: |m|² is ½ + ½ · ¼. A level in between rounds once more.
        let image = Image::rgba8("n", 4, 1, ImageKind::Normal, [left, right, right, right].concat());
        let kept = 1.0 - f32::from(image.levels[2][3]) / 255.0;
        assert!((kept - 0.375f32.sqrt()).abs() < 1.5 / 255.0, "{kept}");
        // Three flat, one at 45°: the flat ones keep three quarters of the peak, 2/64 · (4/3 − 1) is the variance.
        let texels = [(Vec4::new(0.5, 0.5, 1.0, 1.0), 0.75), (wide(right), 0.25)];
        assert!((spread(Vec3::Z, &texels) - (1.0f32 / 97.0).sqrt()).abs() < 1e-3);
        // The same in half floats, and where a side is odd.
        let image = Image::rgba16("n", 3, 1, ImageKind::Normal, &[wide(left), wide(right), wide(right)]);
        let kept = 1.0 - <Rgba16Float as Store>::alpha(&image.levels[1]);
        assert!((kept - (1.0f32 - 0.5 - 0.5 / 9.0).sqrt()).abs() < 4e-3, "{kept}");
    }
}
