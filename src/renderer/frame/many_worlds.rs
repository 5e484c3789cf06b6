//! Views of several worlds in one submission: world after world is prepared and encoded, then all is handed in.
//!
//! Each world has device buffers of its own: no write for one changes what was encoded for another.

use super::measured::{DrawnPlans, has_levels};
use super::renderer::Renderer;
use super::view_batches::{DrawnBatches, ViewBatches};
use crate::renderer::gpu::error::RenderError;
use crate::renderer::plan::view_plan::ViewPlan;
use crate::renderer::shadows::shadow_maps::views_with_room;
use crate::renderer::views::layers::ViewBatchKey;
use crate::renderer::views::outputs::Outputs;
use systems::draw::{FrameData, ToneMap};

/// Callback that reads the frame of a world.
pub type ReadFrame<'a> = dyn FnMut(&mut FrameData<'_>) -> Result<(), RenderError> + 'a;

/// Hands over the frame of a world, by its place in a list of worlds.
pub type Lend<'a> = dyn FnMut(usize, &mut ReadFrame<'_>) -> Result<(), RenderError> + 'a;

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
        let mut all_drawn = Vec::new();
        // By world, whether the shadows of all its views find room beside each other.
        let mut tone_maps = Vec::new();
        let mut open = Vec::new();
        for (world, plans) in worlds.iter().enumerate() {
            let (mut tone_map, mut have_room, mut with_levels) = (ToneMap::default(), true, false);
            lend(world, &mut |frame| {
                tone_map = frame.list.environment.tone_map;
                have_room = views_with_room(frame, &plans.iter().collect::<Vec<_>>()) >= plans.len();
                with_levels = has_levels(frame);
                Ok(())
            })?;
            tone_maps.push(tone_map);
            let drawn = DrawnPlans::new(plans, with_levels);
            results.push(drawn.plans.iter().map(|_| None).collect());
            if have_room {
                open.extend((0..drawn.plans.len()).map(|plan| (world, plan)));
            } else {
                lend(world, &mut |frame| {
                    let outputs = self.draw_views(frame, batches, &drawn.plans)?;
                    results[world] = outputs.into_iter().map(Some).collect();
                    Ok(())
                })?;
            }
            all_drawn.push(drawn);
        }
        let plan_of = |world: usize, plan: usize| &all_drawn[world].plans[plan];
        let key_of = |&(world, plan): &(usize, usize)| (ViewBatchKey::of(plan_of(world, plan)), tone_maps[world]);
        let mut submitted = DrawnBatches::default();
        while let Some(first) = open.first() {
            let key = key_of(first);
            let (alike, others): (Vec<_>, Vec<_>) = open.iter().partition(|view| key_of(view) == key);
            open = others;
            for now in alike.chunks(key.0.most_views(&self.gpu)) {
                let batch = self.draw_batch(batches, key.0, now.len(), &mut |batch| {
                    for views in now.chunk_by(|a, b| a.0 == b.0) {
                        let plans = views.iter().map(|&(world, plan)| (plan_of(world, plan).clone(), None)).collect();
                        let mut plans = Some(plans);
                        lend(views[0].0, &mut |frame| batch.encode(frame, plans.take().unwrap_or_default()))?;
                    }
                    Ok(())
                })?;
                let views = (batch, now.to_vec());
                submitted.push(self, batches, views, |(world, plan), outputs| results[world][plan] = Some(outputs));
            }
        }
        submitted.finish(self, batches, |(world, plan), outputs| results[world][plan] = Some(outputs));
        batches.end();
        self.gpu.check()?;
        let joined = all_drawn.iter().zip(results);
        Ok(joined.map(|(drawn, outputs)| drawn.join(outputs.into_iter().flatten().collect())).collect())
    }
}
