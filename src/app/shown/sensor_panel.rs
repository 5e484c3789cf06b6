//! The sensors in the panel: which are looked at, and what of them.

use crate::app::sensors::choice::{self, Choice};
use crate::app::sensors::views::SensorViews;
use crate::app::viewer::Viewer;
use bevy_ecs::prelude::*;
use egui::{Align, Label, Layout, RichText, ScrollArea, Sense, Ui};
use systems::sensors::Sensor;

/// Points.
const HEIGHT: f32 = 260.0;

/// Shows the switches of sensors, which have names.
pub fn show(ui: &mut Ui, viewer: &mut Viewer, sensors: &[(String, Entity)]) {
    let Viewer { session, sensors: views, .. } = viewer;
    let mut changed = ui.checkbox(&mut views.beams, "frusta and beams").changed();
    if let Some(every) = views.captures.thinned().filter(|_| views.beams) {
        ui.weak(format!("of the beams one in {every} is drawn"));
    }
    let list = ScrollArea::vertical().id_salt("sensors").max_height(HEIGHT).min_scrolled_height(HEIGHT);
    list.auto_shrink([false, true]).show(ui, |ui| {
        for (name, entity) in sensors {
            let Some(sensor) = session.simulation.world.get::<Sensor>(*entity) else { continue };
            ui.horizontal(|ui| {
                let mut open = views.is_open(*entity);
                let mut clicked = ui.checkbox(&mut open, "").changed();
                ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                    let rate = if sensor.every == 1 { String::new() } else { format!(", every {}", sensor.every) };
                    ui.weak(RichText::new(format!("{}{rate}", choice::description(sensor))).small());
                    ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                        clicked |= ui.add(Label::new(name).truncate().sense(Sense::click())).clicked();
                    });
                });
                if clicked {
                    views.toggle(*entity);
                    changed = true;
                }
            });
            if views.is_open(*entity) {
                ui.indent(entity, |ui| choices(ui, views, *entity, sensor));
            }
        }
    });
    if changed {
        // What is looked at from now on is captured before the next frame.
        ui.request_repaint();
    }
}

/// Shows the choices of a sensor's pictures, in a line that wraps.
pub fn choices(ui: &mut Ui, views: &mut SensorViews, entity: Entity, sensor: &Sensor) {
    let before = views.choice(entity, sensor);
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        for (name, choice) in Choice::all_of(sensor) {
            if ui.selectable_label(before == Some(choice), name).clicked() {
                views.choose(entity, choice);
            }
        }
    });
}
