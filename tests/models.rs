//! Every model of the test data, drawn: no warning from the graphics stack, and something to see.
//!
//! With `RELIEF_CONTACT_SHEET=FILE.png` the pictures are also put on one sheet, to look at.

mod common;

use crate::common::prelude::*;
use std::sync::Mutex;

/// Warnings and errors that the graphics stack logged.
struct Heard(Mutex<Vec<String>>);

static HEARD: Heard = Heard(Mutex::new(Vec::new()));

impl log::Log for Heard {
    fn enabled(&self, metadata: &log::Metadata) -> bool {
        metadata.level() <= log::Level::Warn
    }

    fn log(&self, record: &log::Record) {
        let text = format!("{}: {}", record.target(), record.args());
        // Machines without Vulkan's validation layer check with wgpu's own validation only. Layers older than 2023 do
        // not know WGSL as a source language (operand 10), and name the device as the object; newer ones want no
        // strides of arrays in function variables, which naga gives them (VUID-StandaloneSpirv-None-10684).
        let known = [
            "VK_LAYER_KHRONOS_validation",
            "Invalid source language operand: 10",
            "VUID-StandaloneSpirv-None-10684",
            "objects: (type: DEVICE",
            // Mesa's software driver where the processor has no half floats, which no shader here packs; the second
            // says the same at length.
            "Missing downlevel flags: DownlevelFlags(SHADER_F16_IN_F32)\nThe underlying API",
            "DownlevelCapabilities {",
        ];
        if self.enabled(record.metadata()) && !known.iter().any(|known| text.contains(known)) {
            self.0.lock().expect("no panic while logging").push(text);
        }
    }

    fn flush(&self) {}
}

/// All `.gltf` and `.glb` files below a folder, sorted.
fn models_below(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder").flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "gltf" || e == "glb") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

#[test]
fn every_model_draws_without_a_warning_or_is_refused_for_a_named_reason() {
    let (Some(gpu), Some(data)) = (common::gpu(), common::test_data()) else { return };
    log::set_logger(&HEARD).expect("the only logger");
    log::set_max_level(log::LevelFilter::Warn);
    drop(gpu);
    let mut headless = Headless::new().expect("an adapter");
    let (side, mut refused, mut drawn) = (96, Vec::new(), Vec::new());
    let files = [models_below(&data.join("models")), models_below(&data.join("asset-generator"))].concat();
    for file in &files {
        let name = file.strip_prefix(&data).expect("below").display().to_string();
        let mut stage = match Session::load(file, &LoadOptions::default()) {
            Ok(stage) => stage,
            Err(error) => {
                refused.push(format!("{name}: {error}"));
                continue;
            }
        };
        let picture = headless.draw(&mut stage.simulation, stage.viewpoint, (side, side)).expect("a picture");
        // Points and lines are left out with a warning; some files hold nothing but lights.
        let explained = !stage.scene.warnings.is_empty() || name.contains("Lights");
        assert!(headless.renderer.read_visible_counts().objects > 0 || explained, "{name}: nothing drawn");
        let burnt = picture.pixels().filter(|p| p.0.iter().all(|&c| c > 250)).count();
        assert!(burnt < (side * side / 2) as usize, "{name}: {burnt} pixels are white");
        drawn.push((name, picture));
    }
    println!("{} drawn, {} refused", drawn.len(), refused.len());
    refused.iter().for_each(|line| println!("refused: {line}"));
    if let Some(sheet) = std::env::var_os("RELIEF_CONTACT_SHEET") {
        contact_sheet(&drawn, side).save(sheet).expect("a writable sheet");
    }
    let heard = HEARD.0.lock().expect("no panic while logging");
    assert!(heard.is_empty(), "{}", heard.join("\n"));
    let reasons = ["requires EXT_meshopt_compression", "requires FAKE_materials_quantumRendering", "needs glTF 2.1"];
    refused.retain(|line| !reasons.iter().any(|reason| line.contains(reason)));
    assert!(refused.is_empty(), "refused for another reason: {refused:?}");
    assert!(drawn.len() > 120);
}

fn contact_sheet(drawn: &[(String, image::RgbaImage)], side: u32) -> image::RgbaImage {
    let columns = 16;
    let mut sheet = image::RgbaImage::new(columns * side, (drawn.len() as u32).div_ceil(columns) * side);
    for (i, (name, picture)) in drawn.iter().enumerate() {
        let (x, y) = (i as u32 % columns * side, i as u32 / columns * side);
        image::imageops::replace(&mut sheet, picture, x.into(), y.into());
        println!("{:3} row {} column {}: {name}", i, i as u32 / columns, i as u32 % columns);
    }
    sheet
}
