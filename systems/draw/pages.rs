//! Allocation of instance slots: pages of 64, each of one batch.
//!
//! An object takes the lowest free slot in the first page of its batch that has room, and keeps it until it dies or
//! changes its batch. As no page mixes batches, a draw is a list of pages: objects come, go and change without
//! anything being sorted, and that list changes only when a page is begun or given up.

use super::list::{BatchKey, PAGE_SLOTS};
use std::collections::{BTreeMap, BTreeSet};

#[derive(Debug)]
struct Page {
    key: BatchKey,
    /// One bit per slot.
    used: u64,
}

/// The pages of one batch, all of them and those with room.
#[derive(Debug, Default)]
struct Pages {
    all: BTreeSet<u32>,
    roomy: BTreeSet<u32>,
}

/// Gives out slots.
#[derive(Debug, Default)]
pub(crate) struct SlotPages {
    pages: Vec<Page>,
    batches: BTreeMap<BatchKey, Pages>,
    /// Pages of no batch.
    free: BTreeSet<u32>,
    used_slots: u32,
    changed: bool,
}

impl SlotPages {
    /// Takes a slot for an object of that batch.
    pub fn take(&mut self, key: BatchKey) -> u32 {
        let batch = self.batches.entry(key).or_default();
        let number = batch.roomy.first().copied().unwrap_or_else(|| {
            self.changed = true;
            let page = Page { key, used: 0 };
            let number = self.free.pop_first().unwrap_or(self.pages.len() as u32);
            match self.pages.get_mut(number as usize) {
                Some(given_up) => *given_up = page,
                None => self.pages.push(page),
            }
            batch.all.insert(number);
            batch.roomy.insert(number);
            number
        });
        let page = &mut self.pages[number as usize];
        let place = page.used.trailing_ones();
        page.used |= 1 << place;
        if page.used == u64::MAX {
            batch.roomy.remove(&number);
        }
        self.used_slots += 1;
        number * PAGE_SLOTS + place
    }

    /// Gives a slot back.
    pub fn release(&mut self, slot: u32) {
        let (number, place) = (slot / PAGE_SLOTS, slot % PAGE_SLOTS);
        let page = &mut self.pages[number as usize];
        page.used &= !(1 << place);
        self.used_slots -= 1;
        let Some(batch) = self.batches.get_mut(&page.key) else { return };
        if page.used != 0 {
            batch.roomy.insert(number);
            return;
        }
        batch.all.remove(&number);
        batch.roomy.remove(&number);
        self.free.insert(number);
        self.changed = true;
        if batch.all.is_empty() {
            self.batches.remove(&page.key);
        }
    }

    /// The batch of a slot in use.
    pub fn key(&self, slot: u32) -> BatchKey {
        self.pages[(slot / PAGE_SLOTS) as usize].key
    }

    /// Slots in use.
    pub fn used_slots(&self) -> u32 {
        self.used_slots
    }

    /// Batches in the order of their keys, each with its pages in ascending order.
    pub fn batches(&self) -> impl Iterator<Item = (BatchKey, impl Iterator<Item = u32>)> {
        self.batches.iter().map(|(&key, pages)| (key, pages.all.iter().copied()))
    }

    /// Tells if a page was begun or given up since the last call.
    pub fn take_changed(&mut self) -> bool {
        std::mem::take(&mut self.changed)
    }
}
