//! Materials as the GPU reads them: a record each, their maps as layers of texture arrays.
//!
//! Images of the same size and format share a texture array, so that objects with different materials can be drawn
//! together: only the layer index differs, and that is in the record. What a draw must bind (one array and one sampler
//! per map) is the material's *class*; materials with equal ones share it. A missing map is the layer of a stand-in.

use super::list::{ClassId, DrawList, MaterialClass, PipelineKey, TextureArray};
use super::records::MaterialRecord;
use crate::assets::image::{ImageId, Texels, level_count, level_size};
use crate::assets::library::Library;
use crate::assets::material::{MAP_COUNT, Map, Material, MaterialId};
use bevy_ecs::prelude::*;
use glam::Vec3;
use std::collections::BTreeMap;

/// Layers that every adapter offers (WebGPU's default limit); a fuller array is followed by another.
pub const MOST_LAYERS: usize = 256;

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

/// Where materials and images went.
#[derive(Resource, Debug, Default)]
pub struct MaterialTable {
    placed: Vec<(ClassId, PipelineKey)>,
    layer_of_image: BTreeMap<ImageId, (u32, u32)>,
    id_of_class: BTreeMap<MaterialClass, ClassId>,
    /// By number, up to the last of them: materials whose objects are to be grouped anew. Their class or pipeline is
    /// another, or they are new: objects that came before them were drawn with the default.
    regrouped: Vec<bool>,
}

impl MaterialTable {
    /// The class and the pipeline of a material, without what the object decides (mesh, mirroring); those of the
    /// default for an unknown one.
    pub fn placed(&self, material: MaterialId) -> (ClassId, PipelineKey) {
        self.placed.get(material.0 as usize).or(self.placed.first()).copied().unwrap_or_default()
    }

    /// Whether any objects are to be grouped anew.
    pub(crate) fn regroups(&self) -> bool {
        !self.regrouped.is_empty()
    }

    /// Whether objects of that material are.
    pub(crate) fn is_regrouped(&self, material: MaterialId) -> bool {
        self.regrouped.get(material.0 as usize).is_some_and(|is| *is)
    }

    fn regroup(&mut self, index: usize) {
        self.regrouped.resize(self.regrouped.len().max(index + 1), false);
        self.regrouped[index] = true;
    }

    fn layer(&mut self, image: ImageId, library: &Library, arrays: &mut Vec<TextureArray>) -> (u32, u32) {
        if let Some(&place) = self.layer_of_image.get(&image) {
            return place;
        }
        let Some(source) = library.image(image) else {
            return self.layer(ImageId::WHITE_DATA, library, arrays);
        };
        let wanted = TextureArray {
            width: source.width,
            height: source.height,
            srgb: source.kind.is_color() && source.texels != Texels::Rgba16Float,
            texels: source.texels,
            layers: Vec::new(),
        };
        let index = arrays.iter().position(|a| a.same_format(&wanted) && a.layers.len() < most_layers(a));
        let index = index.unwrap_or_else(|| {
            arrays.push(wanted);
            arrays.len() - 1
        });
        arrays[index].layers.push(image);
        let place = (index as u32, arrays[index].layers.len() as u32 - 1);
        self.layer_of_image.insert(image, place);
        place
    }

    fn place(&mut self, material: &Material, library: &Library, list: &mut DrawList) -> (ClassId, MaterialRecord) {
        let mut class = MaterialClass::default();
        let mut record = record(material);
        for (slot, map) in material.maps().into_iter().enumerate() {
            let map = map.unwrap_or_else(|| Map::new(STAND_INS[slot]));
            let (array, layer) = self.layer(map.image, library, &mut list.texture_arrays);
            class.arrays[slot] = array;
            class.samplers[slot] = map.sampler;
            record.layers[slot] = layer;
            record.image_from_mesh_uv[slot] = map.image_from_mesh_uv.matrix2.to_cols_array();
            record.offsets[slot] = map.image_from_mesh_uv.translation.to_array();
            record.second_uvs |= map.uv_set.min(1) << slot;
        }
        let id = *self.id_of_class.entry(class).or_insert_with(|| {
            list.classes.push(class);
            ClassId(list.classes.len() as u32 - 1)
        });
        (id, record)
    }
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

/// Writes the records of new and edited materials.
pub fn update_materials(mut library: ResMut<Library>, mut table: ResMut<MaterialTable>, mut list: ResMut<DrawList>) {
    let (table, list) = (table.bypass_change_detection(), list.bypass_change_detection());
    table.regrouped.clear();
    let known = table.placed.len();
    let mut pending: Vec<usize> = (known..library.materials().len()).collect();
    if library.has_edited_materials() {
        pending.extend(library.take_edited_materials().into_iter().map(|id| id.0 as usize).filter(|&id| id < known));
    }
    for index in pending {
        let material = &library.materials()[index];
        let (class, record) = table.place(material, &library, list);
        list.materials.write(index as u32, record);
        let placed = (class, pipeline(material));
        if index >= table.placed.len() {
            table.placed.push(placed);
            if known > 0 {
                table.regroup(index);
            }
        } else if table.placed[index] != placed {
            table.placed[index] = placed;
            table.regroup(index);
        }
    }
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
        let layers: Vec<_> = ids.iter().map(|id| list.materials.records[id.0 as usize].layers[0]).collect();
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
