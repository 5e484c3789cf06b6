//! egui on winit and wgpu: events in, triangles over the scene out.

use crate::renderer::Gpu;
use egui::epaint::{ClippedPrimitive, Shadow};
use egui::{Color32, FontFamily, FontId, Stroke, TextStyle, TexturesDelta, ViewportId};
use glam::Vec2;
use std::time::Duration;
use winit::event::WindowEvent;
use winit::window::Window;

/// The user interface of a window.
pub struct Gui {
    /// State of the widgets.
    pub context: egui::Context,
    state: egui_winit::State,
    renderer: egui_wgpu::Renderer,
    triangles: Vec<ClippedPrimitive>,
    /// Changes of textures that no frame has shown yet.
    textures: TexturesDelta,
    pixels_per_point: f32,
    /// Rectangle that the panel leaves of the window, points.
    scene: egui::Rect,
}

impl Gui {
    /// For a window whose panel view has that format.
    pub fn new(gpu: &Gpu, format: wgpu::TextureFormat, window: &Window) -> Self {
        let context = egui::Context::default();
        context.set_theme(egui::Theme::Dark);
        context.all_styles_mut(set_style);
        let largest = gpu.device.limits().max_texture_dimension_2d as usize;
        let scale = window.scale_factor() as f32;
        let state = egui_winit::State::new(context.clone(), ViewportId::ROOT, window, Some(scale), None, Some(largest));
        // Dithering would add noise to pixels that nothing is painted on.
        let options = egui_wgpu::RendererOptions { dithering: false, ..Default::default() };
        Self {
            context,
            state,
            renderer: egui_wgpu::Renderer::new(&gpu.device, format, options),
            triangles: Vec::new(),
            textures: TexturesDelta::default(),
            pixels_per_point: scale,
            scene: egui::Rect::EVERYTHING,
        }
    }

    /// Hands an event to the widgets.
    pub fn on_event(&mut self, window: &Window, event: &WindowEvent) {
        let _ = self.state.on_window_event(window, event);
    }

    /// Tells if a text field has the keyboard.
    pub fn is_typing(&self) -> bool {
        self.context.text_edit_focused()
    }

    /// Tells if a widget covers a pixel. egui's own answer would be for the pointer of the last frame, and a click may
    /// follow a movement at once.
    pub fn covers(&self, at: Vec2) -> bool {
        let at = egui::pos2(at.x, at.y) / self.pixels_per_point;
        let floats = self.context.layer_id_at(at).is_some_and(|layer| layer.order != egui::Order::Background);
        floats || !self.scene.contains(at)
    }

    /// Lays the widgets out; returns how long they stay as they are.
    pub fn run(&mut self, window: &Window, mut widgets: impl FnMut(&mut egui::Ui)) -> Duration {
        let input = self.state.take_egui_input(window);
        let scene = &mut self.scene;
        let output = self.context.run_ui(input, |ui| {
            widgets(ui);
            *scene = ui.available_rect_before_wrap();
        });
        self.state.handle_platform_output(window, output.platform_output);
        self.pixels_per_point = output.pixels_per_point;
        self.triangles = self.context.tessellate(output.shapes, output.pixels_per_point);
        self.textures.append(output.textures_delta);
        output.viewport_output.get(&ViewportId::ROOT).map_or(Duration::MAX, |viewport| viewport.repaint_delay)
    }

    /// Paints the widgets over what is in the view; pixels that no widget covers stay as they are.
    pub fn paint(&mut self, gpu: &Gpu, view: &wgpu::TextureView, (width, height): (u32, u32)) {
        let mut textures = std::mem::take(&mut self.textures);
        for (id, delta) in textures.set.drain().flat_map(|(id, deltas)| deltas.into_iter().map(move |d| (id, d))) {
            self.renderer.update_texture(&gpu.device, &gpu.queue, id, &delta);
        }
        if !self.triangles.is_empty() {
            let screen = egui_wgpu::ScreenDescriptor {
                size_in_pixels: [width, height],
                pixels_per_point: self.pixels_per_point,
            };
            let label = wgpu::CommandEncoderDescriptor { label: Some("panel") };
            let mut encoder = gpu.device.create_command_encoder(&label);
            self.renderer.update_buffers(&gpu.device, &gpu.queue, &mut encoder, &self.triangles, &screen);
            let ops = wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store };
            let mut pass = encoder
                .begin_render_pass(&wgpu::RenderPassDescriptor {
                    label: Some("panel"),
                    color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                        view,
                        depth_slice: None,
                        resolve_target: None,
                        ops,
                    })],
                    ..Default::default()
                })
                .forget_lifetime();
            self.renderer.render(&mut pass, &self.triangles, &screen);
            drop(pass);
            gpu.queue.submit([encoder.finish()]);
        }
        for id in textures.free.drain() {
            self.renderer.free_texture(&id);
        }
    }
}

impl Drop for Gui {
    /// A frame may fail between [`Self::run`] and [`Self::paint`], as where the device is lost. Its changes of textures
    /// go with the device; in debug builds egui panics where they are dropped as they are.
    fn drop(&mut self) {
        self.textures.clear();
    }
}

/// Small and dark; nothing casts a shadow, which would darken the scene beside the panel.
pub fn set_style(style: &mut egui::Style) {
    let font = |size| FontId::new(size, FontFamily::Proportional);
    style.text_styles = [
        (TextStyle::Small, font(10.5)),
        (TextStyle::Body, font(12.5)),
        (TextStyle::Button, font(12.5)),
        (TextStyle::Heading, font(15.0)),
        (TextStyle::Monospace, FontId::new(11.5, FontFamily::Monospace)),
    ]
    .into();
    style.spacing.item_spacing = egui::vec2(6.0, 3.0);
    style.spacing.button_padding = egui::vec2(6.0, 1.5);
    style.spacing.interact_size.y = 18.0;
    style.interaction.selectable_labels = false;
    let visuals = &mut style.visuals;
    visuals.window_shadow = Shadow::NONE;
    visuals.popup_shadow = Shadow::NONE;
    visuals.panel_fill = Color32::from_rgba_unmultiplied(18, 20, 24, 236);
    visuals.widgets.noninteractive.fg_stroke = Stroke::new(1.0, Color32::from_gray(205));
    visuals.widgets.noninteractive.bg_stroke = Stroke::new(1.0, Color32::from_gray(52));
    visuals.selection.bg_fill = Color32::from_rgb(36, 92, 140);
    visuals.selection.stroke = Stroke::new(1.0, Color32::from_gray(245));
}
