//! Meshes, materials and images that come and go while renderers draw them: pictures equal those of a renderer that
//! sees the world for the first time, and of a world that was made with what is there now; memory goes down.

use crate::common::{self, prelude::*};
use relief::renderer::HeldBytes;
use systems::assets::{Texels, blocks, level_size, tangents};

const SIZE: (u32, u32) = (96, 54);

/// Objects apart from each other before a camera, under a light.
struct Scene {
    simulation: Simulation,
    camera: Entity,
    objects: Vec<Entity>,
}

impl Scene {
    fn new(library: Library, objects: impl Iterator<Item = (MeshId, MaterialId)>) -> Self {
        let mut simulation = Simulation::new();
        simulation.world.insert_resource(library);
        let place = |i: usize| Transform::from_xyz((i % 6) as f32 * 2.4 - 6.0, (i / 6) as f32 * 2.4 - 3.6, -12.0);
        let objects = objects.enumerate().map(|(i, object)| simulation.world.spawn((object, place(i))).id()).collect();
        simulation.world.spawn((Light::point(60.0, 40.0), Transform::from_xyz(2.0, 3.0, 0.0)));
        let camera = simulation.world.spawn(Camera::default()).id();
        Self { simulation, camera, objects }
    }

    fn library(&mut self) -> Mut<'_, Library> {
        self.simulation.world.resource_mut::<Library>()
    }

    /// A world with the same objects and what they use, made at once.
    fn again(&self) -> Self {
        let mut library = Library::default();
        let old = self.simulation.library();
        let images = old.images().map(|(id, image)| {
            let stands_in = library.image(id).is_some_and(|own| own == image);
            (id, if stands_in { id } else { library.add_image(image.clone()) })
        });
        let images: BTreeMap<ImageId, ImageId> = images.collect();
        let materials = old.materials().map(|(id, material)| {
            let mut material = material.clone();
            for map in material.maps_mut() {
                *map = map.and_then(|map| Some(Map { image: *images.get(&map.image)?, ..map }));
            }
            (id, if id == MaterialId::DEFAULT { id } else { library.add_material(material) })
        });
        let materials: BTreeMap<MaterialId, MaterialId> = materials.collect();
        let meshes: BTreeMap<MeshId, MeshId> =
            old.meshes().map(|(id, entry)| (id, library.add_mesh(entry.mesh.clone()))).collect();
        // In place of a mesh that is not there.
        let none = library.add_mesh(Mesh::default());
        let world = &self.simulation.world;
        let objects = self.objects.iter().map(|&object| {
            let (mesh, material) = (world.get::<MeshId>(object), world.get::<MaterialId>(object));
            let mesh = mesh.and_then(|mesh| meshes.get(mesh)).copied().unwrap_or(none);
            (mesh, material.and_then(|material| materials.get(material)).copied().unwrap_or_default())
        });
        Self::new(library, objects.collect::<Vec<_>>().into_iter())
    }
}

fn headless(gpu: &Gpu) -> Headless {
    Headless { renderer: SingleView::new(gpu), settings: Settings::default() }
}

fn draw(headless: &mut Headless, scene: &mut Scene) -> image::RgbaImage {
    let picture = headless.draw(&mut scene.simulation, scene.camera, SIZE).expect("a picture");
    headless.renderer.gpu().check().expect("nothing was refused");
    picture
}

struct Editor {
    random: TestRng,
    /// All ids that there ever were.
    meshes: Vec<MeshId>,
    materials: Vec<MaterialId>,
    images: Vec<ImageId>,
}

impl Editor {
    fn below(&mut self, most: usize) -> usize {
        self.random.random_range(0..most.max(1))
    }

    fn mesh(&mut self) -> Mesh {
        let size = 0.5 + 0.7 * self.random.random::<f32>();
        match self.below(5) {
            0 => shapes::cube(Vec3::splat(size)),
            1 => shapes::sphere(size * 0.7, 24, 16),
            2 => shapes::torus(size * 0.6, size * 0.2, 32, 16),
            3 => {
                let mut mesh = shapes::plane(Vec2::splat(size), UVec2::splat(3));
                mesh.positions.iter_mut().for_each(|p| *p = Vec3::new(p.x, -p.z, p.y));
                mesh.normals.fill(Vec3::Z);
                mesh.colors = mesh.positions.iter().map(|p| (p.abs() * 2.0).min(Vec3::ONE).extend(1.0)).collect();
                mesh
            }
            _ => shapes::cylinder(size * 0.5, size, 9),
        }
    }

    fn image(&mut self) -> Image {
        let side = 4 << self.below(3);
        let kind = if self.below(4) == 0 { ImageKind::Normal } else { ImageKind::Color };
        let texels = (0..side * side).flat_map(|_| [self.random.random(), self.random.random(), 200, 255]).collect();
        let mut image = Image::rgba8("random", side as u32, side as u32, kind, texels);
        match self.below(4) {
            0 => {
                let texels: Vec<Vec4> = image.levels[0]
                    .chunks(4)
                    .map(|texel| Vec4::from_array([0, 1, 2, 3].map(|i| f32::from(texel[i]) / 255.0)))
                    .collect();
                image = Image::rgba16("random", side as u32, side as u32, kind, &texels);
            }
            1 => {
                for (level, texels) in (0..).zip(&mut image.levels) {
                    let (width, height) = level_size(side as u32, side as u32, level);
                    *texels = blocks::encode(texels, width, height);
                }
                image.texels = Texels::Bc7;
            }
            _ => {}
        }
        image
    }

    fn material(&mut self) -> Material {
        let mut map = |of_four: usize| {
            let image = any(&mut self.random, &self.images);
            (self.below(4) < of_four).then(|| Map::new(image))
        };
        let (base_map, normal_map) = (map(3), map(2));
        let base_factor = Vec3::from_array([(); 3].map(|()| 0.3 + 0.7 * self.random.random::<f32>())).extend(0.7);
        let alpha = [AlphaMode::Opaque, AlphaMode::Opaque, AlphaMode::Blend][self.below(3)];
        Material { base_map, normal_map, base_factor, alpha, ..Material::default() }
    }

    /// Something else than before.
    fn edit(&mut self, scene: &mut Scene) {
        let mesh = any(&mut self.random, &self.meshes);
        let material = any(&mut self.random, &self.materials);
        let image = any(&mut self.random, &self.images);
        let (other_mesh, other_material, other_image) = (self.mesh(), self.material(), self.image());
        match self.below(10) {
            0 => _ = scene.library().replace_mesh(mesh, other_mesh),
            1 => _ = scene.library().remove_mesh(mesh),
            2 | 3 => self.meshes.push(scene.library().add_mesh(other_mesh)),
            4 => _ = scene.library().replace_image(image, other_image),
            5 => _ = scene.library().remove_image(image),
            6 => self.images.push(scene.library().add_image(other_image)),
            7 => _ = scene.library().edit_material(material, |material| *material = other_material),
            8 => _ = scene.library().remove_material(material),
            _ => self.materials.push(scene.library().add_material(other_material)),
        }
        // The newest are used most.
        let object = any(&mut self.random, &scene.objects);
        let mesh = any(&mut self.random, &self.meshes[self.meshes.len() - 4..]);
        let material = any(&mut self.random, &self.materials[self.materials.len() - 4..]);
        scene.simulation.world.entity_mut(object).insert((mesh, material));
    }
}

fn any<T: Copy>(random: &mut TestRng, all: &[T]) -> T {
    all[random.random_range(0..all.len())]
}

/// A scene of 24 objects, and who edits it.
fn edited() -> (Scene, Editor) {
    let random = random();
    let mut editor = Editor { random, meshes: Vec::new(), materials: Vec::new(), images: Vec::new() };
    let mut library = Library::default();
    for _ in 0..6 {
        let image = editor.image();
        editor.images.push(library.add_image(image));
        let (material, mesh) = (editor.material(), editor.mesh());
        editor.materials.push(library.add_material(material));
        editor.meshes.push(library.add_mesh(mesh));
    }
    let objects: Vec<_> = (0..24).map(|i| (editor.meshes[i % 6], editor.materials[i * 5 % 6])).collect();
    (Scene::new(library, objects.into_iter()), editor)
}

#[test]
fn two_renderers_follow_every_edit_to_the_bit() {
    let Some(gpu) = common::gpu() else { return };
    let (mut scene, mut editor) = edited();
    let [mut always, mut sometimes] = [(); 2].map(|()| headless(&gpu));
    let mut before = draw(&mut always, &mut scene);
    let mut changed = 0;
    for round in 0..60 {
        for _ in 0..=editor.below(3) {
            editor.edit(&mut scene);
        }
        let picture = draw(&mut always, &mut scene);
        changed += usize::from(picture != before);
        assert!(picture == draw(&mut headless(&gpu), &mut scene), "another renderer, round {round}");
        if round % 7 == 0 {
            assert!(picture == draw(&mut sometimes, &mut scene), "one that missed frames, round {round}");
        }
        if round % 4 == 0 {
            assert!(picture == draw(&mut headless(&gpu), &mut scene.again()), "another world, round {round}");
        }
        // Nothing more is uploaded where nothing changes.
        assert!(draw(&mut always, &mut scene) == picture, "round {round}");
        assert_eq!(always.renderer.stats().asset_bytes, 0);
        before = picture;
    }
    assert!(changed > 40, "{changed} edits were seen");
}

/// Texels that only the GPU has move with the others of their array, whether this shrinks or grows.
#[test]
fn texels_that_are_not_kept_stay_where_layers_move() {
    let Some(gpu) = common::gpu() else { return };
    let mut library = Library::default();
    let colored = |i: usize| {
        let texel = [40 * i as u8, 255 - 30 * i as u8, if i.is_multiple_of(2) { 20 } else { 220 }, 255];
        Image::rgba8("colour", 8, 8, ImageKind::Color, texel.repeat(64))
    };
    let images: Vec<_> = (0..6).map(|i| library.add_image(colored(i))).collect();
    let material = |&image: &ImageId| Material { base_map: Some(Map::new(image)), ..Material::default() };
    let materials: Vec<_> = images.iter().map(|image| library.add_material(material(image))).collect();
    let cube = library.add_mesh(shapes::cube(Vec3::ONE));
    library.keep_texels(false);
    let mut scene = Scene::new(library, materials.iter().map(|&material| (cube, material)));
    let [mut drawing, mut expected] = [(); 2].map(|()| headless(&gpu));
    draw(&mut drawing, &mut scene);
    let layers = |scene: &Scene| {
        let arrays = &scene.simulation.draw_list().texture_arrays;
        arrays.iter().find(|array| array.width == 8).map_or(0, |array| array.layers.len())
    };
    assert_eq!(layers(&scene), 6);
    let mut check = |scene: &mut Scene, shown: &[Option<usize>], count: usize| {
        let picture = draw(&mut drawing, scene);
        assert_eq!(layers(scene), count);
        // Another world, whose library has all texels.
        let mut library = Library::default();
        let images: Vec<_> = shown.iter().map(|shown| shown.map(|i| library.add_image(colored(i)))).collect();
        let materials = images.iter().map(|image| image.map_or_else(Material::default, |image| material(&image)));
        let materials: Vec<_> = materials.map(|material| library.add_material(material)).collect();
        let cube = library.add_mesh(shapes::cube(Vec3::ONE));
        let mut other = Scene::new(library, materials.into_iter().map(|material| (cube, material)));
        assert!(picture == draw(&mut expected, &mut other), "{shown:?}");
    };
    for gone in [0, 1, 3] {
        scene.library().remove_image(images[gone]);
    }
    let moved = [None, None, Some(2), None, Some(4), Some(5)];
    check(&mut scene, &moved, 3);
    // As many again, and more.
    for i in [0, 1, 3] {
        let image = scene.library().add_image(colored(i));
        scene.library().edit_material(materials[i], |edited| *edited = material(&image));
    }
    let grown = [0, 1, 2, 3, 4, 5].map(Some);
    check(&mut scene, &grown, 6);
}

#[test]
fn what_is_unloaded_gives_its_memory_back() {
    let Some(gpu) = common::gpu() else { return };
    let mut library = Library::default();
    let cube = library.add_mesh(shapes::cube(Vec3::ONE));
    let mut scene = Scene::new(library, [(cube, MaterialId::DEFAULT); 2].into_iter());
    let mut headless = headless(&gpu);
    let empty = draw(&mut headless, &mut scene);
    let memory = |headless: &Headless, scene: &Scene| {
        let HeldBytes { meshes, textures, .. } = headless.renderer.held_bytes();
        let held = scene.simulation.library().bytes();
        [meshes, textures, held.meshes, held.images]
    };
    let before = memory(&headless, &scene);
    let mut after_first = None;
    let mut ball = shapes::sphere(1.0, 64, 32);
    tangents::compute_tangents(&mut ball);
    for round in 0..200 {
        let mut library = scene.library();
        let mesh = library.add_mesh_without_levels(ball.clone());
        let texels = [200, 20, 20, 255].repeat(64 * 64);
        let image = library.add_image(Image::rgba8("red", 64, 64, ImageKind::Color, texels));
        let material = Material { base_map: Some(Map::new(image)), base_factor: Vec4::ONE, ..Material::default() };
        let material = library.add_material(material);
        scene.simulation.world.entity_mut(scene.objects[0]).insert((mesh, material));
        let picture = draw(&mut headless, &mut scene);
        let loaded = memory(&headless, &scene);
        if round == 0 {
            // So many vertices of 64 bytes; 4 bytes a texel of 64² and the smaller levels.
            assert!(loaded[0] >= before[0] + 64 * ball.positions.len() as u64, "{loaded:?} after {before:?}");
            assert_eq!(loaded[1], before[1] + 4 * (4096 + 1024 + 256 + 64 + 16 + 4 + 1));
            assert!(loaded[2] > before[2] && loaded[3] > before[3], "{loaded:?} after {before:?}");
        }
        let mut library = scene.library();
        assert!(library.remove_mesh(mesh).is_some() && library.remove_material(material).is_some());
        assert!(library.remove_image(image).is_some());
        // As it was, but for the object that lost its mesh.
        let without = draw(&mut headless, &mut scene);
        assert!(without != picture && without != empty);
        let unloaded = memory(&headless, &scene);
        let [first, ..] = *after_first.get_or_insert([unloaded]);
        assert!((0..4).all(|i| unloaded[i] < loaded[i] && unloaded[i] <= first[i]), "round {round}: {unloaded:?}");
        if round == 0 {
            assert_eq!(unloaded[1..], before[1..]);
            // Small buffers keep their room: 64 KiB each.
            assert!(unloaded[0] <= before[0] + 2 * (64 << 10), "{unloaded:?} after {before:?}");
        }
        scene.simulation.world.entity_mut(scene.objects[0]).insert((cube, MaterialId::DEFAULT));
        if round == 0 {
            assert!(draw(&mut headless, &mut scene) == empty);
        }
    }
}
