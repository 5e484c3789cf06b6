//! Scenes too large for the device. As much as fits is drawn, more is refused with an error that says what, and the
//! renderer goes on. The devices here allow less than the adapter does.

use crate::common::{self, prelude::*};
use relief::renderer::RenderError;
use systems::draw::{DrawList, InstanceRecord};

/// A device with lower limits.
fn lowered(lower: impl FnOnce(&mut wgpu::Limits)) -> Option<Gpu> {
    let gpu = common::gpu()?;
    let mut required_limits = gpu.device.limits();
    lower(&mut required_limits);
    let required_features = gpu.device.features();
    let descriptor = wgpu::DeviceDescriptor { required_features, required_limits, ..wgpu::DeviceDescriptor::default() };
    let (device, queue) = pollster::block_on(gpu.adapter.request_device(&descriptor)).expect("less than it has");
    Some(Gpu::of_device(gpu.instance, gpu.adapter, device, queue))
}

/// Buffers of no more than 64 KiB.
fn small_buffers() -> Option<Gpu> {
    lowered(|limits| (limits.max_buffer_size, limits.max_storage_buffer_binding_size) = (1 << 16, 1 << 16))
}

/// Textures of no more than 4096 texels along a side.
fn small_textures() -> Option<Gpu> {
    lowered(|limits| limits.max_texture_dimension_2d = 4096)
}

struct Scene {
    simulation: Simulation,
    camera: Entity,
    cube: MeshId,
}

impl Scene {
    /// A lamp and a camera that looks down on a plain.
    fn new() -> Self {
        let mut simulation = Simulation::new();
        let cube = simulation.world.resource_mut::<Library>().add_mesh_without_levels(shapes::cube(Vec3::ONE));
        simulation.world.spawn((Light::directional(1.0), Transform::default().looking_to(Vec3::NEG_Y, Vec3::X)));
        let place = Transform::from_xyz(0.0, 150.0, 150.0).looking_at(Vec3::ZERO, Vec3::Y);
        let camera = simulation.world.spawn((Camera::default(), place)).id();
        Self { simulation, camera, cube }
    }

    /// Cubes in rows of 128, from the number `first` on.
    fn spawn(&mut self, first: usize, count: usize) -> Vec<Entity> {
        let place = |i: usize| Transform::from_xyz((i % 128) as f32 * 2.0 - 128.0, 0.0, (i / 128) as f32 * 2.0 - 128.0);
        (first..first + count).map(|i| self.simulation.world.spawn((self.cube, place(i))).id()).collect()
    }

    /// One of a material with a map so wide.
    fn spawn_striped(&mut self, number: usize, width: u32) {
        let mut library = self.simulation.world.resource_mut::<Library>();
        let texels = [200, 100, 50, 255].repeat(width as usize);
        let image = library.add_image(Image::rgba8("stripes.png", width, 1, ImageKind::Color, texels));
        let material = library.add_material(Material { base_map: Some(Map::new(image)), ..Material::default() });
        let cube = self.spawn(number, 1)[0];
        self.simulation.world.entity_mut(cube).insert(material);
    }

    fn draw(&mut self, renderer: &mut SingleView) -> Result<image::RgbaImage, RenderError> {
        self.draw_with(renderer, &Settings::default())
    }

    fn draw_with(&mut self, renderer: &mut SingleView, settings: &Settings) -> Result<image::RgbaImage, RenderError> {
        self.simulation.frame();
        let view = Viewpoint::Camera(self.camera).view(&self.simulation.world, (64, 36));
        self.simulation.with_frame(|frame| renderer.prepare(frame, &view, settings))?;
        Ok(renderer.draw_picture())
    }
}

#[test]
fn a_list_grows_to_the_last_byte_and_no_further() {
    let (Some(gpu), Some(small)) = (common::gpu(), small_buffers()) else { return };
    let (mut large, mut small) = (SingleView::new(&gpu), SingleView::new(&small));
    let mut scene = Scene::new();
    // Four bytes for each of 256 pages of 64 objects.
    scene.spawn(0, 16_384);
    let full = scene.draw(&mut small).expect("it fits");
    assert!(full == scene.draw(&mut large).expect("it fits"));
    assert!(full.pixels().any(|pixel| pixel.0[..3] != full.get_pixel(0, 0).0[..3]), "cubes are in sight");
    let more = scene.spawn(16_384, 1);
    let error = scene.draw(&mut small).expect_err("one too many").to_string();
    assert_eq!(error, "too large for this graphics adapter: visibility of objects: 65792 bytes, at most 65536");
    scene.draw(&mut large).expect("it fits");
    // What was too much is gone: the same renderer goes on.
    scene.simulation.world.despawn(more[0]);
    assert!(full == scene.draw(&mut small).expect("it fits again"));
}

#[test]
fn what_is_refused_leaves_no_targets_of_another_kind() {
    let Some(small) = small_textures() else { return };
    let settings = Settings { samples: 1, ..Settings::default() };
    let mut renderer = SingleView::new(&small);
    let mut scene = Scene::new();
    scene.spawn(0, 1000);
    let full = scene.draw_with(&mut renderer, &settings).expect("it fits");
    // Its map is too large, and there are no targets with four samples yet.
    scene.spawn_striped(1000, 4097);
    assert!(scene.draw_with(&mut renderer, &Settings::default()).is_err(), "too large a map");
    // A draw all the same gives nothing, until something was prepared.
    assert_eq!(renderer.draw_picture().dimensions(), (0, 0));
    assert!(renderer.draw_outputs(OutputSet::ALL).is_none());
    let mut scene = Scene::new();
    scene.spawn(0, 1000);
    assert!(full == scene.draw_with(&mut renderer, &settings).expect("another world fits"));
}

#[test]
fn a_mesh_that_is_too_large_is_refused() {
    let Some(small) = small_buffers() else { return };
    let mut renderer = SingleView::new(&small);
    let mut scene = Scene::new();
    scene.cube = scene.simulation.world.resource_mut::<Library>().add_mesh_without_levels(shapes::sphere(1.0, 64, 64));
    scene.spawn(0, 1);
    let error = scene.draw(&mut renderer).expect_err("4,225 vertices").to_string();
    assert!(error.starts_with("too large for this graphics adapter: vertices: ") && error.ends_with("at most 65536"));
}

#[test]
fn a_map_that_is_too_large_is_refused_by_its_name() {
    let Some(small) = small_textures() else { return };
    for (width, fits) in [(4096, true), (4097, false)] {
        let mut renderer = SingleView::new(&small);
        let mut scene = Scene::new();
        scene.spawn_striped(0, width);
        let drawn = scene.draw(&mut renderer).map_err(|error| error.to_string());
        let refused =
            "too large for this graphics adapter: image \"stripes.png\" of 4097x1 texels, at most 4096 along a side";
        assert_eq!(drawn.err().as_deref(), (!fits).then_some(refused));
    }
}

/// Ten, five of the sky, and the shadow maps. Every adapter has 16.
#[test]
fn pixels_read_at_most_sixteen_textures() {
    for (shadows, most) in [(false, 15), (true, 16)] {
        let Some(few) = lowered(|limits| limits.max_sampled_textures_per_shader_stage = most) else { return };
        let gpu = common::gpu().expect("as before");
        let mut scene = Scene::new();
        scene.spawn(0, 1000);
        scene.simulation.world.spawn(Light { shadows, ..Light::point(1.0, 50.0) });
        let picture = scene.draw(&mut SingleView::new(&gpu)).expect("it fits");
        assert!(picture == scene.draw(&mut SingleView::new(&few)).expect("the same with so few"));
    }
}

#[test]
fn more_objects_than_the_largest_texture_holds_are_refused() {
    let Some(small) = small_textures() else { return };
    // The tables of lights, materials and lists of lights have a row each.
    let most = 4093 * 4096 * 16 / size_of::<InstanceRecord>();
    let mut scene = Scene::new();
    scene.simulation.frame();
    let view = Viewpoint::Camera(scene.camera).view(&scene.simulation.world, (64, 36));
    // As many slots as a world of so many objects has.
    let slots = |scene: &mut Scene, count| {
        scene.simulation.world.resource_mut::<DrawList>().instances.objects = vec![None; count];
    };
    slots(&mut scene, most + 1);
    let mut renderer = SingleView::new(&small);
    let refused = scene.simulation.with_frame(|frame| renderer.prepare(frame, &view, &Settings::default()));
    let error = refused.expect_err("one too many").to_string();
    let refused = "too large for this graphics adapter: \
                   the tables of objects, lights, materials and lists of lights: 268500992 bytes";
    assert!(error.starts_with(refused), "{error}");
    slots(&mut scene, 1);
    scene.simulation.with_frame(|frame| renderer.prepare(frame, &view, &Settings::default())).expect("it fits");
}
