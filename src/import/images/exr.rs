//! OpenEXR files: red, green and blue with or without alpha, as the image crate reads them, or one channel of any name.
//!
//! A file holds the texels of its data window, and is an image of its display window: 0 where it has no texels, and
//! without those that lie outside.

use super::unfit::{self, Unfit};
use exr::meta::MetaData;
use exr::meta::header::Header;
use exr::prelude::{FlatSamples, ReadChannels, ReadLayers, f16, read};
use image::{DynamicImage, ImageFormat, Rgb32FImage, Rgba32FImage};
use std::io::Cursor;

/// Kind of the channels that are read.
enum Content {
    Color,
    /// One channel, or one and alpha.
    Grey,
}

fn refused(message: impl Into<String>) -> Unfit {
    Unfit::Damaged(message.into())
}

fn damaged(error: exr::error::Error) -> Unfit {
    refused(format!("the OpenEXR cannot be decoded: {error}"))
}

/// Width and height in texels, by the header alone: of what is decoded or of what is made of it, the larger.
pub fn size(bytes: &[u8]) -> Result<(usize, usize), Unfit> {
    let (header, _) = content(bytes)?;
    let window = header.shared_attributes.display_window.size;
    Ok((window.0.max(header.layer_size.0), window.1.max(header.layer_size.1)))
}

/// The layer that is read, and what is in it.
fn content(bytes: &[u8]) -> Result<(Header, Content), Unfit> {
    let headers = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(damaged)?.headers;
    let has = |header: &Header, name: &str| header.channels.list.iter().any(|channel| channel.name.eq(name));
    let color = |header: &&Header| !header.deep && ["R", "G", "B"].into_iter().all(|name| has(header, name));
    let (header, content) = match headers.iter().find(color) {
        Some(header) => (header, Content::Color),
        None => (grey(&headers)?, Content::Grey),
    };
    let ((x, y), window) = (offset(header), header.shared_attributes.display_window.size);
    let apart = |at: i64, data: usize, shown: usize| at >= shown as i64 || at + data as i64 <= 0;
    if apart(x, header.layer_size.0, window.0) || apart(y, header.layer_size.1, window.1) {
        return Err(refused("the OpenEXR has no texels to show: its data window lies outside its display window"));
    }
    Ok((header.clone(), content))
}

fn grey(headers: &[Header]) -> Result<&Header, Unfit> {
    let first = headers.first().ok_or_else(|| refused("expected a layer in the OpenEXR"))?;
    if first.deep {
        return Err(refused("deep OpenEXR is not read: several values in a texel"));
    }
    let names: Vec<String> = first.channels.list.iter().map(|channel| channel.name.to_string()).collect();
    match names.as_slice() {
        [_] => Ok(first),
        [a, _] | [_, a] if a == "A" => Ok(first),
        _ => {
            let message = "expected an OpenEXR with the channels R, G and B, with or without A, or a single one; found";
            Err(refused(format!("{message} {}", names.join(", "))))
        }
    }
}

/// Offset of the data window in the display window, pixels.
fn offset(header: &Header) -> (i64, i64) {
    let (data, shown) = (header.own_attributes.layer_position, header.shared_attributes.display_window.position);
    (i64::from(data.0) - i64::from(shown.0), i64::from(data.1) - i64::from(shown.1))
}

/// Decodes a file whose size has been found to be within bounds.
pub fn decode(bytes: &[u8]) -> Result<DynamicImage, Unfit> {
    let (header, content) = content(bytes)?;
    if let Content::Color = content {
        let image = image::load_from_memory_with_format(bytes, ImageFormat::OpenExr);
        return image.map_err(|error| unfit::damaged(ImageFormat::OpenExr, &error));
    }
    let reader = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let layer = reader.from_buffered(Cursor::new(bytes)).map_err(damaged)?.layer_data;
    let (mut grey, mut alpha) = (Vec::new(), None);
    let channels = layer.channel_data.list;
    let only = channels.len() == 1;
    for channel in channels {
        let values = match channel.sample_data {
            FlatSamples::F16(values) => values.into_iter().map(f16::to_f32).collect(),
            FlatSamples::F32(values) => values,
            FlatSamples::U32(values) => values.into_iter().map(|v| v as f32).collect(),
        };
        if values.len() != layer.size.area() {
            return Err(refused("a channel of the OpenEXR has fewer values than the image has texels"));
        }
        let values = shown(&values, &header);
        if channel.name.eq("A") && !only { alpha = Some(values) } else { grey = values }
    }
    let size = header.shared_attributes.display_window.size;
    let (width, height) = (size.0 as u32, size.1 as u32);
    let image = match alpha {
        None => Rgb32FImage::from_raw(width, height, grey.into_iter().flat_map(|v| [v; 3]).collect()).map(Into::into),
        Some(alpha) => {
            let texels = grey.into_iter().zip(alpha).flat_map(|(v, a)| [v, v, v, a]).collect();
            Rgba32FImage::from_raw(width, height, texels).map(Into::into)
        }
    };
    image.ok_or_else(|| refused("the OpenEXR has no texels"))
}

/// Crops a channel of the data window to the display window, which it meets; 0 elsewhere.
fn shown(values: &[f32], header: &Header) -> Vec<f32> {
    let ((x, y), window) = (offset(header), header.shared_attributes.display_window.size);
    let mut shown = vec![0.0; window.area()];
    let (skipped, first) = ((-x).max(0) as usize, x.max(0) as usize);
    for (row, values) in values.chunks_exact(header.layer_size.0).enumerate() {
        let Some(row) = usize::try_from(row as i64 + y).ok().filter(|&row| row < window.1) else { continue };
        let targets = shown[row * window.0..][..window.0].iter_mut().skip(first);
        targets.zip(values.iter().skip(skipped)).for_each(|(target, value)| *target = *value);
    }
    shown
}
