//! Frames into an animated picture that needs no other program: APNG or GIF.
//!
//! APNG keeps every pixel as it is; GIF has 256 colours per frame, which shows in the gradients of a night sky, and is
//! read everywhere. Both hold of a frame only the rectangle that differs from the one before, and of that only the
//! pixels that do: the rest is transparent.

use crate::output::{self, OutputError};
use image::RgbImage;
use std::fs::File;
use std::io::{BufWriter, Error, Result, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A form of animated pictures.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Animation {
    /// PNG with more frames than one.
    Apng,
    /// GIF 89a.
    Gif,
}

impl Animation {
    /// The one that a file's name asks for.
    pub fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_string_lossy().to_lowercase();
        match extension.as_str() {
            "apng" | "png" => Some(Self::Apng),
            "gif" => Some(Self::Gif),
            _ => None,
        }
    }
}

/// Writes `folder/color_NNNNN.png` of those frames, whole or not at all. It repeats for ever.
///
/// # Errors
/// [`OutputError`]; frames that cannot be read are among them.
pub fn encode(
    path: &Path,
    kind: Animation,
    folder: &Path,
    frames: Range<u64>,
    frames_per_second: f64,
) -> std::result::Result<(), OutputError> {
    output::write_whole_with(path, |file| {
        let picture = |frame: u64| {
            let path = folder.join(format!("color_{frame:05}.png"));
            crate::import::load_pixels(&path).map(|picture| picture.into_rgb8()).map_err(Error::other)
        };
        match kind {
            Animation::Apng => write_apng(file, frames, frames_per_second, picture),
            Animation::Gif => write_gif(file, frames, frames_per_second, picture),
        }
    })
}

/// What a frame shows that the one before did not.
struct Delta {
    x: u32,
    y: u32,
    width: u32,
    height: u32,
    /// Transparent where nothing changed.
    rgba: Vec<u8>,
}

impl Delta {
    /// Without a frame before: everything. Nothing new: one transparent pixel, for a frame has at least one.
    fn between(before: Option<&RgbImage>, now: &RgbImage) -> Self {
        let is_new = |x: u32, y: u32| before.is_none_or(|before| before.get_pixel(x, y) != now.get_pixel(x, y));
        let (mut left, mut top, mut right, mut bottom) = (u32::MAX, u32::MAX, 0, 0);
        for (x, y, _) in now.enumerate_pixels().filter(|(x, y, _)| is_new(*x, *y)) {
            (left, top, right, bottom) = (left.min(x), top.min(y), right.max(x), bottom.max(y));
        }
        if left == u32::MAX {
            (left, top) = (0, 0);
        }
        let (width, height) = (right - left + 1, bottom - top + 1);
        let mut rgba = Vec::with_capacity(width as usize * height as usize * 4);
        for y in top..=bottom {
            for x in left..=right {
                let [r, g, b] = now.get_pixel(x, y).0;
                rgba.extend(if is_new(x, y) { [r, g, b, 255] } else { [0; 4] });
            }
        }
        Self { x: left, y: top, width, height, rgba }
    }
}

fn write_apng(file: &mut File, frames: Range<u64>, rate: f64, picture: impl Fn(u64) -> Result<RgbImage>) -> Result<()> {
    let count = u32::try_from(frames.end - frames.start).map_err(Error::other)?;
    let mut before = picture(frames.start)?;
    let mut encoder = png::Encoder::new(BufWriter::new(file), before.width(), before.height());
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Balanced);
    encoder.set_animated(count, 0)?;
    // Milliseconds are the finest that all viewers keep.
    encoder.set_frame_delay((1000.0 / rate).round().clamp(1.0, 60_000.0) as u16, 1000)?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&Delta::between(None, &before).rgba)?;
    for frame in frames.skip(1) {
        let now = same_size(picture(frame)?, &before)?;
        let delta = Delta::between(Some(&before), &now);
        // Back to the corner first: size and place are checked one by one.
        writer.reset_frame_position()?;
        writer.set_frame_dimension(delta.width, delta.height)?;
        writer.set_frame_position(delta.x, delta.y)?;
        writer.set_blend_op(png::BlendOp::Over)?;
        writer.write_image_data(&delta.rgba)?;
        before = now;
    }
    Ok(writer.finish()?)
}

/// Hundredths of a second; viewers take less than this for a mistake and slow down.
const SHORTEST_DELAY: u64 = 2;

/// How much speed goes before quality when colours are chosen: 1 slow to 30 fast.
const COLOR_SPEED: i32 = 10;

fn write_gif(file: &mut File, frames: Range<u64>, rate: f64, picture: impl Fn(u64) -> Result<RgbImage>) -> Result<()> {
    let first = picture(frames.start)?;
    let side = |side: u32| u16::try_from(side).map_err(Error::other);
    let (width, height) = (side(first.width())?, side(first.height())?);
    let mut encoder = gif::Encoder::new(BufWriter::new(file), width, height, &[]).map_err(Error::other)?;
    encoder.set_repeat(gif::Repeat::Infinite).map_err(Error::other)?;
    let time_of = |frame: u64| ((frame - frames.start) as f64 * 100.0 / rate).round() as u64;
    let mut before: Option<RgbImage> = None;
    let mut frame = frames.start;
    while frame < frames.end {
        // Frames that come too fast for the format are left out.
        let next = (frame + 1..frames.end).find(|&next| time_of(next) - time_of(frame) >= SHORTEST_DELAY);
        let next = next.unwrap_or(frames.end);
        let now = same_size(picture(frame)?, &first)?;
        let mut delta = Delta::between(before.as_ref(), &now);
        let (width, height) = (side(delta.width)?, side(delta.height)?);
        let mut part = gif::Frame::from_rgba_speed(width, height, &mut delta.rgba, COLOR_SPEED);
        (part.left, part.top) = (side(delta.x)?, side(delta.y)?);
        part.delay = (time_of(next) - time_of(frame)).clamp(SHORTEST_DELAY, 6000) as u16;
        part.dispose = gif::DisposalMethod::Keep;
        encoder.write_frame(&part).map_err(Error::other)?;
        before = Some(now);
        frame = next;
    }
    encoder.get_mut().flush()
}

/// Frames of an earlier run may be of another size.
fn same_size(picture: RgbImage, first: &RgbImage) -> Result<RgbImage> {
    if picture.dimensions() == first.dimensions() {
        return Ok(picture);
    }
    Err(Error::other("its frames differ in size"))
}

/// Beside a film that cannot be made: the same name as an animated PNG.
pub fn instead_of(film: &Path) -> PathBuf {
    film.with_extension("apng")
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::AnimationDecoder;
    use image::codecs::png::PngDecoder;
    use std::io::BufReader;

    /// A block that moves over a gradient, then stands.
    fn frame(i: u64) -> RgbImage {
        let at = (i as u32 * 3).min(12);
        RgbImage::from_fn(24, 16, |x, y| {
            let inside = (at..at + 5).contains(&x) && (4..9).contains(&y);
            image::Rgb(if inside { [250, 20, 10] } else { [x as u8 * 10, y as u8 * 10, 30] })
        })
    }

    fn folder() -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a temporary folder");
        (2..10).for_each(|i| frame(i).save(folder.path().join(format!("color_{i:05}.png"))).expect("a frame"));
        folder
    }

    #[test]
    fn an_animated_png_has_every_pixel_of_every_frame() {
        let folder = folder();
        let path = folder.path().join("film.apng");
        encode(&path, Animation::Apng, folder.path(), 2..10, 50.0).expect("a film");
        let file = BufReader::new(File::open(&path).expect("there"));
        let frames = PngDecoder::new(file).and_then(|decoder| decoder.apng()).expect("an animation").into_frames();
        let frames = frames.collect_frames().expect("all");
        assert_eq!(frames.len(), 8);
        for (i, seen) in (2..).zip(&frames) {
            assert_eq!(seen.delay().numer_denom_ms(), (20, 1));
            assert!(image::DynamicImage::from(seen.buffer().clone()).into_rgb8() == frame(i), "frame {i}");
        }
    }

    #[test]
    fn a_gif_takes_as_long_as_its_frames_though_it_leaves_some_out() {
        let folder = folder();
        let path = folder.path().join("film.gif");
        encode(&path, Animation::Gif, folder.path(), 2..10, 100.0).expect("a film");
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let mut decoder = options.read_info(File::open(&path).expect("there")).expect("a GIF");
        let (mut canvas, mut delays) = (frame(2), Vec::new());
        while let Some(part) = decoder.read_next_frame().expect("sound") {
            delays.push(part.delay);
            for (i, pixel) in part.buffer.chunks_exact(4).enumerate().filter(|(_, pixel)| pixel[3] > 0) {
                let (x, y) = (i as u32 % u32::from(part.width), i as u32 / u32::from(part.width));
                let at = canvas.get_pixel_mut(x + u32::from(part.left), y + u32::from(part.top));
                at.0.copy_from_slice(&pixel[..3]);
            }
        }
        assert_eq!(delays, [2; 4]);
        // 256 colours are not all colours.
        let last = frame(8);
        let differences = canvas.iter().zip(last.iter()).map(|(a, b)| u32::from(a.abs_diff(*b)));
        let mean = differences.sum::<u32>() as f32 / canvas.len() as f32;
        assert!(mean < 10.0, "{mean}");
    }

    #[test]
    fn a_missing_frame_leaves_nothing_behind() {
        let folder = folder();
        let path = folder.path().join("film.apng");
        let error = encode(&path, Animation::Apng, folder.path(), 2..11, 50.0).expect_err("no frame 10").to_string();
        assert!(error.contains("color_00010.png"), "{error}");
        let left = std::fs::read_dir(folder.path()).expect("a folder").count();
        assert_eq!(left, 8, "the frames alone");
    }
}
