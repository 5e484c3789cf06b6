//! Texels in blocks and back: BC7, 16 bytes for 4 × 4 texels.

use super::image::{ImageKind, Texels};
use intel_tex_2::{RgbaSurface, bc7};

/// A level in blocks; what its last texels lack to a whole block is filled with them.
pub fn encode(texels: &[u8], width: u32, height: u32) -> Vec<u8> {
    let (wide, high) = (width.next_multiple_of(4), height.next_multiple_of(4));
    let mut padded = Vec::with_capacity((wide * high) as usize * 4);
    for y in 0..high {
        let row = &texels[(y.min(height - 1) * width) as usize * 4..][..width as usize * 4];
        padded.extend_from_slice(row);
        // The last texel goes on: what pads a block is not seen, but has its part in the block's colours.
        let last = &row[row.len() - 4..];
        (width..wide).for_each(|_| padded.extend_from_slice(last));
    }
    let opaque = texels.iter().skip(3).step_by(4).all(|&alpha| alpha == 255);
    let settings = if opaque { bc7::opaque_fast_settings() } else { bc7::alpha_fast_settings() };
    bc7::compress_blocks(&settings, &RgbaSurface { data: &padded, width: wide, height: high, stride: wide * 4 })
}

/// The texels of a level in blocks.
pub fn decode(blocks: &[u8], width: u32, height: u32) -> Vec<u8> {
    let (wide, high) = (width.next_multiple_of(4), height.next_multiple_of(4));
    let row = wide as usize * 4;
    let mut padded = vec![0; row * high as usize];
    let rows = blocks.chunks_exact(Texels::Bc7.row_bytes(width)).zip(padded.chunks_exact_mut(4 * row));
    for (blocks, rows) in rows {
        for (i, block) in blocks.as_chunks::<16>().0.iter().enumerate() {
            bcdec_rs::bc7(block, &mut rows[i * 16..], row);
        }
    }
    let rows = padded.chunks_exact(wide as usize * 4).take(height as usize);
    rows.flat_map(|row| &row[..width as usize * 4]).copied().collect()
}

/// Decibels, of 255, by the mean square over all channels, a normal map's without alpha: in its finest level it is 1.
pub fn psnr(a: &[u8], b: &[u8], kind: ImageKind) -> f64 {
    let channels = if kind == ImageKind::Normal { 3 } else { 4 };
    let square = |(a, b): (&[u8; 4], &[u8; 4])| {
        let off = |channel: usize| u64::from(a[channel].abs_diff(b[channel])).pow(2);
        (0..channels).map(off).sum::<u64>()
    };
    let (a, b) = (a.as_chunks().0, b.as_chunks().0);
    let sum: u64 = a.iter().zip(b).map(square).sum();
    let mean = sum as f64 / (a.len() * channels).max(1) as f64;
    10.0 * (255.0f64 * 255.0 / mean).log10()
}
