//! The tables of a draw list on the GPU, which all views share, and the bind group through which passes read them.

use super::scatter::Scatter;
use super::tables::{RecordTable, TableKind, TableTexture};
use super::timestamps::Timestamps;
use super::{Gpu, RenderError, RenderStats};
use systems::draw::{FrameData, InstanceRecord, MaterialRecord};
use systems::lights::{LightListPage, LightLists, MOST_LIGHTS, PackedLight};

/// Instances, lights, materials, lists of lights.
#[derive(Debug)]
pub(super) struct FrameTables {
    texture: TableTexture,
    instances: RecordTable<InstanceRecord>,
    lights: RecordTable<PackedLight>,
    materials: RecordTable<MaterialRecord>,
    light_lists: RecordTable<LightListPage>,
    scatter: Scatter,
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
            uploaded_frame: None,
        }
    }

    /// Uploads what changed since the frame that was uploaded last, and books the bytes.
    pub fn upload(&mut self, gpu: &Gpu, frame: &FrameData<'_>, stats: &mut RenderStats) -> Result<(), RenderError> {
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
        if self.uploaded_frame != Some(list.frame) {
            let all = self.uploaded_frame.is_none_or(|uploaded| list.frame != uploaded + 1);
            let Self { texture, instances, lights, materials, light_lists, scatter, .. } = self;
            let (objects, lists) = (frame.instances, frame.light_lists.pages());
            instances.scattered.flush(gpu, scatter);
            lights.scattered.flush(gpu, scatter);
            materials.scattered.flush(gpu, scatter);
            light_lists.scattered.flush(gpu, scatter);
            let texels = [
                RecordTable::texels(objects),
                RecordTable::texels(&list.lights),
                RecordTable::texels(&list.materials),
                RecordTable::texels(lists),
            ];
            texture.reserve(gpu, texels)?;
            stats.instance_bytes = instances.mirror(gpu, scatter, texture, objects, all)?;
            stats.light_bytes = lights.mirror(gpu, scatter, texture, &list.lights, all)?;
            stats.material_bytes = materials.mirror(gpu, scatter, texture, &list.materials, all)?;
            stats.light_bytes += light_lists.mirror(gpu, scatter, texture, lists, all)?;
            self.uploaded_frame = Some(list.frame);
        }
        Ok(())
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
        self.texture.version
    }

    /// What every pass over a view binds as group 0: the view's record, and the tables.
    pub fn bind(&self, device: &wgpu::Device, layout: &wgpu::BindGroupLayout, view: &wgpu::Buffer) -> wgpu::BindGroup {
        let resources = [
            view.as_entire_binding(),
            wgpu::BindingResource::TextureView(&self.texture.view),
            self.texture.starts.as_entire_binding(),
        ];
        let entries: Vec<_> =
            (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("frame"), layout, entries: &entries })
    }
}
