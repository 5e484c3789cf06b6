//! Image files.

use crate::common::{self, prelude::*};
use crate::support::*;
use relief::import::{ImportError, load_image, load_images};
use systems::assets::Texels;

#[test]
fn every_valid_image_loads_with_its_levels() {
    let Some(data) = common::test_data() else { return };
    let mut files = files_below(&data.join("textures"), &["png", "tga", "jpg", "TGA"]);
    files.retain(|f| !f.to_str().unwrap().contains("REPO"));
    assert!(files.len() > 150, "only {} images", files.len());
    let requests: Vec<_> = files.iter().map(|f| (f.clone(), ImageKind::Color)).collect();
    for (file, image) in files.iter().zip(load_images(&requests)) {
        let image = image.unwrap().image;
        assert_eq!(image.name, file.file_stem().unwrap().to_str().unwrap(), "the order is kept");
        assert_eq!(image.levels.last().unwrap().len(), image.texels.level_bytes(1, 1));
    }
}

#[test]
fn interlaced_images_equal_their_plain_twins() {
    let Some(data) = common::test_data() else { return };
    let folder = data.join("textures/pngsuite-valid");
    let mut pairs = 0;
    for plain in files_below(&folder, &["png"]) {
        let name = plain.file_name().unwrap().to_str().unwrap();
        let Some(rest) = name.strip_prefix("basn") else { continue };
        let (a, b) =
            (load_image(&plain, ImageKind::Data), load_image(&folder.join(format!("basi{rest}")), ImageKind::Data));
        let (a, b) = (a.unwrap(), b.unwrap());
        assert!(a.levels == b.levels, "{name}");
        assert_eq!(a.texels, if rest.contains("16.png") { Texels::Rgba16Float } else { Texels::Rgba8 }, "{name}");
        pairs += 1;
    }
    assert!(pairs >= 10, "only {pairs} pairs");
}

#[test]
fn sixteen_bits_are_linear_light_for_colour_and_as_they_are_for_data() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deep.png");
    image::ImageBuffer::<image::Rgba<u16>, _>::from_pixel(1, 1, image::Rgba([32768u16, 0, 65535, 16384]))
        .save(&path)
        .unwrap();
    let texel = |kind| {
        let image = load_image(&path, kind).unwrap();
        let halves = image.levels[0].as_chunks::<2>().0.iter().map(|&b| half::f16::from_le_bytes(b).to_f32());
        Vec4::from_slice(&halves.collect::<Vec<_>>())
    };
    let data = texel(ImageKind::Data);
    assert!(data.abs_diff_eq(Vec4::new(0.5, 0.0, 1.0, 0.25), 1e-3), "{data}");
    let color = texel(ImageKind::Color);
    assert!(color.abs_diff_eq(Vec4::new(0.2140, 0.0, 1.0, 0.25), 1e-3), "{color}");
}

#[test]
fn heights_of_sixteen_bits_stay_apart() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ramp.png");
    // The greys between which half floats have no other: their steps there are 32 of 65535.
    let ramp = image::ImageBuffer::from_fn(64, 1, |x, _| image::Luma([60_000 + x as u16]));
    ramp.save(&path).unwrap();
    let image = load_image(&path, ImageKind::Height).unwrap();
    assert_eq!((image.texels, image.levels[0].len()), (Texels::R32Float, 4 * 64));
    for (x, &bytes) in image.levels[0].as_chunks::<4>().0.iter().enumerate() {
        assert_eq!((f32::from_le_bytes(bytes) * 65535.0).round(), 60_000.0 + x as f32);
    }
    // The mean of a ramp is the mean of its ends.
    let last = image.levels.last().unwrap();
    let mean = f32::from_le_bytes(last[..].try_into().unwrap()) * 65535.0;
    assert!((mean - 60_031.5).abs() < 0.1, "{mean}");
    // Eight bits stay eight.
    let shallow = folder.path().join("shallow.png");
    image::GrayImage::from_pixel(4, 4, image::Luma([7])).save(&shallow).unwrap();
    assert_eq!(load_image(&shallow, ImageKind::Height).unwrap().texels, Texels::Rgba8);
}

#[test]
fn images_of_one_channel_are_grey_in_every_map() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let [eight, alpha, sixteen] = ["l8.png", "la8.png", "l16.png"].map(file);
    image::GrayImage::from_pixel(2, 2, image::Luma([100])).save(&eight).unwrap();
    image::GrayAlphaImage::from_pixel(2, 2, image::LumaA([100, 50])).save(&alpha).unwrap();
    image::ImageBuffer::from_pixel(2, 2, image::Luma([25_700u16])).save(&sixteen).unwrap();
    let others = [file("l8.tga"), file("l8.bmp"), file("one.exr"), file("two.exr")];
    image::GrayImage::from_pixel(2, 2, image::Luma([100])).save(&others[0]).unwrap();
    image::GrayImage::from_pixel(2, 2, image::Luma([100])).save(&others[1]).unwrap();
    let value = 100.0f32 / 255.0;
    write_exr(&others[2], &[("depth.Z", value)]);
    write_exr(&others[3], &[("A", 50.0 / 255.0), ("Y", value)]);
    for (path, expected) in [
        (&eight, [100, 100, 100, 255]),
        (&alpha, [100, 100, 100, 50]),
        (&sixteen, [100, 100, 100, 255]),
        (&others[0], [100, 100, 100, 255]),
        (&others[1], [100, 100, 100, 255]),
        (&others[2], [100, 100, 100, 255]),
        (&others[3], [100, 100, 100, 50]),
    ] {
        let data = load_image(path, ImageKind::Data).unwrap();
        let texel: Vec<f32> = match data.texels {
            Texels::Rgba8 => data.levels[0][..4].iter().map(|&v| f32::from(v) / 255.0).collect(),
            _ => data.levels[0][..8].as_chunks::<2>().0.iter().map(|&v| half::f16::from_le_bytes(v).to_f32()).collect(),
        };
        let expected = expected.map(|v: u8| f32::from(v) / 255.0);
        // Half floats round to 11 bits.
        assert!(texel.iter().zip(expected).all(|(a, b)| (a - b).abs() <= 1.0 / 4096.0), "{path:?}: {texel:?}");
        let height = load_image(path, ImageKind::Height).unwrap();
        let first = match height.texels {
            Texels::Rgba8 => f32::from(height.levels[0][0]) / 255.0,
            _ => f32::from_le_bytes(height.levels[0][..4].try_into().unwrap()),
        };
        assert!((first - value).abs() < 1e-6, "{path:?}: {first}");
    }
    let path = file("xyz.exr");
    write_exr(&path, &[("X", 0.5), ("Y", 0.5), ("Z", 0.5)]);
    let error = load_image(&path, ImageKind::Data).unwrap_err().to_string();
    assert!(error.contains("R, G and B") && error.contains("X, Y, Z"), "{error}");
}

/// 2 × 2 texels of so many channels, each of one value.
fn write_exr(path: &Path, channels: &[(&str, f32)]) {
    use exr::prelude::*;
    let channels = channels.iter().map(|&(name, value)| AnyChannel::new(name, FlatSamples::F32(vec![value; 4])));
    let channels = AnyChannels::sort(channels.collect());
    let layer = Layer::new((2, 2), LayerAttributes::default(), Encoding::UNCOMPRESSED, channels);
    Image::from_layer(layer).write().to_file(path).unwrap();
}

/// The display window is the image: of 2 × 2 texels at (1, −1) one row is in a window of 3 × 2. The rest is nothing.
#[test]
fn openexr_is_an_image_of_its_display_window() {
    use exr::prelude::*;
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, channels: &[&str], data: (i32, i32), shown: ((i32, i32), (usize, usize))| {
        let path = folder.path().join(name);
        let values = || FlatSamples::F32(vec![0.125, 0.25, 0.5, 0.75]);
        let channels = channels.iter().map(|&name| AnyChannel::new(name, values())).collect();
        let attributes = LayerAttributes { layer_position: Vec2(data.0, data.1), ..LayerAttributes::default() };
        let layer = Layer::new((2, 2), attributes, Encoding::UNCOMPRESSED, AnyChannels::sort(channels));
        let window = IntegerBounds::new(shown.0, shown.1);
        Image::empty(ImageAttributes::new(window)).with_layer(layer).write().to_file(&path).unwrap();
        path
    };
    let texels = |path: &Path| {
        let image = load_image(path, ImageKind::Data).unwrap();
        let halves = image.levels[0].as_chunks::<2>().0.iter().map(|&v| half::f16::from_le_bytes(v).to_f32());
        let texels: Vec<[f32; 2]> =
            halves.collect::<Vec<_>>().as_chunks::<4>().0.iter().map(|t| [t[0], t[3]]).collect();
        ((image.width, image.height), texels)
    };
    // Without alpha all is covered.
    let opaque = vec![[0.0, 1.0], [0.5, 1.0], [0.75, 1.0], [0.0, 1.0], [0.0, 1.0], [0.0, 1.0]];
    let clear = vec![[0.0; 2], [0.5; 2], [0.75; 2], [0.0; 2], [0.0; 2], [0.0; 2]];
    for (channels, expected) in
        [(&["Y"][..], &opaque), (&["R", "G", "B"], &opaque), (&["Y", "A"], &clear), (&["R", "G", "B", "A"], &clear)]
    {
        // The same, wherever the origin is.
        for (x, y) in [(0, 0), (-40, 7)] {
            let path = write("part.exr", channels, (x + 1, y - 1), ((x, y), (3, 2)));
            assert_eq!(texels(&path), ((3, 2), expected.clone()), "{channels:?}");
        }
        let inner = write("inner.exr", channels, (-1, 0), ((0, 0), (1, 2)));
        let (size, found) = texels(&inner);
        assert_eq!((size, found[0][0], found[1][0]), ((1, 2), 0.25, 0.75), "{channels:?}");
        for (x, y) in [(2, 0), (-2, 0), (0, 2), (0, -2), (1 << 29, 0)] {
            let apart = write("apart.exr", channels, (x, y), ((0, 0), (2, 2)));
            let error = load_image(&apart, ImageKind::Data).unwrap_err().to_string();
            assert!(error.contains("OpenEXR") && error.contains("outside its display window"), "{error}");
        }
    }
}

#[test]
fn what_cannot_be_decoded_is_said_with_the_name_of_its_format() {
    let folder = tempfile::tempdir().unwrap();
    let mut dds = vec![0u8; 148];
    dds[..8].copy_from_slice(b"DDS \x7c\0\0\0");
    (dds[12], dds[16], dds[80]) = (4, 4, 4);
    dds[84..88].copy_from_slice(b"DX10");
    dds[128] = 95;
    let encoded = |format| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let noise = |x, y| image::Rgb([(x * 31 % 256) as u8, (y * 47 % 256) as u8, (x * y % 256) as u8]);
        image::RgbImage::from_fn(40, 40, noise).write_to(&mut bytes, format).unwrap();
        let whole = bytes.into_inner();
        whole[..whole.len() / 2].to_vec()
    };
    for (file, bytes, said) in [
        ("a.dds", dds, "a.dds: image data: DDS of the kind BC6H is not read; "),
        ("b.dds", b"DDS \x7c\0\0\0".to_vec(), "b.dds: image data: the DDS file ends at byte 8"),
        ("a.exr", b"\x76\x2f\x31\x01\x02\0\0\0".to_vec(), "a.exr: image data: the OpenEXR cannot be decoded: "),
        ("a.png", encoded(image::ImageFormat::Png), "a.png: image data: the PNG cannot be decoded: "),
        ("a.bmp", encoded(image::ImageFormat::Bmp), "a.bmp: image data: the BMP cannot be decoded: "),
    ] {
        let path = folder.path().join(file);
        std::fs::write(&path, bytes).unwrap();
        let error = load_image(&path, ImageKind::Color).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
        assert!(!error.contains("Format error"), "{error}");
    }
}

#[test]
fn normal_maps_of_two_channels_get_their_z() {
    let folder = tempfile::tempdir().unwrap();
    // Leans by 37° in four directions, and none: x and y are 0.6 or 0.
    let xy = [[204, 128], [51, 128], [128, 204], [128, 51], [128, 128]];
    let read = |name: &str, texel: &dyn Fn([u8; 2]) -> [u8; 4]| {
        let path = folder.path().join(name);
        image::RgbaImage::from_fn(5, 1, |x, _| image::Rgba(texel(xy[x as usize]))).save(&path).unwrap();
        let read = load_images(&[(path, ImageKind::Normal)]).remove(0).unwrap();
        let texels: Vec<[u8; 4]> = read.image.levels[0].as_chunks::<4>().0.to_vec();
        (texels, read.notes)
    };
    // z is 0.8 where x or y is 0.6, stored 0.9; 128 is 1/255 beyond none.
    let whole: Vec<[u8; 4]> = xy.map(|[x, y]| [x, y, if [x, y] == [128, 128] { 255 } else { 229 }, 255]).to_vec();
    let alike =
        |a: &[[u8; 4]], b: &[[u8; 4]]| a.iter().zip(b).all(|(a, b)| a.iter().zip(b).all(|(a, b)| a.abs_diff(*b) <= 1));
    for (name, blue) in [("none.png", 0), ("half.png", 128), ("full.png", 255)] {
        let (texels, notes) = read(name, &|[x, y]| [x, y, blue, 255]);
        assert!(alike(&texels, &whole), "{name}: {texels:?}");
        assert!(notes.len() == 1 && notes[0].contains("reconstructed from red and green"), "{name}: {notes:?}");
    }
    for (name, red) in [("dxt5nm_0.png", 0), ("dxt5nm_255.png", 255)] {
        let (texels, notes) = read(name, &|[x, y]| [red, y, y, x]);
        assert!(alike(&texels, &whole), "{name}: {texels:?}");
        assert!(notes.len() == 1 && notes[0].contains("x in alpha"), "{name}: {notes:?}");
    }
    let (texels, notes) = read("whole.png", &|[x, y]| [x, y, if x == y { 255 } else { 229 }, 255]);
    assert!(texels == whole && notes.is_empty(), "{texels:?} {notes:?}");
    // A gentle map may well have the same blue all over.
    let (texels, notes) = read("gentle.png", &|[x, y]| [128 + x / 20, 128 + y / 20, 254, 255]);
    assert!(texels[0] == [138, 134, 254, 255] && notes.is_empty(), "{texels:?} {notes:?}");
    type Texel<'a> = &'a dyn Fn([u8; 2]) -> [u8; 4];
    let grey: Texel = &|[x, _]: [u8; 2]| [x, x, x, 255];
    for (name, texel, word) in [
        ("grey.png", grey, "is grey: expected a normal map"),
        ("grey_alpha.png", &|[x, y]| [x, x, x, y], "is grey with alpha"),
        ("inward.png", &|[x, y]| [x, y, if x == y { 0 } else { 26 }, 255], "points into the surface"),
    ] {
        let (_, notes) = read(name, texel);
        assert!(notes.len() == 1 && notes[0].contains(word), "{name}: {notes:?}");
    }
}

#[test]
fn a_header_that_promises_too_much_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("huge.bmp");
    let mut bytes = b"BM\0\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0".to_vec();
    bytes.extend(20_000i32.to_le_bytes().repeat(2));
    bytes.extend([1, 0, 24, 0]);
    bytes.resize(200, 0);
    std::fs::write(&path, bytes).unwrap();
    let error = load_image(&path, ImageKind::Color).unwrap_err().to_string();
    assert!(error.contains("huge.bmp") && error.contains("large"), "{error}");
    let missing = load_image(&folder.path().join("none.png"), ImageKind::Color).unwrap_err();
    assert!(matches!(missing, ImportError::Unreadable { .. }), "{missing}");
}
