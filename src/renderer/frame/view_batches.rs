//! Many views in one submission: views of one size are layers of shared textures, and come back through one buffer.
//!
//! ```text
//! prepare          uploads, lists, and a layer for each view
//! encode_scene     a pass per view, each into its own layer, from its corner (0, 0)
//! tone map         one pass for all layers, into one tall picture; a view with several samples per pixel has its own
//! copies           one per output, of all layers
//! submit, map      once
//! ```
//!
//! Layers, not parts of one large texture with a viewport each: where a view lies in a texture changes how window
//! coordinates and planes round. In layers a view's bits are those that it has alone, whatever is drawn beside it.

use super::batch_encoder::BatchEncoder;
use super::measured::{DrawnPlans, has_levels};
use super::objects::Encoded;
use super::renderer::Renderer;
use crate::renderer::culling::slot_set::SlotSet;
use crate::renderer::gpu::device::Gpu;
use crate::renderer::gpu::error::RenderError;
use crate::renderer::gpu::formats::PICTURE_FORMAT;
use crate::renderer::gpu::readback::{Pending, Readback, Source};
use crate::renderer::gpu::texture::layer_view;
use crate::renderer::passes::attachments::color_attachment;
use crate::renderer::passes::pack::{Packer, Packing};
use crate::renderer::passes::pipelines::{Pipelines, ToneMapSource};
use crate::renderer::plan::output_set::OutputSet;
use crate::renderer::plan::view_plan::ViewPlan;
use crate::renderer::shadows::shadow_maps::views_with_room;
use crate::renderer::views::layers::{LayerTextures, ViewBatchKey};
use crate::renderer::views::outputs::Outputs;
use crate::renderer::views::view_state::ViewState;
use glam::Mat4;
use std::collections::VecDeque;
use std::sync::Arc;
use systems::draw::FrameData;

/// Calls of [`Renderer::draw_views`] for which a batch without a view is kept: sensors may be due seldom.
const KEPT_FOR: u32 = 120;
/// Bytes of copies that are under way at once; a batch may have more by itself.
const MOST_PENDING: u64 = 256 << 20;

/// State of [`Renderer::draw_views`] kept between frames. It holds view states in batches of one size and one set of
/// outputs, and the textures that they share.
#[derive(Debug, Default)]
pub struct ViewBatches {
    batches: Vec<ViewBatch>,
    readback: Readback,
}

/// A batch whose views are encoded, and not submitted yet.
pub(super) struct EncodedBatch {
    encoder: wgpu::CommandEncoder,
    key: ViewBatchKey,
    /// Number of its views.
    count: usize,
}

/// A batch that was submitted, and is not read yet.
pub(super) struct DrawnBatch {
    pending: Pending,
    key: ViewBatchKey,
    first: OutputSources,
    /// By view.
    view_from_clip: Vec<Mat4>,
}

/// Places of outputs among the sources of a batch.
struct OutputSources {
    color: Option<usize>,
    linear: Option<usize>,
    depth: Option<usize>,
    normal: Option<usize>,
    id: Option<usize>,
}

/// Batches that were submitted, with the places that their views have in a capture.
pub(super) struct DrawnBatches<P>(VecDeque<(DrawnBatch, Vec<P>)>);

impl<P> Default for DrawnBatches<P> {
    fn default() -> Self {
        Self(VecDeque::new())
    }
}

impl<P> DrawnBatches<P> {
    /// Adds a batch. The earliest ones are read where all together hold more than [`MOST_PENDING`].
    pub fn push(
        &mut self,
        renderer: &Renderer,
        batches: &mut ViewBatches,
        drawn: (DrawnBatch, Vec<P>),
        mut put: impl FnMut(P, Outputs),
    ) {
        self.0.push_back(drawn);
        while self.0.len() > 1 && self.0.iter().map(|(batch, _)| batch.pending.bytes()).sum::<u64>() > MOST_PENDING {
            self.read_first(renderer, batches, &mut put);
        }
    }

    /// Reads all that is left.
    pub fn finish(mut self, renderer: &Renderer, batches: &mut ViewBatches, mut put: impl FnMut(P, Outputs)) {
        while !self.0.is_empty() {
            self.read_first(renderer, batches, &mut put);
        }
        batches.readback.keep(MOST_PENDING);
    }

    fn read_first(&mut self, renderer: &Renderer, batches: &mut ViewBatches, put: &mut impl FnMut(P, Outputs)) {
        if let Some((batch, places)) = self.0.pop_front() {
            places
                .into_iter()
                .zip(renderer.read_batch(batches, batch))
                .for_each(|(place, outputs)| put(place, outputs));
        }
    }
}

#[derive(Debug)]
struct ViewBatch {
    key: ViewBatchKey,
    states: Vec<ViewState>,
    textures: Option<LayerTextures>,
    /// Calls since it had a view.
    unused_for: u32,
}

impl ViewBatches {
    /// Before the first batch of a frame.
    pub(super) fn begin(&mut self) {
        self.batches.iter_mut().for_each(|batch| batch.unused_for += 1);
    }

    /// After the last one: what has had no view for long gives its memory back.
    pub(super) fn end(&mut self) {
        self.batches.retain(|batch| batch.unused_for <= KEPT_FOR);
    }

    /// The textures of a kind's batch, and the states of its first views.
    fn drawn(&self, key: ViewBatchKey, count: usize) -> Result<(&LayerTextures, &[ViewState]), RenderError> {
        let found = self.batches.iter().find(|batch| batch.key == key);
        let parts = found.and_then(|batch| batch.textures.as_ref().zip(batch.states.get(..count)));
        parts.ok_or_else(|| RenderError::Refused { reason: "no textures for views".into() })
    }

    /// The batch of a kind, which is made where there is none.
    fn batch(&mut self, key: ViewBatchKey) -> &mut ViewBatch {
        let found = self.batches.iter().position(|batch| batch.key == key);
        let index = found.unwrap_or_else(|| {
            self.batches.push(ViewBatch { key, states: Vec::new(), textures: None, unused_for: 0 });
            self.batches.len() - 1
        });
        let batch = &mut self.batches[index];
        batch.unused_for = 0;
        batch
    }
}

impl ViewBatch {
    /// Has states and layers for so many views.
    fn fit(&mut self, gpu: &Gpu, pipelines: &Pipelines, views: usize) -> Result<(), RenderError> {
        if self.states.len() < views {
            self.states.resize_with(views, || ViewState::new(gpu));
            self.textures = None;
        }
        if self.textures.is_none() {
            let textures = LayerTextures::new(gpu, pipelines, self.key, self.states.len() as u32)?;
            for (index, state) in (0..).zip(&mut self.states) {
                state.set_layer(textures.layer(self.key, index));
            }
            self.textures = Some(textures);
        }
        Ok(())
    }
}

impl Renderer {
    /// Draws views of a frame and reads back what their settings ask for, in the order of the plans. Views that agree
    /// in size, samples and outputs are drawn together, with one wait for the GPU. What a view shows does not depend on
    /// the others, to the bit. Views are told apart by their place among those alike: keep their order from frame to
    /// frame.
    ///
    /// Prepares the views itself: those of an earlier [`Self::prepare`] have to be prepared again.
    ///
    /// # Errors
    /// [`RenderError`].
    pub fn draw_views(
        &mut self,
        frame: &mut FrameData<'_>,
        batches: &mut ViewBatches,
        plans: &[ViewPlan],
    ) -> Result<Vec<Outputs>, RenderError> {
        self.draw_alone(frame, batches, plans, &[])
    }

    /// [`Self::draw_views`] of some objects alone, as if nothing were in front of them: of each plan those in a set of
    /// slots; of plans beyond the sets, all. Where an object is seen in both, its bits are the same. Colours of the
    /// rest's shadows are not.
    ///
    /// # Errors
    /// [`RenderError`].
    pub fn draw_alone(
        &mut self,
        frame: &mut FrameData<'_>,
        batches: &mut ViewBatches,
        plans: &[ViewPlan],
        only: &[Arc<SlotSet>],
    ) -> Result<Vec<Outputs>, RenderError> {
        batches.begin();
        let drawn = DrawnPlans::new(plans, has_levels(frame));
        let plans = &drawn.plans;
        let mut results: Vec<Option<Outputs>> = plans.iter().map(|_| None).collect();
        let mut open: Vec<usize> = (0..plans.len()).collect();
        let mut submitted = DrawnBatches::default();
        while let Some(&first) = open.first() {
            let key = ViewBatchKey::of(&plans[first]);
            let (alike, others): (Vec<_>, Vec<_>) = open.iter().partition(|&&i| ViewBatchKey::of(&plans[i]) == key);
            open = others;
            let mut rest = &alike[..];
            while !rest.is_empty() {
                let most = rest.len().min(key.most_views(&self.gpu));
                let asked: Vec<&ViewPlan> = rest[..most].iter().map(|&i| &plans[i]).collect();
                let (now, later) = rest.split_at(views_with_room(frame, &asked));
                rest = later;
                let mut views =
                    Some(now.iter().map(|&i| (plans[i].clone(), only.get(drawn.asked[i]).cloned())).collect());
                let encoded = self.encode_batch(batches, key, now.len(), &mut |batch| {
                    batch.encode(frame, views.take().unwrap_or_default())
                })?;
                let batch = self.submit_batch(batches, encoded)?;
                submitted.push(self, batches, (batch, now.to_vec()), |i, outputs| results[i] = Some(outputs));
            }
        }
        submitted.finish(self, batches, |i, outputs| results[i] = Some(outputs));
        batches.end();
        self.gpu.check()?;
        Ok(drawn.join(results.into_iter().flatten().collect()))
    }

    /// Draws so many views of a kind, which `encode` encodes.
    pub(super) fn encode_batch(
        &mut self,
        batches: &mut ViewBatches,
        key: ViewBatchKey,
        count: usize,
        encode: &mut dyn FnMut(&mut BatchEncoder<'_>) -> Result<(), RenderError>,
    ) -> Result<EncodedBatch, RenderError> {
        let limit = self.gpu.device.limits().max_texture_dimension_2d;
        if key.size.0.max(key.size.1) > limit {
            let (needed, limit) = (key.size.0.max(key.size.1).into(), limit.into());
            return Err(RenderError::TooLarge { what: "the picture", unit: "pixels along a side", needed, limit });
        }
        batches.batch(key).fit(&self.gpu, &self.pipelines, count)?;
        let Some(ViewBatch { states, textures: Some(textures), .. }) =
            batches.batches.iter_mut().find(|batch| batch.key == key)
        else {
            return Err(RenderError::Refused { reason: "no textures for views".into() });
        };
        let label = wgpu::CommandEncoderDescriptor { label: Some("views") };
        let encoder = self.gpu.device.create_command_encoder(&label);
        let pictures: Vec<_> = (0..if key.samples == 1 { 1 } else { count as u32 })
            .map(|index| layer_view(&textures.picture, "picture", index))
            .collect();
        let states = &mut states[..count];
        let (renderer, encoded) = (&mut *self, Encoded::default());
        let mut batch =
            BatchEncoder { renderer, key, states: &mut *states, pictures: &pictures, encoder, encoded, next: 0 };
        encode(&mut batch)?;
        let BatchEncoder { mut encoder, encoded, .. } = batch;
        (self.stats.draws, self.stats.draw_calls) = (encoded.draws, encoded.calls);
        if key.samples == 1 && key.outputs.color {
            self.encode_tone_map_of_layers(&mut encoder, textures, key, count as u32, &pictures[0], states);
        }
        self.finish_timestamps(&mut encoder);
        Ok(EncodedBatch { encoder, key, count })
    }

    /// Submits a batch, and behind it a pass that packs what its views have drawn into arrays. `places`: of its views
    /// among those of the arrays.
    pub(super) fn pack_batch(
        &mut self,
        batches: &ViewBatches,
        EncodedBatch { mut encoder, key, count }: EncodedBatch,
        places: &[usize],
        packing: &Packing<'_>,
    ) -> Result<(), RenderError> {
        let (textures, states) = batches.drawn(key, count)?;
        let views = states.iter().zip(places).map(|(state, &place)| (state.view_from_clip, place));
        let packer = self.packer.get_or_insert_with(|| Packer::new(&self.gpu.device));
        packer.encode(&self.gpu, &mut encoder, &textures.packed(key), views, packing);
        self.gpu.queue.submit([encoder.finish()]);
        Ok(())
    }

    /// Submits a batch, and copies of what its views have drawn, which [`Self::read_batch`] waits for.
    pub(super) fn submit_batch(
        &self,
        batches: &mut ViewBatches,
        EncodedBatch { mut encoder, key, count }: EncodedBatch,
    ) -> Result<DrawnBatch, RenderError> {
        let (textures, states) = batches.drawn(key, count)?;
        let resolved: Vec<_> = states
            .iter()
            .filter(|_| key.outputs.linear && key.samples > 1)
            .filter_map(|state| state.targets.as_ref())
            .map(|targets| targets.hdr.resolved(&self.gpu.device, &mut encoder))
            .collect();
        let layers =
            |texture: &wgpu::Texture| Source { texture: texture.clone(), size: key.size, layers: count as u32 };
        let mut sources = Vec::new();
        // Where the first source of an output is among them all.
        let mut add = |made: Vec<Source>| {
            let first = sources.len();
            sources.extend(made);
            first
        };
        let linear = if key.samples == 1 {
            vec![layers(&textures.hdr.texture)]
        } else {
            resolved.iter().map(|texture| Source { texture: texture.clone(), size: key.size, layers: 1 }).collect()
        };
        let OutputSet { color, linear: is_linear, depth, .. } = key.outputs;
        let first = OutputSources {
            color: color.then(|| add(vec![layers(&textures.picture)])),
            linear: is_linear.then(|| add(linear)),
            depth: depth.then(|| add(vec![layers(&textures.depth)])),
            normal: textures.normal.as_ref().map(|texture| add(vec![layers(texture)])),
            id: textures.id.as_ref().map(|texture| add(vec![layers(texture)])),
        };
        let view_from_clip = states.iter().map(|state| state.view_from_clip).collect();
        let pending = batches.readback.submit(&self.gpu, encoder, sources);
        Ok(DrawnBatch { pending, key, first, view_from_clip })
    }

    /// Waits for a batch, and reads what its views have drawn.
    pub(super) fn read_batch(&self, batches: &mut ViewBatches, batch: DrawnBatch) -> Vec<Outputs> {
        let DrawnBatch { pending, key, first, view_from_clip } = batch;
        let OutputSources { color, linear, depth, normal, id } = first;
        batches.readback.finish(&self.gpu, pending, |packed| {
            let texels = |source: Option<usize>, layer: usize| {
                source.map_or_else(Vec::new, |source| packed[source].layer(layer as u32))
            };
            let (width, height) = key.size;
            let outputs = |(view, view_from_clip): (usize, Mat4)| Outputs {
                width,
                height,
                picture: color.and_then(|_| image::RgbaImage::from_raw(width, height, texels(color, view))),
                linear: if key.samples == 1 { texels(linear, view) } else { texels(linear.map(|of| of + view), 0) },
                normal: texels(normal, view),
                id: texels(id, view),
                depth: texels(depth, view),
                view_from_clip,
            };
            view_from_clip.into_iter().enumerate().map(outputs).collect()
        })
    }

    /// From the linear colours of all layers to their pictures.
    fn encode_tone_map_of_layers(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        textures: &LayerTextures,
        key: ViewBatchKey,
        count: u32,
        target: &wgpu::TextureView,
        states: &[ViewState],
    ) {
        // It is that of all: a batch has either none or that of its world.
        let Some(tone_map) = states.first().map(|state| state.tone_map) else { return };
        let pipeline = self.pipelines.tone_map(&self.gpu.device, PICTURE_FORMAT, tone_map, ToneMapSource::Layers);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("tone map"),
            color_attachments: &[Some(color_attachment(target))],
            timestamp_writes: self.timestamps.as_ref().and_then(|timestamps| timestamps.render_pass("tone map")),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_scissor_rect(0, 0, key.size.0, key.size.1 * count);
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &textures.hdr.source, &[]);
        pass.draw(0..3, 0..1);
    }
}
