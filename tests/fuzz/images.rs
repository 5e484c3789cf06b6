//! Images: as maps, as pixels, and compared with another picture.

use crate::{Place, repair};
use relief::import::{load_image, load_pixels};
use relief::tools::compare;
use std::path::Path;
use systems::assets::ImageKind;

/// A PNG file.
pub fn png(place: &Place, bytes: &[u8]) {
    read(place, "png", &repair::mostly(bytes, repair::png));
}

/// A file of another format, which only TGA needs the extension for.
pub fn read(place: &Place, extension: &str, bytes: &[u8]) {
    let path = place.write("textures", &format!(".{extension}"), bytes);
    // As a map with its levels.
    if let Err(error) = load_image(&path, ImageKind::Color) {
        names_its_file(&error, &path);
    }
    // As a normal map, where other things count.
    let _ = load_image(&path, ImageKind::Normal);
    // As it is; OpenEXR, too.
    match load_pixels(&path) {
        Ok(pixels) => assert!(pixels.width() > 0 && pixels.height() > 0),
        Err(error) => names_its_file(&error, &path),
    }
}

fn names_its_file(error: &relief::import::ImportError, path: &Path) {
    assert!(error.to_string().starts_with(&*path.to_string_lossy()), "which file? {error}");
}

/// A picture that is compared with a grey one.
pub fn compared(place: &Place, bytes: &[u8]) {
    let path = place.write("textures", ".picture", &repair::mostly(bytes, repair::png));
    let Ok(pixels) = load_pixels(&path) else { return };
    if pixels.width().saturating_mul(pixels.height()) > 1 << 14 {
        return;
    }
    let linear = pixels.to_rgba32f();
    let luminances: Vec<f32> = linear.pixels().map(|pixel| compare::luminance(pixel.0)).collect();
    assert!(luminances.iter().all(|luminance| luminance.is_finite()), "a luminance that is no number");
    let error = compare::luminance_error(&vec![1.0; luminances.len()], &luminances, &vec![true; luminances.len()]);
    assert!(error.mean.is_finite() && error.p99.is_finite(), "{error:?}");
    let grey = image::RgbImage::from_pixel(pixels.width(), pixels.height(), image::Rgb([128; 3]));
    let flip = compare::flip(&grey, &pixels.into_rgb8()).expect("of one size");
    assert!((0.0..=1.0).contains(&flip), "{flip}");
}
