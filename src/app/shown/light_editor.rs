//! The settings of a selected light, to be changed.

use bevy_ecs::prelude::*;
use egui::emath::Numeric;
use egui::{Checkbox, DragValue, Grid, Id, Slider, SliderClamping, Ui};
use glam::Vec3;
use systems::lights::{Light, LightKind};
use systems::run::standard_inputs::edit_light;

/// Range of a light that gets an end and had none, metres.
const FIRST_RANGE: f32 = 10.0;
/// Initial value of the temperature slider, kelvin: a light keeps its colour, not the temperature that it came from.
const DAYLIGHT: f32 = 6500.0;

/// Shows the settings of an entity's light, if it has one, and takes over what is changed.
pub fn show(ui: &mut Ui, world: &mut World, entity: Entity) {
    let Some(light) = world.get::<Light>(entity) else { return };
    let mut edited = light.clone();
    ui.add_space(4.0);
    Grid::new("light editor").num_columns(2).min_col_width(70.0).show(ui, |ui| {
        common(ui, entity, &mut edited);
        if edited.kind != LightKind::Directional {
            reach(ui, &mut edited);
        }
        shadows(ui, &mut edited);
        if let LightKind::Spot { outer, inner, exponent } = &mut edited.kind {
            cone(ui, outer, inner, exponent);
        }
    });
    // Only a real change, as an input: a recording holds it.
    if world.get::<Light>(entity).is_some_and(|light| *light != edited) {
        edit_light(world, entity, edited);
    }
}

fn field<R>(ui: &mut Ui, name: &str, contents: impl FnOnce(&mut Ui) -> R) {
    ui.weak(name);
    ui.horizontal(contents);
    ui.end_row();
}

/// A field that leaves a value beyond its range alone until it is edited.
fn number<N: Numeric>(value: &mut N) -> DragValue<'_> {
    DragValue::new(value).clamp_existing_to_range(false)
}

fn common(ui: &mut Ui, entity: Entity, light: &mut Light) {
    field(ui, "enabled", |ui| ui.add(Checkbox::without_text(&mut light.enabled)));
    field(ui, "colour", |ui| {
        color(ui, &mut light.color);
        ui.weak("ambient");
        color(ui, &mut light.ambient);
    });
    field(ui, "temperature", |ui| {
        let id = Id::unique("temperature").with(entity);
        let mut kelvin = ui.data(|data| data.get_temp(id)).unwrap_or(DAYLIGHT);
        ui.spacing_mut().slider_width = 80.0;
        let slider = Slider::new(&mut kelvin, 1667.0..=25000.0).logarithmic(true).fixed_decimals(0).suffix(" K");
        if ui.add(slider.clamping(SliderClamping::Always)).changed() {
            ui.data_mut(|data| data.insert_temp(id, kelvin));
            *light = light.clone().with_kelvin(kelvin);
        }
    });
    let speed = f64::from(light.intensity.abs().max(0.1)) * 0.01;
    field(ui, "intensity", |ui| ui.add(number(&mut light.intensity).range(0.0..=1e7).speed(speed)));
}

/// Writes only where something was chosen: colours brighter than the button can show stay as they are.
fn color(ui: &mut Ui, color: &mut Vec3) {
    let mut rgb = color.to_array();
    if ui.color_edit_button_rgb(&mut rgb).changed() {
        *color = rgb.into();
    }
}

fn reach(ui: &mut Ui, light: &mut Light) {
    field(ui, "range", |ui| {
        let mut ends = light.range.is_finite();
        if ui.add(Checkbox::without_text(&mut ends)).changed() {
            light.range = if ends { FIRST_RANGE } else { f32::INFINITY };
        }
        if ends {
            ui.add(number(&mut light.range).range(1e-3..=1e7).speed(0.1).suffix(" m"));
        } else {
            ui.weak("unlimited");
        }
    });
    let inverse_square = light.attenuation == Light::INVERSE_SQUARE;
    field(ui, "attenuation", |ui| {
        if ui.selectable_label(inverse_square, "inverse square").clicked() {
            light.attenuation = Light::INVERSE_SQUARE;
        }
        if ui.selectable_label(!inverse_square, "classic").clicked() && inverse_square {
            light.attenuation = Light::point(1.0, 1.0).attenuation;
        }
    });
    if !inverse_square {
        field(ui, "", |ui| {
            for (coefficient, unit) in light.attenuation.as_mut().iter_mut().zip(["", " /m", " /m²"]) {
                ui.add(number(coefficient).range(0.0..=1e6).speed(0.01).max_decimals(3).suffix(unit));
            }
        });
    }
}

fn shadows(ui: &mut Ui, light: &mut Light) {
    field(ui, "shadows", |ui| {
        ui.add(Checkbox::without_text(&mut light.shadows));
        if light.shadows && light.kind != LightKind::Directional {
            ui.weak("from");
            ui.add(number(&mut light.shadow_near).range(1e-3..=1e3).speed(0.005).max_decimals(3).suffix(" m"));
        }
    });
    if light.kind == LightKind::Directional {
        let mut degrees = light.angle.to_degrees();
        field(ui, "angle", |ui| {
            let drag = number(&mut degrees).range(0.0..=Light::MOST_DEGREES).speed(0.01).max_decimals(2).suffix("°");
            if ui.add(drag).changed() {
                light.angle = degrees.to_radians();
            }
        });
    } else {
        let radius = number(&mut light.radius).range(0.0..=Light::MOST_RADIUS).speed(0.005).max_decimals(3);
        field(ui, "radius", |ui| ui.add(radius.suffix(" m")));
    }
}

/// Half angles; the inner one, or the classic exponent.
fn cone(ui: &mut Ui, outer: &mut f32, inner: &mut Option<f32>, exponent: &mut f32) {
    field(ui, "cone", |ui| {
        angle(ui, outer, 85.0);
        match inner {
            Some(inner) => {
                ui.weak("inner");
                angle(ui, inner, outer.to_degrees());
            }
            None => {
                ui.weak("exponent");
                ui.add(number(exponent).range(0.0..=1e4).speed(0.1));
            }
        }
    });
}

/// Writes only where something was chosen: to degrees and back is not quite the same angle.
fn angle(ui: &mut Ui, radians: &mut f32, most: f32) {
    let mut degrees = radians.to_degrees();
    if ui.add(number(&mut degrees).range(0.1..=most).speed(0.2).max_decimals(1).suffix("°")).changed() {
        *radians = degrees.to_radians();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy_ecs::change_detection::DetectChanges;
    use egui::{Event, Modifiers, PointerButton, Pos2, RawInput, Rect};
    use systems::run::inputs;

    fn world_with(light: Light) -> (World, Entity) {
        let mut world = World::new();
        world.init_resource::<inputs::Inputs>();
        let entity = world.spawn(light).id();
        systems::run::registry::register_all(&mut world);
        (world, entity)
    }

    /// A frame of the editor alone.
    fn frame(context: &egui::Context, world: &mut World, entity: Entity, events: Vec<Event>) {
        let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, egui::vec2(300.0, 400.0)));
        let mut output =
            context.run_ui(RawInput { screen_rect, events, ..RawInput::default() }, |ui| show(ui, world, entity));
        output.textures_delta.clear();
        inputs::apply_queued(world);
    }

    #[test]
    fn a_light_that_is_only_looked_at_stays_as_it_is() {
        let classic = LightKind::Spot { outer: 1.5, inner: None, exponent: 2e4 };
        let odd = Light { kind: classic, intensity: 3e8, range: 1e-5, ..Light::point(1.0, 1.0) };
        let bright =
            Light::spot(-2.0, 1e9, 0.3).with_color(Vec3::new(7.0, -1.0, 0.5)).with_attenuation(Vec3::splat(1e8));
        for light in [odd, bright, Light::directional(1.0)] {
            let (mut world, entity) = world_with(light.clone());
            world.increment_change_tick();
            let context = egui::Context::default();
            let shown = format!("{light:?}");
            (0..3).for_each(|_| frame(&context, &mut world, entity, Vec::new()));
            let now = world.entity(entity).get_ref::<Light>().expect("a light");
            assert_eq!(format!("{:?}", *now), shown);
            assert_eq!(now.last_changed(), now.added(), "not even touched");
        }
    }

    /// The light after a click at each of these places in turn, until something changed.
    fn clicked(places: impl Iterator<Item = Pos2>) -> Light {
        let before = Light::point(1.0, 5.0);
        let (mut world, entity) = world_with(before.clone());
        let context = egui::Context::default();
        frame(&context, &mut world, entity, Vec::new());
        for pos in places {
            let button = |pressed| Event::PointerButton {
                pos,
                button: PointerButton::Primary,
                pressed,
                modifiers: Modifiers::NONE,
            };
            frame(&context, &mut world, entity, vec![Event::PointerMoved(pos)]);
            frame(&context, &mut world, entity, vec![button(true)]);
            frame(&context, &mut world, entity, vec![button(false)]);
            let light = world.get::<Light>(entity).expect("a light");
            if *light != before {
                return light.clone();
            }
        }
        panic!("nothing to click at");
    }

    #[test]
    fn a_click_switches_the_light_off() {
        // The first row has one thing to click at, whatever the font's size.
        let light = clicked((60..140).step_by(4).map(|x| Pos2::new(x as f32, 14.0)));
        assert_eq!(light, Light { enabled: false, ..Light::point(1.0, 5.0) });
    }

    #[test]
    fn a_click_gives_the_light_shadows() {
        // The last row.
        let rows = (14..400).rev().step_by(6);
        let light = clicked(rows.flat_map(|y| (60..100).step_by(8).map(move |x| Pos2::new(x as f32, y as f32))));
        assert_eq!(light, Light::point(1.0, 5.0).with_shadows());
    }
}
