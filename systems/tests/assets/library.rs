//! Meshes, materials and images that are replaced and removed while they are used.

use super::*;
use bevy_ecs::prelude::*;
use systems::assets::{AlphaMode, ImageId, Map, Material, MaterialId, MeshId, bounds_of};
use systems::draw::pieces::{Pieces, draw_in_pieces};
use systems::draw::{MaterialTable, TextureArray};
use systems::lights::{Light, SelectedLights};
use systems::space::Transform;

fn library(simulation: &mut Simulation) -> Mut<'_, Library> {
    simulation.world.resource_mut::<Library>()
}

fn image(side: u32, kind: ImageKind) -> Image {
    Image::rgba8("image", side, side, kind, vec![100; (side * side * 4) as usize])
}

fn drawn(simulation: &mut Simulation) -> u32 {
    simulation.frame();
    simulation.draw_list().objects
}

#[test]
fn what_uses_a_mesh_follows_it() {
    let mut simulation = Simulation::new();
    let small = library(&mut simulation).add_mesh(shapes::cube(Vec3::ONE));
    let glass = Material { alpha: AlphaMode::Blend, ..Material::default() };
    let glass = library(&mut simulation).add_material(glass);
    let object = simulation.world.spawn(small).id();
    let pane = simulation.world.spawn((small, glass)).id();
    // Reaches 2 m: what is near, and what is large.
    let lamp = (Light::point(1.0, 2.0), Transform::from_xyz(0.0, 5.0, 0.0));
    simulation.world.spawn(lamp);
    let reached = |simulation: &Simulation| {
        simulation.world.get::<SelectedLights>(object).expect("an object").unpack(simulation.world.resource()).reaching
    };
    assert_eq!((drawn(&mut simulation), reached(&simulation)), (2, 0));
    let blended_radius = |simulation: &Simulation| simulation.draw_list().transparent[0].bounds.radius;
    assert!(library(&mut simulation).replace_mesh(small, shapes::cube(Vec3::splat(8.0))));
    assert_eq!((drawn(&mut simulation), reached(&simulation)), (2, 1));
    let corner = Vec3::splat(4.0).length();
    for radius in [bounds_of(&simulation.world, pane).expect("a mesh").radius, blended_radius(&simulation)] {
        assert!((radius - corner).abs() < 1e-5 * corner, "{radius}");
    }
    let entry = simulation.library().mesh(small).expect("it is there");
    assert!(entry.is_finished() && !entry.mesh.tangents.is_empty());
    // Colours are another pipeline.
    let has_colors = |simulation: &Simulation| simulation.draw_list().batches[0].key.pipeline.vertex_colors;
    assert!(!has_colors(&simulation));
    let mut colored = shapes::cube(Vec3::ONE);
    colored.colors = vec![glam::Vec4::ONE; colored.positions.len()];
    library(&mut simulation).replace_mesh(small, colored);
    assert_eq!((drawn(&mut simulation), reached(&simulation)), (2, 0));
    assert!(has_colors(&simulation));
    // A frame without edits is a still one.
    simulation.frame();
    assert!(simulation.draw_list().instances.dirty.is_empty());
    assert_eq!(simulation.world.resource::<systems::ecs::stats::FrameStats>().selected, 0);
}

#[test]
fn an_id_of_what_was_removed_names_nothing_also_when_its_slot_is_taken() {
    let mut simulation = Simulation::new();
    let cube = library(&mut simulation).add_mesh(shapes::cube(Vec3::ONE));
    let red = library(&mut simulation).add_material(Material { double_sided: true, ..Material::default() });
    let object = simulation.world.spawn((cube, red)).id();
    assert_eq!(drawn(&mut simulation), 1);
    assert!(library(&mut simulation).remove_mesh(cube).is_some());
    assert!(library(&mut simulation).remove_mesh(cube).is_none());
    assert!(!library(&mut simulation).replace_mesh(cube, shapes::cube(Vec3::ONE)));
    assert_eq!(drawn(&mut simulation), 0);
    let sphere = library(&mut simulation).add_mesh(shapes::sphere(1.0, 8, 4));
    assert_eq!((sphere.slot(), sphere.generation()), (cube.slot(), 1));
    assert_eq!(drawn(&mut simulation), 0);
    assert!(bounds_of(&simulation.world, object).is_none());
    simulation.world.entity_mut(object).insert(sphere);
    assert_eq!(drawn(&mut simulation), 1);
    // Its material is the default, whatever takes the slot of its own.
    let materials =
        |simulation: &Simulation| simulation.instance_records().drawn().map(|r| r.material).collect::<Vec<_>>();
    assert_eq!(materials(&simulation), [red.slot()]);
    assert!(library(&mut simulation).remove_material(red).is_some());
    assert!(!library(&mut simulation).edit_material(red, |material| material.shininess = 1.0));
    simulation.frame();
    assert_eq!(materials(&simulation), [MaterialId::DEFAULT.slot()]);
    assert!(!simulation.draw_list().batches[0].key.pipeline.double_sided);
    let other = library(&mut simulation).add_material(Material { double_sided: true, ..Material::default() });
    assert_eq!((other.slot(), other.generation()), (red.slot(), 1));
    simulation.frame();
    assert_eq!(materials(&simulation), [MaterialId::DEFAULT.slot()]);
    // It follows the default's edits.
    library(&mut simulation).edit_material(MaterialId::DEFAULT, |material| material.double_sided = true);
    simulation.frame();
    assert!(simulation.draw_list().batches[0].key.pipeline.double_sided);
}

#[test]
fn the_default_and_the_stand_ins_stay() {
    let mut library = Library::default();
    assert!(library.remove_material(MaterialId::DEFAULT).is_none());
    for stand_in in [ImageId::WHITE_COLOR, ImageId::FLAT_NORMAL, ImageId::NO_OFFSET] {
        assert!(library.remove_image(stand_in).is_none());
        assert!(!library.replace_image(stand_in, image(2, ImageKind::Color)));
    }
    assert_eq!(library.sizes(), Library::default().sizes());
}

#[test]
fn ids_of_first_items_are_saved_as_their_slots_and_all_come_back() {
    let mut library = Library::default();
    let first = library.add_mesh(shapes::cube(Vec3::ONE));
    library.add_mesh(shapes::cube(Vec3::ONE));
    library.remove_mesh(first);
    let second = library.add_mesh(shapes::cube(Vec3::ONE));
    let bytes = |id: MeshId| postcard::to_allocvec(&id).expect("bytes");
    assert_eq!(bytes(MeshId::from_slot(300)), postcard::to_allocvec(&300u32).expect("bytes"));
    assert_eq!(postcard::from_bytes::<MeshId>(&bytes(second)), Ok(second));
    assert!(second != first && second.slot() == first.slot());
}

#[test]
fn pieces_follow_their_mesh() {
    let mut simulation = Simulation::new();
    let plane = |x: f32| shapes::plane(Vec2::new(x, 10.0), UVec2::ONE);
    let road = library(&mut simulation).add_mesh(plane(100.0));
    let object = simulation.world.spawn((road, Transform::from_xyz(0.0, 3.0, 0.0))).id();
    draw_in_pieces(&mut simulation.world, object, 10.0);
    assert_eq!((drawn(&mut simulation), simulation.library().meshes().count()), (10, 11));
    let places = |simulation: &Simulation| {
        let pieces = simulation.world.get::<Pieces>(object);
        let pieces: Vec<Entity> = pieces.map(|pieces| pieces.iter().collect()).unwrap_or_default();
        let bounds = |piece: Entity| bounds_of(&simulation.world, piece).expect("a mesh");
        pieces.into_iter().map(|piece| bounds(piece).center).collect::<Vec<_>>()
    };
    library(&mut simulation).replace_mesh(road, plane(40.0));
    assert_eq!((drawn(&mut simulation), simulation.library().meshes().count()), (4, 5));
    assert!(places(&simulation).iter().all(|center| center.y == 3.0 && center.x.abs() < 20.0));
    // Too short to be cut, and long again.
    library(&mut simulation).replace_mesh(road, plane(5.0));
    assert_eq!((drawn(&mut simulation), simulation.library().meshes().count()), (1, 1));
    assert_eq!(places(&simulation), [Vec3::new(0.0, 3.0, 0.0)]);
    library(&mut simulation).replace_mesh(road, plane(60.0));
    assert_eq!((drawn(&mut simulation), simulation.library().meshes().count()), (6, 7));
    // A disabled object's pieces are not drawn.
    use bevy_ecs::entity_disabling::Disabled;
    simulation.world.entity_mut(object).insert_recursive::<Children>(Disabled);
    library(&mut simulation).replace_mesh(road, plane(30.0));
    assert_eq!(drawn(&mut simulation), 0);
    simulation.world.entity_mut(object).remove_recursive::<Children, Disabled>();
    assert_eq!(drawn(&mut simulation), 3);
    library(&mut simulation).remove_mesh(road);
    assert_eq!((drawn(&mut simulation), simulation.library().meshes().count()), (0, 0));
    assert!(places(&simulation).is_empty());
}

/// Images of a size in one array; a material for each.
fn with_images(count: usize) -> (Simulation, Vec<ImageId>, Vec<MaterialId>) {
    let mut simulation = Simulation::new();
    let mut library = library(&mut simulation);
    let images: Vec<_> = (0..count).map(|_| library.add_image(image(8, ImageKind::Color))).collect();
    let material = |&id: &ImageId| Material { base_map: Some(Map::new(id)), ..Material::default() };
    let materials = images.iter().map(|id| library.add_material(material(id))).collect();
    simulation.frame();
    (simulation, images, materials)
}

fn array_of_eight(simulation: &Simulation) -> Option<&TextureArray> {
    simulation.draw_list().texture_arrays.iter().find(|array| array.width == 8)
}

/// Every material's record names the layers of its images, or of the stand-ins.
fn check_layers(simulation: &Simulation) {
    let (list, library) = (simulation.draw_list(), simulation.library());
    let table = simulation.world.resource::<MaterialTable>();
    for (id, material) in library.materials() {
        let (class, record) = (list.classes[table.placed(id).0.0 as usize], list.materials.records[id.slot() as usize]);
        let at = |map: usize| list.texture_arrays[class.arrays[map] as usize].layers[record.layers[map] as usize];
        let base = material.base_map.map(|map| map.image).filter(|&image| library.image(image).is_some());
        assert_eq!(at(0), Some(base.unwrap_or(ImageId::WHITE_COLOR)));
        assert_eq!(at(1), Some(ImageId::FLAT_NORMAL));
    }
}

#[test]
fn layers_of_removed_images_are_filled_again_and_arrays_shrink() {
    let (mut simulation, images, materials) = with_images(8);
    let layers = |simulation: &mut Simulation| {
        simulation.frame();
        check_layers(simulation);
        array_of_eight(simulation).map_or(0, |array| array.layers.len())
    };
    assert_eq!(layers(&mut simulation), 8);
    library(&mut simulation).remove_image(images[2]);
    library(&mut simulation).remove_image(images[7]);
    assert_eq!(layers(&mut simulation), 7, "the last layer goes, and one is free");
    let new = library(&mut simulation).add_image(image(8, ImageKind::Color));
    assert_eq!(new.slot(), images[2].slot());
    library(&mut simulation).edit_material(materials[7], |material| material.base_map = Some(Map::new(new)));
    assert_eq!(layers(&mut simulation), 7, "the free one is taken");
    for &gone in &images[3..6] {
        library(&mut simulation).remove_image(gone);
    }
    assert_eq!(layers(&mut simulation), 7, "more than half are used");
    library(&mut simulation).remove_image(images[1]);
    assert_eq!(layers(&mut simulation), 3, "the others move up");
    // Another size is another array.
    library(&mut simulation).replace_image(images[0], image(4, ImageKind::Color));
    assert_eq!(layers(&mut simulation), 3, "its layer is free");
    let free = array_of_eight(&simulation).map(|array| array.layers.iter().filter(|layer| layer.is_none()).count());
    assert_eq!(free, Some(1));
    library(&mut simulation).replace_image(images[0], image(8, ImageKind::Color));
    assert_eq!(layers(&mut simulation), 3, "and taken again");
    for gone in [images[0], images[6], new] {
        library(&mut simulation).remove_image(gone);
    }
    assert_eq!(layers(&mut simulation), 0);
    let (arrays, classes) = (simulation.draw_list().texture_arrays.len(), simulation.draw_list().classes.len());
    for side in [16, 2, 64] {
        let other = library(&mut simulation).add_image(image(side, ImageKind::Color));
        library(&mut simulation).edit_material(materials[0], |material| material.base_map = Some(Map::new(other)));
        layers(&mut simulation);
        library(&mut simulation).remove_image(other);
        layers(&mut simulation);
    }
    let list = simulation.draw_list();
    assert_eq!((list.texture_arrays.len(), list.classes.len()), (arrays, classes), "empty ones are used for others");
}

#[test]
fn removed_materials_give_their_classes_back() {
    let (mut simulation, images, materials) = with_images(3);
    library(&mut simulation).replace_image(images[1], image(4, ImageKind::Color));
    simulation.frame();
    let classes = simulation.draw_list().classes.len();
    library(&mut simulation).remove_material(materials[1]);
    simulation.frame();
    for (wrap_u, wrap_v) in [(Wrap::Clamp, Wrap::Clamp), (Wrap::Mirror, Wrap::Clamp), (Wrap::Clamp, Wrap::Mirror)] {
        // Another sampler is another class.
        let sampler = Sampler { wrap_u, wrap_v, ..Sampler::default() };
        let map = Map { sampler, ..Map::new(images[1]) };
        let new = library(&mut simulation).add_material(Material { base_map: Some(map), ..Material::default() });
        simulation.frame();
        check_layers(&simulation);
        assert_eq!(simulation.draw_list().classes.len(), classes);
        assert!(library(&mut simulation).remove_material(new).is_some());
        simulation.frame();
    }
}

#[test]
fn a_loader_that_fails_leaves_no_trace() {
    let (mut simulation, images, _) = with_images(2);
    library(&mut simulation).remove_image(images[0]);
    simulation.frame();
    let mut library = library(&mut simulation);
    let (sizes, before) = (library.sizes(), library.revisions());
    let vain = [image(2, ImageKind::Data), image(2, ImageKind::Data)].map(|image| library.add_image(image));
    library.add_mesh(shapes::cube(Vec3::ONE));
    library.take_back(before);
    assert_eq!(library.sizes(), sizes);
    assert!(vain.iter().all(|&id| library.image(id).is_none()));
    assert_eq!(library.add_image(image(2, ImageKind::Data)), vain[0], "as if they had never been there");
}

#[test]
fn memory_of_what_is_removed_is_given_back() {
    let mut library = Library::default();
    let before = library.bytes();
    let mut after_first = None;
    for _ in 0..1000 {
        let mesh = library.add_mesh(shapes::sphere(1.0, 16, 8));
        let image = library.add_image(image(16, ImageKind::Color));
        library.unfinished_meshes().for_each(systems::assets::MeshEntry::finish);
        let loaded = library.bytes();
        // 16², 8², 4², 2² and 1 texels; a vertex has 12 bytes of position alone.
        assert_eq!(loaded.images - before.images, 4 * 341);
        assert!(loaded.meshes > 12 * 16 * 8);
        library.remove_mesh(mesh);
        library.remove_image(image);
        assert_eq!(library.bytes(), *after_first.get_or_insert(before));
    }
}
