//! The tables of a draw list on the GPU, which all views share, and the bind group through which passes read them.

use super::scatter::Scatter;
use super::tables::{GrowingBuffer, RecordTable, TableKind, TableTexture};
use super::timestamps::Timestamps;
use super::{Gpu, RenderError, RenderStats};
use systems::draw::{DrawList, FrameData, InstanceRecord, MAX_REACHING, MaterialRecord};
use systems::ecs::tables::DirtySlots;
use systems::lights::{LightRecord, MOST_LIGHTS};

/// Instances, lights, materials.
#[derive(Debug)]
pub(super) struct FrameTables {
    texture: TableTexture,
    instances: RecordTable<InstanceRecord>,
    lights: RecordTable<LightRecord>,
    materials: RecordTable<MaterialRecord>,
    scatter: Scatter,
    reaching: GrowingBuffer,
    /// World and version of the lists that are uploaded.
    uploaded_reaching: (u64, u64),
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
            scatter: Scatter::new(device),
            reaching: GrowingBuffer::new(device, "lights of objects", wgpu::BufferUsages::STORAGE),
            uploaded_reaching: (0, 0),
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
        if self.uploaded_frame != Some(list.frame) {
            let all = self.uploaded_frame.is_none_or(|uploaded| list.frame != uploaded + 1);
            let Self { texture, instances, lights, materials, scatter, .. } = self;
            let objects = frame.instances;
            instances.scattered.flush(gpu, scatter);
            lights.scattered.flush(gpu, scatter);
            materials.scattered.flush(gpu, scatter);
            let texels =
                [RecordTable::texels(objects), RecordTable::texels(&list.lights), RecordTable::texels(&list.materials)];
            texture.reserve(gpu, texels)?;
            stats.instance_bytes = instances.mirror(gpu, scatter, texture, objects, all)?;
            stats.light_bytes = lights.mirror(gpu, scatter, texture, &list.lights, all)?;
            stats.material_bytes = materials.mirror(gpu, scatter, texture, &list.materials, all)?;
            self.uploaded_frame = Some(list.frame);
        }
        stats.light_bytes += self.upload_reaching(gpu, list)?;
        Ok(())
    }

    /// Encodes the uploads that commands finish. First of all in a frame.
    pub fn encode(&mut self, encoder: &mut wgpu::CommandEncoder, timestamps: Option<&Timestamps>) {
        let Self { scatter, instances, lights, materials, .. } = self;
        let tables = [&mut instances.scattered, &mut lights.scattered, &mut materials.scattered];
        if tables.iter().any(|table| table.is_pending()) {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some("scatter"),
                timestamp_writes: timestamps.and_then(|timestamps| timestamps.compute_pass("scatter")),
            });
            tables.into_iter().for_each(|table| table.encode(scatter, &mut pass));
        }
    }

    /// The lists of the policy that shades with every light.
    fn upload_reaching(&mut self, gpu: &Gpu, list: &DrawList) -> Result<u64, RenderError> {
        let version = (list.world, list.reaching_version);
        if !list.all_lights || self.uploaded_reaching == version {
            return Ok(0);
        }
        if list.reaching_elements > MAX_REACHING {
            let (needed, limit) = (list.reaching_elements, MAX_REACHING);
            let what = "the list of all lights that reach each object";
            return Err(RenderError::TooLarge { what, unit: "entries", needed, limit });
        }
        let bytes = self.reaching.write(gpu, &list.reaching, &DirtySlots::default(), true)?;
        self.uploaded_reaching = version;
        Ok(bytes)
    }

    /// Changes whenever bind groups of views are to be made anew.
    pub fn version(&self) -> u32 {
        self.texture.version + self.reaching.version
    }

    /// What every pass over a view binds as group 0: the view's record, and the tables.
    pub fn bind(&self, device: &wgpu::Device, layout: &wgpu::BindGroupLayout, view: &wgpu::Buffer) -> wgpu::BindGroup {
        let resources = [
            view.as_entire_binding(),
            wgpu::BindingResource::TextureView(&self.texture.view),
            self.texture.starts.as_entire_binding(),
            self.reaching.buffer().as_entire_binding(),
        ];
        let entries: Vec<_> =
            (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("frame"), layout, entries: &entries })
    }
}
