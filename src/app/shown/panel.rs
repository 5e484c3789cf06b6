//! The panel: what the last frame did, and the switches of the view. In the other corner, a card about one object.

use crate::app::control::input::{Command, KEYS, POINTER};
use crate::app::shown::details::{self, row};
use crate::app::shown::entities::EntityList;
use crate::app::shown::{legend, light_editor, object_lights, sensor_panel, weather_panel};
use crate::app::timing::Timing;
use crate::app::viewer::Viewer;
use crate::name;
use crate::renderer::{DebugView, Occlusion, RenderStats, Settings, VisibleCounts};
use crate::sense::sensor_names;
use bevy_ecs::prelude::*;
use egui::{Align2, Area, CollapsingHeader, Color32, ComboBox, Frame, Grid, Id, Margin, Panel, RichText, ScrollArea};
use egui::{Slider, SliderClamping, Ui};
use systems::assets::levels::LevelOfDetail;
use systems::assets::{Technique, texture_memory};
use systems::draw::{Environment, ToneMap, View};
use systems::ecs::clock::{Clock, SPEEDS};
use systems::ecs::stats::{FrameStats, Stage};
use systems::lights::{LightPolicies, LightPolicy, LightRecord};

/// Points.
pub const WIDTH: f32 = 292.0;
const CARD_WIDTH: f32 = 250.0;

/// Data of the last frame that the panel shows.
pub struct FrameInfo<'a> {
    /// The adapter's name and kind.
    pub adapter: &'a str,
    /// Statistics of draws and uploads.
    pub stats: RenderStats,
    /// Visible objects, as far as the GPU has told.
    pub drawn: Option<VisibleCounts>,
    pub timing: Timing,
    /// View that it was drawn for.
    pub view: &'a View,
}

/// The panel, with what it remembers from frame to frame.
#[derive(Default)]
pub struct SidePanel {
    entities: EntityList,
}

impl SidePanel {
    /// Shows the panel; returns what a button asks for.
    pub fn show(&mut self, ui: &mut Ui, viewer: &mut Viewer, info: &FrameInfo) -> Option<Command> {
        let mut command = None;
        in_panel(ui, |ui| {
            ui.add(egui::Label::new(RichText::new(&viewer.session.scene.name).heading().strong()).truncate());
            headline(ui, viewer, info);
            if !viewer.notice.is_empty() {
                ui.add(egui::Label::new(RichText::new(&viewer.notice).color(Color32::from_rgb(255, 205, 110))));
            }
            if viewer.help {
                section(ui, "Keys", true, help);
            }
            section(ui, "Clock", true, |ui| command = clock(ui, viewer));
            section(ui, "Picture", true, |ui| picture(ui, viewer));
            section(ui, "Camera", true, |ui| camera(ui, viewer, info.view));
            section(ui, "Weather", false, |ui| {
                weather_panel::show(ui, &mut viewer.session.simulation.world);
            });
            let sensors = sensor_names(&mut viewer.session.simulation.world);
            if !sensors.is_empty() {
                section(ui, "Sensors", true, |ui| sensor_panel::show(ui, viewer, &sensors));
            }
            section(ui, "Statistics", true, |ui| statistics(ui, viewer, info));
            section(ui, "Entities", true, |ui| {
                let clicked = self.entities.show(ui, &mut viewer.session.simulation.world, viewer.selected);
                viewer.selected = clicked.or(viewer.selected);
            });
        });
        if let Some(object) = viewer.pointed_out().filter(|_| viewer.sensors.full.is_none()) {
            card(ui, viewer, object, info.view);
        }
        command
    }
}

/// At the right, from top to bottom; what has no room is scrolled to.
fn in_panel(ui: &mut Ui, contents: impl FnOnce(&mut Ui)) {
    let frame = Frame::new().fill(ui.visuals().panel_fill).inner_margin(Margin::symmetric(10, 8));
    let panel = Panel::right("panel").resizable(false).exact_size(WIDTH).frame(frame).show_separator_line(false);
    panel.show(ui, |ui| ScrollArea::vertical().auto_shrink([false, false]).show(ui, contents));
}

fn section<R>(ui: &mut Ui, title: &str, open: bool, contents: impl FnOnce(&mut Ui) -> R) {
    ui.add_space(3.0);
    ui.separator();
    CollapsingHeader::new(RichText::new(title).strong()).default_open(open).show_unindented(ui, contents);
}

fn headline(ui: &mut Ui, viewer: &mut Viewer, info: &FrameInfo) {
    let timing = info.timing;
    let text = match viewer.clock().paused {
        true => format!("paused · {:.1} ms of work per frame", timing.work_ms),
        false => {
            format!("{:.1} ms · {:.0} frames/s · {:.1} ms of work", timing.frame_ms, timing.rate(), timing.work_ms)
        }
    };
    ui.weak(text);
}

fn clock(ui: &mut Ui, viewer: &mut Viewer) -> Option<Command> {
    let mut command = None;
    let mut clock = viewer.clock();
    let Clock { paused, step, speed, .. } = *clock;
    let seconds = clock.seconds();
    ui.horizontal(|ui| {
        if ui.button(if paused { "resume" } else { "pause" }).clicked() {
            command = Some(Command::Pause);
        }
        if ui.add_enabled(paused, egui::Button::new("step")).clicked() {
            command = Some(Command::Step);
        }
        ui.weak(format!("{seconds:.2} s, step {step}"));
    });
    let mut changed = speed;
    let slider =
        Slider::new(&mut changed, SPEEDS).logarithmic(true).clamping(SliderClamping::Edits).suffix("×").text("speed");
    if ui.add(slider).changed() {
        clock.speed = changed;
    }
    command
}

fn picture(ui: &mut Ui, viewer: &mut Viewer) {
    let settings = &mut viewer.settings;
    choice(ui, "bump mapping", |ui| {
        ui.selectable_value(&mut settings.technique, None, "from the material");
        for (name, technique) in Technique::ALL {
            ui.selectable_value(&mut settings.technique, Some(technique), words(name));
        }
    });
    let world = &mut viewer.session.simulation.world;
    let mut policies = world.resource_mut::<LightPolicies>();
    let mut wanted = *policies;
    choice(ui, "lights", |ui| {
        ui.selectable_value(&mut wanted.forced, None, "from the scene");
        for (name, choice) in LightPolicy::ALL {
            ui.selectable_value(&mut wanted.forced, Some(choice), name);
        }
    });
    policies.set_if_neq(wanted);
    choice(ui, "debug view", |ui| {
        for (name, view) in DebugView::ALL {
            ui.selectable_value(&mut settings.debug, view, words(name));
        }
    });
    if let Some(scale) = settings.debug.heat_scale() {
        legend::show(ui, &scale);
    }
    ui.checkbox(&mut viewer.light_lines, "lines to the selected object's lights");
    let mut fewer = settings.levels.enabled;
    ui.checkbox(&mut fewer, "levels of detail");
    if fewer != settings.levels.enabled {
        settings.levels = if fewer { LevelOfDetail::default() } else { LevelOfDetail::OFF };
    }
    let mut hidden = settings.occlusion != Occlusion::Off;
    ui.checkbox(&mut hidden, "occlusion culling");
    settings.occlusion = if hidden { Occlusion::Auto } else { Occlusion::Off };
    ui.checkbox(&mut settings.specular_aa, "specular antialiasing");
    ui.add(Slider::new(&mut settings.shadow_maps, 0..=Settings::MOST_SHADOW_MAPS).text("shadow maps"));
    let mut environment = world.resource_mut::<Environment>();
    let (mut tone_map, mut exposure) = (environment.tone_map, environment.exposure);
    choice(ui, "tone map", |ui| {
        for (name, curve) in ToneMap::ALL {
            ui.selectable_value(&mut tone_map, curve, name);
        }
    });
    let slider = Slider::new(&mut exposure, 0.01..=100.0).logarithmic(true).clamping(SliderClamping::Edits);
    ui.add(slider.text("exposure"));
    if (tone_map, exposure) != (environment.tone_map, environment.exposure) {
        (environment.tone_map, environment.exposure) = (tone_map, exposure);
    }
}

/// A name, and its choices in a line that wraps.
pub(super) fn choice(ui: &mut Ui, name: &str, choices: impl FnOnce(&mut Ui)) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        ui.weak(name);
        choices(ui);
    });
}

fn words(name: &str) -> String {
    name.replace('_', " ")
}

fn camera(ui: &mut Ui, viewer: &mut Viewer, view: &View) {
    let viewpoints = viewer.viewpoints();
    let name_of = |viewpoint| viewpoints.iter().find(|(_, known)| *known == viewpoint).map(|(name, _)| name.as_str());
    let (before, mut chosen) = (viewer.session.viewpoint, viewer.session.viewpoint);
    let shown = name_of(before).unwrap_or("(no name)").to_owned();
    ui.horizontal(|ui| {
        ComboBox::from_id_salt("camera").selected_text(shown).width(150.0).truncate().show_ui(ui, |ui| {
            for (name, viewpoint) in &viewpoints {
                ui.selectable_value(&mut chosen, *viewpoint, name);
            }
        });
        let moved = viewer.controller.pose().is_some();
        if ui.add_enabled(moved, egui::Button::new("reset")).clicked() || chosen != before {
            viewer.controller.reset();
        }
    });
    viewer.session.viewpoint = chosen;
    ui.weak(format!("at {}", details::meters(&viewer.session.simulation.world, view.eye())));
}

fn statistics(ui: &mut Ui, viewer: &mut Viewer, info: &FrameInfo) {
    let (stats, world) = (info.stats, &viewer.session.simulation.world);
    let frame = world.resource::<FrameStats>();
    let lights = &viewer.session.simulation.draw_list().lights.records;
    let lights = lights.iter().filter(|light| light.kind() != LightRecord::OFF).count();
    Grid::new("statistics").num_columns(2).striped(true).min_col_width(70.0).show(ui, |ui| {
        row(ui, "adapter", info.adapter);
        row(ui, "picture", &format!("{} × {}", info.view.width, info.view.height));
        row(ui, "objects", &count(frame.objects as u64));
        let drawn =
            |drawn: VisibleCounts| format!("{}, {} triangles", count(drawn.objects.into()), count(drawn.triangles));
        row(ui, "in view", &info.drawn.map_or_else(String::new, drawn));
        row(ui, "draws", &format!("{} in {} calls ({} blended)", stats.draws, stats.draw_calls, frame.transparent));
        row(ui, "lights", &count(lights as u64));
        let textures = texture_memory::used(viewer.session.simulation.library());
        let megabytes = textures.bytes.div_ceil(1 << 20);
        row(ui, "textures", &format!("{}, {megabytes} MB", count(textures.images as u64)));
        let shadows = stats.shadows;
        let drawn = format!("{} maps, {} faces of {} drawn", shadows.layers, shadows.faces, shadows.passes);
        row(ui, "shadows", &drawn);
        row(ui, "uploaded", &format!("{} bytes", count(stats.uploaded_bytes())));
        let selection = frame.stage_ms[Stage::Lights as usize];
        let again = format!("{selection:.2} ms, {} objects", count(frame.selected as u64));
        row(ui, "light selection", &again);
        let further =
            format!("{} lights of {} objects", count(frame.listed_lights), count(frame.listed_objects as u64));
        row(ui, "beyond three", &further);
        row(ui, "changed", &format!("{} objects", count(frame.instances_written as u64)));
        row(ui, "systems", &format!("{:.2} ms", frame.cpu_ms()));
    });
    CollapsingHeader::new("stages").default_open(false).show(ui, |ui| {
        Grid::new("stages").num_columns(2).striped(true).min_col_width(70.0).show(ui, |ui| {
            for (name, stage) in Stage::ALL {
                row(ui, name, &format!("{:.3} ms", frame.stage_ms[stage as usize]));
            }
        });
    });
}

/// Digits in groups of three.
fn count(number: u64) -> String {
    let digits = number.to_string();
    let groups: Vec<&str> = digits.as_bytes().rchunks(3).rev().filter_map(|g| std::str::from_utf8(g).ok()).collect();
    groups.join("\u{2009}")
}

/// Shows a card about the object that is pointed out, in the other corner.
fn card(ui: &mut Ui, viewer: &mut Viewer, object: Entity, view: &View) {
    // A card about what is under the pointer must not be under the pointer itself: it would come and go.
    let selected = viewer.hovered.is_none();
    let area = Area::new(Id::unique("card")).anchor(Align2::LEFT_TOP, [8.0, 8.0]).interactable(selected);
    let frame = Frame::new().fill(ui.visuals().panel_fill).inner_margin(Margin::same(8)).corner_radius(4);
    area.show(ui.ctx(), |ui| {
        frame.show(ui, |ui| {
            ui.set_width(CARD_WIDTH);
            let world = &mut viewer.session.simulation.world;
            ui.label(RichText::new(name::of_entity(world, object)).strong());
            let lights = object_lights::object_lights(world, object, viewer.pointed_at);
            if let Some(lights) = &lights {
                let clicked = object_lights::show_lights(ui, world, lights);
                viewer.selected = clicked.or(viewer.selected);
            }
            details::show(ui, world, object);
            if !selected {
                return;
            }
            light_editor::show(ui, world, object);
            ui.horizontal(|ui| {
                if let Some(lights) = lights.filter(|_| ui.button("go to it").clicked()) {
                    viewer.controller.grab(view, lights.bounds.center).go_to(lights.bounds);
                }
                if ui.button("deselect").clicked() {
                    viewer.selected = None;
                }
            });
        });
    });
}

/// Points, for the names of keys.
const KEYS_WIDTH: f32 = 44.0;

fn help(ui: &mut Ui) {
    // With a bound, what a cell says wraps rather than being cut off.
    let widest = ui.available_width() - KEYS_WIDTH - ui.spacing().item_spacing.x;
    Grid::new("keys").num_columns(2).striped(true).min_col_width(KEYS_WIDTH).max_col_width(widest).show(ui, |ui| {
        for binding in &KEYS {
            ui.label(binding.keys.join("  "));
            ui.weak(binding.help);
            ui.end_row();
        }
    });
    for (what, does) in POINTER {
        ui.horizontal_wrapped(|ui| {
            ui.label(what);
            ui.weak(does);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Right edges of the texts that are laid out in a panel, and that of the room they have; points.
    fn edges_of(size: egui::Vec2, mut contents: impl FnMut(&mut Ui)) -> Vec<(String, f32, f32)> {
        let context = egui::Context::default();
        context.all_styles_mut(crate::app::screen::gui::set_style);
        let screen = egui::Rect::from_min_size(egui::Pos2::ZERO, size);
        let mut shapes = Vec::new();
        // A grid knows the widths of its columns from the second time on.
        for _ in 0..3 {
            let input = egui::RawInput { screen_rect: Some(screen), ..Default::default() };
            let mut output = context.run_ui(input, |ui| in_panel(ui, &mut contents));
            // Nothing is painted.
            output.textures_delta.clear();
            shapes = output.shapes;
        }
        let texts = shapes.iter().filter_map(|clipped| match &clipped.shape {
            egui::Shape::Text(text) => {
                let right = text.pos.x + text.galley.rect.max.x;
                Some((text.galley.text().to_owned(), right, clipped.clip_rect.max.x.min(size.x)))
            }
            _ => None,
        });
        texts.collect()
    }

    #[test]
    fn every_key_can_be_read_to_its_end() {
        for size in [egui::vec2(1280.0, 720.0), egui::vec2(640.0, 360.0), egui::vec2(1280.0, 4000.0)] {
            let edges = edges_of(size, |ui| section(ui, "Keys", true, help));
            for binding in &KEYS {
                let of_binding = edges.iter().find(|(text, ..)| text == binding.help);
                // What is scrolled out of sight is not laid out.
                assert!(of_binding.is_some() || size.y < 4000.0, "{}", binding.help);
            }
            for (text, right, room) in &edges {
                assert!(right <= room, "{text:?} ends at {right}, the panel at {room} of {size}");
            }
        }
    }

    #[test]
    fn large_numbers_are_grouped() {
        assert_eq!(count(0), "0");
        assert_eq!(count(999), "999");
        assert_eq!(count(1_234_567), "1\u{2009}234\u{2009}567");
    }
}
