//! The tables of a draw list on the GPU, which all views share, and the bind group through which passes read them.

use super::scatter::Scatter;
use super::sky::{SkyBinding, SkyTextures};
use super::stats::RenderStats;
use super::tables::{RecordTable, SHADOW_RECORDS, TableKind, TableTexture};
use crate::renderer::gpu::device::Gpu;
use crate::renderer::gpu::error::RenderError;
use crate::renderer::gpu::timestamps::Timestamps;
use std::collections::BTreeMap;
use std::ops::Range;
use systems::draw::{FrameData, InstanceRecord, MaterialRecord};
use systems::ecs::tables::{DirtySlots, Records, Table};
use systems::lights::{LightListPage, LightLists, MOST_LIGHTS, PackedLight};

/// Instances, lights, materials, lists of lights.
#[derive(Debug)]
pub(crate) struct FrameTables {
    texture: TableTexture,
    instances: RecordTable<InstanceRecord>,
    lights: RecordTable<PackedLight>,
    materials: RecordTable<MaterialRecord>,
    light_lists: RecordTable<LightListPage>,
    scatter: Scatter,
    sky: SkyBinding,
    /// The shadow layers of lights by slot, as they are uploaded.
    layers: BTreeMap<u32, u8>,
    /// The shadow records of each view, as they are uploaded.
    shadow_records: Vec<Vec<[u32; 4]>>,
    /// The frame of the draw list whose tables are uploaded.
    uploaded_frame: Option<u64>,
}

impl FrameTables {
    pub fn new(device: &wgpu::Device) -> Self {
        Self {
            texture: TableTexture::new(device),
            instances: RecordTable::new(device, TableKind::Instances),
            lights: RecordTable::new(device, TableKind::Lights),
            materials: RecordTable::new(device, TableKind::Materials),
            light_lists: RecordTable::new(device, TableKind::LightLists),
            scatter: Scatter::new(device),
            sky: SkyBinding::new(device),
            layers: BTreeMap::new(),
            shadow_records: Vec::new(),
            uploaded_frame: None,
        }
    }

    /// Uploads what changed since the frame that was uploaded last, and books the bytes. `layers`: the shadow layers of
    /// lights by their slots. `shadow_records`: of each view the records of its layers.
    pub fn upload(
        &mut self,
        gpu: &Gpu,
        frame: &FrameData<'_>,
        layers: &BTreeMap<u32, u8>,
        shadow_records: &[Vec<[u32; 4]>],
        skies: &mut SkyTextures,
        stats: &mut RenderStats,
    ) -> Result<(), RenderError> {
        let list = frame.list;
        if list.lights.records.len() > MOST_LIGHTS {
            let (needed, limit) = (list.lights.records.len() as u64, MOST_LIGHTS as u64);
            return Err(RenderError::TooLarge { what: "the light table", unit: "lights", needed, limit });
        }
        if frame.light_lists.refused() > 0 {
            let needed = frame.light_lists.lights() + frame.light_lists.refused();
            let (what, limit) = ("the lists of lights of objects", LightLists::MOST_LIGHTS);
            return Err(RenderError::TooLarge { what, unit: "lights", needed, limit });
        }
        let is_new = self.uploaded_frame != Some(list.frame);
        let all = self.uploaded_frame.is_none_or(|uploaded| list.frame != uploaded + 1) && is_new;
        let Self { texture, instances, lights, materials, light_lists, scatter, .. } = self;
        let (objects, lists) = (frame.instances, frame.light_lists.pages());
        let given = LayeredLights::new(&list.lights, layers, &self.layers, is_new);
        if is_new || !given.dirty.is_empty() {
            lights.scattered.flush(gpu, scatter);
        }
        if is_new {
            instances.scattered.flush(gpu, scatter);
            materials.scattered.flush(gpu, scatter);
            light_lists.scattered.flush(gpu, scatter);
        }
        let has_records = shadow_records.iter().any(|records| !records.is_empty());
        let texels = [
            RecordTable::texels(objects),
            RecordTable::texels(&list.lights),
            RecordTable::texels(&list.materials),
            RecordTable::texels(lists),
            if has_records { shadow_records.len() as u64 * SHADOW_RECORDS } else { 0 },
        ];
        texture.reserve(gpu, texels)?;
        if is_new {
            stats.instance_bytes = instances.mirror(gpu, scatter, texture, objects, all)?;
            stats.material_bytes = materials.mirror(gpu, scatter, texture, &list.materials, all)?;
            stats.light_bytes = light_lists.mirror(gpu, scatter, texture, lists, all)?;
        }
        stats.light_bytes += self.sky.upload(gpu, list.sky.as_ref(), skies);
        // A light keeps its layer through its own changes, and its changes through those of its layer.
        stats.light_bytes += lights.mirror(gpu, scatter, texture, &given, all)?;
        self.layers.clone_from(layers);
        if !has_records {
            // Their rows may go.
            self.shadow_records.clear();
        }
        self.shadow_records.resize(shadow_records.len(), Vec::new());
        for (view, (records, uploaded)) in shadow_records.iter().zip(&mut self.shadow_records).enumerate() {
            if records != uploaded {
                stats.light_bytes += texture.write_shadow_records(gpu, view as u64, records);
                uploaded.clone_from(records);
            }
        }
        self.uploaded_frame = Some(list.frame);
        Ok(())
    }

    /// The texel that has the record of a view's first shadow layer.
    pub fn shadow_records(&self, view: u64) -> u32 {
        (self.texture.start(TableKind::ShadowRecords) + view * SHADOW_RECORDS) as u32
    }

    /// Encodes the uploads that commands finish. First of all in a frame.
    pub fn encode(&mut self, encoder: &mut wgpu::CommandEncoder, timestamps: Option<&Timestamps>) {
        let Self { scatter, instances, lights, materials, light_lists, .. } = self;
        let tables =
            [&mut instances.scattered, &mut lights.scattered, &mut materials.scattered, &mut light_lists.scattered];
        if tables.iter().any(|table| table.is_pending()) {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some("scatter"),
                timestamp_writes: timestamps.and_then(|timestamps| timestamps.compute_pass("scatter")),
            });
            tables.into_iter().for_each(|table| table.encode(scatter, &mut pass));
        }
    }

    /// Changes whenever bind groups of views are to be made anew.
    pub fn version(&self) -> u32 {
        self.texture.version.wrapping_add(self.sky.version)
    }

    /// Makes bind group 0 of every pass over a view: the view's record, and the tables.
    pub fn bind(&self, device: &wgpu::Device, layout: &wgpu::BindGroupLayout, view: &wgpu::Buffer) -> wgpu::BindGroup {
        let resources = [
            view.as_entire_binding(),
            wgpu::BindingResource::TextureView(&self.texture.view),
            self.texture.starts.as_entire_binding(),
        ];
        let resources = resources.into_iter().chain(self.sky.resources());
        let entries: Vec<_> =
            (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("frame"), layout, entries: &entries })
    }
}

/// The light table with the shadow layers of lights, which are the renderer's.
struct LayeredLights<'a> {
    lights: &'a Table<PackedLight>,
    layers: &'a BTreeMap<u32, u8>,
    dirty: DirtySlots,
}

impl<'a> LayeredLights<'a> {
    /// Dirty are lights whose layer is another than was uploaded, and, in a new frame, those of the table.
    fn new(
        lights: &'a Table<PackedLight>,
        layers: &'a BTreeMap<u32, u8>,
        uploaded: &BTreeMap<u32, u8>,
        is_new: bool,
    ) -> Self {
        let mut dirty = if is_new { lights.dirty.clone() } else { DirtySlots::default() };
        if layers != uploaded {
            let count = lights.slot_count();
            let slots = layers.keys().chain(uploaded.keys()).filter(|slot| **slot < count);
            slots.filter(|slot| layers.get(slot) != uploaded.get(slot)).for_each(|&slot| dirty.mark(slot));
        }
        Self { lights, layers, dirty }
    }
}

impl Records for LayeredLights<'_> {
    type Record = PackedLight;

    fn slot_count(&self) -> u32 {
        self.lights.slot_count()
    }

    fn dirty(&self) -> &DirtySlots {
        &self.dirty
    }

    fn read<'a>(&'a self, ranges: &[Range<u32>], room: &'a mut Vec<PackedLight>) -> &'a [PackedLight] {
        if self.layers.is_empty() {
            return self.lights.read(ranges, room);
        }
        room.clear();
        for range in ranges {
            let first = room.len();
            room.extend_from_slice(&self.lights.records[range.start as usize..range.end as usize]);
            for (&slot, &layer) in self.layers.range(range.clone()) {
                let light = &mut room[first + (slot - range.start) as usize];
                *light = light.with_shadow_layer(layer);
            }
        }
        room
    }
}
