//! Events in, frames out.

use crate::app::control::driving::Wheel;
use crate::app::control::input::{self, Gesture, Pointer};
use crate::app::control::picking::{self, Hit};
use crate::app::error::{AppError, no_display};
use crate::app::options::Options;
use crate::app::screen::graphics::Graphics;
use crate::app::shown::panel::{self, FrameInfo, SidePanel};
use crate::app::shown::{details, object_lights, overlay, sensor_overlay, sensor_thumbnails};
use crate::app::timing::Timing;
use crate::app::viewer::{Effect, Viewer};
use crate::frames::FrameError;
use crate::output;
use crate::renderer::{RenderError, RenderStats, instance_flags};
use glam::{Vec2, Vec3};
use image::buffer::ConvertBuffer;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use systems::draw::View;
use systems::run::inputs::Inputs;
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, MouseButton, MouseScrollDelta, StartCause, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::keyboard::ModifiersState;
use winit::window::{Window, WindowId};

/// Pixels of a touchpad that count as a notch of a wheel.
const NOTCH_PIXELS: f64 = 40.0;

/// Devices that fail one after another before a frame is shown. What fails more often will not do.
const MOST_REOPENED: u32 = 3;

/// Flying crosses the scene in about so many seconds.
const FLIGHT_SECONDS: f32 = 10.0;

/// The application: waits for the event loop, then has a window.
pub struct App {
    options: Option<Options>,
    open: Option<Open>,
    failed: Option<AppError>,
}

impl App {
    /// Not open yet.
    pub fn new(options: Options) -> Self {
        Self { options: Some(options), open: None, failed: None }
    }

    /// Result of the event loop.
    pub fn result(self) -> Result<(), AppError> {
        self.failed.map_or(Ok(()), Err)
    }

    /// Draws a frame, with another device where the one there is fails; an error ends the loop.
    fn redraw(&mut self, event_loop: &ActiveEventLoop) {
        let Some(mut open) = self.open.take() else { return };
        let drawn = match open.redraw() {
            Err(AppError::Frame(FrameError::Render(error)))
                if error.is_of_device() && open.reopened < MOST_REOPENED =>
            {
                open.reopen(&error).map(|open| (open, ControlFlow::Wait))
            }
            Ok(control_flow) => Ok((open, control_flow)),
            Err(error) => {
                open.viewer.finish();
                Err(error)
            }
        };
        match drawn {
            Ok((open, control_flow)) => {
                self.open = Some(open);
                event_loop.set_control_flow(control_flow);
            }
            Err(error) => {
                self.failed = Some(error);
                event_loop.exit();
            }
        }
    }
}

impl ApplicationHandler for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        let Some(options) = self.options.take() else { return };
        match Open::new(event_loop, options) {
            Ok(open) => self.open = Some(open),
            Err(error) => {
                self.failed = Some(error);
                event_loop.exit();
            }
        }
    }

    fn new_events(&mut self, _: &ActiveEventLoop, cause: StartCause) {
        if let (StartCause::ResumeTimeReached { .. }, Some(open)) = (cause, &self.open) {
            open.window.request_redraw();
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        if event == WindowEvent::RedrawRequested {
            return self.redraw(event_loop);
        }
        let Some(open) = &mut self.open else { return };
        if event == WindowEvent::CloseRequested || !open.on_event(&event) {
            event_loop.exit();
        }
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        if let Some(open) = &mut self.open {
            open.viewer.finish();
        }
        // The surface goes before the event loop's connection to the display does.
        self.open = None;
    }
}

/// An open window. Fields are dropped in order: what draws before the window.
struct Open {
    viewer: Viewer,
    /// Failures of the device in a row before a frame was shown.
    reopened: u32,
    side_panel: SidePanel,
    pointer: Pointer,
    modifiers: ModifiersState,
    /// Pointer position at which the wheel last picked a point to zoom to.
    wheel_at: Option<Vec2>,
    /// Surface under the pointer when the drag began.
    pressed_on: Option<Hit>,
    timing: Timing,
    stats: RenderStats,
    adapter: String,
    /// View of the last frame.
    view: Option<View>,
    picture_wanted: bool,
    graphics: Graphics,
    window: Arc<Window>,
}

impl Open {
    fn new(event_loop: &ActiveEventLoop, options: Options) -> Result<Self, AppError> {
        let attributes = Window::default_attributes()
            .with_title(format!("Relief — {}", options.session.scene.name))
            .with_inner_size(PhysicalSize::new(options.size.0, options.size.1));
        let window = event_loop.create_window(attributes).map_err(|error| no_display(&error))?;
        let window = Arc::new(window);
        let display = Box::new(event_loop.owned_display_handle());
        let instance =
            wgpu::Instance::new(instance_flags(wgpu::InstanceDescriptor::new_with_display_handle(display)).with_env());
        let graphics = Graphics::open(&window, instance)?;
        window.request_redraw();
        let mut viewer = Viewer::new(options);
        viewer.sensors.use_device(Some(&graphics.gpu));
        Ok(Self {
            reopened: 0,
            viewer,
            side_panel: SidePanel::default(),
            pointer: Pointer::default(),
            modifiers: ModifiersState::empty(),
            wheel_at: None,
            pressed_on: None,
            timing: Timing::default(),
            stats: RenderStats::default(),
            adapter: graphics.gpu.name(),
            view: None,
            picture_wanted: false,
            graphics,
            window,
        })
    }

    /// The same window with another device; texels that only the lost one had are read again. The world stays as it is.
    fn reopen(mut self, error: &RenderError) -> Result<Self, AppError> {
        tracing::warn!("{error}; the window goes on with the device opened anew");
        self.viewer.sensors.use_device(None);
        let reopened = self.graphics.reopen(&self.window).map_err(AppError::from).and_then(|graphics| {
            self.viewer.session.restore_texels()?;
            Ok(graphics)
        });
        match reopened {
            Ok(graphics) => {
                self.viewer.sensors.use_device(Some(&graphics.gpu));
                self.window.request_redraw();
                let (adapter, reopened) = (graphics.gpu.name(), self.reopened + 1);
                Ok(Self { adapter, reopened, graphics, ..self })
            }
            Err(error) => {
                self.viewer.finish();
                Err(error)
            }
        }
    }

    /// Takes note of an event; `false`: close the window.
    fn on_event(&mut self, event: &WindowEvent) -> bool {
        self.window.request_redraw();
        match event {
            WindowEvent::ModifiersChanged(modifiers) => self.modifiers = modifiers.state(),
            WindowEvent::Focused(false) => {
                self.pointer.release_all();
                self.viewer.wheel = Wheel::default();
            }
            WindowEvent::CursorLeft { .. } if self.pointer.drag.is_none() => self.pointer.at = None,
            WindowEvent::KeyboardInput { event: key, is_synthetic, .. } if !self.graphics.gui.is_typing() => {
                let pressed = key.state == ElementState::Pressed && !is_synthetic;
                if self.pointer.fly_key(key.physical_key, pressed) {
                    return true;
                }
                if self.viewer.driven.is_some() && self.viewer.wheel.key(key.physical_key, pressed) {
                    return true;
                }
                if let Some(command) = input::command_of(key, self.modifiers) {
                    return !pressed || self.apply(command);
                }
            }
            _ => {}
        }
        self.graphics.gui.on_event(&self.window, event);
        match event {
            WindowEvent::CursorMoved { position, .. } => self.on_moved(Vec2::new(position.x as f32, position.y as f32)),
            WindowEvent::MouseInput { state: ElementState::Pressed, button, .. } => self.on_press(*button),
            WindowEvent::MouseInput { state: ElementState::Released, button, .. } => self.on_release(*button),
            WindowEvent::MouseWheel { delta, .. } => self.on_wheel(delta),
            _ => {}
        }
        true
    }

    /// `false`: close the window.
    fn apply(&mut self, command: input::Command) -> bool {
        match self.viewer.apply(command) {
            Some(Effect::Quit) => return false,
            Some(Effect::SavePicture) => self.picture_wanted = true,
            Some(Effect::SaveSnapshot) => self.save_snapshot(),
            None => {}
        }
        true
    }

    fn pick(&mut self, at: Vec2) -> Option<Hit> {
        picking::pick(&mut self.graphics.renderer, self.view.as_ref()?, at)
    }

    /// Position of the pointer, if on the scene.
    fn on_scene(&self) -> Option<Vec2> {
        self.pointer.at.filter(|at| !self.graphics.gui.covers(*at))
    }

    fn on_press(&mut self, button: MouseButton) {
        let Some(at) = self.on_scene() else { return };
        let Some(gesture) = self.pointer.press(button, self.modifiers.shift_key()) else { return };
        self.pressed_on = if gesture == Gesture::Look { None } else { self.pick(at) };
    }

    fn on_release(&mut self, button: MouseButton) {
        if let Some((Gesture::Orbit, true)) = self.pointer.release(button) {
            self.viewer.selected = self.pressed_on.and_then(|hit| self.viewer.entity(hit.entity));
            self.viewer.pointed_at = self.pressed_on.map_or(self.viewer.pointed_at, |hit| hit.point);
        }
    }

    fn on_moved(&mut self, to: Vec2) {
        let Some((gesture, by)) = self.pointer.moved(to) else { return };
        let Some(view) = &self.view else { return };
        let pivot = self.pressed_on.map_or_else(|| self.viewer.pivot_ahead(view), |hit| hit.point);
        let pose = self.viewer.controller.grab(view, pivot);
        match gesture {
            Gesture::Orbit => {
                pose.pivot = pivot;
                pose.orbit(by);
            }
            Gesture::Pan => {
                pose.pivot = pivot;
                pose.pan(by, view);
            }
            Gesture::Look => pose.look(by),
        }
    }

    fn on_wheel(&mut self, delta: &MouseScrollDelta) {
        let notches = match delta {
            MouseScrollDelta::LineDelta(_, y) => *y,
            MouseScrollDelta::PixelDelta(by) => (by.y / NOTCH_PIXELS) as f32,
        };
        let Some(at) = self.on_scene() else { return };
        // What is under the pointer stays there while zooming: it need not be looked for again.
        let aim = if self.wheel_at == Some(at) { None } else { self.pick(at).map(|hit| hit.point) };
        self.wheel_at = Some(at);
        let Some(view) = &self.view else { return };
        let ahead = self.viewer.pivot_ahead(view);
        let pose = self.viewer.controller.grab(view, ahead);
        pose.pivot = aim.unwrap_or(pose.pivot);
        pose.zoom(notches, &view.camera);
    }

    /// Draws a frame; returns how long to wait for the next.
    fn redraw(&mut self) -> Result<ControlFlow, AppError> {
        let drawn = self.draw();
        // First of all: everything else may follow from it.
        self.graphics.gpu.check()?;
        drawn
    }

    fn draw(&mut self) -> Result<ControlFlow, AppError> {
        let size = self.graphics.screen.size();
        let acquired = size.map(|size| self.graphics.screen.acquire(&self.graphics.gpu, size)).transpose()?.flatten();
        let Some((size, frame)) = size.zip(acquired) else {
            // Minimised or hidden. An event will tell when it is not; a texture that fails asks again by itself.
            self.timing.rest();
            return Ok(ControlFlow::Wait);
        };
        let began = Instant::now();
        let seconds = self.timing.begin(began);
        self.viewer.advance(seconds);
        self.capture_sensors()?;
        self.fly(seconds as f32);
        self.viewer.session.simulation.frame();

        let view = self.viewer.view(size);
        let (still_for, command) = self.run_gui(&view);
        if let Some(command) = command {
            self.apply(command);
        }
        let settings = self.viewer.drawn_settings();
        let simulation = &mut self.viewer.session.simulation;
        // Where only the panel changes, the scene is not drawn again; the panel goes on telling what it took.
        if simulation.with_frame(|frame| self.graphics.renderer.prepare(frame, &view, &settings))? {
            self.graphics.renderer.draw(&frame.scene, self.graphics.screen.scene_format);
            self.stats = self.graphics.renderer.stats();
        } else {
            self.graphics.renderer.show_again(&frame.scene, self.graphics.screen.scene_format);
        }
        // egui's renderer panics where it finds the device lost.
        self.graphics.gpu.check()?;
        self.graphics.gui.paint(&self.graphics.gpu, &frame.panel, size);
        self.graphics.screen.present(&self.graphics.gpu, frame);
        self.graphics.gpu.check()?;
        self.reopened = 0;
        self.view = Some(view);
        if std::mem::take(&mut self.picture_wanted) {
            self.save_picture(size)?;
        }
        self.follow_pointer();
        self.timing.worked(began.elapsed());
        Ok(self.rest(still_for))
    }

    /// Captures the sensors that are looked at from now on; those that were looked at before are captured as steps are
    /// taken.
    fn capture_sensors(&mut self) -> Result<(), RenderError> {
        let Viewer { sensors, session, .. } = &mut self.viewer;
        sensors.update(&mut session.simulation);
        match sensors.take_failure() {
            Some(error) if error.is_of_device() => Err(error),
            Some(error) => {
                self.viewer.notice = format!("sensors: {error}");
                Ok(())
            }
            None => Ok(()),
        }
    }

    fn fly(&mut self, seconds: f32) {
        let direction = self.pointer.fly_direction();
        let Some(view) = self.view.as_ref().filter(|_| direction != Vec3::ZERO) else { return };
        let (_, radius) = self.viewer.scene_extent();
        let ahead = self.viewer.pivot_ahead(view);
        let speed = radius * 2.0 / FLIGHT_SECONDS;
        self.viewer.controller.grab(view, ahead).fly(direction, self.modifiers.shift_key(), speed, seconds);
    }

    fn run_gui(&mut self, view: &View) -> (Duration, Option<input::Command>) {
        let Self { viewer, side_panel, stats, timing, adapter, window, graphics, .. } = self;
        let Graphics { gui, renderer, .. } = graphics;
        let info = FrameInfo { adapter, stats: *stats, drawn: renderer.visible_counts(), timing: *timing, view };
        let mut command = None;
        let still_for = gui.run(window, |ui| {
            // Painted first, so that the panel is above the lines.
            if let Some(object) = viewer.pointed_out().filter(|_| viewer.light_lines)
                && let Some(lights) =
                    object_lights::object_lights(&mut viewer.session.simulation.world, object, viewer.pointed_at)
            {
                let room = ui.max_rect().width() - if viewer.panel { panel::WIDTH } else { 0.0 };
                overlay::paint(ui.painter(), view, &lights, room);
            }
            if viewer.sensors.beams {
                sensor_overlay::paint(ui.painter(), view, &mut viewer.sensors, &mut viewer.session.simulation.world);
            }
            if let Some(motion) = viewer.driven.and_then(|vehicle| viewer.session.simulation.world.get(vehicle)) {
                let above = if viewer.sensors.has_thumbnails() { sensor_thumbnails::ROOM } else { 0.0 };
                overlay::speed(ui.painter(), &details::kilometres_per_hour(motion), above);
            }
            if viewer.panel {
                command = side_panel.show(ui, viewer, &info).or(command);
            }
            sensor_thumbnails::show(ui, &mut viewer.sensors, &mut viewer.session.simulation.world);
        });
        (still_for, command)
    }

    /// Finds the object under the pointer if a debug view points it out; a change shows in the next frame.
    fn follow_pointer(&mut self) {
        let at = self.on_scene().filter(|_| self.viewer.follows_pointer());
        let hit = at.and_then(|at| self.pick(at));
        let hovered = hit.and_then(|hit| self.viewer.entity(hit.entity));
        let point = hit.map_or(self.viewer.pointed_at, |hit| hit.point);
        // The point, too: another piece of one object has other lights.
        let before = (self.viewer.hovered, self.viewer.pointed_at);
        (self.viewer.hovered, self.viewer.pointed_at) = (hovered, point);
        if before != (hovered, point) {
            self.window.request_redraw();
        }
    }

    /// Asks for the next frame while something moves; else waits for an event, or as long as the widgets stay still.
    fn rest(&mut self, still_for: Duration) -> ControlFlow {
        let waits = !self.viewer.session.simulation.world.resource::<Inputs>().is_empty();
        let moving = !self.viewer.clock().paused || self.pointer.fly_direction() != Vec3::ZERO || waits;
        if moving || still_for.is_zero() {
            self.window.request_redraw();
            return ControlFlow::Wait;
        }
        self.timing.rest();
        Instant::now().checked_add(still_for).map_or(ControlFlow::Wait, ControlFlow::WaitUntil)
    }

    /// Writes the scene as it is seen, without the panel, into the working directory: the state of the step in its
    /// name, as it is, which the window shows only when the clock stands.
    fn save_picture(&mut self, size: (u32, u32)) -> Result<(), AppError> {
        self.viewer.frame_of_state();
        let view = self.viewer.view(size);
        let settings = self.viewer.drawn_settings().for_files();
        self.viewer.session.simulation.with_frame(|frame| self.graphics.renderer.prepare(frame, &view, &settings))?;
        self.view = Some(view);
        let picture = self.graphics.renderer.draw_picture();
        self.graphics.gpu.check()?;
        let path = free_name(&self.viewer.session.scene.name, self.viewer.session.step_number(), "png");
        let picture: image::RgbImage = picture.convert();
        self.tell_saved(&path, output::write_png(&path, &picture.into()));
        Ok(())
    }

    /// Writes the state into the working directory.
    fn save_snapshot(&mut self) {
        let path = free_name(&self.viewer.session.scene.name, self.viewer.session.step_number(), "snapshot");
        let saved = self.viewer.session.save_snapshot(&path);
        self.tell_saved(&path, saved);
    }

    fn tell_saved(&mut self, path: &Path, saved: Result<(), impl std::fmt::Display>) {
        self.viewer.notice = match saved {
            Ok(()) => {
                let _ = writeln!(std::io::stdout(), "{}", path.display());
                format!("saved {}", path.display())
            }
            Err(error) => {
                eprintln!("error: {error}");
                error.to_string()
            }
        };
        self.window.request_redraw();
    }
}

/// A name that no file has: the scene's name and the step, and a number from the second on.
fn free_name(title: &str, step: u64, extension: &str) -> PathBuf {
    let safe = |c: char| if c.is_alphanumeric() || "-_ .".contains(c) { c } else { '_' };
    let title: String = title.chars().map(safe).collect();
    let title = title.trim_start_matches('.');
    let first = PathBuf::from(format!("{title}_{step:05}.{extension}"));
    let others = (2..).map(|n| PathBuf::from(format!("{title}_{step:05}_{n}.{extension}")));
    std::iter::once(first.clone()).chain(others).find(|path| !path.exists()).unwrap_or(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_title_names_a_file_in_the_working_directory() {
        assert_eq!(free_name("yard at dusk", 7, "png"), PathBuf::from("yard at dusk_00007.png"));
        assert_eq!(free_name("../a:b", 0, "png"), PathBuf::from("_a_b_00000.png"));
    }
}
