//! A camera's views, and the arrays that become of what these drew.

use super::develop::{develop, is_developed};
use super::lens_map::LensMap;
use super::pixels::{Pixels, WITH_DEPTH, WITH_RANGE};
use crate::renderer::{OutputSet, Outputs, Settings, ViewPlan};
use crate::sense::captures::axes::ENTITY_FROM_CAMERA;
use crate::sense::captures::camera::CameraCapture;
use crate::sense::captures::label_table::{LabelRuns, LabelTable, Labels};
use bevy_ecs::prelude::*;
use glam::{Affine3A, DAffine3, DVec3, Mat3, Vec3};
use std::collections::BTreeMap;
use std::sync::Arc;
use systems::draw::{DrawList, Environment, View};
use systems::sensors::philox::Noise;
use systems::sensors::{CameraOutput, CameraSensor};

/// Plan of a camera's views.
pub(crate) struct CameraPlan {
    /// View of its picture; of a lens that bends, as if it did not.
    whole: ViewPlan,
    /// Map of a lens that bends.
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
        use CameraOutput::{Boxes, Class, Color, Flow, FlowBack, Instance, Linear, Normal, Panoptic, Part};
        let color = sensor.outputs.has(Color);
        let outputs = OutputSet {
            color: color && !is_developed(sensor),
            linear: sensor.outputs.has(Linear) || color && is_developed(sensor),
            depth: sensor.outputs.has_any(&WITH_DEPTH),
            normal: sensor.outputs.has(Normal),
            id: sensor.outputs.has_any(&[Instance, Part, Class, Panoptic, Boxes, Flow, FlowBack]),
        };
        // What is measured is of the meshes themselves, as rays meet them; levels of detail are for the eye.
        let settings =
            Settings { samples: sensor.samples, outputs, measures_whole: true, few_on_cpu: true, ..*settings }
                .for_files();
        Self { whole: ViewPlan { view, settings }, map }
    }

    /// The views that are drawn for it.
    pub fn views(&self) -> Vec<ViewPlan> {
        self.map.as_ref().map_or_else(|| vec![self.whole.clone()], |map| map.plans(&self.whole))
    }

    /// The same camera for things that are drawn alone, for their pixels to be counted.
    pub fn alone(&self) -> Self {
        let outputs = OutputSet { id: true, ..OutputSet::NONE };
        let ViewPlan { view, settings } = &self.whole;
        let settings = Settings { samples: 1, outputs, ..*settings };
        Self { whole: ViewPlan { view: view.clone(), settings }, map: self.map.clone() }
    }

    /// From camera axes, X right, Y down, Z forward, to the scene's coordinates, whose `origin` the world's count from.
    pub fn world_from_camera(&self, origin: DVec3) -> DAffine3 {
        let Affine3A { matrix3, translation } = self.whole.view.world_from_view;
        let matrix3 = Mat3::from(matrix3).as_dmat3() * ENTITY_FROM_CAMERA;
        DAffine3 { matrix3, translation: translation.as_dvec3() + origin }
    }

    /// Places of the pixels in what is drawn, of a lens that bends.
    pub fn map(&self) -> Option<&LensMap> {
        self.map.as_deref()
    }

    /// Entity indices plus 1 of the pixels of what its views drew.
    pub fn ids(&self, drawn: &[Outputs]) -> Vec<u32> {
        match &self.map {
            Some(map) => map.ids(drawn),
            None => drawn.iter().flat_map(Outputs::ids).collect(),
        }
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

/// Capture of a camera by what its views drew, with the noise that is its own; and labels of each pixel.
pub(crate) fn capture(
    sensor: &CameraSensor,
    (plan, drawn): (&CameraPlan, &[Outputs]),
    labels: &mut LabelTable,
    world: &World,
    noise: Noise,
) -> (CameraCapture, LabelRuns) {
    let (width, height) = sensor.size;
    let has = |output| sensor.outputs.has(output);
    let (pixels, exposure) = plan.pixels(sensor, drawn, &world.resource::<DrawList>().environment, noise);
    let (intrinsics, lens, color) = (sensor.intrinsics(), sensor.lens, pixels.color);
    let outputs = sensor.outputs;
    let mut capture =
        CameraCapture { width, height, outputs, intrinsics, lens, exposure, color, ..CameraCapture::default() };
    if has(CameraOutput::Linear) {
        capture.linear = pixels.linear;
    }
    if has(CameraOutput::Depth) {
        capture.depth = pixels.depth;
    }
    // Flow goes by it, too.
    if sensor.outputs.has_any(&WITH_RANGE) {
        capture.range = pixels.range;
    }
    if has(CameraOutput::Normal) {
        // From world axes to X right, Y down, Z forward.
        let world_from_view = Mat3::from(plan.whole.view.world_from_view.matrix3);
        let camera_from_world = Mat3::from_diagonal(Vec3::new(1.0, -1.0, -1.0)) * world_from_view.transpose();
        let turned = |normal: [f32; 3]| (camera_from_world * Vec3::from(normal)).normalize_or_zero().to_array();
        capture.normal = pixels.normal.into_iter().map(turned).collect();
    }
    let found = labels.runs(world, &pixels.id);
    if has(CameraOutput::Instance) {
        capture.instance = found.each(|labels| labels.instance);
    }
    if has(CameraOutput::Part) {
        capture.part = found.each(|labels| labels.part);
    }
    if has(CameraOutput::Class) {
        capture.class = found.each(|labels| labels.class);
    }
    if has(CameraOutput::Panoptic) {
        capture.panoptic = panoptic(&found);
    }
    (capture, found)
}

/// Classes and instances in one number.
fn panoptic(found: &LabelRuns) -> Vec<u32> {
    let mut of_class: BTreeMap<u8, BTreeMap<u32, u32>> = BTreeMap::new();
    for (labels, _) in found.0.iter().filter(|(labels, _)| labels.is_thing) {
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
    found.each(number)
}
