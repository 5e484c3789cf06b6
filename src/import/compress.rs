//! Images in blocks of 4 × 4 texels (BC7), a quarter of the memory.
//!
//! Blocks are worked out once for an image's texels and then come from the [`Cache`]. An image stays as it is where
//! blocks would show ([`LEAST_PSNR`]), where it has more than eight bits, and where its sides are no multiples of four,
//! which block formats ask of textures.

use super::cache::{Cache, Key};
use systems::assets::blocks::{decode, encode, psnr};
use systems::assets::{Image, Library, Texels, level_size};
use systems::ecs::parallel::map_in_parallel;

/// Decibels: what the finest level keeps at least, by the mean square over the channels that are read. At 38 a byte is
/// off by 3 in the root of the mean square.
pub const LEAST_PSNR: f64 = 38.0;

/// Texels of the smallest images that are worth it.
const FEWEST_TEXELS: u32 = 64 * 64;

/// Part of every key: another encoder, or another choice, is another result.
const VERSION: &[u8] = b"relief bc7 3";

/// What [`compress_images`] did.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct CompressReport {
    /// Images in blocks.
    pub compressed: usize,
    /// Images that stayed as they are.
    pub kept: usize,
}

/// Puts the images of a library that have their texels into blocks, in parallel.
pub fn compress_images(library: &mut Library, cache: Option<&Cache>) -> CompressReport {
    systems::set_threads(None);
    let images: Vec<_> = library.images_mut().collect();
    let done = map_in_parallel(images.into_iter(), |(_, image)| compress(image, cache));
    let compressed = done.iter().filter(|&&done| done).count();
    CompressReport { compressed, kept: done.len() - compressed }
}

/// Whether the image is in blocks now.
pub fn compress(image: &mut Image, cache: Option<&Cache>) -> bool {
    let fits = image.width.is_multiple_of(4) && image.height.is_multiple_of(4);
    if image.texels != Texels::Rgba8 || !fits || image.width * image.height < FEWEST_TEXELS {
        return false;
    }
    let key = key(image);
    let cached = cache.and_then(|cache| cache.read(&key, |bytes| unpack(image, bytes)));
    let levels = cached.unwrap_or_else(|| {
        let levels = in_blocks(image);
        if let Some(cache) = cache {
            cache.write(&key, &levels.concat());
        }
        levels
    });
    if levels.is_empty() {
        return false;
    }
    (image.levels, image.texels) = (levels, Texels::Bc7);
    true
}

fn key(image: &Image) -> Key {
    let mut hasher = blake3::Hasher::new();
    let kind = format!("{:?}", image.kind);
    for part in [VERSION, kind.as_bytes(), &image.width.to_le_bytes(), &image.height.to_le_bytes()] {
        hasher.update(part);
    }
    // All of them: those of a mask do not follow from the finest alone.
    image.levels.iter().for_each(|level| _ = hasher.update(level));
    hasher.finalize()
}

/// The levels as they are kept: one after another; nothing at all for an image that blocks would spoil.
fn unpack(image: &Image, mut bytes: &[u8]) -> Option<Vec<Vec<u8>>> {
    if bytes.is_empty() {
        return Some(Vec::new());
    }
    let mut levels = Vec::with_capacity(image.levels.len());
    for level in 0..image.levels.len() as u32 {
        let (width, height) = level_size(image.width, image.height, level);
        let (own, rest) = bytes.split_at_checked(Texels::Bc7.level_bytes(width, height))?;
        levels.push(own.to_vec());
        bytes = rest;
    }
    bytes.is_empty().then_some(levels)
}

/// The levels in blocks; none where they would be too far from the image.
fn in_blocks(image: &Image) -> Vec<Vec<u8>> {
    let mut levels = Vec::with_capacity(image.levels.len());
    for (level, texels) in image.levels.iter().enumerate() {
        let (width, height) = level_size(image.width, image.height, level as u32);
        let blocks = encode(texels, width, height);
        if level == 0 && psnr(texels, &decode(&blocks, width, height), image.kind) < LEAST_PSNR {
            return Vec::new();
        }
        levels.push(blocks);
    }
    levels
}
