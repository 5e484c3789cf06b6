//! Shadow maps: which lights have layers, what is drawn into these, and when.
//!
//! ```text
//! choose   each view ranks its lamps (systems/lights/importance.rs), and has levels of the suns around its eye; those
//!          of all views share the layers
//! find     the casters of each face of each layer: at first by the order of objects, then by those that changed
//! encode   passes for each layer with a face whose list of casters is another one than was drawn
//! ```
//!
//! The visible content of a layer depends on the world alone, not on other views and frames before. So nothing is
//! looked at while nothing changed. Depths that are drawn anew are those that any other order would give.

use super::lamp_layers::Lamp;
use super::layer_casters::{Changes, DueFace, DueLayer, Layer, Owner, Start};
use super::layer_light::LayerLight;
use super::shadow_layers::{Face, MOST_LAYERS, SIZE, Turn, fade_bits, upper_half};
use super::shadow_pass::{Maps, OnDevice, begin_pass, face_stride};
use super::sun_levels::{LEVELS, SunLayer, SunLevel, turn_of};
use super::visible_casters::{ReceiverView, VisibleReceivers};
use crate::renderer::gpu::device::Gpu;
use crate::renderer::gpu::error::RenderError;
use crate::renderer::gpu::timestamps::Timestamps;
use crate::renderer::plan::view_plan::ViewPlan;
use crate::renderer::resources::frame_tables::FrameTables;
use crate::renderer::resources::meshes::Meshes;
use crate::renderer::resources::stats::ShadowStats;
use crate::renderer::resources::tables::SHADOW_RECORDS;
use crate::renderer::resources::textures::Textures;
use std::collections::{BTreeMap, BTreeSet};
use systems::assets::Technique;
use systems::draw::{DrawList, FrameData, ShadowScene};
use systems::ecs::parallel::{in_parallel, map_in_parallel};
use systems::ecs::tables::DirtySlots;
use systems::lights::{LightRecord, Ranked, ShadowLights, rank_suns};

/// The shadow record of the first of them, behind those of all layers; the records of their levels follow.
const SUN_RECORDS: usize = MOST_LAYERS;
const LEVEL_RECORDS: usize = SUN_RECORDS + ShadowLights::MOST_SUNS;
const _: () = assert!(LEVEL_RECORDS + ShadowLights::MOST_SUNS * LEVELS as usize <= SHADOW_RECORDS as usize);
// A light's record has eight bits for the number of its shadow record.
const _: () = assert!(LEVEL_RECORDS <= u8::MAX as usize);

/// Request of a view for shadow maps.
pub(crate) struct ShadowedView<'a> {
    pub ranked: &'a [Ranked],
    pub plan: &'a ViewPlan,
}

/// The layers of all views, and what draws them.
#[derive(Debug)]
pub(crate) struct ShadowMaps {
    /// By number.
    layers: Vec<Layer>,
    by_owner: BTreeMap<Owner, usize>,
    /// The directional lights that have levels, brightest first.
    suns: Vec<Sun>,
    /// Made when a view first asks for it.
    device: Option<OnDevice>,
    /// The shadow records of lights by their slots, counted from 1, as the light table on the device has them.
    pub by_slot: BTreeMap<u32, u8>,
    due: Vec<DueLayer>,
    /// Versions at the last search for casters.
    seen: Option<Seen>,
    pub stats: ShadowStats,
}

/// A directional light that has levels.
#[derive(Debug)]
struct Sun {
    ranked: Ranked,
    /// Its frame's.
    turn: Turn,
    /// Tangent of half its angle.
    size: f32,
}

/// Versions that lists of casters depend on, beside the lights.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Seen {
    frame: u64,
    meshes: u64,
    textures: u64,
}

/// Number of leading views that find room for the layers of all their lights; at least 1. They take no layers from each
/// other. Each counts with as many lamps as it may ask for.
pub(crate) fn views_with_room(frame: &FrameData<'_>, plans: &[&ViewPlan]) -> usize {
    let Some(lights) = frame.shadows.as_ref().map(ShadowScene::lights) else { return plans.len() };
    let suns = rank_suns(lights);
    let turns: Vec<Turn> = suns
        .iter()
        .filter_map(|sun| Some(turn_of(&frame.list.lights.records.get(sun.slot as usize)?.unpacked())))
        .collect();
    let (mut levels, mut lamps) = (BTreeSet::new(), 0);
    let fits = |plan: &&&ViewPlan| {
        for (level, turn) in (0..LEVELS).flat_map(|level| turns.iter().map(move |turn| (level, *turn))) {
            levels.insert(SunLevel::around(plan.view.eye(), turn, level));
        }
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
    pub fn new() -> Self {
        Self {
            layers: Vec::new(),
            by_owner: BTreeMap::new(),
            suns: Vec::new(),
            device: None,
            by_slot: BTreeMap::new(),
            due: Vec::new(),
            seen: None,
            stats: ShadowStats::default(),
        }
    }

    /// Bytes of the layers.
    pub fn bytes(&self) -> u64 {
        let layers = self.device.as_ref().and_then(|device| device.maps.as_ref()).map_or(0, |maps| maps.layers.len());
        let bases = self.layers.iter().filter(|layer| layer.base.is_some()).count();
        (layers + bases) as u64 * u64::from(SIZE * SIZE) * 4
    }

    /// Bind group of objects that receive shadows; `None` before the first [`Self::choose`].
    pub fn group(&self) -> Option<&wgpu::BindGroup> {
        Some(&self.device.as_ref()?.maps.as_ref()?.group)
    }

    /// Gives layers to the lamps that views have ranked, and to the levels of suns around their eyes: what has one
    /// keeps it. There is room for `most` lamps at once, and more if that is not enough. `layouts`: of group 3 of
    /// receivers, of a frame, of a material class.
    pub fn choose(
        &mut self,
        gpu: &Gpu,
        [layout, frame_layout, class_layout]: [&wgpu::BindGroupLayout; 3],
        frame: &FrameData<'_>,
        views: &[ShadowedView<'_>],
        most: usize,
    ) {
        self.stats = ShadowStats::default();
        let suns = frame.shadows.map_or_else(Vec::new, |scene| rank_suns(scene.lights()));
        let sun = |ranked: Ranked| {
            let light = frame.list.lights.records.get(ranked.slot as usize)?.unpacked();
            Some(Sun { ranked, turn: turn_of(&light), size: light.size })
        };
        self.suns = suns.into_iter().filter_map(sun).collect();
        let mut wanted = BTreeSet::new();
        for level in 0..LEVELS {
            for view in views {
                wanted.extend(
                    self.suns.iter().map(|sun| Owner::Sun(SunLevel::around(view.plan.view.eye(), sun.turn, level))),
                );
            }
        }
        // The coarsest levels are missing where there is not room for all.
        while wanted.len() > MOST_LAYERS {
            wanted.pop_last();
        }
        let levels = wanted.len();
        // Where views together ask for more than there can be, the most important ones of any view.
        let mut lamps: Vec<Ranked> = views.iter().flat_map(|view| view.ranked).copied().collect();
        lamps.sort_by(|a, b| b.importance.total_cmp(&a.importance).then(a.slot.cmp(&b.slot)));
        for lamp in lamps {
            if wanted.len() < MOST_LAYERS {
                wanted.insert(Owner::Lamp(lamp.slot));
            }
        }
        let needed = wanted.len();
        for layer in &mut self.layers {
            if layer.owner.is_some_and(|owner| !wanted.remove(&owner)) {
                *layer = Layer::default();
            }
        }
        let device = self.device.get_or_insert_with(|| OnDevice::new(&gpu.device, frame_layout, class_layout));
        if needed > self.layers.len() || device.maps.is_none() {
            self.layers.resize_with(needed.max(levels + most).clamp(1, MOST_LAYERS), Layer::default);
            self.layers.iter_mut().for_each(|layer| layer.light = None);
            // The old ones first: there may not be room for both.
            device.maps = None;
            device.maps = Some(Maps::new(&gpu.device, layout, self.layers.len()));
        }
        let free = self.layers.iter_mut().filter(|layer| layer.owner.is_none());
        free.zip(wanted).for_each(|(layer, owner)| layer.owner = Some(owner));
        let owners = self.layers.iter().map(|layer| layer.owner);
        self.by_owner = owners.zip(0..).filter_map(|(owner, layer)| Some((owner?, layer))).collect();
        let lamp = |(&owner, &layer): (&Owner, &usize)| match owner {
            Owner::Lamp(slot) => Some((slot, layer as u8 + 1)),
            Owner::Sun(_) => None,
        };
        let suns = self.suns.iter().zip(SUN_RECORDS as u8 + 1..).map(|(sun, number)| (sun.ranked.slot, number));
        self.by_slot = self.by_owner.iter().filter_map(lamp).chain(suns).collect();
        self.stats.lights = self.by_slot.len() as u32;
        self.stats.layers = self.by_owner.len() as u32;
    }

    /// The records that shaders read for a view: of lamps by their layers; then of suns, and of each sun's levels.
    pub fn records(&self, view: &ShadowedView<'_>, scene: &ShadowScene<'_>, list: &DrawList) -> Vec<[u32; 4]> {
        let mut records = vec![[0; 4]; self.layers.len()];
        for light in view.ranked {
            let Some(&layer) = self.by_owner.get(&Owner::Lamp(light.slot)) else { continue };
            if let Some(lamp) = lamp(light.slot, scene, list) {
                records[layer] = lamp.record(light.fade);
            }
        }
        if self.suns.is_empty() {
            return records;
        }
        records.resize(LEVEL_RECORDS + self.suns.len() * LEVELS as usize, [0; 4]);
        for (number, sun) in self.suns.iter().enumerate() {
            let first = LEVEL_RECORDS + number * LEVELS as usize;
            let mut count = 0;
            for level in (0..LEVELS).map(|level| SunLevel::around(view.plan.view.eye(), sun.turn, level)) {
                let Some(&layer) = self.by_owner.get(&Owner::Sun(level)) else { break };
                records[first + count] = level.record(view.plan.view.eye(), layer as u32);
                count += 1;
            }
            let [x, y] = sun.turn.words();
            let levels = first as u32 | (count as u32) << 16;
            records[SUN_RECORDS + number] = [x, y, levels, upper_half(sun.size).to_bits() | fade_bits(sun.ranked.fade)];
        }
        records
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
        let (list, Some(scene)) = (frame.list, frame.shadows) else { return Ok(0) };
        let seen = Seen { frame: list.frame, meshes: meshes.version(), textures: textures_version };
        let before = self.seen.replace(seen);
        if before.is_none_or(|before| before.meshes != seen.meshes) {
            // A mesh may be another one under the same number.
            self.layers.iter_mut().for_each(|layer| layer.light = None);
        }
        let is_same = before.is_some_and(|before| before.frame == seen.frame);
        let follows = is_same || before.is_some_and(|before| before.frame + 1 == seen.frame);
        let nothing = DirtySlots::default();
        let casters = if is_same || !follows || self.by_owner.is_empty() {
            Vec::new()
        } else {
            scene.changed_casters(&list.instances, frame.library)
        };
        let receivers = if casters.is_empty() {
            VisibleReceivers::default()
        } else {
            VisibleReceivers::new(views.iter().map(|view| ReceiverView::new(view.plan)), scene.bounds())
        };
        let changes = Changes {
            slots: if is_same { &nothing } else { &list.instances.dirty },
            casters,
            materials: if is_same { &nothing } else { &list.materials.dirty },
            all_masks: !follows || before.is_some_and(|before| before.textures != seen.textures),
            frame: seen.frame,
            receivers,
        };
        let is_still = changes.slots.is_empty() && changes.materials.is_empty() && !changes.all_masks;
        let light_of = |owner| match owner {
            Owner::Lamp(slot) => lamp(slot, &scene, list).map(LayerLight::Lamp),
            Owner::Sun(level) => {
                let alike = self.suns.iter().filter(|sun| sun.turn == level.turn);
                let widest = alike.map(|sun| sun.size).fold(0.0, f32::max);
                Some(LayerLight::Sun(SunLayer::new(level, widest)))
            }
        };
        let lights = self.layers.iter_mut().filter_map(|layer| Some((light_of(layer.owner?)?, layer)));
        let is_concerned = |(light, layer): &(_, &mut Layer)| {
            !is_still || !follows || layer.light != Some(*light) || layer.leaves_out()
        };
        let concerned: Vec<_> = lights.filter(is_concerned).collect();
        let library = &*frame.library;
        in_parallel(concerned.into_iter(), |(light, layer)| {
            if layer.light != Some(light) || !follows {
                layer.find_all(light, &scene, library, meshes, changes.all_masks);
            } else {
                layer.change(&light, &changes, meshes);
            }
        });
        let layers = self.layers.iter_mut().enumerate().filter(|(_, layer)| layer.owner.is_some());
        let layers: Vec<_> =
            layers.filter_map(|(number, layer)| layer.is_due(is_same).then_some((number, layer))).collect();
        let due = |(number, layer): (usize, &mut Layer)| layer.due(number, gpu, meshes, is_same, seen.frame);
        self.due = map_in_parallel(layers.into_iter(), due);
        self.upload(gpu)
    }

    /// The slots of casters and the records of faces that are due.
    fn upload(&mut self, gpu: &Gpu) -> Result<u64, RenderError> {
        let Some(device) = self.device.as_mut().filter(|_| !self.due.is_empty()) else { return Ok(0) };
        let stride = face_stride(&gpu.device) as usize;
        let (mut slots, mut records) = (Vec::<u32>::new(), Vec::<u8>::new());
        for due in &mut self.due {
            let Some(light) = self.layers[due.layer].light else { continue };
            for face in due.base.iter_mut().chain(&mut due.faces) {
                for draw in &mut face.draws {
                    draw.slots = draw.slots.start + slots.len() as u32..draw.slots.end + slots.len() as u32;
                }
                slots.extend(&face.slots);
                records.extend_from_slice(bytemuck::bytes_of(&light.face_record(&face.face)));
                records.resize(records.len().next_multiple_of(stride), 0);
            }
        }
        let all = DirtySlots::default();
        let written = device.slots.write(gpu, &slots, &all, true)? + device.faces.write(gpu, &records, &all, true)?;
        let faces = self.due.iter().flat_map(|layer| layer.base.iter().chain(&layer.faces));
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
        let Some(device) = self.device.as_mut().filter(|_| !self.due.is_empty()) else { return };
        let stride = face_stride(&gpu.device);
        device.bind(&gpu.device, tables, frame_layout);
        let (Some(maps), Some((_, table_group)), Some((_, face_group))) =
            (&device.maps, &device.tables, &device.face_group)
        else {
            return;
        };
        let mut number = 0;
        let mut draw = |encoder: &mut _, view: &_, load, erase, faces: &[DueFace]| {
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
                if erase {
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
        for due in self.due.drain(..) {
            let layer = &mut self.layers[due.layer];
            let view = &maps.layers[due.layer];
            if let Some(base) = layer.base.as_mut().filter(|_| due.start == Start::Base) {
                if !due.base.is_empty() {
                    let view = base.texture.create_view(&wgpu::TextureViewDescriptor::default());
                    draw(encoder, &view, clear, false, &due.base);
                    base.is_drawn = true;
                }
                maps.copy_into(encoder, &base.texture, due.layer);
                self.stats.bases += 1;
            }
            let load = if due.start == Start::Nothing { clear } else { wgpu::LoadOp::Load };
            draw(encoder, view, load, due.start == Start::OtherFaces, &due.faces);
            layer.faces.iter_mut().for_each(|face| face.is_drawn = true);
            self.stats.passes += 1;
            self.stats.faces += due.faces.len() as u32;
            let drawn = due.base.iter().chain(&due.faces);
            self.stats.casters += drawn.map(|face| face.slots.len() as u32).sum::<u32>();
        }
    }
}

/// The point light or spot in a slot.
fn lamp(slot: u32, scene: &ShadowScene<'_>, list: &DrawList) -> Option<Lamp> {
    let near = scene.lights().get(slot)?.near;
    let light: LightRecord = list.lights.records.get(slot as usize)?.unpacked();
    Some(Lamp::new(&light, near))
}
