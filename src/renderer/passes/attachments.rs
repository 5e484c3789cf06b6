//! Attachments of the passes over a scene: what these load, clear and leave.

use crate::renderer::gpu::timestamps::Timestamps;

/// Attachments of the passes over a scene.
#[derive(Clone, Copy)]
pub(crate) struct Attachments<'a> {
    pub color: &'a wgpu::TextureView,
    /// Target that the samples of `color` are resolved into after opaque objects.
    pub resolved: Option<&'a wgpu::TextureView>,
    pub depth: &'a wgpu::TextureView,
    /// Normals and ids that are drawn with the colour.
    pub beside: [Option<&'a wgpu::TextureView>; 2],
}

/// Results that a pass over the scene leaves for those that follow, beside the colours of all samples.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Leaves {
    /// The mean of each pixel's samples, for blended objects to refract.
    pub resolved: bool,
    pub depth: bool,
}

impl Leaves {
    /// Depths.
    pub const DEPTH: Self = Self { resolved: false, depth: true };
}

/// A pass over the scene, as it begins and ends.
#[derive(Clone, Copy)]
pub(crate) struct ScenePass {
    pub label: &'static str,
    /// Colour that it begins with, and nothing else; `None`: what is there already.
    pub clear: Option<wgpu::Color>,
    pub leaves: Leaves,
}

/// Begins a pass over the scene.
pub(crate) fn begin_forward<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    timestamps: Option<&Timestamps>,
    Attachments { color, resolved, depth, beside }: Attachments<'_>,
    ScenePass { label, clear, leaves }: ScenePass,
) -> wgpu::RenderPass<'a> {
    let resolve_target = resolved.filter(|_| leaves.resolved);
    let load = clear.map_or(wgpu::LoadOp::Load, wgpu::LoadOp::Clear);
    let mut depth = depth_attachment(depth, if leaves.depth { wgpu::StoreOp::Store } else { wgpu::StoreOp::Discard });
    if clear.is_none() {
        depth.depth_ops = depth.depth_ops.map(|ops| wgpu::Operations { load: wgpu::LoadOp::Load, ..ops });
    }
    let ops = wgpu::Operations { load, store: wgpu::StoreOp::Store };
    let color = wgpu::RenderPassColorAttachment { view: color, depth_slice: None, resolve_target, ops };
    let beside = beside.map(|view| {
        view.map(|view| {
            let mut attachment = color_attachment(view);
            attachment.ops.load = if clear.is_some() { attachment.ops.load } else { wgpu::LoadOp::Load };
            attachment
        })
    });
    let [normal, id] = beside;
    let attached = normal.is_some() || id.is_some();
    let all = [Some(color), normal, id];
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(label),
        color_attachments: if attached { &all } else { &all[..1] },
        depth_stencil_attachment: Some(depth),
        timestamp_writes: timestamps.and_then(|timestamps| timestamps.render_pass(label)),
        ..wgpu::RenderPassDescriptor::default()
    })
}

pub(crate) fn color_attachment(view: &wgpu::TextureView) -> wgpu::RenderPassColorAttachment<'_> {
    let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store };
    wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops }
}

pub(crate) fn depth_attachment(
    view: &wgpu::TextureView,
    store: wgpu::StoreOp,
) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    // Reversed depth: 0 is infinitely far.
    let depth_ops = Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store });
    wgpu::RenderPassDepthStencilAttachment { view, depth_ops, stencil_ops: None }
}
