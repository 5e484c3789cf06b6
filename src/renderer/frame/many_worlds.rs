//! Views of several worlds in one submission: world after world is prepared and encoded, then all is handed in.
//!
//! Each world has device buffers of its own: no write for one changes what was encoded for another.

use super::measured::{DrawnPlans, has_levels};
use super::renderer::Renderer;
use super::view_batches::{DrawnBatches, EncodedBatch, ViewBatches};
use crate::renderer::gpu::error::RenderError;
use crate::renderer::passes::pack::Packing;
use crate::renderer::plan::view_plan::ViewPlan;
use crate::renderer::shadows::shadow_maps::views_with_room;
use crate::renderer::views::layers::ViewBatchKey;
use crate::renderer::views::outputs::Outputs;
use systems::draw::{FrameData, ToneMap};

/// Callback that reads the frame of a world.
pub type ReadFrame<'a> = dyn FnMut(&mut FrameData<'_>) -> Result<(), RenderError> + 'a;

/// Hands over the frame of a world, by its place in a list of worlds.
pub type Lend<'a> = dyn FnMut(usize, &mut ReadFrame<'_>) -> Result<(), RenderError> + 'a;

/// World and plan of a view.
type PlanOfWorld = (usize, usize);

/// Takes an encoded batch, and its views.
type Take<'a> =
    dyn FnMut(&mut Renderer, &mut ViewBatches, EncodedBatch, Vec<PlanOfWorld>) -> Result<(), RenderError> + 'a;

/// Views of several worlds as they are drawn.
#[derive(Default)]
struct WorldViews {
    /// By world.
    drawn: Vec<DrawnPlans>,
    /// By world.
    tone_maps: Vec<ToneMap>,
    /// Those that are drawn beside each other.
    open: Vec<PlanOfWorld>,
}

impl WorldViews {
    fn plan(&self, (world, plan): PlanOfWorld) -> &ViewPlan {
        &self.drawn[world].plans[plan]
    }

    fn key(&self, view: PlanOfWorld) -> (ViewBatchKey, ToneMap) {
        (ViewBatchKey::of(self.plan(view)), self.tone_maps[view.0])
    }

    /// Adds the views of the next world; those that find no room for their shadows beside each other are not open.
    /// Returns whether they are.
    fn add(&mut self, frame: &FrameData<'_>, plans: &[ViewPlan]) -> bool {
        let world = self.drawn.len();
        let drawn = DrawnPlans::new(plans, has_levels(frame));
        let have_room = views_with_room(frame, &plans.iter().collect::<Vec<_>>()) >= plans.len();
        if have_room {
            self.open.extend((0..drawn.plans.len()).map(|plan| (world, plan)));
        }
        self.tone_maps.push(frame.list.environment.tone_map);
        self.drawn.push(drawn);
        have_room
    }

    /// Encodes all open views, in batches of those that agree, and hands over each batch with its views.
    fn encode(
        &self,
        renderer: &mut Renderer,
        batches: &mut ViewBatches,
        lend: &mut Lend<'_>,
        take: &mut Take<'_>,
    ) -> Result<(), RenderError> {
        let mut open = self.open.clone();
        while let Some(&first) = open.first() {
            let key = self.key(first);
            let (alike, others): (Vec<_>, Vec<_>) = open.into_iter().partition(|&view| self.key(view) == key);
            open = others;
            for now in alike.chunks(key.0.most_views(&renderer.gpu)) {
                let batch = renderer.encode_batch(batches, key.0, now.len(), &mut |batch| {
                    for views in now.chunk_by(|a, b| a.0 == b.0) {
                        let plans = views.iter().map(|&view| (self.plan(view).clone(), None)).collect();
                        let mut plans = Some(plans);
                        lend(views[0].0, &mut |frame| batch.encode(frame, plans.take().unwrap_or_default()))?;
                    }
                    Ok(())
                })?;
                take(renderer, batches, batch, now.to_vec())?;
            }
        }
        Ok(())
    }
}

impl Renderer {
    /// Draws views of several worlds and reads back what their settings ask for: of each world in the order of its
    /// plans. Views that agree in size, samples, outputs and tone map are drawn together, whichever world they are of,
    /// with one wait for the GPU. `lend` hands over the frame of a world by its place in the list; it may be asked for
    /// several times. The renderer should [keep worlds](Self::keep_worlds), each of which is to be listed once.
    ///
    /// # Errors
    /// [`RenderError`].
    pub fn draw_worlds(
        &mut self,
        batches: &mut ViewBatches,
        worlds: &[Vec<ViewPlan>],
        lend: &mut Lend<'_>,
    ) -> Result<Vec<Vec<Outputs>>, RenderError> {
        batches.begin();
        let mut results: Vec<Vec<Option<Outputs>>> = Vec::new();
        let mut views = WorldViews::default();
        for (world, plans) in worlds.iter().enumerate() {
            let mut have_room = true;
            lend(world, &mut |frame| {
                have_room = views.add(frame, plans);
                Ok(())
            })?;
            let drawn = &views.drawn[world].plans;
            results.push(drawn.iter().map(|_| None).collect());
            if !have_room {
                lend(world, &mut |frame| {
                    let outputs = self.draw_views(frame, batches, drawn)?;
                    results[world] = outputs.into_iter().map(Some).collect();
                    Ok(())
                })?;
            }
        }
        let mut submitted = DrawnBatches::default();
        let mut put = |(world, plan): PlanOfWorld, outputs| results[world][plan] = Some(outputs);
        views.encode(self, batches, lend, &mut |renderer, batches, encoded, views| {
            let batch = renderer.submit_batch(batches, encoded)?;
            submitted.push(renderer, batches, (batch, views), &mut put);
            Ok(())
        })?;
        submitted.finish(self, batches, put);
        batches.end();
        self.gpu.check()?;
        let joined = views.drawn.iter().zip(results);
        Ok(joined.map(|(drawn, outputs)| drawn.join(outputs.into_iter().flatten().collect())).collect())
    }

    /// Draws a view of each of several worlds as [`Self::draw_worlds`] does, and leaves what they show on the device,
    /// in arrays ([`Packing`]). Waits until these are written, once.
    ///
    /// # Errors
    /// [`RenderError`].
    pub fn pack_worlds(
        &mut self,
        batches: &mut ViewBatches,
        worlds: &[ViewPlan],
        lend: &mut Lend<'_>,
        packing: &Packing<'_>,
    ) -> Result<(), RenderError> {
        packing.check(&self.gpu, worlds.len())?;
        batches.begin();
        let mut views = WorldViews::default();
        for (world, plan) in worlds.iter().enumerate() {
            lend(world, &mut |frame| {
                // A single view always has room for its shadows.
                views.add(frame, std::slice::from_ref(plan));
                Ok(())
            })?;
        }
        views.encode(self, batches, lend, &mut |renderer, batches, encoded, views| {
            let places: Vec<usize> = views.into_iter().map(|(world, _)| world).collect();
            renderer.pack_batch(batches, encoded, &places, packing)
        })?;
        batches.end();
        self.gpu.poll(wgpu::PollType::wait_indefinitely());
        self.gpu.check()
    }
}
