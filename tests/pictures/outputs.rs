//! Outputs of a view: drawn with the picture or after it, read back together, and picked at a pixel.

use crate::common::{self, prelude::*};
use relief::renderer::{Outputs, Picked};

const SIZE: (u32, u32) = (70, 45);

struct Scene {
    simulation: Simulation,
    camera: Entity,
}

impl Scene {
    /// Objects of all kinds before a camera, some behind others: opaque, masked and blended, of a technique that writes
    /// depth, one with a vertex shader of its own, and two without either.
    fn new() -> Self {
        Self::of([AlphaMode::Opaque, AlphaMode::Opaque, AlphaMode::Mask, AlphaMode::Blend])
    }

    fn of(alphas: [AlphaMode; 4]) -> Self {
        let mut simulation = Simulation::new();
        let mut random = random();
        let camera = simulation.world.spawn(Camera::default()).id();
        simulation.world.spawn(Light::directional(2.0));
        let mut library = simulation.world.resource_mut::<Library>();
        let cube = library.add_mesh(shapes::cube(Vec3::ONE));
        let techniques = [Technique::Normal, Technique::ZCorrect, Technique::Dot3, Technique::Off];
        let materials: Vec<_> = techniques
            .into_iter()
            .flat_map(|technique| alphas.map(|alpha| (technique, alpha)))
            .map(|(technique, alpha)| {
                let base_factor = Vec3::new(0.7, 0.4, 0.2).extend(if alpha == AlphaMode::Opaque { 1.0 } else { 0.6 });
                library.add_material(Material { base_factor, alpha, technique, ..Material::default() })
            })
            .collect();
        for index in 0..120 {
            let mut number = || random.random::<f32>() * 2.0 - 1.0;
            let place = Vec3::new(number() * 4.0, number() * 3.0, -7.0 + number() * 4.0);
            simulation.world.spawn((cube, materials[index % materials.len()], Transform::from_translation(place)));
        }
        Self { simulation, camera }
    }

    fn view(&self) -> View {
        Viewpoint::Camera(self.camera).view(&self.simulation.world, SIZE)
    }

    fn prepare(&mut self, renderer: &mut SingleView, settings: &Settings) {
        self.simulation.frame();
        let view = self.view();
        self.simulation.with_frame(|frame| renderer.prepare(frame, &view, settings)).expect("it fits");
    }

    fn draw(&mut self, gpu: &Gpu, settings: Settings, wanted: OutputSet) -> Outputs {
        let mut renderer = SingleView::new(gpu);
        self.prepare(&mut renderer, &settings);
        renderer.draw_outputs(wanted).expect("prepared")
    }
}

/// Settings with one sample per pixel.
fn single(outputs: OutputSet) -> Settings {
    Settings { samples: 1, outputs, ..Settings::default() }
}

/// The same pixels of the outputs that were asked for: entities, and depths and normals of the same surfaces. Two
/// compiled shaders may round apart: a depth of 32 bits is the end of some ten operations, of less than 2⁻²⁴ each; a
/// normal is stored in half floats, to 2⁻¹¹.
fn assert_near(found: &Outputs, expected: &Outputs, what: &str) {
    let entities = found.entities();
    assert!(entities.is_empty() || entities == expected.entities(), "{what}: entities");
    for (pixel, (a, b)) in found.depths().into_iter().zip(expected.depths()).enumerate() {
        assert!(a == b || (a - b).abs() < 1e-5 * b, "{what}: depth of pixel {pixel}: {a}, not {b}");
    }
    for (pixel, (a, b)) in found.normals().into_iter().zip(expected.normals()).enumerate() {
        let apart = Vec3::from(a).distance(Vec3::from(b));
        assert!(apart < 2e-3, "{what}: normal of pixel {pixel}: {a:?}, not {b:?}");
    }
}

/// [`assert_near`], of all outputs.
fn assert_same(found: &Outputs, expected: &Outputs, what: &str) {
    let seen = expected.entities();
    assert!(seen.iter().any(Option::is_some) && seen.iter().any(Option::is_none), "{what}: both");
    let counts = |outputs: &Outputs| [outputs.depths().len(), outputs.normals().len(), outputs.entities().len()];
    assert_eq!(counts(found), counts(expected), "{what}");
    assert_near(found, expected, what);
}

#[test]
fn outputs_that_are_drawn_with_the_picture_are_those_of_a_pass_of_their_own() {
    let Some(gpu) = common::gpu() else { return };
    let solid = [AlphaMode::Opaque, AlphaMode::Mask, AlphaMode::Opaque, AlphaMode::Mask];
    for occlusion in [Occlusion::Off, Occlusion::On] {
        for (mut scene, blended) in [(Scene::new(), true), (Scene::of(solid), false)] {
            let of = |outputs| Settings { occlusion, ..single(outputs) };
            let apart = scene.draw(&gpu, of(OutputSet::COLOR), OutputSet::ALL);
            let mut renderer = SingleView::new(&gpu);
            scene.prepare(&mut renderer, &of(OutputSet::ALL));
            assert!(renderer.state().draws_together());
            let together = renderer.draw_outputs(OutputSet::ALL).expect("prepared");
            assert_same(&together, &apart, "together");
            let (found, expected) = (together.picture.expect("asked for"), apart.picture.expect("asked for"));
            // Two compiled shaders may round a half float apart, which is at most one step of 8 bits.
            let steps = found.iter().zip(expected.iter()).map(|(a, b)| a.abs_diff(*b)).max();
            assert!(steps <= Some(1), "{occlusion:?}, blended {blended}: {steps:?} steps");
        }
    }
}

#[test]
fn a_view_says_whether_outputs_are_drawn_with_the_picture() {
    let Some(gpu) = common::gpu() else { return };
    let mut scene = Scene::new();
    let mut renderer = SingleView::new(&gpu);
    for (settings, together) in [
        (single(OutputSet::ALL), true),
        (single(OutputSet { normal: false, ..OutputSet::ALL }), true),
        (single(OutputSet::COLOR), false),
        (single(OutputSet::ALL.beside_color()), false),
        (Settings { samples: 4, ..single(OutputSet::ALL) }, false),
        (Settings { technique: Some(Technique::EmbossMultipass), ..single(OutputSet::ALL) }, false),
    ] {
        scene.prepare(&mut renderer, &settings);
        assert_eq!(renderer.state().draws_together(), together, "{settings:?}");
    }
}

#[test]
fn each_set_of_outputs_is_what_it_is_among_all() {
    let Some(gpu) = common::gpu() else { return };
    let mut scene = Scene::new();
    let all = scene.draw(&gpu, Settings::default(), OutputSet::ALL);
    let mut renderer = SingleView::new(&gpu);
    // Each set after smaller ones and after larger ones, whose textures are still there.
    for bits in (0..16_u32).chain((0..16).rev()) {
        let bit = |place: u32| bits >> place & 1 == 1;
        let wanted = OutputSet { color: bit(0), depth: bit(1), normal: bit(2), id: bit(3), linear: bit(4) };
        // Asked for in the settings, or afterwards, with a renderer that has drawn other sets before.
        for outputs in [wanted, OutputSet::COLOR] {
            scene.prepare(&mut renderer, &Settings { outputs, ..Settings::default() });
            let found = renderer.draw_outputs(wanted).expect("prepared");
            assert_eq!(found.picture, all.picture.clone().filter(|_| wanted.color), "{wanted:?} of {outputs:?}");
            let counts = [found.depths().len(), found.normals().len(), found.entities().len()];
            let pixels = (SIZE.0 * SIZE.1) as usize;
            let expected = [wanted.depth, wanted.normal, wanted.id].map(|wanted| if wanted { pixels } else { 0 });
            assert_eq!(counts, expected, "{wanted:?} of {outputs:?}");
            assert_near(&found, &all, &format!("{wanted:?} of {outputs:?}"));
        }
    }
}

/// Picks equal the outputs there; a pick leaves nothing of its one pixel in those that follow.
#[test]
fn a_pixel_is_picked_as_the_outputs_have_it() {
    let Some(gpu) = common::gpu() else { return };
    let mut scene = Scene::new();
    for settings in [Settings::default(), single(OutputSet::COLOR), single(OutputSet::ALL)] {
        let all = scene.draw(&gpu, settings, OutputSet::ALL);
        let (entities, depths) = (all.entities(), all.depths());
        let mut renderer = SingleView::new(&gpu);
        scene.prepare(&mut renderer, &settings);
        renderer.draw_picture();
        for pixel in (0..SIZE.0 * SIZE.1).step_by(97) {
            let found = renderer.pick(UVec2::new(pixel % SIZE.0, pixel / SIZE.0));
            let (entity, depth) = (entities[pixel as usize], depths[pixel as usize]);
            assert_eq!(found.map(|found| found.entity), entity, "pixel {pixel}");
            // As in `assert_near`.
            let near = |found: Picked| (found.depth - depth).abs() < 1e-5 * depth;
            assert!(found.is_none_or(near), "pixel {pixel}: {found:?}, not {depth}");
        }
        assert_eq!(renderer.pick(UVec2::new(SIZE.0, 0)), None, "outside");
        assert_eq!(renderer.pick(UVec2::new(0, u32::MAX)), None, "outside");
        assert_same(&renderer.draw_outputs(OutputSet::ALL).expect("prepared"), &all, "after a pick");
    }
}

/// Outputs of the last frame are read, not drawn again, while nothing moves; motion shows in the next.
#[test]
fn outputs_follow_the_world() {
    let Some(gpu) = common::gpu() else { return };
    for settings in [single(OutputSet::ALL), Settings { outputs: OutputSet::ALL, ..Settings::default() }] {
        let mut scene = Scene::new();
        let mut objects = scene.simulation.world.query_filtered::<&mut Transform, With<MeshId>>();
        let mut renderer = SingleView::new(&gpu);
        for frame in 0..4 {
            if frame != 2 {
                objects.iter_mut(&mut scene.simulation.world).for_each(|mut place| place.translation.x += 0.2);
            }
            scene.prepare(&mut renderer, &settings);
            let expected = scene.draw(&gpu, settings, OutputSet::ALL);
            // Before the frame is drawn, and after it, with a pick between: nothing of the frame before.
            let early = renderer.draw_outputs(OutputSet::ALL.beside_color()).expect("prepared");
            assert_same(&early, &expected, &format!("frame {frame}, not drawn yet"));
            renderer.draw_picture();
            renderer.pick(UVec2::splat(9));
            let drawn = renderer.draw_outputs(OutputSet::ALL.beside_color()).expect("prepared");
            assert_same(&drawn, &expected, &format!("frame {frame}, drawn"));
        }
    }
}

/// Textures that the settings ask for stay whole when a pixel is picked.
#[test]
fn a_pick_leaves_the_textures_that_are_asked_for() {
    let Some(gpu) = common::gpu() else { return };
    let mut scene = Scene::new();
    let id = OutputSet { color: true, id: true, ..OutputSet::NONE };
    let expected = scene.draw(&gpu, Settings::default(), OutputSet::ALL);
    let mut renderer = SingleView::new(&gpu);
    scene.prepare(&mut renderer, &Settings { outputs: id, ..Settings::default() });
    renderer.draw_picture();
    renderer.pick(UVec2::splat(9));
    let texels = read_texture(&gpu, renderer.state().id_texture().expect("asked for"));
    let entity = |texel: &[u8]| u32::from_le_bytes([texel[0], texel[1], texel[2], texel[3]]).checked_sub(1);
    assert!(texels.chunks_exact(4).map(entity).eq(expected.entities()));
    assert!(renderer.state().normal_texture().is_none(), "not asked for");
}
