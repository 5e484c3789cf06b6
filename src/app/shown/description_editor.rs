//! Fields of what is described, to be changed: a row each, by the JSON schema of its struct. No kind of thing is named.

use egui::{Checkbox, ComboBox, DragValue, Ui};
use serde_json::{Map, Value};
use systems::describe::Field;

/// A number that gets an end and had none.
const FIRST_END: f64 = 10.0;

/// Shows fields in a grid of two columns, and takes over what is changed. Those that may be left out and are, are not
/// shown. True if something has changed.
pub fn show(ui: &mut Ui, fields: impl Iterator<Item = Field>, values: &mut Map<String, Value>) -> bool {
    let mut has_changed = false;
    for field in fields {
        let Some(value) = values.get_mut(field.name).filter(|value| !value.is_null() || field.is_infinite()) else {
            continue;
        };
        ui.weak(field.name.trim_end_matches("_degrees").replace('_', " ")).on_hover_text(field.doc());
        ui.horizontal(|ui| has_changed |= edit(ui, &field, value));
        ui.end_row();
    }
    has_changed
}

fn edit(ui: &mut Ui, field: &Field, value: &mut Value) -> bool {
    if field.is_infinite() {
        return end(ui, field, value);
    }
    if field.schema["see"] == "colour" {
        return color(ui, value);
    }
    match value {
        Value::Bool(on) => ui.add(Checkbox::without_text(on)).changed(),
        Value::Number(_) => number(ui, field, value),
        Value::Array(items) => items.iter_mut().fold(false, |changed, item| number(ui, field, item) | changed),
        Value::String(chosen) => choice(ui, field, chosen),
        Value::Object(_) | Value::Null => {
            ui.weak(value.to_string());
            false
        }
    }
}

/// A number that may have no end.
fn end(ui: &mut Ui, field: &Field, value: &mut Value) -> bool {
    let mut ends = !value.is_null();
    let mut has_changed = ui.add(Checkbox::without_text(&mut ends)).changed();
    if has_changed {
        *value = if ends { FIRST_END.into() } else { Value::Null };
    }
    if ends {
        has_changed |= number(ui, field, value);
    } else {
        ui.weak("unlimited");
    }
    has_changed
}

/// Leaves a number beyond its range alone until it is edited.
fn number(ui: &mut Ui, field: &Field, value: &mut Value) -> bool {
    let Some(mut number) = value.as_f64() else { return false };
    let limit = |key: &str, without: f64| field.schema[key].as_f64().unwrap_or(without);
    let least = limit("minimum", limit("exclusiveMinimum", f64::NEG_INFINITY));
    let range = least..=limit("maximum", f64::INFINITY);
    let is_whole = value.is_u64() || value.is_i64();
    let unit = if field.unit().is_empty() { String::new() } else { format!(" {}", field.unit()) };
    let drag = DragValue::new(&mut number).clamp_existing_to_range(false).range(range);
    let speed = if is_whole { 1.0 } else { number_speed(value) };
    let drag = drag.speed(speed).max_decimals(if is_whole { 0 } else { 3 }).suffix(unit.replace(" °", "°"));
    let has_changed = ui.add(drag).changed();
    if has_changed {
        *value = if is_whole { (number as u64).into() } else { number.into() };
    }
    has_changed
}

/// A hundredth of the number for each point of the screen.
fn number_speed(value: &Value) -> f64 {
    (value.as_f64().unwrap_or_default().abs() * 0.01).max(0.001)
}

/// Writes only where something was chosen: colours brighter than the button can show stay as they are.
fn color(ui: &mut Ui, value: &mut Value) -> bool {
    let part = |i: usize| value[i].as_f64().unwrap_or_default() as f32;
    let mut rgb = [part(0), part(1), part(2)];
    let has_changed = ui.color_edit_button_rgb(&mut rgb).changed();
    if has_changed {
        *value = rgb.to_vec().into();
    }
    has_changed
}

fn choice(ui: &mut Ui, field: &Field, chosen: &mut String) -> bool {
    let before = chosen.clone();
    ComboBox::from_id_salt(field.name).selected_text(chosen.as_str()).show_ui(ui, |ui| {
        for name in field.names() {
            ui.selectable_value(chosen, name.to_owned(), name);
        }
    });
    *chosen != before
}
