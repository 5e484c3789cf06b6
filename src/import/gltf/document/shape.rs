//! Walks a document along the tables of [`super::schema`] and reports everything that does not fit, so that the readers
//! beside this module may take a property's type, range and target for granted and only handle its absence.
//!
//! Faults in parts that a file can do without do not refuse it: an extension that it does not require, a camera, a name
//! is left out ([`leave_out`]), with a warning.

use super::schema::{Field, Kind, MAX, ROOT, SUPPORTED, Schema};
use crate::import::gltf::report::Report;
use serde_json::{Map, Value, json};
use std::collections::BTreeSet;

/// Reports everything in the document that does not fit the tables. Returns the places of what is to be left out.
pub fn check(root: &Value, report: &mut Report) -> Vec<String> {
    let names = |list: &str| root[list].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    let (used, required) = (names("extensionsUsed"), names("extensionsRequired"));
    let (ignored, unfit) = (BTreeSet::new(), Vec::new());
    let mut check = Check { root, report, lenient: false, used, required, ignored, faults: 0, unfit };
    check.object(root, &ROOT, "");
    let (ignored, unfit) = (std::mem::take(&mut check.ignored), std::mem::take(&mut check.unfit));
    check.declarations(&ignored);
    for name in ignored {
        report.warn("extensionsUsed", format!("ignored: {name}"));
    }
    unfit
}

/// Takes out of the document what [`check`] has named.
pub fn leave_out(root: &mut Value, unfit: &[String]) {
    for place in unfit {
        // From `nodes[0].name` to a JSON pointer; no name of ours has a dot or bracket.
        let pointer = format!("/{}", place.replace('[', ".").replace(']', "").replace('.', "/"));
        let Some((parent, name)) = pointer.rsplit_once('/') else { continue };
        match root.pointer_mut(parent) {
            Some(Value::Object(members)) => _ = members.remove(name),
            // Others are counted by their place: an item is only emptied.
            Some(Value::Array(items)) => {
                if let Some(item) = name.parse().ok().and_then(|id: usize| items.get_mut(id)) {
                    *item = Value::Null;
                }
            }
            _ => {}
        }
    }
    if unfit.iter().any(|place| place.starts_with("cameras[")) {
        without_cameras(root);
    }
    if unfit.iter().any(|place| place.starts_with("extensions.KHR_lights_punctual")) {
        without_lights(root);
    }
}

/// Takes lights that are gone or have been emptied from their nodes; a stand-in keeps the others' numbers.
fn without_lights(root: &mut Value) {
    let lights = root["extensions"]["KHR_lights_punctual"]["lights"].as_array().cloned().unwrap_or_default();
    let is_left = |id: &Value| whole(id).and_then(|id| lights.get(id as usize)).is_some_and(|light| !light.is_null());
    let nodes = root.get_mut("nodes").and_then(Value::as_array_mut);
    for node in nodes.into_iter().flatten() {
        let extensions = node.get_mut("extensions").and_then(Value::as_object_mut);
        let Some(extensions) = extensions else { continue };
        if extensions.get("KHR_lights_punctual").is_some_and(|extension| !is_left(&extension["light"])) {
            extensions.remove("KHR_lights_punctual");
        }
    }
    let lights = root.pointer_mut("/extensions/KHR_lights_punctual/lights").and_then(Value::as_array_mut);
    for light in lights.into_iter().flatten().filter(|light| light.is_null()) {
        *light = json!({ "type": "point" });
    }
}

/// Takes cameras that have been emptied from their nodes; a stand-in keeps the others' numbers.
fn without_cameras(root: &mut Value) {
    let cameras = root["cameras"].as_array().cloned().unwrap_or_default();
    let is_empty = |id: &Value| whole(id).and_then(|id| cameras.get(id as usize)).is_some_and(Value::is_null);
    let nodes = root.get_mut("nodes").and_then(Value::as_array_mut);
    for node in nodes.into_iter().flatten().filter_map(Value::as_object_mut) {
        if node.get("camera").is_some_and(is_empty) {
            node.remove("camera");
        }
    }
    for camera in root["cameras"].as_array_mut().into_iter().flatten().filter(|camera| camera.is_null()) {
        *camera = json!({ "type": "perspective", "perspective": { "yfov": 1.0, "znear": 0.1 } });
    }
}

/// A JSON number without a fraction, however it is written.
pub fn whole(value: &Value) -> Option<u64> {
    value.as_u64().or_else(|| value.as_f64().filter(|f| f.fract() == 0.0 && (0.0..=9e15).contains(f)).map(|f| f as u64))
}

/// Tells if glTF 2.0 has the vertex attribute.
pub fn is_attribute(name: &str) -> bool {
    let (semantic, set) = name.split_once('_').unwrap_or((name, ""));
    match semantic {
        "POSITION" | "NORMAL" | "TANGENT" => name == semantic,
        "TEXCOORD" | "COLOR" | "JOINTS" | "WEIGHTS" => set.parse::<u32>().is_ok_and(|s| s.to_string() == set),
        _ => false,
    }
}

/// The list of lights, of which each is left out by itself.
const LIGHTS: &str = "extensions.KHR_lights_punctual.lights";

/// Properties that nothing else depends on.
const FORGIVEN: [&str; 5] = ["name", "copyright", "generator", "min", "max"];

struct Check<'a> {
    root: &'a Value,
    report: &'a mut Report,
    /// Within what we do not read: faults do not refuse the file.
    lenient: bool,
    /// Extensions that the file declares.
    used: BTreeSet<&'a str>,
    /// Extensions that the file cannot be read without.
    required: BTreeSet<&'a str>,
    /// Extensions met that we do not read.
    ignored: BTreeSet<String>,
    /// Faults so far of what is not left out.
    faults: usize,
    /// Places of what is left out.
    unfit: Vec<String>,
}

impl Check<'_> {
    fn fault(&mut self, place: &str, message: impl Into<String>) {
        self.faults += 1;
        if self.lenient {
            self.report.warn(place, message);
        } else {
            self.report.invalid(place, message);
        }
    }

    fn object(&mut self, value: &Value, schema: &Schema, place: &str) {
        let Some(object) = value.as_object() else { return self.fault(or_document(place), "expected an object") };
        for field in schema.fields {
            let place = join(place, field.name);
            match object.get(field.name) {
                Some(value) => self.field(value, field, &place),
                None if field.required => self.fault(&place, "missing required property"),
                None => {}
            }
        }
        for name in object.keys().filter(|n| !schema.fields.iter().any(|f| f.name == **n)) {
            match name.as_str() {
                "extras" => {}
                "extensions" => self.extensions(&object[name], schema, &join(place, name)),
                _ => self.report.warn(join(place, name), "ignored: no such property in glTF 2.0"),
            }
        }
    }

    fn field(&mut self, value: &Value, field: &Field, place: &str) {
        if place == "animations" {
            let outer = std::mem::replace(&mut self.lenient, true);
            self.value(value, field.kind, place);
            self.lenient = outer;
        } else if FORGIVEN.contains(&field.name) {
            self.forgive(place, |check| check.value(value, field.kind, place));
        } else {
            self.value(value, field.kind, place);
        }
    }

    /// Checks something that is left out, with a warning, where there is a fault in it. What it is part of is none the
    /// worse for that.
    fn forgive(&mut self, place: &str, check: impl FnOnce(&mut Self)) {
        let (outer, before) = (std::mem::replace(&mut self.lenient, true), self.faults);
        check(self);
        self.lenient = outer;
        if self.faults > before {
            self.report.warn(place, "ignored for this reason");
            self.unfit.push(place.to_owned());
            self.faults = before;
        }
    }

    fn value(&mut self, value: &Value, kind: Kind, place: &str) {
        match kind {
            Kind::Bool => self.expect(value.is_boolean(), place, "expected true or false"),
            Kind::Text => self.expect(value.is_string(), place, "expected a string"),
            Kind::Texts => self.each(value, Kind::Text, place),
            Kind::Whole(min, max) => match whole(value) {
                Some(n) => {
                    self.expect((min..=max).contains(&n), place, format_args!("expected {min} to {max}, found {n}"))
                }
                None => self.fault(place, format!("expected a whole number of at least {min}")),
            },
            Kind::Real(min, max) => self.real(value, place, |n| n >= min && n <= max, || in_words(min, max)),
            Kind::Above(min) => self.real(value, place, |n| n > min && n <= MAX, || format!("a number above {min}")),
            Kind::Reals(count, min, max) => {
                let length = value.as_array().map_or(0, Vec::len);
                if count > 0 && value.is_array() && length != count {
                    return self.fault(place, format!("expected {count} numbers, found {length}"));
                }
                self.each(value, Kind::Real(min, max), place);
            }
            Kind::TextOf(list) => match value.as_str() {
                Some(text) if !list.contains(&text) => {
                    self.report.warn(place, format!("unknown: {text:?}; known are {}", list.join(", ")))
                }
                text => self.expect(text.is_some(), place, "expected a string"),
            },
            Kind::WholeOf(list) => match whole(value) {
                Some(n) if !list.contains(&n) => self.report.warn(place, format!("unknown: {n}; known are {list:?}")),
                n => self.expect(n.is_some(), place, "expected a whole number"),
            },
            Kind::Id(array) => self.reference(value, array, place),
            Kind::Ids(array) => self.each(value, Kind::Id(array), place),
            Kind::IdMap(array) => match value.as_object() {
                Some(map) => self.id_map(map, array, place),
                None => self.fault(place, "expected an object"),
            },
            Kind::Attributes => {
                self.value(value, Kind::IdMap("accessors"), place);
                value.as_object().into_iter().flatten().for_each(|(name, id)| self.attribute(name, id, place));
            }
            Kind::IdMaps(array) => self.each(value, Kind::IdMap(array), place),
            Kind::Object(schema) => self.object(value, schema, place),
            Kind::Objects(schema) => self.each(value, Kind::Object(schema), place),
        }
    }

    fn expect(&mut self, holds: bool, place: &str, message: impl std::fmt::Display) {
        if !holds {
            self.fault(place, message.to_string());
        }
    }

    fn real(&mut self, value: &Value, place: &str, fits: impl Fn(f64) -> bool, expected: impl Fn() -> String) {
        match value.as_f64() {
            Some(n) => self.expect(fits(n), place, format_args!("expected {}, found {n}", expected())),
            None => self.fault(place, "expected a number"),
        }
    }

    fn each(&mut self, value: &Value, kind: Kind, place: &str) {
        let Some(array) = value.as_array() else { return self.fault(place, "expected an array") };
        if array.is_empty() {
            self.report.warn(place, "empty, which glTF does not allow: treated as absent");
        }
        for (i, value) in array.iter().enumerate() {
            let item = format!("{place}[{i}]");
            if place == "cameras" || place == LIGHTS && !self.required.contains("KHR_lights_punctual") {
                self.forgive(&item, |check| check.value(value, kind, &item));
            } else {
                self.value(value, kind, &item);
            }
        }
    }

    fn id_map(&mut self, map: &Map<String, Value>, array: &'static str, place: &str) {
        if map.is_empty() {
            self.report.warn(place, "empty, which glTF does not allow");
        }
        for (name, value) in map {
            self.reference(value, array, &join(place, name));
        }
    }

    /// Checks names that are only known here: the gltf crate drops names that it does not know, also those that glTF
    /// allows.
    fn attribute(&mut self, name: &str, id: &Value, place: &str) {
        if !name.starts_with('_') && !is_attribute(name) {
            self.report.warn(join(place, name), "ignored: no such attribute in glTF 2.0");
        }
        let accessor = whole(id).and_then(|id| self.root["accessors"].get(usize::try_from(id).ok()?));
        if accessor.is_some_and(|accessor| whole(&accessor["componentType"]) == Some(5125)) {
            self.report.warn(join(place, name), "glTF does not allow 32-bit integers in attributes");
        }
    }

    fn reference(&mut self, value: &Value, array: &'static str, place: &str) {
        let target = match array {
            "lights" => &self.root["extensions"]["KHR_lights_punctual"]["lights"],
            array => &self.root[array],
        };
        let length = target.as_array().map_or(0, Vec::len) as u64;
        match whole(value) {
            // Nothing to choose from: the file is empty rather than wrong.
            Some(_) if array == "scenes" && length == 0 => self.report.warn(place, "there are no scenes"),
            Some(id) => self.expect(
                id < length,
                place,
                format_args!("{array}[{id}] does not exist, there are {length} {array}"),
            ),
            None => self.fault(place, format!("expected an index into {array}")),
        }
    }

    fn extensions(&mut self, value: &Value, schema: &Schema, place: &str) {
        let Some(extensions) = value.as_object() else { return self.fault(place, "expected an object") };
        for (name, extension) in extensions {
            let place = join(place, name);
            if !self.used.contains(name.as_str()) {
                self.report.warn(&*place, "not declared in extensionsUsed");
            }
            if let Some((_, schema)) = schema.extensions.iter().find(|(n, _)| n == name) {
                if self.required.contains(name.as_str()) {
                    self.object(extension, schema, &place);
                } else {
                    self.forgive(&place, |check| check.object(extension, schema, &place));
                }
            } else if SUPPORTED.contains(&name.as_str()) {
                self.report.warn(place, "ignored: this extension has no meaning here");
            } else {
                if !extension.is_object() {
                    self.report.warn(place, "expected an object");
                }
                self.ignored.insert(name.clone());
            }
        }
    }

    /// The lists of extensions against each other and against what we have.
    fn declarations(&mut self, ignored: &BTreeSet<String>) {
        for list in ["extensionsUsed", "extensionsRequired"] {
            let names = self.root[list].as_array().into_iter().flatten().filter_map(Value::as_str);
            let mut seen = BTreeSet::new();
            for (i, name) in names.enumerate() {
                let place = format!("{list}[{i}]");
                let supported = SUPPORTED.contains(&name);
                if !seen.insert(name) {
                    self.report.warn(&*place, format!("{name} is listed twice"));
                }
                if list == "extensionsUsed" {
                    if !supported && !ignored.contains(name) {
                        self.report.warn(place, format!("ignored: {name}"));
                    }
                } else if !supported {
                    self.report.unsupported(place, format!("this file requires {name}, which is not supported"));
                } else if !self.used.contains(name) {
                    self.report.warn(place, format!("{name} is not listed in extensionsUsed"));
                }
            }
        }
    }
}

fn join(place: &str, name: &str) -> String {
    if place.is_empty() { name.to_owned() } else { format!("{place}.{name}") }
}

fn or_document(place: &str) -> &str {
    if place.is_empty() { "document" } else { place }
}

fn in_words(min: f64, max: f64) -> String {
    match (min <= -MAX, max >= MAX) {
        (true, true) => "a finite 32-bit number".into(),
        (false, true) => format!("a number of at least {min}"),
        _ => format!("a number from {min} to {max}"),
    }
}
