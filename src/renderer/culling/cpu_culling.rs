//! Culling of a view's objects on the CPU, for worlds of few objects, whose draws are then direct ones.
//!
//! The culling pass ([`super::cull`]) costs the same few dispatches for ten objects and for ten thousand. A view of
//! a camera sensor, a hundred pixels wide and one of many, takes less time to draw than to cull so. Here the sphere of
//! each object is tested against the frustum, and its level of detail chosen. Lists come out as
//! there, near slices first; what lies between the samples of a picture is not left out.

use super::cull::{DirectDraws, SLICES};
use super::indirect_draws::Draw;
use super::slot_set::SlotSet;
use crate::renderer::resources::meshes::{MeshRange, Meshes};
use glam::{Affine3A, Mat3A, Mat4, Vec3A, Vec4};
use systems::assets::Level;
use systems::assets::levels::{LevelOfDetail, MOST_LEVELS};
use systems::draw::{FrameData, InstanceRecord, PAGE_SLOTS, Projection, View, in_frustum};
use systems::space::Sphere;

/// Marks a slot that is drawn at another level of detail than the mesh itself; `COARSE` of shaders/types.wgsl.
pub(crate) const COARSE: u32 = 1 << 31;

/// The most objects that are culled on the CPU.
const MOST_OBJECTS: u32 = 2048;

/// The opaque objects of a world that has few, for all views of a frame.
#[derive(Debug)]
pub(crate) struct CpuCulling {
    /// In the order of batches, pages and slots.
    objects: Vec<Object>,
    /// Levels of detail of the batches' meshes.
    batches: Vec<Vec<Level>>,
}

#[derive(Debug)]
struct Object {
    slot: u32,
    batch: usize,
    /// World space; as large as its mesh's, which may lie far from its own origin, with room for rounding.
    bounds: Sphere,
    /// The sphere that its level of detail is chosen by, world space.
    level_bounds: Sphere,
    /// Largest scale of its `world_from_object`.
    scale: f32,
}

impl CpuCulling {
    /// Those of a frame; `None` if there are many. All meshes are uploaded.
    pub fn of(frame: &FrameData<'_>, meshes: &Meshes) -> Option<Self> {
        (frame.list.objects <= MOST_OBJECTS).then(|| Self::among(frame, meshes, |_| true))
    }

    /// Those in some slots of a frame, however many there are. All meshes are uploaded.
    pub fn among(frame: &FrameData<'_>, meshes: &Meshes, is_among: impl Fn(u32) -> bool) -> Self {
        let list = frame.list;
        let is_used = |slot: u32| is_among(slot) && is_used(frame, slot);
        let mut few = Self { objects: Vec::new(), batches: Vec::new() };
        let mut room = Vec::new();
        for batch in &list.batches {
            // As `IndirectDraws::update` passes over them.
            let Some(mesh) = meshes.range(batch.key.mesh) else { continue };
            let pages = &list.pages[batch.pages.start as usize..batch.pages.end as usize];
            for page in pages {
                let slots = page * PAGE_SLOTS..(page + 1) * PAGE_SLOTS;
                let last = slots.clone().rev().find(|&slot| is_used(slot));
                let slots = slots.start..last.map_or(slots.start, |last| last + 1);
                let records = frame.instances.read(std::slice::from_ref(&slots), &mut room);
                let objects = slots.zip(records).filter(|(slot, _)| is_used(*slot));
                few.objects.extend(objects.map(|(slot, record)| Object::new(slot, few.batches.len(), record, mesh)));
            }
            few.batches.push(mesh.levels.clone());
        }
        few
    }

    /// Visible draws of a view; `draws`: all draws, of each level of detail that has triangles, or of the first alone;
    /// `only`: slots of the objects that may be drawn, `None`: all.
    pub fn visible(&self, view: &View, levels: &LevelOfDetail, draws: &[Draw], only: Option<&SlotSet>) -> DirectDraws {
        let planes = view.frustum_planes();
        let pixels_at_1m = view.pixels_at_1m();
        let is_parallel = matches!(view.camera.projection, Projection::Orthographic { .. });
        let mut of_levels = vec![[None; MOST_LEVELS]; self.batches.len()];
        draws.iter().enumerate().for_each(|(place, draw)| of_levels[draw.batch][draw.level as usize] = Some(place));
        let mut visible: Vec<(usize, u32, u32)> = Vec::with_capacity(self.objects.len());
        let is_meant = |object: &&Object| only.is_none_or(|only| only.has(object.slot));
        for object in self.objects.iter().filter(is_meant).filter(|object| in_frustum(&planes, object.bounds)) {
            let Sphere { center, radius } = object.level_bounds;
            let nearest = if is_parallel { 1.0 } else { center.distance(view.eye()) - radius };
            let level = levels.choose(&self.batches[object.batch], object.scale, nearest, pixels_at_1m);
            let Some(draw) = of_levels[object.batch][level] else { continue };
            let offset = object.bounds.center - view.eye();
            let distance = if is_parallel { offset.dot(view.direction()) } else { offset.length() };
            visible.push((draw, slice(distance), object.slot | if level > 0 { COARSE } else { 0 }));
        }
        // Stable: within a slice in the order of slots.
        visible.sort_by_key(|&(draw, slice, _)| (draw, slice));
        let slots = visible.iter().map(|&(_, _, slot)| slot).collect();
        let mut end = 0;
        let range = |draw: usize| {
            let start = end;
            end += visible[start..].iter().take_while(|&&(of, _, _)| of == draw).count();
            start as u32..end as u32
        };
        DirectDraws { slots, ranges: (0..draws.len()).map(range).collect() }
    }
}

fn is_used(frame: &FrameData<'_>, slot: u32) -> bool {
    frame.list.instances.objects.get(slot as usize).is_some_and(Option::is_some)
}

impl Object {
    fn new(slot: u32, batch: usize, record: &InstanceRecord, mesh: &MeshRange) -> Self {
        let rows = record.world_from_object.map(Vec4::from_array);
        let [x, y, z, origin] = Mat4::from_cols(rows[0], rows[1], rows[2], Vec4::W).transpose().to_cols_array_2d();
        let column = |[x, y, z, _]: [f32; 4]| Vec3A::new(x, y, z);
        let matrix3 = Mat3A::from_cols(column(x), column(y), column(z));
        let place = Affine3A { matrix3, translation: column(origin) };
        let Sphere { center, radius } = mesh.bounds;
        let unit = Sphere { center, radius: 1.0 };
        let Sphere { center: middle, radius: scale } = unit.transformed(&place);
        let bounds = Sphere { center: middle, radius: scale * (radius + 1e-6 * center.length()) };
        let level_bounds =
            if mesh.level_bounds == mesh.bounds { bounds } else { mesh.level_bounds.transformed(&place) };
        Self { slot, batch, bounds, level_bounds, scale }
    }
}

/// The slice that holds what is so far away: `slice_of` of shaders/cull.wgsl.
fn slice(distance: f32) -> u32 {
    (2.0 * distance.max(0.25).log2() + 4.0).clamp(0.0, (SLICES - 1) as f32) as u32
}
