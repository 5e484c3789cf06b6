//! Shadow maps: which lights have layers, what is drawn into these, and when.
//!
//! ```text
//! choose   each view ranks its lamps (systems/lights/importance.rs), and has levels of the suns around its eye; those
//!          of all views whose layers are as fine share them (layer_set.rs)
//! find     the casters of each face of each layer: at first by the order of objects, then by those that changed
//! encode   passes for each layer with a face whose list of casters is another one than was drawn
//! ```
//!
//! The visible content of a layer depends on the world alone, not on other views and frames before. So nothing is
//! looked at while nothing changed. Depths that are drawn anew are those that any other order would give.

use super::layer_casters::{DueFace, Owner, Start};
use super::layer_set::{LayerSet, SUN_RECORDS, ShadowedView, Sun};
use super::shadow_layers::{Face, MOST_LAYERS};
use super::shadow_pass::{OnDevice, begin_pass, face_stride};
use super::sides::{SIDES, side_for};
use crate::renderer::gpu::device::Gpu;
use crate::renderer::gpu::error::RenderError;
use crate::renderer::gpu::timestamps::Timestamps;
use crate::renderer::plan::view_plan::ViewPlan;
use crate::renderer::resources::frame_tables::FrameTables;
use crate::renderer::resources::meshes::Meshes;
use crate::renderer::resources::stats::ShadowStats;
use crate::renderer::resources::textures::Textures;
use std::collections::{BTreeMap, BTreeSet};
use systems::assets::Technique;
use systems::draw::{DrawList, FrameData, ShadowScene};
use systems::ecs::tables::DirtySlots;

/// The layers of all views, and what draws them.
#[derive(Debug, Default)]
pub(crate) struct ShadowMaps {
    /// By their side.
    sets: BTreeMap<u32, LayerSet>,
    /// Made when a view first asks for it.
    device: Option<OnDevice>,
    /// The shadow records of lights by their slots, counted from 1, as the light table on the device has them.
    pub by_slot: BTreeMap<u32, u8>,
    pub stats: ShadowStats,
}

/// Number of leading views that find room for the layers of all their lights; at least 1. They take no layers from each
/// other. Each counts with as many lamps as it may ask for.
pub(crate) fn views_with_room(frame: &FrameData<'_>, plans: &[&ViewPlan]) -> usize {
    let Some(lights) = frame.shadows.as_ref().map(ShadowScene::lights) else { return plans.len() };
    let suns = Sun::all(frame);
    let (mut levels, mut lamps) = (BTreeSet::new(), 0);
    let fits = |plan: &&&ViewPlan| {
        let side = side_for(plan);
        levels.extend(suns.iter().flat_map(|sun| sun.levels(plan.view.eye(), side)));
        lamps = lights.lights().len().min(lamps + plan.settings.shadow_maps as usize);
        levels.len() + lamps <= MOST_LAYERS
    };
    plans.iter().take_while(fits).count().max(1)
}

/// Sources of what casters are drawn from.
#[derive(Clone, Copy)]
pub(crate) struct CasterSources<'a> {
    pub tables: &'a FrameTables,
    pub frame_layout: &'a wgpu::BindGroupLayout,
    pub meshes: &'a Meshes,
    pub textures: &'a Textures,
}

impl ShadowMaps {
    /// Bytes of the layers.
    pub fn bytes(&self) -> u64 {
        self.sets.values().map(LayerSet::bytes).sum()
    }

    /// Bind group of objects that receive shadows from layers of a side; `None` before the first [`Self::choose`].
    pub fn group(&self, side: u32) -> Option<&wgpu::BindGroup> {
        Some(&self.sets.get(&side)?.maps.as_ref()?.group)
    }

    /// Gives layers to the lights of views, and numbers to these: what has one keeps it. `layouts`: of group 3 of
    /// receivers, of a frame, of a material class.
    pub fn choose(
        &mut self,
        gpu: &Gpu,
        [layout, frame_layout, class_layout]: [&wgpu::BindGroupLayout; 3],
        frame: &FrameData<'_>,
        views: &[ShadowedView<'_>],
    ) {
        self.device.get_or_insert_with(|| OnDevice::new(&gpu.device, frame_layout, class_layout));
        self.sets.retain(|_, set| set.is_in_use(frame.list.frame));
        self.stats = ShadowStats::default();
        let mut lamps = BTreeSet::new();
        for (side, views) in by_side(views) {
            let set = self.sets.entry(side).or_insert_with(|| LayerSet::new(side));
            set.choose(gpu, layout, frame, &views);
            for owner in set.owners() {
                self.stats.layers += 1;
                if let Owner::Lamp(slot) = owner {
                    lamps.insert(slot);
                }
            }
        }
        self.by_slot.retain(|slot, number| usize::from(*number) <= SUN_RECORDS && lamps.remove(slot));
        let taken: BTreeSet<u8> = self.by_slot.values().copied().collect();
        let free = (1..=SUN_RECORDS as u8).filter(|number| !taken.contains(number));
        self.by_slot.extend(lamps.into_iter().zip(free));
        self.by_slot.extend(Sun::all(frame).iter().map(|sun| sun.ranked.slot).zip(SUN_RECORDS as u8 + 1..));
        self.stats.lights = self.by_slot.len() as u32;
    }

    /// The records that shaders read for a view.
    pub fn records(&self, view: &ShadowedView<'_>, scene: &ShadowScene<'_>, list: &DrawList) -> Vec<[u32; 4]> {
        let set = self.sets.get(&view.side);
        set.map_or_else(Vec::new, |set| set.records(view, &self.by_slot, scene, list))
    }

    /// Finds the faces before which other casters are than those that are drawn there, and uploads what draws them.
    /// Returns the bytes written.
    pub fn find_due(
        &mut self,
        gpu: &Gpu,
        frame: &FrameData<'_>,
        views: &[ShadowedView<'_>],
        meshes: &Meshes,
        textures_version: u64,
    ) -> Result<u64, RenderError> {
        self.sets.values_mut().for_each(|set| set.due.clear());
        for (side, views) in by_side(views) {
            if let Some(set) = self.sets.get_mut(&side) {
                set.find_due(gpu, frame, &views, meshes, textures_version);
            }
        }
        self.upload(gpu)
    }

    fn is_due(&self) -> bool {
        self.sets.values().any(|set| !set.due.is_empty())
    }

    /// The slots of casters and the records of faces that are due.
    fn upload(&mut self, gpu: &Gpu) -> Result<u64, RenderError> {
        let is_due = self.is_due();
        let Some(device) = self.device.as_mut().filter(|_| is_due) else { return Ok(0) };
        let stride = face_stride(&gpu.device) as usize;
        let (mut slots, mut records) = (Vec::<u32>::new(), Vec::<u8>::new());
        for LayerSet { layers, due, .. } in self.sets.values_mut() {
            for due in due {
                let Some(light) = layers[due.layer].light else { continue };
                for face in due.base.iter_mut().chain(&mut due.faces) {
                    for draw in &mut face.draws {
                        draw.slots = draw.slots.start + slots.len() as u32..draw.slots.end + slots.len() as u32;
                    }
                    slots.extend(&face.slots);
                    records.extend_from_slice(bytemuck::bytes_of(&light.face_record(&face.face)));
                    records.resize(records.len().next_multiple_of(stride), 0);
                }
            }
        }
        let all = DirtySlots::default();
        let written = device.slots.write(gpu, &slots, &all, true)? + device.faces.write(gpu, &records, &all, true)?;
        let due = self.sets.values().flat_map(|set| &set.due);
        let faces = due.flat_map(|layer| layer.base.iter().chain(&layer.faces));
        let keys = faces.flat_map(|face| &face.draws);
        let masks: BTreeSet<_> = keys.filter_map(|draw| draw.key.map(|(_, mask)| mask)).collect();
        masks.into_iter().for_each(|mask| device.make_mask(&gpu.device, mask));
        Ok(written)
    }

    /// Draws what is due.
    pub fn encode(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        CasterSources { tables, frame_layout, meshes, textures }: CasterSources<'_>,
        timestamps: Option<&Timestamps>,
    ) {
        let is_due = self.is_due();
        let Some(device) = self.device.as_mut().filter(|_| is_due) else { return };
        let stride = face_stride(&gpu.device);
        device.bind(&gpu.device, tables, frame_layout);
        let (Some((_, table_group)), Some((_, face_group))) = (&device.tables, &device.face_group) else { return };
        let mut number = 0;
        let mut draw = |encoder: &mut _, view: &_, load, faces: &[DueFace]| {
            let mut pass = begin_pass(encoder, view, load, timestamps);
            pass.set_bind_group(0, table_group, &[]);
            pass.set_vertex_buffer(0, meshes.vertices.buffer().slice(..));
            pass.set_vertex_buffer(1, device.slots.buffer().slice(..));
            pass.set_index_buffer(meshes.indices.buffer().slice(..), wgpu::IndexFormat::Uint32);
            for due in faces {
                let Face { corner: [x, y], size, .. } = due.face;
                pass.set_viewport(x as f32, y as f32, size as f32, size as f32, 0.0, 1.0);
                pass.set_scissor_rect(x, y, size, size);
                pass.set_bind_group(3, face_group, &[number * stride]);
                number += 1;
                if due.is_erased {
                    pass.set_pipeline(&device.empty);
                    pass.draw(0..3, 0..1);
                }
                for alike in due.draws.chunk_by(|a, b| a.key == b.key) {
                    if let Some((class, mask)) = alike[0].key {
                        let group = textures.class(class, Technique::Off);
                        let (Some(group), Some(pipeline)) = (group, device.masks.get(&mask)) else { continue };
                        pass.set_pipeline(pipeline);
                        pass.set_bind_group(1, group, &[]);
                    } else {
                        pass.set_pipeline(&device.opaque);
                    }
                    for draw in alike {
                        pass.draw_indexed(draw.indices.clone(), draw.base_vertex, draw.slots.clone());
                    }
                }
            }
        };
        let clear = wgpu::LoadOp::Clear(0.0);
        let sets = self.sets.values_mut().filter_map(|set| Some((set.maps.as_ref()?, &mut set.layers, &mut set.due)));
        for (maps, layers, due) in sets {
            for due in due.drain(..) {
                let layer = &mut layers[due.layer];
                let view = &maps.layers[due.layer];
                if let Some(base) = layer.base.as_ref().filter(|_| due.start == Start::Base) {
                    if !due.base.is_empty() {
                        let view = base.texture.create_view(&wgpu::TextureViewDescriptor::default());
                        draw(encoder, &view, if base.is_new { clear } else { wgpu::LoadOp::Load }, &due.base);
                    }
                    maps.copy_into(encoder, &base.texture, due.layer);
                    self.stats.bases += 1;
                }
                let load = if due.start == Start::Nothing { clear } else { wgpu::LoadOp::Load };
                draw(encoder, view, load, &due.faces);
                layer.drawn_now();
                self.stats.passes += 1;
                self.stats.faces += due.faces.len() as u32;
                let drawn = due.base.iter().chain(&due.faces);
                self.stats.casters += drawn.map(|face| face.slots.len() as u32).sum::<u32>();
            }
        }
    }
}

/// Views by the side of their layers.
fn by_side<'a>(views: &[ShadowedView<'a>]) -> impl Iterator<Item = (u32, Vec<ShadowedView<'a>>)> {
    let of = |side| (side, views.iter().filter(|view| view.side == side).copied().collect());
    SIDES.map(of).into_iter().filter(|(_, views): &(_, Vec<_>)| !views.is_empty())
}
