//! Shadow maps of lamps: which lights have a layer, what is drawn into it, and when.
//!
//! ```text
//! choose   each view ranks the lights (systems/lights/importance.rs); those of all views share the layers
//! find     the casters of each face of each layer; a face is due where they are others than those drawn there
//! encode   a pass for each layer with a face that is due
//! ```
//!
//! What a layer holds depends on the world alone, not on the views and frames before. So nothing is looked at while
//! nothing changed, and what is drawn anew has the depths that it would have in any other order.

use super::frame_tables::FrameTables;
use super::meshes::Meshes;
use super::shadow_layers::{Face, FaceCaster, LayerLight, MOST_LAYERS, SIZE};
use super::shadow_pass::{Maps, MaskKey, OnDevice, face_stride};
use super::textures::Textures;
use super::timestamps::Timestamps;
use super::{Gpu, RenderError};
use glam::Vec3;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use systems::assets::levels::LevelOfDetail;
use systems::assets::{AlphaMode, Technique};
use systems::draw::{BatchKey, ClassId, DrawList, FrameData, ShadowCaster, ShadowScene};
use systems::ecs::tables::DirtySlots;
use systems::lights::{PackedLight, Ranked};

/// Texels of a layer that a caster's level of detail may be off.
const DETAIL: LevelOfDetail = LevelOfDetail { enabled: true, max_error_pixels: 0.5 };

/// What the last prepare found and the last encode drew.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct ShadowStats {
    /// Lights that have a layer.
    pub layers: u32,
    /// Layers drawn, a pass each.
    pub passes: u32,
    /// Faces drawn.
    pub faces: u32,
    /// Objects drawn into them.
    pub casters: u32,
}

/// The layers of all views, and what draws them.
#[derive(Debug)]
pub(super) struct ShadowMaps {
    /// By layer.
    layers: Vec<Layer>,
    /// Made when a view first asks for it.
    device: Option<OnDevice>,
    /// The layers of lights by their slots, as the light table on the device has them.
    pub by_slot: BTreeMap<u32, u8>,
    due: Vec<DueLayer>,
    /// What was looked at last.
    seen: Option<Seen>,
    /// How often what masks let through may have changed.
    masks: u64,
    pub stats: ShadowStats,
}

/// A part of the texture that a light has.
#[derive(Clone, Debug, Default)]
struct Layer {
    /// Its slot.
    slot: Option<u32>,
    /// As it is drawn there.
    light: Option<LayerLight>,
    /// What is drawn in each face; empty: nothing is known.
    faces: Vec<Vec<FaceCaster>>,
}

/// What lists of casters depend on beside the lights.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Seen {
    frame: u64,
    batches: u64,
    meshes: u64,
    textures: u64,
    lights: u64,
}

#[derive(Debug)]
struct DueLayer {
    layer: usize,
    light: LayerLight,
    /// Nothing of what it holds stays.
    clear: bool,
    /// By their numbers.
    faces: Vec<(usize, DueFace)>,
    count: usize,
}

#[derive(Debug)]
struct DueFace {
    face: Face,
    casters: Vec<FaceCaster>,
    draws: Vec<CasterDraw>,
}

/// Casters of one mesh at one level, which differ in their places.
#[derive(Debug)]
struct CasterDraw {
    key: CasterKey,
    indices: Range<u32>,
    base_vertex: i32,
    /// In the list of slots.
    slots: Range<u32>,
}

/// What casters are drawn with: of masks their class and what their shader reads.
type CasterKey = Option<(ClassId, MaskKey)>;

impl ShadowMaps {
    pub fn new() -> Self {
        Self {
            layers: Vec::new(),
            device: None,
            by_slot: BTreeMap::new(),
            due: Vec::new(),
            seen: None,
            masks: 0,
            stats: ShadowStats::default(),
        }
    }

    /// Bytes of the layers.
    pub fn bytes(&self) -> u64 {
        let layers = self.device.as_ref().and_then(|device| device.maps.as_ref()).map_or(0, |maps| maps.layers.len());
        layers as u64 * u64::from(SIZE * SIZE) * 4
    }

    /// What objects that receive shadows bind; `None` before the first [`Self::choose`].
    pub fn group(&self) -> Option<&wgpu::BindGroup> {
        Some(&self.device.as_ref()?.maps.as_ref()?.group)
    }

    /// Gives layers to the lights that views have ranked: those that have one keep it. There is room for `most` at
    /// once, and more if that is not enough. `layouts`: of group 3 of receivers, of a frame, of a material class.
    pub fn choose(
        &mut self,
        gpu: &Gpu,
        [layout, frame_layout, class_layout]: [&wgpu::BindGroupLayout; 3],
        ranked: &[&[Ranked]],
        most: usize,
    ) {
        self.stats = ShadowStats::default();
        // Where views together ask for more than there can be, the most important ones of any view.
        let mut all: Vec<Ranked> = ranked.concat();
        all.sort_by(|a, b| b.importance.total_cmp(&a.importance).then(a.slot.cmp(&b.slot)));
        let mut wanted = BTreeSet::new();
        for light in all {
            if wanted.len() < MOST_LAYERS {
                wanted.insert(light.slot);
            }
        }
        for layer in &mut self.layers {
            if layer.slot.is_some_and(|slot| !wanted.remove(&slot)) {
                layer.slot = None;
            }
        }
        let needed = wanted.len() + self.layers.iter().filter(|layer| layer.slot.is_some()).count();
        let device = self.device.get_or_insert_with(|| OnDevice::new(&gpu.device, frame_layout, class_layout));
        if needed > self.layers.len() || device.maps.is_none() {
            self.layers.resize(needed.max(most).clamp(1, MOST_LAYERS), Layer::default());
            self.layers.iter_mut().for_each(|layer| layer.light = None);
            // The old ones first: there may not be room for both.
            device.maps = None;
            device.maps = Some(Maps::new(&gpu.device, layout, self.layers.len()));
        }
        let mut wanted = wanted.into_iter();
        for layer in self.layers.iter_mut().filter(|layer| layer.slot.is_none()) {
            (layer.slot, layer.light) = (wanted.next(), None);
        }
        let numbered = (1..).zip(&self.layers);
        self.by_slot = numbered.filter_map(|(number, layer)| Some((layer.slot?, number))).collect();
        self.stats.layers = self.by_slot.len() as u32;
    }

    /// The records of a view's layers.
    pub fn records(&self, ranked: &[Ranked], scene: &ShadowScene<'_>, list: &DrawList) -> Vec<[u32; 4]> {
        let mut records = vec![[0; 4]; self.layers.len()];
        for light in ranked {
            let Some(&number) = self.by_slot.get(&light.slot) else { continue };
            if let Some(layer) = layer_light(light.slot, scene, list) {
                records[usize::from(number) - 1] = layer.record(light.fade);
            }
        }
        records
    }

    /// Finds the faces whose casters are others than those that are drawn there, and uploads what draws them. Returns
    /// the bytes written.
    pub fn find_due(
        &mut self,
        gpu: &Gpu,
        frame: &FrameData<'_>,
        meshes: &Meshes,
        textures_version: u64,
    ) -> Result<u64, RenderError> {
        let (list, Some(scene)) = (frame.list, frame.shadows) else { return Ok(0) };
        let seen = Seen {
            frame: list.frame,
            batches: list.batches_version,
            meshes: meshes.version(),
            textures: textures_version,
            lights: scene.lights().version(),
        };
        let is_same = |before: Seen| {
            let still = list.instances.dirty.is_empty() && list.materials.dirty.is_empty();
            Seen { frame: seen.frame, ..before } == seen
                && (before.frame == seen.frame || still && before.frame + 1 == seen.frame)
        };
        let is_still = self.due.is_empty() && self.seen.is_some_and(is_same);
        let sees_masks = |before: Seen| {
            before.textures == seen.textures
                && (before.frame == seen.frame || before.frame + 1 == seen.frame && list.materials.dirty.is_empty())
        };
        self.masks += u64::from(!self.seen.is_some_and(sees_masks));
        if self.seen.is_some_and(|before| before.meshes != seen.meshes) {
            // A mesh may be another one under the same number.
            self.layers.iter_mut().for_each(|layer| layer.light = None);
        }
        self.seen = Some(seen);
        self.due.clear();
        let mut casters = Vec::new();
        for (number, layer) in self.layers.iter_mut().enumerate() {
            let Some(light) = layer.slot.and_then(|slot| layer_light(slot, &scene, list)) else { continue };
            let is_known = layer.light == Some(light);
            if is_known && is_still {
                continue;
            }
            scene.casters(layer.slot.unwrap_or_default(), frame.library, &mut casters);
            let faces = light.faces();
            let count = faces.len();
            let mut due = Vec::new();
            for (index, face) in faces.into_iter().enumerate() {
                let held = casters.iter().filter(|caster| light.holds(&face, caster.bounds));
                let mut held: Vec<_> =
                    held.filter_map(|caster| face_caster(caster, &light, &face, meshes, self.masks)).collect();
                held.sort_by_key(|(key, caster)| (*key, caster.mesh, caster.level, caster.slot));
                let found = held.iter().map(|(_, caster)| *caster);
                if !(is_known && layer.faces.get(index).is_some_and(|drawn| found.clone().eq(drawn.iter().copied()))) {
                    let draws = draws_of(&held, meshes);
                    due.push((index, DueFace { face, casters: found.collect(), draws }));
                }
            }
            if !due.is_empty() {
                let clear = !is_known || due.len() == count;
                self.due.push(DueLayer { layer: number, light, clear, faces: due, count });
            }
        }
        self.upload(gpu)
    }

    /// The slots of casters and the records of faces that are due.
    fn upload(&mut self, gpu: &Gpu) -> Result<u64, RenderError> {
        let Some(device) = self.device.as_mut().filter(|_| !self.due.is_empty()) else { return Ok(0) };
        let stride = face_stride(&gpu.device) as usize;
        let (mut slots, mut faces) = (Vec::new(), Vec::new());
        for layer in &mut self.due {
            for (_, due) in &mut layer.faces {
                for draw in &mut due.draws {
                    draw.slots = draw.slots.start + slots.len() as u32..draw.slots.end + slots.len() as u32;
                }
                slots.extend(due.casters.iter().map(|caster| caster.slot));
                let record = layer.light.face_record(&due.face);
                faces.extend_from_slice(bytemuck::bytes_of(&record));
                faces.resize(faces.len().next_multiple_of(stride), 0);
            }
        }
        let all = DirtySlots::default();
        let written = device.slots.write(gpu, &slots, &all, true)? + device.faces.write(gpu, &faces, &all, true)?;
        let keys = self.due.iter().flat_map(|layer| &layer.faces).flat_map(|(_, due)| &due.draws);
        let masks: BTreeSet<_> = keys.filter_map(|draw| draw.key.map(|(_, mask)| mask)).collect();
        masks.into_iter().for_each(|mask| device.make_mask(&gpu.device, mask));
        Ok(written)
    }

    /// Draws what is due.
    pub fn encode(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        (tables, frame_layout): (&FrameTables, &wgpu::BindGroupLayout),
        (meshes, textures): (&Meshes, &Textures),
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
        for due in self.due.drain(..) {
            let load = if due.clear { wgpu::LoadOp::Clear(0.0) } else { wgpu::LoadOp::Load };
            let depth_ops = Some(wgpu::Operations { load, store: wgpu::StoreOp::Store });
            let view = &maps.layers[due.layer];
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("shadows"),
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view,
                    depth_ops,
                    stencil_ops: None,
                }),
                timestamp_writes: timestamps.and_then(|timestamps| timestamps.render_pass("shadows")),
                ..wgpu::RenderPassDescriptor::default()
            });
            pass.set_bind_group(0, table_group, &[]);
            pass.set_vertex_buffer(0, meshes.vertices.buffer().slice(..));
            pass.set_vertex_buffer(1, device.slots.buffer().slice(..));
            pass.set_index_buffer(meshes.indices.buffer().slice(..), wgpu::IndexFormat::Uint32);
            let layer = &mut self.layers[due.layer];
            if due.clear {
                layer.faces = vec![Vec::new(); due.count];
            }
            layer.light = Some(due.light);
            self.stats.passes += 1;
            for (index, face) in due.faces {
                let [x, y] = face.face.corner;
                let size = face.face.size;
                pass.set_viewport(x as f32, y as f32, size as f32, size as f32, 0.0, 1.0);
                pass.set_scissor_rect(x, y, size, size);
                pass.set_bind_group(3, face_group, &[number * stride]);
                number += 1;
                if !due.clear {
                    pass.set_pipeline(&device.empty);
                    pass.draw(0..3, 0..1);
                }
                for draw in &face.draws {
                    if let Some((class, mask)) = draw.key {
                        let group = textures.class(class, Technique::Off);
                        let (Some(group), Some(pipeline)) = (group, device.masks.get(&mask)) else { continue };
                        pass.set_pipeline(pipeline);
                        pass.set_bind_group(1, group, &[]);
                    } else {
                        pass.set_pipeline(&device.opaque);
                    }
                    pass.draw_indexed(draw.indices.clone(), draw.base_vertex, draw.slots.clone());
                }
                self.stats.faces += 1;
                self.stats.casters += face.casters.len() as u32;
                layer.faces[index] = face.casters;
            }
        }
    }
}

/// The light in a slot as its layer has it.
fn layer_light(slot: u32, scene: &ShadowScene<'_>, list: &DrawList) -> Option<LayerLight> {
    let near = scene.lights().get(slot)?.near;
    let record: &PackedLight = list.lights.records.get(slot as usize)?;
    Some(LayerLight::new(&record.unpacked(), near))
}

/// A caster as it is drawn into a face; `None` while its mesh is not uploaded.
fn face_caster(
    caster: &ShadowCaster,
    light: &LayerLight,
    face: &Face,
    meshes: &Meshes,
    masks: u64,
) -> Option<(CasterKey, FaceCaster)> {
    let ShadowCaster { slot, key: BatchKey { pipeline, class, mesh }, material, world_from_object, bounds } = *caster;
    let range = meshes.range(mesh)?;
    let m = world_from_object.matrix3;
    let stretch = m.x_axis.length().max(m.y_axis.length()).max(m.z_axis.length());
    let (distance, texels) = light.detail(face, bounds);
    let level = DETAIL.choose(&range.levels, stretch, distance, texels) as u32;
    let is_mask = pipeline.alpha == AlphaMode::Mask;
    let key = is_mask.then_some((class, (pipeline.transformed_uvs, pipeline.vertex_colors)));
    let place = [m.x_axis, m.y_axis, m.z_axis, world_from_object.translation].map(Vec3::from);
    let mask = is_mask.then_some((material, masks));
    Some((key, FaceCaster { mesh, level, slot, place, mask }))
}

/// A draw for each run of casters of one kind, mesh and level.
fn draws_of(casters: &[(CasterKey, FaceCaster)], meshes: &Meshes) -> Vec<CasterDraw> {
    let mut start = 0;
    let mut draws = Vec::new();
    for run in casters.chunk_by(|(a, x), (b, y)| (a, x.mesh, x.level) == (b, y.mesh, y.level)) {
        let slots = start..start + run.len() as u32;
        start = slots.end;
        let (key, first) = run[0];
        let Some(mesh) = meshes.range(first.mesh) else { continue };
        let Some(level) = mesh.levels.get(first.level as usize) else { continue };
        let indices = mesh.first_index() + level.first_index;
        let indices = indices..indices + level.index_count;
        draws.push(CasterDraw { key, indices, base_vertex: mesh.base_vertex(), slots });
    }
    draws
}
