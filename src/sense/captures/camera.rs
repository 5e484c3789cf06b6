//! Measurements of a camera: arrays of a value per pixel, rows from the top.

use super::boxes::ObjectBox;
use super::flow::Flow;
use half::f16;
use systems::draw::Intrinsics;
use systems::sensors::{CameraOutputs, Lens};

/// Capture of a camera. Arrays that were not asked for are empty.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct CameraCapture {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Outputs that were asked for.
    pub outputs: CameraOutputs,
    /// `None` where the projection is parallel.
    pub intrinsics: Option<Intrinsics>,
    /// With what bends its picture.
    pub lens: Lens,
    /// Factor of linear colours.
    pub exposure: f32,
    /// 8-bit sRGB, tone-mapped: (H, W, 3).
    pub color: Vec<[u8; 3]>,
    /// Linear, exposed, before the tone map: (H, W, 3).
    pub linear: Vec<[f16; 3]>,
    /// Metres along the optical axis, infinite where there is nothing: (H, W).
    pub depth: Vec<f32>,
    /// Metres from the optical centre, infinite where there is nothing: (H, W). Where the projection is parallel, as
    /// depth.
    pub range: Vec<f32>,
    /// Unit shading normals with bumps, X right, Y down, Z forward; 0 where there is nothing: (H, W, 3).
    pub normal: Vec<[f32; 3]>,
    /// Numbers of things; 0 where there is nothing: (H, W).
    pub instance: Vec<u32>,
    /// Numbers of drawn entities; 0 where there is nothing: (H, W).
    pub part: Vec<u32>,
    /// Semantic classes; 0 where there is none: (H, W).
    pub class: Vec<u8>,
    /// Numbers: of things class · 1000 + n, where n counts those of a class in this picture from 0 on by their numbers;
    /// of stuff its class; 0 where there is nothing: (H, W). As Cityscapes has instance ids.
    pub panoptic: Vec<u32>,
    /// Boxes of things in the picture, in the order of their numbers.
    pub boxes: Vec<ObjectBox>,
    /// Flow from the pixels of the *capture before* to this picture. Empty where there was none.
    pub flow: Flow,
    /// Flow from the pixels of this picture to that of the capture before. Empty where there was none.
    pub flow_back: Flow,
}
