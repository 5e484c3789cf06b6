//! What a camera gives: arrays of a value per pixel, rows from the top.

use super::axes::ENTITY_FROM_CAMERA;
use super::boxes::ObjectBox;
use super::flow::Flow;
use super::label_table::{LabelTable, Labels};
use crate::renderer::{OutputSet, Outputs, Settings, ViewPlan};
use bevy_ecs::prelude::*;
use glam::{Affine3A, DAffine3, DVec3, Mat3, Vec3};
use half::f16;
use std::collections::BTreeMap;
use systems::draw::{Intrinsics, View};
use systems::sensors::{CameraOutput, CameraSensor};

/// What a camera captured. Arrays that were not asked for are empty.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct CameraCapture {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// `None` where the projection is parallel.
    pub intrinsics: Option<Intrinsics>,
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
    /// Of things class · 1000 + n, where n counts those of a class in this picture from 0 on by their numbers; of
    /// stuff its class; 0 where there is nothing: (H, W). As Cityscapes has instance ids.
    pub panoptic: Vec<u32>,
    /// Of each thing in the picture, in the order of their numbers.
    pub boxes: Vec<ObjectBox>,
    /// Where what the pixels of the *capture before* show is in this picture. Empty where there was none.
    pub flow: Flow,
    /// Where what the pixels of this picture show was in that of the capture before. Empty where there was none.
    pub flow_back: Flow,
}

/// How a camera's view is drawn.
pub(super) fn plan(sensor: &CameraSensor, world_from_camera: &Affine3A, settings: &Settings) -> ViewPlan {
    let view = View::new(world_from_camera, &sensor.camera(), sensor.size.0, sensor.size.1);
    use CameraOutput::{Boxes, Class, Color, Depth, Flow, FlowBack, Instance, Linear, Normal, Panoptic, Part, Range};
    let outputs = OutputSet {
        color: sensor.outputs.has(Color),
        linear: sensor.outputs.has(Linear),
        depth: sensor.outputs.has_any(&[Depth, Range, Flow, FlowBack]),
        normal: sensor.outputs.has(Normal),
        id: sensor.outputs.has_any(&[Instance, Part, Class, Panoptic, Boxes, Flow, FlowBack]),
    };
    let settings = Settings { samples: sensor.samples, outputs, few_on_cpu: true, ..*settings }.for_files();
    ViewPlan { view, settings }
}

/// How the things of some slots are drawn alone in a camera's view, for their pixels to be counted.
pub(super) fn plan_alone(ViewPlan { view, settings }: &ViewPlan) -> ViewPlan {
    let outputs = OutputSet { id: true, ..OutputSet::NONE };
    ViewPlan { view: view.clone(), settings: Settings { samples: 1, outputs, ..*settings } }
}

/// From camera axes, X right, Y down, Z forward, to the scene's coordinates, whose `origin` the world's count from.
pub(super) fn world_from_camera(view: &View, origin: DVec3) -> DAffine3 {
    let Affine3A { matrix3, translation } = view.world_from_view;
    DAffine3 {
        matrix3: Mat3::from(matrix3).as_dmat3() * ENTITY_FROM_CAMERA,
        translation: translation.as_dvec3() + origin,
    }
}

/// What a camera gives of what its view drew, and what each pixel shows.
pub(super) fn capture(
    sensor: &CameraSensor,
    view: &View,
    drawn: &Outputs,
    labels: &mut LabelTable,
    world: &World,
) -> (CameraCapture, Vec<Labels>) {
    let (width, height) = sensor.size;
    let has = |output| sensor.outputs.has(output);
    let intrinsics = sensor.intrinsics();
    let depth = drawn.depths();
    let mut capture = CameraCapture { width, height, intrinsics, ..CameraCapture::default() };
    if let Some(picture) = drawn.picture.as_ref().filter(|_| has(CameraOutput::Color)) {
        capture.color = picture.pixels().map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
    }
    if has(CameraOutput::Linear) {
        capture.linear = drawn.linear().into_iter().map(|[r, g, b, _]| [r, g, b]).collect();
    }
    // Flow goes by it, too.
    if sensor.outputs.has_any(&[CameraOutput::Range, CameraOutput::Flow, CameraOutput::FlowBack]) {
        capture.range = ranges(&depth, width, intrinsics);
    }
    if has(CameraOutput::Normal) {
        // From world axes to X right, Y down, Z forward.
        let camera_from_world =
            Mat3::from_diagonal(Vec3::new(1.0, -1.0, -1.0)) * Mat3::from(view.world_from_view.matrix3).transpose();
        let turned = |normal: [f32; 3]| (camera_from_world * Vec3::from(normal)).normalize_or_zero().to_array();
        capture.normal = drawn.normals().into_iter().map(turned).collect();
    }
    if has(CameraOutput::Depth) {
        capture.depth = depth;
    }
    let found: Vec<Labels> = drawn.ids().map(|id| labels.labels(world, id)).collect();
    if has(CameraOutput::Instance) {
        capture.instance = found.iter().map(|labels| labels.instance).collect();
    }
    if has(CameraOutput::Part) {
        capture.part = found.iter().map(|labels| labels.part).collect();
    }
    if has(CameraOutput::Class) {
        capture.class = found.iter().map(|labels| labels.class).collect();
    }
    if has(CameraOutput::Panoptic) {
        capture.panoptic = panoptic(&found);
    }
    (capture, found)
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

/// Classes and instances in one number.
fn panoptic(found: &[Labels]) -> Vec<u32> {
    let mut of_class: BTreeMap<u8, BTreeMap<u32, u32>> = BTreeMap::new();
    for labels in found.iter().filter(|labels| labels.is_thing) {
        of_class.entry(labels.class).or_default().insert(labels.instance, 0);
    }
    for instances in of_class.values_mut() {
        (0..).zip(instances.values_mut()).for_each(|(place, own)| *own = place);
    }
    let number = |labels: &Labels| {
        let instances = of_class.get(&labels.class).filter(|_| labels.is_thing);
        let place = instances.and_then(|instances| instances.get(&labels.instance));
        place.map_or(labels.class.into(), |place| u32::from(labels.class) * 1000 + place)
    };
    found.iter().map(number).collect()
}
