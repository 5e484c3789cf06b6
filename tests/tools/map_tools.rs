//! `relief map` as a user meets it: files, messages, exit codes, real textures.

use crate::common::{self, assert_fails, names, prelude::*, text};
use relief::tools::maps::files;
use std::process::Output;

fn relief(args: &[&str], folder: &Path) -> Output {
    common::relief(&[&["map"], args].concat(), folder)
}

/// Runs `relief map` as [`relief`] does, which succeeds.
#[track_caller]
fn done(args: &[&str], folder: &Path) -> Output {
    common::succeeds(&[&["map"], args].concat(), folder)
}

/// Bumps, a photograph's colours, gloss, and a metallic-roughness map, all 48×32.
fn maps_folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let save = |name: &str, color: &dyn Fn(u32, u32) -> [u8; 3]| {
        let image = image::RgbImage::from_fn(48, 32, |x, y| image::Rgb(color(x, y)));
        image.save(folder.path().join(name)).expect("written");
    };
    let bump = |x: u32, y: u32| 127.0 + 60.0 * (x as f32 * 0.6).sin() + 60.0 * (y as f32 * 0.4).cos();
    save("height.png", &|x, y| [bump(x, y) as u8; 3]);
    save("color.png", &|x, y| [bump(x, y) as u8, (x * 5) as u8, (y * 7) as u8]);
    save("orm.png", &|x, y| [255, (x * 5) as u8, (y * 7) as u8]);
    folder
}

/// Every tool, with what it writes.
const TOOLS: [(&[&str], &[&str]); 5] = [
    (&["normal", "height.png", "-o", "OUT/n.png", "--filter", "scharr", "--bits", "16"], &["n.png"]),
    (&["height", "color.png", "-o", "OUT/h.png", "--blur", "1", "--remove-shading", "6", "--sharpen", "1"], &["h.png"]),
    (&["horizon", "height.png", "-o", "OUT/z.exr", "--edges", "clamp"], &["z_0.exr", "z_1.exr"]),
    (&["offset", "height.png", "-o", "OUT/o.png", "--strength", "4"], &["o.png"]),
    (
        &[
            "specular",
            "orm.png",
            "--channel",
            "g",
            "--from",
            "roughness",
            "-o",
            "OUT/s.png",
            "--base",
            "color.png",
            "--metallic",
            "orm.png",
        ],
        &["s.png"],
    ),
];

fn run_into(out: &str, args: &[&str], more: &[&str], folder: &Path) -> Output {
    let args: Vec<String> = args.iter().map(|arg| arg.replace("OUT", out)).collect();
    let args: Vec<&str> = args.iter().map(String::as_str).chain(more.iter().copied()).collect();
    relief(&args, folder)
}

#[test]
fn every_tool_writes_the_same_bytes_for_any_number_of_threads() {
    let folder = maps_folder();
    for out in ["one", "three", "again"] {
        fs::create_dir(folder.path().join(out)).expect("a folder");
    }
    for (args, files) in TOOLS {
        for (out, threads) in [("one", "1"), ("three", "3"), ("again", "3")] {
            let output = run_into(out, args, &["--threads", threads], folder.path());
            assert!(output.status.success(), "{}", text(&output.stderr));
            let said: Vec<String> = files.iter().map(|file| format!("{out}/{file}")).collect();
            assert_eq!(text(&output.stdout).lines().collect::<Vec<_>>(), said);
        }
        for file in files {
            let read = |out: &str| fs::read(folder.path().join(out).join(file)).expect("a map");
            assert!(read("one") == read("three") && read("three") == read("again"), "{file}");
            let map = files::read(&folder.path().join("one").join(file)).expect("an image");
            assert_eq!((map.width, map.height), (48, 32));
            assert!(map.values.chunks_exact(map.channels).any(|texel| texel != &map.values[..map.channels]), "{file}");
        }
    }
    assert_eq!(names(&folder.path().join("one")), ["h.png", "n.png", "o.png", "s.png", "z_0.exr", "z_1.exr"]);
}

#[test]
fn files_hold_as_many_bits_as_asked_for_and_are_replaced() {
    let folder = maps_folder();
    let color = |name: &str| image::open(folder.path().join(name)).expect("an image").color();
    fs::write(folder.path().join("n.png"), "something else").expect("written");
    done(&["normal", "height.png", "-o", "n.png"], folder.path());
    assert_eq!(color("n.png"), image::ColorType::Rgb8);
    done(&["normal", "height.png", "-o", "n.png", "--bits", "16"], folder.path());
    assert_eq!(color("n.png"), image::ColorType::Rgb16);
    done(&["normal", "height.png", "-o", "n.exr"], folder.path());
    assert_eq!(color("n.exr"), image::ColorType::Rgb32F);
    done(&["height", "color.png", "-o", "h.png"], folder.path());
    assert_eq!(color("h.png"), image::ColorType::L16);
    done(&["horizon", "height.png", "-o", "of.two.png"], folder.path());
    assert_eq!((color("of.two_0.png"), color("of.two_1.png")), (image::ColorType::Rgba8, image::ColorType::Rgba8));
    done(&["horizon", "height.png", "-o", "plain"], folder.path());
    assert_eq!(color("plain_1.png"), image::ColorType::Rgba8);
}

#[test]
fn bad_input_is_one_clear_error_and_nothing_is_written() {
    let folder = maps_folder();
    let path = folder.path();
    fs::create_dir(path.join("folder")).expect("a folder");
    fs::write(path.join("text.png"), "not an image").expect("written");
    fs::write(path.join("empty.png"), "").expect("written");
    let height = fs::read(path.join("height.png")).expect("a map");
    fs::write(path.join("torn.png"), &height[..height.len() / 2]).expect("written");
    image::GrayImage::new(20_000, 1).save(path.join("wide.png")).expect("written");
    image::GrayImage::new(7, 7).save(path.join("small.png")).expect("written");
    let nan = image::Rgb32FImage::from_pixel(4, 4, image::Rgb([f32::NAN; 3]));
    nan.save(path.join("nan.exr")).expect("written");
    let before = names(path);
    let normal = |file: &str| relief(&["normal", file, "-o", "out.png"], path);
    assert_fails(&normal("missing.png"), 2, &["missing.png", "No such file"]);
    assert_fails(&normal("folder"), 2, &["folder", "not a regular file"]);
    assert_fails(&normal("text.png"), 2, &["text.png", "expected a PNG"]);
    assert_fails(&normal("empty.png"), 2, &["empty.png", "expected a PNG"]);
    assert_fails(&normal("torn.png"), 2, &["torn.png"]);
    assert_fails(&normal("wide.png"), 2, &["wide.png", "at most 16384 texels along a side"]);
    assert_fails(&normal("nan.exr"), 2, &["nan.exr", "finite", "(0, 0)"]);
    let colour = ["color.png", "expected a grey image", "--channel", "relief map height"];
    assert_fails(&normal("color.png"), 2, &colour);
    assert_fails(&relief(&["horizon", "color.png", "-o", "out.png"], path), 2, &colour);
    assert_fails(&relief(&["offset", "color.png", "-o", "out.png"], path), 2, &colour);
    let metal = |base: &str, metallic: &str| {
        let args =
            ["specular", "height.png", "--from", "gloss", "-o", "out.png", "--base", base, "--metallic", metallic];
        relief(&args, path)
    };
    assert_fails(&metal("small.png", "orm.png"), 2, &["small.png", "expected 48×32", "found 7×7"]);
    assert_fails(&metal("color.png", "small.png"), 2, &["small.png", "expected 48×32", "found 7×7"]);
    assert_eq!(names(path), before, "nothing is written");
}

#[test]
fn bad_arguments_say_what_was_expected() {
    let folder = maps_folder();
    let path = folder.path();
    let before = names(path);
    let normal = |more: &[&str]| relief(&[&["normal", "height.png"], more].concat(), path);
    assert_fails(&normal(&[]), 2, &["--output"]);
    assert_fails(&normal(&["-o", "out.jpg"]), 2, &["out.jpg", ".png or .exr"]);
    for bits in ["8", "16"] {
        let needles = ["--bits: out.exr holds 32-bit floats", ".png"];
        assert_fails(&normal(&["-o", "out.exr", "--bits", bits]), 2, &needles);
        assert_fails(&relief(&["height", "color.png", "-o", "out.exr", "--bits", bits], path), 2, &needles);
    }
    let horizon = relief(&["horizon", "height.png", "-o", "out.exr", "--bits", "8"], path);
    assert_fails(&horizon, 2, &["--bits: out_0.exr holds 32-bit floats"]);
    let specular = relief(&["specular", "height.png", "--from", "gloss", "-o", "out.exr", "--bits", "8"], path);
    assert_fails(&specular, 2, &["--bits: out.exr holds 32-bit floats"]);
    assert_fails(&normal(&["-o", "out.png", "--height-scale=-1"]), 2, &["from 0 to 1000"]);
    assert_fails(&normal(&["-o", "out.png", "--strength", "NaN"]), 2, &["from 0 to 1000"]);
    assert_fails(&normal(&["-o", "out.png", "--filter", "sobol"]), 2, &["sobel", "scharr", "central"]);
    assert_fails(&normal(&["-o", "out.png", "--preview", "p.jpg"]), 2, &["p.jpg", ".png"]);
    assert_fails(&normal(&["-o", "out.png", "--preview", "out.png"]), 2, &["another name"]);
    assert_fails(&relief(&["height", "color.png", "-o", "o.png", "--blur", "9999"], path), 2, &["from 0 to 512"]);
    assert_fails(&relief(&["horizon", "height.png", "-o", "o.png", "--max-distance", "0"], path), 2, &["max-distance"]);
    assert_fails(&relief(&["specular", "height.png", "-o", "o.png"], path), 2, &["--from"]);
    let base = ["specular", "height.png", "-o", "o.png", "--from", "gloss", "--base", "color.png"];
    assert_fails(&relief(&base, path), 2, &["--metallic"]);
    assert_fails(&relief(&[], path), 2, &["normal", "horizon"]);
    assert_eq!(names(path), before, "nothing is written");
}

#[test]
fn outputs_that_cannot_be_written_are_found_before_the_work() {
    let folder = maps_folder();
    let path = folder.path();
    fs::create_dir(path.join("taken.png")).expect("a folder");
    let before = names(path);
    for (args, _) in TOOLS {
        assert_fails(&run_into("nowhere", args, &[], path), 2, &["no such directory: nowhere"]);
    }
    // Found first, though the input is no good either.
    let nowhere = ["nowhere/n.png: no such directory: nowhere"];
    assert_fails(&relief(&["normal", "missing.png", "-o", "nowhere/n.png"], path), 2, &nowhere);
    assert_fails(&relief(&["normal", "height.png", "-o", "taken.png"], path), 2, &["taken.png: is a directory"]);
    let preview = ["normal", "height.png", "-o", "n.png", "--preview", "nowhere/p.png"];
    assert_fails(&relief(&preview, path), 2, &["nowhere/p.png: no such directory: nowhere"]);
    assert_eq!(names(path), before, "nothing is written");
}

#[test]
fn a_colour_image_is_read_by_the_channel_named() {
    let folder = maps_folder();
    let path = folder.path();
    let bytes = |file: &str, channel: &str| {
        done(&["normal", file, "-o", "n.png", "--channel", channel], path);
        fs::read(path.join("n.png")).expect("a map")
    };
    let red = bytes("color.png", "r");
    assert!(red == bytes("height.png", "luminance"), "the red of one is the grey of the other");
    assert!(red != bytes("color.png", "g") && red != bytes("color.png", "luminance"));
    let flat = bytes("color.png", "a");
    let flat = image::load_from_memory(&flat).expect("an image").into_rgb8();
    assert!(flat.pixels().all(|p| p.0 == [128, 128, 255]), "no alpha is 1 everywhere");
}

#[test]
fn no_input_is_overwritten() {
    let folder = maps_folder();
    let names_before = names(folder.path());
    let before = fs::read(folder.path().join("height.png")).expect("there");
    let refused: [&[&str]; 4] = [
        &["normal", "height.png", "-o", "height.png"],
        &["offset", "height.png", "-o", "o.png", "--preview", "./height.png"],
        &["height", "color.png", "-o", "./color.png"],
        &[
            "specular",
            "height.png",
            "--from",
            "gloss",
            "--base",
            "color.png",
            "--metallic",
            "orm.png",
            "-o",
            "color.png",
        ],
    ];
    for args in refused {
        assert_fails(&relief(args, folder.path()), 2, &["the output would overwrite the input; expected another name"]);
    }
    assert_eq!(fs::read(folder.path().join("height.png")).expect("there"), before);
    assert_eq!(names(folder.path()), names_before);
}

#[test]
fn without_an_adapter_the_map_is_there_and_the_preview_is_not() {
    let folder = maps_folder();
    let args = ["map", "normal", "height.png", "-o", "n.png", "--preview", "p.png"];
    let output = common::command(&args, folder.path()).env("WGPU_ADAPTER_NAME", "no such adapter").output();
    assert_fails(&output.expect("the binary runs"), 3, &["p.png", "preview", "no graphics adapter"]);
    assert_eq!(names(folder.path()), ["color.png", "height.png", "n.png", "orm.png"]);
}

/// Damaged OpenEXR files are refused, or read as something: never a panic, never a lot of memory.
#[test]
fn damaged_floats_are_refused() {
    let folder = maps_folder();
    done(&["normal", "height.png", "-o", "n.exr"], folder.path());
    let whole = fs::read(folder.path().join("n.exr")).expect("a map");
    let path = folder.path().join("damaged.exr");
    let read = |bytes: &[u8]| {
        fs::write(&path, bytes).expect("written");
        files::read(&path).map(|map| map.width * map.height)
    };
    assert_eq!(read(&whole).expect("whole"), 48 * 32);
    for length in (0..whole.len()).step_by(whole.len() / 60) {
        assert!(read(&whole[..length]).is_err(), "cut after {length} bytes");
    }
    for at in 0..600.min(whole.len()) {
        for value in [0x00, 0x7f, 0x80, 0xff] {
            let mut bytes = whole.clone();
            bytes[at] = value;
            let _ = read(&bytes);
        }
    }
}

/// Every texture of the test data that a tool can take, and what it is.
fn real_sets(data: &Path) -> Vec<(&'static str, Vec<&'static str>, PathBuf)> {
    let at = |file: &str| data.join("textures").join(file);
    let heights: [(&str, &[&str]); 3] = [
        ("layingrock-panda3d/layingrock-h.jpg", &["--invert"]),
        ("parallax-cube-bevy/cube_depth.png", &["--invert", "--height-scale", "0.1"]),
        ("brick-tga-osg/rockwall_NH.png", &["--channel", "a"]),
    ];
    let colors = [
        "brick-panda3d/brick-c.jpg",
        "brick-tga-osg/Brick-Norman-Brown.TGA",
        "brick-tga-osg/Brick-Std-Orange.TGA",
        "brick-tga-osg/rockwall.png",
        "cobble-learnwgpu/cobble-diffuse.png",
        "layingrock-panda3d/layingrock-c.jpg",
        "parallax-cube-bevy/cube_color.png",
    ];
    let mut sets = Vec::new();
    for (file, options) in heights {
        sets.extend(["normal", "horizon", "offset"].map(|tool| (tool, options.to_vec(), at(file))));
    }
    sets.extend(colors.map(|file| ("height", vec!["--remove-shading", "40"], at(file))));
    for model in ["phong", "specular_glossiness"] {
        let options = vec!["--from", "gloss", "--shading", model];
        sets.push(("specular", options, at("runesword-spec-babylon/moltenDagger_gloss.png")));
    }
    sets
}

#[test]
fn real_textures_go_through_every_tool_and_are_drawn() {
    let Some(data) = common::test_data() else { return };
    let Some(folder) = with_gpu(Folder::new) else { return };
    for (tool, options, file) in real_sets(&data) {
        let source = files::read(&file).expect("a texture");
        let input = file.to_string_lossy();
        let args = [&[tool, &input, "-o", "map.png", "--preview", "look.png"], options.as_slice()].concat();
        done(&args, folder.path());
        let name = if tool == "horizon" { "map_1.png" } else { "map.png" };
        let map = files::read(&folder.path().join(name)).expect("a map");
        assert_eq!((map.width, map.height), (source.width, source.height), "{tool} {input}");
        let (least, most) = map.values.iter().fold((1.0f32, 0.0f32), |(a, b), v| (a.min(*v), b.max(*v)));
        assert!(most - least > 0.1, "{tool} {input}: something is to be seen");
        let look = image::open(folder.path().join("look.png")).expect("a picture").into_rgb8();
        let middle: Vec<_> = (0..512).map(|x| look.get_pixel(x, 256).0).collect();
        assert!(look.dimensions() == (512, 512) && middle.iter().any(|p| p != &middle[0]), "{tool} {input}");
    }
}

/// The published normal map of a texture is the one made of its height map: the same lean, texel by texel.
#[test]
fn a_published_normal_map_is_the_one_made_of_its_heights() {
    let Some(data) = common::test_data() else { return };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let set = data.join("textures/parallax-cube-bevy");
    let depth = set.join("cube_depth.png");
    let args = ["normal", &depth.to_string_lossy(), "-o", "n.png", "--invert", "--height-scale", "0.1"];
    done(&args, folder.path());
    let (ours, theirs) = (files::read(&folder.path().join("n.png")), files::read(&set.join("cube_normal.png")));
    let (ours, theirs) = (ours.expect("a map"), theirs.expect("a map"));
    for channel in 0..2 {
        let of = |map: &relief::tools::maps::Raster| -> Vec<f32> {
            map.values.chunks_exact(map.channels).map(|texel| texel[channel] - 0.5).collect()
        };
        let (a, b) = (of(&ours), of(&theirs));
        let product = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| f64::from(a * b)).sum::<f64>();
        let alike = product(&a, &b) / (product(&a, &a) * product(&b, &b)).sqrt();
        println!("channel {channel}: correlation {alike}");
        assert!(alike > 0.9, "channel {channel}: correlation {alike}");
    }
}
