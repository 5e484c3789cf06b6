//! Inputs of boxes and optical flow of cameras beside their own pictures: places of everything drawn, now and when the
//! camera was due before.

use super::boxes::{Boxes, Scene};
use super::drawn_parts::{DrawnParts, Places};
use super::flow::{FlowFrame, flow};
use super::things::{OuterVertices, Thing, things};
use crate::renderer::SlotSet;
use crate::sense::camera::lens_map::LensMap;
use crate::sense::captures::camera::CameraCapture;
use crate::sense::captures::label_table::{LabelRuns, LabelTable};
use bevy_ecs::prelude::*;
use glam::DAffine3;
use std::collections::HashMap;
use std::sync::Arc;
use systems::Simulation;
use systems::ecs::clock::Clock;
use systems::sensors::{CameraOutput, CameraSensor, Sensor, SensorKind};

/// Kept from capture to capture.
#[derive(Default)]
pub(crate) struct Tracker {
    vertices: OuterVertices,
    /// Pictures of cameras, with the steps after which they were due last.
    before: HashMap<Entity, Vec<(u64, FlowFrame)>>,
}

/// Places and things of a state, for all cameras that are due.
pub(crate) struct Tracked {
    step: u64,
    step_seconds: f64,
    places: Arc<Places>,
    things: Vec<Thing>,
}

/// A camera that is due.
pub(crate) struct TrackedCamera<'a> {
    pub entity: Entity,
    pub sensor: &'a Sensor,
    pub camera: &'a CameraSensor,
    /// Map of a lens that bends.
    pub map: Option<&'a LensMap>,
    /// From camera axes, X right, Y down, Z forward, to the scene's coordinates.
    pub world_from_camera: DAffine3,
    /// Number of its jumps.
    pub jumps: u32,
    /// The number of the thing that it is on.
    pub mounted_on: Option<u32>,
}

impl Tracker {
    /// Looks at what the last frame drew, if one of the sensors asks for it.
    pub fn look<'a>(
        &mut self,
        simulation: &Simulation,
        labels: &mut LabelTable,
        due: impl Iterator<Item = &'a Sensor> + Clone,
    ) -> Option<Tracked> {
        let asks_for = |outputs: &[CameraOutput]| {
            due.clone().any(|due| matches!(&due.kind, SensorKind::Camera(camera) if camera.outputs.has_any(outputs)))
        };
        let has_boxes = asks_for(&[CameraOutput::Boxes]);
        if !has_boxes && !asks_for(&[CameraOutput::Flow, CameraOutput::FlowBack]) {
            return None;
        }
        let drawn = DrawnParts::of(simulation, labels);
        let things = if has_boxes { things(&drawn, simulation.library(), &mut self.vertices) } else { Vec::new() };
        let Clock { step, step_seconds, .. } = *simulation.world.resource::<Clock>();
        Some(Tracked { step, step_seconds, places: Arc::new(drawn.places), things })
    }

    /// Gives a camera's capture its flow, and finds its boxes, for which things are to be drawn alone yet.
    pub fn track(
        &mut self,
        tracked: &Tracked,
        camera: &TrackedCamera,
        capture: &mut CameraCapture,
        found: &LabelRuns,
    ) -> Option<Boxes> {
        let &TrackedCamera { entity, sensor, camera, map, world_from_camera, jumps, mounted_on } = camera;
        let has = |output| camera.outputs.has(output);
        let (has_flow, has_flow_back, has_boxes) =
            (has(CameraOutput::Flow), has(CameraOutput::FlowBack), has(CameraOutput::Boxes));
        if !(has_flow || has_flow_back || has_boxes) {
            return None;
        }
        let mut now = FlowFrame { world_from_camera, jumps, places: tracked.places.clone(), ..FlowFrame::default() };
        if has_flow || has_flow_back {
            now.part = found.each(|labels| labels.part);
            now.range =
                if has(CameraOutput::Range) { capture.range.clone() } else { std::mem::take(&mut capture.range) };
        }
        let kept = self.before.entry(entity).or_default();
        // The same again where it is asked again.
        kept.retain(|(step, _)| *step < tracked.step);
        let due_before = tracked.step.checked_sub(sensor.every.into());
        let before = kept.iter().find(|(step, _)| Some(*step) == due_before).map(|(_, before)| before);
        if let Some(before) = before {
            let is_alike = before.part.len() == now.part.len();
            capture.flow = if has_flow && is_alike { flow(camera, map, before, &now) } else { Default::default() };
            capture.flow_back =
                if has_flow_back && is_alike { flow(camera, map, &now, before) } else { Default::default() };
        }
        let boxes = has_boxes.then(|| {
            let seconds = f64::from(sensor.every) * tracked.step_seconds;
            let scene = Scene {
                things: &tracked.things,
                camera_from_world: world_from_camera.inverse(),
                before: before.map(|before| (&before.places.things, seconds)),
                mounted_on,
            };
            Boxes::of(camera, &scene, found)
        });
        if sensor.is_due(tracked.step) {
            kept.drain(..kept.len().saturating_sub(1));
            kept.push((tracked.step, now));
        }
        boxes
    }

    /// Forgets cameras that are no more.
    pub fn forget(&mut self, world: &World) {
        self.before.retain(|camera, _| world.get_entity(*camera).is_ok());
    }
}

impl Tracked {
    /// Slots that boxes need drawn alone, a set for each picture.
    pub fn drawn_alone(&self, boxes: &Boxes) -> Vec<Arc<SlotSet>> {
        boxes.drawn_alone(&self.things).into_iter().map(Arc::new).collect()
    }
}
