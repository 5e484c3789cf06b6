//! Sound and broken files to begin with, of each target.

use crate::runs::{self, Record};
use crate::{Place, TARGETS};
use image::{DynamicImage, ImageFormat};
use relief::recording::RunFiles;
use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Cursor};
use std::path::{Path, PathBuf};
use systems::lights::Light;
use systems::run::inputs::{Inputs, SavedInput};
use systems::run::registry::StateId;
use systems::run::snapshot;
use systems::run::spawn::Spawn;
use systems::run::standard_inputs::{
    Despawn, Drive, EditLight, Hide, MoveVehicle, NextMeshVariant, ReleaseVehicle, SetManualControl, SetTransform,
};
use systems::space::Transform;
use systems::vehicles::{Controls, StampedMotion};

/// Files of at most so many bytes; what is small is changed where it matters.
const MOST_BYTES: u64 = 40 << 10;

/// Seeds by the names of targets.
pub type Seeds = BTreeMap<&'static str, Vec<Vec<u8>>>;

/// Seeds of all targets: from the project's files, made ones, and from a folder of test data if there is one. Puts the
/// files that models name into the place.
///
/// # Errors
/// Errors of the file system.
pub fn all(place: &Path, data: Option<&Path>) -> io::Result<Seeds> {
    let mut seeds = Seeds::new();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut files = Vec::new();
    for folder in [Some(place), data, Some(&*root.join("assets"))].into_iter().flatten() {
        list(folder, &mut files)?;
    }
    for file in files {
        let bytes = fs::read(&file)?;
        let extension = file.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        if let Some(name) = file.file_name().filter(|_| ["bin", "png", "jpg", "jpeg"].contains(&&*extension)) {
            fs::write(place.join("models").join(name), &bytes)?;
        }
        let target = match &*extension {
            "gltf" | "glb" if bytes.starts_with(b"glTF") => "glb",
            "gltf" | "glb" => "gltf",
            "png" => "png",
            "jpg" | "jpeg" => "jpeg",
            "tga" => "tga",
            "bmp" => "bmp",
            "webp" => "webp",
            "dds" => "dds",
            "exr" => "exr",
            "ron" if file.ends_with("vehicles.ron") => "vehicles",
            "ron" => "scene",
            _ => continue,
        };
        seeds.entry(target).or_default().push(bytes);
    }
    of_documentation(&root, &mut seeds)?;
    single_types(&mut seeds);
    pictures(&mut seeds)?;
    of_runs(&Place::new(place), &mut seeds)?;
    let small = |target: &str| seeds[target].iter().filter(|bytes| bytes.len() < 3 << 10).cloned();
    let drawn = small("scene").chain(small("gltf")).collect();
    let compared = small("png").chain(small("exr")).collect();
    seeds.insert("drawn", drawn);
    seeds.insert("picture", compared);
    assert!(
        TARGETS.iter().all(|target| seeds.get(target.name).is_some_and(|all| !all.is_empty())),
        "a target has none"
    );
    Ok(seeds)
}

fn list(folder: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    let mut entries: Vec<PathBuf> = fs::read_dir(folder)?.flatten().map(|entry| entry.path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            list(&path, files)?;
        } else if fs::metadata(&path)?.len() <= MOST_BYTES {
            files.push(path);
        }
    }
    Ok(())
}

/// The examples of the pages on scenes and vehicles, each within a scene.
fn of_documentation(root: &Path, seeds: &mut Seeds) -> io::Result<()> {
    for page in ["docs/scenes.md", "docs/vehicles.md"] {
        let text = fs::read_to_string(root.join(page))?;
        for block in text.split("```").skip(1).step_by(2) {
            let Some((info, block)) = block.split_once('\n') else { continue };
            let scene = match info.strip_prefix("ron ").unwrap_or_default() {
                "scene" => block.to_owned(),
                field @ ("environment" | "clock") => format!("({field}: {block})"),
                "material" => format!("(materials: {{\"a\": {block}}})"),
                "mesh" => format!("(meshes: {{\"a\": {block}}}, entities: [(mesh: \"a\")])"),
                "entity" => format!("(entities: [{block}])"),
                field @ ("transform" | "light" | "camera" | "spin" | "vehicle") => {
                    format!("(entities: [({field}: {block})])")
                }
                "generator" => format!("(generators: [{block}])"),
                "place" => format!("(generators: [(place: {block}, entity: ())])"),
                "route" => format!("(routes: {{\"a\": {block}}})"),
                "signal" => format!("(signals: {{\"a\": {block}}})"),
                _ => continue,
            };
            seeds.entry("scene").or_default().push(scene.into_bytes());
        }
    }
    Ok(())
}

/// Files of one type, of a file of many.
fn single_types(seeds: &mut Seeds) {
    let all = seeds.get("vehicles").and_then(|all| all.first()).cloned().unwrap_or_default();
    let text = String::from_utf8_lossy(&all).into_owned();
    for block in text.split("\n        \"").skip(1) {
        let Some((block, _)) = block.split_once("\n        ),") else { continue };
        let file = format!("(types: {{ \"{block}\n) }})");
        seeds.entry("vehicles").or_default().push(file.into_bytes());
    }
}

/// Images of each kind.
fn pictures(seeds: &mut Seeds) -> io::Result<()> {
    let rgba = image::RgbaImage::from_fn(9, 6, |x, y| image::Rgba([x as u8 * 28, y as u8 * 40, 90, 255 - x as u8 * 9]));
    let rgba = DynamicImage::from(rgba);
    let all = [rgba.to_luma8().into(), rgba.to_rgb8().into(), rgba.clone(), rgba.to_luma16().into()];
    let floats = [rgba.to_rgb32f().into(), rgba.to_rgba32f().into()];
    let formats = [
        ("png", ImageFormat::Png),
        ("jpeg", ImageFormat::Jpeg),
        ("tga", ImageFormat::Tga),
        ("bmp", ImageFormat::Bmp),
        ("webp", ImageFormat::WebP),
        ("exr", ImageFormat::OpenExr),
    ];
    for (target, format) in formats {
        for picture in all.iter().chain(&floats) {
            let mut bytes = Cursor::new(Vec::new());
            // A format takes some kinds only.
            if picture.write_to(&mut bytes, format).is_ok() {
                seeds.entry(target).or_default().push(bytes.into_inner());
            }
        }
    }
    let codes = [b"DXT1", b"DXT2", b"DXT3", b"DXT4", b"DXT5", b"ATI1", b"BC4U", b"BC4S", b"ATI2", b"BC5U", b"BC5S"];
    let blocks = codes.map(|code| dds(4, *code, 0, [0; 5]));
    // DXGI formats: BC1 to BC7, RGBA8, BGRA8, R8, RG8, R16, and others.
    let extended = [71, 74, 77, 80, 83, 95, 98, 28, 29, 87, 91, 61, 49, 56, 2, 10].map(|kind| {
        let mut bytes = dds(4, *b"DX10", 0, [0; 5]);
        let header: [u32; 5] = [kind, 3, 0, 1, 0];
        bytes.splice(128..128, header.into_iter().flat_map(u32::to_le_bytes));
        bytes
    });
    let plain = [
        dds(0x41, [0; 4], 32, [0xff, 0xff00, 0xff_0000, 0xff00_0000, 0]),
        dds(0x40, [0; 4], 24, [0xff_0000, 0xff00, 0xff, 0, 0]),
        dds(0x20000, [0; 4], 8, [0xff, 0, 0, 0, 0]),
    ];
    seeds.entry("dds").or_default().extend(blocks.into_iter().chain(extended).chain(plain));
    Ok(())
}

/// A DDS file of 8×8 texels (Microsoft: Programming Guide for DDS): flags of its pixels, code, bits, masks.
fn dds(flags: u32, code: [u8; 4], bits: u32, masks: [u32; 5]) -> Vec<u8> {
    let mut words = vec![124, 0x1007, 8, 8, 0, 0, 1];
    words.extend([0; 11]);
    words.extend([32, flags, u32::from_le_bytes(code), bits]);
    words.extend(masks);
    words.extend([0x1000, 0, 0, 0]);
    words.truncate(31);
    let mut bytes = b"DDS ".to_vec();
    bytes.extend(words.into_iter().flat_map(u32::to_le_bytes));
    bytes.extend((0..256).map(|i| (i * 37) as u8));
    bytes
}

/// A recorded run with every kind of input, its records, its last state.
fn of_runs(place: &Place, seeds: &mut Seeds) -> io::Result<()> {
    let mut session = runs::session(place);
    let path = place.write("", ".rec", b"");
    let files = RunFiles { record: Some(path.clone()), ..RunFiles::default() };
    session.begin(&files, 0).map_err(io::Error::other)?;
    seeds.entry("state").or_default().push(snapshot::save(&mut session.simulation.world));
    let mut records = Vec::new();
    for step in 0..12 {
        let inputs = inputs(step);
        records.push(Record::Inputs(step, inputs.clone()));
        let mut queue = session.simulation.world.resource_mut::<Inputs>();
        inputs.into_iter().for_each(|input| queue.push_saved(input));
        session.step().map_err(io::Error::other)?;
    }
    session.finish().map_err(io::Error::other)?;
    seeds.entry("recording").or_default().push(fs::read(path)?);
    let encoded = |record: &Record| postcard::to_stdvec(record).map_err(io::Error::other);
    let state = snapshot::save(&mut session.simulation.world);
    seeds.entry("replay").or_default().push(encoded(&Record::Snapshot(12, state.clone()))?);
    for record in &records {
        seeds.entry("replay").or_default().push(encoded(record)?);
    }
    let together: io::Result<Vec<Vec<u8>>> = records.iter().map(encoded).collect();
    seeds.entry("replay").or_default().push(together?.concat());
    seeds.entry("state").or_default().push(state);
    let path = place.write("", ".snapshot", b"");
    session.save_snapshot(&path).map_err(io::Error::other)?;
    seeds.entry("snapshot").or_default().push(fs::read(path)?);
    Ok(())
}

fn inputs(step: u64) -> Vec<SavedInput> {
    let (at, light) = (Transform::from_xyz(step as f32, 1.0, 0.0), Light::point(2.0, 5.0));
    let controls = Controls { throttle: 0.5, steer: 0.3, ..Controls::default() };
    let (entity, vehicle, name) = (StateId(step as u32), StateId(3 + step as u32 % 4), format!("new {step}"));
    let van =
        Spawn::Vehicle { name: name.clone(), transform: at, kind: "box".into(), paint: 0, controls, manual: true };
    let moved = StampedMotion { place: at.translation.as_dvec3(), yaw_rate: 0.2, ..StampedMotion::default() };
    match step % 8 {
        0 => vec![SavedInput::of(&Spawn::Light { name, transform: at, light: light.clone() })],
        1 => vec![SavedInput::of(&van)],
        2 => vec![SavedInput::of(&SetTransform { entity, transform: at }), SavedInput::of(&NextMeshVariant)],
        3 => vec![
            SavedInput::of(&Drive { vehicle, controls }),
            SavedInput::of(&SetManualControl { vehicle, manual: true }),
        ],
        4 => vec![
            SavedInput::of(&SetManualControl { vehicle, manual: false }),
            SavedInput::of(&MoveVehicle { vehicle, motion: StampedMotion { stamp: step as f64 / 60.0, ..moved } }),
        ],
        5 => vec![SavedInput::of(&Hide { entity, hidden: true }), SavedInput::of(&ReleaseVehicle(vehicle))],
        6 => vec![SavedInput::of(&EditLight { entity: StateId(8), light })],
        _ => vec![SavedInput::of(&Despawn(StateId(20))), SavedInput::of(&Despawn(entity))],
    }
}

/// Words and names of text seeds, for libFuzzer's dictionary.
pub fn dictionary(seeds: &[Vec<u8>]) -> String {
    let mut words = std::collections::BTreeSet::new();
    for seed in seeds {
        let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let text = String::from_utf8_lossy(seed);
        let all = text.split(|c: char| !is_word(c));
        let is_name = |word: &&str| (3..24).contains(&word.len()) && !word.starts_with(|c: char| c.is_ascii_digit());
        words.extend(all.filter(is_name).map(str::to_owned));
    }
    words.iter().map(|word| format!("\"{word}\"\n")).collect()
}
