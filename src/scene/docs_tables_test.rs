//! Tables of the docs that are made of descriptions. Where one differs from its struct the test says so, and with
//! `RELIEF_WRITE_DOCS=1` it writes the table anew.

use super::format::cells::{Cell, Door, Portal};
use super::format::earth::GeoOrigin;
use super::format::entities::{Camera, Entity, Spin, Transform};
use super::format::generators::{Generator, Grid, Scatter};
use super::format::lights::Lights;
use super::format::roads::{Along, Limit, Physical, Route, Signal, SignalHead, Stop, Traffic, Vehicle};
use super::format::scene::{Clock, Environment, Scene};
use super::format::sensors::Class;
use super::format::surfaces::{Cube, Cylinder, MapSource, Material, ModelSource, Plane, Sampler, Sphere, Torus, Uv};
use super::format::vehicle_types as vehicles;
use serde_json::Value;
use std::path::Path;
use systems::describe::{Described, Field, fields, fields_of, schema};
use systems::lights::LightFields;
use systems::sensors::{
    BarometerSensor, CameraSensor, CollisionSensor, GnssSensor, ImuSensor, LaneSensor, Lens, LidarSensor, Rate,
};
use systems::weather::Weather;

/// A table below a heading of a document, and the fields that it is of.
struct Table {
    document: &'static str,
    heading: &'static str,
    fields: Vec<Field>,
    required: &'static Value,
}

fn table<T: Described>(document: &'static str, heading: &'static str) -> Table {
    Table { document, heading, fields: fields::<T>(), required: &schema::<T>()["required"] }
}

/// A kind of sensor: its settings and its rate.
fn sensor<T: Described>(heading: &'static str) -> Table {
    let own = table::<T>("sensors.md", heading);
    Table { fields: own.fields.into_iter().chain(fields::<Rate>()).collect(), ..own }
}

/// A kind of lens.
fn lens(heading: &'static str, kind: &str) -> Table {
    let mut kinds = schema::<Lens>()["oneOf"].as_array().into_iter().flatten();
    let of = kinds.find_map(|choice| choice["properties"].get(kind)).expect("a kind of lens");
    Table { document: "sensors.md", heading, fields: fields_of(of).collect(), required: &of["required"] }
}

fn scenes<T: Described>(heading: &'static str) -> Table {
    table::<T>("scenes.md", heading)
}

fn vehicles<T: Described>(heading: &'static str) -> Table {
    table::<T>("vehicles.md", heading)
}

fn tables() -> Vec<Table> {
    vec![
        scenes::<Scene>("## Scene"),
        scenes::<Environment>("## Environment"),
        scenes::<Clock>("## Clock"),
        scenes::<Material>("## Material"),
        scenes::<MapSource>("### Map"),
        scenes::<Uv>("### Uv"),
        scenes::<Sampler>("### Sampler"),
        scenes::<Plane>("### Plane"),
        scenes::<Cube>("### Cube"),
        scenes::<Sphere>("### Sphere"),
        scenes::<Torus>("### Torus"),
        scenes::<Cylinder>("### Cylinder"),
        scenes::<ModelSource>("### Model"),
        scenes::<Entity>("## Entity"),
        scenes::<Transform>("### Transform"),
        scenes::<Lights>("### Lights"),
        scenes::<LightFields>("### Fields of lights"),
        scenes::<Camera>("### Camera"),
        scenes::<Spin>("### Spin"),
        scenes::<Generator>("## Generator"),
        scenes::<Grid>("### Grid"),
        scenes::<Scatter>("### Scatter"),
        scenes::<Along>("### Along"),
        scenes::<Traffic>("## Traffic"),
        scenes::<Route>("### Route"),
        scenes::<Limit>("### Limit"),
        scenes::<Stop>("### Stop"),
        scenes::<Signal>("### Signal"),
        scenes::<SignalHead>("### Signal head"),
        scenes::<Cell>("## Cell"),
        scenes::<Portal>("### Portal"),
        scenes::<Door>("### Door"),
        vehicles::<Vehicle>("### Vehicle"),
        vehicles::<Physical>("### Physical"),
        vehicles::<vehicles::VehicleTypes>("### Vehicle types"),
        vehicles::<vehicles::VehicleType>("### Vehicle type"),
        vehicles::<vehicles::VehicleLimits>("### Vehicle limits"),
        vehicles::<vehicles::Driver>("### Driver"),
        vehicles::<vehicles::Wheels>("### Wheels"),
        vehicles::<vehicles::Cranks>("### Cranks"),
        vehicles::<vehicles::Swing>("### Swing"),
        vehicles::<vehicles::Trailer>("### Trailer"),
        vehicles::<vehicles::Lamps>("### Lamps"),
        vehicles::<vehicles::Paint>("### Paint"),
        sensor::<CameraSensor>("### Camera sensor"),
        lens("#### Field of view", "field_of_view"),
        lens("#### Pinhole", "pinhole"),
        lens("#### Brown Conrady", "brown_conrady"),
        lens("#### Kannala Brandt", "kannala_brandt"),
        lens("#### Orthographic", "orthographic"),
        table::<systems::sensors::ImageNoise>("sensors.md", "### Image noise"),
        sensor::<LidarSensor>("### Lidar sensor"),
        sensor::<ImuSensor>("#### IMU sensor"),
        sensor::<GnssSensor>("#### GNSS sensor"),
        sensor::<LaneSensor>("#### Lane sensor"),
        sensor::<BarometerSensor>("#### Barometer sensor"),
        sensor::<CollisionSensor>("#### Collision sensor"),
        table::<GeoOrigin>("sensors.md", "#### Geo origin"),
        table::<Weather>("weather.md", "## Fields"),
        table::<Class>("sensors.md", "### Class"),
    ]
}

impl Table {
    /// A row for each field, and for each field of a part.
    fn rows(&self) -> Vec<(String, String)> {
        let row = |name: &str, field: &Field| {
            let is_required = self.required.as_array().is_some_and(|names| names.iter().any(|own| own == field.name));
            let default = if is_required { "*required*".into() } else { default(field.schema) };
            let kinds: Vec<String> = field.schema["kinds"].as_array().into_iter().flatten().map(code).collect();
            let kinds = if kinds.is_empty() { String::new() } else { format!("{}: ", kinds.join(", ")) };
            (name.to_owned(), format!("| `{name}` | {} | {default} | {kinds}{} |", values(field.schema), said(field)))
        };
        let mut rows = Vec::new();
        for field in &self.fields {
            if field.is_part() && field.schema["see"].is_null() {
                let part = |part: Field| row(&format!("{}.{}", field.name, part.name), &part);
                rows.extend(fields_of(field.schema).map(part));
            } else {
                rows.push(row(field.name, field));
            }
        }
        rows
    }

    /// The document with the rows in place of the table's own; those that it has keep their order.
    fn written(&self, text: &str) -> String {
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        let at = lines.iter().position(|line| line == self.heading);
        let heading = at.unwrap_or_else(|| panic!("{}: no heading {:?}", self.document, self.heading));
        let first = heading + lines[heading..].iter().position(|line| line.starts_with("|---")).expect("a table") + 1;
        let count = lines[first..].iter().take_while(|line| line.starts_with('|')).count();
        let place = |name: &str| {
            lines[first..first + count]
                .iter()
                .position(|line| line.starts_with(&format!("| `{name}` ")))
                .unwrap_or(count)
        };
        let mut rows = self.rows();
        rows.sort_by_key(|(name, _)| place(name));
        lines.splice(first..first + count, rows.into_iter().map(|(_, row)| row));
        lines.join("\n") + "\n"
    }
}

/// Documentation of a field as a part of a sentence.
fn said(field: &Field) -> String {
    let doc = field.doc().split("\n\n").next().unwrap_or_default().replace('\n', " ");
    doc.strip_suffix('.').unwrap_or(&doc).replace('|', "\\|")
}

fn code(value: &Value) -> String {
    format!("`{}`", value.as_str().map_or_else(|| value.to_string(), str::to_owned))
}

/// Values that a field may have, with their unit.
fn values(schema: &Value) -> String {
    let unit = schema["unit"].as_str().map_or(String::new(), |unit| format!(", {unit}"));
    kind(schema, schema) + &unit
}

/// `limits`: the schema that has the range of numbers.
fn kind(schema: &Value, limits: &Value) -> String {
    let choices = ["oneOf", "anyOf"].into_iter().filter_map(|key| schema[key].as_array()).flatten();
    let choices: Vec<&Value> = choices.filter(|choice| choice["type"] != "null").collect();
    let is = |kind: &str| match &schema["type"] {
        Value::Array(kinds) => kinds.iter().any(|own| own == kind),
        own => own == kind,
    };
    let limit = |key: &str| {
        let (own, outer) = (schema[key].as_f64(), limits[key].as_f64());
        let tightest = if key == "maximum" { f64::min } else { f64::max };
        own.map_or(outer, |own| Some(outer.map_or(own, |outer| tightest(own, outer)))).map(number)
    };
    if let Some(link) = schema["see"].as_str() {
        link.to_owned()
    } else if let Some(values) = schema["enum"].as_array() {
        values.iter().map(code).collect::<Vec<_>>().join(", ")
    } else if is("boolean") {
        "`true`, `false`".into()
    } else if is("number") || is("integer") {
        let noun = if is("integer") { "integer" } else { "number" };
        match (limit("minimum"), limit("exclusiveMinimum"), limit("maximum")) {
            (_, Some(above), Some(most)) => format!("{noun} above {above}, at most {most}"),
            (Some(least), _, Some(most)) => format!("{noun} {least}..{most}"),
            (Some(least), _, None) => format!("{noun} ≥ {least}"),
            (_, Some(above), None) => format!("{noun} > {above}"),
            (_, _, Some(most)) => format!("{noun} ≤ {most}"),
            (None, None, None) => noun.into(),
        }
    } else if is("string") {
        "text".into()
    } else if is("array") {
        let item = if schema["items"].is_object() { &schema["items"] } else { &schema["prefixItems"][0] };
        let of = kind(item, schema);
        match (schema["minItems"].as_u64(), schema["maxItems"].as_u64()) {
            (Some(least), Some(most)) if least == most => format!("{least} × {of}"),
            (Some(least), Some(most)) => format!("{least} to {most} × ({of})"),
            _ => format!("list of {of}"),
        }
    } else if let [only] = choices.as_slice() {
        kind(only, only)
    } else {
        let named = |choice: &&Value| {
            let key = choice["properties"].as_object().and_then(|choices| choices.keys().next().cloned());
            key.map_or_else(|| code(&choice["const"]), |name| format!("`{name}(…)`"))
        };
        choices.iter().map(named).collect::<Vec<_>>().join(", ")
    }
}

/// Large and small ones as powers of 10.
fn number(number: f64) -> String {
    let plain = number.to_string();
    let short = format!("{number:e}");
    if plain.len() > 6 && short.len() < plain.len() { short } else { plain }
}

fn default(schema: &Value) -> String {
    match &schema["default"] {
        Value::Null => "none".into(),
        Value::Object(fields) if fields.is_empty() => "`{}`".into(),
        // Its own table has them.
        Value::Object(_) if schema["see"].is_string() && schema["oneOf"].is_null() => "`()`".into(),
        value => format!("`{}`", ron(value, true)),
    }
}

/// A value as scene files have it.
fn ron(value: &Value, is_whole: bool) -> String {
    let all = |values: &Vec<Value>| values.iter().map(|value| ron(value, false)).collect::<Vec<_>>().join(", ");
    match value {
        Value::Null => "None".into(),
        Value::Bool(_) => value.to_string(),
        Value::Number(number) if number.is_f64() => {
            let number = number.as_f64().unwrap_or_default();
            let single = number as f32;
            if f64::from(single) == number { single.to_string() } else { number.to_string() }
        }
        Value::Number(number) => number.to_string(),
        // The name of a choice.
        Value::String(text) if text.is_empty() => "\"\"".into(),
        Value::String(text) => text.clone(),
        Value::Array(values)
            if values.iter().all(|value| value.is_number() || value.is_array()) && !values.is_empty() =>
        {
            format!("({})", all(values))
        }
        Value::Array(values) => format!("[{}]", all(values)),
        Value::Object(fields) => match fields.iter().collect::<Vec<_>>().as_slice() {
            [(name, value)] if is_whole && value.is_object() => format!("{name}{}", ron(value, false)),
            all => {
                let all: Vec<String> =
                    all.iter().map(|(name, value)| format!("{name}: {}", ron(value, false))).collect();
                format!("({})", all.join(", "))
            }
        },
    }
}

#[test]
fn tables_have_what_is_described() {
    for table in tables() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs").join(table.document);
        let text = std::fs::read_to_string(&path).expect("a document");
        let written = table.written(&text);
        if std::env::var_os("RELIEF_WRITE_DOCS").is_some() {
            std::fs::write(&path, written).expect("written");
        } else {
            let differs = text.lines().zip(written.lines()).find(|(found, expected)| found != expected);
            let hint = "RELIEF_WRITE_DOCS=1 writes the table of what is described";
            assert!(text == written, "{}, {}: {differs:?}; {hint}", table.document, table.heading);
        }
    }
}

#[test]
fn what_is_described_has_a_description() {
    for table in tables() {
        let silent = table.fields.iter().find(|field| field.doc().is_empty() && !field.is_part());
        assert!(silent.is_none(), "{}: {silent:?}", table.heading);
    }
}
