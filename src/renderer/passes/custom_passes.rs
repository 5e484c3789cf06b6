//! Passes of the caller's own, at named places between those of a view.

use crate::renderer::gpu::formats::{DEPTH_FORMAT, HDR_FORMAT};

/// Point in the frame at which a pass of the caller's own is encoded.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum PassPlace {
    /// After opaque objects, before the sky and blended objects: what writes depth hides these.
    AfterOpaque,
    /// After blended objects, before the tone map, which resolves samples.
    AfterBlended,
    /// After the tone map, onto the view's target.
    AfterToneMap,
}

/// Targets that a pass of the caller's own may draw into or read. It loads and stores all of these.
#[derive(Clone, Copy, Debug)]
pub struct PassTargets<'a> {
    /// Pixels.
    pub size: (u32, u32),
    /// The colours so far. Before the tone map: exposed linear HDR of [`Self::samples`] samples. After it: the view's
    /// target.
    pub color: &'a wgpu::TextureView,
    /// Format of `color`.
    pub color_format: wgpu::TextureFormat,
    /// Samples in each pixel of `color`.
    pub color_samples: u32,
    /// Reversed depth: 1 at the near plane, 0 infinitely far. [`Self::DEPTH_FORMAT`]; can also be bound as a texture.
    /// It holds opaque objects. After the tone map it also holds blended ones, where outputs are drawn with the picture
    /// ([`ViewState::draws_together`](crate::renderer::ViewState::draws_together)). Depths that passes write there are
    /// part of that output.
    pub depth: &'a wgpu::TextureView,
    /// Samples in each pixel of `depth`: after the tone map there may be more of them than in `color`.
    pub samples: u32,
}

impl PassTargets<'_> {
    /// Format of the depths.
    pub const DEPTH_FORMAT: wgpu::TextureFormat = DEPTH_FORMAT;
    /// Format of the colours before the tone map.
    pub const LINEAR_FORMAT: wgpu::TextureFormat = HDR_FORMAT;
}

/// Encodes a pass.
pub(crate) type EncodePass<'a> = Box<dyn FnMut(&mut wgpu::CommandEncoder, &PassTargets<'_>) + 'a>;
