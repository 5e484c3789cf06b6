//! Large objects, drawn in pieces.
//!
//! An object has one choice of lights; a road would have one for all its length. [`draw_in_pieces`] takes the mesh off
//! such an entity and hangs the pieces of it ([`crate::assets::split`]) below, each an object with bounds, lights and a
//! draw of its own. The entity stays what it was in all other respects: it moves its pieces, [`follow_materials`] gives
//! them its material, [`follow_meshes`] cuts it anew when its mesh is replaced, and ids, picking and lists name it and
//! not them.

use crate::assets::library::Library;
use crate::assets::material::{AlphaMode, MaterialId, Shading};
use crate::assets::mesh::{MeshId, MeshVariants};
use crate::assets::split::Grid;
use crate::ecs::changes::for_each_changed;
use crate::lights::components::NoShadow;
use crate::lights::policy::LightPolicy;
use crate::lights::selected::SelectedLights;
use crate::space::bounds::Aabb;
use crate::space::hidden::AlsoDisabled;
use crate::space::transform::Transform;
use bevy_ecs::change_detection::ContiguousRef;
use bevy_ecs::entity::{ComponentCloneCtx, SourceComponent};
use bevy_ecs::entity_disabling::Disabled;
use bevy_ecs::prelude::*;
use glam::{Affine3A, Vec3};
use std::collections::BTreeSet;

/// Metres: objects longer than this are drawn in pieces unless something else is said. A street lamp's pool of light is
/// about twice as wide, a room lamp's as wide.
pub const DEFAULT_METRES: f32 = 8.0;

/// A piece of an object: what is drawn for it, and has no name and no state of its own. The piece is the object's
/// child, too. It is a part of the object's mesh, or a proxy of a model of which the object is a part.
#[derive(Component, Clone, Copy, PartialEq, Eq, Debug)]
#[relationship(relationship_target = Pieces)]
pub struct PieceOf(pub Entity);

/// The pieces of an object.
#[derive(Component, Debug)]
#[relationship_target(relationship = PieceOf)]
pub struct Pieces(Vec<Entity>);

/// The mesh of an object that is drawn in pieces: it has no [`MeshId`] of its own.
///
/// A copy of the entity without its children has no pieces, and gets the mesh itself.
#[derive(Component, Clone, Copy, PartialEq, Debug)]
#[component(clone_behavior = Custom(copy_whole))]
pub struct WholeMesh {
    /// The mesh.
    pub mesh: MeshId,
    /// Metres: how long pieces may be.
    pub metres: f32,
}

fn copy_whole(source: &SourceComponent, context: &mut ComponentCloneCtx) {
    let Some(&whole) = source.read::<WholeMesh>() else { return };
    if context.linked_cloning() || context.moving() {
        context.write_target_component(whole);
        return;
    }
    let copy = context.target();
    context.queue_deferred(move |world, _| {
        if let Ok(mut copy) = world.get_entity_mut(copy) {
            copy.insert(whole.mesh);
        }
    });
}

/// Result of [`draw_in_pieces`].
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct PiecesReport {
    /// Objects that are in pieces now.
    pub objects: usize,
    /// Their pieces.
    pub pieces: usize,
    /// Metres: how long the longest piece may be. More than was asked for where that would have made too many.
    pub metres: f32,
}

/// Draws `root`, and every object below it, in pieces no longer than `metres` along any of its own axes, where it is
/// longer than that. 0: not at all. The scale that counts is that of the transforms as they are now. Objects that share
/// a mesh share its pieces, if their scale is the same.
///
/// Left whole: unlit objects, which choose no lights; blended ones, which are sorted as wholes; those with a
/// [`MeshVariants`], whose mesh changes. With three lights or fewer in the world nothing is gained by pieces.
///
/// ```
/// use systems::Simulation;
/// use systems::assets::{Library, shapes};
/// use systems::draw::pieces;
/// # use glam::{UVec2, Vec2};
/// let mut simulation = Simulation::new();
/// let road = shapes::plane(Vec2::new(12.0, 1000.0), UVec2::ONE);
/// let road = simulation.world.resource_mut::<Library>().add_mesh(road);
/// let road = simulation.world.spawn(road).id();
/// let report = pieces::draw_in_pieces(&mut simulation.world, road, 4.0);
/// assert_eq!(report.pieces, 3 * 250);
/// ```
pub fn draw_in_pieces(world: &mut World, root: Entity, metres: f32) -> PiecesReport {
    let mut report = PiecesReport::default();
    let mut open = vec![root];
    while let Some(entity) = open.pop() {
        if let Some(children) = world.get::<Children>(entity) {
            open.extend(children.iter().rev());
        }
        if let Some(own) = draw_one_in_pieces(world, entity, metres) {
            report.objects += 1;
            report.pieces += own.pieces;
            report.metres = report.metres.max(own.metres);
        }
    }
    report
}

/// Tells if a box is longer than `metres` along any axis of its own.
pub fn is_longer(aabb: Aabb, world_from_object: &Affine3A, metres: f32) -> bool {
    metres > 0.0 && ((aabb.max - aabb.min) * axis_scale(world_from_object)).max_element() > metres
}

/// World-space length of an object's unit along each of its axes, metres.
fn axis_scale(world_from_object: &Affine3A) -> Vec3 {
    let m = world_from_object.matrix3;
    Vec3::new(m.x_axis.length(), m.y_axis.length(), m.z_axis.length())
}

/// [`draw_in_pieces`] without what is below; `None` where the entity is left whole.
pub fn draw_one_in_pieces(world: &mut World, entity: Entity, metres: f32) -> Option<PiecesReport> {
    let object = world.get_entity(entity).ok()?;
    if object.contains::<PieceOf>() || object.contains::<MeshVariants>() {
        return None;
    }
    let (mesh, material) = (*object.get::<MeshId>()?, *object.get::<MaterialId>()?);
    let library = world.resource::<Library>();
    let whole = &library.mesh(mesh)?.mesh;
    let world_from_object = world_from(world, entity);
    let shown = library.material(material);
    let left_whole = shown.is_some_and(|m| m.alpha == AlphaMode::Blend || m.shading == Shading::Unlit);
    if left_whole || !is_longer(whole.aabb(), &world_from_object, metres) {
        return None;
    }
    let scale = axis_scale(&world_from_object);
    let grid = Grid::new(whole, metres / scale);
    if grid.is_whole() {
        return None;
    }
    let aabb = whole.aabb();
    let longest = (grid.cell(aabb.max - aabb.min) * scale).max_element();
    let pieces = world.resource_mut::<Library>().pieces(mesh, grid);
    // Lights are the pieces' now.
    world.entity_mut(entity).remove::<(MeshId, SelectedLights)>().insert(WholeMesh { mesh, metres });
    let piece = |&piece: &MeshId| (piece, material, ChildOf(entity), PieceOf(entity));
    world.spawn_batch(pieces.iter().map(piece).collect::<Vec<_>>());
    hand_on(world, entity);
    Some(PiecesReport { objects: 1, pieces: pieces.len(), metres: longest })
}

/// Place of an entity, world space, from the transforms above it: nothing has been propagated before the first frame.
fn world_from(world: &World, entity: Entity) -> Affine3A {
    let (mut place, mut next) = (Affine3A::IDENTITY, Some(entity));
    while let Some(current) = next {
        place = world.get::<Transform>(current).map_or(Affine3A::IDENTITY, Transform::compute_affine) * place;
        next = world.get::<ChildOf>(current).map(ChildOf::parent);
    }
    place
}

/// Cuts objects anew whose mesh was replaced, in pieces as long as before, whatever their number; one that has become
/// short is one piece. Objects whose mesh was removed lose their pieces.
pub fn follow_meshes(
    world: &mut World,
    objects: &mut QueryState<(Entity, &WholeMesh), AlsoDisabled>,
    mut seen: Local<u64>,
) {
    let library = world.resource::<Library>();
    let since = std::mem::replace(&mut *seen, library.revisions().meshes);
    if library.meshes_edited() <= since {
        return;
    }
    let changed: BTreeSet<u32> = library.changed_meshes(since).collect();
    // Pieces are removed with their mesh. A mesh that was added has them already; one that was short is its own piece.
    let is_stale = |piece: Entity, whole: &WholeMesh| {
        world.get::<MeshId>(piece).is_some_and(|&own| own == whole.mesh || library.mesh(own).is_none())
    };
    let concerned = objects.iter(world).filter(|(entity, whole)| {
        changed.contains(&whole.mesh.slot())
            && world.get::<Pieces>(*entity).is_some_and(|pieces| pieces.iter().any(|piece| is_stale(piece, whole)))
    });
    for (entity, whole) in concerned.map(|(entity, &whole)| (entity, whole)).collect::<Vec<_>>() {
        cut_anew(world, entity, whole);
    }
}

fn cut_anew(world: &mut World, entity: Entity, WholeMesh { mesh, metres }: WholeMesh) {
    let before: Vec<Entity> = world.get::<Pieces>(entity).map(|pieces| pieces.iter().collect()).unwrap_or_default();
    before.into_iter().for_each(|piece| _ = world.despawn(piece));
    let world_from_object = world_from(world, entity);
    let Some(entry) = world.resource::<Library>().mesh(mesh) else { return };
    let mut pieces = vec![mesh];
    if is_longer(entry.mesh.aabb(), &world_from_object, metres) {
        let grid = Grid::new(&entry.mesh, metres / axis_scale(&world_from_object));
        if !grid.is_whole() {
            pieces = world.resource_mut::<Library>().pieces(mesh, grid);
        }
    }
    let material = world.get::<MaterialId>(entity).copied().unwrap_or_default();
    let is_disabled = world.get::<Disabled>(entity).is_some();
    for mesh in pieces {
        let mut piece = world.spawn((mesh, material, ChildOf(entity), PieceOf(entity)));
        if is_disabled {
            piece.insert(Disabled);
        }
    }
    hand_on(world, entity);
}

/// Gives an object's new pieces its policy, if it has one, and that it casts no shadow.
fn hand_on(world: &mut World, entity: Entity) {
    let (policy, no_shadow) = (world.get::<LightPolicy>(entity).copied(), world.get::<NoShadow>(entity).copied());
    if policy.is_none() && no_shadow.is_none() {
        return;
    }
    let pieces: Vec<Entity> = world.get::<Pieces>(entity).into_iter().flat_map(|pieces| pieces.iter()).collect();
    for piece in pieces {
        policy.into_iter().for_each(|policy| _ = world.entity_mut(piece).insert(policy));
        no_shadow.into_iter().for_each(|no_shadow| _ = world.entity_mut(piece).insert(no_shadow));
    }
}

/// Gives pieces the material of their object where that changed.
pub fn follow_materials(
    objects: Query<(&Pieces, Ref<MaterialId>), With<WholeMesh>>,
    mut all: Query<&mut MaterialId, (Without<Pieces>, AlsoDisabled)>,
) {
    let mut followed = Vec::new();
    for (pieces, materials) in objects.contiguous_iter().into_iter().flatten() {
        let (materials, ticks) = ContiguousRef::split(materials);
        for_each_changed(&ticks, |row| followed.extend(pieces[row].iter().map(|piece| (piece, materials[row]))));
    }
    for (piece, material) in followed {
        if let Ok(mut own) = all.get_mut(piece) {
            own.set_if_neq(material);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assets::material::Material;
    use crate::assets::object_bounds::bounds_of;
    use crate::assets::shapes;
    use crate::lights::components::Light;
    use crate::simulation::Simulation;
    use glam::{Quat, UVec2, Vec2};

    fn with_plane(size: Vec2) -> (Simulation, MeshId) {
        let mut simulation = Simulation::new();
        let plane = shapes::plane(size, UVec2::ONE);
        let mesh = simulation.world.resource_mut::<Library>().add_mesh(plane);
        (simulation, mesh)
    }

    fn pieces_of(simulation: &Simulation, object: Entity) -> Vec<Entity> {
        simulation.world.get::<Pieces>(object).map(|pieces| pieces.iter().collect()).unwrap_or_default()
    }

    #[test]
    fn pieces_are_drawn_as_one_object_each_with_lights_of_its_own() {
        let (mut simulation, road) = with_plane(Vec2::new(10.0, 100.0));
        let lights = [-40.0, 40.0].map(|z| {
            let place = Transform::from_xyz(0.0, 3.0, z);
            simulation.world.spawn((Light::point(1.0, 15.0), place)).id()
        });
        simulation.frame();
        let object = simulation.world.spawn(road).id();
        let report = draw_in_pieces(&mut simulation.world, object, 20.0);
        assert_eq!(report, PiecesReport { objects: 1, pieces: 5, metres: 20.0 });
        simulation.frame();
        let world = &simulation.world;
        assert!(!world.entity(object).contains::<MeshId>());
        let first = |light| world.get::<crate::lights::table::LightSlot>(light).expect("a light").0;
        let chosen =
            |piece| world.get::<SelectedLights>(piece).expect("a piece is drawn").unpack(world.resource()).lights[0];
        let chosen: Vec<u32> = pieces_of(&simulation, object).into_iter().map(chosen).collect();
        let none = crate::lights::record::NO_LIGHT;
        assert_eq!(chosen, [first(lights[0]), first(lights[0]), none, first(lights[1]), first(lights[1])]);
        let list = simulation.draw_list();
        assert_eq!(list.objects, 5);
        assert!(simulation.instance_records().drawn().all(|record| record.entity == object.index_u32()));
        // Again, everything is small.
        assert_eq!(draw_in_pieces(&mut simulation.world, object, 20.0), PiecesReport::default());
    }

    #[test]
    fn an_object_keeps_its_place_and_its_material_and_takes_its_pieces_with_it() {
        let (mut simulation, road) = with_plane(Vec2::splat(40.0));
        let red = simulation.world.resource_mut::<Library>().add_material(Material::default());
        let object = simulation.world.spawn((road, Transform::from_xyz(0.0, 5.0, 0.0))).id();
        // One that was drawn whole before.
        simulation.frame();
        draw_in_pieces(&mut simulation.world, object, 20.0);
        simulation.frame();
        assert_eq!(simulation.draw_list().objects, 4);
        simulation.world.entity_mut(object).insert((red, Transform::from_xyz(0.0, 7.0, 0.0)));
        simulation.frame();
        for piece in pieces_of(&simulation, object) {
            assert_eq!(simulation.world.get::<MaterialId>(piece), Some(&red));
            assert_eq!(bounds_of(&simulation.world, piece).map(|b| b.center.y), Some(7.0));
        }
        simulation.world.despawn(object);
        simulation.frame();
        assert_eq!(simulation.draw_list().objects, 0);
        assert_eq!(simulation.instance_records().drawn().count(), 0);
    }

    #[test]
    fn a_copy_is_drawn_whole_or_with_pieces_of_its_own() {
        let (mut simulation, road) = with_plane(Vec2::splat(40.0));
        let object = simulation.world.spawn(road).id();
        draw_in_pieces(&mut simulation.world, object, 20.0);
        let alone = simulation.world.entity_mut(object).clone_and_spawn();
        let linked = simulation
            .world
            .entity_mut(object)
            .clone_and_spawn_with_opt_out(|builder| _ = builder.linked_cloning(true));
        simulation.frame();
        assert_eq!(
            (simulation.world.get::<MeshId>(alone), simulation.world.get::<WholeMesh>(alone)),
            (Some(&road), None)
        );
        assert_eq!(pieces_of(&simulation, linked).len(), 4);
        assert_eq!(simulation.draw_list().objects, 4 + 1 + 4);
    }

    #[test]
    fn pieces_have_their_object_s_material_whatever_became_of_it_meanwhile() {
        let (mut simulation, road) = with_plane(Vec2::splat(40.0));
        let mut library = simulation.world.resource_mut::<Library>();
        let [red, blue] = [(); 2].map(|()| library.add_material(Material::default()));
        let object = simulation.world.spawn((road, red)).id();
        draw_in_pieces(&mut simulation.world, object, 20.0);
        simulation.frame();
        let mut after = |edit: &dyn Fn(&mut EntityWorldMut)| {
            edit(&mut simulation.world.entity_mut(object));
            simulation.frame();
            let mut materials: Vec<u32> = simulation.instance_records().drawn().map(|record| record.material).collect();
            materials.dedup();
            materials
        };
        after(&|object| _ = object.insert_recursive::<Children>(Disabled));
        after(&|object| _ = object.insert(blue));
        assert_eq!(after(&|object| _ = object.remove_recursive::<Children, Disabled>()), [blue.slot()]);
        // Without a material, the default: noticed in the frame after, and theirs at once.
        assert_eq!(after(&|object| _ = object.remove::<MaterialId>()), [MaterialId::DEFAULT.slot()]);
    }

    #[test]
    fn the_scale_in_the_world_counts_and_objects_share_pieces() {
        let (mut simulation, plane) = with_plane(Vec2::ONE);
        let parent = simulation.world.spawn(Transform::from_scale(Vec3::new(30.0, 1.0, 1.0))).id();
        let turned = Transform::from_rotation(Quat::from_rotation_y(std::f32::consts::FRAC_PI_2));
        let mut child = |at: Transform| simulation.world.spawn((plane, at, ChildOf(parent))).id();
        let (along, again, across) =
            (child(Transform::IDENTITY), child(Transform::from_xyz(0.0, 9.0, 0.0)), child(turned));
        let small = simulation.world.spawn(plane).id();
        draw_in_pieces(&mut simulation.world, parent, 10.0);
        draw_in_pieces(&mut simulation.world, small, 10.0);
        let meshes = |object| {
            let mesh = |piece: Entity| *simulation.world.get::<MeshId>(piece).expect("a piece is drawn");
            pieces_of(&simulation, object).into_iter().map(mesh).collect::<Vec<_>>()
        };
        assert_eq!((meshes(along).len(), meshes(across).len(), meshes(small).len()), (3, 3, 0));
        assert_eq!(meshes(along), meshes(again));
        assert!(meshes(along).iter().all(|mesh| !meshes(across).contains(mesh)), "it is long along its other axis");
    }

    #[test]
    fn what_gains_nothing_is_left_whole() {
        let (mut simulation, plane) = with_plane(Vec2::splat(40.0));
        let mut library = simulation.world.resource_mut::<Library>();
        let blended = library.add_material(Material { alpha: AlphaMode::Blend, ..Material::default() });
        let unlit = library.add_material(Material { shading: Shading::Unlit, ..Material::default() });
        let world = &mut simulation.world;
        let whole = [
            world.spawn((plane, blended)).id(),
            world.spawn((plane, unlit)).id(),
            world.spawn((plane, MeshVariants { meshes: vec![plane], shown: 0 })).id(),
            world.spawn(Light::point(1.0, 1.0)).id(),
            world.spawn(MeshId::from_slot(77)).id(),
        ];
        for entity in whole {
            assert_eq!(draw_in_pieces(world, entity, 10.0), PiecesReport::default());
        }
        let object = world.spawn(plane).id();
        for metres in [0.0, -1.0, f32::NAN, f32::INFINITY, 40.0] {
            assert_eq!(draw_in_pieces(world, object, metres), PiecesReport::default());
        }
        assert_eq!(draw_in_pieces(world, object, 39.0).pieces, 4);
    }

    #[test]
    fn pieces_that_would_be_too_many_are_longer() {
        let (mut simulation, land) = with_plane(Vec2::splat(1e5));
        let object = simulation.world.spawn(land).id();
        let report = draw_in_pieces(&mut simulation.world, object, 1.0);
        assert!(report.pieces > 1000 && report.pieces <= crate::assets::split::MOST_PIECES as usize, "{report:?}");
        assert!((report.metres - 1e5 / (report.pieces as f32).sqrt()).abs() < 1.0, "{report:?}");
    }
}
