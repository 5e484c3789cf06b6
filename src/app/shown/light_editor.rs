//! The settings of a selected light, to be changed.

use crate::app::shown::description_editor;
use bevy_ecs::prelude::*;
use egui::{Grid, Slider, SliderClamping, Ui};
use serde_json::{Map, Value};
use systems::describe::{Field, faults, fields};
use systems::lights::{Light, LightDescription, LightFields};
use systems::run::standard_inputs::{EditLight, push_for};

/// Kelvin: place of the temperature slider for a colour that no black body has.
const DAYLIGHT: f64 = 6500.0;

/// Shows the settings of an entity's light, if it has one, and takes over what is changed.
pub fn show(ui: &mut Ui, world: &mut World, entity: Entity) {
    let Some(light) = world.get::<Light>(entity) else { return };
    let kind = light.kind.name();
    let before = LightDescription::from(light);
    let described = serde_json::to_value(before.fields());
    let Ok(Value::Object(mut values)) = described else { return };
    let mut has_changed = false;
    ui.add_space(4.0);
    Grid::new("light editor").num_columns(2).min_col_width(70.0).show(ui, |ui| {
        let (temperatures, others): (Vec<Field>, Vec<Field>) = fields::<LightFields>()
            .into_iter()
            .filter(|field| field.is_of(kind))
            .partition(|field| field.unit() == "K");
        has_changed = description_editor::show(ui, others.into_iter(), &mut values);
        for field in temperatures {
            has_changed |= temperature(ui, &field, &mut values);
        }
    });
    // The inner angle goes with the outer one.
    if let Some((inner, outer)) = values["inner_degrees"].as_f64().zip(values["outer_degrees"].as_f64()) {
        values["inner_degrees"] = inner.min(outer).into();
    }
    // Only a real change, as an input: a recording holds it. What was beyond its range before is left so.
    if has_changed
        && let Ok(edited) = before.edited(Value::Object(values))
        && faults(&edited).iter().all(|fault| faults(&before).contains(fault))
    {
        push_for(world, entity, |entity| EditLight { entity, light: (&edited).into() });
    }
}

/// A slider for a temperature, which is there even where no black body has the light's colour.
fn temperature(ui: &mut Ui, field: &Field, values: &mut Map<String, Value>) -> bool {
    ui.weak("temperature").on_hover_text(field.doc());
    let limit = |key: &str| field.schema[key].as_f64().unwrap_or(DAYLIGHT);
    let mut kelvin = values[field.name].as_f64().unwrap_or(DAYLIGHT);
    ui.spacing_mut().slider_width = 80.0;
    let slider = Slider::new(&mut kelvin, limit("minimum")..=limit("maximum")).logarithmic(true).fixed_decimals(0);
    let has_changed = ui.add(slider.suffix(" K").clamping(SliderClamping::Always)).changed();
    if has_changed {
        values.insert(field.name.into(), (kelvin as u32).into());
    }
    ui.end_row();
    has_changed
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy_ecs::change_detection::DetectChanges;
    use egui::{Event, Modifiers, PointerButton, Pos2, RawInput, Rect};
    use glam::Vec3;
    use systems::lights::LightKind;
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

    /// The light after a click at one of these places, the first that does as is wanted.
    fn clicked(places: impl Iterator<Item = Pos2>, is_wanted: impl Fn(&Light) -> bool) -> Light {
        let before = Light::point(1.0, 5.0);
        for pos in places {
            let (mut world, entity) = world_with(before.clone());
            let context = egui::Context::default();
            frame(&context, &mut world, entity, Vec::new());
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
            if is_wanted(light) {
                return light.clone();
            }
        }
        panic!("nothing to click at");
    }

    /// Near enough to each other to hit every box, whatever the font's size.
    fn everywhere() -> impl Iterator<Item = Pos2> {
        (8..300).step_by(6).flat_map(|y| (60..180).step_by(8).map(move |x| Pos2::new(x as f32, y as f32)))
    }

    #[test]
    fn a_click_switches_the_light_off() {
        let light = clicked(everywhere(), |light| !light.enabled);
        assert_eq!(light, Light { enabled: false, ..Light::point(1.0, 5.0) });
    }

    #[test]
    fn a_click_on_the_slider_gives_the_light_a_temperature() {
        let light = clicked(everywhere(), |light| light.color.x == 1.0 && light.color.z < 0.5);
        let described = LightDescription::from(&light);
        let kelvin = described.fields().temperature_kelvin.expect("a temperature");
        assert_eq!(light, Light::point(1.0, 5.0).with_kelvin(kelvin as f32));
    }

    #[test]
    fn a_click_gives_the_light_shadows() {
        let light = clicked(everywhere(), |light| light.shadows);
        assert_eq!(light, Light::point(1.0, 5.0).with_shadows());
    }
}
