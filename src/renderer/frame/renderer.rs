//! The renderer: a device, and a scene as it is uploaded, which all views share.

use super::worlds::{Assets, RestingWorlds, WorldUploads};
use crate::renderer::culling::cpu_culling::CpuCulling;
use crate::renderer::culling::cull::Culling;
use crate::renderer::culling::indirect_draws::IndirectDraws;
use crate::renderer::culling::pyramid::PyramidMaker;
use crate::renderer::culling::slot_set::SlotSet;
use crate::renderer::gpu::cpu_rasterizer::CpuRasterizer;
use crate::renderer::gpu::device::Gpu;
use crate::renderer::gpu::error::RenderError;
use crate::renderer::gpu::timestamps::{PassTime, Timestamps};
use crate::renderer::passes::pack::Packer;
use crate::renderer::passes::pass::Shadows;
use crate::renderer::passes::pipelines::{MissingPipelines, Pipelines};
use crate::renderer::passes::targets::SceneColorCopy;
use crate::renderer::plan::settings::DebugView;
use crate::renderer::plan::view_plan::ViewPlan;
use crate::renderer::resources::sky::SkyTextures;
use crate::renderer::resources::stats::{HeldBytes, RenderStats};
use crate::renderer::resources::textures::Textures;
use crate::renderer::shadows::shadow_maps::ShadowMaps;
use crate::renderer::shadows::traced::TracedShadows;
use crate::renderer::views::view_state::ViewState;
use systems::assets::Technique;
use systems::draw::{BatchKey, DrawList, FrameData};

/// A device, and a scene as it is uploaded to it: what all views share.
#[derive(Debug)]
pub struct Renderer {
    pub(super) gpu: Gpu,
    pub(super) pipelines: Pipelines,
    pub(super) assets: Assets,
    /// Device data of the current world.
    pub(super) own: WorldUploads,
    /// Device data of other worlds, if it is kept.
    resting: Option<RestingWorlds>,
    pub(super) culling: Culling,
    pub(super) pyramids: PyramidMaker,
    /// Stands in for the picture behind blended objects where none refracts it.
    pub(super) no_scene_color: SceneColorCopy,
    /// The world whose meshes, textures and tables are uploaded.
    world: u64,
    /// Number of the last preparation: only views prepared in it may be encoded.
    prepared: u64,
    pub(super) stats: RenderStats,
    /// Enabled by [`Self::time_passes`], on devices that have timestamp queries.
    pub(super) timestamps: Option<Timestamps>,
    pub(super) cpu_rasterizer: CpuRasterizer,
    /// Made when views are first packed.
    pub(super) packer: Option<Packer>,
    skies: SkyTextures,
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
            assets: Assets::new(gpu, textures),
            own: WorldUploads::new(gpu),
            resting: None,
            no_scene_color: SceneColorCopy::new(device, &pipelines.scene_color_layout, (1, 1)),
            world: 0,
            prepared: 0,
            stats: RenderStats::default(),
            timestamps: None,
            cpu_rasterizer: CpuRasterizer::new(&gpu.adapter),
            packer: None,
            skies: SkyTextures::default(),
            pipelines,
            gpu: gpu.clone(),
        }
    }

    /// The device it draws with.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Device memory of the scene's meshes, textures and shadow maps.
    pub fn held_bytes(&self) -> HeldBytes {
        HeldBytes {
            meshes: self.assets.meshes.bytes(),
            textures: self.assets.textures.bytes(),
            shadow_maps: self.own.shadow_maps.bytes(),
        }
    }

    /// Statistics of the last prepare and encode, all views together.
    pub fn stats(&self) -> RenderStats {
        self.stats
    }

    /// Has the GPU note when it works on each pass, for [`Self::pass_times`]. Nothing on a device without
    /// [`wgpu::Features::TIMESTAMP_QUERY`].
    pub fn time_passes(&mut self) {
        self.timestamps = Timestamps::new(&self.gpu);
    }

    /// GPU time of each pass of the oldest frame not asked for yet, in order. `None` while it has not arrived, and if
    /// passes are not timed ([`Self::time_passes`]).
    pub fn pass_times(&mut self) -> Option<Vec<PassTime>> {
        self.timestamps.as_mut()?.take()
    }

    /// Uploads what changed in a frame's data, once for all views, and makes what views lack, so that [`Self::encode`]
    /// only encodes. Afterwards [`ViewState::needs_redraw`] says whether a view's picture can differ from the one last
    /// drawn; if not, [`Self::encode_again`] gives it for less. A world lends its frame by
    /// [`Simulation::with_frame`](systems::Simulation::with_frame), and is to be as its frame's systems left it: what
    /// is edited in between may be seen in part. Data of other programs are a frame, too ([`FrameData`]). Texels that
    /// the library does not keep ([`systems::assets::Library::keep_texels`]) are released.
    ///
    /// Those views can be encoded until the next `prepare`. Others rest, with what they saw last: what lists are made
    /// of may change meanwhile.
    ///
    /// # Errors
    /// [`RenderError`]. No view can be encoded then until another `prepare` goes well, but where a picture is too
    /// large: nothing changes for that.
    pub fn prepare(
        &mut self,
        frame: &mut FrameData<'_>,
        views: &mut [(&mut ViewState, ViewPlan)],
    ) -> Result<(), RenderError> {
        let limit = self.gpu.device.limits().max_texture_dimension_2d;
        let longest = views.iter().map(|(_, plan)| plan.view.width.max(plan.view.height)).max().unwrap_or(0);
        if longest > limit {
            let (needed, limit) = (longest.into(), limit.into());
            return Err(RenderError::TooLarge { what: "the picture", unit: "pixels along a side", needed, limit });
        }
        self.enter(frame);
        let list = frame.list;
        self.stats = RenderStats::default();
        for (state, plan) in &mut *views {
            state.begin(&self.gpu, self.own.epoch);
            state.choose_pass(list, &plan.settings);
        }
        self.prepared += 1;
        // What there is no memory for fails again where it is used.
        let invalid = self.gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let no_memory = self.gpu.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let prepared = self.prepare_scene(frame, views);
        let errors = [no_memory.pop(), invalid.pop()].map(pollster::block_on);
        let refused =
            errors.into_iter().flatten().next().map(|error| RenderError::Refused { reason: error.to_string() });
        // A device that is lost refuses everything.
        let prepared = self.gpu.check().and(refused.map_or(prepared, Err));
        // What is given up is no upload, and may be missing in a picture.
        let versions = (self.assets.meshes.version(), self.assets.textures.version());
        let assets_changed = std::mem::replace(&mut self.own.asset_versions, versions) != versions;
        self.own.uploads.any += u64::from(assets_changed || self.stats.scene_bytes() > 0);
        self.own.uploads.surfaces += u64::from(assets_changed || self.stats.surface_bytes() > 0);
        if let Err(error) = prepared {
            views.iter_mut().for_each(|(state, plan)| state.forget(&plan.settings));
            // There may have been no memory for them.
            self.own.shadow_maps = ShadowMaps::default();
            return Err(error);
        }
        let list = frame.list;
        for (index, (state, plan)) in (0..).zip(views) {
            let shadow_records = self.own.tables.shadow_records(index);
            state.finish(&self.gpu, list, plan, shadow_records, self.own.uploads, self.prepared);
            state.ensure_scene_color(
                &self.gpu.device,
                &self.pipelines.scene_color_layout,
                plan.size(),
                &self.own.blended_keys.1,
            );
            if state.needs_sky() {
                self.pipelines.make_sky(&self.gpu.device, state.pass.sky());
            }
        }
        Ok(())
    }

    /// Keeps what is uploaded of a world while others are drawn, until it is [forgotten](Self::forget_world).
    pub fn keep_worlds(&mut self) {
        self.resting.get_or_insert_default();
    }

    /// Gives up what is uploaded of a world that is not drawn any more, by [`DrawList::world`].
    pub fn forget_world(&mut self, world: u64) {
        if world == self.world {
            (self.own, self.world) = (WorldUploads::new(&self.gpu), 0);
        } else if let Some(resting) = &mut self.resting {
            resting.forget(world);
        }
    }

    /// Has a view drawn with shadows that rays found, from its next [`Self::prepare`] on; `None`: as ever. They are of
    /// a picture of the view's size, and of lists of lights as they are then. A view that another renderer or another
    /// world was drawn into before forgets them.
    ///
    /// # Errors
    /// [`RenderError::TooLarge`].
    pub fn set_traced_shadows(
        &mut self,
        view: &mut ViewState,
        shadows: Option<&TracedShadows>,
    ) -> Result<(), RenderError> {
        let (device, class_layout) = (&self.gpu.device, &self.assets.textures.layout);
        let group = shadows.map(|shadows| {
            let layout = self.pipelines.shadows_layout(device, class_layout, Shadows::Traced);
            shadows.group(&self.gpu, layout)
        });
        view.set_traced(group.transpose()?);
        Ok(())
    }

    /// Switches to the device data of a frame's world; pipelines and settings of drawing stay.
    fn enter(&mut self, frame: &FrameData<'_>) {
        let world = frame.list.world;
        if world == self.world {
            return;
        }
        if let Some(resting) = &mut self.resting {
            resting.exchange(&self.gpu, self.world, frame, &mut self.own, &mut self.assets);
        } else if self.world != 0 {
            let textures = Textures::with_layout(self.assets.textures.layout.clone());
            (self.assets, self.own) = (Assets::new(&self.gpu, textures), WorldUploads::new(&self.gpu));
        }
        self.world = world;
    }

    /// Uploads the scene, makes the pipelines and targets that are missing, and gets ready to cull for each view.
    fn prepare_scene(
        &mut self,
        frame: &mut FrameData<'_>,
        views: &mut [(&mut ViewState, ViewPlan)],
    ) -> Result<(), RenderError> {
        let list = frame.list;
        self.note_blended(list);
        for (state, plan) in &mut *views {
            state.rank_shadows(frame, plan);
            self.stats.list_bytes += state.upload_blended(&self.gpu, list, &plan.view)?;
        }
        self.choose_shadows(frame, views);
        // Compiled while the rest is uploaded.
        let states = views.iter().map(|(state, _)| &**state);
        let missing = self.start_pipelines(states, list.batches.iter().map(|batch| batch.key));
        let uploaded = self.upload(frame, views);
        self.pipelines.finish_objects(missing);
        uploaded?;
        let list = frame.list;
        let cells = frame.cells.filter(|cells| !cells.is_empty());
        if cells.is_some() {
            self.culling.make_for_cells(&self.gpu.device);
        }
        let few = self.cpu_culling(frame, views);
        for (state, plan) in views {
            let levels = plan.settings.levels.enabled;
            let draws = &mut self.own.draws[usize::from(levels)];
            self.stats.list_bytes += draws.update(&self.gpu, list, &self.assets.meshes, levels)?;
            let draws = &self.own.draws[usize::from(levels)];
            state.make_targets(&self.gpu, &self.pipelines, &self.pyramids, plan, draws, list.objects)?;
            state.ensure_outputs(&self.gpu.device, plan.size());
            let shown = cells.filter(|_| plan.settings.debug == DebugView::Cells && plan.settings.outputs.is_shaded());
            let shown = shown.map(|cells| (cells, frame.open_portals));
            state.ensure_cells(&self.gpu, &self.pipelines.frame_layout, shown);
            state.prepare_lists(&self.gpu, &self.culling, draws, plan, cells, few.as_ref())?;
            state.bind(&self.gpu.device, &self.pipelines.frame_layout, &self.own.tables);
        }
        Ok(())
    }

    /// Objects to cull on the CPU: those that views show alone. Else all, if they are few and the world has no cells.
    fn cpu_culling(&self, frame: &FrameData<'_>, views: &[(&mut ViewState, ViewPlan)]) -> Option<CpuCulling> {
        let shown_alone: Vec<&SlotSet> = views.iter().filter_map(|(state, _)| state.only.as_deref()).collect();
        if !shown_alone.is_empty() {
            let is_among = |slot| shown_alone.iter().any(|only| only.has(slot));
            return Some(CpuCulling::among(frame, &self.assets.meshes, is_among));
        }
        let has_cells = frame.cells.is_some_and(|cells| !cells.is_empty());
        let counts_few = !has_cells && views.iter().any(|(_, plan)| plan.settings.few_on_cpu);
        counts_few.then(|| CpuCulling::of(frame, &self.assets.meshes)).flatten()
    }

    /// Meshes, maps and tables.
    fn upload(&mut self, frame: &mut FrameData<'_>, views: &[(&mut ViewState, ViewPlan)]) -> Result<(), RenderError> {
        self.assets.begin(frame);
        self.stats.asset_bytes = self.assets.meshes.upload(&self.gpu, frame.library)?;
        self.stats.asset_bytes += self.assets.textures.upload(&self.gpu, frame.list, frame.library)?;
        let records: Vec<_> = views.iter().map(|(state, plan)| self.shadow_records(state, plan, frame)).collect();
        self.assets.note(frame);
        self.own.tables.upload(
            &self.gpu,
            frame,
            &self.own.shadow_maps.by_slot,
            &records,
            &mut self.skies,
            &mut self.stats,
        )?;
        let textures = self.assets.textures.version();
        let shadowed: Vec<_> = views.iter().filter_map(|(state, plan)| state.shadowed(plan)).collect();
        // Views that shade nothing are no reason to draw what those before them left out.
        if !shadowed.is_empty() {
            let maps = &mut self.own.shadow_maps;
            self.stats.list_bytes += maps.find_due(&self.gpu, frame, &shadowed, &self.assets.meshes, textures)?;
        }
        Ok(())
    }

    /// Gives layers to the lights that have a shadow map in some view.
    fn choose_shadows(&mut self, frame: &FrameData<'_>, views: &[(&mut ViewState, ViewPlan)]) {
        let shadowed: Vec<_> = views.iter().filter_map(|(state, plan)| state.shadowed(plan)).collect();
        if shadowed.is_empty() {
            // Views that shade nothing do not tell whether others read them.
            if views.iter().any(|(_, plan)| plan.settings.outputs.is_shaded()) {
                self.own.shadow_maps = ShadowMaps::default();
            }
            return;
        }
        let (device, class_layout) = (&self.gpu.device, &self.assets.textures.layout);
        let layout = self.pipelines.shadows_layout(device, class_layout, Shadows::Maps).clone();
        let layouts = [&layout, &self.pipelines.frame_layout, class_layout];
        self.own.shadow_maps.choose(&self.gpu, layouts, frame, &shadowed);
    }

    /// The records of the layers that a view reads.
    fn shadow_records(&self, state: &ViewState, plan: &ViewPlan, frame: &FrameData<'_>) -> Vec<[u32; 4]> {
        let shadowed = state.shadowed(plan).zip(frame.shadows);
        shadowed.map_or_else(Vec::new, |(view, scene)| self.own.shadow_maps.records(&view, &scene, frame.list))
    }

    /// Tells if a view was part of the last preparation.
    pub(super) fn is_prepared(&self, view: &ViewState) -> bool {
        view.is_of(self.own.epoch, self.prepared)
    }

    /// The draws that a view draws.
    pub(super) fn draws_of(&self, view: &ViewState) -> &IndirectDraws {
        &self.own.draws[usize::from(view.levels)]
    }

    /// Finds what blended objects are drawn with, if they changed.
    fn note_blended(&mut self, list: &DrawList) {
        let (version, keys) = &mut self.own.blended_keys;
        if *version != Some(list.transparent_version) {
            *version = Some(list.transparent_version);
            *keys = list.transparent.iter().map(|object| object.key).collect();
            keys.dedup();
            keys.sort_unstable();
            keys.dedup();
        }
    }

    /// Batch keys of the opaque objects that a view draws.
    pub(super) fn opaque_keys(&self, view: &ViewState) -> impl Iterator<Item = BatchKey> + Clone {
        self.draws_of(view).list.iter().map(|draw| draw.key)
    }

    /// Begins to make the pipelines that views need for these opaque objects and the blended ones.
    pub(super) fn start_pipelines<'a>(
        &self,
        views: impl Iterator<Item = &'a ViewState>,
        opaque: impl Iterator<Item = BatchKey> + Clone,
    ) -> Option<MissingPipelines> {
        let mut kinds = Vec::new();
        for view in views {
            for (pass, draws_opaque) in view.passes() {
                let opaque = opaque.clone().filter(|_| draws_opaque);
                let keys = opaque.chain(self.own.blended_keys.1.iter().copied());
                let mut keys: Vec<_> = keys.map(|key| view.pipeline_of(pass, key)).collect();
                keys.dedup();
                for key in keys {
                    kinds.push((pass, key));
                    if key.technique == Technique::EmbossMultipass {
                        kinds.extend(view.pass.emboss_passes().map(|pass| (pass, key)));
                    }
                }
            }
        }
        self.pipelines.start_objects(&self.gpu.device, kinds.into_iter())
    }
}
