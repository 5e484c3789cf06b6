//! A folder where a file can be read with all that it names: a copy of `assets/` in which images have a few texels and
//! models a box at each of their nodes, for what is read a thousand times a minute has to be small.

use relief::import::load_model;
use serde_json::json;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use systems::assets::Library;

/// The folder, and the name that this process gives its files there.
#[derive(Debug)]
pub struct Place {
    folder: PathBuf,
    own: String,
}

impl Place {
    /// A folder that [`Self::prepare`] has filled.
    pub fn new(folder: &Path) -> Self {
        Self { folder: folder.to_owned(), own: format!("fuzz-{}", std::process::id()) }
    }

    /// Fills a folder.
    ///
    /// # Errors
    /// Errors of the file system.
    pub fn prepare(folder: &Path) -> io::Result<()> {
        let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets");
        for entry in ["scenes", "textures", "models"] {
            fs::create_dir_all(folder.join(entry))?;
        }
        fs::copy(assets.join("vehicles.ron"), folder.join("vehicles.ron"))?;
        for entry in fs::read_dir(assets.join("textures"))?.flatten() {
            let texels = image::RgbImage::from_fn(8, 4, |x, y| image::Rgb([x as u8 * 30, y as u8 * 60, 200]));
            let mut png = io::Cursor::new(Vec::new());
            texels.write_to(&mut png, image::ImageFormat::Png).map_err(io::Error::other)?;
            fs::write(folder.join("textures").join(entry.file_name()), png.into_inner())?;
        }
        for entry in fs::read_dir(assets.join("models"))?.flatten() {
            let mut library = Library::default();
            let Ok(model) = load_model(&entry.path(), &mut library) else { continue };
            let names: Vec<&str> = model.nodes.iter().map(|node| node.name.as_str()).collect();
            let materials: Vec<&str> =
                library.materials().map(|(_, material)| material.name.as_str()).filter(|n| !n.is_empty()).collect();
            fs::write(folder.join("models").join(entry.file_name()), boxes(&names, &materials))?;
        }
        Ok(())
    }

    /// Writes a file into one of its folders.
    ///
    /// # Panics
    /// If it cannot be written: nothing was tried then.
    pub fn write(&self, within: &str, suffix: &str, bytes: &[u8]) -> PathBuf {
        let path = self.folder.join(within).join(format!("{}{suffix}", self.own));
        fs::write(&path, bytes).expect("the folder can be written to");
        path
    }
}

/// A glTF document with a box at each node, in the materials in turn.
fn boxes(names: &[&str], materials: &[&str]) -> String {
    let corner = |i: u32, axis: u32| if i >> axis & 1 == 0 { -0.5f32 } else { 0.5 };
    let positions = (0..8).flat_map(|i| [corner(i, 0), corner(i, 1), corner(i, 2)]);
    let indices: [u8; 12] = [0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6];
    let bytes: Vec<u8> = positions.flat_map(f32::to_le_bytes).chain(indices).collect();
    let data: String = bytes.iter().map(|byte| format!("%{byte:02x}")).collect();
    let mesh = |material: usize| json!({ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1, "material": material }] });
    let materials = if materials.is_empty() { &["plain"] } else { materials };
    let node =
        |(i, name): (usize, &&str)| json!({ "name": name, "mesh": i % materials.len(), "translation": [0, 0, i] });
    json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": (0..names.len()).collect::<Vec<_>>() }],
        "nodes": names.iter().enumerate().map(node).collect::<Vec<_>>(),
        "materials": materials.iter().map(|name| json!({ "name": name })).collect::<Vec<_>>(),
        "meshes": (0..materials.len()).map(mesh).collect::<Vec<_>>(),
        "buffers": [{ "byteLength": bytes.len(), "uri": format!("data:application/octet-stream,{data}") }],
        "bufferViews": [{ "buffer": 0, "byteLength": 96 }, { "buffer": 0, "byteOffset": 96, "byteLength": 12 }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3",
              "min": [-0.5, -0.5, -0.5], "max": [0.5, 0.5, 0.5] },
            { "bufferView": 1, "componentType": 5121, "count": 12, "type": "SCALAR" },
        ],
    })
    .to_string()
}
