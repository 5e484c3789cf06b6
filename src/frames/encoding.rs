//! Kinds of pictures of a frame, and their encoding.

use crate::export::picture;
use crate::name;
use crate::renderer::{OutputSet, SingleView};
use bevy_ecs::prelude::*;
use glam::DVec3;
use image::buffer::ConvertBuffer;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;
use systems::assets::MeshId;
use systems::draw::pieces::{PieceOf, WholeMesh};
use systems::space::origin::Origin;

/// A kind of picture that is written for each frame.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OutputKind {
    /// The tone-mapped picture, 8-bit sRGB.
    Color,
    /// Distance along the viewing direction: 16-bit grey, 1/256 m per step, 0 where there is nothing or it is farther
    /// than 255.99 m (the convention of the KITTI data set).
    Depth,
    /// World-space shading normal, 8 bits: 0.5 + 0.5·n.
    Normal,
    /// Entity ids as 24-bit colour (red lowest byte), 0 for nothing; `ids.json` names them.
    Id,
}

impl OutputKind {
    /// All kinds with their names, with which the names of their files begin.
    pub const ALL: [(&'static str, Self); 4] =
        [("color", Self::Color), ("depth", Self::Depth), ("normal", Self::Normal), ("id", Self::Id)];

    pub(super) fn name(self) -> &'static str {
        name::of(&Self::ALL, self)
    }
}

/// Tells if a whole picture of that size is there: one that was cut short, by others than this program, lacks its end.
pub(crate) fn is_written(path: &Path, size: (u32, u32)) -> bool {
    // The last chunk of a PNG file: no data, its name, and the checksum of that (PNG specification, 11.2.5).
    const END: [u8; 12] = *b"\0\0\0\0IEND\xAE\x42\x60\x82";
    let mut end = [0; END.len()];
    let read_end = |mut file: File| {
        file.seek(SeekFrom::End(-(END.len() as i64)))?;
        file.read_exact(&mut end)
    };
    let is_whole = File::open(path).and_then(read_end).is_ok() && end == END;
    is_whole && image::image_dimensions(path).is_ok_and(|found| found == size)
}

/// Outputs that are drawn for some kinds.
pub(super) fn outputs_of(kinds: &[OutputKind]) -> OutputSet {
    kinds.iter().fold(OutputSet::NONE, |all, kind| {
        all.with(match kind {
            OutputKind::Color => OutputSet::COLOR,
            OutputKind::Depth => OutputSet { depth: true, ..OutputSet::NONE },
            OutputKind::Normal => OutputSet { normal: true, ..OutputSet::NONE },
            OutputKind::Id => OutputSet { id: true, ..OutputSet::NONE },
        })
    })
}

/// The pictures of what was prepared, of each kind once.
pub(super) fn pictures(renderer: &mut SingleView, kinds: &[OutputKind]) -> Vec<(OutputKind, image::DynamicImage)> {
    let mut pictures = Vec::new();
    let Some(mut outputs) = renderer.draw_outputs(outputs_of(kinds)) else { return pictures };
    let size = (outputs.width, outputs.height);
    for &kind in kinds {
        let picture: Option<image::DynamicImage> = match kind {
            OutputKind::Color => outputs.picture.take().map(|picture| {
                let rgb: image::RgbImage = picture.convert();
                rgb.into()
            }),
            OutputKind::Depth => picture::of_metres(size, &outputs.depths()),
            OutputKind::Normal => picture::of_normals(size, &outputs.normals()),
            OutputKind::Id => picture::of_numbers(size, outputs.ids()),
        };
        pictures.extend(picture.map(|picture| (kind, picture)));
    }
    pictures
}

/// JSON: the id in the picture → the entity's name, its parent's where it has none; `origin`, where it is not zero:
/// where the world's places count from, in the scene's coordinates.
pub(super) fn names_of_ids(world: &mut World) -> String {
    type DrawnEntity = (Or<(With<MeshId>, With<WholeMesh>)>, Without<PieceOf>);
    let mut drawn = world.query_filtered::<Entity, DrawnEntity>();
    let entities: Vec<Entity> = drawn.iter(world).collect();
    let names: BTreeMap<u32, String> =
        entities.into_iter().map(|entity| (entity.index().index() + 1, name::of_entity(world, entity))).collect();
    let origin = world.resource::<Origin>().0;
    let origin = (origin != DVec3::ZERO).then(|| format!("  \"origin\": {}", serde_json::json!(origin.to_array())));
    let quoted = names.iter().map(|(id, name)| format!("  \"{id}\": {}", serde_json::Value::from(name.as_str())));
    let quoted: Vec<String> = origin.into_iter().chain(quoted).collect();
    format!("{{\n{}\n}}\n", quoted.join(",\n"))
}
