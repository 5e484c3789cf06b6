//! Costs of frames: draws, and bytes uploaded, for generated scenes.

use crate::common::{self, headless, prelude::*};
use systems::assets::texture_memory;
use systems::draw::InstanceRecord;
use systems::lights::PackedLight;

const SIZE: (u32, u32) = (32, 18);

struct Field {
    simulation: Simulation,
    headless: Headless,
    camera: Entity,
    objects: Vec<Entity>,
}

impl Field {
    /// Objects on a grid with 4 meshes and 16 materials in turn, each with maps of its own.
    fn new(count: u32) -> Option<Self> {
        let gpu = common::gpu()?;
        let mut simulation = Simulation::new();
        let mut library = simulation.world.resource_mut::<Library>();
        let meshes = [
            library.add_mesh(shapes::cube(Vec3::ONE)),
            library.add_mesh(shapes::sphere(0.5, 6, 4)),
            library.add_mesh(shapes::plane(Vec2::ONE, UVec2::ONE)),
            library.add_mesh(shapes::cylinder(0.5, 1.0, 6)),
        ];
        let mut image = |kind, value| library.add_image(Image::rgba8("map", 8, 8, kind, vec![value; 256]));
        let maps: Vec<_> =
            (0..16).map(|i| (Map::new(image(ImageKind::Color, i)), Map::new(image(ImageKind::Normal, 128)))).collect();
        let materials: Vec<_> = maps
            .into_iter()
            .map(|(base, normal)| {
                let (base_map, normal_map) = (Some(base), Some(normal));
                library.add_material(Material { base_map, normal_map, ..Material::default() })
            })
            .collect();
        let place = |i: u32| Transform::from_xyz((i % 100) as f32 * 2.0, 0.0, (i / 100) as f32 * -2.0);
        let objects = (0..count)
            .map(|i| simulation.world.spawn((meshes[i as usize % 4], materials[i as usize / 4 % 16], place(i))).id())
            .collect();
        let eye = Transform::from_xyz(100.0, 400.0, 300.0).looking_at(Vec3::new(100.0, 0.0, -100.0), Vec3::Y);
        let camera = simulation.world.spawn((Camera::default(), eye)).id();
        simulation.world.spawn((Light::directional(1.0), Transform::default().looking_to(Vec3::NEG_Y, Vec3::X)));
        Some(Self { simulation, headless: headless(&gpu), camera, objects })
    }

    fn draw(&mut self) -> (relief::renderer::RenderStats, image::RgbaImage) {
        let picture = self.headless.draw(&mut self.simulation, self.camera, SIZE).expect("a picture");
        (self.headless.renderer.stats(), picture)
    }

    fn height(&mut self, object: Entity) -> Mut<'_, f32> {
        let place = self.simulation.world.get_mut::<Transform>(object).expect("a place");
        place.map_unchanged(|place| &mut place.translation.y)
    }

    /// The picture of a renderer that saw nothing before.
    fn draw_afresh(&mut self) -> image::RgbaImage {
        let mut fresh = headless(self.headless.renderer.gpu());
        fresh.draw(&mut self.simulation, self.camera, SIZE).expect("a picture")
    }

    /// Prepares the world's last frame; true if it is to be drawn.
    fn prepare(&mut self, settings: &Settings) -> bool {
        let view = relief::viewpoint::Viewpoint::Camera(self.camera).view(&self.simulation.world, SIZE);
        self.simulation.with_frame(|frame| self.headless.renderer.prepare(frame, &view, settings)).expect("it fits")
    }

    /// Objects in a picture that is large enough for each of them to cover a pixel.
    fn visible_counts(&mut self) -> u32 {
        self.headless.draw(&mut self.simulation, self.camera, (1280, 720)).expect("a picture");
        self.headless.renderer.read_visible_counts().objects
    }
}

#[test]
fn ten_thousand_objects_draw_in_few_calls_and_a_still_frame_uploads_nothing() {
    let Some(mut field) = Field::new(10_000) else { return };
    let (first, _) = field.draw();
    let told = "one per mesh in either phase: all materials share one pipeline";
    assert_eq!((first.draws, first.draw_calls), (8, 2), "{told}");
    let pages = 4 * 2_500u64.div_ceil(64);
    assert!(first.instance_bytes <= pages * 64 * size_of::<InstanceRecord>() as u64, "{}", first.instance_bytes);
    let (still, _) = field.draw();
    assert_eq!((still.uploaded_bytes(), still.draws), (0, 8));
    assert_eq!(field.visible_counts(), 10_000);
}

#[test]
fn what_moves_is_uploaded_and_nothing_else() {
    let Some(mut field) = Field::new(2_000) else { return };
    field.draw();
    let record = size_of::<InstanceRecord>() as u64;
    for object in [7, 900, 1_999] {
        *field.height(field.objects[object]) = 1.0;
    }
    let (moved, _) = field.draw();
    assert_eq!((moved.instance_bytes, moved.list_bytes, moved.asset_bytes), (3 * record, 0, 0));
    let lamp = field.simulation.world.spawn((Light::point(1.0, 0.5), Transform::from_xyz(-50.0, 0.0, 0.0))).id();
    let (lit, _) = field.draw();
    assert_eq!((lit.light_bytes, lit.instance_bytes), (size_of::<PackedLight>() as u64, 0), "it reaches nothing");
    field.simulation.world.despawn(lamp);
    field.simulation.world.despawn(field.objects[5]);
    let (gone, _) = field.draw();
    assert_eq!((gone.light_bytes, field.visible_counts()), (size_of::<PackedLight>() as u64, 1_999));
}

#[test]
fn changes_here_and_there_arrive_also_from_frames_that_nobody_drew() {
    let Some(mut field) = Field::new(10_000) else { return };
    field.draw();
    let move_some = |field: &mut Field, first: usize, height: f32| {
        let some: Vec<Entity> = field.objects.iter().copied().skip(first).step_by(151).collect();
        for &object in &some {
            *field.height(object) = height;
        }
        some.len() as u64
    };
    let moved = move_some(&mut field, 0, 9.0);
    let (stats, _) = field.draw();
    assert_eq!(stats.instance_bytes, moved * (size_of::<InstanceRecord>() as u64 + 4), "records and their slots");
    // The same objects twice, and drawn once; then a few of them, which go another way.
    for (first, height) in [(7, 20.0), (7, 3.0), (20, 5.0)] {
        move_some(&mut field, first, height);
        field.simulation.frame();
        field.prepare(&Settings::default());
    }
    for object in [20, 171] {
        *field.height(field.objects[object]) = 30.0;
    }
    let (_, seen) = field.draw();
    assert!(field.draw_afresh() == seen);
}

#[test]
fn a_table_that_grows_takes_the_others_along() {
    // Each table fits into the one row that it has at first.
    let Some(mut field) = Field::new(300) else { return };
    let (_, before) = field.draw();
    // More than the 819 lights of a row, and no object near them.
    let lamps = 2_000;
    for _ in 0..lamps {
        field.simulation.world.spawn((Light::point(1.0, 0.5), Transform::from_xyz(-50.0, 0.0, 0.0)));
    }
    let (lit, same) = field.draw();
    assert_eq!((lit.light_bytes, lit.instance_bytes), (lamps * size_of::<PackedLight>() as u64, 0));
    assert!(same == before);
    // Lights and materials lie behind the objects, whose table is the next to grow.
    let mesh = *field.simulation.world.get::<MeshId>(field.objects[0]).expect("a mesh");
    for i in 0..2_000u16 {
        let place = Transform::from_xyz(f32::from(i % 100) * 2.0, 1.0, f32::from(i / 100) * -2.0);
        field.simulation.world.spawn((mesh, place));
    }
    let (more, seen) = field.draw();
    let record = size_of::<InstanceRecord>() as u64;
    assert!((2_000 * record..2_300 * record).contains(&more.instance_bytes), "{}", more.instance_bytes);
    assert!(seen != before);
    assert!(field.draw_afresh() == seen);
}

#[test]
fn a_renderer_that_missed_frames_shows_the_same_as_one_that_saw_all() {
    let (Some(mut field), Some(gpu)) = (Field::new(300), common::gpu()) else { return };
    let mut late = SingleView::new(&gpu);
    for frame in 0..5 {
        for (i, object) in field.objects.clone().into_iter().enumerate().skip(frame).step_by(3) {
            *field.height(object) = i as f32 * 0.1;
        }
        let (_, seen) = field.draw();
        if frame == 1 || frame == 4 {
            std::mem::swap(&mut late, &mut field.headless.renderer);
            field.prepare(&Settings::default());
            assert!(field.headless.renderer.draw_picture() == seen, "frame {frame}");
            std::mem::swap(&mut late, &mut field.headless.renderer);
        }
    }
}

#[test]
fn a_picture_that_cannot_differ_is_shown_again_and_any_change_is_noticed() {
    let Some(mut field) = Field::new(40) else { return };
    let (_, drawn) = field.draw();
    // What differs is drawn then.
    let prepare = |field: &mut Field, settings: &Settings| {
        field.simulation.frame();
        let differs = field.prepare(settings);
        differs.then(|| field.headless.renderer.draw_picture());
        differs
    };
    let still = Settings::default();
    assert!(!prepare(&mut field, &still), "nothing changed");
    assert!(field.headless.renderer.draw_picture() == drawn);
    assert!(!prepare(&mut field, &still));
    let technique = Some(systems::assets::Technique::Off);
    assert!(prepare(&mut field, &Settings { technique, ..still }), "another technique");
    assert!(prepare(&mut field, &still), "and back");
    let levels = LevelOfDetail { max_error_pixels: 4.0, ..still.levels };
    assert!(prepare(&mut field, &Settings { levels, ..still }), "other levels of detail");
    assert!(prepare(&mut field, &still), "and back");
    *field.height(field.objects[3]) = 0.5;
    assert!(prepare(&mut field, &still), "an object moved");
    *field.height(field.camera) += 1.0;
    assert!(prepare(&mut field, &still), "the camera moved");
    field.simulation.world.resource_mut::<systems::draw::Environment>().ambient = Vec3::ONE;
    assert!(prepare(&mut field, &still), "the environment changed");
    field.simulation.world.insert_resource(LightPolicies::forced(LightPolicy::All));
    assert!(!prepare(&mut field, &still), "no more than three lights reach any object, whatever the policy");
    field.simulation.world.despawn(field.objects[0]);
    assert!(prepare(&mut field, &still), "an object went");
    assert!(!prepare(&mut field, &still));
    for object in field.objects.split_off(1) {
        field.simulation.world.despawn(object);
    }
    assert!(prepare(&mut field, &still), "the last object went");
}

#[test]
fn what_was_prepared_and_not_drawn_is_still_to_be_drawn() {
    let Some(mut field) = Field::new(40) else { return };
    field.draw();
    *field.height(field.objects[3]) = 20.0;
    for _ in 0..2 {
        field.simulation.frame();
        assert!(field.prepare(&Settings::default()));
    }
}

#[test]
fn images_that_come_one_by_one_are_uploaded_once_each() {
    let Some(mut field) = Field::new(30) else { return };
    field.draw();
    // Not a power of two: levels of odd sizes are copied, too.
    let (width, height) = (20, 12);
    for i in 0..30 {
        let mut library = field.simulation.world.resource_mut::<Library>();
        let texels =
            (0..width * height).flat_map(|texel| [i as u8 * 8, (texel % 7 * 36) as u8, 255 - i as u8 * 8, 255]);
        let image = Image::rgba8("late", width, height, ImageKind::Color, texels.collect());
        let bytes: usize = image.levels.iter().map(Vec::len).sum();
        let base_map = Some(Map::new(library.add_image(image)));
        let material = library.add_material(Material { base_map, ..Material::default() });
        field.simulation.world.entity_mut(field.objects[i]).insert(material);
        let (stats, _) = field.draw();
        assert_eq!(stats.asset_bytes, bytes as u64, "image {i}");
    }
    let (_, seen) = field.draw();
    assert!(field.draw_afresh() == seen);
}

#[test]
fn an_entity_whose_mesh_becomes_an_empty_one_is_gone() {
    let Some(mut field) = Field::new(9) else { return };
    field.draw();
    let empty = field.simulation.world.resource_mut::<Library>().add_mesh(systems::assets::Mesh::default());
    field.simulation.world.entity_mut(field.objects[4]).insert(empty);
    field.draw();
    assert_eq!(field.visible_counts(), 8);
    let back = *field.simulation.world.get::<systems::assets::MeshId>(field.objects[0]).expect("a mesh");
    field.simulation.world.entity_mut(field.objects[4]).insert(back);
    field.draw();
    assert_eq!(field.visible_counts(), 9);
}

#[test]
fn meshes_and_materials_that_come_later_are_drawn() {
    let Some(mut field) = Field::new(50) else { return };
    let (before, picture) = field.draw();
    let drawn = field.visible_counts();
    let mut library = field.simulation.world.resource_mut::<Library>();
    let big = library.add_mesh(shapes::sphere(30.0, 12, 8));
    let image = Image::rgba8("late", 16, 16, ImageKind::Color, vec![200; 1024]);
    let base_map = Some(Map::new(library.add_image(image)));
    let material = library.add_material(Material { base_map, alpha: AlphaMode::Blend, ..Material::default() });
    field.simulation.world.spawn((big, material, Transform::from_xyz(100.0, 0.0, -40.0)));
    let (after, changed) = field.draw();
    assert_eq!((field.visible_counts(), after.draws), (drawn + 1, before.draws + 1));
    assert!(after.asset_bytes > 0 && changed != picture);
}

#[test]
fn texels_that_are_not_kept_are_held_by_one_renderer_alone() {
    let (Some(mut kept), Some(mut field)) = (Field::new(50), Field::new(50)) else { return };
    for field in [&mut kept, &mut field] {
        let near = Transform::from_xyz(20.0, 12.0, 12.0).looking_at(Vec3::X * 20.0, Vec3::Y);
        field.simulation.world.entity_mut(field.camera).insert(near);
    }
    field.simulation.world.resource_mut::<Library>().keep_texels(false);
    let library = |field: &Field| texture_memory::used(field.simulation.library());
    let before = library(&field);
    assert!(field.draw().1 == kept.draw().1);
    // The first images stand in for missing maps.
    let has_texels = |field: &Field, i: u32| {
        !field.simulation.library().image(ImageId::from_slot(i)).expect("it is there").levels.is_empty()
    };
    assert!(has_texels(&kept, 8) && !has_texels(&field, 8));
    assert_eq!(library(&field), before, "what textures take stays known");
    // One more of the same size: the array grows, and the others are where they were.
    let add = |field: &mut Field| {
        let mut library = field.simulation.world.resource_mut::<Library>();
        let image = Image::rgba8("late", 8, 8, ImageKind::Color, vec![250; 256]);
        let base_map = Some(Map::new(library.add_image(image)));
        let material = library.add_material(Material { base_map, ..Material::default() });
        for &object in &field.objects[..20] {
            field.simulation.world.entity_mut(object).insert(material);
        }
    };
    let old = field.draw().1;
    [&mut kept, &mut field].into_iter().for_each(add);
    let new = field.draw().1;
    assert!(new != old, "it is seen");
    assert!(new == kept.draw().1);
    let mut other = headless(field.headless.renderer.gpu());
    let refused = other.draw(&mut field.simulation, field.camera, SIZE).expect_err("no texels").to_string();
    assert!(refused.starts_with("texels of image \"white colour\" were released"), "{refused}");
    assert!(other.draw(&mut kept.simulation, kept.camera, SIZE).expect("a picture") == new);
}
