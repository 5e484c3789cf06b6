//! Objects that are not drawn for a while: [`Hidden`] hides an entity and all that is below it.
//!
//! [`inherit_hidden`] keeps [`InheritedHidden`] on what is hidden by itself or from above. Hidden objects are in tables
//! of their own, so that what draws leaves them out by the filter `Without<InheritedHidden>` and no object pays for
//! it. Lights shine on: they have a switch of their own.
//!
//! An entity with bevy's `Disabled` is out of everything: neither is it drawn nor does it shine. What is below it, the
//! pieces of a large object among that, is not disabled with it; `EntityWorldMut::insert_recursive` does that.

use super::propagation::NewParents;
use crate::ecs::changes::for_each_changed;
use bevy_ecs::change_detection::ContiguousRef;
use bevy_ecs::entity_disabling::Disabled;
use bevy_ecs::prelude::*;
use std::collections::{HashMap, HashSet};

/// Neither this entity nor what is below it is drawn.
#[derive(Component, Clone, Copy, PartialEq, Eq, Debug, Default, serde::Serialize, serde::Deserialize)]
#[component(summary_tick)]
pub struct Hidden;

/// This entity is hidden, by itself or by one above. Derived; written by [`inherit_hidden`].
#[derive(Component, Clone, Copy, PartialEq, Eq, Debug, Default)]
#[component(clone_behavior = Ignore)]
pub struct InheritedHidden;

/// A filter that lets disabled entities through, which queries pass over otherwise.
pub(crate) type AlsoDisabled = Or<(With<Disabled>, Without<Disabled>)>;

/// Hides and shows what was hidden, shown, or hung below something else, and what is below it. Costs nothing while
/// nothing is hidden. What is disabled is hidden and shown with the others: it may be enabled again.
#[allow(clippy::type_complexity)]
pub fn inherit_hidden(
    hidden: Query<(Entity, Ref<Hidden>), AlsoDisabled>,
    inherited: Query<(), (With<InheritedHidden>, AlsoDisabled)>,
    hung: Query<&ChildOf, AlsoDisabled>,
    children: Query<&Children, AlsoDisabled>,
    mut shown: RemovedComponents<Hidden>,
    (new_parents, mut orphaned): (Res<NewParents>, RemovedComponents<ChildOf>),
    mut commands: Commands,
) {
    let mut open: Vec<Entity> = shown.read().collect();
    let orphans = orphaned.read();
    if hidden.is_empty() && inherited.is_empty() {
        return orphans.for_each(drop);
    }
    open.extend(orphans);
    for (entities, marks) in hidden.contiguous_iter().into_iter().flatten() {
        for_each_changed(&ContiguousRef::split(marks).1, |row| open.push(entities[row]));
    }
    open.extend(new_parents.entities().iter().filter(|&&entity| hung.contains(entity)));
    let mut known = HashMap::new();
    for top in open {
        let mut below = vec![(top, is_hidden_above(top, &hidden, &hung))];
        while let Some((entity, above)) = below.pop() {
            let is_hidden = above || hidden.contains(entity);
            let is_new = known.insert(entity, is_hidden).is_none();
            if !is_new || is_hidden == inherited.contains(entity) {
                continue;
            }
            if let Ok(mut entity) = commands.get_entity(entity) {
                if is_hidden {
                    entity.try_insert(InheritedHidden)
                } else {
                    entity.try_remove::<InheritedHidden>()
                };
            }
            let children = children.get(entity).into_iter().flat_map(|children| children.iter());
            below.extend(children.map(|child| (child, is_hidden)));
        }
    }
}

/// Tells if anything above an entity is hidden.
fn is_hidden_above(
    entity: Entity,
    hidden: &Query<(Entity, Ref<Hidden>), AlsoDisabled>,
    hung: &Query<&ChildOf, AlsoDisabled>,
) -> bool {
    let above = |entity| hung.get(entity).ok().map(ChildOf::parent);
    let (mut next, mut seen) = (above(entity), HashSet::new());
    while let Some(node) = next {
        if hidden.contains(node) {
            return true;
        }
        // Ends in rings of parents, too.
        next = above(node).filter(|_| seen.insert(node));
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assets::library::Library;
    use crate::assets::material::{AlphaMode, Material};
    use crate::assets::shapes;
    use crate::draw::instances::InstanceTable;
    use crate::lights::components::Light;
    use crate::simulation::Simulation;
    use crate::space::transform::Transform;
    use bevy_ecs::entity_disabling::Disabled;
    use glam::Vec3;

    /// A root with two children, each with one.
    fn family(world: &mut World) -> [Entity; 5] {
        let root = world.spawn_empty().id();
        let children = [(); 2].map(|()| world.spawn(ChildOf(root)).id());
        let below = children.map(|child| world.spawn(ChildOf(child)).id());
        [root, children[0], children[1], below[0], below[1]]
    }

    fn hidden(simulation: &mut Simulation, entities: &[Entity]) -> Vec<usize> {
        simulation.frame();
        let is_hidden = |&i: &usize| simulation.world.get::<InheritedHidden>(entities[i]).is_some();
        (0..entities.len()).filter(is_hidden).collect()
    }

    #[test]
    fn what_is_below_is_hidden_and_shown_with_it() {
        let mut simulation = Simulation::new();
        let family = family(&mut simulation.world);
        assert!(hidden(&mut simulation, &family).is_empty());
        simulation.world.entity_mut(family[1]).insert(Hidden);
        assert_eq!(hidden(&mut simulation, &family), [1, 3]);
        simulation.world.entity_mut(family[0]).insert(Hidden);
        assert_eq!(hidden(&mut simulation, &family), [0, 1, 2, 3, 4]);
        simulation.world.entity_mut(family[0]).remove::<Hidden>();
        assert_eq!(hidden(&mut simulation, &family), [1, 3], "hidden by itself");
        simulation.world.entity_mut(family[2]).insert(ChildOf(family[3]));
        assert_eq!(hidden(&mut simulation, &family), [1, 2, 3, 4]);
        simulation.world.entity_mut(family[4]).remove::<ChildOf>();
        assert_eq!(hidden(&mut simulation, &family), [1, 2, 3]);
        let new = simulation.world.spawn(ChildOf(family[2])).id();
        assert_eq!(hidden(&mut simulation, &[new]), [0]);
        simulation.world.entity_mut(family[1]).remove::<Hidden>();
        assert!(hidden(&mut simulation, &[family, [new; 5]].concat()).is_empty());
    }

    #[test]
    fn a_ring_of_parents_ends() {
        let mut simulation = Simulation::new();
        let family = family(&mut simulation.world);
        simulation.world.entity_mut(family[0]).insert((ChildOf(family[3]), Hidden));
        assert_eq!(hidden(&mut simulation, &family), [0, 1, 2, 3, 4]);
    }

    #[test]
    fn a_disabled_object_is_not_drawn_nor_lit_and_comes_back_as_what_it_is_by_then() {
        let mut simulation = Simulation::new();
        let mut library = simulation.world.resource_mut::<Library>();
        let cube = library.add_mesh(shapes::cube(Vec3::ONE));
        let glass = library.add_material(Material { alpha: AlphaMode::Blend, ..Material::default() });
        let object = simulation.world.spawn(cube).id();
        let lamp = simulation.world.spawn(Light::point(1.0, 10.0)).id();
        let mut drawn = |edit: &mut dyn FnMut(&mut World)| {
            edit(&mut simulation.world);
            simulation.frame();
            let list = simulation.draw_list();
            let reaching =
                simulation.instance_records().drawn().map(|record| record.reaching_or_list).collect::<Vec<_>>();
            (list.batches.len(), list.transparent.len(), reaching)
        };
        assert_eq!(drawn(&mut |_| {}), (1, 0, vec![1]));
        assert_eq!(drawn(&mut |world| _ = world.entity_mut(object).insert(Disabled)), (0, 0, vec![]));
        assert_eq!(drawn(&mut |world| _ = world.entity_mut(object).insert(glass)), (0, 0, vec![]));
        assert_eq!(drawn(&mut |world| _ = world.entity_mut(lamp).insert(Disabled)), (0, 0, vec![]));
        assert_eq!(drawn(&mut |world| _ = world.entity_mut(object).remove::<Disabled>()), (0, 1, vec![0]));
        assert_eq!(drawn(&mut |world| _ = world.entity_mut(lamp).remove::<Disabled>()), (0, 1, vec![1]));
    }

    #[test]
    fn a_disabled_object_does_not_choose_lights() {
        let mut simulation = Simulation::new();
        let cube = simulation.world.resource_mut::<Library>().add_mesh(shapes::cube(Vec3::ONE));
        let objects = [(); 3].map(|()| simulation.world.spawn(cube).id());
        let lamp = simulation.world.spawn(Light::point(1.0, 10.0)).id();
        let mut choosing = |edit: &dyn Fn(&mut EntityWorldMut)| {
            edit(&mut simulation.world.entity_mut(objects[0]));
            simulation.world.get_mut::<Transform>(lamp).unwrap().translation.x += 0.1;
            simulation.frame();
            simulation.world.resource::<crate::ecs::stats::FrameStats>().selected
        };
        assert_eq!(choosing(&|_| {}), 3);
        assert_eq!(choosing(&|object| _ = object.insert(Disabled)), 2);
        assert_eq!(choosing(&|_| {}), 2);
        assert_eq!(choosing(&|object| _ = object.remove::<Disabled>()), 3);
    }

    #[test]
    fn a_hidden_object_gives_its_slot_back_and_gets_one_when_it_is_shown() {
        let mut simulation = Simulation::new();
        let cube = simulation.world.resource_mut::<Library>().add_mesh(shapes::cube(Vec3::ONE));
        let object = simulation.world.spawn(cube).id();
        let mut slot_after_a_frame = |edit: fn(&mut EntityWorldMut)| {
            edit(&mut simulation.world.entity_mut(object));
            simulation.frame();
            simulation.world.resource::<InstanceTable>().slot(object)
        };
        assert_eq!(slot_after_a_frame(|_| {}), Some(0));
        assert_eq!(slot_after_a_frame(|object| _ = object.insert(Hidden)), None);
        assert_eq!(slot_after_a_frame(|_| {}), None);
        assert_eq!(slot_after_a_frame(|object| _ = object.remove::<Hidden>()), Some(0));
    }
}
