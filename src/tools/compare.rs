//! Error of a picture against a reference: luminance error in linear HDR, and FLIP of what is shown.
//!
//! Luminance error asks how much light is missing or too much, and seams how far that changes where two pieces of an
//! object meet. FLIP asks what a viewer notices on flipping between the two. None knows where the pictures come from.

use image::RgbImage;
use systems::lights::LUMINANCE;

/// Size of a pixel for the viewer that [`flip`] assumes: pixels per degree of visual angle. FLIP's own default, a 0.7 m
/// wide screen of 3840 pixels seen from 0.7 m.
pub const PIXELS_PER_DEGREE: f32 = flip_rs::DEFAULT_PPD;

/// Pictures of at most so many pixels are compared. FLIP needs about 60 bytes for each.
pub const MOST_PIXELS: u64 = 1 << 24;

/// Pictures that cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// More than [`MOST_PIXELS`].
    #[error("pictures of {width}x{height} pixels are too large to compare: at most {MOST_PIXELS} pixels")]
    TooLarge {
        /// Pixels.
        width: u32,
        /// Pixels.
        height: u32,
    },
    /// One is of another size, or empty.
    #[error("pictures of {0}x{1} and {2}x{3} pixels cannot be compared")]
    Sizes(u32, u32, u32, u32),
}

/// Error of a picture against a reference, over the pixels that count.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct PictureError {
    /// Mean of |L − L_ref|, over the mean of L_ref.
    pub mean: f64,
    /// 99 % of the pixels are at most this far off.
    pub p99: f64,
    /// Mean FLIP of the tone-mapped pictures.
    pub flip: f64,
}

/// Rec. 709 luminance of a linear colour. What is no finite number counts as the largest half float, 65504: far off,
/// and still to be computed with.
pub fn luminance([r, g, b, _]: [f32; 4]) -> f32 {
    let luminance = glam::Vec3::new(r, g, b).dot(LUMINANCE);
    if luminance.is_finite() { luminance } else { 65504.0 }
}

/// |L − L_ref| of each pixel over the mean of L_ref.
#[derive(Clone, Debug, PartialEq)]
pub struct LuminanceError {
    /// One per pixel; 0 where the pixel does not count.
    pub of_pixels: Vec<f32>,
    /// Over the pixels that count.
    pub mean: f64,
    /// 99 % of the pixels that count are at most this far off (nearest rank).
    pub p99: f64,
}

/// Compares luminances, one per pixel, where `counted` says so. The quotient is taken with the mean of the reference
/// and not pixel by pixel, so that dark pixels do not outweigh what is seen. Where the reference is black, equal
/// pixels have error 0 and others an infinite one. If no pixel counts, the error is 0.
pub fn luminance_error(reference: &[f32], other: &[f32], counted: &[bool]) -> LuminanceError {
    let mean_reference = mean_luminance(reference, counted);
    let error = |difference: f32| relative(f64::from(difference), mean_reference) as f32;
    let pixels = reference.iter().zip(other).zip(counted);
    let of_pixels: Vec<f32> =
        pixels.map(|((&l, &other), &counts)| if counts { error(other - l) } else { 0.0 }).collect();
    let counting = of_pixels.iter().zip(counted).filter(|(_, counts)| **counts);
    let mut sorted: Vec<f64> = counting.map(|(&e, _)| f64::from(e)).collect();
    sorted.sort_by(f64::total_cmp);
    let p99 = percentile(&sorted, 990);
    // The empty sum is −0.
    let mean = (0.0 + sorted.iter().sum::<f64>()) / sorted.len().max(1) as f64;
    LuminanceError { of_pixels, mean, p99 }
}

/// Magnitude of a difference, in means of the reference.
fn relative(difference: f64, mean_reference: f64) -> f64 {
    if difference == 0.0 { 0.0 } else { difference.abs() / mean_reference }
}

/// The least of ascending values that so many thousandths of them do not exceed (nearest rank); 0 if there are none.
fn percentile(ascending: &[f64], thousandths: usize) -> f64 {
    let rank = (ascending.len() * thousandths).div_ceil(1000).saturating_sub(1);
    ascending.get(rank).copied().unwrap_or(0.0)
}

/// Object and piece that a pixel shows.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Shown {
    /// A number for the object.
    pub object: u32,
    /// A number for the piece of it.
    pub piece: u32,
}

/// The pairs of neighbouring pixels, side by side or one below the other, that show two pieces of one object. `shown`:
/// one per pixel, rows of `width` from the top; `None` where there is no object.
pub fn piece_borders(shown: &[Option<Shown>], width: usize) -> Vec<[usize; 2]> {
    let meet = |&[first, second]: &[usize; 2]| match (shown[first], shown.get(second).copied().flatten()) {
        (Some(a), Some(b)) => a.object == b.object && a.piece != b.piece,
        _ => false,
    };
    let right = |pixel: usize| (!(pixel + 1).is_multiple_of(width)).then_some([pixel, pixel + 1]);
    (0..shown.len()).flat_map(|pixel| [right(pixel), Some([pixel, pixel + width])]).flatten().filter(meet).collect()
}

/// Change of the error from one piece of an object to the next. Over the pairs of pixels `borders` ([`piece_borders`]):
/// the 99.9th percentile (nearest rank) of |(L − L_ref) − (L − L_ref)'| over the mean of L_ref, that mean as of
/// [`luminance_error`]. An edge that the reference has, too, does not count. 0 without pairs.
///
/// # Panics
/// If a pair is of pixels that are not there.
pub fn seams(reference: &[f32], other: &[f32], counted: &[bool], borders: &[[usize; 2]]) -> f64 {
    let mean_reference = mean_luminance(reference, counted);
    let error = |pixel: usize| f64::from(other[pixel]) - f64::from(reference[pixel]);
    let step = |&[first, second]: &[usize; 2]| relative(error(second) - error(first), mean_reference);
    let mut steps: Vec<f64> = borders.iter().map(step).collect();
    steps.sort_by(f64::total_cmp);
    percentile(&steps, 999)
}

/// The mean over the pixels that count; 0 if none does.
pub fn mean_luminance(luminances: &[f32], counted: &[bool]) -> f64 {
    let counting = luminances.iter().zip(counted).filter(|(_, counts)| **counts);
    let (sum, count) = counting.fold((0.0, 0u64), |(sum, count), (&l, _)| (sum + f64::from(l), count + 1));
    sum / count.max(1) as f64
}

/// The 2 × 2 parts of each pixel of a picture that was drawn twice as large, of so many pixels' width.
pub fn quarters<T: Clone>(parts: &[T], width: u32) -> impl Iterator<Item = [T; 4]> {
    let row = 2 * width as usize;
    parts.chunks_exact((2 * row).max(1)).flat_map(move |rows| {
        let (above, below) = rows.split_at(row);
        let pairs = above.chunks_exact(2).zip(below.chunks_exact(2));
        pairs.map(|(a, b)| [a[0].clone(), a[1].clone(), b[0].clone(), b[1].clone()])
    })
}

/// Mean LDR-FLIP of two 8-bit sRGB pictures at [`PIXELS_PER_DEGREE`]: 0 for equal pictures, up to 1. What a viewer
/// notices who flips between the two, from colours blurred as the eye blurs them, edges and points (Andersson,
/// Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild: "FLIP: A Difference Evaluator for Alternating Images",
/// HPG 2020). The figure is that of the authors' tool.
///
/// # Errors
/// [`CompareError`].
pub fn flip(reference: &RgbImage, other: &RgbImage) -> Result<f64, CompareError> {
    let (width, height) = reference.dimensions();
    check_size((width, height))?;
    let sizes = CompareError::Sizes(width, height, other.width(), other.height());
    let picture =
        |of: &RgbImage| flip_rs::RgbImage::new(of.width() as usize, of.height() as usize, of.as_raw().clone());
    let map = picture(reference)
        .and_then(|reference| flip_rs::ldr_flip(&reference, &picture(other)?, PIXELS_PER_DEGREE))
        .map_err(|_| sizes)?;
    Ok(map.pixels().iter().copied().map(f64::from).sum::<f64>() / map.pixels().len() as f64)
}

/// Checks that pictures of this size can be compared; to be asked before they are made.
///
/// # Errors
/// [`CompareError::TooLarge`].
pub fn check_size((width, height): (u32, u32)) -> Result<(), CompareError> {
    let fits = u64::from(width) * u64::from(height) <= MOST_PIXELS;
    if fits { Ok(()) } else { Err(CompareError::TooLarge { width, height }) }
}

/// Values as colours from 0 black over violet and orange to 1 and above, pale yellow: the map Magma of Matplotlib.
/// `None` if there are not width · height values.
pub fn heat_map(values: &[f32], width: u32, height: u32) -> Option<RgbImage> {
    let color = |&value: &f32| {
        let step = (value.clamp(0.0, 1.0) * 255.0).round() as usize;
        flip_rs::MAGMA[step].map(|channel| (channel * 255.0).round() as u8)
    };
    RgbImage::from_raw(width, height, values.iter().flat_map(color).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn luminance_error_is_relative_to_the_mean_of_the_reference() {
        // The last pixel does not count; the mean of the reference is 2.
        let error = luminance_error(&[1.0, 3.0, 2.0, 100.0], &[1.0, 2.0, 4.0, 0.0], &[true, true, true, false]);
        assert_eq!(error.of_pixels, [0.0, 0.5, 1.0, 0.0]);
        assert_eq!((error.mean, error.p99), (0.5, 1.0));
        // Of 200 pixels, two are far off: 99 % are not.
        let other: Vec<f32> = (0..200).map(|i| if i < 2 { 9.0 } else { 1.5 }).collect();
        let error = luminance_error(&[1.0; 200], &other, &[true; 200]);
        assert_eq!(error.p99, 0.5);
        assert!((error.mean - (2.0 * 8.0 + 198.0 * 0.5) / 200.0).abs() < 1e-9);
        let three = luminance_error(&[1.0; 200], &[&[9.0][..], &other[..199]].concat(), &[true; 200]);
        assert_eq!(three.p99, 8.0);
    }

    #[test]
    fn black_references_and_pictures_without_objects_are_sane() {
        assert_eq!(luminance_error(&[0.0; 2], &[0.0; 2], &[true; 2]).mean, 0.0);
        assert_eq!(luminance_error(&[0.0; 2], &[0.0, 1.0], &[true; 2]).p99, f64::INFINITY);
        let none = luminance_error(&[1.0; 2], &[0.0, 1.0], &[false; 2]);
        assert_eq!((none.mean, none.p99, none.of_pixels), (0.0, 0.0, vec![0.0; 2]));
        assert_eq!(luminance_error(&[], &[], &[]).mean, 0.0);
        assert_eq!(luminance([f32::NAN, 0.0, 0.0, 1.0]), 65504.0);
    }

    #[test]
    fn pieces_of_one_object_meet_side_by_side_and_one_below_the_other() {
        let of = |object, piece| Some(Shown { object, piece });
        let (a, b, c, other) = (of(1, 10), of(1, 11), of(1, 12), of(2, 20));
        // The end of a row is no neighbour of the next row's start: b and a of the second row are.
        let shown = [[a, a, b], [a, other, b], [c, None, a]];
        let borders = piece_borders(shown.as_flattened(), 3);
        assert_eq!(borders, [[1, 2], [3, 6], [5, 8]]);
        assert!(piece_borders(&[a, other, None, None, other, a], 2).is_empty(), "other objects, and nothing");
        assert_eq!(piece_borders(&[a, b, a], 1), [[0, 1], [1, 2]], "one column");
        assert_eq!(piece_borders(&[a, b, a], 3), [[0, 1], [1, 2]], "one row");
        assert!(piece_borders(&[], 0).is_empty());
    }

    #[test]
    fn seams_are_steps_of_the_error_at_borders() {
        // Of mean 2 where pixels count. Errors: 0, 1, 1, −1, and one that does not count.
        let (reference, counted) = ([1.0, 4.0, 2.0, 1.0, 9.0], [true, true, true, true, false]);
        let other = [1.0, 5.0, 3.0, 0.0, 0.0];
        let of = |borders: &[[usize; 2]]| seams(&reference, &other, &counted, borders);
        assert_eq!(of(&[]), 0.0);
        assert_eq!(of(&[[0, 1]]), 0.5);
        assert_eq!(of(&[[1, 2]]), 0.0, "an edge of the reference is no seam");
        assert_eq!(of(&[[2, 3]]), 1.0, "upwards and downwards");
        assert_eq!(of(&[[3, 2], [0, 1], [1, 2]]), 1.0);
        assert_eq!(seams(&reference, &reference, &counted, &[[0, 1], [2, 3]]), 0.0);
        // Of 2,000 pairs, two are far off: 99.9 % are not.
        let pairs = |far: usize| [vec![[2, 3]; far], vec![[0, 1]; 2000 - far]].concat();
        assert_eq!((of(&pairs(2)), of(&pairs(3))), (0.5, 1.0));
        // A black reference.
        assert_eq!(seams(&[0.0; 2], &[1.0; 2], &[true; 2], &[[0, 1]]), 0.0);
        assert_eq!(seams(&[0.0; 2], &[0.0, 1.0], &[true; 2], &[[0, 1]]), f64::INFINITY);
    }

    fn picture(color: impl Fn(u32, u32, u32) -> u32) -> RgbImage {
        RgbImage::from_fn(48, 32, |x, y| image::Rgb([0, 1, 2].map(|channel| color(x, y, channel) as u8)))
    }

    /// The figures are the means of the maps that NVIDIA's flip-evaluator 1.7 gives for the same pictures.
    #[test]
    fn flip_gives_the_figures_of_its_authors_tool() {
        let ramps = |x: u32, y: u32, channel: u32| (x * 5 + y * 3 + channel * 40) % 256;
        let in_square = |x, y| (16..32).contains(&x) && (8..24).contains(&y);
        let square = |x, y, channel| if channel == 0 && in_square(x, y) { 200 } else { 60 };
        let cases = [
            (picture(|_, _, _| 0), picture(|_, _, _| 255), 0.967_388_33),
            (picture(ramps), picture(|x, y, channel| (ramps(x, y, channel) + 16).min(255)), 0.292_622_27),
            (picture(|_, _, _| 60), picture(square), 0.206_718_67),
            (picture(ramps), picture(|x, y, channel| ramps(x + 1, y, channel)), 0.247_922_39),
        ];
        for (a, b, known) in cases {
            let found = flip(&a, &b).expect("equal sizes");
            assert!((found - known).abs() < 1e-6, "{found} {known}");
            assert!((flip(&b, &a).expect("equal sizes") - known).abs() < 1e-6);
            assert_eq!(flip(&a, &a).expect("equal sizes"), 0.0);
        }
        let grey = |value| picture(move |_, _, _| value);
        let steps: Vec<f64> = (0..8).map(|i| flip(&grey(60), &grey(60 + i * 24)).expect("equal sizes")).collect();
        assert!(steps.windows(2).all(|pair| pair[0] < pair[1]), "{steps:?}");
    }

    #[test]
    fn pictures_of_other_sizes_are_refused() {
        let (a, b) = (RgbImage::new(4, 4), RgbImage::new(4, 5));
        assert_eq!(flip(&a, &b).unwrap_err().to_string(), "pictures of 4x4 and 4x5 pixels cannot be compared");
        assert!(flip(&RgbImage::new(0, 4), &RgbImage::new(0, 4)).is_err());
        assert!(check_size((4096, 4096)).is_ok());
        assert!(matches!(check_size((4097, 4096)), Err(CompareError::TooLarge { .. })));
    }

    #[test]
    fn the_heat_map_goes_from_black_to_pale() {
        let heat = heat_map(&[0.0, 0.5, 1.0, f32::INFINITY], 2, 2).expect("four values");
        let sums = heat.pixels().map(|p| p.0.iter().map(|&c| u32::from(c)).sum::<u32>()).collect::<Vec<_>>();
        assert!(sums[0] < 10 && sums[0] < sums[1] && sums[1] < sums[2] && sums[2] > 600, "{sums:?}");
        assert_eq!(sums[2], sums[3]);
        assert!(heat_map(&[0.0; 3], 2, 2).is_none());
    }
}
