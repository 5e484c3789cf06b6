//! Shadows that were found by rays: which lights the surfaces of each pixel see. For measuring what the renderer makes
//! of shadows; a view that is drawn with them has other pipelines, and others cost nothing for it.
//!
//! `shaders/traced_shadows.wgsl` reads them as words:
//!
//! ```text
//! word 0     pixels in a row
//! words 1…   of each pixel, rows from the top, the word at which its surfaces begin; 0 where it has none
//! surface    slot of the object · how many words of shares follow, and ANOTHER_SURFACE if the pixel has more surfaces
//!            shares: byte n mod 4 of word n / 4 is how much is seen of light n of the object, in parts of 255
//! ```
//!
//! An object without a surface at a pixel has no shadows there.

use crate::renderer::gpu::device::Gpu;
use crate::renderer::gpu::error::RenderError;

/// Set in the second word of a surface that another one of the pixel follows.
pub(crate) const ANOTHER_SURFACE: u32 = 1 << 31;
const SHARES: usize = size_of::<u32>();

/// A row of pixels of [`TracedShadows`].
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct TracedRow {
    /// Start of each pixel's surfaces in `words`; `None` where it has none.
    starts: Vec<Option<usize>>,
    words: Vec<u32>,
}

impl TracedRow {
    /// The next pixel: of each surface that it shows the object's slot, and how much of each of the object's lights
    /// is seen from there, in parts of 255, in the order of its list.
    pub fn push_pixel(&mut self, surfaces: &[(u32, Vec<u8>)]) {
        self.starts.push((!surfaces.is_empty()).then_some(self.words.len()));
        for (number, (slot, seen)) in surfaces.iter().enumerate() {
            let another = if number + 1 < surfaces.len() { ANOTHER_SURFACE } else { 0 };
            self.words.extend([*slot, seen.len().div_ceil(SHARES) as u32 | another]);
            let word = |seen: &[u8]| (0..).zip(seen).fold(0, |word, (at, &seen)| word | u32::from(seen) << (8 * at));
            self.words.extend(seen.chunks(SHARES).map(word));
        }
    }
}

/// Shares of each light that the surfaces of each pixel of a picture see.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct TracedShadows {
    words: Vec<u32>,
}

impl TracedShadows {
    /// Packs a picture's rows, from the top, each of as many pixels as the first.
    pub fn from_rows(rows: &[TracedRow]) -> Self {
        let pixels: usize = rows.iter().map(|row| row.starts.len()).sum();
        let surfaces: usize = rows.iter().map(|row| row.words.len()).sum();
        let mut words = Vec::with_capacity(1 + pixels + surfaces);
        words.push(rows.first().map_or(0, |row| row.starts.len()) as u32);
        let mut first = 1 + pixels;
        for row in rows {
            // No more than 32 bits can count has a buffer room for.
            words.extend(row.starts.iter().map(|start| start.map_or(0, |start| (first + start) as u32)));
            first += row.words.len();
        }
        rows.iter().for_each(|row| words.extend_from_slice(&row.words));
        Self { words }
    }

    /// Uploads them, and makes the group 3 of objects that have them.
    pub(crate) fn group(
        &self,
        Gpu { device, queue, .. }: &Gpu,
        layout: &wgpu::BindGroupLayout,
    ) -> Result<wgpu::BindGroup, RenderError> {
        let limits = device.limits();
        let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let needed = size_of_val(&self.words[..]) as u64;
        if needed > limit {
            return Err(RenderError::TooLarge { what: "the traced shadows", unit: "bytes", needed, limit });
        }
        let label = Some("traced shadows");
        // Not mapped at its creation: that panics where the device has no memory for it, or is lost.
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label,
            size: needed,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        queue.write_buffer(&buffer, 0, bytemuck::cast_slice(&self.words));
        let entries = &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }];
        Ok(device.create_bind_group(&wgpu::BindGroupDescriptor { label, layout, entries }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_those_of_the_table_above() {
        let mut rows = [TracedRow::default(), TracedRow::default()];
        rows[0].push_pixel(&[]);
        rows[0].push_pixel(&[(7, vec![255, 0, 17]), (9, vec![0, 0, 0, 0, 3])]);
        rows[1].push_pixel(&[(5, vec![])]);
        rows[1].push_pixel(&[(6, vec![0])]);
        let found = TracedShadows::from_rows(&rows);
        let surfaces = [&[7, 1 | ANOTHER_SURFACE, 0x11_00ff][..], &[9, 2, 0, 3], &[5, 0], &[6, 1, 0]].concat();
        assert_eq!(found.words, [&[2, 0, 5, 12, 14][..], &surfaces].concat());
    }
}
