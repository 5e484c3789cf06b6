//! Frames into an animated picture that needs no other program: APNG or GIF.
//!
//! APNG keeps every pixel as it is; GIF has 256 colours per frame, which shows in the gradients of a night sky, and is
//! read everywhere. Both hold of a frame only the rectangle that differs from the one before, and of that only the
//! pixels that do: the rest is transparent.

use crate::frame_time::{FrameTime, Shown, Ticks};
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

    /// Durations of a frame that the format can express; APNG has fractions of two 16-bit numbers.
    fn ticks(self, time: FrameTime) -> Ticks {
        let longest = u64::from(u16::MAX);
        match self {
            Self::Gif => Ticks { per_second: 100, shortest: SHORTEST_DELAY, longest },
            Self::Apng if time.numerator.max(time.denominator) <= longest => {
                Ticks { per_second: time.denominator, shortest: 1, longest }
            }
            // As fine as leaves room for a frame.
            Self::Apng => {
                Ticks { per_second: (longest as f64 / time.seconds().ceil()).max(1.0) as u64, shortest: 1, longest }
            }
        }
    }

    /// Deviations of the film from its frames' times, in words: limits of the format, or of what shows it.
    pub fn shortcomings(self, frames: Range<u64>, time: FrameTime) -> Vec<String> {
        let count = frames.end - frames.start;
        let ticks = self.ticks(time);
        let mut shown = ticks.of_frames(frames, time);
        let total: u64 = shown.iter().map(|picture| picture.ticks).sum();
        shown.dedup_by_key(|picture| picture.frame);
        let (left_out, exact) = (count - shown.len() as u64, count as f64 * time.seconds());
        let made = total as f64 / ticks.per_second as f64;
        let name = match self {
            Self::Apng => "an APNG",
            Self::Gif => "a GIF",
        };
        let mut said = Vec::new();
        if left_out > 0 {
            let (shortest, per_second) = (ticks.shortest, ticks.per_second);
            said.push(format!(
                "{left_out} of {count} frames are dropped: {name} shows a frame for at least {shortest}/{per_second} s"
            ));
        } else if self == Self::Gif && !(100 * time.numerator).is_multiple_of(time.denominator) {
            said.push(format!(
                "{name} counts hundredths of a second: not every frame lasts {time}; the total is {made} s \
                 for {exact:.4} s"
            ));
        }
        if self == Self::Apng && time.seconds() <= SLOWED_DOWN {
            said.push(format!(
                "browsers show frames of {SLOWED_DOWN} s and less for longer; frames of this film last {time}"
            ));
        }
        said
    }
}

/// Seconds; browsers take a frame of this or less for a mistake.
const SLOWED_DOWN: f64 = 0.01;

/// Writes `folder/color_NNNNN.png` of those frames, whole or not at all. It repeats for ever.
///
/// # Errors
/// [`OutputError`]; frames that cannot be read are among them.
pub fn encode(
    path: &Path,
    kind: Animation,
    folder: &Path,
    frames: Range<u64>,
    time: FrameTime,
) -> std::result::Result<(), OutputError> {
    let ticks = kind.ticks(time);
    let shown = ticks.of_frames(frames, time);
    output::write_whole_with(path, |file| {
        let picture = |frame: u64| {
            let path = folder.join(format!("color_{frame:05}.png"));
            crate::import::load_pixels(&path).map(|picture| picture.into_rgb8()).map_err(Error::other)
        };
        match kind {
            Animation::Apng => write_apng(file, &shown, ticks, picture),
            Animation::Gif => write_gif(file, &shown, picture),
        }
    })
}

/// Rectangle of a frame that differs from the one before.
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

fn write_apng(file: &mut File, shown: &[Shown], ticks: Ticks, picture: impl Fn(u64) -> Result<RgbImage>) -> Result<()> {
    let [first, others @ ..] = shown else { return Err(Error::other("no frames")) };
    let per_second = delay(ticks.per_second)?;
    let mut before = picture(first.frame)?;
    let mut encoder = png::Encoder::new(BufWriter::new(file), before.width(), before.height());
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Balanced);
    encoder.set_animated(u32::try_from(shown.len()).map_err(Error::other)?, 0)?;
    encoder.set_frame_delay(delay(first.ticks)?, per_second)?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&Delta::between(None, &before).rgba)?;
    for &Shown { frame, ticks } in others {
        let now = same_size(picture(frame)?, &before)?;
        let delta = Delta::between(Some(&before), &now);
        // Back to the corner first: size and place are checked one by one.
        writer.reset_frame_position()?;
        writer.set_frame_dimension(delta.width, delta.height)?;
        writer.set_frame_position(delta.x, delta.y)?;
        writer.set_blend_op(png::BlendOp::Over)?;
        writer.set_frame_delay(delay(ticks)?, per_second)?;
        writer.write_image_data(&delta.rgba)?;
        before = now;
    }
    Ok(writer.finish()?)
}

/// Both formats have 16 bits for it.
fn delay(ticks: u64) -> Result<u16> {
    u16::try_from(ticks).map_err(Error::other)
}

/// Hundredths of a second; viewers take less than this for a mistake and slow down.
const SHORTEST_DELAY: u64 = 2;

/// Preference of speed over quality when colours are chosen: 1 slow to 30 fast.
const COLOR_SPEED: i32 = 10;

fn write_gif(file: &mut File, shown: &[Shown], picture: impl Fn(u64) -> Result<RgbImage>) -> Result<()> {
    let Some(Shown { frame, .. }) = shown.first() else { return Err(Error::other("no frames")) };
    let first = picture(*frame)?;
    let side = |side: u32| u16::try_from(side).map_err(Error::other);
    let (width, height) = (side(first.width())?, side(first.height())?);
    let mut encoder = gif::Encoder::new(BufWriter::new(file), width, height, &[]).map_err(Error::other)?;
    encoder.set_repeat(gif::Repeat::Infinite).map_err(Error::other)?;
    let mut before: Option<RgbImage> = None;
    for &Shown { frame, ticks } in shown {
        let now = same_size(picture(frame)?, &first)?;
        let mut delta = Delta::between(before.as_ref(), &now);
        let (width, height) = (side(delta.width)?, side(delta.height)?);
        let mut part = gif::Frame::from_rgba_speed(width, height, &mut delta.rgba, COLOR_SPEED);
        (part.left, part.top) = (side(delta.x)?, side(delta.y)?);
        part.delay = delay(ticks)?;
        part.dispose = gif::DisposalMethod::Keep;
        encoder.write_frame(&part).map_err(Error::other)?;
        before = Some(now);
    }
    encoder.get_mut().flush()
}

/// Frames of an earlier run may be of another size.
fn same_size(picture: RgbImage, first: &RgbImage) -> Result<RgbImage> {
    if picture.dimensions() == first.dimensions() {
        return Ok(picture);
    }
    Err(Error::other("frames differ in size"))
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
        encode(&path, Animation::Apng, folder.path(), 2..10, FrameTime::of(0.02)).expect("a film");
        let file = BufReader::new(File::open(&path).expect("there"));
        let frames = PngDecoder::new(file).and_then(|decoder| decoder.apng()).expect("an animation").into_frames();
        let frames = frames.collect_frames().expect("all");
        assert_eq!(frames.len(), 8);
        for (i, seen) in (2..).zip(&frames) {
            let (numerator, denominator) = seen.delay().numer_denom_ms();
            assert_eq!(numerator, 20 * denominator, "milliseconds");
            assert!(image::DynamicImage::from(seen.buffer().clone()).into_rgb8() == frame(i), "frame {i}");
        }
    }

    /// Numerators and denominators of the delays of an APNG's `fcTL` chunks (PNG specification, third edition,
    /// 11.3.6.2).
    fn delays_of(path: &Path) -> Vec<(u16, u16)> {
        let bytes = std::fs::read(path).expect("there");
        let chunks = bytes.windows(4).enumerate().filter(|(_, name)| *name == b"fcTL");
        let number = |at: usize| u16::from_be_bytes([bytes[at], bytes[at + 1]]);
        chunks.map(|(at, _)| (number(at + 24), number(at + 26))).collect()
    }

    #[test]
    fn an_animated_png_is_exact_where_it_can_be_and_else_ends_at_its_time() {
        let folder = folder();
        let path = folder.path().join("film.apng");
        let delays = |seconds: f64| {
            encode(&path, Animation::Apng, folder.path(), 2..10, FrameTime::of(seconds)).expect("a film");
            delays_of(&path)
        };
        for (seconds, expected) in [
            (1.0 / 60.0, (1, 60)),
            (1.0 / 144.0, (1, 144)),
            (0.0004, (1, 2500)),
            (100.0, (100, 1)),
            (1000.0, (1000, 1)),
        ] {
            assert_eq!(delays(seconds), [expected; 8], "{seconds}");
        }
        // Not fractions of 16-bit numbers: the end of 8 frames is the nearest tick to their time.
        for seconds in [0.016_666_7, 1.234_567, 999.999_99] {
            let found = delays(seconds);
            let per_second = f64::from(found[0].1);
            let total: f64 = found.iter().map(|(ticks, _)| f64::from(*ticks) / per_second).sum();
            assert!((total - 8.0 * seconds).abs() <= 0.5001 / per_second, "{seconds}: {found:?}");
        }
        // Frames of a microsecond, of which a tick has 15: one remains.
        assert_eq!(delays(1e-6), [(1, 65_535)]);
    }

    #[test]
    fn what_a_format_cannot_show_is_said() {
        let said = |kind: Animation, seconds| kind.shortcomings(0..60, FrameTime::of(seconds)).join("; ");
        for (kind, seconds) in [(Animation::Apng, 1.0 / 60.0), (Animation::Apng, 100.0), (Animation::Gif, 0.04)] {
            assert_eq!(said(kind, seconds), "");
        }
        let gif = said(Animation::Gif, 1.0 / 60.0);
        assert!(gif.contains("of 60 frames are dropped: a GIF shows a frame for at least 2/100 s"), "{gif}");
        assert!(said(Animation::Gif, 1.0 / 30.0).contains("not every frame lasts 1/30 s; the total is 2 s"));
        assert!(said(Animation::Apng, 0.0004).contains("frames of this film last 1/2500 s"));
        assert!(said(Animation::Apng, 1e-6).contains("56 of 60 frames are dropped"));
    }

    #[test]
    fn a_gif_takes_as_long_as_its_frames_though_it_leaves_some_out() {
        let folder = folder();
        let path = folder.path().join("film.gif");
        encode(&path, Animation::Gif, folder.path(), 2..10, FrameTime::of(0.01)).expect("a film");
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
        let error = encode(&path, Animation::Apng, folder.path(), 2..11, FrameTime::of(0.02))
            .expect_err("no frame 10")
            .to_string();
        assert!(error.contains("color_00010.png"), "{error}");
        let left = std::fs::read_dir(folder.path()).expect("a folder").count();
        assert_eq!(left, 8, "the frames alone");
    }
}
