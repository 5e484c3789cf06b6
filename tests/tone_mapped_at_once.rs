//! Without [`Settings::hdr`], objects are tone-mapped as they are drawn, where the scene allows it: the same picture as
//! with linear colours and a pass of its own.

mod common;

use bevy_ecs::entity::Entity;
use glam::{DVec3, Quat, Vec3};
use image::RgbaImage;
use relief::frames::Headless;
use relief::prelude::{Camera, Library, Light, Simulation, Transform, shapes};
use relief::renderer::{DebugView, Gpu, Occlusion, OutputSet, PICTURE_FORMAT, Settings, SingleView};
use systems::assets::{AlphaMode, Material, MaterialId, MeshId, Technique};
use systems::draw::{Environment, ToneMap};

const SIZE: (u32, u32) = (128, 72);
const ONCE: Settings = Settings {
    technique: None,
    debug: DebugView::Off,
    levels: systems::assets::levels::LevelOfDetail::OFF,
    samples: 1,
    hdr: false,
    picked_entity: None,
    occlusion: Occlusion::Off,
    outputs: OutputSet::COLOR,
};

struct Field {
    simulation: Simulation,
    camera: Entity,
    mesh: MeshId,
}

impl Field {
    /// Bright and dark spheres in front of a sky.
    fn new() -> Self {
        let mut simulation = Simulation::new();
        let mut library = simulation.world.resource_mut::<Library>();
        let mesh = library.add_mesh(shapes::sphere(0.6, 24, 16));
        let mut material = |color: Vec3, alpha| {
            library.add_material(Material {
                base_factor: color.extend(0.5),
                alpha,
                alpha_cutoff: 0.2,
                ..Material::default()
            })
        };
        let materials: [MaterialId; 3] = [
            material(Vec3::new(0.9, 0.3, 0.1), AlphaMode::Opaque),
            material(Vec3::new(0.1, 0.5, 0.9), AlphaMode::Mask),
            material(Vec3::ONE, AlphaMode::Opaque),
        ];
        for i in 0..96_u16 {
            let place = Vec3::new(f32::from(i % 12) * 1.3 - 7.0, 0.0, -1.5 * f32::from(i / 12));
            let turned = Transform::from_translation(place).with_rotation(Quat::from_rotation_y(f32::from(i)));
            simulation.world.spawn((mesh, materials[usize::from(i % 3)], turned));
        }
        simulation.world.spawn((Light::directional(2.0), Transform::default().looking_to(-Vec3::ONE, Vec3::Y)));
        let eye = Transform::from_xyz(0.0, 4.0, 8.0).looking_at(Vec3::NEG_Z * 4.0, Vec3::Y);
        let camera = simulation.world.spawn((Camera::default(), eye)).id();
        Self { simulation, camera, mesh }
    }

    fn sky(&mut self, [zenith, horizon, ground]: [Vec3; 3], exposure: f32, tone_map: ToneMap) {
        let ambient = Vec3::splat(0.05);
        self.simulation.world.insert_resource(Environment { ambient, zenith, horizon, ground, exposure, tone_map });
    }
}

/// Tone-mapped at once, and after.
struct Pair {
    once: Headless,
    after: Headless,
}

impl Pair {
    fn new(gpu: &Gpu) -> Self {
        let headless = |settings| Headless { renderer: SingleView::new(gpu), settings };
        Self { once: headless(ONCE), after: headless(Settings { hdr: true, ..ONCE }) }
    }

    fn set(&mut self, settings: Settings) {
        self.once.settings = settings;
        self.after.settings = Settings { hdr: true, ..settings };
    }

    fn draw(&mut self, field: &mut Field) -> [RgbaImage; 2] {
        [&mut self.once, &mut self.after]
            .map(|headless| headless.draw(&mut field.simulation, field.camera, SIZE).expect("a picture"))
    }

    /// Draws both: at once indeed, and alike.
    #[track_caller]
    fn check(&mut self, field: &mut Field, case: &str) {
        let pictures = self.draw(field);
        assert!(!self.once.renderer.keeps_linear(), "{case}");
        assert!(self.once.renderer.read_linear().is_none(), "{case}");
        self.check_colors(field, &pictures, case);
        let [_, after] = pictures;
        let sky = *after.get_pixel(0, 0);
        let objects = after.pixels().filter(|pixel| **pixel != sky).count();
        assert!(objects > 1000, "{case}: {objects} pixels to see");
    }

    #[track_caller]
    fn check_colors(&self, field: &Field, pictures: &[RgbaImage; 2], case: &str) {
        let linear = self.after.renderer.read_linear().expect("kept");
        let curve = field.simulation.world.resource::<Environment>().tone_map;
        let curve = if self.after.settings.debug == DebugView::Off { curve } else { ToneMap::Clamp };
        assert_alike(pictures, &linear, curve, case);
    }
}

/// Pixels of both ways are what the curve makes of the linear colours that the other way kept, as half floats.
///
/// A half float has 11 bits, and Vulkan lets a driver round to the nearest or to zero: before it was rounded, a colour
/// was within 2⁻¹⁰ of its own size, or 2⁻²⁴. That leaves room for what two compiled shaders may
/// round differently, some units of 2⁻²⁴. What the curve makes of both ends encloses the pixel.
#[track_caller]
fn assert_alike([once, after]: &[RgbaImage; 2], linear: &[[f32; 4]], curve: ToneMap, case: &str) {
    for (i, color) in linear.iter().enumerate() {
        let color = DVec3::new(color[0].into(), color[1].into(), color[2].into());
        let rounding = (color.abs() * 2f64.powi(-10)).max(DVec3::splat(2f64.powi(-24)));
        let place = (i as u32 % once.width(), i as u32 / once.width());
        for (picture, rounding, which) in [(once, rounding, "at once"), (after, DVec3::ZERO, "after")] {
            let [low, high] = tone::mapped(curve, color - rounding, color + rounding);
            let pixel = picture.get_pixel(place.0, place.1).0;
            for channel in 0..3 {
                let value = f64::from(pixel[channel]);
                let (low, high) = (tone::encoded(low[channel]) - SLACK, tone::encoded(high[channel]) + SLACK);
                assert!((low..=high).contains(&value), "{case}, {which}, {place:?}: {pixel:?}, {low} to {high} wanted");
            }
        }
    }
}

/// In steps of 8 bits, how far from exact arithmetic a device may be: 0.6 for encoding sRGB (Direct3D 11.3 functional
/// specification, 3.2.3.7; Vulkan names no bound), and the rest for `log2` and `pow` in the curves. Of 16.5 stops that
/// AgX covers, with a slope below 4 and the powers 2.2 and 1/2.4 after it, 0.4 of a step is 2⁻⁸ of a stop: software
/// drivers, which take polynomials for both functions, are much finer.
const SLACK: f64 = 1.0;

/// The tone curves of shaders/tone.wgsl in double precision, of intervals.
mod tone {
    use glam::{DMat3, DVec3};
    use systems::draw::ToneMap;

    /// The ends of what a curve makes of all colours between two.
    pub fn mapped(curve: ToneMap, low: DVec3, high: DVec3) -> [DVec3; 2] {
        let ends = [low, high].map(|end| end.max(DVec3::ZERO));
        match curve {
            ToneMap::Clamp => ends,
            ToneMap::Aces => ends.map(|x| (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)),
            ToneMap::Agx => agx(ends),
        }
        .map(|end| end.clamp(DVec3::ZERO, DVec3::ONE))
    }

    fn agx(ends: [DVec3; 2]) -> [DVec3; 2] {
        let agx_from_linear = DMat3::from_cols_array(&[
            0.842479062253094,
            0.0423282422610123,
            0.0423756549057051,
            0.0784335999999992,
            0.878468636469772,
            0.0784336,
            0.0792237451477643,
            0.0791661274605434,
            0.879142973793104,
        ]);
        let linear_from_agx = DMat3::from_cols_array(&[
            1.19687900512017,
            -0.0528968517574562,
            -0.0529716355144438,
            -0.0980208811401368,
            1.15190312990417,
            -0.0980434501171241,
            -0.0990297440797205,
            -0.0989611768448433,
            1.15107367264116,
        ]);
        let (low, high) = (-12.47393, 4.026069);
        // Rising in every channel: all of the first matrix is positive.
        let curved = ends.map(|end| {
            let light = (agx_from_linear * end).max(DVec3::splat(1e-10));
            let x = ((light.map(f64::log2) - low) / (high - low)).clamp(DVec3::ZERO, DVec3::ONE);
            let (x2, x4) = (x * x, x * x * x * x);
            15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232
        });
        // The second has negative parts, which turn ends round.
        let parts = |least: bool| {
            let columns = (0..3).map(|i| {
                let (a, b) = (linear_from_agx.col(i) * curved[0][i], linear_from_agx.col(i) * curved[1][i]);
                if least { a.min(b) } else { a.max(b) }
            });
            columns.sum::<DVec3>().clamp(DVec3::ZERO, DVec3::ONE).map(|x| x.powf(2.2))
        };
        [parts(true), parts(false)]
    }

    /// IEC 61966-2-1, in steps of 8 bits.
    pub fn encoded(linear: f64) -> f64 {
        255.0 * if linear <= 0.0031308 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
    }
}

const GRADIENT: [Vec3; 3] = [Vec3::new(0.2, 0.4, 0.9), Vec3::new(0.7, 0.8, 0.9), Vec3::new(0.1, 0.09, 0.08)];
const PLAIN: [Vec3; 3] = [Vec3::new(0.3, 0.05, 0.6); 3];

#[test]
fn the_picture_is_the_same_as_with_a_pass_of_its_own() {
    let Some(gpu) = common::gpu() else { return };
    let (mut field, mut pair) = (Field::new(), Pair::new(&gpu));
    for (name, curve) in ToneMap::ALL {
        for (kind, sky) in [("a gradient", GRADIENT), ("one colour", PLAIN)] {
            field.sky(sky, 1.5, curve);
            for occlusion in [Occlusion::Off, Occlusion::On] {
                pair.set(Settings { occlusion, ..ONCE });
                for frame in 0..3 {
                    pair.check(&mut field, &format!("{name}, {kind}, {occlusion:?}, frame {frame}"));
                }
            }
        }
    }
    for (name, technique) in Technique::ALL {
        if technique != Technique::EmbossMultipass {
            pair.set(Settings { technique: Some(technique), ..ONCE });
            pair.check(&mut field, name);
        }
    }
    for (name, debug) in DebugView::ALL {
        pair.set(Settings { debug, ..ONCE });
        pair.check(&mut field, name);
    }
}

#[test]
fn a_sky_of_one_colour_is_what_the_shader_makes_of_it() {
    let Some(gpu) = common::gpu() else { return };
    let (mut field, mut pair) = (Field::new(), Pair::new(&gpu));
    for (name, curve) in ToneMap::ALL {
        for value in 0..20_u8 {
            let value = f32::from(value);
            let color = Vec3::new(0.001 * value * value, 0.1 * value, 0.02 * (20.0 - value));
            field.sky([color; 3], 1.3, curve);
            let [once, after] = pair.draw(&mut field).map(|picture| *picture.get_pixel(0, 0));
            let steps = once.0.iter().zip(after.0).map(|(a, b)| a.abs_diff(b)).max();
            assert!(steps <= Some(1), "{name}, {color}: {once:?} and {after:?}");
        }
    }
}

#[test]
fn what_needs_linear_colours_keeps_them() {
    let Some(gpu) = common::gpu() else { return };
    let (mut field, mut pair) = (Field::new(), Pair::new(&gpu));
    field.sky(GRADIENT, 1.0, ToneMap::Agx);
    let alike = |field: &mut Field, pair: &mut Pair, linear: bool, case: &str| {
        let pictures = pair.draw(field);
        pair.check_colors(field, &pictures, case);
        assert!(!linear || pictures[0] == pictures[1], "{case}");
        assert_eq!(pair.once.renderer.keeps_linear(), linear, "{case}");
        assert_eq!(pair.once.renderer.read_linear().is_some(), linear, "{case}");
    };
    alike(&mut field, &mut pair, false, "at first");
    pair.set(Settings { samples: 4, ..ONCE });
    alike(&mut field, &mut pair, true, "four samples");
    pair.set(Settings { technique: Some(Technique::EmbossMultipass), ..ONCE });
    alike(&mut field, &mut pair, true, "passes that add up");
    pair.set(ONCE);
    alike(&mut field, &mut pair, false, "as at first");
    let glass = Material { base_factor: Vec3::ONE.extend(0.4), alpha: AlphaMode::Blend, ..Material::default() };
    let glass = field.simulation.world.resource_mut::<Library>().add_material(glass);
    let object = field.simulation.world.spawn((field.mesh, glass, Transform::from_xyz(0.0, 1.0, 3.0))).id();
    alike(&mut field, &mut pair, true, "a blended object");
    field.simulation.world.despawn(object);
    alike(&mut field, &mut pair, false, "without it again");
}

#[test]
fn a_renderer_changes_from_one_way_to_the_other() {
    let Some(gpu) = common::gpu() else { return };
    let mut field = Field::new();
    field.sky(GRADIENT, 1.0, ToneMap::Agx);
    let once = Settings { occlusion: Occlusion::On, ..ONCE };
    let settings = [once, Settings { hdr: true, ..once }];
    let mut draw =
        |headless: &mut Headless, size| headless.draw(&mut field.simulation, field.camera, size).expect("a picture");
    let mut changing = Headless { renderer: SingleView::new(&gpu), settings: once };
    let mut known = Vec::new();
    // Still for long enough that nothing is culled any more, then the other way; then the same in another size.
    for (round, size) in [SIZE, SIZE, (65, 130), SIZE].into_iter().enumerate() {
        for (which, settings) in settings.into_iter().enumerate() {
            changing.settings = settings;
            for frame in 0..4 {
                let drawn = draw(&mut changing, size);
                assert_eq!(changing.renderer.keeps_linear(), settings.hdr);
                if !known.iter().any(|(of, _)| *of == (which, size)) {
                    let mut fresh = Headless { renderer: SingleView::new(&gpu), settings };
                    known.push(((which, size), draw(&mut fresh, size)));
                }
                let expected = known.iter().find(|(of, _)| *of == (which, size)).map(|(_, picture)| picture);
                assert!(expected == Some(&drawn), "round {round}, way {which}, frame {frame}");
            }
        }
    }
}

#[test]
fn passes_that_are_cut_are_tone_mapped_at_once() {
    let Some(gpu) = common::gpu() else { return };
    let (mut field, mut pair) = (Field::new(), Pair::new(&gpu));
    field.sky(GRADIENT, 1.0, ToneMap::Aces);
    pair.check(&mut field, "whole");
    let [whole, _] = pair.draw(&mut field);
    for headless in [&mut pair.once, &mut pair.after] {
        headless.renderer.cut_passes(std::num::NonZeroU32::new(500));
    }
    pair.check(&mut field, "cut");
    assert!(pair.once.renderer.stats().passes > 1, "one pass");
    assert!(whole == pair.draw(&mut field)[0]);
}

#[test]
#[should_panic(expected = "expected a target of Rgba8UnormSrgb, found Bgra8UnormSrgb")]
fn another_format_is_refused() {
    let Some(gpu) = common::gpu() else { panic!("expected a target of Rgba8UnormSrgb, found Bgra8UnormSrgb: skipped") };
    let (mut field, mut pair) = (Field::new(), Pair::new(&gpu));
    pair.check(&mut field, "its own format");
    let target = target(&gpu, wgpu::TextureFormat::Bgra8UnormSrgb);
    let view = target.create_view(&wgpu::TextureViewDescriptor::default());
    pair.once.renderer.draw(&view, wgpu::TextureFormat::Bgra8UnormSrgb);
}

fn target(gpu: &Gpu, format: wgpu::TextureFormat) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: SIZE.0, height: SIZE.1, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}

#[test]
fn other_calls_work_without_linear_colours() {
    let Some(gpu) = common::gpu() else { return };
    let mut field = Field::new();
    field.sky(PLAIN, 1.0, ToneMap::Aces);
    let mut renderer = SingleView::new(&gpu);
    let viewpoint = relief::viewpoint::Viewpoint::Camera(field.camera);
    field.simulation.frame();
    let view = viewpoint.view(&field.simulation.world, SIZE);
    field.simulation.with_frame(|frame| renderer.prepare(frame, &view, &ONCE)).expect("prepared");
    // The picture was not drawn.
    assert!(renderer.draw_outputs(OutputSet::ALL.beside_color()).is_some());
    let drawn = renderer.draw_picture();
    let target = target(&gpu, PICTURE_FORMAT);
    renderer.show_again(&target.create_view(&wgpu::TextureViewDescriptor::default()), PICTURE_FORMAT);
    let again = relief::renderer::read_texture(&gpu, &target);
    assert!(again == drawn.into_raw());
}
