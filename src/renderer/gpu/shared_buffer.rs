//! A buffer that many share, of elements of one size. Room that is given back is used again; where that leaves gaps
//! that are too small, or half of the buffer unused, what lies in it moves together into another one.

use super::device::Gpu;
use super::error::RenderError;
use super::growing_buffer::GrowingBuffer;
use std::collections::BTreeMap;
use std::ops::Range;

/// Bytes of a buffer that is too small to become smaller.
const SMALL: u64 = 64 << 10;
/// Bytes of a run that is long enough to be written.
const LONG: usize = 1 << 20;

/// A buffer, and which of its elements are in use.
#[derive(Debug)]
pub(crate) struct SharedBuffer {
    buffer: GrowingBuffer,
    /// Bytes of an element: a multiple of four.
    size: u64,
    places: Places,
}

/// Elements on their way into a shared buffer, one behind the other. They are written together: a write of its own for
/// each of thousands of meshes takes longer than what it writes, most of all under validation layers.
#[derive(Debug)]
pub(crate) struct Run<T> {
    first: u64,
    elements: Vec<T>,
}

impl<T> Default for Run<T> {
    fn default() -> Self {
        Self { first: 0, elements: Vec::new() }
    }
}

impl SharedBuffer {
    pub fn new(device: &wgpu::Device, label: &'static str, usage: wgpu::BufferUsages, size: usize) -> Self {
        Self { buffer: GrowingBuffer::new(device, label, usage), size: size as u64, places: Places::default() }
    }

    pub fn buffer(&self) -> &wgpu::Buffer {
        self.buffer.buffer()
    }

    /// Makes room for so many elements each, which are taken next, in this order. What is held may move: then the
    /// places are others, and `true`.
    pub fn make_room<'a>(
        &mut self,
        gpu: &Gpu,
        counts: impl Iterator<Item = u64> + Clone,
        held: impl Iterator<Item = &'a mut Range<u64>>,
    ) -> Result<bool, RenderError> {
        let Self { buffer, size, places, .. } = self;
        let capacity = buffer.buffer().size();
        let needed = (places.used + counts.clone().sum::<u64>()) * *size;
        let wasteful = capacity > SMALL && 2 * needed <= capacity;
        if !wasteful && places.end_with(counts) * *size <= capacity {
            return Ok(false);
        }
        if !wasteful && places.free.is_empty() {
            buffer.extend(gpu, places.end * *size, needed)?;
            return Ok(false);
        }
        let old = buffer.buffer().clone();
        if wasteful {
            buffer.resize(&gpu.device, needed + needed / 2);
        } else if needed > capacity {
            buffer.reserve(&gpu.device, needed)?;
        } else if needed + needed / 8 <= capacity || buffer.reserve(&gpu.device, capacity + 1).is_err() {
            // One that is nearly full becomes larger, as long as the device allows it: else what comes and goes would
            // have it moved again and again.
            buffer.resize(&gpu.device, capacity);
        }
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("move") });
        *places = Places::default();
        for held in held.filter(|held| !held.is_empty()) {
            let to = places.take(held.end - held.start);
            let bytes = (held.end - held.start) * *size;
            encoder.copy_buffer_to_buffer(&old, held.start * *size, buffer.buffer(), to.start * *size, bytes);
            *held = to;
        }
        gpu.queue.submit([encoder.finish()]);
        Ok(true)
    }

    /// Takes elements that there is room for.
    pub fn take(&mut self, count: u64) -> Range<u64> {
        self.places.take(count)
    }

    /// Gives elements back.
    pub fn release(&mut self, taken: Range<u64>) {
        self.places.release(taken);
    }

    /// Adds elements from one on to a run. What is in the run is written before where they do not follow it, or where
    /// it is long. Returns the bytes written.
    pub fn add<T: bytemuck::Pod>(
        &self,
        gpu: &Gpu,
        run: &mut Run<T>,
        first: u64,
        elements: impl Iterator<Item = T>,
    ) -> u64 {
        let follows = run.first + run.elements.len() as u64 == first && size_of_val(&run.elements[..]) < LONG;
        let written = if follows { 0 } else { self.write(gpu, run) };
        if run.elements.is_empty() {
            run.first = first;
        }
        run.elements.extend(elements);
        written
    }

    /// Writes what is in a run, which is empty then. Returns the bytes written.
    pub fn write<T: bytemuck::Pod>(&self, gpu: &Gpu, run: &mut Run<T>) -> u64 {
        let written = size_of_val(&run.elements[..]) as u64;
        if written > 0 {
            gpu.queue.write_buffer(self.buffer.buffer(), run.first * self.size, bytemuck::cast_slice(&run.elements));
        }
        run.elements.clear();
        written
    }
}

/// Allocator of ranges of elements.
#[derive(Clone, Debug, Default)]
struct Places {
    /// Gaps before the end, the start of each and its end; no two touch each other, and none touches the end.
    free: BTreeMap<u64, u64>,
    /// Behind the last one in use.
    end: u64,
    used: u64,
}

impl Places {
    /// The first gap that is large enough, or what follows the end.
    fn take(&mut self, count: u64) -> Range<u64> {
        self.used += count;
        let gap = self.free.iter().find(|(start, end)| *end - *start >= count).map(|(&start, &end)| start..end);
        let Some(gap) = gap.filter(|_| count > 0) else {
            self.end += count;
            return self.end - count..self.end;
        };
        self.free.remove(&gap.start);
        let taken = gap.start..gap.start + count;
        if taken.end < gap.end {
            self.free.insert(taken.end, gap.end);
        }
        taken
    }

    fn release(&mut self, taken: Range<u64>) {
        if taken.is_empty() {
            return;
        }
        self.used -= taken.end - taken.start;
        let mut gap = taken;
        if let Some(end) = self.free.remove(&gap.end) {
            gap.end = end;
        }
        if let Some((&start, &end)) = self.free.range(..gap.start).next_back()
            && end == gap.start
        {
            self.free.remove(&start);
            gap.start = start;
        }
        if gap.end == self.end {
            self.end = gap.start;
        } else {
            self.free.insert(gap.start, gap.end);
        }
    }

    /// Computes the end after allocations of these counts.
    fn end_with(&self, counts: impl Iterator<Item = u64>) -> u64 {
        let mut places = self.clone();
        counts.for_each(|count| _ = places.take(count));
        places.end
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
        /// Against a list of all elements, which takes the first gap by looking at each.
        #[test]
        fn the_first_gap_that_is_large_enough_is_taken(
            edits in proptest::collection::vec((any::<bool>(), 0..40usize, 1..9u64), 1..200),
        ) {
            let (mut places, mut taken, mut used) = (Places::default(), Vec::new(), vec![false; 2000]);
            for (takes, which, count) in edits {
                if takes {
                    let start = used.windows(count as usize).position(|gap| !gap.contains(&true));
                    let start = start.expect("there is room");
                    let expected = start as u64..start as u64 + count;
                    prop_assert_eq!(places.end_with([count].into_iter()), places.end.max(expected.end));
                    prop_assert_eq!(places.take(count), expected.clone());
                    used[start..start + count as usize].fill(true);
                    taken.push(expected);
                } else if !taken.is_empty() {
                    let given_back = taken.swap_remove(which % taken.len());
                    used[given_back.start as usize..given_back.end as usize].fill(false);
                    places.release(given_back);
                }
                prop_assert_eq!(places.end, used.iter().rposition(|used| *used).map_or(0, |last| last as u64 + 1));
                prop_assert_eq!(places.used, used.iter().filter(|used| **used).count() as u64);
                prop_assert_eq!(places.free.is_empty(), places.used == places.end);
            }
        }
    }
}
