//! Places of entities in the world: `GlobalTransform` from `Transform` and the parents above.
//!
//! Results are those of `bevy_transform`'s systems for the same hierarchies, to the bit. Those read several columns of
//! all objects in every frame. [`update_transforms`] passes over a table in which nothing moved, and of the others it
//! reads 4 bytes of an object that stands still: the change tick of its `Transform`. Objects without parent and
//! children are written where the scan finds them, parts of a table in parallel. Of hierarchies, `topmost` finds the
//! changed nodes that have no changed node above, and `propagate` goes down from these. What is below an entity without
//! `Transform`, or in a ring of parents, keeps its place.
//!
//! An [`Interpolated`] entity is placed between its last two transforms; where the window draws frames between steps,
//! those that moved in the last step are placed anew in each.

use super::interpolation::{Interpolated, Interpolation};
use super::transform::{GlobalTransform, Transform};
use crate::ecs::changes::{LIGHT_ROWS, first_changed, for_each_changed_in, rows_per_task};
use crate::ecs::columns::Column;
use crate::ecs::parallel::in_parallel;
use bevy_ecs::change_detection::{ContiguousMut, ContiguousRef};
use bevy_ecs::prelude::*;
use glam::Affine3A;

type Placed<'a> = (Ref<'a, Transform>, Option<Ref<'a, Interpolated>>, &'a mut GlobalTransform);
type Hung<'a> = (Entity, Ref<'a, Transform>, Option<Ref<'a, Interpolated>>);
type Alone = (Without<ChildOf>, Without<Children>);
type Related = Or<(With<ChildOf>, With<Children>)>;
type Node = (&'static Transform, Option<&'static Interpolated>, &'static mut GlobalTransform, Has<Children>);
type Nodes<'w, 's> = Query<'w, 's, Node>;

/// Entities whose parent is new since the last frame. `ChildOf`, which is Bevy's, has no summary tick that would tell.
#[derive(Resource, Debug, Default)]
pub struct NewParents(Vec<Entity>);

impl NewParents {
    /// Entities in the order in which they came; some may be gone, or have another parent by now.
    pub(crate) fn entities(&self) -> &[Entity] {
        &self.0
    }
}

/// Keeps an account of [`NewParents`]; an observer of the world.
pub fn note_parent(inserted: On<Insert<ChildOf>>, mut new: ResMut<NewParents>) {
    new.0.push(inserted.entity);
}

/// Placement of interpolated entities in a frame.
#[derive(Clone, Copy)]
struct Between {
    /// Part of the last step: 1 is the state itself.
    fraction: f32,
    /// Set if the part differs from that of the frame before.
    is_new: bool,
}

/// Brings the `GlobalTransform`s of what moved, or changed its parent, up to date.
#[allow(clippy::type_complexity)]
pub fn update_transforms(
    mut queries: ParamSet<(
        Query<Placed, Alone>,
        Query<Hung, (With<GlobalTransform>, Related)>,
        (Nodes, Query<&ChildOf>, Query<&Children>),
    )>,
    mut orphaned: RemovedComponents<ChildOf>,
    mut hung: ResMut<NewParents>,
    interpolation: Res<Interpolation>,
    mut kept: Local<Kept>,
) {
    let fraction = interpolation.drawn();
    let between = Between { fraction, is_new: kept.fraction.replace(fraction).is_some_and(|last| last != fraction) };
    for (transforms, interpolated, globals) in queries.p0().contiguous_iter_mut().into_iter().flatten() {
        update_table(transforms, interpolated, globals, between);
    }
    let mut changed: Vec<Entity> = orphaned.read().collect();
    if !hung.0.is_empty() {
        changed.extend(std::mem::take(&mut hung.0));
    }
    for (entities, transforms, interpolated) in queries.p1().contiguous_iter().into_iter().flatten() {
        let (transforms, placed) = ContiguousRef::split(transforms);
        let (interpolated, noted) = interpolated.map(ContiguousRef::split).unzip();
        for_each_changed_in([Some(&placed), noted.as_ref()], |row| changed.push(entities[row]));
        if let Some(interpolated) = interpolated.filter(|_| between.is_new) {
            let moving = interpolated.iter().zip(transforms).zip(entities);
            changed.extend(moving.filter(|((noted, now), _)| noted.is_moving(now)).map(|(_, entity)| *entity));
        }
    }
    if changed.is_empty() {
        return;
    }
    let (mut nodes, parents, children) = queries.p2();
    let topmost = kept.topmost(&changed, &nodes, &parents);
    kept.forget();
    propagate(&topmost, &children, &mut nodes, fraction);
}

/// Writes the changed rows of a table of objects without parent and children.
fn update_table(
    transforms: ContiguousRef<Transform>,
    interpolated: Option<ContiguousRef<Interpolated>>,
    globals: ContiguousMut<GlobalTransform>,
    between: Between,
) {
    let (transforms, ticks) = ContiguousRef::split(transforms);
    let (interpolated, noted) = interpolated.map(ContiguousRef::split).unzip();
    let mut globals = Column::new(globals);
    let global = |row: usize| match interpolated {
        Some(noted) => place(&noted[row].blend(&transforms[row], between.fraction)),
        None => place(&transforms[row]),
    };
    if let Some((first, since, columns)) = first_changed([Some(&ticks), noted.as_ref()]) {
        let rows = rows_per_task(globals.len() - first, LIGHT_ROWS);
        in_parallel(globals.parts(first, rows), |mut part| {
            since.for_each(columns, part.rows(), |row| part.set(row, global(row)));
        });
    }
    if let Some(noted) = interpolated.filter(|_| between.is_new) {
        let rows = rows_per_task(globals.len(), LIGHT_ROWS);
        in_parallel(globals.parts(0, rows), |mut part| {
            for row in part.rows() {
                if !part.is_written(row) && noted[row].is_moving(&transforms[row]) {
                    part.set(row, global(row));
                }
            }
        });
    }
}

/// `GlobalTransform::from`, which is not inlined: what comes back through memory, in other pieces than it is read in,
/// waits there for all that was written before it.
#[inline(always)]
fn place(Transform { translation, rotation, scale }: &Transform) -> GlobalTransform {
    GlobalTransform::from(Affine3A::from_scale_rotation_translation(*scale, *rotation, *translation))
}

/// Knowledge of a node while a frame's changed nodes are sorted out.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
enum Mark {
    #[default]
    Unknown,
    /// Its `Transform` or its parent changed.
    Changed,
    /// On the way up that is being climbed: what meets it is in a ring.
    Climbed,
    /// No node above it changed, nor did it.
    Still,
    /// Some node above it changed, or there is none that everything hangs from.
    Below,
}

/// Memory that [`update_transforms`] keeps from frame to frame, lest it be allocated in each.
#[derive(Default)]
pub struct Kept {
    /// By the indices of entities.
    marks: Vec<Mark>,
    /// Those that are not `Unknown`.
    marked: Vec<usize>,
    /// Part of a step at which the frame before was drawn.
    fraction: Option<f32>,
}

impl Kept {
    fn mark(&mut self, entity: Entity) -> Mark {
        self.marks.get(entity.index_u32() as usize).copied().unwrap_or_default()
    }

    fn set(&mut self, entity: Entity, mark: Mark) {
        let index = entity.index_u32() as usize;
        if index >= self.marks.len() {
            self.marks.resize(index + 1, Mark::Unknown);
        }
        if self.marks[index] == Mark::Unknown {
            self.marked.push(index);
        }
        self.marks[index] = mark;
    }

    fn forget(&mut self) {
        for index in self.marked.drain(..) {
            self.marks[index] = Mark::Unknown;
        }
    }

    /// Those of the changed nodes that have no changed node above them, each once, and the transforms of their parents.
    fn topmost(&mut self, changed: &[Entity], nodes: &Nodes, parents: &Query<&ChildOf>) -> Vec<Below> {
        let mut distinct = Vec::with_capacity(changed.len());
        for &entity in changed {
            // Orphans may be gone.
            if self.mark(entity) == Mark::Unknown && nodes.contains(entity) {
                self.set(entity, Mark::Changed);
                distinct.push(entity);
            }
        }
        distinct.retain(|&entity| self.climb(entity, nodes, parents) == Mark::Still);
        let global = |parent: &ChildOf| nodes.get(parent.parent()).ok().map(|(_, _, global, _)| *global);
        distinct.iter().map(|&entity| (entity, parents.get(entity).ok().and_then(global))).collect()
    }

    /// Tells if there is a changed node above: climbs until it is known, and marks the way.
    fn climb(&mut self, entity: Entity, nodes: &Nodes, parents: &Query<&ChildOf>) -> Mark {
        let parent = |entity| parents.get(entity).ok().map(ChildOf::parent);
        let start = parent(entity);
        let (mut next, mut found) = (start, Mark::Still);
        while let Some(node) = next {
            match self.mark(node) {
                Mark::Unknown if nodes.contains(node) => self.set(node, Mark::Climbed),
                Mark::Still => break,
                _ => {
                    found = Mark::Below;
                    break;
                }
            }
            next = parent(node);
        }
        next = start;
        while let Some(node) = next.filter(|&node| self.mark(node) == Mark::Climbed) {
            self.set(node, found);
            next = parent(node);
        }
        found
    }
}

/// A node and the transform of its parent, if it has one.
type Below = (Entity, Option<GlobalTransform>);

/// Recomputes the nodes and what is below them. On one thread: looking an entity up takes longer than its product, and
/// results would have to be gathered before they are written.
fn propagate(topmost: &[Below], parents: &Query<&Children>, nodes: &mut Nodes, fraction: f32) {
    let mut place = |entity: Entity, parent: Option<&GlobalTransform>, open: &mut Vec<(Entity, GlobalTransform)>| {
        let Ok((transform, noted, mut global, has_children)) = nodes.get_mut(entity) else { return };
        let local = noted.map_or(*transform, |noted| noted.blend(transform, fraction));
        let new = parent.map_or_else(|| GlobalTransform::from(local), |parent| parent.mul_transform(local));
        global.set_if_neq(new);
        if has_children {
            open.push((entity, new));
        }
    };
    let mut open = Vec::new();
    for (entity, parent) in topmost {
        place(*entity, parent.as_ref(), &mut open);
        while let Some((entity, global)) = open.pop() {
            let children = parents.get(entity).into_iter().flat_map(|children| children.iter());
            children.for_each(|child| place(child, Some(&global), &mut open));
        }
    }
}
