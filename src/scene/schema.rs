//! JSON schemas of scene files, for editors and for programs that write scenes.

use super::format::entities::Entity;
use super::format::scene::Scene;
#[cfg(feature = "vehicles")]
use super::format::vehicle_types::VehicleTypes;
use schemars::generate::SchemaSettings;
use schemars::transform::{RecursiveTransform, Transform};
use schemars::{JsonSchema, Schema};
use serde_json::Value;

/// Makes the schema of a kind of file.
pub type SchemaOf = fn() -> Value;

/// Kinds of files that have a schema.
pub const SCHEMAS: &[(&str, SchemaOf)] = &[
    ("scene", schema::<Scene>),
    ("rig", schema::<Vec<Entity>>),
    #[cfg(feature = "vehicles")]
    ("vehicle-type", schema::<VehicleTypes>),
];

/// Schema of a type, without words that are for tables in documents only.
fn schema<T: JsonSchema>() -> Value {
    let mut schema = SchemaSettings::draft2020_12().into_generator().into_root_schema_for::<T>();
    let forget = |schema: &mut Schema| ["see", "expected"].into_iter().for_each(|word| _ = schema.remove(word));
    RecursiveTransform(forget).transform(&mut schema);
    schema.to_value()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::text::parse::parse;
    use std::path::{Path, PathBuf};

    /// Faults of a value by the keywords that the schemas use, with their places.
    fn faults(value: &Value, schema: &Value, root: &Value, place: &str) -> Vec<String> {
        let fault = |message: String| vec![format!("{place}: {message}")];
        let mut found = Vec::new();
        if let Some(name) = schema["$ref"].as_str() {
            let target = root.pointer(name.trim_start_matches('#')).expect("a definition");
            found.extend(faults(value, target, root, place));
        }
        for choices in ["anyOf", "oneOf"].iter().filter_map(|key| schema[*key].as_array()) {
            let all: Vec<_> = choices.iter().map(|choice| faults(value, choice, root, place)).collect();
            if !all.iter().any(Vec::is_empty) {
                found.extend(all.into_iter().min_by_key(Vec::len).unwrap_or_default());
            }
        }
        let kind = match value {
            Value::Null => "null",
            Value::Bool(_) => "boolean",
            Value::Number(number) if number.is_f64() => "number",
            Value::Number(_) => "integer",
            Value::String(_) => "string",
            Value::Array(_) => "array",
            Value::Object(_) => "object",
        };
        let is_kind = |name: &Value| name == kind || name == "number" && kind == "integer";
        match &schema["type"] {
            Value::Null => {}
            Value::Array(names) if names.iter().any(is_kind) => {}
            name if is_kind(name) => {}
            name => return fault(format!("expected {name}, found {value}")),
        }
        if !schema["const"].is_null() && schema["const"] != *value {
            return fault(format!("expected {}, found {value}", schema["const"]));
        }
        if schema["enum"].as_array().is_some_and(|values| !values.contains(value)) {
            return fault(format!("expected one of {}, found {value}", schema["enum"]));
        }
        if let Some(number) = value.as_f64() {
            // A limit as a number of 32 bits is written as one of 64.
            let rounding = 1e-6 * number.abs();
            let least = schema["minimum"].as_f64().or(schema["exclusiveMinimum"].as_f64());
            if least.is_some_and(|least| number < least - rounding)
                || schema["maximum"].as_f64().is_some_and(|most| number > most + rounding)
            {
                return fault(format!("{number} is out of range of {schema}"));
            }
        }
        if let Some(items) = value.as_array() {
            let bound = |key: &str, otherwise| schema[key].as_u64().unwrap_or(otherwise);
            if !(bound("minItems", 0)..=bound("maxItems", u64::MAX)).contains(&(items.len() as u64)) {
                return fault(format!("found {} items", items.len()));
            }
            for (i, item) in items.iter().enumerate() {
                let own = &schema["prefixItems"][i];
                let own = if own.is_null() { &schema["items"] } else { own };
                found.extend(faults(item, own, root, &format!("{place}[{i}]")));
            }
        }
        for (name, field) in value.as_object().into_iter().flatten() {
            let place = format!("{place}.{name}");
            match (&schema["properties"][name], &schema["additionalProperties"]) {
                (Value::Null, Value::Bool(false)) => found.push(format!("{place}: no such field")),
                (Value::Null, other) => found.extend(faults(field, other, root, &place)),
                (own, _) => found.extend(faults(field, own, root, &place)),
            }
        }
        let required = schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str);
        found.extend(required.filter(|name| value.get(name).is_none()).map(|name| format!("{place}: no {name}")));
        found
    }

    /// Files of a folder of the project's own scenes and those below it.
    fn shipped(folder: &Path) -> Vec<PathBuf> {
        let entries = std::fs::read_dir(folder).expect("a folder").flatten().map(|entry| entry.path());
        let below = |path: PathBuf| if path.is_dir() { shipped(&path) } else { vec![path] };
        entries.flat_map(below).filter(|path| path.extension().is_some_and(|ending| ending == "ron")).collect()
    }

    #[test]
    fn what_is_shipped_conforms() {
        let files = shipped(&Path::new(env!("CARGO_MANIFEST_DIR")).join("assets"));
        let mut scenes = 0;
        for path in files {
            let text = std::fs::read_to_string(&path).expect("a text");
            let name = path.to_string_lossy().into_owned();
            let (value, schema) = if name.ends_with("rig.ron") {
                (serde_json::to_value(parse::<Vec<Entity>>(&text).expect(&name)), schema::<Vec<Entity>>())
            } else if name.ends_with("vehicles.ron") {
                #[cfg(not(feature = "vehicles"))]
                continue;
                #[cfg(feature = "vehicles")]
                (serde_json::to_value(parse::<VehicleTypes>(&text).expect(&name)), schema::<VehicleTypes>())
            } else {
                scenes += 1;
                (serde_json::to_value(parse::<Scene>(&text).expect(&name)), schema::<Scene>())
            };
            assert_eq!(faults(&value.expect(&name), &schema, &schema, ""), Vec::<String>::new(), "{name}");
        }
        assert!(scenes >= 10, "{scenes} scenes");
    }

    #[test]
    fn what_is_wrong_does_not_conform() {
        let schema = schema::<Scene>();
        for (scene, expected) in [
            (r#"{"sede": 1}"#, ".sede: no such field"),
            (r#"{"seed": "1"}"#, r#".seed: expected "integer", found "1""#),
            (r#"{"clock": {"speed": -1}}"#, ".clock.speed: -1 is out of range"),
            (r#"{"entities": [{"children": [{"transform": {"look_at": [0, 1]}}]}]}"#, "look_at: found 2 items"),
            (r#"{"entities": [{"sensor": {"imu": {"every": 0}}}]}"#, ".sensor.imu.every: 0 is out of range"),
            (r#"{"generators": [{"place": {"scatter": {"count": 1}}}]}"#, ".place.scatter: no region"),
            (r#"{"materials": {"m": {"technique": "nromal"}}}"#, ".materials.m.technique: expected"),
        ] {
            let found = faults(&serde_json::from_str(scene).expect(scene), &schema, &schema, "").join("\n");
            assert!(found.contains(expected), "{scene}: {found}");
        }
    }

    /// Fields without a word of documentation, here and below.
    fn silent(schema: &Value, place: &str, found: &mut Vec<String>) {
        if !schema.is_object() {
            return;
        }
        for (name, field) in schema["properties"].as_object().into_iter().flatten() {
            let place = format!("{place}.{name}");
            // A choice says what it is beside its only field.
            let is_said = field["description"].is_string() || schema["description"].is_string() && is_choice(schema);
            if !is_said && name != "srgb" && name != "kelvin" {
                found.push(place.clone());
            }
            silent(field, &place, found);
        }
        for choice in ["anyOf", "oneOf"].iter().filter_map(|key| schema[*key].as_array()).flatten() {
            silent(choice, place, found);
        }
        for key in ["items", "additionalProperties"] {
            silent(&schema[key], place, found);
        }
        schema["$defs"].as_object().into_iter().flatten().for_each(|(name, schema)| silent(schema, name, found));
    }

    fn is_choice(schema: &Value) -> bool {
        schema["required"].as_array().is_some_and(|names| names.len() == 1)
            && schema["properties"].as_object().is_some_and(|fields| fields.len() == 1)
    }

    #[test]
    fn every_field_is_described() {
        for (name, schema) in SCHEMAS {
            let mut found = Vec::new();
            silent(&schema(), name, &mut found);
            assert_eq!(found, Vec::<String>::new());
        }
    }
}
