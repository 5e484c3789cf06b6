//! Images in blocks: quality on real textures, the cache, and the same picture.

use crate::common::{self, prelude::*};
use relief::import::cache::Cache;
use relief::import::compress::{LEAST_BLOCK_PSNR, LEAST_PSNR, compress, worst_block};
use relief::import::load_image;
use std::time::Instant;
use systems::assets::{Texels, blocks};

fn kind_of(path: &Path) -> ImageKind {
    let name = path.file_stem().unwrap_or_default().to_string_lossy().to_lowercase();
    if name.contains("normal") || name.ends_with("_n") {
        ImageKind::Normal
    } else if ["height", "bump", "spec", "gloss", "disp"].iter().any(|part| name.contains(part)) {
        ImageKind::Data
    } else {
        ImageKind::Color
    }
}

fn images_below(folder: &Path) -> Vec<PathBuf> {
    let (mut files, mut open) = (Vec::new(), vec![folder.to_owned()]);
    while let Some(folder) = open.pop() {
        for path in std::fs::read_dir(folder).unwrap().flatten().map(|entry| entry.path()) {
            let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
            if path.is_dir() {
                open.push(path);
            } else if ["png", "jpg", "tga"].contains(&&*extension) {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}

#[test]
fn blocks_of_real_textures_are_near_the_texels() {
    let mut files = images_below(&Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/textures"));
    if let Some(data) = common::test_data() {
        files.extend(images_below(&data.join("textures")));
    }
    let (mut compressed, mut texels, mut seconds) = ([0; 3], 0, 0.0);
    for file in files {
        let Ok(image) = load_image(&file, kind_of(&file)) else { continue };
        let mut blocks = image.clone();
        let started = Instant::now();
        if !compress(&mut blocks, None) {
            continue;
        }
        seconds += started.elapsed().as_secs_f64();
        texels += image.texel_count();
        let kinds = [ImageKind::Color, ImageKind::Data, ImageKind::Normal];
        compressed[kinds.iter().position(|&kind| kind == image.kind).unwrap()] += 1;
        assert_eq!(blocks.texels, Texels::Bc7);
        assert_eq!(blocks.levels.len(), image.levels.len());
        assert!(blocks.bytes() * 39 / 10 < image.bytes(), "{}", file.display());
        let decoded = blocks::decode(&blocks.levels[0], image.width, image.height);
        let quality = blocks::psnr(&image.levels[0], &decoded, image.kind);
        let worst = worst_block(&image.levels[0], &decoded, image.width, image.kind);
        eprintln!("{quality:.1} dB, {worst:.1} in the worst block, {:?} {}", image.kind, file.display());
        assert!(quality >= LEAST_PSNR, "{}: {quality} dB", file.display());
        assert!(worst >= LEAST_BLOCK_PSNR, "{}: {worst} dB in a block", file.display());
    }
    eprintln!("{compressed:?} images, {:.1} million texels a second", texels as f64 / seconds * 1e-6);
    assert!(compressed.iter().all(|&images| images >= 7), "{compressed:?}");
}

/// Noise over a gradient: blocks keep it well enough, but not exactly.
fn test_image(side: u32, kind: ImageKind) -> Image {
    let texel = |i: u32| {
        let noise = (i.wrapping_mul(2_654_435_761) >> 29) as u8;
        [(i % side * 255 / side) as u8, (i / side * 255 / side) as u8, 100 + noise, 255]
    };
    Image::rgba8("noise", side, side, kind, (0..side * side).flat_map(texel).collect())
}

#[test]
fn the_second_time_comes_from_the_cache_and_is_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let run = || {
        let cache = Cache::new(folder.path().to_owned(), 1 << 30);
        let mut image = test_image(128, ImageKind::Color);
        assert!(compress(&mut image, Some(&cache)));
        (image, cache.counts())
    };
    let (first, counts) = run();
    assert_eq!(counts, (0, 1));
    let (second, counts) = run();
    assert_eq!(counts, (1, 0));
    assert!(first == second);
    // Of another kind the same texels are another thing.
    let cache = Cache::new(folder.path().to_owned(), 1 << 30);
    assert!(compress(&mut test_image(128, ImageKind::Data), Some(&cache)));
    assert_eq!(cache.counts(), (0, 1));
    // Damaged files are worked out anew.
    for entry in std::fs::read_dir(folder.path()).unwrap().flatten() {
        let mut bytes = std::fs::read(entry.path()).unwrap();
        bytes[100] ^= 1;
        std::fs::write(entry.path(), bytes).unwrap();
    }
    let (third, counts) = run();
    assert_eq!(counts, (0, 1));
    assert!(first == third);
    assert_eq!(run().1, (1, 0));
}

/// Noise in 16 × 16 of 256 × 256 texels. The mean over the picture is 24 dB better than that over the patch.
#[test]
fn a_patch_of_noise_in_a_smooth_picture_keeps_it_as_it_is() {
    let side = 256;
    let noise = |i: u32| ((i ^ (i >> 7)).wrapping_mul(2_654_435_761) >> 13) as u8;
    let texel = |i: u32, is_noisy: bool| {
        let smooth = (i % side / 2 + i / side / 4) as u8;
        let is_noise = is_noisy && i % side < 16 && i / side < 16;
        if is_noise { [noise(4 * i), noise(4 * i + 1), noise(4 * i + 2), 255] } else { [smooth, smooth, smooth, 255] }
    };
    for (is_noisy, fits) in [(false, true), (true, false)] {
        let texels: Vec<u8> = (0..side * side).flat_map(|i| texel(i, is_noisy)).collect();
        let mut image = Image::rgba8("patch", side, side, ImageKind::Color, texels.clone());
        assert_eq!(compress(&mut image, None), fits);
        let decoded = blocks::decode(&blocks::encode(&texels, side, side), side, side);
        assert!(blocks::psnr(&texels, &decoded, ImageKind::Color) > LEAST_PSNR, "the mean takes either");
    }
}

#[test]
fn what_blocks_would_spoil_or_cannot_hold_stays_as_it_is() {
    let noise = |i: u32| ((i ^ (i >> 7)).wrapping_mul(2_654_435_761) >> 13) as u8;
    let wild = Image::rgba8("wild", 64, 64, ImageKind::Normal, (0..64 * 64 * 4).map(noise).collect());
    let odd = Image::rgba8("odd", 126, 128, ImageKind::Color, vec![7; 126 * 128 * 4]);
    let deep = Image::rgba16("deep", 64, 64, ImageKind::Data, &vec![glam::Vec4::ONE; 64 * 64]);
    let folder = tempfile::tempdir().unwrap();
    for image in [wild, odd, deep] {
        for _ in 0..2 {
            let cache = Cache::new(folder.path().to_owned(), 1 << 30);
            let mut own = image.clone();
            assert!(!compress(&mut own, Some(&cache)), "{}", image.name);
            assert!(own == image, "{}", image.name);
        }
    }
    // That the wild one is spoilt is remembered, too.
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}
