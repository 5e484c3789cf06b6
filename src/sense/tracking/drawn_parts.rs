//! Places of everything that is drawn after a step, by its numbers in outputs.

use crate::sense::captures::label_table::{LabelTable, Labels};
use crate::sense::captures::pose::Pose;
use crate::sense::motion::place::{Place, jumps};
use bevy_ecs::entity::EntityIndex;
use glam::{DAffine3, DMat3, DVec3};
use std::collections::BTreeMap;
use systems::Simulation;
use systems::assets::MeshId;
use systems::draw::InstanceRecord;
use systems::ecs::tables::Records;
use systems::space::GlobalTransform;
use systems::space::origin::Origin;

/// All that the last frame drew.
#[derive(Default)]
pub(super) struct DrawnParts {
    /// In drawing order.
    pub parts: Vec<Part>,
    pub places: Places,
}

/// Drawing from one slot.
pub(super) struct Part {
    pub slot: u32,
    pub mesh: MeshId,
    pub labels: Labels,
    /// To the scene's coordinates.
    pub world_from_object: DAffine3,
}

/// Places after a step, in the scene's coordinates.
#[derive(Default)]
pub(super) struct Places {
    /// Places of drawn entities, by their numbers: `part`.
    pub parts: BTreeMap<u32, PartPlace>,
    /// Places of things, by their numbers: `instance`.
    pub things: BTreeMap<u32, Place>,
}

/// Place of a drawn entity, and the number of its jumps until then.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct PartPlace {
    pub world_from_object: DAffine3,
    /// [`jumps`].
    pub jumps: u32,
}

impl DrawnParts {
    /// Those of the world's last frame.
    pub fn of(simulation: &Simulation, labels: &mut LabelTable) -> Self {
        let (world, records) = (&simulation.world, simulation.instance_records());
        let origin = world.resource::<Origin>().0;
        let mut room = Vec::new();
        let records = records.read(std::slice::from_ref(&(0..records.slot_count())), &mut room);
        let mut drawn = Self::default();
        for (slot, key) in simulation.draw_list().drawn() {
            let record = &records[slot as usize];
            let labels = labels.labels(world, record.entity.wrapping_add(1));
            let world_from_object = affine(record, origin);
            drawn.parts.push(Part { slot, mesh: key.mesh, labels, world_from_object });
            let entity = EntityIndex::from_raw_u32(record.entity);
            let jumps_of = |index| jumps(world, world.entities().resolve_from_index(index));
            let jumped = entity.map_or(0, jumps_of);
            drawn.places.parts.insert(labels.part, PartPlace { world_from_object, jumps: jumped });
            if let Some(thing) = labels.thing
                && let Some(place) = world.get::<GlobalTransform>(thing)
            {
                let place = || Place { pose: Pose::of(place).moved(origin), jumps: jumps(world, thing) };
                drawn.places.things.entry(labels.instance).or_insert_with(place);
            }
        }
        drawn
    }
}

/// A record's place, when the world's coordinates count from there.
fn affine(record: &InstanceRecord, origin: DVec3) -> DAffine3 {
    let rows = record.world_from_object;
    let matrix3 = DMat3::from_cols_array_2d(&rows.map(|[x, y, z, _]| [x, y, z].map(f64::from))).transpose();
    DAffine3 { matrix3, translation: DVec3::from(rows.map(|row| row[3].into())) + origin }
}
