//! The lights of objects that have more than three: a list for each, in pages that shaders read.
//!
//! The first three lights of an object are in its record, as ever. Where there are more, the record's word
//! `reaching_or_list` names the first page of a list, and a list has as many pages as it takes, one behind the other:
//!
//! ```text
//! word 0     how many lights reach the object
//! word 1     how many lights are listed
//! words 2…   slot · 2¹⁰ + weight · 1023 of each, as in a record
//! ```
//!
//! A list is written when its object chooses again and finds other lights, and not otherwise.

use super::selected::{SelectedLights, unpack_light};
use crate::ecs::entity_numbers::EntityNumbers;
use crate::ecs::tables::Table;
use bevy_ecs::entity::EntityIndex;
use bevy_ecs::prelude::*;
use bytemuck::{Pod, Zeroable};

/// Words of a page.
const PAGE_WORDS: usize = 8;
/// Words ahead of the lights.
const HEADER_WORDS: usize = 2;
const LISTED: u32 = LightLists::LISTED;
/// Most pages: 1 GiB.
const MOST_PAGES: usize = 1 << 25;
/// Most lights of lists that are found at once.
pub(crate) const MOST_LISTED: usize = MOST_PAGES * PAGE_WORDS;
/// Bits of a block's number that hold the logarithm of its pages.
const SIZE_BITS: u32 = 5;

/// A page of a list, or a part of one. Two texels of the tables.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Pod, Zeroable)]
pub struct LightListPage(pub [u32; PAGE_WORDS]);

/// The lists of all objects that have more than three lights.
#[derive(Resource, Clone, Debug, Default)]
pub struct LightLists {
    pages: Table<LightListPage>,
    /// The block of each object: its first page and, in the lowest bits, the logarithm of the number of its pages.
    blocks: EntityNumbers,
    /// First pages of blocks that nothing has, by the logarithm of the number of pages.
    free: Vec<Vec<u32>>,
    lists: usize,
    lights: u64,
    /// Lights for which there was no room in this frame.
    refused: u64,
}

impl LightLists {
    /// Set in a record's `reaching_or_list` where it is the first page of a list.
    pub const LISTED: u32 = 1 << 31;
    /// Most lights that can be listed.
    pub const MOST_LIGHTS: u64 = MOST_LISTED as u64;

    /// Pages as shaders read them, with marks of those that changed since the frame before.
    pub fn pages(&self) -> &Table<LightListPage> {
        &self.pages
    }

    /// Number of objects that have a list.
    pub fn len(&self) -> usize {
        self.lists
    }

    /// Tells if no object has one.
    pub fn is_empty(&self) -> bool {
        self.lists == 0
    }

    /// Number of lights in all lists, beyond the three of each object.
    pub fn lights(&self) -> u64 {
        self.lights
    }

    /// Number of lights that found no room: beyond [`Self::MOST_LIGHTS`]. Their objects have three.
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// Slots and weights of an object's lights beyond its first three, and how many lights reach it. The object is one
    /// that is drawn: one that is hidden or disabled has no list any more.
    pub fn of(&self, selected: &SelectedLights) -> (Vec<(u32, f32)>, u32) {
        let word = selected.reaching_or_list;
        if word & LISTED == 0 {
            return (Vec::new(), word);
        }
        let first = (word & !LISTED) as usize;
        let words: &[u32] = bytemuck::cast_slice(self.pages.records.get(first..).unwrap_or_default());
        let [reaching, count, lights @ ..] = words else { return (Vec::new(), 0) };
        (lights.iter().take(*count as usize).map(|&light| unpack_light(light)).collect(), *reaching)
    }

    /// Begins a frame: nothing has changed.
    pub(crate) fn begin_frame(&mut self) {
        self.pages.dirty.clear();
    }

    /// Tells if lights found no room in the frame before, and forgets them; all objects are to choose anew then.
    pub(crate) fn forget_refused(&mut self) -> bool {
        std::mem::take(&mut self.refused) > 0
    }

    /// Takes the lists that were found for some objects, task by task, and says in what was found where they are.
    pub(crate) fn take(
        &mut self,
        further: &[ListedLights],
        mut objects: impl Iterator<Item = Option<EntityIndex>>,
        found: &mut [SelectedLights],
    ) {
        let is_listed = further.iter().any(|further| !further.ends.is_empty());
        if !is_listed && self.lists == 0 {
            return;
        }
        self.refused += further.iter().map(|further| further.refused).sum::<u64>();
        if !is_listed {
            objects.flatten().for_each(|object| self.free(object));
            return;
        }
        let mut found = found.iter_mut();
        for further in further {
            let mut start = 0;
            for &end in &further.ends {
                let (Some(found), Some(object)) = (found.next(), objects.next()) else { return };
                let lights = &further.lights[start as usize..end as usize];
                start = end;
                if let Some(object) = object {
                    found.reaching_or_list = self.put(object, found.reaching_or_list, lights);
                }
            }
        }
    }

    /// Gives an object its list; returns the word of its record.
    fn put(&mut self, object: EntityIndex, reaching: u32, lights: &[u32]) -> u32 {
        let reaching = reaching & !LISTED;
        let pages = (HEADER_WORDS + lights.len()).div_ceil(PAGE_WORDS);
        let size = pages.next_power_of_two().ilog2();
        if lights.is_empty() {
            self.free(object);
            return reaching;
        }
        let Some(first) = self.block(object, size) else {
            self.refused += lights.len() as u64;
            return reaching;
        };
        let before = self.pages.records.get(first as usize).map_or(0, |page| page.0[1]);
        self.lights = self.lights - u64::from(before) + lights.len() as u64;
        let mut words = [reaching, lights.len() as u32].into_iter().chain(lights.iter().copied());
        for page in first..first + pages as u32 {
            let words = std::array::from_fn(|_| words.next().unwrap_or(0));
            self.pages.write(page, LightListPage(words));
        }
        LISTED | first
    }

    /// The first page of an object's block that has room for 2^`size` pages and no more than twice that; another one if
    /// need be. `None` where there is no room.
    fn block(&mut self, object: EntityIndex, size: u32) -> Option<u32> {
        let number = self.blocks.of_index(object);
        let held = number & ((1 << SIZE_BITS) - 1);
        if number != EntityNumbers::NONE && (held == size || held == size + 1) {
            return Some(number >> SIZE_BITS);
        }
        self.free(object);
        let freed = self.free.get_mut(size as usize).and_then(Vec::pop);
        let first = match freed {
            Some(first) => first,
            None => {
                let first = self.pages.records.len();
                let end = first + (1 << size);
                if end > MOST_PAGES {
                    return None;
                }
                self.pages.records.resize(end, LightListPage::default());
                (first as u32..end as u32).for_each(|page| self.pages.dirty.mark(page));
                first as u32
            }
        };
        self.blocks.set(object, first << SIZE_BITS | size);
        self.lists += 1;
        Some(first)
    }

    /// Takes an object's list away, if it has one.
    pub(crate) fn free(&mut self, object: EntityIndex) {
        let Some(number) = self.blocks.take_index(object) else { return };
        let (first, size) = (number >> SIZE_BITS, number & ((1 << SIZE_BITS) - 1));
        // Counts from nothing when another object has it.
        let count = std::mem::take(&mut self.pages.records[first as usize].0[1]);
        self.pages.dirty.mark(first);
        self.lights -= u64::from(count);
        self.lists -= 1;
        if self.lists == 0 {
            // Gives the memory back, too.
            *self = Self { refused: self.refused, ..Self::default() };
            return;
        }
        let size = size as usize;
        if self.free.len() <= size {
            self.free.resize_with(size + 1, Vec::new);
        }
        self.free[size].push(first);
    }
}

/// The lights that objects have beyond their three, object after object.
#[derive(Clone, PartialEq, Debug)]
pub struct ListedLights {
    /// Slots and weights, packed as the three of [`SelectedLights`].
    pub lights: Vec<u32>,
    /// End of each object's lights in the list. Empty where all have the same policy, by which none has any.
    pub ends: Vec<u32>,
    /// Number of lights that found no room.
    pub refused: u64,
    /// Room for so many.
    most: usize,
}

impl Default for ListedLights {
    fn default() -> Self {
        Self::with_room(MOST_LISTED)
    }
}

impl ListedLights {
    /// An empty list for so many lights.
    pub fn with_room(most: usize) -> Self {
        Self { lights: Vec::new(), ends: Vec::new(), refused: 0, most }
    }

    /// The same list, empty.
    pub(crate) fn clear(&mut self) {
        self.lights.clear();
        self.ends.clear();
        self.refused = 0;
    }

    #[inline]
    pub(crate) fn push(&mut self, light: u32) {
        if self.lights.len() < self.most {
            self.lights.push(light);
        } else {
            self.refused += 1;
        }
    }

    #[inline]
    pub(crate) fn end_object(&mut self) {
        self.ends.push(self.lights.len() as u32);
    }
}
