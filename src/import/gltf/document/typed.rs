//! From JSON that has passed [`super::shape`] to the types of the gltf crate.
//!
//! Deserialising them is stricter than glTF in a few places: it wants a list of nodes in every scene, whole numbers
//! without a point, objects as `extras`, and no `extensions` in lights. So it is given what the tables of
//! [`super::schema`] know, spelt as it likes. What a closed list does not know becomes `Checked::Invalid`, on which the
//! crate's own accessors panic: readers match on such properties in [`gltf::json`].

use super::schema::{Kind, ROOT, Schema};
use super::shape::{is_attribute, whole};
use crate::import::gltf::report::{Fault, Read};
use serde_json::{Map, Value};

/// The document without animations, `extras` and whatever else is not read.
pub fn document(mut root: Value) -> Read<gltf::Document> {
    if let Some(members) = root.as_object_mut() {
        // Never read, and their faults are forgiven.
        members.remove("animations");
    }
    // As text once more: the crate brings its own reader of text, while one of values would be compiled here a second
    // time, for all of glTF's types.
    let root = gltf::json::Root::from_str(&object(root, &ROOT).to_string());
    root.map(gltf::Document::from_json_without_validation).map_err(|error| {
        let message = error.to_string();
        let message = message.rsplit_once(" at line ").map_or(message.as_str(), |(message, _)| message);
        Fault::invalid("document", message)
    })
}

fn object(value: Value, schema: &Schema) -> Value {
    let Value::Object(mut members) = value else { return value };
    let mut known = Map::new();
    for field in schema.fields {
        match (members.remove(field.name), field.kind) {
            (Some(value), kind) => _ = known.insert(field.name.into(), typed(value, kind)),
            (None, Kind::Ids(_)) => _ = known.insert(field.name.into(), Value::Array(Vec::new())),
            (None, _) => {}
        }
    }
    if let Some(Value::Object(mut extensions)) = members.remove("extensions") {
        let read = schema.extensions.iter();
        let read = read.filter_map(|(name, schema)| Some(((*name).into(), object(extensions.remove(*name)?, schema))));
        known.insert("extensions".into(), Value::Object(read.collect()));
    }
    Value::Object(known)
}

fn typed(value: Value, kind: Kind) -> Value {
    match kind {
        Kind::Whole(..) | Kind::Id(_) => whole(&value).map_or(value, Value::from),
        // Beyond 32 bits the crate would read the low ones.
        Kind::WholeOf(_) => whole(&value).map_or(value, |n| n.min(u64::from(u32::MAX)).into()),
        Kind::Ids(array) => each(value, |value| typed(value, Kind::Id(array))),
        Kind::IdMap(_) => ids(value, |_| true),
        Kind::Attributes => ids(value, is_attribute),
        Kind::IdMaps(_) => each(value, |value| ids(value, |_| true)),
        Kind::Object(schema) => object(value, schema),
        Kind::Objects(schema) => each(value, |value| object(value, schema)),
        Kind::Bool | Kind::Text | Kind::Texts | Kind::TextOf(_) => value,
        Kind::Real(..) | Kind::Above(_) | Kind::Reals(..) => value,
    }
}

fn each(value: Value, change: impl Fn(Value) -> Value) -> Value {
    match value {
        Value::Array(values) => values.into_iter().map(change).collect(),
        value => value,
    }
}

fn ids(value: Value, keep: fn(&str) -> bool) -> Value {
    match value {
        Value::Object(members) => {
            let kept = members.into_iter().filter(|(name, _)| keep(name));
            kept.map(|(name, id)| (name, typed(id, Kind::Id("accessors")))).collect()
        }
        value => value,
    }
}
