//! Tables of records that shaders read, and what of them changed since the frame before: a bit per slot, read out as few
//! ranges. The renderer's copies are in `src/renderer/tables.rs`.

use crate::parallel::in_parallel;
use bevy_tasks::ComputeTaskPool;
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
        self.reach(slot, slot)[slot as usize / 64] |= 1 << (slot % 64);
    }

    /// Gets ready for marks between two slots, both included; gives a bit per slot of the table from 0 on.
    fn reach(&mut self, low: u32, high: u32) -> &mut [u64] {
        let (low, high) = (low as usize / 64, high as usize / 64 + 1);
        if high > self.words.len() {
            self.words.resize(high, 0);
        }
        (self.low, self.high) = if self.is_empty() { (low, high) } else { (self.low.min(low), self.high.max(high)) };
        &mut self.words
    }

    /// Whether no slot is marked.
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

impl<T: Pod + Default + Send> Table<T> {
    /// [`Self::write`] for many slots, none of them twice, in parallel: `record` makes that of `slots[index]`. Records
    /// differ if their bytes do.
    pub fn write_all(&mut self, slots: &[u32], record: impl Fn(usize) -> T + Sync) {
        // Each task looks for the slots in its part of the table: through all of them, unless they ascend.
        let ascend = slots.is_sorted();
        let (low, high) = if ascend { (slots.first(), slots.last()) } else { (slots.iter().min(), slots.iter().max()) };
        let Some((&low, &high)) = low.zip(high) else { return };
        if high as usize >= self.records.len() {
            self.records.resize(high as usize + 1, T::default());
        }
        let words = self.dirty.reach(low, high);
        let parts = (slots.len() / 4096).clamp(1, 2 * ComputeTaskPool::get().thread_num());
        let part = self.records.len().div_ceil(64).div_ceil(parts) * 64;
        let parts = self.records.chunks_mut(part).zip(words.chunks_mut(part / 64));
        in_parallel(parts.enumerate(), |(number, (records, words))| {
            let first = number * part;
            let before = |end: usize| slots.partition_point(|&slot| (slot as usize) < end);
            let here = if ascend { before(first)..before(first + records.len()) } else { 0..slots.len() };
            // Some are made and then compared: each by itself would be read while it is on its way to memory.
            let mut made = [(0, T::default()); TOGETHER];
            for start in here.clone().step_by(TOGETHER) {
                let mut count = 0;
                for (index, &slot) in (start..).zip(&slots[start..here.end.min(start + TOGETHER)]) {
                    let place = (slot as usize).wrapping_sub(first);
                    if place < records.len() {
                        made[count] = (place, record(index));
                        count += 1;
                    }
                }
                for (place, new) in &made[..count] {
                    if differ(&records[*place], new) {
                        records[*place] = *new;
                        words[place / 64] |= 1 << (place % 64);
                    }
                }
            }
        });
    }
}

/// Whether any bits differ. Records are made of 32-bit words; a comparison of bytes is a call.
#[inline(always)]
fn differ<T: Pod>(a: &T, b: &T) -> bool {
    const { assert!(size_of::<T>().is_multiple_of(4) && align_of::<T>() >= 4) };
    let (a, b): (&[u32], &[u32]) =
        (bytemuck::cast_slice(std::slice::from_ref(a)), bytemuck::cast_slice(std::slice::from_ref(b)));
    a.iter().zip(b).fold(0, |bits, (a, b)| bits | (a ^ b)) != 0
}

/// Records that [`Table::write_all`] makes at a time.
const TOGETHER: usize = 32;
