//! Frames whose ids are slots: they tell the pieces of an object apart, where ids are otherwise the object's.

use systems::draw::{FrameData, InstanceRecord};
use systems::ecs::tables::{DirtySlots, Records};

/// Lends a frame, as it is but for the entity of each record: that is its slot.
pub(crate) fn with_slot_ids<R>(frame: &mut FrameData<'_>, read: impl FnOnce(&mut FrameData<'_>) -> R) -> R {
    let instances = SlotIds(frame.instances);
    read(&mut FrameData {
        instances: &instances,
        list: frame.list,
        light_lists: frame.light_lists,
        shadows: frame.shadows,
        cells: frame.cells,
        open_portals: frame.open_portals,
        library: frame.library,
    })
}

struct SlotIds<'a>(&'a dyn Records<Record = InstanceRecord>);

impl Records for SlotIds<'_> {
    type Record = InstanceRecord;

    fn slot_count(&self) -> u32 {
        self.0.slot_count()
    }

    fn dirty(&self) -> &DirtySlots {
        self.0.dirty()
    }

    fn read<'a>(&'a self, ranges: &[std::ops::Range<u32>], room: &'a mut Vec<InstanceRecord>) -> &'a [InstanceRecord] {
        let mut own = Vec::new();
        let records = self.0.read(ranges, &mut own);
        let slots = ranges.iter().cloned().flatten();
        room.clear();
        room.extend(records.iter().zip(slots).map(|(&record, slot)| InstanceRecord { entity: slot, ..record }));
        room
    }
}
