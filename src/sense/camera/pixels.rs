//! Outputs of a camera's views, an array of a value per pixel each, rows from the top.

use crate::renderer::Outputs;
use half::f16;
use systems::draw::Intrinsics;
use systems::sensors::{CameraOutput, CameraSensor};

/// Outputs that go by the distance from the optical centre.
pub(super) const WITH_RANGE: [CameraOutput; 3] = [CameraOutput::Range, CameraOutput::Flow, CameraOutput::FlowBack];

/// Outputs that go by depth.
pub(super) const WITH_DEPTH: [CameraOutput; 4] =
    [CameraOutput::Depth, CameraOutput::Range, CameraOutput::Flow, CameraOutput::FlowBack];

/// Before entities have their labels, and normals the camera's axes. What was not asked for is empty.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Pixels {
    /// 8-bit sRGB, tone-mapped.
    pub color: Vec<[u8; 3]>,
    /// Linear, exposed.
    pub linear: Vec<[f16; 3]>,
    /// Metres along the camera's axis, infinite where there is nothing.
    pub depth: Vec<f32>,
    /// Metres from the optical centre, infinite where there is nothing; of a parallel projection, as depth.
    pub range: Vec<f32>,
    /// World space, 0 where there is nothing.
    pub normal: Vec<[f32; 3]>,
    /// Entity indices plus 1, 0 where there is nothing.
    pub id: Vec<u32>,
}

impl Pixels {
    /// Pixels of a view that is the camera's picture.
    pub fn of_view(sensor: &CameraSensor, drawn: &Outputs) -> Self {
        let depth = drawn.depths();
        let ranges = |depth| ranges(depth, sensor.size.0, sensor.intrinsics());
        let range = if sensor.outputs.has_any(&WITH_RANGE) { ranges(&depth) } else { Vec::new() };
        let color = drawn.picture.as_ref().map_or(&[][..], |picture| picture.as_raw());
        Self {
            color: color.as_chunks().0.iter().map(|&[r, g, b, _]: &[u8; 4]| [r, g, b]).collect(),
            linear: linear(drawn).collect(),
            depth,
            range,
            normal: drawn.normals(),
            id: drawn.ids().collect(),
        }
    }
}

/// Linear colours of a view.
pub(super) fn linear(drawn: &Outputs) -> impl Iterator<Item = [f16; 3]> {
    drawn.linear().into_iter().map(|[r, g, b, _]| [r, g, b])
}

/// Depth · ‖K⁻¹ (u, v, 1)‖.
fn ranges(depth: &[f32], width: u32, intrinsics: Option<Intrinsics>) -> Vec<f32> {
    let Some(intrinsics) = intrinsics else { return depth.to_vec() };
    let rows = depth.chunks(width.max(1) as usize).zip(0_u32..);
    rows.flat_map(|(row, v)| {
        row.iter().zip(0_u32..).map(move |(&depth, u)| {
            let stretch = intrinsics.direction(f64::from(u), f64::from(v)).length();
            (f64::from(depth) * stretch) as f32
        })
    })
    .collect()
}
