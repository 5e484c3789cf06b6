//! World transforms are those of `bevy_transform`'s own systems, to the bit, whatever is spawned, moved, hung elsewhere
//! and despawned.

use bevy_ecs::component::Mutable;
use bevy_ecs::prelude::*;
use bevy_transform::components as theirs;
use bevy_transform::systems::{
    StaticTransformOptimizations, mark_dirty_trees, propagate_parent_transforms, sync_simple_transforms,
};
use glam::{Quat, Vec3};
use proptest::prelude::*;
use systems::Simulation;
use systems::assets::Library;
use systems::ecs::stats::FrameStats;
use systems::space::{GlobalTransform, Transform, update_transforms};

/// A component that a place in the parent's coordinates can be written to.
trait Place: Component<Mutability = Mutable> {
    fn of(place: Transform) -> Self;
}

impl Place for Transform {
    fn of(place: Transform) -> Self {
        place
    }
}

impl Place for theirs::Transform {
    fn of(Transform { translation, rotation, scale }: Transform) -> Self {
        Self { translation, rotation, scale }
    }
}

/// An entity is named by the order in which it was spawned.
#[derive(Clone, Debug)]
enum Edit {
    Spawn(Transform, Option<usize>),
    Despawn(usize),
    Move(usize, Transform),
    /// Writes what was there.
    Touch(usize),
    Hang(usize, usize),
    Unhang(usize),
    RemoveTransform(usize),
    InsertTransform(usize, Transform),
    Frame,
}

/// The same edits done to two worlds.
struct Worlds {
    ours: (World, Schedule),
    theirs: (World, Schedule),
    entities: Vec<Entity>,
}

impl Worlds {
    fn new() -> Self {
        systems::set_threads(Some(4));
        let (mut ours, mut theirs) = (Schedule::default(), Schedule::default());
        ours.add_systems(update_transforms);
        theirs.add_systems((mark_dirty_trees, propagate_parent_transforms, sync_simple_transforms).chain());
        // In both, so that entities are the same.
        let mut worlds = [World::new(), World::new()];
        worlds.iter_mut().for_each(|world| {
            world.init_resource::<StaticTransformOptimizations>();
            world.init_resource::<systems::space::Interpolation>();
            world.init_resource::<systems::space::NewParents>();
            world.add_observer(systems::space::note_parent);
        });
        let [one, other] = worlds;
        Self { ours: (one, ours), theirs: (other, theirs), entities: Vec::new() }
    }

    fn edit(&mut self, edit: &Edit) {
        if let Edit::Frame = edit {
            return self.frame();
        }
        let entity = |index: usize| self.entities.get(index % self.entities.len().max(1)).copied();
        let ours = apply::<Transform>(&mut self.ours.0, edit, entity);
        assert_eq!(ours, apply::<theirs::Transform>(&mut self.theirs.0, edit, entity));
        self.entities.extend(ours);
    }

    fn frame(&mut self) {
        for (world, schedule) in [&mut self.ours, &mut self.theirs] {
            schedule.run(world);
            world.clear_trackers();
        }
        for &entity in &self.entities {
            let ours = self.ours.0.get::<GlobalTransform>(entity).map(|place| place.affine().to_cols_array());
            let theirs = self.theirs.0.get::<theirs::GlobalTransform>(entity).map(|p| p.affine().to_cols_array());
            // The signs of zeros and of what is not a number are left open.
            let plain = |v: f32| if v.is_nan() { f32::NAN } else { v + 0.0 };
            let bits = |place: Option<[f32; 12]>| place.map(|m| m.map(|v| plain(v).to_bits()));
            assert_eq!(bits(ours), bits(theirs), "{entity}: {ours:?} is not {theirs:?}");
        }
    }
}

/// Does an edit, if it can be done; returns the entity that it spawned.
fn apply<P: Place>(world: &mut World, edit: &Edit, entity: impl Fn(usize) -> Option<Entity>) -> Option<Entity> {
    let living = |world: &World, index: usize| entity(index).filter(|&entity| world.get_entity(entity).is_ok());
    match *edit {
        Edit::Spawn(place, parent) => {
            let parent = parent.and_then(|parent| living(world, parent));
            let mut new = world.spawn(P::of(place));
            if let Some(parent) = parent {
                new.insert(ChildOf(parent));
            }
            return Some(new.id());
        }
        Edit::Despawn(index) => _ = living(world, index).map(|entity| world.despawn(entity)),
        Edit::Move(index, place) => {
            let living = living(world, index)?;
            *world.get_mut::<P>(living)? = P::of(place);
        }
        Edit::Touch(index) => {
            let living = living(world, index)?;
            world.get_mut::<P>(living)?.set_changed();
        }
        Edit::Hang(index, parent) => {
            let (child, parent) = (living(world, index)?, living(world, parent)?);
            let mut above = Some(parent);
            while let Some(entity) = above.filter(|&entity| entity != child) {
                above = world.get::<ChildOf>(entity).map(ChildOf::parent);
            }
            if above.is_none() {
                world.entity_mut(child).insert(ChildOf(parent));
            }
        }
        Edit::Unhang(index) => _ = world.entity_mut(living(world, index)?).remove::<ChildOf>(),
        Edit::RemoveTransform(index) => _ = world.entity_mut(living(world, index)?).remove::<P>(),
        Edit::InsertTransform(index, place) => _ = world.entity_mut(living(world, index)?).insert(P::of(place)),
        Edit::Frame => {}
    }
    None
}

fn number() -> impl Strategy<Value = f32> {
    prop_oneof![
        8 => -10.0f32..10.0,
        2 => Just(0.0),
        2 => Just(-0.0),
        1 => Just(1.0),
        1 => Just(f32::INFINITY),
        1 => Just(f32::NAN),
        1 => Just(1e30),
    ]
}

fn place() -> impl Strategy<Value = Transform> {
    let vector = || [number(), number(), number()].prop_map(Vec3::from);
    (vector(), -3.0f32..3.0, vector()).prop_map(|(translation, angle, scale)| Transform {
        translation,
        rotation: Quat::from_rotation_x(angle),
        scale,
    })
}

fn edit() -> impl Strategy<Value = Edit> {
    let one = || 0usize..64;
    prop_oneof![
        4 => (place(), proptest::option::of(one())).prop_map(|(place, parent)| Edit::Spawn(place, parent)),
        1 => one().prop_map(Edit::Despawn),
        4 => (one(), place()).prop_map(|(index, place)| Edit::Move(index, place)),
        1 => one().prop_map(Edit::Touch),
        3 => (one(), one()).prop_map(|(child, parent)| Edit::Hang(child, parent)),
        2 => one().prop_map(Edit::Unhang),
        1 => one().prop_map(Edit::RemoveTransform),
        1 => (one(), place()).prop_map(|(index, place)| Edit::InsertTransform(index, place)),
        5 => Just(Edit::Frame),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    #[test]
    fn equal_to_the_bit_whatever_is_edited(edits in proptest::collection::vec(edit(), 1..120)) {
        let mut worlds = Worlds::new();
        edits.iter().for_each(|edit| worlds.edit(edit));
        worlds.frame();
    }
}

/// So many that tasks share them: tables of several parts, and levels of hierarchies.
#[test]
fn equal_where_tasks_share_the_work() {
    let mut worlds = Worlds::new();
    let at = |i: usize| Transform {
        translation: Vec3::new(i as f32 * 0.37, (i % 7) as f32, -1.0),
        rotation: Quat::from_rotation_y(i as f32),
        scale: Vec3::splat(1.0 + (i % 3) as f32),
    };
    (0..20_000).for_each(|i| worlds.edit(&Edit::Spawn(at(i), None)));
    // 3,000 of them have a child, one of these 3,000 children, each with two.
    (0..3_000).for_each(|i| worlds.edit(&Edit::Spawn(at(i), Some(i))));
    (0..3_000).for_each(|i| worlds.edit(&Edit::Spawn(at(i), Some(20_000))));
    (0..6_000).for_each(|i| worlds.edit(&Edit::Spawn(at(i), Some(23_000 + i / 2))));
    worlds.frame();
    for step in [1, 2, 97, 9_000] {
        (0..32_000).step_by(step).for_each(|i| worlds.edit(&Edit::Move(worlds.entities.len() - 1 - i, at(i + step))));
        worlds.frame();
    }
    worlds.edit(&Edit::Move(0, at(5)));
    worlds.frame();
}

#[test]
fn chains_of_any_length_and_rings_end() {
    let mut simulation = Simulation::new();
    let step = Transform::from_xyz(1.0, 0.0, 0.0);
    let world = &mut simulation.world;
    let top = world.spawn(step).id();
    let chain: Vec<Entity> = (1..20_000)
        .scan(top, |parent, _| {
            *parent = world.spawn((step, ChildOf(*parent))).id();
            Some(*parent)
        })
        .collect();
    let ring = [(); 3].map(|()| world.spawn(step).id());
    let below = world.spawn((step, ChildOf(ring[0]))).id();
    for (i, &entity) in ring.iter().enumerate() {
        world.entity_mut(entity).insert(ChildOf(ring[(i + 1) % 3]));
    }
    simulation.frame();
    let x =
        |simulation: &Simulation, entity| simulation.world.get::<GlobalTransform>(entity).map(|p| p.translation().x);
    assert_eq!(x(&simulation, chain[19_998]), Some(20_000.0));
    simulation.world.get_mut::<Transform>(top).expect("lives").translation.x = 0.0;
    simulation.world.entity_mut(chain[9_999]).remove::<ChildOf>();
    simulation.world.get_mut::<Transform>(below).expect("lives").translation.x = 5.0;
    simulation.frame();
    assert_eq!(x(&simulation, chain[9_998]), Some(9_999.0));
    assert_eq!(x(&simulation, chain[19_998]), Some(10_000.0));
    // Out of the ring, everything has its place.
    simulation.world.entity_mut(ring[0]).remove::<ChildOf>();
    simulation.frame();
    assert_eq!((x(&simulation, below), x(&simulation, ring[1])), (Some(6.0), Some(3.0)));
}

#[test]
fn what_stands_still_does_not_count_as_changed() {
    let mut simulation = Simulation::new();
    let cube = simulation.world.resource_mut::<Library>().add_mesh(systems::assets::shapes::cube(Vec3::ONE));
    let parent = simulation.world.spawn(Transform::IDENTITY).id();
    let below: Vec<Entity> = (0..100).map(|_| simulation.world.spawn((cube, ChildOf(parent))).id()).collect();
    let alone: Vec<Entity> = (0..100).map(|_| simulation.world.spawn(cube).id()).collect();
    simulation.frame();
    let ticks = |world: &World| {
        let changed =
            |&entity: &Entity| world.entity(entity).get_change_ticks::<GlobalTransform>().map(|ticks| ticks.changed);
        below.iter().chain(&alone).map(changed).collect::<Vec<_>>()
    };
    let before = ticks(&simulation.world);
    let world = &mut simulation.world;
    let mut edit =
        |entity, edit: &dyn Fn(&mut Transform)| edit(&mut world.get_mut::<Transform>(entity).expect("lives"));
    edit(below[50], &|place| place.translation.x = 1.0);
    edit(alone[50], &|place| place.translation.x = 1.0);
    edit(alone[7], &|place| place.rotation = Quat::from_rotation_x(1.0));
    edit(below[7], &|_| {});
    edit(parent, &|place| place.translation.x = 0.0);
    simulation.frame();
    let after = ticks(&simulation.world);
    let changed: Vec<usize> = (0..200).filter(|&object| before[object] != after[object]).collect();
    assert_eq!(changed, [50, 107, 150]);
    assert_eq!(simulation.world.resource::<FrameStats>().selected, 3);
}
