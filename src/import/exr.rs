//! OpenEXR files: red, green and blue with or without alpha, as the image crate reads them, or one channel of any name.

use super::image::Unfit;
use exr::meta::MetaData;
use exr::meta::header::Header;
use exr::prelude::{FlatSamples, ReadChannels, ReadLayers, f16, read};
use image::{DynamicImage, ImageFormat, Rgb32FImage, Rgba32FImage};
use std::io::Cursor;

/// What a file has that is read.
enum Content {
    Color,
    /// One channel, or one and alpha.
    Grey,
}

fn damaged(error: impl std::fmt::Display) -> Unfit {
    Unfit::Damaged(error.to_string())
}

/// Width and height in texels, by the header alone.
pub fn size(bytes: &[u8]) -> Result<(usize, usize), Unfit> {
    let (header, content) = content(bytes)?;
    let size = match content {
        // The image crate makes an image of the whole window.
        Content::Color => {
            let window = header.shared_attributes.display_window.size;
            (window.0.max(header.layer_size.0), window.1.max(header.layer_size.1))
        }
        Content::Grey => (header.layer_size.0, header.layer_size.1),
    };
    Ok(size)
}

/// The layer that is read, and what is in it.
fn content(bytes: &[u8]) -> Result<(Header, Content), Unfit> {
    let headers = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(damaged)?.headers;
    let has = |header: &Header, name: &str| header.channels.list.iter().any(|channel| channel.name.eq(name));
    let color = |header: &&Header| !header.deep && ["R", "G", "B"].into_iter().all(|name| has(header, name));
    if let Some(header) = headers.iter().find(color) {
        return Ok((header.clone(), Content::Color));
    }
    let Some(first) = headers.into_iter().next() else { return Err(damaged("expected a layer")) };
    if first.deep {
        return Err(damaged("deep OpenEXR is not read: several values in a texel"));
    }
    let names: Vec<String> = first.channels.list.iter().map(|channel| channel.name.to_string()).collect();
    match names.as_slice() {
        [_] => Ok((first, Content::Grey)),
        [a, _] | [_, a] if a == "A" => Ok((first, Content::Grey)),
        _ => {
            let message = "expected the channels R, G and B, with or without A, or a single one; found";
            Err(damaged(format_args!("{message} {}", names.join(", "))))
        }
    }
}

/// Decodes a file whose size has been found to be within bounds.
pub fn decode(bytes: &[u8]) -> Result<DynamicImage, Unfit> {
    if let (_, Content::Color) = content(bytes)? {
        return image::load_from_memory_with_format(bytes, ImageFormat::OpenExr).map_err(damaged);
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
        if channel.name.eq("A") && !only { alpha = Some(values) } else { grey = values }
    }
    let (width, height) = (layer.size.0 as u32, layer.size.1 as u32);
    let image = match alpha {
        None => Rgb32FImage::from_raw(width, height, grey.into_iter().flat_map(|v| [v; 3]).collect()).map(Into::into),
        Some(alpha) => {
            let texels = grey.into_iter().zip(alpha).flat_map(|(v, a)| [v, v, v, a]).collect();
            Rgba32FImage::from_raw(width, height, texels).map(Into::into)
        }
    };
    image.ok_or_else(|| damaged("a channel has fewer values than the image has texels"))
}
