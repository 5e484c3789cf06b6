//! What a camera gives: arrays of a value per pixel, rows from the top.

use super::develop::{develop, is_developed};
use super::label_table::{LabelTable, Labels};
use super::lens_map::LensMap;
use super::pixels::Pixels;
use crate::renderer::{OutputSet, Outputs, Settings, ViewPlan};
use bevy_ecs::prelude::*;
use glam::{Affine3A, Mat3, Vec3};
use half::f16;
use std::collections::BTreeMap;
use std::sync::Arc;
use systems::draw::{Environment, Intrinsics, View};
use systems::sensors::philox::Noise;
use systems::sensors::{CameraOutput, CameraSensor, Lens};

/// What a camera captured. Arrays that were not asked for are empty.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct CameraCapture {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// `None` where the projection is parallel.
    pub intrinsics: Option<Intrinsics>,
    /// With what bends its picture.
    pub lens: Lens,
    /// What linear colours were multiplied by.
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
    /// Of things class · 1000 + n, where n counts those of a class in this picture from 0 on by their numbers; of
    /// stuff its class; 0 where there is nothing: (H, W). As Cityscapes has instance ids.
    pub panoptic: Vec<u32>,
}

/// How a camera is drawn.
pub(super) struct CameraPlan {
    /// As its picture; of a lens that bends, as if it did not.
    whole: ViewPlan,
    /// Of a lens that bends.
    map: Option<Arc<LensMap>>,
}

impl CameraPlan {
    /// For a camera, which has a map if its lens bends.
    pub fn new(
        sensor: &CameraSensor,
        world_from_camera: &Affine3A,
        settings: &Settings,
        map: Option<Arc<LensMap>>,
    ) -> Self {
        let view = View::new(world_from_camera, &sensor.camera(), sensor.size.0, sensor.size.1);
        use CameraOutput::{Class, Color, Depth, Instance, Linear, Normal, Panoptic, Part, Range};
        let color = sensor.outputs.has(Color);
        let outputs = OutputSet {
            color: color && !is_developed(sensor),
            linear: sensor.outputs.has(Linear) || color && is_developed(sensor),
            depth: sensor.outputs.has_any(&[Depth, Range]),
            normal: sensor.outputs.has(Normal),
            id: sensor.outputs.has_any(&[Instance, Part, Class, Panoptic]),
        };
        let settings = Settings { samples: sensor.samples, outputs, few_on_cpu: true, ..*settings }.for_files();
        Self { whole: ViewPlan { view, settings }, map }
    }

    /// The views that are drawn for it.
    pub fn views(&self) -> Vec<ViewPlan> {
        self.map.as_ref().map_or_else(|| vec![self.whole.clone()], |map| map.plans(&self.whole))
    }

    /// The pixels of what these drew, and their exposure.
    fn pixels(
        &self,
        sensor: &CameraSensor,
        drawn: &[Outputs],
        environment: &Environment,
        noise: Noise,
    ) -> (Pixels, f32) {
        let mut pixels = match (&self.map, drawn) {
            (Some(map), _) => map.resample(sensor, drawn),
            (None, [drawn, ..]) => Pixels::of_view(sensor, drawn),
            (None, []) => Pixels::default(),
        };
        let mut exposure = environment.exposure;
        if is_developed(sensor) {
            let tone_map = self.whole.settings.debug.tone_map(environment);
            exposure = develop(&mut pixels, sensor, (exposure, tone_map), noise);
        }
        (pixels, exposure)
    }
}

/// What a camera gives of what its views drew, and the noise that is its own.
pub(super) fn capture(
    sensor: &CameraSensor,
    (plan, drawn): (&CameraPlan, &[Outputs]),
    labels: &mut LabelTable,
    world: &World,
    noise: Noise,
) -> CameraCapture {
    let (width, height) = sensor.size;
    let has = |output| sensor.outputs.has(output);
    let (pixels, exposure) = plan.pixels(sensor, drawn, world.resource::<Environment>(), noise);
    let (intrinsics, lens, color) = (sensor.intrinsics(), sensor.lens, pixels.color);
    let mut capture = CameraCapture { width, height, intrinsics, lens, exposure, color, ..CameraCapture::default() };
    if has(CameraOutput::Linear) {
        capture.linear = pixels.linear;
    }
    if has(CameraOutput::Depth) {
        capture.depth = pixels.depth;
    }
    if has(CameraOutput::Range) {
        capture.range = pixels.range;
    }
    if has(CameraOutput::Normal) {
        // From world axes to X right, Y down, Z forward.
        let world_from_view = Mat3::from(plan.whole.view.world_from_view.matrix3);
        let camera_from_world = Mat3::from_diagonal(Vec3::new(1.0, -1.0, -1.0)) * world_from_view.transpose();
        let turned = |normal: [f32; 3]| (camera_from_world * Vec3::from(normal)).normalize_or_zero().to_array();
        capture.normal = pixels.normal.into_iter().map(turned).collect();
    }
    let found: Vec<Labels> = pixels.id.into_iter().map(|id| labels.labels(world, id)).collect();
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
    capture
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
