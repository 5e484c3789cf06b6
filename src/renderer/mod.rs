//! The GPU half of a frame, and the only place that knows wgpu.
//!
//! ```text
//! Renderer::prepare(list, library, view, settings)    uploads what changed, makes the pipelines that are missing
//!   meshes      new ones into the shared vertex and index buffers
//!   textures    new layers of the texture arrays; a bind group per material class
//!   tables      dirty ranges of instances, lights, materials; the slots, if the batches changed
//! Renderer::draw(target)                              records only
//!   forward     one instanced draw per batch, the sky, blended objects back to front → HDR, multisampled
//!   tone map    → target
//! Renderer::draw_outputs()                            the same objects once more → normal, id, depth
//! ```
//!
//! A window, a file and a test call the same functions: `draw` takes a texture view.

mod gpu;
mod meshes;
mod outputs;
mod pipelines;
mod readback;
mod settings;
pub mod shaders;
mod tables;
mod targets;
mod textures;
mod timestamps;

pub use gpu::{Gpu, GpuError};
pub use outputs::Outputs;
pub use readback::read_texture;
pub use settings::{DebugView, HeatScale, Settings};
pub use timestamps::PassTime;

use meshes::Meshes;
use pipelines::{OUTPUT_FORMATS, Pass, Pipelines};
use systems::batches::sort_transparent;
use systems::components::{Environment, ToneMap};
use systems::draw_list::{Batch, DirtySlots, DrawList, MAX_REACHING, ViewRecord};
use systems::library::{Library, Technique};
use systems::view::View;
use tables::GrowingBuffer;
use targets::{DEPTH_FORMAT, Targets, whole_view};
use textures::Textures;
use timestamps::Timestamps;

/// The format of pictures that are written or compared; a window's surface has the like.
pub const PICTURE_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;

/// A scene that the device cannot hold.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// A buffer or picture would be larger than the device allows.
    #[error("too large for this graphics adapter: {what}: {needed} {unit}, it allows {limit}")]
    TooLarge {
        /// Which buffer, or the picture.
        what: &'static str,
        /// What is counted.
        unit: &'static str,
        /// Needed.
        needed: u64,
        /// Allowed.
        limit: u64,
    },
}

/// What the last prepare and draw did.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct RenderStats {
    /// Draw calls of objects.
    pub draws: u32,
    /// Objects drawn.
    pub instances: u32,
    /// Triangles of those objects.
    pub triangles: u64,
    /// Bytes of instance records uploaded.
    pub instance_bytes: u64,
    /// Bytes of light records uploaded.
    pub light_bytes: u64,
    /// Bytes of material records uploaded.
    pub material_bytes: u64,
    /// Bytes of slots uploaded.
    pub slot_bytes: u64,
    /// Bytes of meshes and textures uploaded.
    pub asset_bytes: u64,
}

impl RenderStats {
    /// All bytes uploaded.
    pub fn uploaded_bytes(&self) -> u64 {
        self.instance_bytes + self.light_bytes + self.material_bytes + self.slot_bytes + self.asset_bytes
    }
}

/// Draws draw lists.
#[derive(Debug)]
pub struct Renderer {
    gpu: Gpu,
    pipelines: Pipelines,
    textures: Textures,
    meshes: Meshes,
    view_buffer: wgpu::Buffer,
    instances: GrowingBuffer,
    slots: GrowingBuffer,
    lights: GrowingBuffer,
    materials: GrowingBuffer,
    reaching: GrowingBuffer,
    /// World and version of the lists that are uploaded.
    uploaded_reaching: (u64, u64),
    frame_group: Option<(u32, wgpu::BindGroup)>,
    targets: Option<Targets>,
    /// The world whose meshes, textures and tables are uploaded.
    world: u64,
    /// The frame of the draw list whose tables are uploaded.
    uploaded_frame: u64,
    uploaded_batches: u64,
    opaque_slots: u32,
    /// Blended slots as they were last uploaded.
    transparent_slots: Vec<u32>,
    opaque: Vec<Batch>,
    transparent: Vec<Batch>,
    pass: Pass,
    tone_map: ToneMap,
    /// A sky of one colour is a clear, which costs nothing: a gradient takes a software rasteriser longer than a thousand
    /// objects.
    plain_sky: Option<wgpu::Color>,
    /// What the HDR target shows: view, pass, technique, batches. `None`: nothing yet.
    shown: Option<(ViewRecord, Pass, Option<Technique>, u64)>,
    stats: RenderStats,
    /// Where the device was opened with them.
    timestamps: Option<Timestamps>,
}

impl Renderer {
    /// A renderer for a device.
    pub fn new(gpu: &Gpu) -> Self {
        let device = &gpu.device;
        let textures = Textures::new(device);
        let storage = |label| GrowingBuffer::new(device, label, wgpu::BufferUsages::STORAGE);
        Self {
            pipelines: Pipelines::new(device, &textures.layout),
            textures,
            meshes: Meshes::new(device),
            view_buffer: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("view"),
                size: size_of::<ViewRecord>() as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            instances: storage("instances"),
            slots: storage("slots"),
            lights: storage("lights"),
            materials: storage("materials"),
            reaching: storage("lights of objects"),
            uploaded_reaching: (0, 0),
            frame_group: None,
            targets: None,
            world: 0,
            uploaded_frame: 0,
            uploaded_batches: 0,
            opaque_slots: 0,
            transparent_slots: Vec::new(),
            opaque: Vec::new(),
            transparent: Vec::new(),
            pass: Pass::Outputs,
            tone_map: ToneMap::default(),
            plain_sky: None,
            shown: None,
            stats: RenderStats::default(),
            timestamps: Timestamps::new(gpu),
            gpu: gpu.clone(),
        }
    }

    /// The device it draws with.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// What the last prepare and draw did.
    pub fn stats(&self) -> RenderStats {
        self.stats
    }

    /// How long the GPU took over each pass of the oldest frame not asked for yet, in order; `None` while it has not
    /// arrived, and on a device without [`wgpu::Features::TIMESTAMP_QUERY`].
    pub fn pass_times(&mut self) -> Option<Vec<PassTime>> {
        self.timestamps.as_mut()?.take()
    }

    /// Uploads what changed in the draw list and makes what is missing, so that [`Self::draw`] only records. Returns
    /// whether the picture can differ from the one last drawn; if not, [`Self::show_again`] gives it for less.
    ///
    /// # Errors
    /// [`RenderError::TooLarge`].
    pub fn prepare(
        &mut self,
        list: &DrawList,
        library: &Library,
        view: &View,
        settings: &Settings,
    ) -> Result<bool, RenderError> {
        if list.world != self.world {
            // What is on the device belongs to another world.
            *self = Self { world: list.world, ..Self::new(&self.gpu) };
        }
        let limit = self.gpu.device.limits().max_texture_dimension_2d;
        let longest = view.width.max(view.height);
        if longest > limit {
            let (needed, limit) = (longest.into(), limit.into());
            return Err(RenderError::TooLarge { what: "the picture", unit: "pixels along a side", needed, limit });
        }
        self.stats = RenderStats::default();
        self.stats.asset_bytes = self.meshes.upload(&self.gpu, library)?;
        self.stats.asset_bytes += self.textures.upload(&self.gpu, list, library);
        self.upload_tables(list)?;
        self.upload_slots(list, view)?;
        self.upload_reaching(list)?;
        let record = view.record(&list.environment, list.lights.records.len() as u32, settings.picked_entity);
        self.gpu.queue.write_buffer(&self.view_buffer, 0, bytemuck::bytes_of(&record));
        self.bind_frame();

        self.pass = Pass::Color { all_lights: list.all_lights, debug: settings.debug, samples: settings.samples };
        self.tone_map = if settings.debug == DebugView::Off { list.environment.tone_map } else { ToneMap::Clamp };
        self.take_batches(list, settings.technique);
        self.make_pipelines(self.pass);
        self.plain_sky = plain_sky(&list.environment);
        if self.plain_sky.is_none() {
            self.pipelines.make_sky(&self.gpu.device, settings.samples);
        }
        let size = (view.width, view.height);
        if self.targets.as_ref().is_none_or(|t| (t.width, t.height, t.samples) != (size.0, size.1, settings.samples)) {
            let layout = &self.pipelines.tone_map_layout;
            self.targets = Some(Targets::new(&self.gpu.device, layout, size, settings.samples));
            self.shown = None;
        }
        let showing = Some((record, self.pass, settings.technique, list.batches_version));
        let changed = self.shown != showing || self.stats.uploaded_bytes() > 0;
        self.shown = showing;
        Ok(changed)
    }

    fn upload_tables(&mut self, list: &DrawList) -> Result<(), RenderError> {
        if list.frame == self.uploaded_frame {
            return Ok(());
        }
        let missed = list.frame != self.uploaded_frame + 1;
        self.stats.instance_bytes = self.instances.mirror(&self.gpu, &list.instances, missed)?;
        self.stats.light_bytes = self.lights.mirror(&self.gpu, &list.lights, missed)?;
        self.stats.material_bytes = self.materials.mirror(&self.gpu, &list.materials, missed)?;
        self.uploaded_frame = list.frame;
        Ok(())
    }

    /// The lists of the policy that shades with every light.
    fn upload_reaching(&mut self, list: &DrawList) -> Result<(), RenderError> {
        let version = (list.world, list.reaching_version);
        if !list.all_lights || self.uploaded_reaching == version {
            return Ok(());
        }
        if list.reaching_elements > MAX_REACHING {
            let (needed, limit) = (list.reaching_elements, MAX_REACHING);
            let what = "the list of all lights that reach each object";
            return Err(RenderError::TooLarge { what, unit: "entries", needed, limit });
        }
        self.stats.light_bytes += self.reaching.write(&self.gpu, &list.reaching, &DirtySlots::default(), true)?;
        self.uploaded_reaching = version;
        Ok(())
    }

    /// Slots of the batches, then those of blended objects in this view's order.
    fn upload_slots(&mut self, list: &DrawList, view: &View) -> Result<(), RenderError> {
        let (mut order, mut transparent) = sort_transparent(&list.transparent, view.direction());
        let first = list.slots.len() as u32;
        transparent.iter_mut().for_each(|batch| batch.first += first);
        self.transparent = transparent;
        if list.batches_version != self.uploaded_batches || first != self.opaque_slots {
            let mut all = list.slots.clone();
            all.append(&mut order.clone());
            self.stats.slot_bytes = self.slots.write(&self.gpu, &all, &DirtySlots::default(), true)?;
            self.uploaded_batches = list.batches_version;
            self.opaque_slots = first;
        } else if order != self.transparent_slots {
            self.slots.extend(&self.gpu, u64::from(first) * 4, (u64::from(first) + order.len() as u64) * 4)?;
            let bytes: &[u8] = bytemuck::cast_slice(&order);
            self.gpu.queue.write_buffer(self.slots.buffer(), u64::from(first) * 4, bytes);
            self.stats.slot_bytes = bytes.len() as u64;
        }
        self.transparent_slots = std::mem::take(&mut order);
        Ok(())
    }

    fn bind_frame(&mut self) {
        let tables = [&self.instances, &self.slots, &self.lights, &self.materials, &self.reaching];
        let version = tables.iter().map(|table| table.version).sum();
        if self.frame_group.as_ref().is_some_and(|(bound, _)| *bound == version) {
            return;
        }
        let view = std::iter::once(&self.view_buffer);
        let entries: Vec<_> = view
            .chain(tables.iter().map(|table| table.buffer()))
            .enumerate()
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding: binding as u32,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        let descriptor =
            wgpu::BindGroupDescriptor { label: Some("frame"), layout: &self.pipelines.frame_layout, entries: &entries };
        self.frame_group = Some((version, self.gpu.device.create_bind_group(&descriptor)));
    }

    fn take_batches(&mut self, list: &DrawList, technique: Option<Technique>) {
        self.opaque.clear();
        self.opaque.extend_from_slice(&list.batches);
        if let Some(technique) = technique {
            let batches = self.opaque.iter_mut().chain(&mut self.transparent);
            batches.for_each(|batch| batch.key.pipeline.technique = technique);
        }
    }

    fn make_pipelines(&mut self, pass: Pass) {
        for batch in self.opaque.iter().chain(&self.transparent) {
            self.pipelines.make_object(&self.gpu.device, pass, batch.key.pipeline);
        }
    }

    /// Draws what was prepared into `target`, a view of a texture of that format and the prepared view's size. An
    /// sRGB format encodes; others receive linear values.
    pub fn draw(&mut self, target: &wgpu::TextureView, format: wgpu::TextureFormat) {
        let commands = self.record(target, format);
        self.gpu.queue.submit([commands]);
    }

    /// [`Self::draw`] without handing the commands in, for who measures the two apart.
    pub fn record(&mut self, target: &wgpu::TextureView, format: wgpu::TextureFormat) -> wgpu::CommandBuffer {
        let label = wgpu::CommandEncoderDescriptor { label: Some("frame") };
        let mut encoder = self.gpu.device.create_command_encoder(&label);
        let drawn = self.record_forward(&mut encoder);
        self.stats = add(self.stats, drawn);
        self.record_tone_map(&mut encoder, target, format);
        if let Some(timestamps) = &mut self.timestamps {
            timestamps.finish(&mut encoder);
        }
        encoder.finish()
    }

    /// What was drawn last, once more: only the tone map. For a window whose panel changes above a still scene.
    pub fn show_again(&mut self, target: &wgpu::TextureView, format: wgpu::TextureFormat) {
        let label = wgpu::CommandEncoderDescriptor { label: Some("frame again") };
        let mut encoder = self.gpu.device.create_command_encoder(&label);
        self.record_tone_map(&mut encoder, target, format);
        if let Some(timestamps) = &mut self.timestamps {
            timestamps.finish(&mut encoder);
        }
        self.gpu.queue.submit([encoder.finish()]);
    }

    fn record_forward(&self, encoder: &mut wgpu::CommandEncoder) -> RenderStats {
        let (Some(targets), Some((_, frame_group))) = (&self.targets, &self.frame_group) else {
            return RenderStats::default();
        };
        let resolve_target = (targets.samples > 1).then_some(&targets.hdr);
        let keep = if resolve_target.is_some() { wgpu::StoreOp::Discard } else { wgpu::StoreOp::Store };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("forward"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &targets.color,
                depth_slice: None,
                resolve_target,
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(self.plain_sky.unwrap_or_default()), store: keep },
            })],
            depth_stencil_attachment: Some(depth_attachment(&targets.depth, wgpu::StoreOp::Discard)),
            timestamp_writes: self.timestamps.as_ref().and_then(|timestamps| timestamps.render_pass("forward")),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_bind_group(0, frame_group, &[]);
        pass.push_debug_group("objects");
        let objects = self.draw_batches(&mut pass, self.pass, &self.opaque);
        pass.pop_debug_group();
        if let (None, Some(sky)) = (self.plain_sky, self.pipelines.sky(targets.samples)) {
            pass.set_pipeline(sky);
            pass.draw(0..3, 0..1);
        }
        pass.push_debug_group("blended objects");
        let blended = self.draw_batches(&mut pass, self.pass, &self.transparent);
        pass.pop_debug_group();
        add(objects, blended)
    }

    fn record_tone_map(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        format: wgpu::TextureFormat,
    ) {
        let (Some(targets), Some((_, frame_group))) = (&self.targets, &self.frame_group) else { return };
        let tone_map = self.pipelines.tone_map(&self.gpu.device, format, self.tone_map);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("tone map"),
            color_attachments: &[Some(color_attachment(target))],
            timestamp_writes: self.timestamps.as_ref().and_then(|timestamps| timestamps.render_pass("tone map")),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(tone_map);
        pass.set_bind_group(0, frame_group, &[]);
        pass.set_bind_group(1, &targets.tone_map_source, &[]);
        pass.draw(0..3, 0..1);
    }

    /// Draws the prepared objects once more, one sample per pixel, for their normals, ids and depths.
    pub fn draw_outputs(&mut self) -> Option<Outputs> {
        self.make_pipelines(Pass::Outputs);
        let (targets, (_, frame_group)) = (self.targets.as_ref()?, self.frame_group.as_ref()?);
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
        let size = (targets.width, targets.height);
        let make = |label, format| targets::texture(&self.gpu.device, label, size, format, 1, usage);
        let (normal, id) = (make("normals", OUTPUT_FORMATS[0]), make("ids", OUTPUT_FORMATS[1]));
        let depth = make("output depth", DEPTH_FORMAT);
        let views = [whole_view(&normal, "normals"), whole_view(&id, "ids"), whole_view(&depth, "output depth")];
        let label = wgpu::CommandEncoderDescriptor { label: Some("outputs") };
        let mut encoder = self.gpu.device.create_command_encoder(&label);
        {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("outputs"),
                color_attachments: &[Some(color_attachment(&views[0])), Some(color_attachment(&views[1]))],
                depth_stencil_attachment: Some(depth_attachment(&views[2], wgpu::StoreOp::Store)),
                ..wgpu::RenderPassDescriptor::default()
            });
            pass.set_bind_group(0, frame_group, &[]);
            self.draw_batches(&mut pass, Pass::Outputs, &self.opaque);
            self.draw_batches(&mut pass, Pass::Outputs, &self.transparent);
        }
        self.gpu.queue.submit([encoder.finish()]);
        Some(Outputs { width: size.0, height: size.1, normal, id, depth })
    }

    fn draw_batches(&self, pass: &mut wgpu::RenderPass<'_>, kind: Pass, batches: &[Batch]) -> RenderStats {
        let mut stats = RenderStats::default();
        pass.set_vertex_buffer(0, self.meshes.vertices.buffer().slice(..));
        pass.set_index_buffer(self.meshes.indices.buffer().slice(..), wgpu::IndexFormat::Uint32);
        let (mut pipeline, mut class) = (None, None);
        for batch in batches {
            let key = batch.key;
            let Some(mesh) = self.meshes.range(key.mesh) else { continue };
            if pipeline != Some(key.pipeline) {
                let Some(wanted) = self.pipelines.object(kind, key.pipeline) else { continue };
                pass.set_pipeline(wanted);
                pipeline = Some(key.pipeline);
            }
            if class != Some(key.class) {
                let Some(wanted) = self.textures.class(key.class) else { continue };
                pass.set_bind_group(1, wanted, &[]);
                class = Some(key.class);
            }
            let indices = mesh.first_index..mesh.first_index + mesh.index_count;
            pass.draw_indexed(indices, mesh.base_vertex, batch.first..batch.first + batch.count);
            stats.draws += 1;
            stats.instances += batch.count;
            stats.triangles += u64::from(batch.count) * u64::from(mesh.index_count / 3);
        }
        stats
    }

    /// Draws what was prepared and reads the picture back: 8-bit sRGB RGBA, rows from the top. Empty if nothing was
    /// prepared.
    pub fn draw_picture(&mut self) -> image::RgbaImage {
        let Some(size) = self.targets.as_ref().map(|t| (t.width, t.height)) else { return image::RgbaImage::default() };
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
        let texture = targets::texture(&self.gpu.device, "picture", size, PICTURE_FORMAT, 1, usage);
        self.draw(&whole_view(&texture, "picture"), PICTURE_FORMAT);
        let bytes = read_texture(&self.gpu, &texture, wgpu::TextureAspect::All);
        image::RgbaImage::from_raw(size.0, size.1, bytes).unwrap_or_default()
    }

    /// The linear HDR colours of the last draw, exposed, before the tone map: RGBA, rows from the top.
    pub fn read_linear(&self) -> Option<Vec<[f32; 4]>> {
        let bytes = read_texture(&self.gpu, &self.targets.as_ref()?.hdr_texture, wgpu::TextureAspect::All);
        let half = |b: &[u8]| half::f16::from_le_bytes([b[0], b[1]]).to_f32();
        Some(bytes.chunks_exact(8).map(|t| [half(&t[0..]), half(&t[2..]), half(&t[4..]), half(&t[6..])]).collect())
    }
}

fn add(a: RenderStats, b: RenderStats) -> RenderStats {
    RenderStats {
        draws: a.draws + b.draws,
        instances: a.instances + b.instances,
        triangles: a.triangles + b.triangles,
        ..a
    }
}

/// The colour of a sky that has only one, exposed as `sky_pass.wgsl` does.
fn plain_sky(environment: &Environment) -> Option<wgpu::Color> {
    let Environment { zenith, horizon, ground, exposure, .. } = environment;
    (zenith == horizon && horizon == ground).then(|| {
        let [r, g, b] = (*horizon * *exposure).min(glam::Vec3::splat(65504.0)).to_array().map(f64::from);
        wgpu::Color { r, g, b, a: 1.0 }
    })
}

fn color_attachment(view: &wgpu::TextureView) -> wgpu::RenderPassColorAttachment<'_> {
    let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store };
    wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops }
}

fn depth_attachment(view: &wgpu::TextureView, store: wgpu::StoreOp) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    // Reversed depth: 0 is infinitely far.
    let depth_ops = Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store });
    wgpu::RenderPassDepthStencilAttachment { view, depth_ops, stencil_ops: None }
}
