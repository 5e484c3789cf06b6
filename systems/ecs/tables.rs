//! Tables of records that shaders read, and what of them changed since the frame before: a bit per slot, read out as
//! few ranges. The renderer's copies are in `src/renderer/resources/tables.rs`.

use bytemuck::Pod;
use std::ops::Range;

/// A set of slots of a table that changed, read out as few ranges.
#[derive(Clone, Debug, Default)]
pub struct DirtySlots {
    words: Vec<u64>,
    low: usize,
    high: usize,
}

impl DirtySlots {
    /// Marks one slot.
    pub fn mark(&mut self, slot: u32) {
        let word = slot as usize / 64;
        if word >= self.words.len() {
            self.words.resize(word + 1, 0);
        }
        let both = (self.low.min(word), self.high.max(word + 1));
        (self.low, self.high) = if self.is_empty() { (word, word + 1) } else { both };
        self.words[word] |= 1 << (slot % 64);
    }

    /// Tells if a slot is marked.
    pub fn contains(&self, slot: u32) -> bool {
        self.words.get(slot as usize / 64).is_some_and(|word| word >> (slot % 64) & 1 != 0)
    }

    /// Tells if no slot is marked.
    pub fn is_empty(&self) -> bool {
        self.low >= self.high
    }

    /// Unmarks all; costs as much as the span that was marked.
    pub fn clear(&mut self) {
        if !self.is_empty() {
            self.words[self.low..self.high].fill(0);
        }
        (self.low, self.high) = (0, 0);
    }

    /// The marked slots as ranges in ascending order. Ranges with at most `gap` clean slots between them become
    /// one: a write call costs more than a few unchanged records.
    pub fn ranges(&self, gap: u32) -> Vec<Range<u32>> {
        let mut ranges: Vec<Range<u32>> = Vec::new();
        for word_index in self.low..self.high {
            let mut word = self.words[word_index];
            while word != 0 {
                let first = word.trailing_zeros();
                let run = (word >> first).trailing_ones();
                let start = word_index as u32 * 64 + first;
                match ranges.last_mut() {
                    Some(last) if start - last.end <= gap => last.end = start + run,
                    _ => ranges.push(start..start + run),
                }
                word = if first + run == 64 { 0 } else { word & (!0u64 << (first + run)) };
            }
        }
        ranges
    }
}

/// A table of records that live in the slots of a GPU buffer, with what changed since the last frame.
#[derive(Clone, Debug)]
pub struct Table<T> {
    /// One per slot.
    pub records: Vec<T>,
    /// Slots written since the frame before this one.
    pub dirty: DirtySlots,
}

impl<T> Default for Table<T> {
    fn default() -> Self {
        Self { records: Vec::new(), dirty: DirtySlots::default() }
    }
}

impl<T: Copy + PartialEq + Default> Table<T> {
    /// Writes a record, growing the table as needed; marks it only if it differs from what is there.
    pub fn write(&mut self, slot: u32, record: T) {
        let index = slot as usize;
        if index >= self.records.len() {
            self.records.resize(index + 1, T::default());
        } else if self.records[index] == record {
            return;
        }
        self.records[index] = record;
        self.dirty.mark(slot);
    }
}

/// Source of a GPU buffer or texture: records by slot, and which of them changed.
pub trait Records {
    /// Record in the layout that shaders read.
    type Record: Pod;

    /// Slots.
    fn slot_count(&self) -> u32;

    /// Slots written since the frame before this one.
    fn dirty(&self) -> &DirtySlots;

    /// The records in ranges of slots, one after another; those that lie nowhere as they are wanted are put in `room`,
    /// which grows as needed.
    ///
    /// # Panics
    /// If a range goes beyond [`Self::slot_count`].
    fn read<'a>(&'a self, ranges: &[Range<u32>], room: &'a mut Vec<Self::Record>) -> &'a [Self::Record];
}

impl<T: Pod> Records for Table<T> {
    type Record = T;

    fn slot_count(&self) -> u32 {
        self.records.len() as u32
    }

    fn dirty(&self) -> &DirtySlots {
        &self.dirty
    }

    fn read<'a>(&'a self, ranges: &[Range<u32>], room: &'a mut Vec<T>) -> &'a [T] {
        let records = |range: &Range<u32>| &self.records[range.start as usize..range.end as usize];
        if let [range] = ranges {
            return records(range);
        }
        room.clear();
        ranges.iter().for_each(|range| room.extend_from_slice(records(range)));
        room
    }
}
