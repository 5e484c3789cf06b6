//! Slots for items that come and go, and the ids that name them.
//!
//! An id is 32 bits: a slot, and which item of that slot it was (the generation). The item that takes the slot of one
//! that was removed has another generation, so an id of the removed one names nothing. The lowest free slot is taken
//! first: slots stay few, and the same edits give the same ids. After 256 items a slot is not used again.
//!
//! A follower of the items keeps the number of the last change that it has seen (a revision). It asks for the slots
//! that changed since. Any number of systems and renderers can do so; where nothing changed, that is one comparison.
//!
//! A clone shares its items with what it was cloned from. One that is changed in either is copied first.

use std::collections::{BTreeMap, BTreeSet};
use std::marker::PhantomData;
use std::sync::Arc;

/// Bits of an id that are its slot; the others are its generation.
const SLOT_BITS: u32 = 24;

/// Slots of one kind of item. With 256 generations each, all ids of 32 bits.
pub const MOST_SLOTS: u32 = 1 << SLOT_BITS;

/// The bits of an id: those of generation 0 are the slot's number.
pub(crate) const fn id_bits(slot: u32, generation: u8) -> u32 {
    assert!(slot < MOST_SLOTS, "more than 16,777,216 items of one kind");
    slot | (generation as u32) << SLOT_BITS
}

/// The slot of an id.
pub(crate) const fn slot_of(bits: u32) -> u32 {
    bits & (MOST_SLOTS - 1)
}

/// The generation of an id.
pub(crate) const fn generation_of(bits: u32) -> u8 {
    (bits >> SLOT_BITS) as u8
}

/// An id of 32 bits.
pub(crate) trait SlotId: Copy + Eq {
    /// The id of those bits.
    fn from_bits(bits: u32) -> Self;
    /// Its bits.
    fn to_bits(self) -> u32;
}

/// The methods of an id, a struct of one `u32`.
macro_rules! slot_id {
    ($id:ident) => {
        impl $id {
            /// The id of the first item of a slot. A library gives ids out by itself: this is for what knows which
            /// slot it means, and for numbers that stand for items until these are in a library.
            ///
            /// # Panics
            /// If the slot is not below 2²⁴.
            pub const fn from_slot(slot: u32) -> Self {
                Self($crate::assets::slots::id_bits(slot, 0))
            }

            /// Its slot in tables. No two items that are in a library at the same time share one.
            pub const fn slot(self) -> u32 {
                $crate::assets::slots::slot_of(self.0)
            }

            /// Number of items that its slot had before.
            pub const fn generation(self) -> u8 {
                $crate::assets::slots::generation_of(self.0)
            }
        }

        impl $crate::assets::slots::SlotId for $id {
            fn from_bits(bits: u32) -> Self {
                Self(bits)
            }

            fn to_bits(self) -> u32 {
                self.0
            }
        }
    };
}
pub(crate) use slot_id;

#[derive(Clone, Debug)]
struct Slot<T> {
    item: Option<Arc<T>>,
    generation: u8,
    /// The revision in which the item was added.
    added: u64,
    /// The revision of its last change.
    changed: u64,
    /// Number of edits of the item.
    edits: u32,
}

/// Items of one kind.
#[derive(Clone, Debug)]
pub(super) struct Slots<I, T> {
    slots: Vec<Slot<T>>,
    free: BTreeSet<u32>,
    /// Slots in use.
    used: usize,
    revision: u64,
    /// The revision of the last edit or removal.
    edited: u64,
    /// The last change of each slot.
    changes: BTreeMap<u64, u32>,
    ids: PhantomData<I>,
}

impl<I, T> Default for Slots<I, T> {
    fn default() -> Self {
        Self {
            slots: Vec::new(),
            free: BTreeSet::new(),
            used: 0,
            revision: 0,
            edited: 0,
            changes: BTreeMap::new(),
            ids: PhantomData,
        }
    }
}

impl<I: SlotId, T: Clone> Slots<I, T> {
    /// Puts an item into the lowest free slot.
    ///
    /// # Panics
    /// If there are [`MOST_SLOTS`] items already.
    pub fn add(&mut self, item: T) -> I {
        let slot = self.free.pop_first().unwrap_or(self.slots.len() as u32);
        let new = Slot { item: Some(Arc::new(item)), generation: 0, added: self.revision + 1, changed: 0, edits: 0 };
        let generation = match self.slots.get_mut(slot as usize) {
            Some(free) => {
                *free = Slot { generation: free.generation, changed: free.changed, ..new };
                free.generation
            }
            None => {
                self.slots.push(new);
                0
            }
        };
        self.used += 1;
        self.touch(slot);
        I::from_bits(id_bits(slot, generation))
    }

    /// Takes an item out; its id names nothing from now on.
    pub fn remove(&mut self, id: I) -> Option<T> {
        let slot = self.find_mut(id)?;
        let item = slot.item.take();
        if let Some(next) = slot.generation.checked_add(1) {
            slot.generation = next;
            self.free.insert(slot_of(id.to_bits()));
        }
        self.used -= 1;
        self.touch(slot_of(id.to_bits()));
        self.edited = self.revision;
        item.map(Arc::unwrap_or_clone)
    }

    /// An item, to be changed.
    pub fn edit(&mut self, id: I) -> Option<&mut T> {
        self.find(id)?;
        let slot = slot_of(id.to_bits());
        self.touch(slot);
        self.edited = self.revision;
        let slot = &mut self.slots[slot as usize];
        slot.edits += 1;
        slot.item.as_mut().map(Arc::make_mut)
    }

    /// Takes back what was added since a revision, as if it had never been there. For items that nothing has seen.
    pub fn take_back(&mut self, since: u64) {
        for slot in self.changed_since(since).collect::<Vec<_>>() {
            let taken = &mut self.slots[slot as usize];
            if taken.added > since && taken.item.take().is_some() {
                self.used -= 1;
                self.free.insert(slot);
                self.touch(slot);
            }
        }
        // Slots that nothing was ever in.
        while self.slots.last().is_some_and(|last| last.item.is_none() && last.generation == 0) {
            if let Some(last) = self.slots.pop() {
                self.free.remove(&(self.slots.len() as u32));
                self.changes.remove(&last.changed);
            }
        }
    }

    /// An item.
    pub fn get(&self, id: I) -> Option<&T> {
        self.find(id)?.item.as_deref()
    }

    /// An item, to change what nothing follows.
    pub fn get_mut(&mut self, id: I) -> Option<&mut T> {
        self.find_mut(id)?.item.as_mut().map(Arc::make_mut)
    }

    /// The item in a slot now, with its id.
    pub fn in_slot(&self, slot: u32) -> Option<(I, &T)> {
        let found = self.slots.get(slot as usize)?;
        Some((I::from_bits(id_bits(slot, found.generation)), found.item.as_deref()?))
    }

    /// All items in the order of their slots.
    pub fn iter(&self) -> impl Iterator<Item = (I, &T)> + Clone {
        (0..)
            .zip(&self.slots)
            .filter_map(|(slot, found)| Some((I::from_bits(id_bits(slot, found.generation)), found.item.as_deref()?)))
    }

    /// Those for which something holds, to change what nothing follows.
    pub fn iter_mut(&mut self, holds: impl Fn(&T) -> bool) -> impl Iterator<Item = (I, &mut T)> {
        (0..).zip(&mut self.slots).filter_map(move |(slot, found)| {
            let item = found.item.as_mut().filter(|item| holds(item))?;
            Some((I::from_bits(id_bits(slot, found.generation)), Arc::make_mut(item)))
        })
    }

    /// Number of items.
    pub fn len(&self) -> usize {
        self.used
    }

    /// The number of the last change.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// The revision of the last change other than an addition.
    pub fn edited(&self) -> u64 {
        self.edited
    }

    /// The revision in which an item was added or last edited.
    pub fn revision_of(&self, id: I) -> Option<u64> {
        self.find(id).map(|slot| slot.changed)
    }

    /// Number of edits of an item.
    pub fn edits_of(&self, id: I) -> Option<u32> {
        self.find(id).map(|slot| slot.edits)
    }

    /// Slots whose item was added, edited or removed since a revision: each once, the latest last.
    pub fn changed_since(&self, revision: u64) -> impl Iterator<Item = u32> {
        self.changes.range(revision.saturating_add(1)..).map(|(_, &slot)| slot)
    }

    fn find(&self, id: I) -> Option<&Slot<T>> {
        let slot = self.slots.get(slot_of(id.to_bits()) as usize)?;
        Some(slot).filter(|slot| slot.generation == generation_of(id.to_bits()) && slot.item.is_some())
    }

    fn find_mut(&mut self, id: I) -> Option<&mut Slot<T>> {
        let slot = self.slots.get_mut(slot_of(id.to_bits()) as usize)?;
        Some(slot).filter(|slot| slot.generation == generation_of(id.to_bits()) && slot.item.is_some())
    }

    /// Notes a change of a slot.
    fn touch(&mut self, slot: u32) {
        self.revision += 1;
        self.changes.insert(self.revision, slot);
        let before = std::mem::replace(&mut self.slots[slot as usize].changed, self.revision);
        self.changes.remove(&before);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
    struct Id(u32);
    slot_id!(Id);

    #[derive(Clone, Copy, Debug)]
    enum Edit {
        Add,
        Remove(usize),
        Change(usize),
        /// Some are added, then taken back.
        AddInVain(u8),
        /// One of three readers looks at what changed.
        Read(usize),
    }

    /// Revision that was seen last, and the items by slot at that time.
    type Reader = (u64, BTreeMap<u32, (Id, u32)>);

    fn edit() -> impl Strategy<Value = Edit> {
        prop_oneof![
            3 => Just(Edit::Add),
            3 => (0..64usize).prop_map(Edit::Remove),
            2 => (0..64usize).prop_map(Edit::Change),
            1 => (0..4u8).prop_map(Edit::AddInVain),
            2 => (0..3usize).prop_map(Edit::Read),
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
        /// Against all ids that were ever given out with what they name, and readers that copy what changed.
        #[test]
        fn ids_name_what_they_were_given_for_and_readers_miss_nothing(
            edits in proptest::collection::vec(edit(), 1..300),
        ) {
            let mut slots: Slots<Id, u32> = Slots::default();
            let mut given: BTreeMap<Id, Option<u32>> = BTreeMap::new();
            let mut readers: [Reader; 3] = Default::default();
            for (value, edit) in (0..).zip(edits) {
                let nth = |i: usize| given.keys().nth(i % given.len().max(1)).copied();
                match edit {
                    Edit::Add => {
                        let id = slots.add(value);
                        prop_assert!(given.insert(id, Some(value)).is_none(), "an id twice");
                    }
                    Edit::Remove(i) => if let Some(id) = nth(i) {
                        prop_assert_eq!(slots.remove(id), given.insert(id, None).flatten());
                    },
                    Edit::Change(i) => if let Some(id) = nth(i) {
                        let found = slots.edit(id).map(|item| *item = value);
                        prop_assert_eq!(found.is_some(), given[&id].is_some());
                        given.entry(id).and_modify(|item| *item = item.map(|_| value));
                    },
                    Edit::AddInVain(count) => {
                        let before = slots.revision();
                        let vain: Vec<Id> = (0..count).map(|_| slots.add(value)).collect();
                        slots.take_back(before);
                        prop_assert!(vain.iter().all(|&id| slots.get(id).is_none()));
                        // As if they had not been: the next gets the same id.
                        if let Some(first) = vain.first() {
                            let before = slots.revision();
                            prop_assert_eq!(slots.add(value), *first);
                            slots.take_back(before);
                        }
                    }
                    Edit::Read(reader) => {
                        let (seen, copy) = &mut readers[reader];
                        for slot in slots.changed_since(*seen) {
                            match slots.in_slot(slot) {
                                Some((id, item)) => _ = copy.insert(slot, (id, *item)),
                                None => _ = copy.remove(&slot),
                            }
                        }
                        *seen = slots.revision();
                        let all: Vec<_> = slots.iter().map(|(id, item)| (id, *item)).collect();
                        prop_assert_eq!(copy.values().copied().collect::<Vec<_>>(), all);
                    }
                }
                for (&id, item) in &given {
                    prop_assert_eq!(slots.get(id), item.as_ref());
                }
                let lives: Vec<_> = given.iter().filter(|(_, item)| item.is_some()).collect();
                prop_assert_eq!(slots.len(), lives.len());
                prop_assert_eq!(slots.iter().count(), lives.len());
            }
        }
    }

    #[test]
    fn the_lowest_free_slot_is_taken_and_its_first_id_is_its_number() {
        let mut slots: Slots<Id, char> = Slots::default();
        let ids = ['a', 'b', 'c'].map(|item| slots.add(item));
        assert_eq!(ids, [Id(0), Id(1), Id(2)]);
        assert_eq!((slots.remove(ids[2]), slots.remove(ids[1]), slots.remove(ids[1])), (Some('c'), Some('b'), None));
        let next = slots.add('d');
        assert_eq!((next.slot(), next.generation(), next.0), (1, 1, 1 | 1 << 24));
        assert_eq!((slots.get(ids[1]), slots.get(next)), (None, Some(&'d')));
        assert_eq!(Id::from_slot(7), Id(7));
    }

    #[test]
    fn a_slot_whose_generations_are_used_up_is_not_used_again() {
        let mut slots: Slots<Id, u32> = Slots::default();
        let mut ids: Vec<Id> = Vec::new();
        for i in 0..600 {
            let id = slots.add(i);
            assert!(!ids.contains(&id));
            assert_eq!(id.slot(), i / 256);
            ids.push(id);
            assert_eq!(slots.remove(id), Some(i));
        }
        assert!(ids.iter().all(|&id| slots.get(id).is_none()));
        assert_eq!(slots.len(), 0);
    }
}
