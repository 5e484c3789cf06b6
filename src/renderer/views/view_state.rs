//! State of one view of a scene: a camera, a sensor, a picture of a test. The views of a frame share everything else
//! ([`crate::renderer::Renderer`]).
//!
//! A view keeps its targets, the lists of what it shows and what it saw last from frame to frame: one that is drawn
//! again makes nothing anew. Views of a frame may differ in size and in all settings.

use super::blended::BlendedList;
use super::layers::Layer;
use crate::renderer::culling::cpu_culling::CpuCulling;
use crate::renderer::culling::cull::{CulledView, Culling, Phase};
use crate::renderer::culling::indirect_draws::{Draw, IndirectDraws};
use crate::renderer::culling::pyramid::{Pyramid, PyramidMaker};
use crate::renderer::culling::slot_set::SlotSet;
use crate::renderer::culling::visible_counts::{CountReadback, VisibleCounts};
use crate::renderer::gpu::device::Gpu;
use crate::renderer::gpu::error::RenderError;
use crate::renderer::gpu::readback::Readback;
use crate::renderer::passes::attachments::Attachments;
use crate::renderer::passes::cell_view::CellView;
use crate::renderer::passes::output_textures::OutputTextures;
use crate::renderer::passes::pass::{Attached, Pass, Shadows};
use crate::renderer::passes::pipelines::{Pipelines, ToneMapSource};
use crate::renderer::passes::targets::{SceneColorCopy, Targets};
use crate::renderer::plan::output_set::OutputSet;
use crate::renderer::plan::settings::Settings;
use crate::renderer::plan::view_plan::ViewPlan;
use crate::renderer::resources::frame_tables::FrameTables;
use crate::renderer::resources::stats::Uploads;
use crate::renderer::shadows::layer_set::ShadowedView;
use crate::renderer::shadows::sides::side_for;
use glam::{Mat4, Vec3};
use std::sync::Arc;
use systems::assets::Technique;
use systems::cells::Cells;
use systems::draw::{DrawList, Environment, FrameData, ToneMap, View, ViewRecord};
use systems::lights::{Ranked, ShadowView, rank};

/// State of a view, kept between frames. It belongs to one [`Renderer`](crate::renderer::Renderer) and its world: with
/// another it begins anew.
#[derive(Debug)]
pub struct ViewState {
    /// Layer of targets that several views share; `None`: targets of its own.
    pub(super) layer: Option<Layer>,
    /// Slots of the objects that are drawn; `None`: all objects.
    pub(crate) only: Option<Arc<SlotSet>>,
    /// Epoch of the renderer ([`crate::renderer::Renderer`]) that it belongs to; 0: none yet.
    epoch: u64,
    /// The number of the renderer's `prepare` that went well for it last; 0: none.
    prepared: u64,
    /// The [`ViewRecord`].
    record: wgpu::Buffer,
    /// Group 0 of all passes, and the version of the tables that it was made for.
    group: Option<(u32, wgpu::BindGroup)>,
    pub(crate) culled: CulledView,
    /// The view that `culled` was made for, and the technique, which may write depths of its own.
    culled_for: Option<(ViewRecord, Option<Technique>)>,
    /// Lists that were made before are no longer right.
    recull: bool,
    /// The lists of visible objects are of that view.
    pub(crate) lists_ready: bool,
    /// Frames that still need culling before the lists of visible objects stay as they are.
    pub(crate) cullings_due: u32,
    pub(crate) targets: Option<Targets>,
    /// Copy of the scene's colours that blended objects refract; `None` while none does.
    pub(crate) scene_color: Option<SceneColorCopy>,
    pub(crate) blended: BlendedList,
    pub(super) technique: Option<Technique>,
    pub(crate) pass: Pass,
    pub(crate) tone_map: ToneMap,
    /// Objects have levels of detail.
    pub(crate) levels: bool,
    /// A sky of one colour, exposed, is a clear, which costs nothing: a gradient takes a software rasteriser longer
    /// than a thousand objects.
    pub(crate) plain_sky: Option<Vec3>,
    /// State that the targets are prepared for: view, pass, technique, batches, outputs. `None`: nothing yet.
    shown: Option<(ViewRecord, Pass, Option<Technique>, u64, OutputSet)>,
    /// Counts of the renderer's uploads when this view was last prepared.
    uploads: Uploads,
    needs_redraw: bool,
    /// The lights that have a shadow map in this view, and what that was found for.
    ranked: Vec<Ranked>,
    ranked_for: Option<(u64, u64, ShadowView, u32)>,
    /// Side of the layers that it reads.
    pub(crate) shadow_side: u32,
    /// The bind group of shadows that rays found, if the view is drawn with such.
    pub(crate) traced: Option<wgpu::BindGroup>,
    /// For the debug view of cells.
    pub(crate) cell_view: Option<CellView>,
    pub(crate) counts: CountReadback,
    /// Outputs that the settings ask for.
    pub(crate) outputs: OutputSet,
    /// Objects may be drawn in two phases, to find what hides what.
    pub(super) may_hide: bool,
    /// The depths of the scene's last pass were kept for the caller's own passes.
    pub(crate) kept_depth: bool,
    /// The picture's own pass can write what they ask for beside it.
    pub(super) together: bool,
    pub(crate) output_textures: OutputTextures,
    /// Outputs already drawn for the frame that was prepared last.
    pub(crate) drawn_outputs: OutputSet,
    pub(crate) readback: Readback,
    pub(crate) view_from_clip: Mat4,
}

impl ViewState {
    /// A view that shows nothing yet.
    pub fn new(gpu: &Gpu) -> Self {
        let device = &gpu.device;
        Self {
            layer: None,
            only: None,
            epoch: 0,
            prepared: 0,
            record: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("view"),
                size: size_of::<ViewRecord>() as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            group: None,
            culled: CulledView::new(device),
            culled_for: None,
            recull: false,
            cullings_due: 0,
            lists_ready: false,
            targets: None,
            scene_color: None,
            blended: BlendedList::new(device),
            technique: None,
            pass: Pass::Outputs(Attached::default()),
            tone_map: ToneMap::default(),
            levels: false,
            plain_sky: None,
            shown: None,
            uploads: Uploads::default(),
            needs_redraw: false,
            ranked: Vec::new(),
            ranked_for: None,
            shadow_side: 0,
            traced: None,
            cell_view: None,
            counts: CountReadback::default(),
            outputs: OutputSet::COLOR,
            may_hide: false,
            kept_depth: false,
            together: false,
            output_textures: OutputTextures::default(),
            drawn_outputs: OutputSet::NONE,
            readback: Readback::default(),
            view_from_clip: Mat4::IDENTITY,
        }
    }

    /// Pixels of the picture; `None` while nothing is prepared.
    pub fn size(&self) -> Option<(u32, u32)> {
        self.targets.as_ref().filter(|_| self.prepared > 0).map(|targets| (targets.width, targets.height))
    }

    /// Tells if a preparation of that number, in that epoch, included it.
    pub(crate) fn is_of(&self, epoch: u64, prepared: u64) -> bool {
        (self.epoch, self.prepared) == (epoch, prepared)
    }

    /// Tells if the prepared picture can differ from the one last drawn.
    pub fn needs_redraw(&self) -> bool {
        self.needs_redraw
    }

    /// Counts of objects and triangles drawn in a recent frame, as last read back from the GPU. It waits for nothing.
    pub fn visible_counts(&self) -> Option<VisibleCounts> {
        self.counts.latest
    }

    /// The linear HDR colours of the last frame, exposed, before the tone map: RGBA, rows from the top. `None` if
    /// nothing was prepared. Of several samples per pixel, their mean in linear light: of what arrives, where the
    /// picture has the mean of what is shown. Waits for the GPU.
    pub fn read_linear(&self, gpu: &Gpu) -> Option<Vec<[f32; 4]>> {
        let label = wgpu::CommandEncoderDescriptor { label: Some("read linear") };
        let mut encoder = gpu.device.create_command_encoder(&label);
        let texture = self.targets.as_ref()?.hdr.resolved(&gpu.device, &mut encoder);
        let [bytes] = Readback::default().read(gpu, encoder, &[Some(texture)]);
        let half = |b: &[u8]| half::f16::from_le_bytes([b[0], b[1]]).to_f32();
        Some(bytes.chunks_exact(8).map(|t| [half(&t[0..]), half(&t[2..]), half(&t[4..]), half(&t[6..])]).collect())
    }

    /// Tells if the passes over the scene are encoded: for the picture, or for occlusion culling.
    pub(crate) fn draws_scene(&self) -> bool {
        self.outputs.is_shaded() || (self.culled.pyramid().is_some() && self.cullings_due > 0)
    }

    /// Attachments of the passes over the scene.
    pub(crate) fn attachments<'a>(&'a self, targets: &'a Targets) -> Attachments<'a> {
        targets.attachments(self.scene_color.as_ref(), self.output_textures.attached(self.pass.sky().beside))
    }

    /// Bind group 0 of every pass; `None` before the first `prepare`.
    pub(crate) fn group(&self) -> Option<&wgpu::BindGroup> {
        self.group.as_ref().map(|(_, group)| group)
    }

    /// The phases that objects are drawn in.
    pub(crate) fn phases(&self) -> impl Iterator<Item = Phase> + use<> {
        [Phase::Early, Phase::Late].into_iter().take(if self.culled.pyramid().is_some() { 2 } else { 1 })
    }

    /// First of all when a view is prepared: which renderer it belongs to.
    pub(crate) fn begin(&mut self, gpu: &Gpu, epoch: u64) {
        if self.epoch != epoch {
            *self = Self { epoch, layer: self.layer.take(), only: self.only.take(), ..Self::new(gpu) };
        }
        self.counts.receive();
    }

    /// Finds the lights that have a shadow map in this view, if it or they changed.
    pub(crate) fn rank_shadows(&mut self, frame: &FrameData<'_>, plan: &ViewPlan) {
        let lights = frame.shadows.filter(|_| self.pass.shadows() == Some(Shadows::Maps));
        let Some(lights) = lights.map(|scene| scene.lights()) else {
            (self.ranked, self.ranked_for) = (Vec::new(), None);
            return;
        };
        self.shadow_side = side_for(plan);
        let view = plan.view.shadow_view(&frame.list.environment);
        let ranked_for = Some((frame.list.world, lights.version(), view, plan.settings.shadow_maps));
        if self.ranked_for != ranked_for {
            let most = plan.settings.shadow_maps.min(Settings::MOST_SHADOW_MAPS);
            self.ranked = rank(lights, &view, most as usize);
            self.ranked_for = ranked_for;
        }
    }

    /// Request for shadow maps; `None` if its pass reads none.
    pub(crate) fn shadowed<'a>(&'a self, plan: &'a ViewPlan) -> Option<ShadowedView<'a>> {
        let has_maps = self.pass.shadows() == Some(Shadows::Maps);
        has_maps.then(|| ShadowedView { ranked: &self.ranked, plan, side: self.shadow_side })
    }

    /// Blended objects in this view's order. Returns the bytes written.
    pub(crate) fn upload_blended(&mut self, gpu: &Gpu, list: &DrawList, view: &View) -> Result<u64, RenderError> {
        let written = self.blended.upload(gpu, list, view, self.only.as_deref())?;
        self.needs_redraw |= written > 0;
        Ok(written)
    }

    /// Targets of the view's size, with a depth pyramid if so many objects are drawn in two phases.
    pub(crate) fn make_targets(
        &mut self,
        gpu: &Gpu,
        pipelines: &Pipelines,
        pyramids: &PyramidMaker,
        plan: &ViewPlan,
        draws: &IndirectDraws,
        objects: u32,
    ) -> Result<(), RenderError> {
        let (size, samples) = (plan.size(), plan.settings.samples);
        let fits = |targets: &Targets| ((targets.width, targets.height), targets.samples) == (size, samples);
        if !self.targets.as_ref().is_some_and(fits) {
            // The old ones first: there may not be room for both.
            self.drop_targets();
            let device = &gpu.device;
            // What there is no memory for fails again where it is used.
            let invalid = device.push_error_scope(wgpu::ErrorFilter::Validation);
            let no_memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
            let layer = self.layer.as_ref().filter(|_| samples == 1);
            let new = || Targets::new(device, pipelines.tone_map_layout(ToneMapSource::of(samples)), size, samples);
            let targets = layer.map_or_else(new, Layer::targets);
            let errors = [no_memory.pop(), invalid.pop()].map(pollster::block_on);
            if let Some(error) = errors.into_iter().flatten().next() {
                return Err(RenderError::NoMemory { size: size.into(), samples, reason: error.to_string() });
            }
            self.targets = Some(targets);
        }
        // What stands out before its bounds may be seen where they are hidden.
        let stands_out = |draw: &Draw| {
            let key = draw.key.pipeline;
            key.raised && self.technique.unwrap_or(key.technique).writes_depth()
        };
        let occlusion = plan.settings.occlusion.is_on(objects) && !draws.list.iter().any(stands_out);
        if let Some(targets) = self.targets.as_ref().filter(|_| occlusion != self.culled.pyramid().is_some()) {
            self.culled.set_pyramid(occlusion.then(|| Pyramid::new(&gpu.device, pyramids, targets)));
        }
        Ok(())
    }

    /// Nothing is drawn until there are others.
    fn drop_targets(&mut self) {
        self.targets = None;
        self.culled.set_pyramid(None);
        self.shown = None;
    }

    /// Draws into a layer of shared textures from the next `prepare` on.
    pub(crate) fn set_layer(&mut self, layer: Layer) {
        self.drop_targets();
        self.layer = Some(layer);
    }

    /// Makes what the debug view of cells needs; `None`: it is not shown.
    pub(crate) fn ensure_cells(
        &mut self,
        gpu: &Gpu,
        frame_layout: &wgpu::BindGroupLayout,
        cells: Option<(&Cells, &[f32])>,
    ) {
        let is_new = CellView::fit(&mut self.cell_view, gpu, frame_layout, self.targets.as_ref(), cells);
        self.needs_redraw |= is_new;
    }

    /// Gets ready to cull for a view.
    pub(crate) fn prepare_lists(
        &mut self,
        gpu: &Gpu,
        culling: &Culling,
        draws: &IndirectDraws,
        plan: &ViewPlan,
        cells: Option<&Cells>,
        few: Option<&CpuCulling>,
    ) -> Result<(), RenderError> {
        let on_cpu = self.only.is_some() || plan.settings.few_on_cpu && self.culled.pyramid().is_none();
        let only = self.only.as_deref();
        let few = few.filter(|_| on_cpu);
        self.recull = match few.map(|few| few.visible(&plan.view, &plan.settings.levels, &draws.list, only)) {
            Some(visible) => self.culled.list(gpu, visible)?,
            None => self.culled.prepare(gpu, culling, draws, plan, cells)?,
        };
        Ok(())
    }

    /// Makes the bind group of the view and the tables, if these are others.
    pub(crate) fn bind(&mut self, device: &wgpu::Device, layout: &wgpu::BindGroupLayout, tables: &FrameTables) {
        let version = tables.version();
        if self.group.as_ref().is_none_or(|(bound, _)| *bound != version) {
            self.group = Some((version, tables.bind(device, layout, &self.record)));
        }
    }

    /// Something failed: some of it was uploaded.
    pub(crate) fn forget(&mut self, settings: &Settings) {
        (self.culled_for, self.needs_redraw, self.prepared) = (None, true, 0);
        // There may have been no memory for them.
        self.output_textures = OutputTextures::default();
        if self.targets.as_ref().is_some_and(|targets| targets.samples != settings.samples) {
            self.drop_targets();
        }
    }

    /// Last of all when a view is prepared: its record, and what has to be done anew.
    pub(crate) fn finish(
        &mut self,
        gpu: &Gpu,
        list: &DrawList,
        plan: &ViewPlan,
        shadow_records: u32,
        uploads: Uploads,
        prepared: u64,
    ) {
        let record = plan.view.record(&list.environment, plan.settings.picked_entity);
        let level_error = plan.settings.levels.allowed_error(plan.view.pixels_at_1m());
        let culled_for = Some((record, plan.settings.technique));
        let shadow_side = self.shadow_side as f32;
        let record = ViewRecord { shadow_records, level_error, shadow_side, ..record };
        gpu.queue.write_buffer(&self.record, 0, bytemuck::bytes_of(&record));
        let surfaces_changed = self.uploads.surfaces != uploads.surfaces;
        if self.recull || surfaces_changed || self.culled_for != culled_for {
            // Twice more in two phases: the first time little may be known to be seen, and so hide anything; the second
            // time all that is in sight hides what is behind it, which the third time's early phase leaves out.
            self.cullings_due = if self.culled.pyramid().is_some() { 3 } else { 1 };
            self.lists_ready = false;
            self.culled_for = culled_for;
        }
        self.plain_sky = plain_sky(&list.environment).filter(|_| list.sky.is_none());
        let showing = Some((record, self.pass, plan.settings.technique, list.batches_version, self.outputs));
        self.needs_redraw |= self.recull || self.shown != showing || self.uploads != uploads;
        self.shown = showing;
        if self.needs_redraw {
            self.drawn_outputs = OutputSet::NONE;
        }
        self.view_from_clip = plan.view.clip_from_view().inverse();
        self.uploads = uploads;
        self.prepared = prepared;
    }

    /// Tells if the sky needs a draw, because it is more than a clear.
    pub(crate) fn needs_sky(&self) -> bool {
        self.plain_sky.is_none()
    }

    /// Draws with shadows that rays found from the next `prepare` on, or without any.
    pub(crate) fn set_traced(&mut self, traced: Option<wgpu::BindGroup>) {
        self.traced = traced;
        self.needs_redraw = true;
    }

    /// The picture is drawn.
    pub(crate) fn drawn_now(&mut self) {
        self.needs_redraw = false;
    }
}

/// The colour of a sky that has only one, exposed as `sky_pass.wgsl` does.
fn plain_sky(environment: &Environment) -> Option<Vec3> {
    let Environment { zenith, horizon, ground, exposure, .. } = environment;
    (zenith == horizon && horizon == ground).then(|| (*horizon * *exposure).min(Vec3::splat(65504.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::renderer::gpu::texture::{texture, whole_view};
    use crate::renderer::{Occlusion, PICTURE_FORMAT, Renderer, SingleView, ViewTarget};
    use systems::Simulation;
    use systems::assets::levels::LevelOfDetail;
    use systems::assets::{Library, Material};
    use systems::draw::Camera;
    use systems::lights::Light;
    use systems::space::{GlobalTransform, Transform};

    /// All that a view draws into and reads. Handles of other textures, buffers and groups are not equal to these.
    fn resources(state: &ViewState) -> impl PartialEq + use<> {
        let targets = state.targets.as_ref().expect("prepared");
        let hdr = (targets.hdr.texture.clone(), targets.hdr.source.clone());
        let lists: Vec<_> = state.phases().map(|phase| state.culled.arguments(phase).clone()).collect();
        let pyramid = state.culled.pyramid().map(|pyramid| pyramid.view.clone());
        let buffers = (state.record.clone(), state.culled.visible().clone(), state.blended.buffer().clone(), lists);
        (targets.depth.clone(), hdr, state.group().cloned(), pyramid, buffers)
    }

    #[test]
    fn two_views_of_different_sizes_and_settings_make_nothing_from_the_second_frame_on() {
        let gpu = match Gpu::headless() {
            Ok(gpu) => gpu,
            Err(error) => {
                assert!(std::env::var_os("RELIEF_STRICT").is_none_or(|strict| strict == "0"), "{error}");
                return eprintln!("skipped: no graphics adapter");
            }
        };
        let mut simulation = Simulation::new();
        let mut library = simulation.world.resource_mut::<Library>();
        let cube = library.add_mesh(systems::assets::shapes::cube(Vec3::ONE));
        let glass = Material { alpha: systems::assets::AlphaMode::Blend, ..Material::default() };
        let glass = library.add_material(glass);
        let objects: Vec<_> =
            (0..30).map(|i| simulation.world.spawn((cube, Transform::from_xyz(i as f32, 0.0, -9.0))).id()).collect();
        simulation.world.spawn((cube, glass, Transform::from_xyz(0.0, 0.0, -4.0)));
        simulation.world.spawn(Light::directional(1.0));
        let settings = [
            Settings { occlusion: Occlusion::On, ..Settings::default() },
            Settings { samples: 1, levels: LevelOfDetail::OFF, ..Settings::default() },
        ];
        let sizes = [(64, 36), (33, 47)];
        let mut renderer = Renderer::new(&gpu);
        let mut states = [ViewState::new(&gpu), ViewState::new(&gpu)];
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let textures = sizes.map(|size| texture(&gpu.device, "", size, PICTURE_FORMAT, 1, usage));
        let targets = textures.map(|texture| whole_view(&texture, ""));
        let mut draw = |frame: u32, states: &mut [ViewState; 2]| {
            for &object in &objects {
                simulation.world.get_mut::<Transform>(object).expect("lives").translation.y = frame as f32 * 0.1;
            }
            simulation.frame();
            let eye = GlobalTransform::from(Transform::from_xyz(frame as f32 * 0.2, 0.0, 0.0));
            let plan = |i: usize| {
                let view = View::new(&eye.affine(), &Camera::default(), sizes[i].0, sizes[i].1);
                ViewPlan { view, settings: settings[i] }
            };
            let [first, second] = states;
            simulation
                .with_frame(|frame| renderer.prepare(frame, &mut [(&mut *first, plan(0)), (&mut *second, plan(1))]))
                .expect("they fit");
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let views = [(first, &targets[0]), (second, &targets[1])];
            let mut views = views.map(|(state, target)| ViewTarget::new(state, target, PICTURE_FORMAT));
            renderer.encode(&mut encoder, &mut views);
            gpu.queue.submit([encoder.finish()]);
        };
        draw(0, &mut states);
        let first = states.each_ref().map(resources);
        for frame in 1..5 {
            draw(frame, &mut states);
            assert!(states.each_ref().map(resources) == first, "frame {frame}");
        }
        let mut single = SingleView::new(&gpu);
        let view = View::new(&GlobalTransform::default().affine(), &Camera::default(), 8, 8);
        simulation.with_frame(|frame| single.prepare(frame, &view, &settings[0])).expect("it fits");
        assert!(resources(single.state()) != first[0], "handles of other resources are others");
    }
}
