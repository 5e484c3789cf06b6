//! Several views of one world in a frame, through one renderer.

use crate::common::{self, prelude::*};
use relief::renderer::{RenderStats, ViewState, ViewTarget, VisibleCounts};

/// Size and settings of each view; the settings differ in all that targets and lists depend on.
fn views() -> [((u32, u32), Settings); 3] {
    let plain = Settings { occlusion: Occlusion::Off, levels: LevelOfDetail::OFF, ..Settings::default() };
    [
        ((96, 54), Settings { occlusion: Occlusion::On, ..plain }),
        ((40, 64), Settings { samples: 1, levels: LevelOfDetail::default(), ..plain }),
        ((64, 64), Settings { occlusion: Occlusion::On, samples: 1, technique: Some(Technique::PerturbedUv), ..plain }),
    ]
}

struct Scene {
    simulation: Simulation,
    cameras: [Entity; 3],
    objects: Vec<Entity>,
    meshes: [MeshId; 2],
    materials: [MaterialId; 3],
    random: TestRng,
}

impl Scene {
    /// Objects among which others are hidden, blended ones and masked ones; three cameras between them.
    fn new(count: usize) -> Self {
        let mut simulation = Simulation::new();
        let mut library = simulation.world.resource_mut::<Library>();
        let meshes = [shapes::cube(Vec3::ONE), shapes::sphere(0.5, 24, 16)].map(|shape| library.add_mesh(shape));
        let materials = [AlphaMode::Opaque, AlphaMode::Mask, AlphaMode::Blend].map(|alpha| {
            let base_factor = Vec3::new(0.8, 0.5, 0.3).extend(0.6);
            library.add_material(Material { base_factor, alpha, ..Material::default() })
        });
        simulation.world.spawn(Light::directional(1.0));
        let cameras = [0, 1, 2].map(|_| simulation.world.spawn(Camera::default()).id());
        let random = random();
        let mut scene = Self { simulation, cameras, objects: Vec::new(), meshes, materials, random };
        for _ in 0..count {
            scene.spawn();
        }
        scene
    }

    fn spawn(&mut self) {
        let (mesh, material) = (self.random.random_range(0..2), self.random.random_range(0..3));
        let object = (self.meshes[mesh], self.materials[material], self.place());
        self.objects.push(self.simulation.world.spawn(object).id());
    }

    fn place(&mut self) -> Transform {
        let mut number = || self.random.random::<f32>() * 2.0 - 1.0;
        let place = Vec3::new(number(), number() * 0.3, number()) * 12.0;
        let turn = Quat::from_euler(EulerRot::XYZ, number() * 3.0, number() * 3.0, 0.0);
        Transform::from_translation(place).with_rotation(turn)
    }

    /// Some objects and all cameras move, some objects come and go.
    fn go_on(&mut self) {
        for index in (0..self.objects.len()).step_by(5) {
            let place = self.place();
            *self.simulation.world.get_mut::<Transform>(self.objects[index]).expect("a place") = place;
        }
        for camera in self.cameras {
            let turn = Quat::from_rotation_y(self.random.random::<f32>() * 6.0);
            *self.simulation.world.get_mut::<Transform>(camera).expect("a place") = Transform::from_rotation(turn);
        }
        let gone = self.objects.swap_remove(self.random.random_range(0..self.objects.len()));
        self.simulation.world.despawn(gone);
        self.spawn();
        self.simulation.frame();
    }

    fn plan(&self, view: usize) -> ViewPlan {
        let (size, settings) = views()[view];
        ViewPlan { view: Viewpoint::Camera(self.cameras[view]).view(&self.simulation.world, size), settings }
    }
}

/// The pictures of some views in one frame, and how much each drew.
fn draw(
    renderer: &mut Renderer,
    states: &mut [ViewState],
    scene: &mut Scene,
    which: &[usize],
) -> Vec<(Vec<u8>, VisibleCounts)> {
    let plans: Vec<_> = which.iter().map(|&view| scene.plan(view)).collect();
    let sizes: Vec<_> = plans.iter().map(|plan| (plan.view.width, plan.view.height)).collect();
    let mut views: Vec<_> = states.iter_mut().zip(plans).collect();
    scene.simulation.with_frame(|frame| renderer.prepare(frame, &mut views)).expect("they fit");
    let gpu = renderer.gpu().clone();
    let textures: Vec<_> = sizes.into_iter().map(|size| picture_texture(&gpu, size)).collect();
    let targets: Vec<_> = textures.iter().map(|texture| texture.create_view(&Default::default())).collect();
    let views = states.iter_mut().zip(&targets);
    let mut views: Vec<_> = views.map(|(state, target)| ViewTarget::new(state, target, PICTURE_FORMAT)).collect();
    common::encode(renderer, &mut views);
    drop(views);
    let pictures = textures.iter().map(|texture| read_texture(&gpu, texture));
    pictures.zip(states).map(|(picture, state)| (picture, renderer.read_visible_counts(state))).collect()
}

/// The picture of a view by itself, with a renderer of its own, and how much that drew.
fn draw_alone(renderer: &mut SingleView, scene: &mut Scene, view: usize) -> (Vec<u8>, VisibleCounts) {
    let ViewPlan { view, settings } = scene.plan(view);
    scene.simulation.with_frame(|frame| renderer.prepare(frame, &view, &settings)).expect("it fits");
    (renderer.draw_picture().into_raw(), renderer.read_visible_counts())
}

fn scene_bytes(stats: RenderStats) -> u64 {
    stats.instance_bytes + stats.light_bytes + stats.material_bytes + stats.asset_bytes
}

/// Each view has what it would have had alone, to the bit: its picture, and what was seen of it before, which decides
/// how much is drawn. What they share is uploaded once.
#[test]
fn views_of_a_frame_look_as_if_each_were_drawn_alone() {
    let Some(gpu) = common::gpu() else { return };
    let mut scene = Scene::new(300);
    let mut renderer = Renderer::new(&gpu);
    let mut states = [0, 1, 2].map(|_| ViewState::new(&gpu));
    let mut alone = [0, 1, 2].map(|_| SingleView::new(&gpu));
    for frame in 0..8 {
        scene.go_on();
        // A view may rest for a frame, with its history as it was.
        let which: &[usize] = if frame == 5 { &[0] } else { &[0, 1, 2] };
        let drawn = draw(&mut renderer, &mut states[..which.len()], &mut scene, which);
        for (&view, drawn) in which.iter().zip(drawn) {
            let expected = draw_alone(&mut alone[view], &mut scene, view);
            assert!(drawn.0 == expected.0, "frame {frame}: the picture of view {view} differs");
            assert_eq!(drawn.1, expected.1, "frame {frame}: what view {view} drew");
            if view == 0 {
                assert_eq!(scene_bytes(renderer.stats()), scene_bytes(alone[0].stats()), "frame {frame}: uploads");
            }
        }
    }
}

/// A view that is not told so still belongs to what it was made for.
#[test]
fn a_view_begins_anew_with_another_renderer_and_another_world() {
    let Some(gpu) = common::gpu() else { return };
    let mut scenes = [Scene::new(40), Scene::new(90)];
    let mut renderers = [Renderer::new(&gpu), Renderer::new(&gpu)];
    let mut states = [ViewState::new(&gpu)];
    scenes.iter_mut().for_each(Scene::go_on);
    for (renderer, scene) in [(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)] {
        let scene = &mut scenes[scene];
        let drawn = draw(&mut renderers[renderer], &mut states, scene, &[0]);
        let expected = draw_alone(&mut SingleView::new(&gpu), scene, 0);
        assert!(drawn[0].0 == expected.0, "renderer {renderer}");
    }
}

/// Views that are prepared and have not changed need not be drawn again, one by one.
#[test]
fn a_view_is_to_be_drawn_again_if_it_or_the_world_has_changed() {
    let Some(gpu) = common::gpu() else { return };
    let mut scene = Scene::new(20);
    scene.go_on();
    let mut renderer = Renderer::new(&gpu);
    let mut states = [ViewState::new(&gpu), ViewState::new(&gpu)];
    draw(&mut renderer, &mut states, &mut scene, &[0, 1]);
    let mut needs_redraw = |renderer: &mut Renderer, scene: &mut Scene| {
        scene.simulation.frame();
        let plans = [scene.plan(0), scene.plan(1)];
        let mut views: Vec<_> = states.iter_mut().zip(plans).collect();
        scene.simulation.with_frame(|frame| renderer.prepare(frame, &mut views)).expect("they fit");
        let needs = views.iter().map(|(state, _)| state.needs_redraw()).collect::<Vec<_>>();
        draw(renderer, &mut states, scene, &[0, 1]);
        needs
    };
    // Twice more in two phases.
    for _ in 0..3 {
        needs_redraw(&mut renderer, &mut scene);
    }
    assert_eq!(needs_redraw(&mut renderer, &mut scene), [false, false], "nothing changed");
    let turned = Transform::from_rotation(Quat::from_rotation_y(1.0));
    *scene.simulation.world.get_mut::<Transform>(scene.cameras[1]).expect("a place") = turned;
    assert_eq!(needs_redraw(&mut renderer, &mut scene), [false, true], "one camera turned");
    let moved = scene.place();
    *scene.simulation.world.get_mut::<Transform>(scene.objects[0]).expect("a place") = moved;
    assert_eq!(needs_redraw(&mut renderer, &mut scene), [true, true], "an object moved");
}

/// Lists have changed for a view that rests: nothing is drawn of it, and nothing is told.
#[test]
fn a_view_that_rests_is_not_drawn_and_shows_nothing() {
    let Some(gpu) = common::gpu() else { return };
    let mut scene = Scene::new(30);
    scene.go_on();
    let mut renderer = Renderer::new(&gpu);
    let mut states = [ViewState::new(&gpu), ViewState::new(&gpu)];
    draw(&mut renderer, &mut states, &mut scene, &[0, 1]);
    assert!(renderer.draw_outputs(&mut states[1], OutputSet::ALL).is_some());
    assert!(renderer.read_visible_counts(&states[1]).objects > 0);
    (0..200).for_each(|_| scene.spawn());
    let torus = scene.simulation.world.resource_mut::<Library>().add_mesh(shapes::torus(0.5, 0.2, 8, 6));
    scene.simulation.world.spawn((torus, scene.materials[1]));
    scene.go_on();
    draw(&mut renderer, &mut states[..1], &mut scene, &[0]);
    assert!(renderer.draw_outputs(&mut states[1], OutputSet::ALL).is_none());
    assert_eq!(renderer.read_visible_counts(&states[1]), VisibleCounts::default());
    assert!(renderer.read_visible_slots(&states[1]).is_empty());
    let picture = picture_texture(&gpu, views()[1].0);
    let target = picture.create_view(&Default::default());
    let record = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        common::encode(&mut renderer, &mut [ViewTarget::new(&mut states[1], &target, PICTURE_FORMAT)]);
    }));
    assert!(record.is_err(), "refused");
}
