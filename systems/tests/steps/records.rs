//! Whatever is edited between frames: taking the records that changed, frame by frame, gives the record of every
//! object that is drawn, as it is, and nothing else.

use super::*;
use bevy_ecs::entity_disabling::Disabled;
use glam::Affine3A;
use std::collections::BTreeMap;
use systems::assets::{AlphaMode, Mesh};
use systems::draw::InstanceRecord;
use systems::ecs::tables::Records;

#[derive(Clone, Copy, Debug)]
enum Edit {
    Move(usize, f32),
    Mirror(usize),
    SetMesh(usize, usize),
    SetMaterial(usize, usize),
    RemoveMaterial(usize),
    Hide(usize),
    Disable(usize),
    Hang(usize, usize),
    Despawn(usize),
    Copy(usize),
    Spawn,
    AddMesh,
    ReplaceMesh(usize, bool),
    RemoveMesh(usize),
    AddMaterial(bool),
    RemoveMaterialOfAll(usize),
    TurnMaterial(usize),
    MoveLamp(f32),
    Frame,
}

fn edit() -> impl Strategy<Value = Edit> {
    let who = 0..12usize;
    let change = prop_oneof![
        (who.clone(), -20.0f32..20.0).prop_map(|(i, x)| Edit::Move(i, x)),
        who.clone().prop_map(Edit::Mirror),
        (who.clone(), 0..5usize).prop_map(|(i, mesh)| Edit::SetMesh(i, mesh)),
        (who.clone(), 0..6usize).prop_map(|(i, material)| Edit::SetMaterial(i, material)),
        who.clone().prop_map(Edit::RemoveMaterial),
        who.clone().prop_map(Edit::Hide),
        who.clone().prop_map(Edit::Disable),
        (who.clone(), who.clone()).prop_map(|(i, j)| Edit::Hang(i, j)),
        who.clone().prop_map(Edit::Despawn),
        who.prop_map(Edit::Copy),
        Just(Edit::Spawn),
        Just(Edit::AddMesh),
        (0..5usize, any::<bool>()).prop_map(|(mesh, empty)| Edit::ReplaceMesh(mesh, empty)),
        (0..5usize).prop_map(Edit::RemoveMesh),
        (0..6usize).prop_map(Edit::RemoveMaterialOfAll),
        any::<bool>().prop_map(Edit::AddMaterial),
        (0..6usize).prop_map(Edit::TurnMaterial),
        (-20.0f32..20.0).prop_map(Edit::MoveLamp),
    ];
    prop_oneof![4 => change, 1 => Just(Edit::Frame)]
}

struct Edited {
    simulation: Simulation,
    objects: Vec<Entity>,
    lamp: Entity,
    /// All ids that the library gave out, and some that it has yet to give: the first of their slots.
    meshes: Vec<MeshId>,
    materials: Vec<MaterialId>,
    taken: Vec<InstanceRecord>,
}

impl Edited {
    fn new() -> Self {
        let mut simulation = Simulation::new();
        let objects = (0..8)
            .map(|i| simulation.world.spawn((MeshId::from_slot(i % 3), MaterialId::from_slot(i % 4))).id())
            .collect();
        let lamp = simulation.world.spawn(Light::point(1.0, 8.0)).id();
        let meshes = (0..3).map(MeshId::from_slot).collect();
        let materials = (0..4).map(MaterialId::from_slot).collect();
        Self { simulation, objects, lamp, meshes, materials, taken: Vec::new() }
    }

    /// One of the last ids, counted from the end.
    fn mesh(&self, number: usize) -> MeshId {
        self.meshes[self.meshes.len().saturating_sub(number + 1)]
    }

    fn material(&self, number: usize) -> MaterialId {
        self.materials[self.materials.len().saturating_sub(number + 1)]
    }

    fn apply(&mut self, edit: Edit) {
        let (mesh_of, material_of) = match edit {
            Edit::SetMesh(_, mesh) | Edit::ReplaceMesh(mesh, _) | Edit::RemoveMesh(mesh) => (self.mesh(mesh), None),
            Edit::SetMaterial(_, number) | Edit::TurnMaterial(number) | Edit::RemoveMaterialOfAll(number) => {
                (self.mesh(0), Some(self.material(number)))
            }
            _ => (self.mesh(0), None),
        };
        let material_of = material_of.unwrap_or_default();
        let world = &mut self.simulation.world;
        let entity = |i: usize| self.objects.get(i).copied();
        let switch = |world: &mut World, entity: Entity, is_hidden: bool| {
            let mut entity = world.entity_mut(entity);
            match (is_hidden, entity.contains::<Hidden>(), entity.contains::<Disabled>()) {
                (true, false, _) => entity.insert(Hidden),
                (true, true, _) => entity.remove::<Hidden>(),
                (false, _, false) => entity.insert(Disabled),
                (false, _, true) => entity.remove::<Disabled>(),
            };
        };
        match edit {
            Edit::Move(i, x) => entity(i).into_iter().for_each(|entity| {
                world.get_mut::<Transform>(entity).expect("a place").translation = Vec3::new(x, x * 0.5, -x);
            }),
            Edit::Mirror(i) => entity(i)
                .into_iter()
                .for_each(|entity| world.get_mut::<Transform>(entity).expect("a place").scale.x *= -1.0),
            Edit::SetMesh(i, _) => entity(i).into_iter().for_each(|entity| {
                world.entity_mut(entity).insert(mesh_of);
            }),
            Edit::SetMaterial(i, _) => entity(i).into_iter().for_each(|entity| {
                world.entity_mut(entity).insert(material_of);
            }),
            Edit::RemoveMaterial(i) => entity(i).into_iter().for_each(|entity| {
                world.entity_mut(entity).remove::<MaterialId>();
            }),
            Edit::Hide(i) => entity(i).into_iter().for_each(|entity| switch(world, entity, true)),
            Edit::Disable(i) => entity(i).into_iter().for_each(|entity| switch(world, entity, false)),
            Edit::Hang(i, j) => {
                if let Some((child, parent)) = entity(i).zip(entity(j)).filter(|_| j < i) {
                    world.entity_mut(child).insert(ChildOf(parent));
                } else if let Some(child) = entity(i) {
                    world.entity_mut(child).remove::<ChildOf>();
                }
            }
            Edit::Despawn(i) => {
                if let Some(object) = entity(i) {
                    world.despawn(object);
                    self.objects.retain(|&object| world.get_entity(object).is_ok());
                }
            }
            Edit::Copy(i) => {
                // With its parent, which comes before it.
                if let Some(object) = entity(i) {
                    let copy = world.entity_mut(object).clone_and_spawn();
                    self.objects.push(copy);
                }
            }
            Edit::Spawn => self.objects.push(world.spawn((MeshId::from_slot(0), MaterialId::from_slot(1))).id()),
            Edit::AddMesh => self.meshes.push(world.resource_mut::<Library>().add_mesh(shapes::cube(Vec3::ONE))),
            // Without triangles it is not drawn, with colours by another pipeline.
            Edit::ReplaceMesh(_, empty) => {
                let mut mesh = if empty { Mesh::default() } else { shapes::cube(Vec3::ONE) };
                mesh.colors = vec![glam::Vec4::ONE; mesh.positions.len()];
                world.resource_mut::<Library>().replace_mesh(mesh_of, mesh);
            }
            Edit::RemoveMesh(_) => _ = world.resource_mut::<Library>().remove_mesh(mesh_of),
            Edit::RemoveMaterialOfAll(_) => _ = world.resource_mut::<Library>().remove_material(material_of),
            Edit::AddMaterial(blended) => {
                let alpha = if blended { AlphaMode::Blend } else { AlphaMode::Opaque };
                let new = Material { alpha, ..Material::default() };
                self.materials.push(world.resource_mut::<Library>().add_material(new));
            }
            Edit::TurnMaterial(_) => {
                world.resource_mut::<Library>().edit_material(material_of, |material| material.double_sided ^= true);
            }
            Edit::MoveLamp(x) => world.get_mut::<Transform>(self.lamp).expect("a place").translation.x = x,
            Edit::Frame => self.frame(),
        }
    }

    fn frame(&mut self) {
        self.simulation.frame();
        let (records, mut room) = (self.simulation.instance_records(), Vec::new());
        self.taken.resize(records.slot_count() as usize, InstanceRecord::default());
        for range in records.dirty().ranges(0) {
            let here = range.start as usize..range.end as usize;
            self.taken[here].copy_from_slice(records.read(std::slice::from_ref(&range), &mut room));
        }
        let all = records.read(std::slice::from_ref(&(0..records.slot_count())), &mut room);
        assert_eq!(self.taken, all);
        let drawn: BTreeMap<u32, &InstanceRecord> =
            all.iter().filter(|record| **record != InstanceRecord::default()).map(|r| (r.entity, r)).collect();
        let (world, library) = (&self.simulation.world, self.simulation.library());
        let mut expected = 0;
        for &object in &self.objects {
            let (mut place, mut hidden, mut disabled_above, mut next) =
                (Affine3A::IDENTITY, false, false, Some(object));
            while let Some(node) = next {
                place = world.get::<Transform>(node).expect("a place").compute_affine() * place;
                hidden |= world.get::<Hidden>(node).is_some();
                disabled_above |= node != object && world.get::<Disabled>(node).is_some();
                next = world.get::<ChildOf>(node).map(ChildOf::parent);
            }
            let mesh = world.get::<MeshId>(object).expect("a mesh");
            let mesh = library.mesh(*mesh).filter(|entry| !entry.mesh.indices.is_empty());
            let is_drawn = !hidden && world.get::<Disabled>(object).is_none() && mesh.is_some();
            let record = drawn.get(&object.index_u32());
            assert_eq!(record.is_some(), is_drawn, "{object}");
            let Some(record) = record else { continue };
            expected += 1;
            let material = world.get::<MaterialId>(object).expect("a material");
            let known = library.material(*material).map_or(MaterialId::DEFAULT, |_| *material);
            assert_eq!(record.material, known.slot());
            // What is below a disabled entity stays where it is until that is enabled.
            if !disabled_above {
                let [x, y, z] = record.world_from_object.map(|row| row[3]);
                let is = Vec3::new(x, y, z);
                assert!(is.abs_diff_eq(place.translation.into(), 1e-3), "{object}: {is} for {}", place.translation);
                assert_eq!(record.world_from_object[0][0] < 0.0, place.matrix3.x_axis.x < 0.0);
            }
        }
        assert_eq!((drawn.len(), self.simulation.draw_list().objects), (expected, expected as u32));
        let list = self.simulation.draw_list();
        assert!(list.transparent.is_sorted_by(|a, b| a.slot < b.slot));
        let is_blended = |record: &&&InstanceRecord| {
            library.material_in_slot(record.material).is_some_and(|(_, material)| material.alpha == AlphaMode::Blend)
        };
        assert_eq!(list.transparent.len(), drawn.values().filter(is_blended).count());
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn taken_one_by_one_they_are_those_of_the_world(edits in proptest::collection::vec(edit(), 1..150)) {
        let mut world = Edited::new();
        edits.into_iter().for_each(|edit| world.apply(edit));
        world.frame();
    }
}

/// So many that tasks share them; few of which change.
#[test]
fn of_many_objects_those_that_changed_are_marked() {
    let mut world = Edited::new();
    world.apply(Edit::AddMesh);
    (0..20_000).for_each(|_| world.apply(Edit::Spawn));
    world.apply(Edit::AddMaterial(false));
    world.frame();
    for edit in [Edit::Move(7, 3.0), Edit::Move(9_999, 4.0), Edit::Mirror(15_000), Edit::TurnMaterial(1)] {
        world.apply(edit);
        world.frame();
    }
}
