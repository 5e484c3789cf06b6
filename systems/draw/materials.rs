//! Materials as the GPU reads them: a record each, their maps as layers of texture arrays.
//!
//! Images of the same size and format share a texture array, so that objects with different materials can be drawn
//! together: only the layer index differs, and that is in the record. What a draw must bind (one array and one sampler
//! per map) is the material's *class*; materials with equal ones share it. A missing map is the layer of a stand-in.
//!
//! An image that is removed leaves a hole in its array, which the next of that size and format fills. Where half of an
//! array are holes the others move up, so arrays shrink; one without images is free for another format. The numbers of
//! classes that no material has are used again, too.

use super::list::{ClassId, DrawList, MaterialClass, PipelineKey, TextureArray};
use super::records::MaterialRecord;
use crate::assets::image::{Image, ImageId, Texels, level_count, level_size};
use crate::assets::library::{Library, Revisions};
use crate::assets::material::{MAP_COUNT, Map, Material, MaterialId};
use bevy_ecs::prelude::*;
use glam::Vec3;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

/// Layers that every adapter offers (WebGPU's default limit); a fuller array is followed by another. A layer is a byte
/// of [`MaterialRecord`].
pub const MOST_LAYERS: usize = 256;
const _: () = assert!(MOST_LAYERS <= 1 << u8::BITS);

/// Bytes of a texture array, at the most, unless one layer has more: graphics drivers need not give more in one piece
/// (Vulkan's `maxMemoryAllocationSize` is a GiB at the least, Direct3D 12 has a quarter of the adapter's memory).
const MOST_ARRAY_BYTES: u64 = 512 << 20;

/// Layers that an array of such a format may have.
pub fn most_layers(array: &TextureArray) -> usize {
    let levels = (0..level_count(array.width, array.height)).map(|level| {
        let (width, height) = level_size(array.width, array.height, level);
        // As texels, where an adapter cannot read blocks.
        u64::from(width) * u64::from(height) * if array.texels == Texels::Rgba16Float { 8 } else { 4 }
    });
    (MOST_ARRAY_BYTES / levels.sum::<u64>().max(1)).clamp(1, MOST_LAYERS as u64) as usize
}

/// Stand-ins for missing maps, in the order of [`crate::assets::MapSlot`].
const STAND_INS: [ImageId; MAP_COUNT] = [
    ImageId::WHITE_COLOR,
    ImageId::FLAT_NORMAL,
    ImageId::WHITE_DATA,
    ImageId::WHITE_DATA,
    ImageId::WHITE_DATA,
    ImageId::WHITE_COLOR,
    ImageId::WHITE_DATA,
    ImageId::BLACK_DATA,
    ImageId::BLACK_DATA,
    ImageId::NO_OFFSET,
    ImageId::WHITE_COLOR,
];

/// Placement of materials in classes, and of images in layers of texture arrays.
#[derive(Resource, Debug, Default)]
pub struct MaterialTable {
    /// By slot.
    placed: Vec<Option<Placed>>,
    /// The layer of each image that has one, by slot.
    layers: Vec<Option<Layer>>,
    classes: BTreeMap<MaterialClass, ClassUse>,
    free_classes: BTreeSet<u32>,
    /// Revisions of the library that have been placed.
    seen: Revisions,
    /// By slot, up to the last of them: materials whose objects are to be grouped anew. Their class or pipeline is
    /// another, or they are new or gone: objects with a material that is not there are drawn with the default.
    regrouped: Vec<bool>,
}

/// Placement of a material.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Placed {
    id: MaterialId,
    class: ClassId,
    pipeline: PipelineKey,
}

/// Placement of an image.
#[derive(Clone, Copy, Debug)]
struct Layer {
    image: ImageId,
    array: u32,
    layer: u32,
}

/// A class, and how many materials have it.
#[derive(Clone, Copy, Debug)]
struct ClassUse {
    id: ClassId,
    materials: u32,
}

impl MaterialTable {
    /// The class and the pipeline of a material, without what the object decides (mesh, mirroring); those of the
    /// default for an unknown one.
    pub fn placed(&self, material: MaterialId) -> (ClassId, PipelineKey) {
        let found = self.find(material).or(self.find(MaterialId::DEFAULT));
        found.map(|placed| (placed.class, placed.pipeline)).unwrap_or_default()
    }

    /// The material, or the default where it has no record.
    pub(crate) fn known(&self, material: MaterialId) -> MaterialId {
        if self.find(material).is_some() { material } else { MaterialId::DEFAULT }
    }

    fn find(&self, material: MaterialId) -> Option<&Placed> {
        self.placed.get(material.slot() as usize)?.as_ref().filter(|placed| placed.id == material)
    }

    /// Tells if any objects are to be grouped anew.
    pub(crate) fn regroups(&self) -> bool {
        !self.regrouped.is_empty()
    }

    /// Tells if objects of that material are to be grouped anew: one that was in its slot, or came there.
    pub(crate) fn is_regrouped(&self, material: MaterialId) -> bool {
        self.regrouped.get(material.slot() as usize).is_some_and(|is| *is)
    }

    fn regroup(&mut self, slot: u32) {
        let index = slot as usize;
        self.regrouped.resize(self.regrouped.len().max(index + 1), false);
        self.regrouped[index] = true;
    }

    /// Frees the layers of images that are gone or have another format now; adds the slots of materials whose images
    /// changed, or lie in another layer.
    fn follow_images(&mut self, library: &Library, list: &mut DrawList, materials: &mut BTreeSet<u32>) {
        let mut moved: BTreeSet<u32> = library.changed_images(self.seen.images).collect();
        if moved.is_empty() {
            return;
        }
        let mut with_holes = BTreeSet::new();
        for &slot in &moved {
            let Some(place) = self.layers.get_mut(slot as usize) else { break };
            let Some(Layer { image, array, layer }) = *place else { continue };
            let layers = &mut list.texture_arrays[array as usize];
            if library.image(image).is_none_or(|image| !layers.same_format(&TextureArray::of(image))) {
                layers.layers[layer as usize] = None;
                *place = None;
                with_holes.insert(array);
            }
        }
        for array in with_holes {
            let layers = &mut list.texture_arrays[array as usize].layers;
            close_holes(layers);
            for (layer, image) in (0..).zip(layers.iter()).filter_map(|(layer, image)| Some((layer, (*image)?))) {
                let place = &mut self.layers[image.slot() as usize];
                if place.is_some_and(|place| place.layer != layer) {
                    moved.insert(image.slot());
                }
                *place = Some(Layer { image, array, layer });
            }
            list.textures_version += 1;
        }
        for id in self.placed.iter().flatten().map(|placed| placed.id) {
            let maps = library.material(id).map(Material::maps).unwrap_or_default();
            if maps.into_iter().flatten().any(|map| moved.contains(&map.image.slot())) {
                materials.insert(id.slot());
            }
        }
    }

    /// The array and the layer of an image of the library.
    fn layer(&mut self, id: ImageId, image: &Image, list: &mut DrawList) -> (u32, u32) {
        let slot = id.slot() as usize;
        self.layers.resize(self.layers.len().max(slot + 1), None);
        if let Some(place) = self.layers[slot] {
            return (place.array, place.layer);
        }
        let (wanted, arrays) = (TextureArray::of(image), &mut list.texture_arrays);
        let has_room = |a: &TextureArray| a.layers.len() < most_layers(a) || a.layers.contains(&None);
        let array = arrays.iter().position(|a| a.same_format(&wanted) && has_room(a)).unwrap_or_else(|| {
            // One that lost all its images, or a new one.
            let empty = arrays.iter().position(|a| a.layers.is_empty()).unwrap_or(arrays.len());
            if empty == arrays.len() {
                arrays.push(wanted);
            } else {
                arrays[empty] = wanted;
            }
            empty
        });
        let layers = &mut arrays[array].layers;
        let layer = layers.iter().position(Option::is_none).unwrap_or(layers.len());
        if layer == layers.len() {
            layers.push(None);
        }
        layers[layer] = Some(id);
        list.textures_version += 1;
        let (array, layer) = (array as u32, layer as u32);
        self.layers[slot] = Some(Layer { image: id, array, layer });
        (array, layer)
    }

    fn place(&mut self, material: &Material, library: &Library, list: &mut DrawList) -> (ClassId, MaterialRecord) {
        let mut class = MaterialClass::default();
        let mut record = record(material);
        for (slot, map) in material.maps().into_iter().enumerate() {
            let map = map.unwrap_or_else(|| Map::new(STAND_INS[slot]));
            let Some(image) = library.image(map.image) else { continue };
            let (array, layer) = self.layer(map.image, image, list);
            class.arrays[slot] = array;
            class.samplers[slot] = map.sampler;
            record.layers[slot] = layer as u8;
            record.image_from_mesh_uv[slot] = map.image_from_mesh_uv.matrix2.to_cols_array();
            record.offsets[slot] = map.image_from_mesh_uv.translation.to_array();
            record.second_uvs |= map.uv_set.min(1) << slot;
        }
        (self.take_class(class, list), record)
    }

    /// The id of a class, which one more material has.
    fn take_class(&mut self, class: MaterialClass, list: &mut DrawList) -> ClassId {
        let used = self.classes.entry(class).or_insert_with(|| {
            let id = self.free_classes.pop_first().unwrap_or(list.classes.len() as u32);
            match list.classes.get_mut(id as usize) {
                Some(free) => *free = class,
                None => list.classes.push(class),
            }
            list.textures_version += 1;
            ClassUse { id: ClassId(id), materials: 0 }
        });
        used.materials += 1;
        used.id
    }

    /// One material less has that class.
    fn release_class(&mut self, id: ClassId, list: &mut DrawList) {
        let class = list.classes[id.0 as usize];
        let Some(used) = self.classes.get_mut(&class) else { return };
        used.materials -= 1;
        if used.materials == 0 {
            self.classes.remove(&class);
            self.free_classes.insert(id.0);
            // Nothing that may go is bound for it.
            list.classes[id.0 as usize] = MaterialClass::default();
            list.textures_version += 1;
        }
    }

    /// Brings what is known of the material in a slot up to date; says whether it went elsewhere.
    fn update(&mut self, slot: u32, library: &Library, list: &mut DrawList) -> bool {
        let placed = library.material_in_slot(slot).map(|(id, material)| {
            let material = with_images(material, library);
            let (class, record) = self.place(&material, library, list);
            list.materials.write(slot, record);
            Placed { id, class, pipeline: pipeline(&material) }
        });
        let index = slot as usize;
        self.placed.resize(self.placed.len().max(index + 1), None);
        let before = std::mem::replace(&mut self.placed[index], placed);
        if let Some(before) = before {
            self.release_class(before.class, list);
        }
        if placed.is_none() && before.is_some() {
            list.materials.write(slot, MaterialRecord::default());
        }
        placed != before
    }
}

/// Takes holes off the end of an array, and all of them where they are half of it or more.
fn close_holes(layers: &mut Vec<Option<ImageId>>) {
    while layers.last() == Some(&None) {
        layers.pop();
    }
    if 2 * layers.iter().flatten().count() <= layers.len() {
        layers.retain(Option::is_some);
    }
}

/// The material without maps whose images are not there.
fn with_images<'a>(material: &'a Material, library: &Library) -> Cow<'a, Material> {
    let lacks = |map: &Map| library.image(map.image).is_none();
    if !material.maps().iter().flatten().any(lacks) {
        return Cow::Borrowed(material);
    }
    let mut material = material.clone();
    for map in material.maps_mut() {
        map.take_if(|map| lacks(map));
    }
    Cow::Owned(material)
}

/// Without its maps.
fn record(material: &Material) -> MaterialRecord {
    MaterialRecord {
        base_factor: material.base_factor.to_array(),
        specular_factor: material.specular_factor.to_array(),
        shininess: material.shininess,
        emissive_factor: material.emissive_factor.to_array(),
        normal_scale: material.normal_scale,
        metallic: material.metallic,
        roughness: material.roughness,
        occlusion_strength: material.occlusion_strength,
        alpha_cutoff: material.alpha_cutoff,
        glossiness: material.glossiness,
        specular_strength: material.specular_strength,
        height_scale_uv: material.height_scale_uv,
        offset_matrix: material.offset_matrix.transpose().to_cols_array(),
        // A missing map is white: its surface is the mesh's.
        height_rest: if material.height_map.is_some() { material.height_rest } else { 1.0 },
        emboss_step_texels: material.emboss_step_texels,
        self_shadow: material.self_shadow,
        ..MaterialRecord::default()
    }
}

fn pipeline(material: &Material) -> PipelineKey {
    PipelineKey {
        alpha: material.alpha,
        shading: material.shading,
        technique: material.technique,
        transformed_uvs: material.maps().into_iter().flatten().any(|map| map.is_transformed()),
        emissive: material.emissive_factor != Vec3::ZERO,
        environment_map: material.environment_map.is_some(),
        // Seen from behind, what is sunk stands out.
        raised: material.height_map.is_some() && (material.height_rest < 1.0 || material.double_sided),
        vertex_colors: false,
        double_sided: material.double_sided,
        mirrored: false,
    }
}

/// Writes the records of materials that are new or edited, or whose images changed; gives up what removed ones had.
pub fn update_materials(library: Res<Library>, mut table: ResMut<MaterialTable>, mut list: ResMut<DrawList>) {
    let (table, list) = (table.bypass_change_detection(), list.bypass_change_detection());
    table.regrouped.clear();
    let now = library.revisions();
    if (now.materials, now.images) == (table.seen.materials, table.seen.images) {
        return;
    }
    let is_first = table.placed.is_empty();
    // In the order of slots, whatever the order of changes.
    let mut changed: BTreeSet<u32> = library.changed_materials(table.seen.materials).collect();
    table.follow_images(&library, list, &mut changed);
    for slot in changed {
        // In the first frame all objects are new.
        if table.update(slot, &library, list) && !is_first {
            table.regroup(slot);
        }
    }
    table.seen = now;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assets::image::{Image, ImageKind};
    use crate::assets::material::{Sampler, Shading, Wrap};
    use crate::simulation::Simulation;

    fn image(side: u32, kind: ImageKind) -> Image {
        Image::rgba8("i", side, side, kind, vec![128; (side * side * 4) as usize])
    }

    #[test]
    fn equal_sizes_share_arrays_and_classes_and_other_sizes_do_not() {
        let mut simulation = Simulation::new();
        let mut library = simulation.world.resource_mut::<Library>();
        let maps: Vec<_> = [4, 4, 8].map(|side| library.add_image(image(side, ImageKind::Color))).into();
        let ids: Vec<_> = maps
            .iter()
            .map(|&i| library.add_material(Material { base_map: Some(Map::new(i)), ..Material::default() }))
            .collect();
        simulation.frame();
        let table = simulation.world.resource::<MaterialTable>();
        let classes: Vec<_> = ids.iter().map(|&id| table.placed(id).0).collect();
        assert_eq!(classes[0], classes[1]);
        assert_ne!(classes[0], classes[2]);
        let list = simulation.draw_list();
        let layers: Vec<_> = ids.iter().map(|id| list.materials.records[id.slot() as usize].layers[0]).collect();
        assert_eq!(layers, [0, 1, 0]);
    }

    #[test]
    fn another_sampler_is_another_class() {
        let mut simulation = Simulation::new();
        let mut library = simulation.world.resource_mut::<Library>();
        let map = Map::new(library.add_image(image(4, ImageKind::Color)));
        let clamped = Map { sampler: Sampler { wrap_u: Wrap::Clamp, ..Sampler::default() }, ..map };
        let a = library.add_material(Material { base_map: Some(map), ..Material::default() });
        let b = library.add_material(Material { base_map: Some(clamped), ..Material::default() });
        simulation.frame();
        let table = simulation.world.resource::<MaterialTable>();
        assert_ne!(table.placed(a).0, table.placed(b).0);
    }

    #[test]
    fn a_full_array_is_followed_by_another() {
        let mut simulation = Simulation::new();
        let mut library = simulation.world.resource_mut::<Library>();
        for _ in 0..=MOST_LAYERS {
            let map = Map::new(library.add_image(image(2, ImageKind::Color)));
            library.add_material(Material { base_map: Some(map), ..Material::default() });
        }
        simulation.frame();
        let two = simulation.draw_list().texture_arrays.iter().filter(|a| a.width == 2).map(|a| a.layers.len());
        assert_eq!(two.collect::<Vec<_>>(), [MOST_LAYERS, 1]);
    }

    #[test]
    fn an_array_of_large_images_has_fewer_layers() {
        let array = |side, texels| TextureArray { width: side, height: side, srgb: false, texels, layers: Vec::new() };
        assert_eq!(most_layers(&array(16, Texels::Rgba8)), MOST_LAYERS);
        // 64 MiB, and a third of that for the smaller levels.
        assert_eq!(most_layers(&array(4096, Texels::Rgba8)), 6);
        assert_eq!(most_layers(&array(4096, Texels::Rgba16Float)), 3);
        assert_eq!(most_layers(&array(16_384, Texels::Rgba16Float)), 1);
    }

    #[test]
    fn an_edited_material_is_written_again_and_only_that_one() {
        let mut simulation = Simulation::new();
        let mut library = simulation.world.resource_mut::<Library>();
        let ids = [(); 3].map(|()| library.add_material(Material::default()));
        simulation.frame();
        simulation.frame();
        assert!(simulation.draw_list().materials.dirty.is_empty());
        simulation.world.resource_mut::<Library>().edit_material(ids[1], |m| m.shading = Shading::Unlit);
        simulation.world.resource_mut::<Library>().edit_material(ids[1], |m| m.shininess = 3.0);
        simulation.frame();
        assert_eq!(format!("{:?}", simulation.draw_list().materials.dirty.ranges(0)), "[2..3]");
        assert_eq!(simulation.world.resource::<MaterialTable>().placed(ids[1]).1.shading, Shading::Unlit);
    }
}
