//! A window and a device of one's own: the program opens both, and has relief draw into the window's textures.
//!
//! `cargo run --release --example own_window` turns a torus until the window is closed.

use relief::prelude::*;
use relief::renderer::{Gpu, Renderer, Settings, ViewPlan, ViewState, ViewTarget, instance_flags};
use std::error::Error;
use std::sync::Arc;
use winit::application::ApplicationHandler;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, EventLoop};
use winit::window::{Window, WindowId};

/// A window, its surface, and what draws the simulation.
struct Open {
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    gpu: Gpu,
    renderer: Renderer,
    state: ViewState,
    window: Arc<Window>,
}

impl Open {
    fn new(event_loop: &ActiveEventLoop) -> Result<Self, Box<dyn Error>> {
        let window = Arc::new(event_loop.create_window(Window::default_attributes().with_title("own_window"))?);
        let display = Box::new(event_loop.owned_display_handle());
        let descriptor = instance_flags(wgpu::InstanceDescriptor::new_with_display_handle(display));
        let instance = wgpu::Instance::new(descriptor);
        let surface = instance.create_surface(window.clone())?;
        let options = wgpu::RequestAdapterOptions {
            compatible_surface: Some(&surface),
            ..wgpu::RequestAdapterOptions::default()
        };
        let adapter = pollster::block_on(instance.request_adapter(&options))?;
        // What relief makes use of where the adapter has it. A program adds what it needs itself.
        let descriptor = Gpu::device_descriptor(&adapter);
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))?;
        let gpu = Gpu::of_device(instance, adapter, device, queue);

        let size = window.inner_size();
        let config = surface
            .get_default_config(&gpu.adapter, size.width.max(1), size.height.max(1))
            .ok_or("no surface format")?;
        // Linear colours are encoded as they are written.
        let srgb = config.format.add_srgb_suffix();
        let config = wgpu::SurfaceConfiguration { view_formats: vec![srgb], ..config };
        surface.configure(&gpu.device, &config);
        let (renderer, state) = (Renderer::new(&gpu), ViewState::new(&gpu));
        window.request_redraw();
        Ok(Self { surface, config, gpu, renderer, state, window })
    }

    fn resize(&mut self, width: u32, height: u32) {
        (self.config.width, self.config.height) = (width.max(1), height.max(1));
        self.surface.configure(&self.gpu.device, &self.config);
        self.window.request_redraw();
    }

    /// A step of the simulation and a frame, as seen by a camera.
    fn draw(&mut self, simulation: &mut Simulation, camera: Entity) -> Result<(), Box<dyn Error>> {
        let texture = match self.surface.get_current_texture() {
            wgpu::CurrentSurfaceTexture::Success(texture) | wgpu::CurrentSurfaceTexture::Suboptimal(texture) => texture,
            wgpu::CurrentSurfaceTexture::Lost => return Err("the surface is lost".into()),
            // Another redraw is asked for as it is uncovered.
            wgpu::CurrentSurfaceTexture::Occluded => return Ok(()),
            wgpu::CurrentSurfaceTexture::Timeout => {
                self.window.request_redraw();
                return Ok(());
            }
            wgpu::CurrentSurfaceTexture::Outdated | wgpu::CurrentSurfaceTexture::Validation => {
                self.surface.configure(&self.gpu.device, &self.config);
                self.window.request_redraw();
                return Ok(());
            }
        };
        let format = self.config.view_formats[0];
        let view = wgpu::TextureViewDescriptor { format: Some(format), ..wgpu::TextureViewDescriptor::default() };
        let target = texture.texture.create_view(&view);

        simulation.step();
        simulation.frame();
        let size = (self.config.width, self.config.height);
        let view = Viewpoint::Camera(camera).view(&simulation.world, size);
        let plan = ViewPlan { view, settings: Settings::default() };
        let Self { gpu, renderer, state, .. } = self;
        simulation.with_frame(|frame| renderer.prepare(frame, &mut [(&mut *state, plan)]))?;
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        renderer.encode(&mut encoder, &mut [ViewTarget::new(state, &target, format)]);
        gpu.queue.submit([encoder.finish()]);

        self.window.pre_present_notify();
        self.gpu.queue.present(texture);
        self.window.request_redraw();
        self.gpu.check()?;
        Ok(())
    }
}

/// The application: a simulation, and a window once there is one.
struct App {
    simulation: Simulation,
    camera: Entity,
    open: Option<Open>,
    result: Result<(), Box<dyn Error>>,
}

impl App {
    fn end_with(&mut self, event_loop: &ActiveEventLoop, error: Box<dyn Error>) {
        self.result = Err(error);
        event_loop.exit();
    }
}

impl ApplicationHandler for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        match Open::new(event_loop) {
            Ok(open) => self.open = Some(open),
            Err(error) => self.end_with(event_loop, error),
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(open) = &mut self.open else { return };
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::Resized(size) => open.resize(size.width, size.height),
            WindowEvent::RedrawRequested => {
                if let Err(error) = open.draw(&mut self.simulation, self.camera) {
                    self.end_with(event_loop, error);
                }
            }
            _ => {}
        }
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        // The surface goes before the connection to the display does.
        self.open = None;
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut simulation = Simulation::new();
    let torus = simulation.world.resource_mut::<Library>().add_mesh(shapes::torus(1.0, 0.4, 64, 32));
    let turning = Spin { axis: Vec3::X, rate: 1.0, start: Quat::IDENTITY };
    simulation.world.spawn((torus, Transform::IDENTITY, turning));
    simulation.world.spawn((Light::point(20.0, 30.0), Transform::from_xyz(2.0, 4.0, 3.0)));
    let eye = Transform::from_xyz(0.0, 1.5, 4.0).looking_at(Vec3::ZERO, Vec3::Y);
    let camera = simulation.world.spawn((Camera::default(), eye)).id();

    let mut app = App { simulation, camera, open: None, result: Ok(()) };
    EventLoop::new()?.run_app(&mut app)?;
    app.result
}
