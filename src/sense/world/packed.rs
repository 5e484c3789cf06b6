//! Pictures of the same camera of several worlds that stay on the device, as arrays in a buffer that the caller has.

use super::drawing::{Captured, Drawing, Wanted};
use crate::renderer::{PackedArray, PackedLabels, PackedLayout, Packing, ReadFrame, RenderError, Settings, ViewPlan};
use crate::sense::camera::capture::CameraPlan;
use crate::sense::camera::develop::is_developed;
use crate::sense::captures::label_table::LabelTable;
use bevy_ecs::prelude::*;
use systems::Simulation;
use systems::assets::MeshId;
use systems::draw::pieces::PieceOf;
use systems::ecs::parallel::map_in_parallel;
use systems::sensors::{CameraOutput, CameraSensor, SensorKind};

/// Outputs that are packed, and how.
const PACKED: [(CameraOutput, PackedArray); 5] = [
    (CameraOutput::Color, PackedArray::Color),
    (CameraOutput::Depth, PackedArray::Depth),
    (CameraOutput::Instance, PackedArray::Instance),
    (CameraOutput::Part, PackedArray::Part),
    (CameraOutput::Class, PackedArray::Class),
];

/// Plan of a camera of each of several worlds, as [`Drawing::pack`] draws it.
pub struct PackPlan {
    layout: PackedLayout,
    views: Vec<ViewPlan>,
    labels: Vec<Vec<PackedLabels>>,
    scale: Vec<f32>,
}

impl PackPlan {
    /// Places of the arrays: those of the camera's outputs, in the order of [`PackedArray`].
    pub fn layout(&self) -> &PackedLayout {
        &self.layout
    }
}

impl Drawing {
    /// Plans a capture of a camera of each of several worlds into arrays on the device, and brings these worlds up to
    /// date. Each is to [look at](Wanted::Look) one camera. `scale`: that of [`PackedArray::DepthSteps`], which there
    /// are of cameras with depth where it has steps.
    ///
    /// # Errors
    /// [`RenderError::View`] of a camera whose picture is made on the CPU, that has outputs other than those of
    /// [`PackedArray`], or differs from that of the first world in size or outputs.
    pub fn plan_pack(
        &mut self,
        settings: &Settings,
        worlds: &mut [Captured<'_>],
        scale: Vec<f32>,
    ) -> Result<PackPlan, RenderError> {
        // Several worlds at a time; they are drawn together.
        let planned = map_in_parallel(worlds.iter_mut(), |(simulation, sensors, wanted)| -> Result<_, RenderError> {
            let Wanted::Look(looked_at) = wanted else { return Ok(None) };
            let due = sensors.looked_at(simulation, |sensor| looked_at.contains(&sensor));
            let [due] = &due[..] else { return Ok(None) };
            let (SensorKind::Camera(camera), Some(plan)) = (&due.sensor.kind, sensors.plan_of(settings, due)?) else {
                return Ok(None);
            };
            let arrays = arrays(camera, &plan).map_err(|reason| refused(&due.name, reason))?;
            let labels = if camera.outputs.has_any(&LABELS) { labels(simulation) } else { Vec::new() };
            Ok(Some(View { name: due.name.clone(), plan: plan.views(), arrays, labels }))
        });
        let layout = PackedLayout::new((0, 0), 0, []);
        let mut plan = PackPlan { layout, views: Vec::new(), labels: Vec::new(), scale: Vec::new() };
        let mut first = None;
        for (i, planned) in planned.into_iter().enumerate() {
            let none = || refused("", format!("world {i}: expected one camera"));
            let View { name, plan: views, arrays, labels } = planned?.ok_or_else(none)?;
            let kind = (views.first().map(ViewPlan::size), arrays);
            if *first.get_or_insert_with(|| kind.clone()) != kind {
                let reason = format!("world {i}: expected a camera of the size and outputs of that of world 0");
                return Err(refused(&name, reason));
            }
            plan.views.extend(views);
            plan.labels.push(labels);
        }
        if let Some((size, mut arrays)) = first {
            if !scale.is_empty() && arrays.contains(&PackedArray::Depth) {
                arrays.push(PackedArray::DepthSteps);
            }
            plan.layout = PackedLayout::new(size.unwrap_or_default(), plan.views.len(), arrays);
            plan.scale = scale;
        }
        Ok(plan)
    }

    /// Draws what was planned, and writes it into a storage buffer of at least [`PackedLayout::bytes`] of this
    /// device. Waits until it is there. The arrays hold what [`Self::capture`] gives.
    ///
    /// # Errors
    /// [`RenderError`].
    pub fn pack(
        &mut self,
        worlds: &mut [Captured<'_>],
        plan: &PackPlan,
        target: &wgpu::Buffer,
    ) -> Result<(), RenderError> {
        let (renderer, batches) = self.renderer()?;
        let packing = Packing { layout: &plan.layout, target, labels: &plan.labels, scale: &plan.scale };
        let mut lend = |world: usize, read: &mut ReadFrame<'_>| worlds[world].0.with_frame(|frame| read(frame));
        renderer.pack_worlds(batches, &plan.views, &mut lend, &packing)
    }
}

/// A camera of a world as it is packed.
struct View {
    name: String,
    plan: Vec<ViewPlan>,
    arrays: Vec<PackedArray>,
    labels: Vec<PackedLabels>,
}

/// Outputs that go by the entities of pixels.
const LABELS: [CameraOutput; 3] = [CameraOutput::Instance, CameraOutput::Part, CameraOutput::Class];

fn refused(name: &str, reason: String) -> RenderError {
    RenderError::View { view: format!("sensor {name:?}"), reason }
}

/// The arrays of a camera; an error tells why it has none.
fn arrays(camera: &CameraSensor, plan: &CameraPlan) -> Result<Vec<PackedArray>, String> {
    if plan.map().is_some() || is_developed(camera) {
        return Err(
            "pictures of lenses with distortion, of noise and of an exposure of their own are made by the CPU; \
                    expected none of these for arrays on the device"
                .into(),
        );
    }
    let other = camera.outputs.iter().find(|(_, output)| PACKED.iter().all(|(packed, _)| packed != output));
    if let Some((name, _)) = other {
        let known = CameraOutput::ALL.iter().filter(|(_, output)| PACKED.iter().any(|(packed, _)| packed == output));
        let known = known.map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
        return Err(format!("no array on the device for output {name:?}; expected some of: {known}"));
    }
    Ok(PACKED.into_iter().filter(|(output, _)| camera.outputs.has(*output)).map(|(_, array)| array).collect())
}

/// Labels of all that is drawn, by entity index plus 1.
fn labels(simulation: &Simulation) -> Vec<PackedLabels> {
    let world = &simulation.world;
    let mut rows = vec![PackedLabels::default()];
    let Some(drawn) = world.try_query_filtered::<(Entity, Option<&PieceOf>), With<MeshId>>() else { return rows };
    let mut table = LabelTable::default();
    table.begin();
    for (entity, piece) in drawn.query_manual(world).iter() {
        // Outputs name the object that a piece is of.
        let index = piece.map_or(entity, |piece| piece.0).index_u32();
        let row = index as usize + 1;
        if rows.len() <= row {
            rows.resize(row + 1, PackedLabels::default());
        }
        let labels = table.labels(world, index + 1);
        rows[row] =
            PackedLabels { instance: labels.instance, part: labels.part, class: labels.class.into(), unused: 0 };
    }
    rows
}
