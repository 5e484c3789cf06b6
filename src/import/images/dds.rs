//! DirectDraw Surface files (DDS): the first level of one image, in blocks or uncompressed.
//!
//! Header and formats as in Microsoft's "Programming Guide for DDS" and "DXGI_FORMAT enumeration"; blocks are unpacked
//! by bcdec. What is not read is refused by its name.

use super::unfit::Unfit;
use image::{DynamicImage, GrayImage, ImageBuffer, RgbImage, Rgba32FImage, RgbaImage};
use systems::assets::color::{linear_from_srgb, srgb_from_linear};

/// Formats that are read, for messages.
const READ: &str = "BC1 to BC5 and BC7 (DXT1 to DXT5, ATI1, ATI2), uncompressed RGB, RGBA and grey of up to 32 bits, \
                    and 16- and 32-bit channels are read";

/// Bytes of the header, and of what follows it where the format is DXGI's.
const HEADER: usize = 128;
const DX10_HEADER: usize = 20;

/// `DDS_PIXELFORMAT::dwFlags`.
const ALPHA_PIXELS: u32 = 0x1;
const FOUR_CC: u32 = 0x4;
const RGB: u32 = 0x40;
const LUMINANCE: u32 = 0x2_0000;
/// `miscFlags2` of the DX10 header: what alpha is. Of the other values, 0 is unknown, 1 straight, and 4 nothing that is
/// seen; all are read as they are stored.
const ALPHA_MODE: u32 = 0x7;
const ALPHA_PREMULTIPLIED: u32 = 2;
const ALPHA_OPAQUE: u32 = 3;
/// `dwCaps2`.
const CUBE_MAP: u32 = 0x200;
const VOLUME: u32 = 0x20_0000;

/// Header of a DDS file.
#[derive(Clone, Copy, Debug)]
pub struct Header {
    pub width: u32,
    pub height: u32,
    format: Format,
    alpha: Alpha,
    /// Byte offset of the texels.
    offset: usize,
}

/// Use of alpha in the stored colour.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Alpha {
    /// Colour as it is.
    Straight,
    /// Colour times alpha, of sRGB-encoded colour in linear light or of what is stored.
    Premultiplied { linear: bool },
    /// Nothing that counts.
    Opaque,
}

#[derive(Clone, Copy, PartialEq, Debug)]
enum Format {
    /// BC1, 2, 3 or 7: red, green, blue and alpha.
    Color(u8),
    /// BC4 or BC5: one channel or two.
    Channels { count: usize, signed: bool },
    /// Little-endian integers with a mask for red (or grey), green, blue and alpha.
    Masked { bytes: usize, masks: [u32; 4], grey: bool },
    /// Channels of their own, in the order red, green, blue, alpha.
    Wide { kind: Wide, count: usize },
}

#[derive(Clone, Copy, PartialEq, Debug)]
enum Wide {
    Unorm16,
    Half,
    Float,
}

const BGRA: [u32; 4] = [0xff_0000, 0xff00, 0xff, 0xff00_0000];
const RGBA: [u32; 4] = [0xff, 0xff00, 0xff_0000, 0xff00_0000];

const fn masked(bytes: usize, masks: [u32; 4]) -> Format {
    Format::Masked { bytes, masks, grey: false }
}

fn word(bytes: &[u8], offset: usize) -> Result<u32, Unfit> {
    let word = bytes.get(offset..).and_then(|rest| rest.first_chunk::<4>());
    word.map(|word| u32::from_le_bytes(*word))
        .ok_or_else(|| Unfit::Damaged(format!("the DDS file ends at byte {}, within its header", bytes.len())))
}

fn refused(name: impl std::fmt::Display) -> Unfit {
    Unfit::Damaged(format!("DDS of the kind {name} is not read; {READ}"))
}

impl Header {
    /// Reads the header alone. The size may be anything.
    pub fn new(bytes: &[u8]) -> Result<Self, Unfit> {
        let at = |offset| word(bytes, offset);
        if at(4)? != 124 {
            return Err(Unfit::Damaged(format!("expected a DDS header of 124 bytes, found {}", at(4)?)));
        }
        let (height, width, depth, caps) = (at(12)?, at(16)?, at(24)?, at(112)?);
        if caps & CUBE_MAP != 0 {
            return Err(refused("cube map"));
        }
        if caps & VOLUME != 0 && depth > 1 {
            return Err(refused("volume texture"));
        }
        let (flags, code) = (at(80)?, at(84)?);
        let (format, alpha, offset) = if flags & FOUR_CC != 0 && &code.to_le_bytes() == b"DX10" {
            if at(HEADER + 4)? == 4 {
                return Err(refused("volume texture"));
            }
            if at(HEADER + 8)? & 0x4 != 0 {
                return Err(refused("cube map"));
            }
            if at(HEADER + 12)? > 1 {
                return Err(refused("array of textures"));
            }
            let format = at(HEADER)?;
            let alpha = match at(HEADER + 16)? & ALPHA_MODE {
                ALPHA_PREMULTIPLIED => Alpha::Premultiplied { linear: is_srgb(format) },
                ALPHA_OPAQUE => Alpha::Opaque,
                _ => Alpha::Straight,
            };
            (of_dxgi(format)?, alpha, HEADER + DX10_HEADER)
        } else if flags & FOUR_CC != 0 {
            let (format, alpha) = of_four_cc(code)?;
            (format, alpha, HEADER)
        } else {
            let masks = [at(92)?, at(96)?, at(100)?, if flags & ALPHA_PIXELS != 0 { at(104)? } else { 0 }];
            (of_masks(flags, at(88)?, masks)?, Alpha::Straight, HEADER)
        };
        at(offset - 4)?;
        Ok(Self { width, height, format, alpha, offset })
    }

    /// Tells if a channel has more than eight bits.
    pub fn is_deep(&self) -> bool {
        match self.format {
            Format::Wide { .. } => true,
            Format::Masked { masks, .. } => masks.iter().any(|mask| mask.count_ones() > 8),
            _ => false,
        }
    }

    fn bytes(&self) -> u64 {
        let texels = u64::from(self.width) * u64::from(self.height);
        let blocks = u64::from(self.width.div_ceil(4)) * u64::from(self.height.div_ceil(4));
        match self.format {
            Format::Color(1) | Format::Channels { count: 1, .. } => blocks.saturating_mul(8),
            Format::Color(_) | Format::Channels { .. } => blocks.saturating_mul(16),
            Format::Masked { bytes, .. } => texels.saturating_mul(bytes as u64),
            Format::Wide { kind: Wide::Float, count } => texels.saturating_mul(4 * count as u64),
            Format::Wide { count, .. } => texels.saturating_mul(2 * count as u64),
        }
    }

    /// The image of a file with this header, whose size has been found to be within bounds. Two channels become red and
    /// green, with no blue; one becomes grey.
    pub fn decode(&self, bytes: &[u8]) -> Result<DynamicImage, Unfit> {
        let (data, needed) = (&bytes[self.offset.min(bytes.len())..], self.bytes());
        if (data.len() as u64) < needed {
            let (width, height, found) = (self.width, self.height, data.len());
            let message = format!("a DDS of {width}×{height} texels takes {needed} bytes, found {found}");
            return Err(Unfit::Damaged(message));
        }
        let data = &data[..needed as usize];
        let image = match self.format {
            Format::Color(kind) => {
                let unpack = [bcdec_rs::bc1, bcdec_rs::bc2, bcdec_rs::bc3];
                let unpack = unpack.get(usize::from(kind) - 1).copied().unwrap_or(bcdec_rs::bc7);
                let texels = self.unpacked(data, if kind == 1 { 8 } else { 16 }, 4, unpack);
                RgbaImage::from_raw(self.width, self.height, texels).map(Into::into)
            }
            Format::Channels { count: 1, signed } => {
                let unpack = |block: &[u8], to: &mut [f32], row: usize| bcdec_rs::bc4_float(block, to, row, signed);
                let texels = self.unpacked(data, 8, 1, unpack).into_iter().map(byte(signed)).collect();
                GrayImage::from_raw(self.width, self.height, texels).map(Into::into)
            }
            Format::Channels { signed, .. } => {
                let unpack = |block: &[u8], to: &mut [f32], row: usize| bcdec_rs::bc5_float(block, to, row, signed);
                let pairs = self.unpacked(data, 16, 2, unpack);
                let texels = pairs.as_chunks::<2>().0.iter().flat_map(|pair| {
                    let [red, green] = pair.map(byte(signed));
                    [red, green, 0]
                });
                RgbImage::from_raw(self.width, self.height, texels.collect()).map(Into::into)
            }
            Format::Masked { bytes, masks, grey } => self.masked(data, bytes, masks, grey),
            Format::Wide { kind, count } => self.wide(data, kind, count),
        };
        let image = image.ok_or_else(|| Unfit::Damaged("the image has no texels".into()))?;
        Ok(match self.alpha {
            Alpha::Straight => image,
            Alpha::Opaque => each_texel(image, |[r, g, b, _]| [r, g, b, 1.0]),
            Alpha::Premultiplied { linear } => each_texel(image, |[r, g, b, a]| {
                let divided = |value: f32| match (a > 0.0, linear) {
                    (false, _) => value,
                    (true, false) => value / a,
                    (true, true) => srgb_from_linear(linear_from_srgb(value) / a),
                };
                [divided(r), divided(g), divided(b), a]
            }),
        })
    }

    /// The texels of all blocks, without what the last ones have beyond the edges.
    fn unpacked<T: Copy + Default>(
        &self,
        data: &[u8],
        block: usize,
        channels: usize,
        unpack: impl Fn(&[u8], &mut [T], usize),
    ) -> Vec<T> {
        let (width, height) = (self.width as usize, self.height as usize);
        let row = width.next_multiple_of(4) * channels;
        let mut rows = vec![T::default(); 4 * row];
        let mut texels = Vec::with_capacity(width * height * channels);
        for (y, blocks) in data.chunks_exact(width.div_ceil(4) * block).enumerate() {
            for (x, block) in blocks.chunks_exact(block).enumerate() {
                unpack(block, &mut rows[x * 4 * channels..], row);
            }
            let inside = rows.chunks_exact(row).take(height - 4 * y);
            inside.for_each(|row| texels.extend_from_slice(&row[..width * channels]));
        }
        texels
    }

    fn masked(&self, data: &[u8], bytes: usize, masks: [u32; 4], grey: bool) -> Option<DynamicImage> {
        let values = data.chunks_exact(bytes).map(|texel| {
            let mut word = [0; 4];
            word[..bytes].copy_from_slice(texel);
            let word = u32::from_le_bytes(word);
            // A channel without bits is black; alpha without bits hides nothing.
            let value = |mask: u32, otherwise: f32| {
                if mask == 0 {
                    return otherwise;
                }
                let shift = mask.trailing_zeros();
                ((word & mask) >> shift) as f32 / (mask >> shift) as f32
            };
            let [r, g, b] = [value(masks[0], 0.0), value(masks[1], 0.0), value(masks[2], 0.0)];
            let [g, b] = if grey { [r, r] } else { [g, b] };
            [r, g, b, value(masks[3], 1.0)]
        });
        if self.is_deep() {
            let texels = values.flat_map(|texel| texel.map(|v| (v * 65535.0).round() as u16)).collect();
            ImageBuffer::from_raw(self.width, self.height, texels).map(DynamicImage::ImageRgba16)
        } else {
            let texels = values.flat_map(|texel| texel.map(|v| (v * 255.0).round() as u8)).collect();
            RgbaImage::from_raw(self.width, self.height, texels).map(Into::into)
        }
    }

    fn wide(&self, data: &[u8], kind: Wide, count: usize) -> Option<DynamicImage> {
        let halves = || data.as_chunks::<2>().0.iter();
        let values: Vec<f32> = match kind {
            Wide::Unorm16 => halves().map(|&v| f32::from(u16::from_le_bytes(v)) / 65535.0).collect(),
            Wide::Half => halves().map(|&v| half::f16::from_le_bytes(v).to_f32()).collect(),
            Wide::Float => data.as_chunks::<4>().0.iter().map(|&v| f32::from_le_bytes(v)).collect(),
        };
        let texels = values.chunks_exact(count).map(|texel| match *texel {
            [grey] => [grey, grey, grey, 1.0],
            [r, g] => [r, g, 0.0, 1.0],
            [r, g, b] => [r, g, b, 1.0],
            _ => [texel[0], texel[1], texel[2], texel[3]],
        });
        if kind == Wide::Unorm16 {
            let texels = texels.flat_map(|texel| texel.map(|v| (v * 65535.0).round() as u16)).collect();
            ImageBuffer::from_raw(self.width, self.height, texels).map(DynamicImage::ImageRgba16)
        } else {
            Rgba32FImage::from_raw(self.width, self.height, texels.flatten().collect()).map(Into::into)
        }
    }
}

/// Changes texels as values; those without alpha stay.
fn each_texel(image: DynamicImage, change: impl Fn([f32; 4]) -> [f32; 4]) -> DynamicImage {
    match image {
        DynamicImage::ImageRgba8(mut image) => {
            for texel in image.pixels_mut() {
                texel.0 = change(texel.0.map(|v| f32::from(v) / 255.0)).map(|v| (v * 255.0).round() as u8);
            }
            image.into()
        }
        DynamicImage::ImageRgba16(mut image) => {
            for texel in image.pixels_mut() {
                texel.0 = change(texel.0.map(|v| f32::from(v) / 65535.0)).map(|v| (v * 65535.0).round() as u16);
            }
            image.into()
        }
        DynamicImage::ImageRgba32F(mut image) => {
            image.pixels_mut().for_each(|texel| texel.0 = change(texel.0));
            image.into()
        }
        image => image,
    }
}

/// A channel as a byte; signed ones are from −1 to 1.
fn byte(signed: bool) -> impl Fn(f32) -> u8 {
    move |value| (if signed { 0.5 * value + 0.5 } else { value } * 255.0).round() as u8
}

fn of_masks(flags: u32, bits: u32, masks: [u32; 4]) -> Result<Format, Unfit> {
    let grey = flags & LUMINANCE != 0;
    if !grey && flags & RGB == 0 {
        let name = match flags {
            f if f & 0x2 != 0 => "A8 (alpha alone)",
            f if f & 0x20 != 0 => "palette",
            f if f & 0x200 != 0 => "YUV",
            f if f & 0x8_0000 != 0 => "signed (V8U8 and its like)",
            _ => "without RGB, grey or FourCC",
        };
        return Err(refused(name));
    }
    let contiguous = |mask: u32| {
        let ones = mask.checked_shr(mask.trailing_zeros()).unwrap_or(0);
        ones & ones.wrapping_add(1) == 0
    };
    let whole = if bits >= 32 { u32::MAX } else { (1 << bits) - 1 };
    if !matches!(bits, 8 | 16 | 24 | 32) || masks[0] == 0 || !masks.iter().all(|&m| contiguous(m) && m & !whole == 0) {
        return Err(refused(format_args!("uncompressed with {bits} bits and masks {masks:08x?}")));
    }
    // With one mask alone it is grey too.
    let grey = grey || masks[1] == 0 && masks[2] == 0;
    Ok(Format::Masked { bytes: bits as usize / 8, masks, grey })
}

fn of_four_cc(code: u32) -> Result<(Format, Alpha), Unfit> {
    let text = code.to_le_bytes();
    let format = match &text {
        b"DXT1" => Format::Color(1),
        b"DXT2" | b"DXT3" => Format::Color(2),
        b"DXT4" | b"DXT5" => Format::Color(3),
        b"ATI1" | b"BC4U" => Format::Channels { count: 1, signed: false },
        b"BC4S" => Format::Channels { count: 1, signed: true },
        b"ATI2" | b"BC5U" => Format::Channels { count: 2, signed: false },
        b"BC5S" => Format::Channels { count: 2, signed: true },
        // Numbers of Direct3D 9's formats.
        _ => match code {
            36 => Format::Wide { kind: Wide::Unorm16, count: 4 },
            111 => Format::Wide { kind: Wide::Half, count: 1 },
            112 => Format::Wide { kind: Wide::Half, count: 2 },
            113 => Format::Wide { kind: Wide::Half, count: 4 },
            114 => Format::Wide { kind: Wide::Float, count: 1 },
            115 => Format::Wide { kind: Wide::Float, count: 2 },
            116 => Format::Wide { kind: Wide::Float, count: 4 },
            _ if text.iter().all(u8::is_ascii_graphic) => return Err(refused(text.escape_ascii())),
            _ => return Err(refused(format_args!("Direct3D 9 format {code}"))),
        },
    };
    let premultiplied = matches!(&text, b"DXT2" | b"DXT4");
    Ok((format, if premultiplied { Alpha::Premultiplied { linear: false } } else { Alpha::Straight }))
}

fn is_srgb(dxgi: u32) -> bool {
    matches!(dxgi, 29 | 72 | 75 | 78 | 91 | 93 | 99)
}

fn of_dxgi(format: u32) -> Result<Format, Unfit> {
    let wide = |kind, count| Format::Wide { kind, count };
    Ok(match format {
        70..=72 => Format::Color(1),
        73..=75 => Format::Color(2),
        76..=78 => Format::Color(3),
        97..=99 => Format::Color(7),
        79 | 80 => Format::Channels { count: 1, signed: false },
        81 => Format::Channels { count: 1, signed: true },
        82 | 83 => Format::Channels { count: 2, signed: false },
        84 => Format::Channels { count: 2, signed: true },
        1 | 2 => wide(Wide::Float, 4),
        5 | 6 => wide(Wide::Float, 3),
        9 | 10 => wide(Wide::Half, 4),
        11 => wide(Wide::Unorm16, 4),
        15 | 16 => wide(Wide::Float, 2),
        33 | 34 => wide(Wide::Half, 2),
        35 => wide(Wide::Unorm16, 2),
        39 | 41 => wide(Wide::Float, 1),
        53 | 54 => wide(Wide::Half, 1),
        56 => wide(Wide::Unorm16, 1),
        23 | 24 => masked(4, [0x3ff, 0xf_fc00, 0x3ff0_0000, 0xc000_0000]),
        27..=29 => masked(4, RGBA),
        48 | 49 => masked(2, [0xff, 0xff00, 0, 0]),
        60 | 61 => Format::Masked { bytes: 1, masks: [0xff, 0, 0, 0], grey: true },
        85 => masked(2, [0xf800, 0x7e0, 0x1f, 0]),
        86 => masked(2, [0x7c00, 0x3e0, 0x1f, 0x8000]),
        87 | 90 | 91 => masked(4, BGRA),
        88 | 92 | 93 => masked(4, [BGRA[0], BGRA[1], BGRA[2], 0]),
        115 => masked(2, [0xf00, 0xf0, 0xf, 0xf000]),
        94..=96 => return Err(refused("BC6H")),
        65 => return Err(refused("A8 (alpha alone)")),
        31 | 37 | 51 | 58 | 63 => return Err(refused(format_args!("signed (DXGI format {format})"))),
        100..=114 => return Err(refused(format_args!("YUV or palette (DXGI format {format})"))),
        133..=187 => return Err(refused("ASTC")),
        _ => return Err(refused(format_args!("DXGI format {format}"))),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::GenericImageView;

    /// A file of that size: `format` is the pixel format's flags, FourCC, bits and four masks.
    fn file((width, height): (u32, u32), format: [u32; 7], rest: &[u8]) -> Vec<u8> {
        let mut words = [0u32; 32];
        (words[0], words[1], words[2]) = (u32::from_le_bytes(*b"DDS "), 124, 0x1007);
        (words[3], words[4], words[19], words[27]) = (height, width, 32, 0x1000);
        words[20..27].copy_from_slice(&format);
        let mut bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        bytes.extend_from_slice(rest);
        bytes
    }

    fn four_cc(code: &[u8; 4]) -> [u32; 7] {
        [FOUR_CC, u32::from_le_bytes(*code), 0, 0, 0, 0, 0]
    }

    fn dxgi(size: (u32, u32), format: u32, data: &[u8]) -> Vec<u8> {
        let header = [format, 3, 0, 1, 0].map(u32::to_le_bytes).concat();
        file(size, four_cc(b"DX10"), &[&header, data].concat())
    }

    fn decode(bytes: &[u8]) -> Result<DynamicImage, String> {
        let header = Header::new(bytes).map_err(|unfit| unfit.to_string())?;
        header.decode(bytes).map_err(|unfit| unfit.to_string())
    }

    fn texel(bytes: &[u8]) -> [u8; 4] {
        decode(bytes).unwrap().get_pixel(0, 0).0
    }

    /// Both ends of the block's colours are red, all texels take the first; 565: 31 of 31.
    const RED: [u8; 8] = [0x00, 0xf8, 0, 0, 0, 0, 0, 0];

    #[test]
    fn blocks_are_read_whatever_the_size() {
        // A block's first colour not above its second: index 3 is clear.
        let clear = [0, 0, 0x00, 0xf8, 0xff, 0xff, 0xff, 0xff];
        assert_eq!(texel(&file((4, 4), four_cc(b"DXT1"), &RED)), [255, 0, 0, 255]);
        assert_eq!(texel(&file((4, 4), four_cc(b"DXT1"), &clear))[3], 0);
        assert_eq!(texel(&dxgi((4, 4), 72, &RED)), [255, 0, 0, 255]);
        // BC2: four bits of alpha for each texel; BC3: two ends, the first here.
        let explicit = [&[0x08, 0, 0, 0, 0, 0, 0, 0][..], &RED].concat();
        assert_eq!(texel(&file((4, 4), four_cc(b"DXT3"), &explicit)), [255, 0, 0, 136]);
        let ends = [&[90, 10, 0, 0, 0, 0, 0, 0][..], &RED].concat();
        assert_eq!(texel(&file((4, 4), four_cc(b"DXT5"), &ends)), [255, 0, 0, 90]);
        // BC4 and BC5, unsigned and signed: 64 of 127 is a half and a half of 1.
        let (unsigned, signed) = ([200, 100, 0, 0, 0, 0, 0, 0], [64, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(texel(&file((4, 4), four_cc(b"ATI1"), &unsigned)), [200, 200, 200, 255]);
        assert_eq!(texel(&dxgi((4, 4), 81, &signed)), [192, 192, 192, 255]);
        assert_eq!(texel(&file((4, 4), four_cc(b"ATI2"), &[unsigned, RED].concat()))[..3], [200, 0, 0]);
        assert_eq!(texel(&dxgi((4, 4), 84, &[signed, [0; 8]].concat())), [192, 128, 0, 255]);
        // BC7, mode 6: seven bits of each end and a shared last one.
        let mut whole = [0u8; 16];
        (whole[0], whole[7]) = (0x40, 0);
        assert_eq!(texel(&dxgi((4, 4), 98, &whole)), [0, 0, 0, 0]);
        // Four blocks of 4 × 4 for 6 × 5 texels.
        let image = decode(&file((6, 5), four_cc(b"DXT1"), &RED.repeat(4))).unwrap();
        assert_eq!((image.dimensions(), image.get_pixel(5, 4).0), ((6, 5), [255, 0, 0, 255]));
    }

    #[test]
    fn uncompressed_is_read_by_its_masks() {
        let rgb = |bits, masks: [u32; 4], texel: &[u8]| {
            let flags = RGB | if masks[3] != 0 { ALPHA_PIXELS } else { 0 };
            file((1, 1), [flags, 0, bits, masks[0], masks[1], masks[2], masks[3]], texel)
        };
        assert_eq!(texel(&rgb(32, BGRA, &[1, 2, 3, 4])), [3, 2, 1, 4]);
        assert_eq!(texel(&rgb(32, RGBA, &[1, 2, 3, 4])), [1, 2, 3, 4]);
        assert_eq!(texel(&rgb(32, [BGRA[0], BGRA[1], BGRA[2], 0], &[1, 2, 3, 4])), [3, 2, 1, 255]);
        assert_eq!(texel(&rgb(24, [BGRA[0], BGRA[1], BGRA[2], 0], &[1, 2, 3])), [3, 2, 1, 255]);
        assert_eq!(texel(&rgb(16, [0xf800, 0x7e0, 0x1f, 0], &[0x1f, 0xf8])), [255, 0, 255, 255]);
        assert_eq!(texel(&rgb(16, [0xf00, 0xf0, 0xf, 0xf000], &[0x0f, 0x80])), [0, 0, 255, 136]);
        let grey = |bits, masks: [u32; 2], texel: &[u8]| {
            let flags = LUMINANCE | if masks[1] != 0 { ALPHA_PIXELS } else { 0 };
            file((1, 1), [flags, 0, bits, masks[0], 0, 0, masks[1]], texel)
        };
        assert_eq!(texel(&grey(8, [0xff, 0], &[77])), [77, 77, 77, 255]);
        assert_eq!(texel(&grey(16, [0xff, 0xff00], &[77, 9])), [77, 77, 77, 9]);
        assert_eq!(texel(&dxgi((1, 1), 28, &[1, 2, 3, 4])), [1, 2, 3, 4]);
        // More than eight bits stay.
        let deep = decode(&grey(16, [0xffff, 0], &[0x34, 0x12])).unwrap().into_rgba16();
        assert_eq!(deep.get_pixel(0, 0).0, [0x1234, 0x1234, 0x1234, 0xffff]);
        assert_eq!(decode(&dxgi((1, 1), 56, &[0x34, 0x12])).unwrap().into_rgba16().get_pixel(0, 0).0[0], 0x1234);
        let float = decode(&dxgi((1, 1), 41, &1.25f32.to_le_bytes())).unwrap();
        assert_eq!(float.into_rgba32f().get_pixel(0, 0).0, [1.25, 1.25, 1.25, 1.0]);
    }

    #[test]
    fn what_alpha_was_multiplied_into_is_divided_by_it() {
        let mode = |mode: u32, format: u32, data: &[u8]| {
            let mut bytes = dxgi((1, 1), format, data);
            bytes[HEADER + 16] = mode as u8;
            texel(&bytes)
        };
        let stored = [60, 30, 0, 120];
        // 60/120 and 30/120 of 255; as sRGB, 60 is 0.0452 of light, over 120/255 is 0.0960, encoded 87.3.
        assert_eq!(mode(2, 28, &stored), [128, 64, 0, 120]);
        assert_eq!(mode(2, 29, &stored), [87, 46, 0, 120]);
        // More colour than its alpha lets through, and colour that nothing lets through.
        assert_eq!(mode(2, 28, &[200, 0, 0, 100]), [255, 0, 0, 100]);
        assert_eq!(mode(2, 28, &[9, 8, 7, 0]), [9, 8, 7, 0]);
        assert_eq!(mode(3, 28, &stored), [60, 30, 0, 255]);
        for other in [0, 1, 4, 5] {
            assert_eq!(mode(other, 28, &stored), stored, "{other}");
        }
        // 16 bits and floats, too; what has no alpha stays.
        let floats = [0.25f32, 0.5, 0.0, 0.5].map(f32::to_le_bytes).concat();
        let mut float = dxgi((1, 1), 2, &floats);
        float[HEADER + 16] = 2;
        assert_eq!(decode(&float).unwrap().into_rgba32f().get_pixel(0, 0).0, [0.5, 1.0, 0.0, 0.5]);
        let sixteen = [0x1000u16, 0x2000, 0, 0x8000].map(u16::to_le_bytes).concat();
        let mut deep = dxgi((1, 1), 11, &sixteen);
        deep[HEADER + 16] = 2;
        assert_eq!(decode(&deep).unwrap().into_rgba16().get_pixel(0, 0).0, [0x2000, 0x4000, 0, 0x8000]);
        assert_eq!(mode(2, 61, &[77]), [77, 77, 77, 255]);
        // DXT2 and DXT4 are DXT3 and DXT5 with alpha in their colours.
        let half = [0x00, 0x7a, 0, 0, 0, 0, 0, 0];
        let [straight, divided] =
            [b"DXT3", b"DXT2"].map(|code| texel(&file((4, 4), four_cc(code), &[&[0x88; 8][..], &half].concat())));
        assert_eq!(straight[3], 136);
        for (straight, divided) in straight.iter().zip(divided).take(3) {
            assert!((f32::from(divided) - f32::from(*straight) * 255.0 / 136.0).abs() <= 0.5, "{straight} {divided}");
        }
        let ends = [&[200, 200, 0, 0, 0, 0, 0, 0][..], &half].concat();
        let [straight, divided] = [b"DXT5", b"DXT4"].map(|code| texel(&file((4, 4), four_cc(code), &ends)));
        assert!((f32::from(divided[0]) - f32::from(straight[0]) * 255.0 / 200.0).abs() <= 0.5, "{divided:?}");
    }

    #[test]
    fn the_rest_is_refused_by_its_name() {
        let refusal = |bytes: &[u8]| decode(bytes).unwrap_err();
        let with = |at: usize, word: u32| {
            let mut bytes = file((4, 4), four_cc(b"DXT1"), &RED);
            bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
            bytes
        };
        for (bytes, name) in [
            (dxgi((4, 4), 95, &[0; 16]), "BC6H"),
            (dxgi((4, 4), 134, &[0; 16]), "ASTC"),
            (file((4, 4), four_cc(b"UYVY"), &[0; 32]), "UYVY"),
            (file((1, 1), [0x2, 0, 8, 0, 0, 0, 0xff], &[0]), "A8"),
            (file((1, 1), [0x20, 0, 8, 0, 0, 0, 0], &[0]), "palette"),
            (file((1, 1), [RGB, 0, 12, 0xf00, 0xf0, 0xf, 0], &[0; 2]), "12 bits"),
            (file((1, 1), [RGB, 0, 16, 0xff0000, 0xf0, 0xf, 0], &[0; 2]), "16 bits and masks"),
            (with(112, CUBE_MAP), "cube map"),
        ] {
            let refusal = refusal(&bytes);
            assert!(refusal.contains(name) && refusal.contains("BC1 to BC5 and BC7"), "{name}: {refusal}");
        }
        assert!(refusal(&with(4, 100)).contains("header of 124 bytes"));
    }

    #[test]
    fn a_file_that_ends_early_is_refused_before_anything_is_allocated() {
        let whole = dxgi((4, 4), 72, &RED);
        for length in 0..whole.len() {
            assert!(decode(&whole[..length]).is_err(), "{length}");
        }
        let vast = decode(&file((u32::MAX, u32::MAX), four_cc(b"DXT1"), &RED)).unwrap_err();
        assert!(vast.contains("texels takes"), "{vast}");
    }
}
