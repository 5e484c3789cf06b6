//! Passes of the caller's own between those of a view.

use crate::common::{self, prelude::*};
use relief::renderer::{PassPlace, PassTargets, ViewState, ViewTarget};
use std::cell::RefCell;

const SIZE: (u32, u32) = (48, 32);

/// A pipeline that fills the left half of the picture with red, at a depth.
fn half(gpu: &Gpu, targets: &PassTargets<'_>, depth: Option<f32>) -> wgpu::RenderPipeline {
    let source = format!(
        "@vertex fn vertex(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {{
             let corner = vec2f(f32(i & 1u), f32(i >> 1u) * 2.0);
             return vec4f(corner.x - 1.0, corner.y - 1.0, {:?}, 1.0);
         }}
         @fragment fn fragment() -> @location(0) vec4f {{ return vec4f(1.0, 0.0, 0.0, 1.0); }}",
        depth.unwrap_or(0.5)
    );
    let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let depth_stencil = depth.map(|_| wgpu::DepthStencilState {
        format: PassTargets::DEPTH_FORMAT,
        depth_write_enabled: Some(true),
        depth_compare: Some(wgpu::CompareFunction::Greater),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    });
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: None,
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            ..wgpu::PrimitiveState::default()
        },
        depth_stencil,
        multisample: wgpu::MultisampleState { count: targets.color_samples, ..wgpu::MultisampleState::default() },
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: None,
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(targets.color_format.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// Draws that half into what a pass of the caller's own is given.
fn draw_half(gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, targets: &PassTargets<'_>, depth: Option<f32>) {
    let keep = wgpu::StoreOp::Store;
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("half"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: targets.color,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: keep },
        })],
        depth_stencil_attachment: depth.map(|_| wgpu::RenderPassDepthStencilAttachment {
            view: targets.depth,
            depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Load, store: keep }),
            stencil_ops: None,
        }),
        ..wgpu::RenderPassDescriptor::default()
    });
    pass.set_pipeline(&half(gpu, targets, depth));
    pass.draw(0..4, 0..1);
}

struct Stage {
    simulation: Simulation,
    renderer: Renderer,
    state: ViewState,
    picture: wgpu::Texture,
}

impl Stage {
    /// A white wall 4 m before the camera in the lower half of the picture, blue sky above it; perhaps green glass
    /// before both.
    fn new(gpu: &Gpu, glass: bool) -> Self {
        let mut simulation = Simulation::new();
        let blue = Vec3::new(0.0, 0.0, 1.0);
        let sky = Environment {
            zenith: blue,
            horizon: blue,
            // Below the horizon, behind the wall: so that the sky is drawn.
            ground: Vec3::ZERO,
            tone_map: ToneMap::Clamp,
            ..Environment::default()
        };
        simulation.world.insert_resource(sky);
        let mut library = simulation.world.resource_mut::<Library>();
        let cube = library.add_mesh(shapes::cube(Vec3::new(100.0, 100.0, 2.0)));
        let flat = |base: Vec3, alpha, opacity| {
            let base_factor = base.extend(opacity);
            Material { base_factor, alpha, ..Material::new(Shading::Unlit) }
        };
        let white = library.add_material(flat(Vec3::ONE, AlphaMode::Opaque, 1.0));
        let green = library.add_material(flat(Vec3::Y, AlphaMode::Blend, 0.5));
        simulation.world.spawn((cube, white, Transform::from_xyz(0.0, -50.0, -5.0)));
        if glass {
            simulation.world.spawn((cube, green, Transform::from_xyz(0.0, 0.0, -3.0)));
        }
        Self {
            simulation,
            renderer: Renderer::new(gpu),
            state: ViewState::new(gpu),
            picture: picture_texture(gpu, SIZE),
        }
    }

    fn prepare(&mut self, settings: Settings) {
        self.simulation.frame();
        let view = View::new(&GlobalTransform::default().affine(), &Camera::default(), SIZE.0, SIZE.1);
        let mut views = [(&mut self.state, ViewPlan { view, settings })];
        self.simulation.with_frame(|frame| self.renderer.prepare(frame, &mut views)).expect("it fits");
    }

    /// Colours of a pixel left and right in the upper, and in the lower half; red, green and blue.
    fn draw(&mut self, settings: Settings, place: PassPlace, depth: Option<f32>) -> [[u8; 3]; 4] {
        let gpu = self.renderer.gpu().clone();
        self.prepare(settings);
        let target = self.picture.create_view(&Default::default());
        let own = |encoder: &mut wgpu::CommandEncoder, targets: &PassTargets<'_>| {
            assert_eq!(targets.size, SIZE);
            draw_half(&gpu, encoder, targets, depth);
        };
        let view = ViewTarget::new(&mut self.state, &target, PICTURE_FORMAT).with_pass(place, own);
        common::encode(&mut self.renderer, &mut [view]);
        let bytes = read_texture(&gpu, &self.picture);
        gpu.check().expect("nothing was refused");
        let pixel = |x: u32, y: u32| {
            let at = 4 * (y * SIZE.0 + x) as usize;
            [bytes[at], bytes[at + 1], bytes[at + 2]]
        };
        [pixel(10, 5), pixel(38, 5), pixel(10, 27), pixel(38, 27)]
    }
}

const RED: [u8; 3] = [255, 0, 0];
const BLUE: [u8; 3] = [0, 0, 255];
const WHITE: [u8; 3] = [255; 3];

/// Depth is reversed: the wall's is 0.1 / 4 with the camera's near plane.
fn behind_the_wall() -> f32 {
    Camera::default().near / 8.0
}

fn settings() -> [Settings; 4] {
    let four = Settings::default();
    let single = Settings { samples: 1, ..four };
    let outputs = OutputSet::ALL;
    let occlusion = Occlusion::On;
    [four, single, Settings { outputs, ..single }, Settings { occlusion, ..four }]
}

#[test]
fn a_pass_after_opaque_objects_is_hidden_by_them_and_hides_the_sky() {
    let Some(gpu) = common::gpu() else { return };
    for settings in settings() {
        let mut stage = Stage::new(&gpu, false);
        let found = stage.draw(settings, PassPlace::AfterOpaque, Some(behind_the_wall()));
        assert_eq!(found, [RED, BLUE, WHITE, WHITE], "{settings:?}");
    }
}

/// Devices may encode sRGB a step apart.
fn assert_near(found: [[u8; 3]; 4], expected: [[u8; 3]; 4], what: &Settings) {
    let apart = found.as_flattened().iter().zip(expected.as_flattened()).map(|(a, b)| a.abs_diff(*b)).max();
    assert!(apart <= Some(1), "{found:?}, not {expected:?}: {what:?}");
}

#[test]
fn blended_objects_are_drawn_over_a_pass_after_opaque_ones_and_below_one_after_blended_ones() {
    let Some(gpu) = common::gpu() else { return };
    // Half of green over half of the colour, in linear light: 0.5 is 188 of 255 in sRGB.
    let (red, blue, white) = ([188, 188, 0], [0, 188, 188], [188, 255, 188]);
    for settings in settings() {
        let found = Stage::new(&gpu, true).draw(settings, PassPlace::AfterOpaque, Some(behind_the_wall()));
        assert_near(found, [red, blue, white, white], &settings);
        let found = Stage::new(&gpu, true).draw(settings, PassPlace::AfterBlended, Some(behind_the_wall()));
        assert_near(found, [RED, blue, white, white], &settings);
    }
}

#[test]
fn a_pass_after_the_tone_map_is_over_everything() {
    let Some(gpu) = common::gpu() else { return };
    for settings in settings() {
        let found = Stage::new(&gpu, false).draw(settings, PassPlace::AfterToneMap, None);
        assert_eq!(found, [RED, BLUE, RED, WHITE], "{settings:?}");
    }
}

/// A still frame is shown again with a pass that the last one did not have: what it draws is hidden by the scene.
#[test]
fn a_pass_after_the_tone_map_of_a_frame_that_is_shown_again_has_its_depths() {
    let Some(gpu) = common::gpu() else { return };
    let mut stage = Stage::new(&gpu, false);
    let settings = Settings { samples: 1, ..Settings::default() };
    stage.draw(settings, PassPlace::AfterBlended, None);
    let target = stage.picture.create_view(&Default::default());
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let own = |encoder: &mut wgpu::CommandEncoder, targets: &PassTargets<'_>| {
        draw_half(&gpu, encoder, targets, Some(behind_the_wall()));
    };
    let view = ViewTarget::new(&mut stage.state, &target, PICTURE_FORMAT).with_pass(PassPlace::AfterToneMap, own);
    stage.renderer.encode_again(&mut encoder, &mut [view]);
    gpu.queue.submit([encoder.finish()]);
    let bytes = read_texture(&gpu, &stage.picture);
    let pixel = |x: u32, y: u32| bytes[4 * (y * SIZE.0 + x) as usize..][..3].to_vec();
    assert_eq!([pixel(10, 5), pixel(10, 27)], [RED.to_vec(), WHITE.to_vec()]);
}

/// A pass that does nothing leaves the picture what it is, in every place, with any samples.
#[test]
fn an_empty_pass_changes_nothing() {
    let Some(gpu) = common::gpu() else { return };
    for settings in settings() {
        for place in [PassPlace::AfterOpaque, PassPlace::AfterBlended, PassPlace::AfterToneMap] {
            let mut stage = Stage::new(&gpu, true);
            let pictures = [false, true].map(|own| {
                stage.prepare(settings);
                let target = stage.picture.create_view(&Default::default());
                let called = RefCell::new(0);
                let mut view = ViewTarget::new(&mut stage.state, &target, PICTURE_FORMAT);
                if own {
                    view = view.with_pass(place, |_, _| *called.borrow_mut() += 1);
                }
                common::encode(&mut stage.renderer, &mut [view]);
                assert_eq!(called.into_inner(), i32::from(own));
                read_texture(&gpu, &stage.picture)
            });
            assert!(pictures[0] == pictures[1], "{place:?}, {settings:?}");
        }
    }
}
