//! Alpha of images that hides colour: the colour of clear texels, and the coverage of masks seen from afar.
//!
//! Colour is filtered apart from alpha, by the sampler and in mip levels, so the colour of a texel that is not seen
//! shows beside those that are. Painting programs leave black there. Here such texels take the colour of what is beside
//! them, and levels weigh colour by alpha.
//!
//! Coverage changes with the level too: averages of few clear and many covered texels pass the cut-off, or none do. So
//! alpha is scaled level by level until the part that passes is the finest level's (Castano, "Computing Alpha Mipmaps",
//! 2010). And a mask is stored so that the edge between a texel that is seen and one that is not lies halfway, whatever
//! the cut-off: alpha is stretched linearly on both sides of the cut-off until both ends are equally far from it.

use super::image::{Store, level_size};
use glam::Vec4;

/// Least distance from the cut-off that alpha is stretched to: enough steps of 1/255 for a smooth edge.
const LEAST_REACH: f32 = 16.0 / 255.0;

/// Tells if all texels have full alpha.
pub fn is_opaque<S: Store>(_: &S, level: &[u8]) -> bool {
    level.chunks_exact(S::BYTES).all(|texel| S::alpha(texel) >= 1.0)
}

/// Gives texels of no alpha the colour of those around them that have some, weighted by alpha; at an edge, where none
/// has, of those at the opposite one. Else that of the texel which they are part of in the next level. `levels`: all of
/// them, their colour weighted by alpha.
///
/// The sampler that reads the image is not known here. One that repeats mixes texels of opposite edges, one that clamps
/// or mirrors mixes an edge with its inner neighbours. So inner neighbours come first, which suits all of them.
pub fn color_what_is_clear<S: Store>(store: &S, levels: &mut [Vec<u8>], (width, height): (u32, u32)) {
    for level in (0..levels.len()).rev() {
        let (finer, coarser) = levels.split_at_mut(level + 1);
        let texels = &mut finer[level];
        if texels.chunks_exact(S::BYTES).all(|texel| S::alpha(texel) > 0.0) {
            continue;
        }
        let source = texels.clone();
        let (w, h) = level_size(width, height, level as u32);
        let texel = |x: u32, y: u32| &source[(y * w + x) as usize * S::BYTES..][..S::BYTES];
        let parent = coarser.first().map(|parent| (parent, level_size(width, height, level as u32 + 1)));
        let mut one = Vec::with_capacity(S::BYTES);
        for (i, target) in texels.chunks_exact_mut(S::BYTES).enumerate() {
            if S::alpha(target) > 0.0 {
                continue;
            }
            let (x, y) = (i as u32 % w, i as u32 / w);
            let mut around = Vec4::ZERO;
            let weighted = |x: u32, y: u32| {
                if S::alpha(texel(x, y)) == 0.0 {
                    return Vec4::ZERO;
                }
                let color = store.decode(texel(x, y));
                color.truncate().extend(1.0) * color.w
            };
            for y in y.saturating_sub(1)..=(y + 1).min(h - 1) {
                for x in x.saturating_sub(1)..=(x + 1).min(w - 1) {
                    around += weighted(x, y);
                }
            }
            let at_edge = x == 0 || y == 0 || x + 1 == w || y + 1 == h;
            if around.w == 0.0 && at_edge {
                for y in [y + h - 1, y, y + 1] {
                    [x + w - 1, x, x + 1].into_iter().for_each(|x| around += weighted(x % w, y % h));
                }
            }
            let color = if around.w > 0.0 {
                around.truncate() / around.w
            } else {
                let Some((parent, (w, h))) = parent else { continue };
                let at = (y / 2).min(h - 1) * w + (x / 2).min(w - 1);
                store.decode(&parent[at as usize * S::BYTES..][..S::BYTES]).truncate()
            };
            one.clear();
            store.encode(color.extend(0.0), &mut one);
            target.copy_from_slice(&one);
        }
    }
}

/// Stretches the alpha of a mask's levels about its cut-off, so that in each as large a part passes as in the first.
/// `least`: 255ths that pass.
pub fn keep_coverage<S: Store>(_: &S, levels: &mut [Vec<u8>], least: u8) {
    let cutoff = (f32::from(least) - 0.5) / 255.0;
    let alphas = |level: &[u8]| level.chunks_exact(S::BYTES).map(S::alpha).collect::<Vec<f32>>();
    let Some(first) = levels.first() else { return };
    let passing = first.chunks_exact(S::BYTES).filter(|texel| S::alpha(texel) >= cutoff).count();
    let coverage = passing as f64 / (first.len() / S::BYTES).max(1) as f64;
    for (i, level) in levels.iter_mut().enumerate() {
        let threshold = if i == 0 { cutoff } else { threshold(&mut alphas(level), coverage) };
        for texel in level.chunks_exact_mut(S::BYTES) {
            let alpha = S::alpha(texel);
            let stretched = stretched(alpha, threshold, cutoff);
            // Rounding takes nothing over the cut-off.
            let (low, high) = (f32::from(least - 1) / 255.0, f32::from(least) / 255.0);
            S::set_alpha(texel, if alpha >= threshold { stretched.max(high) } else { stretched.min(low) });
        }
    }
}

/// Alpha, where `threshold` becomes `cutoff` and 0 and 1 become equally far from it.
fn stretched(alpha: f32, threshold: f32, cutoff: f32) -> f32 {
    let reach = cutoff.min(1.0 - cutoff).max(LEAST_REACH);
    let above = alpha - threshold;
    let range = if above >= 0.0 { 1.0 - threshold } else { threshold };
    (cutoff + above / range.max(1e-6) * reach).clamp(0.0, 1.0)
}

/// The alpha that is passed by as near this part of the texels as can be; by all of them where all are alike and as
/// many as not should pass. Between two texels' alphas, so that filtering takes neither over it.
fn threshold(alphas: &mut [f32], coverage: f64) -> f32 {
    let wanted = (coverage * alphas.len() as f64).round() as usize;
    let highest = alphas.iter().copied().fold(0.0, f32::max);
    let none = highest + 1.0 / 255.0;
    if wanted == 0 {
        return none;
    }
    let (_, &mut last, _) = alphas.select_nth_unstable_by(wanted - 1, |a, b| b.total_cmp(a));
    // Those that are alike pass together, or none of them.
    let (over, with) = (alphas.iter().filter(|&&a| a > last).count(), alphas.iter().filter(|&&a| a >= last).count());
    if with - wanted <= wanted - over {
        let below = alphas.iter().copied().filter(|&a| a < last).fold(0.0, f32::max);
        0.5 * (last + below)
    } else if over > 0 {
        let above = alphas.iter().copied().filter(|&a| a > last).fold(1.0, f32::min);
        0.5 * (last + above)
    } else {
        none
    }
}

#[cfg(test)]
mod tests {
    use crate::assets::image::{Image, ImageKind};

    /// White where `seen`, else black and clear.
    fn leaves(side: u32, kind: ImageKind, seen: impl Fn(u32, u32) -> bool) -> Image {
        let texel = |i: u32| if seen(i % side, i / side) { [255; 4] } else { [0; 4] };
        Image::rgba8("leaves", side, side, kind, (0..side * side).flat_map(texel).collect())
    }

    fn passing(level: &[u8], least: u8) -> f64 {
        let passing = level.chunks_exact(4).filter(|texel| texel[3] >= least).count();
        passing as f64 / (level.len() / 4) as f64
    }

    #[test]
    fn no_level_shows_the_colour_of_what_is_clear() {
        for kind in [ImageKind::Blended, ImageKind::masked(0.3, 1.0)] {
            let image = leaves(64, kind, |x, y| (x / 2 + y / 2).is_multiple_of(2) && x > 20);
            for level in &image.levels {
                assert!(level.chunks_exact(4).all(|texel| texel[..3] == [255; 3]), "{kind:?}");
            }
        }
        let blended = leaves(64, ImageKind::Blended, |x, y| (x / 2 + y / 2).is_multiple_of(2));
        // A half of it: alpha is linear.
        assert_eq!(blended.levels[6], [255, 255, 255, 128]);
        // Where alpha is a value by itself, nothing is hidden: black counts.
        let color = leaves(64, ImageKind::Color, |x, y| (x / 2 + y / 2).is_multiple_of(2));
        assert_eq!(color.levels[6], [188, 188, 188, 128]);
    }

    #[test]
    fn clear_texels_take_the_colour_beside_them_and_not_one_from_afar() {
        // Red on the left, green on the right, and clear between them.
        let texel = |i: u32| match i % 16 {
            0..=2 => [255, 0, 0, 255],
            13..=15 => [0, 255, 0, 255],
            _ => [0; 4],
        };
        let image = Image::rgba8("two", 16, 16, ImageKind::Blended, (0..256).flat_map(texel).collect());
        let row = image.levels[0].as_chunks::<4>().0;
        assert_eq!([row[3], row[12]], [[255, 0, 0, 0], [0, 255, 0, 0]]);
        // A clear image stays as it is.
        let clear = Image::rgba8("clear", 2, 2, ImageKind::Blended, [9, 8, 7, 0].repeat(4));
        assert!(clear.levels.iter().all(|level| level.chunks_exact(4).all(|t| t == [9, 8, 7, 0])));
    }

    /// A leaf at the left edge of a texture that repeats: what is clear at the right edge mixes with it, and not with
    /// the green that is nearer within.
    #[test]
    fn clear_texels_at_an_edge_take_the_colour_of_the_opposite_one() {
        let column = |x: u32| match x {
            0 => [255, 0, 0, 255],
            11 | 12 => [0, 255, 0, 255],
            _ => [0; 4],
        };
        let columns = Image::rgba8("c", 16, 16, ImageKind::Blended, (0..256).flat_map(|i| column(i % 16)).collect());
        let row = columns.levels[0].as_chunks::<4>().0;
        assert_eq!([row[15], row[13], row[1]], [[255, 0, 0, 0], [0, 255, 0, 0], [255, 0, 0, 0]]);
        let rows = Image::rgba8("r", 16, 16, ImageKind::Blended, (0..256).flat_map(|i| column(i / 16)).collect());
        let texels = rows.levels[0].as_chunks::<4>().0;
        assert_eq!([texels[15 * 16], texels[13 * 16]], [[255, 0, 0, 0], [0, 255, 0, 0]]);
        // What is within comes first: a sampler that clamps sees nothing of the other edge.
        let both = |x: u32| match x {
            0 => [255, 0, 0, 255],
            14 => [0, 255, 0, 255],
            _ => [0; 4],
        };
        let both = Image::rgba8("b", 16, 1, ImageKind::Blended, (0..16).flat_map(both).collect());
        assert_eq!(both.levels[0].as_chunks::<4>().0[15], [0, 255, 0, 0]);
    }

    /// Sparse coverage vanishes from afar, where nothing is nearer to the truth than the least that could be shown.
    #[test]
    fn a_sparse_mask_ends_where_a_texel_would_show_more_than_twice_as_much() {
        let mask = ImageKind::Masked { least: 128 };
        let seen = |seen: &dyn Fn(u32, u32) -> bool| {
            let image = leaves(64, mask, seen);
            image.levels.iter().map(|level| passing(level, 128) * (level.len() / 4) as f64).collect::<Vec<_>>()
        };
        // A sixteenth of it: one texel of 4 × 4; of 2 × 2 one would be four times as much.
        assert_eq!(seen(&|x, y| x < 16 && y < 16), [256.0, 64.0, 16.0, 4.0, 1.0, 0.0, 0.0]);
        // 121 of 4096 are 30.3 of 1024, 7.6 of 256, 1.9 of 64 and 0.47 of 16. Texels that are covered alike pass
        // together: 25 whole ones and 10 halves, 4 and 4 of three quarters, 1 and 2 of three eighths.
        assert_eq!(seen(&|x, y| x < 11 && y < 11), [121.0, 35.0, 8.0, 3.0, 0.0, 0.0, 0.0]);
        // A wire in every eighth column: one column in four is as near to an eighth as none, and one in two is not.
        assert_eq!(seen(&|x, _| x.is_multiple_of(8)), [512.0, 256.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        // Half of it is one texel of two, and the last one.
        assert_eq!(seen(&|x, _| x < 32), [2048.0, 512.0, 128.0, 32.0, 8.0, 2.0, 1.0]);
    }

    #[test]
    fn a_mask_covers_as_much_in_every_level() {
        // Blades of grass: 3 of 16 columns, with edges that are half covered.
        let texel = |i: u32| [80, 160, 40, [0, 0, 90, 255, 255, 120, 30, 0][(i % 128 / 2 % 8) as usize]];
        for cutoff in [0.1, 0.3, 0.5, 0.75, 0.95] {
            let kind = ImageKind::masked(cutoff, 1.0);
            let ImageKind::Masked { least } = kind else { panic!("{kind:?}") };
            let plain = Image::rgba8("g", 128, 128, ImageKind::Color, (0..128 * 128).flat_map(texel).collect());
            let image = Image::rgba8("g", 128, 128, kind, (0..128 * 128).flat_map(texel).collect());
            assert_eq!(passing(&image.levels[0], least), passing(&plain.levels[0], least), "{cutoff}");
            let wanted = passing(&image.levels[0], least);
            for (level, texels) in image.levels.iter().enumerate() {
                let (part, plain) = (passing(texels, least), passing(&plain.levels[level], least));
                // A level whose texels are all alike shows all or nothing; else the columns of a period, 8 in all
                // levels up to the 4th, pass one by one.
                let step = if level < 4 { 1.0 / f64::from(8 >> level.saturating_sub(1)) } else { 1.0 };
                assert!((part - wanted).abs() <= 0.5 * step + 1e-9, "{cutoff}, level {level}: {part}, not {wanted}");
                assert!((part - wanted).abs() <= (plain - wanted).abs() + 1e-9, "{cutoff}, level {level}");
            }
        }
    }

    #[test]
    fn the_edge_of_a_mask_lies_halfway_between_its_texels() {
        for cutoff in [0.2, 0.3, 0.5, 0.8] {
            let image = leaves(2, ImageKind::masked(cutoff, 1.0), |x, _| x == 0);
            let (seen, clear) = (f32::from(image.levels[0][3]) / 255.0, f32::from(image.levels[0][7]) / 255.0);
            // Both are rounded to a byte, and the cut-off up to one.
            assert!((0.5 * (seen + clear) - cutoff).abs() < 1.5 / 255.0, "{cutoff}: {seen}, {clear}");
        }
    }

    #[test]
    fn what_has_no_alpha_is_plain_colour() {
        let kind = |kind| leaves(2, kind, |_, _| true).kind;
        assert_eq!([kind(ImageKind::Blended), kind(ImageKind::masked(0.5, 1.0))], [ImageKind::Color; 2]);
        // A cut-off that cuts nothing, and one that nothing passes.
        assert_eq!([ImageKind::masked(0.0, 1.0), ImageKind::masked(0.5, 0.4)], [ImageKind::Color; 2]);
    }
}
