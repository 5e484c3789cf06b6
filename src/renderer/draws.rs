//! The draws of a scene as the culling pass reads them: which pages each one looks through, and where the slots that it
//! keeps go. Made anew when batches or meshes changed, never otherwise; the same for every view.
//!
//! ```text
//! pages[p]      a page of instance slots, and its batch           for `cull` and `occlude`
//! batches[b]    what culling needs to know of the batch's mesh
//! entries[e]    a page and a draw that looks through it           for `count` and `scatter`
//! draws[d]      a batch at one level of detail: its entries, where its list of visible slots begins, and its arguments
//! arguments[a]  an indirect draw of the next slots of such a list
//! ```
//!
//! A list has as many arguments as it takes to draw it in portions, on adapters that are to be handed no more at once
//! (`portions.rs`); else one. Lists begin with what is near, and of what is far few triangles have pixels: portions
//! become larger and larger, which bounds their number.

use super::meshes::Meshes;
use super::tables::GrowingBuffer;
use super::{Gpu, RenderError};
use bytemuck::{Pod, Zeroable};
use std::ops::Range;
use systems::assets::levels::MOST_LEVELS;
use systems::draw::{BatchKey, DrawList, PAGE_SLOTS};
use systems::ecs::tables::DirtySlots;
use wgpu::util::DrawIndexedIndirectArgs;

/// Mirrors `CullBatch` of shaders/cull.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct CullBatchRecord {
    /// Of the mesh's bounding sphere, object space.
    pub center: [f32; 3],
    /// Of the mesh's bounding sphere, object space.
    pub radius: f32,
    /// Of the box around the mesh, from the same centre, object space.
    pub half_extents: [f32; 3],
    /// Room for 16-byte alignment.
    pub pad0: u32,
    /// Of each level of detail, metres in object space; beyond any measure where there is none.
    pub errors: [f32; MOST_LEVELS],
}

/// Mirrors `CullDraw` of shaders/cull.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct CullDrawRecord {
    /// Level of detail.
    pub level: u32,
    /// First of its entries.
    pub first_entry: u32,
    /// One past the last of its entries.
    pub end_entry: u32,
    /// Where its list of visible slots begins, in the early phase.
    pub first_visible: u32,
    /// First of its arguments.
    pub first_argument: u32,
    /// One past the last of its arguments.
    pub end_argument: u32,
    /// Instances of each of its first 256 arguments; the last has the rest.
    pub portion: u32,
}

/// A batch at one level of detail.
#[derive(Clone, Debug)]
pub(super) struct Draw {
    pub key: BatchKey,
    /// Its elements of [`Draws::arguments`].
    pub arguments: Range<usize>,
}

/// One indirect draw.
#[derive(Clone, Copy, Debug)]
pub(super) struct DrawArguments {
    /// What the draw reads, but for the first instance and the number of them, which culling fills in.
    pub indirect: DrawIndexedIndirectArgs,
    /// Where its slots begin in the list of visible ones, in the early phase.
    pub first_visible: u32,
    /// Instances to expect while the number is not known: all that there is room for; of a page,
    /// which may hold just one object, one.
    pub expected_instances: u32,
}

/// What changes the draws: world, version of its batches, number of meshes uploaded, levels of detail or not, triangles
/// of a portion.
pub(super) type DrawsVersion = (u64, u64, usize, bool, Option<u32>);

/// All draws of a scene.
#[derive(Debug)]
pub(super) struct Draws {
    version: DrawsVersion,
    pub list: Vec<Draw>,
    pub arguments: Vec<DrawArguments>,
    pub page_count: u32,
    pub entry_count: u32,
    /// Slots that the pages reach up to.
    pub slot_count: u32,
    pages: GrowingBuffer,
    batches: GrowingBuffer,
    entries: GrowingBuffer,
    draws: GrowingBuffer,
}

impl Draws {
    pub fn new(device: &wgpu::Device) -> Self {
        let storage = |label| GrowingBuffer::new(device, label, wgpu::BufferUsages::STORAGE);
        Self {
            version: DrawsVersion::default(),
            list: Vec::new(),
            arguments: Vec::new(),
            page_count: 0,
            entry_count: 0,
            slot_count: 0,
            pages: storage("pages of objects"),
            batches: storage("batches"),
            entries: storage("pages of draws"),
            draws: storage("draws"),
        }
    }

    /// The buffers in the order of their bindings.
    pub fn buffers(&self) -> [&GrowingBuffer; 4] {
        [&self.pages, &self.batches, &self.entries, &self.draws]
    }

    /// Whether they have levels of detail.
    pub fn with_levels(&self) -> bool {
        self.version.3
    }

    /// Tells draws from others.
    pub fn version(&self) -> DrawsVersion {
        self.version
    }

    /// Brings the draws up to date. Returns the bytes uploaded.
    pub fn update(
        &mut self,
        gpu: &Gpu,
        list: &DrawList,
        meshes: &Meshes,
        levels: bool,
        portion_triangles: Option<u32>,
    ) -> Result<u64, RenderError> {
        let version = (list.world, list.batches_version, meshes.count(), levels, portion_triangles);
        if version == self.version {
            return Ok(0);
        }
        self.list.clear();
        self.arguments.clear();
        let (mut pages, mut batches, mut entries, mut draws) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for batch in &list.batches {
            let Some(mesh) = meshes.range(batch.key.mesh) else { continue };
            let its_pages = &list.pages[batch.pages.start as usize..batch.pages.end as usize];
            pages.extend(its_pages.iter().map(|&page| [page, batches.len() as u32]));
            let its_levels = &mesh.levels[..if levels { mesh.levels.len() } else { mesh.levels.len().min(1) }];
            let mut errors = [f32::MAX; MOST_LEVELS];
            errors.iter_mut().zip(its_levels).for_each(|(error, level)| *error = level.error);
            let (center, radius) = (mesh.bounds.center.to_array(), mesh.bounds.radius);
            let half_extents = mesh.half_extents.to_array();
            batches.push(CullBatchRecord { center, radius, half_extents, pad0: 0, errors });
            for (number, level) in (0..).zip(its_levels) {
                let first_entry = entries.len() as u32;
                let first_visible = first_entry * PAGE_SLOTS;
                entries.extend(its_pages.iter().map(|&page| [page, draws.len() as u32]));
                let end_entry = entries.len() as u32;
                let most = (end_entry - first_entry) * PAGE_SLOTS;
                let portion = portion_of(portion_triangles, level.index_count / 3, most);
                let first_argument = self.arguments.len();
                for places in portions_of_list(portion, most) {
                    let first = first_visible + places.start;
                    let indirect = DrawIndexedIndirectArgs {
                        index_count: level.index_count,
                        instance_count: 0,
                        first_index: level.first_index,
                        base_vertex: mesh.base_vertex,
                        first_instance: 0,
                    };
                    let expected_instances = if its_pages.len() > 1 { places.len() as u32 } else { 1 };
                    self.arguments.push(DrawArguments { indirect, first_visible: first, expected_instances });
                }
                let arguments = first_argument..self.arguments.len();
                draws.push(CullDrawRecord {
                    level: number,
                    first_entry,
                    end_entry,
                    first_visible,
                    first_argument: arguments.start as u32,
                    end_argument: arguments.end as u32,
                    portion,
                });
                self.list.push(Draw { key: batch.key, arguments });
            }
        }
        (self.page_count, self.entry_count) = (pages.len() as u32, entries.len() as u32);
        self.slot_count = list.pages.iter().max().map_or(0, |page| (page + 1) * PAGE_SLOTS);
        let all = DirtySlots::default();
        let bytes = self.pages.write(gpu, &pages, &all, true)?
            + self.batches.write(gpu, &batches, &all, true)?
            + self.entries.write(gpu, &entries, &all, true)?
            + self.draws.write(gpu, &draws, &all, true)?;
        self.version = version;
        Ok(bytes)
    }
}

/// So many portions of a list hold as many instances as the first; `FINE` of shaders/cull.wgsl.
pub(super) const FINE: u32 = 256;

/// Behind them, after so many each holds twice as many; `STEP` of shaders/cull.wgsl.
pub(super) const STEP: u32 = 8;

/// How many of `most` instances of so many triangles the first portions of a list hold: no less than a page has.
fn portion_of(portion_triangles: Option<u32>, triangles: u32, most: u32) -> u32 {
    let most = most.max(1);
    portion_triangles.map_or(most, |portion| (portion / triangles.max(1)).clamp(PAGE_SLOTS.min(most), most))
}

/// The places in a list of `most` that each of its portions draws, if the first draw so many.
fn portions_of_list(portion: u32, most: u32) -> impl Iterator<Item = Range<u32>> {
    let mut start = 0;
    (0..).map_while(move |number: u32| {
        let doublings = number.checked_sub(FINE).map_or(0, |behind| behind / STEP + 1);
        let size = (u64::from(portion) << doublings).min(u64::from(most - start)) as u32;
        start += size;
        (size > 0).then(|| start - size..start)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn portions_have_as_many_triangles_as_they_may_and_a_page_at_least() {
        assert_eq!(portion_of(None, 12, 6400), 6400);
        assert_eq!(portion_of(Some(1200), 12, 6400), 100);
        assert_eq!(portion_of(Some(1200), 12, 64), 64, "no more than there are");
        assert_eq!(portion_of(Some(1200), 5000, 128), 64, "a page is not taken apart");
        assert_eq!((portion_of(Some(1200), 0, 0), portion_of(None, 0, 0)), (1, 1));
    }

    #[test]
    fn portions_follow_each_other_to_the_end_of_a_list_and_grow() {
        let sizes = |portion, most| {
            let mut end = 0;
            let size = |places: Range<u32>| {
                assert_eq!(places.start, end);
                end = places.end;
                places.len()
            };
            portions_of_list(portion, most).map(size).collect::<Vec<_>>()
        };
        assert_eq!(sizes(100, 250), [100, 100, 50]);
        assert_eq!(sizes(1, 0), [0; 0]);
        assert_eq!(sizes(7, 7), [7], "not cut");
        let many = sizes(100, 30_000);
        assert_eq!((many.len(), many[255], many[256], many[263], many[264]), (271, 100, 200, 200, 400));
        assert_eq!(many.iter().sum::<usize>(), 30_000);
        assert!(sizes(64, u32::MAX).len() < 450, "however many there are");
    }
}
