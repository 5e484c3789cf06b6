//! The texture that mirrors the tables of the draw list. It takes only what changed.

use super::scatter::{MANY_RANGES, Place, Scatter, ScatterBuffers};
use crate::renderer::gpu::device::Gpu;
use crate::renderer::gpu::error::RenderError;
use crate::renderer::gpu::growing_buffer::gap;
use crate::renderer::gpu::pace::{FEW_BYTES_UNDER_WAY, Pace};
use crate::renderer::gpu::texture::{texture, whole_view};
use std::ops::Range;
use systems::draw::PAGE_SLOTS;
use systems::ecs::tables::Records;
use wgpu::util::DeviceExt;

/// Records that are read at once, at the most. So many fill whole rows of a table, whatever their size.
const READ_TOGETHER: u32 = 4 * TABLE_WIDTH as u32;

/// The tables, in the order in which they lie in their texture.
#[derive(Clone, Copy, Debug)]
pub(crate) enum TableKind {
    Instances,
    Lights,
    Materials,
    LightLists,
    ShadowRecords,
}

/// Number of [`TableKind`]s.
pub(crate) const TABLE_COUNT: usize = 5;
/// Rows of each table at least; only worlds whose lights cast shadows have shadow records.
const LEAST_ROWS: [u32; TABLE_COUNT] = [1, 1, 1, 1, 0];
/// Texels between the shadow records of one view and those of the next: as many as there are at most, or more.
pub(crate) const SHADOW_RECORDS: u64 = 288;

/// The tables in one texture of four 32-bit values per texel, as shaders/types.wgsl reads it: each has whole rows, and
/// record r lies r times its size behind its table's first texel, row after row.
#[derive(Debug)]
pub(crate) struct TableTexture {
    texture: wgpu::Texture,
    /// For bind groups.
    pub view: wgpu::TextureView,
    rows: [u32; TABLE_COUNT],
    /// The first texel of each table, for bind groups: `TableStarts` of shaders/types.wgsl.
    pub starts: wgpu::Buffer,
    /// Changes whenever `texture` is another one: bind groups are made anew.
    pub version: u32,
}

/// Uploader of one table of records into its part of the texture.
#[derive(Debug)]
pub(crate) struct RecordTable<T> {
    kind: TableKind,
    pub scattered: ScatterBuffers,
    /// For records that are made when they are read.
    room: Vec<T>,
}

/// Texels in a row of the tables; `TABLE_WIDTH` of shaders/types.wgsl.
pub(crate) const TABLE_WIDTH: u64 = 4096;
const TEXEL_BYTES: u64 = 16;
/// Uploads of what changed are so after this many: in every frame, calls cost more than memory.
const MOST_BYTES_UNDER_WAY: u64 = 12 << 20;

impl TableTexture {
    pub fn new(device: &wgpu::Device) -> Self {
        Self::with_rows(device, LEAST_ROWS, 0)
    }

    fn with_rows(device: &wgpu::Device, rows: [u32; TABLE_COUNT], version: u32) -> Self {
        use wgpu::TextureUsages;
        let usage = TextureUsages::STORAGE_BINDING | TextureUsages::COPY_DST | TextureUsages::COPY_SRC;
        let size = (TABLE_WIDTH as u32, rows.iter().sum());
        let texture = texture(device, "tables", size, wgpu::TextureFormat::Rgba32Uint, 1, usage);
        let view = whole_view(&texture, "tables");
        let starts = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("starts of tables"),
            contents: bytemuck::cast_slice(&first_rows(rows).map(|row| row * TABLE_WIDTH as u32)[..4]),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        Self { texture, view, rows, starts, version }
    }

    /// Makes room for that many texels in each table. What they hold moves along.
    pub fn reserve(&mut self, gpu: &Gpu, texels: [u64; TABLE_COUNT]) -> Result<(), RenderError> {
        let rows = |table: usize| texels[table].div_ceil(TABLE_WIDTH).max(u64::from(LEAST_ROWS[table]));
        let needed: [u64; TABLE_COUNT] = std::array::from_fn(rows);
        let most = u64::from(gpu.device.limits().max_texture_dimension_2d);
        let sum = needed.iter().sum::<u64>();
        if sum > most {
            let [needed, limit] = [sum, most].map(|rows| rows * TABLE_WIDTH * TEXEL_BYTES);
            let what = "the tables of objects, lights, materials and lists of lights";
            return Err(RenderError::TooLarge { what, unit: "bytes", needed, limit });
        }
        let needed = needed.map(|rows| rows as u32);
        if needed.iter().zip(self.rows).all(|(&needed, rows)| needed <= rows) {
            return Ok(());
        }
        let rows = grown_rows(self.rows, needed, self.version == 0, most as u32);
        let larger = Self::with_rows(&gpu.device, rows, self.version + 1);
        self.copy_into(gpu, &larger);
        *self = larger;
        Ok(())
    }

    fn copy_into(&self, gpu: &Gpu, larger: &Self) {
        let mut encoder =
            gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("grow tables") });
        let places = first_rows(self.rows).into_iter().zip(first_rows(larger.rows));
        let heights = self.rows.iter().zip(larger.rows).map(|(&old, new)| old.min(new));
        for ((from, to), height) in places.zip(heights) {
            let place = |texture, y| wgpu::TexelCopyTextureInfo {
                texture,
                mip_level: 0,
                origin: wgpu::Origin3d { x: 0, y, z: 0 },
                aspect: wgpu::TextureAspect::All,
            };
            let size = wgpu::Extent3d { width: TABLE_WIDTH as u32, height, depth_or_array_layers: 1 };
            let (from, to) = (place(&self.texture, from), place(&larger.texture, to));
            encoder.copy_texture_to_texture(from, to, size);
        }
        gpu.queue.submit([encoder.finish()]);
    }

    /// The first texel of a table.
    pub fn start(&self, kind: TableKind) -> u64 {
        u64::from(first_rows(self.rows)[kind as usize]) * TABLE_WIDTH
    }

    /// Writes the records of a view's shadow layers. Returns the bytes written.
    pub fn write_shadow_records(&self, gpu: &Gpu, view: u64, records: &[[u32; 4]]) -> u64 {
        let first = self.start(TableKind::ShadowRecords) + view * SHADOW_RECORDS;
        let bytes = bytemuck::cast_slice(records);
        self.write(gpu, &mut Pace::new(MOST_BYTES_UNDER_WAY), first, bytes);
        bytes.len() as u64
    }

    /// Writes texels from one on: the rest of its row, whole rows, and the beginning of the last.
    fn write(&self, gpu: &Gpu, pace: &mut Pace, mut texel: u64, mut bytes: &[u8]) {
        while !bytes.is_empty() {
            let column = texel % TABLE_WIDTH;
            let texels = bytes.len() as u64 / TEXEL_BYTES;
            let whole_rows = (texels / TABLE_WIDTH).min(pace.most / (TABLE_WIDTH * TEXEL_BYTES));
            let (width, height) = if column == 0 && whole_rows > 0 {
                (TABLE_WIDTH, whole_rows)
            } else {
                (texels.min(TABLE_WIDTH - column), 1)
            };
            let (here, rest) = bytes.split_at((width * height * TEXEL_BYTES) as usize);
            self.write_rows(&gpu.queue, [column, texel / TABLE_WIDTH], [width, height], here);
            pace.handed_in(gpu, here.len() as u64);
            (texel, bytes) = (texel + width * height, rest);
        }
    }

    fn write_rows(&self, queue: &wgpu::Queue, [x, y]: [u64; 2], [width, height]: [u64; 2], bytes: &[u8]) {
        let destination = wgpu::TexelCopyTextureInfo {
            texture: &self.texture,
            mip_level: 0,
            origin: wgpu::Origin3d { x: x as u32, y: y as u32, z: 0 },
            aspect: wgpu::TextureAspect::All,
        };
        let bytes_per_row = Some((width * TEXEL_BYTES) as u32);
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row, rows_per_image: None };
        let size = wgpu::Extent3d { width: width as u32, height: height as u32, depth_or_array_layers: 1 };
        queue.write_texture(destination, bytes, layout, size);
    }
}

/// First row of each table, for tables of that many rows.
fn first_rows(rows: [u32; TABLE_COUNT]) -> [u32; TABLE_COUNT] {
    let mut first = 0;
    rows.map(|rows| {
        first += rows;
        first - rows
    })
}

/// The rows of tables that had `rows` and need more. What is not used is resident on an adapter in main memory: at
/// `first` there is no more than what is needed, then a quarter more than before, at the most; and no more than `most`
/// in all while what is `needed` fits.
fn grown_rows(rows: [u32; TABLE_COUNT], needed: [u32; TABLE_COUNT], first: bool, most: u32) -> [u32; TABLE_COUNT] {
    let grown = |table: usize| {
        let needed = needed[table];
        let step = if first { 1 } else { (needed.next_power_of_two() / 8).max(1) };
        if needed > rows[table] { needed.next_multiple_of(step) } else { rows[table] }
    };
    let grown = std::array::from_fn(grown);
    if grown.iter().sum::<u32>() <= most { grown } else { needed }
}

impl<T: bytemuck::Pod> RecordTable<T> {
    pub fn new(device: &wgpu::Device, kind: TableKind) -> Self {
        Self { kind, scattered: ScatterBuffers::new(device), room: Vec::new() }
    }

    /// Texels that the records take. Whole pages: culling looks at the slots behind the last one in use, too, and new
    /// texels are zero.
    pub fn texels(records: &(impl Records<Record = T> + ?Sized)) -> u64 {
        u64::from(records.slot_count().next_multiple_of(PAGE_SLOTS)) * size_of::<T>() as u64 / TEXEL_BYTES
    }

    /// Brings the texture, which has room for them, up to date with the records: all of them if `everything` is asked
    /// for, else the dirty ones. Returns the bytes written.
    pub fn mirror(
        &mut self,
        gpu: &Gpu,
        scatter: &mut Scatter,
        texture: &TableTexture,
        records: &(impl Records<Record = T> + ?Sized),
        everything: bool,
    ) -> Result<u64, RenderError> {
        if everything {
            let (mut pace, all) = (Pace::new(FEW_BYTES_UNDER_WAY), 0..records.slot_count());
            return Ok(self.write_range(gpu, &mut pace, texture, records, all));
        }
        let size = size_of::<T>();
        let ranges = records.dirty().ranges(gap(size));
        // Each record by itself: what lies between costs as much as they do.
        let apart = if ranges.len() >= MANY_RANGES { records.dirty().ranges(0) } else { Vec::new() };
        let bytes_apart = apart.iter().map(|range| range.len() * size).sum::<usize>() as u64;
        if (1..=MOST_BYTES_UNDER_WAY).contains(&bytes_apart) {
            let place = Place { texture: &texture.view, start: texture.start(self.kind) as u32 };
            return self.scattered.write(gpu, scatter, place, records, &apart, &mut self.room);
        }
        let mut pace = Pace::new(MOST_BYTES_UNDER_WAY);
        Ok(ranges.into_iter().map(|range| self.write_range(gpu, &mut pace, texture, records, range)).sum())
    }

    /// Writes the records of some slots, a few at a time: they may be made just for this. Returns the bytes written.
    fn write_range(
        &mut self,
        gpu: &Gpu,
        pace: &mut Pace,
        texture: &TableTexture,
        records: &(impl Records<Record = T> + ?Sized),
        slots: Range<u32>,
    ) -> u64 {
        let size = size_of::<T>();
        let mut room = std::mem::take(&mut self.room);
        let mut start = slots.start;
        while start < slots.end {
            let end = slots.end.min((start + 1).next_multiple_of(READ_TOGETHER));
            let bytes = bytemuck::cast_slice(records.read(std::slice::from_ref(&(start..end)), &mut room));
            let texel = texture.start(self.kind) + u64::from(start) * size as u64 / TEXEL_BYTES;
            texture.write(gpu, pace, texel, bytes);
            start = end;
        }
        self.room = room;
        (slots.len() * size) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_grow_by_themselves_and_give_up_room_where_there_is_no_more() {
        let grown = |rows, needed, first, most| grown_rows(rows, needed, first, most);
        assert_eq!(
            grown([1, 1, 1, 1, 0], [100, 3, 1, 1, 0], true, 4096),
            [100, 3, 1, 1, 0],
            "at first no more than needed"
        );
        assert_eq!(
            grown([100, 3, 1, 1, 0], [101, 2, 1, 1, 0], false, 4096),
            [112, 3, 1, 1, 0],
            "steps of an eighth of 128"
        );
        assert_eq!(grown([112, 3, 1, 1, 0], [101, 4, 1, 1, 1], false, 4096), [112, 4, 1, 1, 1]);
        assert_eq!(
            grown([112, 20, 1, 1, 0], [113, 2, 1, 1, 0], false, 130),
            [113, 2, 1, 1, 0],
            "128, 20, 1 and 1 are too many"
        );
        assert_eq!(first_rows([112, 4, 1, 7, 0]), [0, 112, 116, 117, 124]);
    }
}
