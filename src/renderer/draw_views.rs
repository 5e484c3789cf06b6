//! Many views in one submission, of one world or of several: views of one size are layers of shared textures
//! ([`ViewBatches`]), and come back through one buffer.
//!
//! ```text
//! prepare          of each world: uploads, lists, and a layer for each view
//! encode_scene     a pass per view, each into its own layer, from its corner (0, 0)
//! tone map         one pass for all layers, into one tall picture; a view with several samples per pixel has its own
//! copies           one per output, of all layers
//! submit, map      once
//! ```

use super::encode::color_attachment;
use super::objects::Encoded;
use super::pipelines::ToneMapSource;
use super::readback::Source;
use super::shadow_maps::views_with_room;
use super::targets::layer_view;
use super::view_batches::{BatchKey, Fitted, LayerTextures, ViewBatches};
use super::{OutputSet, Outputs, PICTURE_FORMAT, RenderError, Renderer, SlotSet, ViewPlan, ViewState, ViewTarget};
use std::sync::Arc;
use systems::Simulation;
use systems::draw::FrameData;

/// Lends a world's frame to what reads it.
type LendFrame<'a> = dyn FnMut(&mut dyn FnMut(&mut FrameData<'_>)) + 'a;

/// Views of a world that are drawn with those of others.
pub struct WorldViews<'a> {
    renderer: &'a mut Renderer,
    lend: Box<LendFrame<'a>>,
    plans: &'a [ViewPlan],
    /// Of plans, the slots of what is drawn alone; of those beyond, all.
    only: &'a [Arc<SlotSet>],
}

impl<'a> WorldViews<'a> {
    /// Of a world as its last frame left it. `renderer`: its own, which draws no other world meanwhile.
    pub fn new(renderer: &'a mut Renderer, simulation: &'a mut Simulation, plans: &'a [ViewPlan]) -> Self {
        let lend = |read: &mut dyn FnMut(&mut FrameData<'_>)| simulation.with_frame(|frame| read(frame));
        Self { renderer, lend: Box::new(lend), plans, only: &[] }
    }

    /// What a frame gives to what reads it.
    fn with_frame<R>(&mut self, mut read: impl FnMut(&mut Renderer, &mut FrameData<'_>) -> R) -> Option<R> {
        let (mut made, renderer) = (None, &mut *self.renderer);
        (self.lend)(&mut |frame| made = Some(read(renderer, frame)));
        made
    }
}

/// A view among those of several worlds: the numbers of its world and of its plan.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Place {
    world: usize,
    plan: usize,
}

impl Renderer {
    /// Draws views of a frame and reads back what their settings ask for, in the order of the plans. Views that agree in
    /// size, samples and outputs are drawn together, with one wait for the GPU. What a view shows does not depend on
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
        self.draw_alone(frame, batches, (plans, &[]))
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
        (plans, only): (&[ViewPlan], &[Arc<SlotSet>]),
    ) -> Result<Vec<Outputs>, RenderError> {
        let lend = Box::new(|read: &mut dyn FnMut(&mut FrameData<'_>)| read(frame));
        let drawn = draw_worlds(&mut [WorldViews { renderer: self, lend, plans, only }], batches)?;
        Ok(drawn.into_iter().flatten().collect())
    }
}

/// [`Renderer::draw_views`] of several worlds at once: of each world what its plans ask for. What a view shows depends
/// neither on other views nor on other worlds, to the bit. Keep the worlds' order, too. All renderers are to be of one
/// device; those of worlds with the same library share its meshes and maps ([`Renderer::fork`]).
///
/// # Errors
/// [`RenderError`].
pub fn draw_worlds(worlds: &mut [WorldViews<'_>], batches: &mut ViewBatches) -> Result<Vec<Vec<Outputs>>, RenderError> {
    let Some(gpu) = worlds.first().map(|world| world.renderer.gpu.clone()) else { return Ok(Vec::new()) };
    batches.begin();
    let mut results: Vec<Vec<Option<Outputs>>> =
        worlds.iter().map(|world| world.plans.iter().map(|_| None).collect()).collect();
    let plans =
        |(world, views): (usize, &WorldViews<'_>)| (0..views.plans.len()).map(move |plan| Place { world, plan });
    let mut open: Vec<Place> = worlds.iter().enumerate().flat_map(plans).collect();
    while let Some(first) = open.first() {
        let key_of = |place: &Place| BatchKey::of(&worlds[place.world].plans[place.plan]);
        let key = key_of(first);
        let (alike, others): (Vec<Place>, Vec<Place>) = open.iter().partition(|place| key_of(place) == key);
        open = others;
        let mut rest = &alike[..];
        while !rest.is_empty() {
            let most = rest.len().min(key.most_views(&gpu));
            let (now, later) = rest.split_at(with_room(worlds, &rest[..most]));
            rest = later;
            let drawn = draw_batch(worlds, batches, key, now)?;
            now.iter().zip(drawn).for_each(|(at, outputs)| results[at.world][at.plan] = Some(outputs));
        }
    }
    batches.finish();
    gpu.check()?;
    Ok(results.into_iter().map(|of_world| of_world.into_iter().flatten().collect()).collect())
}

/// How many of some views, from the first on, find room for the shadow maps of their worlds; at least 1.
fn with_room(worlds: &mut [WorldViews<'_>], views: &[Place]) -> usize {
    let mut count = 0;
    for of_world in views.chunk_by(|a, b| a.world == b.world) {
        let world = &mut worlds[of_world[0].world];
        let plans = world.plans;
        let asked: Vec<&ViewPlan> = of_world.iter().map(|at| &plans[at.plan]).collect();
        let fit = world.with_frame(|_, frame| views_with_room(frame, &asked)).unwrap_or(1);
        count += fit;
        if fit < asked.len() {
            break;
        }
    }
    count
}

/// Draws views alike.
fn draw_batch(
    worlds: &mut [WorldViews<'_>],
    batches: &mut ViewBatches,
    key: BatchKey,
    views: &[Place],
) -> Result<Vec<Outputs>, RenderError> {
    let Some(first) = views.first() else { return Ok(Vec::new()) };
    let first = &worlds[first.world].renderer;
    let (gpu, count) = (first.gpu.clone(), views.len());
    let limit = gpu.device.limits().max_texture_dimension_2d;
    if key.size.0.max(key.size.1) > limit {
        let (needed, limit) = (key.size.0.max(key.size.1).into(), limit.into());
        return Err(RenderError::TooLarge { what: "the picture", unit: "pixels along a side", needed, limit });
    }
    let Fitted { states, textures, readback } = batches.fit(&gpu, &first.pipelines, key, count)?;
    prepare(worlds, views, states)?;
    let label = wgpu::CommandEncoderDescriptor { label: Some("views") };
    let mut encoder = gpu.device.create_command_encoder(&label);
    encode(&mut encoder, worlds, views, (key, textures, states));

    let resolved: Vec<_> = states
        .iter()
        .filter(|_| key.outputs.linear && key.samples > 1)
        .filter_map(|state| state.targets.as_ref())
        .map(|targets| targets.hdr.resolved(&gpu.device, &mut encoder))
        .collect();
    let layers = |texture: &wgpu::Texture| Source { texture: texture.clone(), size: key.size, layers: count as u32 };
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
    let color = color.then(|| add(vec![layers(&textures.picture)]));
    let linear = is_linear.then(|| add(linear));
    let depth = depth.then(|| add(vec![layers(&textures.depth)]));
    let normal = textures.normal.as_ref().map(|texture| add(vec![layers(texture)]));
    let id = textures.id.as_ref().map(|texture| add(vec![layers(texture)]));
    Ok(readback.read_layers(&gpu, encoder, &sources, |packed| {
        let texels = |source: Option<usize>, layer: usize| {
            source.map_or_else(Vec::new, |source| packed[source].layer(layer as u32))
        };
        let (width, height) = key.size;
        let outputs = |view: usize| Outputs {
            width,
            height,
            picture: color.and_then(|_| image::RgbaImage::from_raw(width, height, texels(color, view))),
            linear: if key.samples == 1 { texels(linear, view) } else { texels(linear.map(|of| of + view), 0) },
            normal: texels(normal, view),
            id: texels(id, view),
            depth: texels(depth, view),
            view_from_clip: states[view].view_from_clip,
        };
        (0..count).map(outputs).collect()
    }))
}

/// Prepares views, world by world.
fn prepare(worlds: &mut [WorldViews<'_>], views: &[Place], mut states: &mut [ViewState]) -> Result<(), RenderError> {
    for of_world in views.chunk_by(|a, b| a.world == b.world) {
        let (own, others) = states.split_at_mut(of_world.len());
        states = others;
        let world = &mut worlds[of_world[0].world];
        let (plans, only) = (world.plans, world.only);
        let mut prepared = Vec::with_capacity(own.len());
        for (state, at) in own.iter_mut().zip(of_world) {
            state.only = only.get(at.plan).cloned();
            prepared.push((state, plans[at.plan].clone()));
        }
        world.with_frame(|renderer, frame| renderer.prepare(frame, &mut prepared)).transpose()?;
    }
    Ok(())
}

/// Encodes prepared views, world by world, into their layers; then their pictures.
fn encode(
    encoder: &mut wgpu::CommandEncoder,
    worlds: &mut [WorldViews<'_>],
    views: &[Place],
    (key, textures, states): (BatchKey, &LayerTextures, &mut [ViewState]),
) {
    let pictures: Vec<_> = (0..if key.samples == 1 { 1 } else { views.len() as u32 })
        .map(|index| layer_view(&textures.picture, "picture", index))
        .collect();
    let mut targets = states
        .iter_mut()
        .enumerate()
        .map(|(index, state)| ViewTarget::new(state, &pictures[index.min(pictures.len() - 1)], PICTURE_FORMAT));
    for of_world in views.chunk_by(|a, b| a.world == b.world) {
        let renderer = &mut *worlds[of_world[0].world].renderer;
        let targets: Vec<_> = targets.by_ref().take(of_world.len()).collect();
        renderer.begin_encoding(encoder, &targets);
        let mut encoded = Encoded::default();
        for mut target in targets {
            renderer.encode_scene(encoder, &mut target, &mut encoded);
            if key.samples > 1 {
                renderer.encode_tone_map(encoder, &target);
            }
            target.state.drawn_now();
        }
        (renderer.stats.draws, renderer.stats.draw_calls) = (encoded.draws, encoded.calls);
    }
    drop(targets);
    if key.samples == 1 && key.outputs.color {
        let renderer = &mut *worlds[views[0].world].renderer;
        renderer.encode_tone_map_of_layers(encoder, (textures, key), &pictures[0], states);
    }
    for of_world in views.chunk_by(|a, b| a.world == b.world) {
        worlds[of_world[0].world].renderer.finish_timestamps(encoder);
    }
}

impl Renderer {
    /// From the linear colours of all layers to their pictures.
    fn encode_tone_map_of_layers(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        (textures, key): (&LayerTextures, BatchKey),
        target: &wgpu::TextureView,
        states: &[ViewState],
    ) {
        let Self { gpu, pipelines, timestamps, .. } = self;
        // Worlds have tone maps of their own.
        let alike: Vec<_> = states.chunk_by(|a, b| a.tone_map == b.tone_map).collect();
        let mut pipeline_of = |states: &[ViewState]| {
            pipelines.tone_map(&gpu.device, PICTURE_FORMAT, states[0].tone_map, ToneMapSource::Layers).clone()
        };
        let made: Vec<_> = alike.iter().map(|states| pipeline_of(states)).collect();
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("tone map"),
            color_attachments: &[Some(color_attachment(target))],
            timestamp_writes: timestamps.as_ref().and_then(|timestamps| timestamps.render_pass("tone map")),
            ..wgpu::RenderPassDescriptor::default()
        });
        let mut first = 0;
        for (states, pipeline) in alike.into_iter().zip(made) {
            let rows = key.size.1 * states.len() as u32;
            pass.set_scissor_rect(0, first, key.size.0, rows);
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &textures.hdr.source, &[]);
            pass.draw(0..3, 0..1);
            first += rows;
        }
    }
}
