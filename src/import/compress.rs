//! Images in blocks of 4 × 4 texels (BC7), a quarter of the memory.
//!
//! Blocks are worked out once for an image's texels and then come from the [`Cache`]. An image stays as it is where
//! blocks would show ([`LEAST_PSNR`]), where it has more than eight bits, and where its sides are no multiples of four,
//! which block formats ask of textures.

use super::cache::{Cache, Key};
use systems::assets::blocks::{decode, encode, psnr};
use systems::assets::{Image, ImageKind, Library, Texels, level_size};
use systems::ecs::parallel::map_in_parallel;

/// Decibels: what the finest level keeps at least, by the mean square over the channels that are read. At 38 a byte is
/// off by 3 in the root of the mean square.
pub const LEAST_PSNR: f64 = 38.0;

/// Decibels: what every block of the finest level keeps at least. A patch of noise in a smooth picture leaves the mean
/// as it is, and shows all the same. At 24 a byte of the block is off by 16 in the root of the mean square, a sixteenth
/// of the range, which what is in a block that is as busy still hides.
pub const LEAST_BLOCK_PSNR: f64 = 24.0;

/// Texels of the smallest images that are worth it.
const FEWEST_TEXELS: u32 = 64 * 64;

/// Part of every key: another encoder, or another choice, is another result.
const VERSION: &[u8] = b"relief bc7 4";

/// Counts of [`compress_images`].
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

/// Compresses the image into blocks; `false` if it stays as it is.
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

/// Decibels: what the block keeps that keeps least. For images whose sides are multiples of four.
pub fn worst_block(a: &[u8], b: &[u8], width: u32, kind: ImageKind) -> f64 {
    // Four rows of texels, and of these what a block is wide.
    const BLOCK_ROW: usize = 4 * 4;
    let row = width as usize * 4;
    let mut worst = f64::INFINITY;
    let mut pair = [[0; 4 * BLOCK_ROW]; 2];
    for rows in (0..a.len().min(b.len())).step_by(4 * row) {
        for start in (rows..rows + row).step_by(BLOCK_ROW) {
            for (of_block, texels) in pair.iter_mut().zip([a, b]) {
                for (y, own) in of_block.chunks_mut(BLOCK_ROW).enumerate() {
                    own.copy_from_slice(&texels[start + y * row..][..BLOCK_ROW]);
                }
            }
            worst = worst.min(psnr(&pair[0], &pair[1], kind));
        }
    }
    worst
}

/// The levels in blocks; none where they would be too far from the image.
fn in_blocks(image: &Image) -> Vec<Vec<u8>> {
    let mut levels = Vec::with_capacity(image.levels.len());
    for (level, texels) in image.levels.iter().enumerate() {
        let (width, height) = level_size(image.width, image.height, level as u32);
        let blocks = encode(texels, width, height);
        if level == 0 {
            let decoded = decode(&blocks, width, height);
            let worst = worst_block(texels, &decoded, width, image.kind);
            if psnr(texels, &decoded, image.kind) < LEAST_PSNR || worst < LEAST_BLOCK_PSNR {
                return Vec::new();
            }
        }
        levels.push(blocks);
    }
    levels
}
