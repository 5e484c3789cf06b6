//! The GPU half of a frame, and the only place that knows wgpu.
//!
//! ```text
//! Renderer::prepare(simulation, view, settings)       uploads what changed, makes the pipelines that are missing
//!   meshes        new ones into the shared vertex and index buffers
//!   textures      new layers of the texture arrays; a bind group per material class
//!   frame tables  dirty records of instances, lights, materials
//!   draws         what the culling pass reads, if the batches changed
//! Renderer::draw(target)                              records only
//!   culling       which objects the view shows → lists of slots and arguments of draws, on the GPU
//!   forward       an indirect draw per batch and level of detail, the sky, blended objects back to front
//!                 → HDR, multisampled
//!   tone map      → target
//!                 or, without `Settings::hdr`, forward → target, tone-mapped where it is shaded
//! Renderer::draw_outputs()                            the same objects once more → normal, id, depth
//! ```
//!
//! A window, a file and a test call the same functions: `draw` takes a texture view.

mod culling;
mod drawn;
mod draws;
mod emboss;
mod error;
mod faults;
mod frame_tables;
mod gpu;
mod meshes;
mod outputs;
mod pipelines;
mod portions;
mod pyramid;
mod readback;
mod record;
mod scatter;
mod settings;
pub mod shaders;
mod tables;
mod targets;
mod textures;
mod timestamps;
mod tone_map;

pub use culling::CullRecord;
pub use drawn::Drawn;
pub use draws::{CullBatchRecord, CullDrawRecord};
pub use error::RenderError;
pub use faults::Faults;
pub(crate) use gpu::instance_flags;
pub use gpu::{Gpu, GpuError};
pub use outputs::Outputs;
use readback::read_buffer;
pub use readback::read_texture;
pub use settings::{DebugView, HeatScale, Occlusion, Settings};
pub use timestamps::PassTime;

use culling::{ARGUMENT_BYTES, CulledView, Culling, Phase};
use drawn::DrawnCounts;
use draws::Draws;
use emboss::EmbossPass;
use frame_tables::FrameTables;
use glam::Vec3;
use meshes::Meshes;
use pipelines::{MissingPipelines, Pass, Pipelines};
use portions::Portions;
use pyramid::{Pyramid, PyramidMaker};
use systems::Simulation;
use systems::batches::{BlendedRun, sort_transparent};
use systems::components::{Environment, ToneMap};
use systems::draw_list::{Batch, BatchKey, DrawList, LightTraits, PipelineKey, ViewRecord};
use systems::library::Technique;
use systems::tables::DirtySlots;
use systems::view::View;
use tables::GrowingBuffer;
use targets::{Behind, Targets, whole_view};
use textures::Textures;
use timestamps::Timestamps;

/// The format of pictures that are written or compared; a window's surface has the like.
pub const PICTURE_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;

/// What the last prepare and draw did.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct RenderStats {
    /// Draws of objects: batches at each level of detail in each phase, and runs of blended objects.
    pub draws: u32,
    /// Calls that they took.
    pub draw_calls: u32,
    /// Passes that they took, but for those of blended objects: one, or in each of two phases one; more where passes
    /// are cut ([`Renderer::cut_passes`]).
    pub passes: u32,
    /// Bytes of instance records uploaded.
    pub instance_bytes: u64,
    /// Bytes of light records uploaded.
    pub light_bytes: u64,
    /// Bytes of material records uploaded.
    pub material_bytes: u64,
    /// Bytes of the lists of pages, draws and blended objects uploaded.
    pub list_bytes: u64,
    /// Bytes of meshes and textures uploaded.
    pub asset_bytes: u64,
}

impl RenderStats {
    /// All bytes uploaded.
    pub fn uploaded_bytes(&self) -> u64 {
        self.instance_bytes + self.light_bytes + self.material_bytes + self.list_bytes + self.asset_bytes
    }
}

/// Draws draw lists.
#[derive(Debug)]
pub struct Renderer {
    gpu: Gpu,
    pipelines: Pipelines,
    textures: Textures,
    meshes: Meshes,
    tables: FrameTables,
    culling: Culling,
    pyramids: PyramidMaker,
    draws: Draws,
    culled: CulledView,
    /// The view that `culled` was made for, and the technique, which may write depths of its own.
    culled_for: Option<(ViewRecord, Option<Technique>)>,
    /// The lists of visible objects are of that view.
    lists_ready: bool,
    /// How often culling is to be done before the lists of visible objects stay as they are.
    cullings_due: u32,
    targets: Option<Targets>,
    /// What blended objects refract, while any does.
    behind: Option<Behind>,
    /// Stands in for it.
    nothing_behind: Behind,
    /// The world whose meshes, textures and tables are uploaded.
    world: u64,
    /// Slots of blended objects as they were last uploaded, farthest first.
    blended_slots: Vec<u32>,
    blended: GrowingBuffer,
    /// Version of the blended objects, and view, that the order is for.
    blended_for: Option<(u64, View)>,
    blended_runs: Vec<BlendedRun>,
    /// What blended objects are drawn with, also those out of view.
    blended_keys: Vec<BatchKey>,
    technique: Option<Technique>,
    pass: Pass,
    tone_map: ToneMap,
    /// A sky of one colour, exposed, is a clear, which costs nothing: a gradient takes a software rasteriser longer
    /// than a thousand objects.
    plain_sky: Option<Vec3>,
    /// What the targets are prepared for: view, pass, technique, batches. `None`: nothing yet.
    shown: Option<(ViewRecord, Pass, Option<Technique>, u64)>,
    /// Something was prepared since then that the picture may differ by.
    undrawn: bool,
    stats: RenderStats,
    counts: DrawnCounts,
    /// Where they are asked for and the device has them.
    timestamps: Option<Timestamps>,
    portions: Portions,
}

impl Renderer {
    /// A renderer for a device.
    pub fn new(gpu: &Gpu) -> Self {
        let device = &gpu.device;
        let textures = Textures::new(device);
        let pipelines = Pipelines::new(device, &textures.layout);
        let culling = Culling::new(gpu, &pipelines.frame_layout);
        Self::of_no_world(gpu, textures, pipelines, culling, PyramidMaker::new(device))
    }

    /// A renderer that has uploaded nothing yet, with the pipelines that there are.
    fn of_no_world(
        gpu: &Gpu,
        textures: Textures,
        pipelines: Pipelines,
        culling: Culling,
        pyramids: PyramidMaker,
    ) -> Self {
        let device = &gpu.device;
        Self {
            culling,
            pyramids,
            textures,
            meshes: Meshes::new(device),
            tables: FrameTables::new(device),
            draws: Draws::new(device),
            culled: CulledView::new(device),
            culled_for: None,
            cullings_due: 0,
            lists_ready: false,
            targets: None,
            behind: None,
            nothing_behind: Behind::new(device, &pipelines.behind_layout, (1, 1)),
            world: 0,
            blended_slots: Vec::new(),
            blended: GrowingBuffer::new(device, "list of blended objects", wgpu::BufferUsages::VERTEX),
            blended_runs: Vec::new(),
            blended_keys: Vec::new(),
            blended_for: None,
            technique: None,
            pass: Pass::Outputs,
            tone_map: ToneMap::default(),
            plain_sky: None,
            shown: None,
            undrawn: false,
            stats: RenderStats::default(),
            counts: DrawnCounts::default(),
            timestamps: None,
            portions: Portions::new(gpu),
            pipelines,
            gpu: gpu.clone(),
        }
    }

    /// The device it draws with.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Has passes over more triangles than these cut into several, which a driver on the processor finishes one after
    /// another: it holds some hundred bytes of each triangle meanwhile. Within a pass, if it can note the time there,
    /// it is handed an eighth of them at a time, and fills their pixels while it works on the next. `None`: passes stay
    /// whole. The picture is the same. From the beginning: 65,536 on drivers on the processor, none elsewhere. It is a
    /// wish: what is in view is known from frames before, a batch is cut into parts of no less than 64 objects each,
    /// which become larger towards its far end, and
    /// [`Self::draw_outputs`] and the passes of [`Technique::EmbossMultipass`] stay whole.
    pub fn cut_passes(&mut self, triangles: Option<std::num::NonZeroU32>) {
        self.portions.of_pass = triangles.map(std::num::NonZeroU32::get);
    }

    /// What the last prepare and draw did.
    pub fn stats(&self) -> RenderStats {
        self.stats
    }

    /// Whether what was prepared last keeps colours linear until the tone map: [`Settings::hdr`] asks for it, or the
    /// scene needs it.
    pub fn keeps_linear(&self) -> bool {
        self.pass.tone_map().is_none()
    }

    /// Has the GPU note when it works on each pass, for [`Self::pass_times`]. Nothing on a device without
    /// [`wgpu::Features::TIMESTAMP_QUERY`].
    pub fn time_passes(&mut self) {
        self.timestamps = Timestamps::new(&self.gpu);
    }

    /// How long the GPU took over each pass of the oldest frame not asked for yet, in order; `None` while it has not
    /// arrived, and if passes are not timed ([`Self::time_passes`]).
    pub fn pass_times(&mut self) -> Option<Vec<PassTime>> {
        self.timestamps.as_mut()?.take()
    }

    /// Uploads what changed in the draw list and makes what is missing, so that [`Self::draw`] only records. Returns
    /// whether the picture can differ from the one last drawn; if not, [`Self::show_again`] gives it for less. The
    /// world is to be as [`Simulation::frame`] left it: what is edited in between may be seen in part. It stays as it
    /// is but for texels that its library does not keep ([`systems::library::Library::keep_texels`]).
    ///
    /// # Errors
    /// [`RenderError`].
    pub fn prepare(
        &mut self,
        simulation: &mut Simulation,
        view: &View,
        settings: &Settings,
    ) -> Result<bool, RenderError> {
        let list = simulation.draw_list();
        if self.world != 0 && list.world != self.world {
            // What is on the device belongs to another world; how it is drawn does not.
            let textures = Textures::with_layout(self.textures.layout.clone());
            let (pipelines, culling, pyramids) = (self.pipelines.clone(), self.culling.clone(), self.pyramids.clone());
            let (portions, timestamps) = (self.portions.clone(), self.timestamps.take());
            *self =
                Self { portions, timestamps, ..Self::of_no_world(&self.gpu, textures, pipelines, culling, pyramids) };
        }
        self.world = list.world;
        let limit = self.gpu.device.limits().max_texture_dimension_2d;
        let longest = view.width.max(view.height);
        if longest > limit {
            let (needed, limit) = (longest.into(), limit.into());
            return Err(RenderError::TooLarge { what: "the picture", unit: "pixels along a side", needed, limit });
        }
        self.stats = RenderStats::default();
        self.counts.receive();
        self.tone_map = if settings.debug == DebugView::Off { list.environment.tone_map } else { ToneMap::Clamp };
        let pass = |tone_map| Pass::Color {
            all_lights: list.all_lights,
            lights: list.light_traits,
            debug: settings.debug,
            samples: settings.samples,
            tone_map,
        };
        self.technique = settings.technique;
        self.pass = pass(None);
        if !self.needs_linear(list, settings) {
            self.pass = pass(Some(self.tone_map));
        }
        // What there is no memory for fails again where it is used.
        let invalid = self.gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let no_memory = self.gpu.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let recull = self.prepare_objects(simulation, view, settings);
        let errors = [no_memory.pop(), invalid.pop()].map(pollster::block_on);
        let refused =
            errors.into_iter().flatten().next().map(|error| RenderError::Refused { reason: error.to_string() });
        // A device that is lost refuses everything.
        let recull = self.gpu.check().and(refused.map_or(recull, Err)).inspect_err(|_| {
            // Some of it was uploaded.
            (self.culled_for, self.undrawn) = (None, true);
            let wanted = (settings.samples, self.keeps_linear());
            if self.targets.as_ref().is_some_and(|targets| (targets.samples, targets.hdr.is_some()) != wanted) {
                self.drop_targets();
            }
        })?;
        let list = simulation.draw_list();
        let record = view.record(&list.environment, settings.picked_entity);
        self.tables.write_view(&self.gpu.queue, &record);
        // A material that lets more through hides less.
        let surfaces_changed = self.stats.instance_bytes + self.stats.material_bytes + self.stats.asset_bytes > 0;
        if recull || surfaces_changed || self.culled_for != Some((record, settings.technique)) {
            // Twice more in two phases: the first time little may be known to be seen, and so hide anything; the second
            // time all that is in sight hides what is behind it, which the third time's early phase leaves out.
            self.cullings_due = if self.culled.pyramid().is_some() { 3 } else { 1 };
            self.lists_ready = false;
            self.culled_for = Some((record, settings.technique));
        }

        let size = (view.width, view.height);
        if !self.refracts() {
            self.behind = None;
        } else if self.behind.as_ref().is_none_or(|behind| behind.size() != size) {
            self.behind = Some(Behind::new(&self.gpu.device, &self.pipelines.behind_layout, size));
        }
        self.plain_sky = plain_sky(&list.environment);
        if self.plain_sky.is_none() {
            self.pipelines.make_sky(&self.gpu.device, settings.samples, self.pass.tone_map());
        }
        let showing = Some((record, self.pass, settings.technique, list.batches_version));
        self.undrawn |= recull || self.shown != showing || self.stats.uploaded_bytes() > 0;
        self.shown = showing;
        Ok(self.undrawn)
    }

    /// Uploads the scene, makes the pipelines and targets that are missing, and gets ready to cull for a view. Returns
    /// whether lists of visible objects that were made before are no longer right.
    fn prepare_objects(
        &mut self,
        simulation: &mut Simulation,
        view: &View,
        settings: &Settings,
    ) -> Result<bool, RenderError> {
        let list = simulation.draw_list();
        self.upload_blended(list, view)?;
        // Compiled while the rest is uploaded.
        let missing = self.start_pipelines(self.pass, list.batches.iter().map(|batch| batch.key));
        let uploaded = self.upload(simulation);
        self.pipelines.finish_objects(missing);
        uploaded?;
        let list = simulation.draw_list();
        let redrawn =
            self.draws.update(&self.gpu, list, &self.meshes, settings.levels.enabled, self.portions.of_portion())?;
        self.stats.list_bytes += redrawn.unwrap_or(0);
        let occlusion = settings.occlusion.is_on(list.objects);
        // What stands out before its bounds may be seen where they are hidden.
        let stands_out = |draw: &draws::Draw| {
            let key = draw.key.pipeline;
            key.raised && settings.technique.unwrap_or(key.technique).writes_depth()
        };
        let occlusion = occlusion && !self.draws.list.iter().any(stands_out);
        self.make_targets(view, settings.samples, occlusion)?;
        self.culled.prepare(&self.gpu, &self.culling, &self.draws, view, settings, redrawn.is_some())
    }

    /// Meshes, maps and tables.
    fn upload(&mut self, simulation: &mut Simulation) -> Result<(), RenderError> {
        self.stats.asset_bytes = self.meshes.upload(&self.gpu, simulation.library())?;
        self.stats.asset_bytes += self.textures.upload(&self.gpu, simulation)?;
        self.tables.upload(&self.gpu, &self.pipelines.frame_layout, simulation, &mut self.stats)
    }

    /// Targets of the view's size, with a depth pyramid if objects are drawn in two phases.
    fn make_targets(&mut self, view: &View, samples: u32, occlusion: bool) -> Result<(), RenderError> {
        let hdr = self.keeps_linear();
        let wanted = (view.width, view.height, samples, hdr);
        let fits =
            |targets: &Targets| (targets.width, targets.height, targets.samples, targets.hdr.is_some()) == wanted;
        if !self.targets.as_ref().is_some_and(fits) {
            // The old ones first: there may not be room for both.
            self.drop_targets();
            let device = &self.gpu.device;
            // What there is no memory for fails again where it is used.
            let invalid = device.push_error_scope(wgpu::ErrorFilter::Validation);
            let no_memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
            let layout = hdr.then_some(&self.pipelines.tone_map_layout);
            let targets = Targets::new(device, layout, (view.width, view.height), samples);
            let errors = [no_memory.pop(), invalid.pop()].map(pollster::block_on);
            if let Some(error) = errors.into_iter().flatten().next() {
                let (size, reason) = ([view.width, view.height], error.to_string());
                return Err(RenderError::NoMemory { size, samples, reason });
            }
            self.targets = Some(targets);
        }
        if let Some(targets) = self.targets.as_ref().filter(|_| occlusion != self.culled.pyramid().is_some()) {
            self.culled.set_pyramid(occlusion.then(|| Pyramid::new(&self.gpu.device, &self.pyramids, targets)));
        }
        Ok(())
    }

    /// Nothing is drawn until there are others.
    fn drop_targets(&mut self) {
        self.targets = None;
        self.culled.set_pyramid(None);
        self.shown = None;
    }

    /// Whether colours have to stay linear until a pass of its own tone-maps them.
    fn needs_linear(&self, list: &DrawList, settings: &Settings) -> bool {
        let adds_up = |batch: &Batch| self.pipeline_of(self.pass, batch.key).technique == Technique::EmbossMultipass;
        settings.hdr || settings.samples > 1 || !list.transparent.is_empty() || list.batches.iter().any(adds_up)
    }

    /// Blended objects of this view in its order.
    fn upload_blended(&mut self, list: &DrawList, view: &View) -> Result<(), RenderError> {
        if matches!(&self.blended_for, Some((version, of)) if *version == list.transparent_version && of == view) {
            return Ok(());
        }
        if self.blended_for.as_ref().is_none_or(|(version, _)| *version != list.transparent_version) {
            self.blended_keys = list.transparent.iter().map(|object| object.key).collect();
            self.blended_keys.dedup();
            self.blended_keys.sort_unstable();
            self.blended_keys.dedup();
        }
        let (slots, runs) = sort_transparent(&list.transparent, view);
        self.blended_runs = runs;
        if slots != self.blended_slots {
            self.stats.list_bytes += self.blended.write(&self.gpu, &slots, &DirtySlots::default(), true)?;
            self.blended_slots = slots;
        }
        self.blended_for = Some((list.transparent_version, view.clone()));
        Ok(())
    }

    /// The pipeline that objects with that key are drawn with in a pass.
    fn pipeline_of(&self, pass: Pass, key: BatchKey) -> PipelineKey {
        let technique = self.technique.unwrap_or(key.pipeline.technique);
        let PipelineKey { alpha, shading, .. } = key.pipeline;
        PipelineKey { technique: pass.technique(technique, alpha, shading), ..key.pipeline }
    }

    /// Begins to make the pipelines that a pass over these opaque objects and the blended ones needs.
    fn start_pipelines(&self, pass: Pass, opaque: impl Iterator<Item = BatchKey>) -> Option<MissingPipelines> {
        let mut keys: Vec<_> =
            opaque.chain(self.blended_keys.iter().copied()).map(|key| self.pipeline_of(pass, key)).collect();
        keys.dedup();
        let emboss = |technique| (technique == Technique::EmbossMultipass).then(|| self.emboss_passes());
        let passes = |key: PipelineKey| std::iter::once(pass).chain(emboss(key.technique).into_iter().flatten());
        let kinds = keys.into_iter().flat_map(|key| passes(key).map(move |pass| (pass, key)));
        self.pipelines.start_objects(&self.gpu.device, kinds)
    }

    /// The passes that add the light of [`Technique::EmbossMultipass`], if the colour pass leaves it to them.
    fn emboss_passes(&self) -> impl Iterator<Item = Pass> + use<> {
        let (lights, samples) = match self.pass {
            Pass::Color { lights, samples, .. } | Pass::Emboss { lights, samples, .. } => (lights, samples),
            Pass::Outputs => (LightTraits::default(), 1),
        };
        EmbossPass::all().map(move |pass| Pass::Emboss { pass, lights, samples })
    }

    /// Whether a blended object, in view or not, shows what lies behind it elsewhere than it is.
    fn refracts(&self) -> bool {
        let shown = matches!(self.pass, Pass::Color { debug: DebugView::Off, .. });
        let technique = |key: &BatchKey| self.pipeline_of(self.pass, *key).technique;
        shown && self.blended_keys.iter().any(|key| technique(key) == Technique::PerturbedUv)
    }

    /// Draws what was prepared into `target`, a view of a texture of that format and the prepared view's size. An
    /// sRGB format encodes; others receive linear values. Unless colours are [kept linear](Self::keeps_linear), the
    /// format must be [`PICTURE_FORMAT`].
    ///
    /// # Panics
    /// If it is not.
    pub fn draw(&mut self, target: &wgpu::TextureView, format: wgpu::TextureFormat) {
        let commands = self.record(target, format);
        self.gpu.queue.submit([commands]);
    }

    /// [`Self::draw`] without handing the commands in, to measure the two apart.
    pub fn record(&mut self, target: &wgpu::TextureView, format: wgpu::TextureFormat) -> wgpu::CommandBuffer {
        let label = wgpu::CommandEncoderDescriptor { label: Some("frame") };
        let mut encoder = self.gpu.device.create_command_encoder(&label);
        self.check_format(format);
        let recorded = self.record_scene(&mut encoder, target);
        (self.stats.draws, self.stats.draw_calls, self.stats.passes) =
            (recorded.draws, recorded.calls, recorded.passes);
        self.record_tone_map(&mut encoder, target, format);
        self.undrawn = false;
        if let Some(timestamps) = &mut self.timestamps {
            timestamps.finish(&mut encoder);
        }
        encoder.finish()
    }

    /// What was drawn last, once more: only the tone map, if colours were kept linear. For a window whose panel changes
    /// above a still scene, after a [`Self::prepare`] that found nothing new.
    ///
    /// # Panics
    /// As [`Self::draw`].
    pub fn show_again(&mut self, target: &wgpu::TextureView, format: wgpu::TextureFormat) {
        let label = wgpu::CommandEncoderDescriptor { label: Some("frame again") };
        let mut encoder = self.gpu.device.create_command_encoder(&label);
        if !self.keeps_linear() {
            self.check_format(format);
            self.record_scene(&mut encoder, target);
        }
        self.record_tone_map(&mut encoder, target, format);
        if let Some(timestamps) = &mut self.timestamps {
            timestamps.finish(&mut encoder);
        }
        self.gpu.queue.submit([encoder.finish()]);
    }

    /// Panics if objects are drawn into a target of that format with pipelines for another.
    fn check_format(&self, format: wgpu::TextureFormat) {
        assert!(
            self.keeps_linear() || format == PICTURE_FORMAT,
            "without Settings::hdr, expected a target of {PICTURE_FORMAT:?}, found {format:?}"
        );
    }

    /// The phases that objects are drawn in.
    fn phases(&self) -> impl Iterator<Item = Phase> + use<> {
        [Phase::Early, Phase::Late].into_iter().take(if self.culled.pyramid().is_some() { 2 } else { 1 })
    }

    /// How much a recent draw drew, as far as the GPU has told; waits for nothing.
    pub fn drawn(&self) -> Option<Drawn> {
        self.counts.latest
    }

    /// How much the last draw drew. Waits for the GPU.
    pub fn read_drawn(&self) -> Drawn {
        let mut drawn = self.blended_drawn();
        let bytes = self.draws.arguments.len() as u64 * ARGUMENT_BYTES;
        for phase in self.phases().filter(|_| bytes > 0) {
            drawn.add_arguments(&read_buffer(&self.gpu, self.culled.arguments(phase), bytes));
        }
        drawn
    }

    /// Instance slots of the opaque objects that the last draw drew: those of each phase in the order in which it drew
    /// them. Waits for the GPU.
    pub fn read_drawn_slots(&self) -> Vec<u32> {
        let words = |buffer: &wgpu::Buffer| {
            let bytes = read_buffer(&self.gpu, buffer, buffer.size());
            bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect::<Vec<_>>()
        };
        let first_instance = self.gpu.device.features().contains(wgpu::Features::INDIRECT_FIRST_INSTANCE);
        let visible = words(self.culled.visible());
        let mut slots = Vec::new();
        for phase in self.phases() {
            let arguments = words(self.culled.arguments(phase));
            let drawn = arguments.chunks_exact(ARGUMENT_BYTES as usize / 4);
            for (draw, arguments) in self.draws.arguments.iter().zip(drawn) {
                // Where indirect draws all begin at the first instance, it is the lists that lie apart.
                let apart = draw.first_visible + self.culled.list_offset(phase);
                let first = if first_instance { arguments[4] } else { apart } as usize;
                let count = arguments[1] as usize;
                slots.extend(visible.iter().skip(first).take(count));
            }
        }
        slots
    }

    fn blended_drawn(&self) -> Drawn {
        let mut drawn = Drawn::default();
        for run in &self.blended_runs {
            let whole = self.meshes.range(run.key.mesh).and_then(|mesh| mesh.levels.first());
            drawn.add(run.slots.len() as u32, whole.map_or(0, |level| level.index_count));
        }
        drawn
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

    /// The linear HDR colours of the last draw, exposed, before the tone map: RGBA, rows from the top. `None` if
    /// nothing was prepared, or if colours were not [kept linear](Self::keeps_linear).
    pub fn read_linear(&self) -> Option<Vec<[f32; 4]>> {
        let texture = &self.targets.as_ref()?.hdr.as_ref()?.texture;
        let bytes = read_texture(&self.gpu, texture, wgpu::TextureAspect::All);
        let half = |b: &[u8]| half::f16::from_le_bytes([b[0], b[1]]).to_f32();
        Some(bytes.chunks_exact(8).map(|t| [half(&t[0..]), half(&t[2..]), half(&t[4..]), half(&t[6..])]).collect())
    }
}

/// The colour of a sky that has only one, exposed as `sky_pass.wgsl` does.
fn plain_sky(environment: &Environment) -> Option<Vec3> {
    let Environment { zenith, horizon, ground, exposure, .. } = environment;
    (zenith == horizon && horizon == ground).then(|| (*horizon * *exposure).min(Vec3::splat(65504.0)))
}
