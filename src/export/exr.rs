//! OpenEXR files with named channels of mixed types, each sixteen rows compressed by deflate ("ZIP" of the OpenEXR
//! documentation, "Technical Introduction: Data Compression").
//!
//! Names as compositing programs know them: `R`, `G`, `B` (linear), `Z` (depth in metres), `N.X`, `N.Y`, `N.Z` (a
//! layer), `flow.U`, `flow.V` (pixels), `id`.

use super::array::Values;
use super::checks::{check_count, pixels_of, unfit};
use exr::image::write::WritableImage;
use exr::image::{AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples, Image};
use exr::prelude::{Compression, LineOrder};
use std::io::{Cursor, Result};

/// A channel: a value for each pixel, rows from the top.
#[derive(Clone, Copy, Debug)]
pub struct Channel<'a> {
    name: &'a str,
    values: Values<'a>,
    /// Index, and number of values of a pixel.
    part: (usize, usize),
}

impl<'a> Channel<'a> {
    /// A channel of all values.
    pub fn new(name: &'a str, values: impl Into<Values<'a>>) -> Self {
        Self { name, values: values.into(), part: (0, 1) }
    }

    /// A channel for each of the values that a pixel has: `["R", "G", "B"]` of an array `[height, width, 3]`.
    pub fn parts<const N: usize>(names: [&'a str; N], values: impl Into<Values<'a>>) -> [Self; N] {
        let values = values.into();
        std::array::from_fn(|part| Self { name: names[part], values, part: (part, N) })
    }

    /// Samples for the encoder. Smaller integers are widened.
    fn samples(&self) -> Result<FlatSamples> {
        fn every<T: Copy, U: From<T>>(values: &[T], (part, of): (usize, usize)) -> Vec<U> {
            values.iter().skip(part).step_by(of).map(|value| U::from(*value)).collect()
        }
        Ok(match self.values {
            Values::U8(values) => FlatSamples::U32(every(values, self.part)),
            Values::U16(values) => FlatSamples::U32(every(values, self.part)),
            Values::U32(values) => FlatSamples::U32(every(values, self.part)),
            Values::F16(values) => FlatSamples::F16(every(values, self.part)),
            Values::F32(values) => FlatSamples::F32(every(values, self.part)),
            Values::I32(_) | Values::F64(_) => {
                return Err(unfit(format!("EXR channel {}: expected u8, u16, u32, f16 or f32", self.name)));
            }
        })
    }
}

/// A file of a picture of some channels; width and height in pixels.
///
/// # Errors
/// No pixels or no channels; two with the same name; more or fewer values than pixels.
pub fn encode(size: (u32, u32), channels: &[Channel]) -> Result<Vec<u8>> {
    let pixels = pixels_of(size);
    if pixels == 0 || channels.is_empty() {
        return Err(unfit("EXR: expected a pixel and a channel at least"));
    }
    let mut list = Vec::with_capacity(channels.len());
    for (place, channel) in channels.iter().enumerate() {
        let name = channel.name;
        check_count(&format!("EXR channel {name}"), pixels * channel.part.1, channel.values.len())?;
        if channels[..place].iter().any(|before| before.name == name) {
            return Err(unfit(format!("EXR: two channels are named \"{name}\"")));
        }
        list.push(AnyChannel::new(name, channel.samples()?));
    }
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let size = (size.0 as usize, size.1 as usize);
    let image = Image::from_encoded_channels(size, encoding, AnyChannels::sort(list.into()));
    let mut bytes = Cursor::new(Vec::new());
    let written = image.write().non_parallel().to_buffered(&mut bytes);
    written.map_err(|error| unfit(format!("EXR: {error}")))?;
    Ok(bytes.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::{ReadChannels, ReadLayers, read};
    use half::f16;

    #[test]
    fn channels_come_back_bit_for_bit() {
        let size = (5, 19);
        let number = |i: usize| i as f32 * 1.37 - 20.0;
        let color: Vec<f16> = (0..3 * 95).map(|i| f16::from_f32(number(i))).collect();
        let mut depth: Vec<f32> = (0..95).map(number).collect();
        depth[3] = f32::INFINITY;
        let ids: Vec<u32> = (0..95).map(|i| u32::MAX - i).collect();
        let mut channels = Channel::parts(["R", "G", "B"], &color[..]).to_vec();
        channels.extend([Channel::new("Z", &depth[..]), Channel::new("id", &ids[..])]);
        let bytes = encode(size, &channels).unwrap();
        assert_eq!(bytes, encode(size, &channels).unwrap());
        let reader = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
        let image = reader.all_attributes().from_buffered(Cursor::new(&bytes)).unwrap();
        let layer = image.layer_data;
        assert_eq!(layer.encoding.compression, Compression::ZIP16);
        let found = |name: &str| {
            let channel = layer.channel_data.list.iter().find(|channel| channel.name.eq(name));
            channel.map(|channel| channel.sample_data.clone()).expect(name)
        };
        assert_eq!(found("Z"), FlatSamples::F32(depth.clone()));
        assert_eq!(found("id"), FlatSamples::U32(ids.clone()));
        for (part, name) in ["R", "G", "B"].into_iter().enumerate() {
            assert_eq!(found(name), FlatSamples::F16(color.iter().skip(part).step_by(3).copied().collect()));
        }
    }

    #[test]
    fn what_is_no_picture_is_refused() {
        let refusal = |size, channels: &[Channel]| encode(size, channels).unwrap_err().to_string();
        let channel = |name| Channel::new(name, &[1.0_f32][..]);
        assert_eq!(refusal((2, 1), &[channel("Z")]), "EXR channel Z: expected 2 values, found 1");
        assert_eq!(refusal((1, 1), &[channel("Z"), channel("Z")]), "EXR: two channels are named \"Z\"");
        assert_eq!(refusal((1, 1), &[]), "EXR: expected a pixel and a channel at least");
        let doubles = Channel::new("Z", &[1.0_f64][..]);
        assert_eq!(refusal((1, 1), &[doubles]), "EXR channel Z: expected u8, u16, u32, f16 or f32");
    }
}
