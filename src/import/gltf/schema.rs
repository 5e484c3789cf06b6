//! The shape of a glTF 2.0 document: every object's properties with their types, ranges and references, as tables.
//!
//! [`check`] walks a document along the tables and reports everything that does not fit, so that the readers beside
//! this module may take a property's type, range and target for granted and only handle its absence. Written from the
//! JSON schema of the glTF 2.0 specification and of the extensions named here.

use super::report::Report;
use serde_json::{Map, Value};
use std::collections::BTreeSet;

/// What a property holds.
#[derive(Clone, Copy)]
enum Kind {
    Any,
    Bool,
    Text,
    Texts,
    /// An integer within.
    Whole(u64, u64),
    /// A number within.
    Real(f64, f64),
    /// A number greater than.
    Above(f64),
    /// So many numbers (0: any count), each within.
    Reals(usize, f64, f64),
    /// Others than these are reported, and read as the default: a later version may add some.
    TextOf(&'static [&'static str]),
    WholeOf(&'static [u64]),
    /// An index into the root array of that name.
    Id(&'static str),
    Ids(&'static str),
    /// Names to indices.
    IdMap(&'static str),
    IdMaps(&'static str),
    Object(&'static Schema),
    Objects(&'static Schema),
}

struct Field {
    name: &'static str,
    kind: Kind,
    required: bool,
}

/// The properties of one kind of object, and the extensions that we read there.
struct Schema {
    fields: &'static [Field],
    extensions: &'static [(&'static str, &'static Schema)],
}

const fn may(name: &'static str, kind: Kind) -> Field {
    Field { name, kind, required: false }
}

const fn must(name: &'static str, kind: Kind) -> Field {
    Field { name, kind, required: true }
}

const fn plain(fields: &'static [Field]) -> Schema {
    Schema { fields, extensions: &[] }
}

const MAX: f64 = f32::MAX as f64;
const BYTES: Kind = Kind::Whole(0, 1 << 53);
const UNIT: Kind = Kind::Real(0.0, 1.0);
const NAME: Field = may("name", Kind::Text);
const INFO: Kind = Kind::Object(&TEXTURE_INFO);

/// Extensions that a file may require of us.
pub const SUPPORTED: [&str; 10] = [
    "EXT_mesh_gpu_instancing",
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_specular",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "MSFT_texture_dds",
];

static ROOT: Schema = Schema {
    fields: &[
        must("asset", Kind::Object(&ASSET)),
        may("accessors", Kind::Objects(&ACCESSOR)),
        may("animations", Kind::Objects(&ANIMATION)),
        may("buffers", Kind::Objects(&BUFFER)),
        may("bufferViews", Kind::Objects(&BUFFER_VIEW)),
        may("cameras", Kind::Objects(&CAMERA)),
        may("extensionsRequired", Kind::Texts),
        may("extensionsUsed", Kind::Texts),
        may("images", Kind::Objects(&IMAGE)),
        may("materials", Kind::Objects(&MATERIAL)),
        may("meshes", Kind::Objects(&MESH)),
        may("nodes", Kind::Objects(&NODE)),
        may("samplers", Kind::Objects(&SAMPLER)),
        may("scene", Kind::Id("scenes")),
        may("scenes", Kind::Objects(&SCENE)),
        may("skins", Kind::Objects(&SKIN)),
        may("textures", Kind::Objects(&TEXTURE)),
    ],
    extensions: &[("KHR_lights_punctual", &LIGHTS)],
};

static ASSET: Schema = plain(&[
    must("version", Kind::Text),
    may("minVersion", Kind::Text),
    may("copyright", Kind::Text),
    may("generator", Kind::Text),
]);

static ACCESSOR: Schema = plain(&[
    NAME,
    may("bufferView", Kind::Id("bufferViews")),
    may("byteOffset", BYTES),
    must("componentType", Kind::WholeOf(&[5120, 5121, 5122, 5123, 5125, 5126])),
    must("count", Kind::Whole(1, 1 << 53)),
    may("max", Kind::Reals(0, f64::MIN, f64::MAX)),
    may("min", Kind::Reals(0, f64::MIN, f64::MAX)),
    may("normalized", Kind::Bool),
    may("sparse", Kind::Object(&SPARSE)),
    must("type", Kind::TextOf(&["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"])),
]);

static SPARSE: Schema = plain(&[
    must("count", Kind::Whole(1, 1 << 53)),
    must("indices", Kind::Object(&SPARSE_INDICES)),
    must("values", Kind::Object(&SPARSE_VALUES)),
]);

static SPARSE_INDICES: Schema = plain(&[
    must("bufferView", Kind::Id("bufferViews")),
    may("byteOffset", BYTES),
    must("componentType", Kind::WholeOf(&[5121, 5123, 5125])),
]);

static SPARSE_VALUES: Schema = plain(&[must("bufferView", Kind::Id("bufferViews")), may("byteOffset", BYTES)]);

static ANIMATION: Schema = plain(&[
    NAME,
    must("channels", Kind::Objects(&CHANNEL)),
    must("samplers", Kind::Objects(&ANIMATION_SAMPLER)),
]);

static CHANNEL: Schema = plain(&[must("sampler", BYTES), must("target", Kind::Object(&TARGET))]);

static TARGET: Schema = plain(&[
    may("node", Kind::Id("nodes")),
    must("path", Kind::TextOf(&["translation", "rotation", "scale", "weights", "pointer"])),
]);

static ANIMATION_SAMPLER: Schema = plain(&[
    must("input", Kind::Id("accessors")),
    must("output", Kind::Id("accessors")),
    may("interpolation", Kind::TextOf(&["LINEAR", "STEP", "CUBICSPLINE"])),
]);

static BUFFER: Schema = plain(&[NAME, may("uri", Kind::Text), must("byteLength", Kind::Whole(1, 1 << 53))]);

static BUFFER_VIEW: Schema = plain(&[
    NAME,
    must("buffer", Kind::Id("buffers")),
    may("byteOffset", BYTES),
    must("byteLength", Kind::Whole(1, 1 << 53)),
    may("byteStride", Kind::Whole(4, 252)),
    may("target", Kind::WholeOf(&[34962, 34963])),
]);

static CAMERA: Schema = plain(&[
    NAME,
    may("orthographic", Kind::Object(&ORTHOGRAPHIC)),
    may("perspective", Kind::Object(&PERSPECTIVE)),
    must("type", Kind::TextOf(&["perspective", "orthographic"])),
]);

static ORTHOGRAPHIC: Schema = plain(&[
    must("xmag", Kind::Real(-MAX, MAX)),
    must("ymag", Kind::Real(-MAX, MAX)),
    must("zfar", Kind::Above(0.0)),
    must("znear", Kind::Real(0.0, MAX)),
]);

static PERSPECTIVE: Schema = plain(&[
    may("aspectRatio", Kind::Above(0.0)),
    must("yfov", Kind::Above(0.0)),
    may("zfar", Kind::Above(0.0)),
    must("znear", Kind::Above(0.0)),
]);

static IMAGE: Schema = plain(&[
    NAME,
    may("uri", Kind::Text),
    may("mimeType", Kind::TextOf(&["image/jpeg", "image/png", "image/webp", "image/vnd-ms.dds"])),
    may("bufferView", Kind::Id("bufferViews")),
]);

static MATERIAL: Schema = Schema {
    fields: &[
        NAME,
        may("pbrMetallicRoughness", Kind::Object(&METALLIC_ROUGHNESS)),
        may("normalTexture", Kind::Object(&NORMAL_INFO)),
        may("occlusionTexture", Kind::Object(&OCCLUSION_INFO)),
        may("emissiveTexture", INFO),
        may("emissiveFactor", Kind::Reals(3, 0.0, 1.0)),
        may("alphaMode", Kind::TextOf(&["OPAQUE", "MASK", "BLEND"])),
        may("alphaCutoff", Kind::Real(0.0, MAX)),
        may("doubleSided", Kind::Bool),
    ],
    extensions: &[
        ("KHR_materials_emissive_strength", &EMISSIVE_STRENGTH),
        ("KHR_materials_pbrSpecularGlossiness", &SPECULAR_GLOSSINESS),
        ("KHR_materials_specular", &SPECULAR),
        ("KHR_materials_unlit", &UNLIT),
    ],
};

static METALLIC_ROUGHNESS: Schema = plain(&[
    may("baseColorFactor", Kind::Reals(4, 0.0, 1.0)),
    may("baseColorTexture", INFO),
    may("metallicFactor", UNIT),
    may("roughnessFactor", UNIT),
    may("metallicRoughnessTexture", INFO),
]);

static EMISSIVE_STRENGTH: Schema = plain(&[may("emissiveStrength", Kind::Real(0.0, MAX))]);

static SPECULAR_GLOSSINESS: Schema = plain(&[
    may("diffuseFactor", Kind::Reals(4, 0.0, 1.0)),
    may("diffuseTexture", INFO),
    may("specularFactor", Kind::Reals(3, 0.0, 1.0)),
    may("glossinessFactor", UNIT),
    may("specularGlossinessTexture", INFO),
]);

static SPECULAR: Schema = plain(&[
    may("specularFactor", UNIT),
    may("specularTexture", INFO),
    may("specularColorFactor", Kind::Reals(3, 0.0, MAX)),
    may("specularColorTexture", INFO),
]);

static UNLIT: Schema = plain(&[]);

const INFO_EXTENSIONS: &[(&str, &Schema)] = &[("KHR_texture_transform", &TEXTURE_TRANSFORM)];
const INDEX: Field = must("index", Kind::Id("textures"));
const TEX_COORD: Field = may("texCoord", Kind::Whole(0, u32::MAX as u64));

static TEXTURE_INFO: Schema = Schema { fields: &[INDEX, TEX_COORD], extensions: INFO_EXTENSIONS };

static NORMAL_INFO: Schema =
    Schema { fields: &[INDEX, TEX_COORD, may("scale", Kind::Real(-MAX, MAX))], extensions: INFO_EXTENSIONS };

static OCCLUSION_INFO: Schema =
    Schema { fields: &[INDEX, TEX_COORD, may("strength", UNIT)], extensions: INFO_EXTENSIONS };

static TEXTURE_TRANSFORM: Schema = plain(&[
    may("offset", Kind::Reals(2, -MAX, MAX)),
    may("rotation", Kind::Real(-MAX, MAX)),
    may("scale", Kind::Reals(2, -MAX, MAX)),
    TEX_COORD,
]);

static MESH: Schema =
    plain(&[NAME, must("primitives", Kind::Objects(&PRIMITIVE)), may("weights", Kind::Reals(0, -MAX, MAX))]);

static PRIMITIVE: Schema = plain(&[
    must("attributes", Kind::IdMap("accessors")),
    may("indices", Kind::Id("accessors")),
    may("material", Kind::Id("materials")),
    may("mode", Kind::WholeOf(&[0, 1, 2, 3, 4, 5, 6])),
    may("targets", Kind::IdMaps("accessors")),
]);

static NODE: Schema = Schema {
    fields: &[
        NAME,
        may("camera", Kind::Id("cameras")),
        may("children", Kind::Ids("nodes")),
        may("skin", Kind::Id("skins")),
        may("matrix", Kind::Reals(16, -MAX, MAX)),
        may("mesh", Kind::Id("meshes")),
        may("rotation", Kind::Reals(4, -1.0, 1.0)),
        may("scale", Kind::Reals(3, -MAX, MAX)),
        may("translation", Kind::Reals(3, -MAX, MAX)),
        may("weights", Kind::Reals(0, -MAX, MAX)),
    ],
    extensions: &[("KHR_lights_punctual", &NODE_LIGHT), ("EXT_mesh_gpu_instancing", &INSTANCING)],
};

static INSTANCING: Schema = plain(&[must("attributes", Kind::IdMap("accessors"))]);

static NODE_LIGHT: Schema = plain(&[must("light", Kind::Id("lights"))]);

static LIGHTS: Schema = plain(&[must("lights", Kind::Objects(&LIGHT))]);

static LIGHT: Schema = plain(&[
    NAME,
    may("color", Kind::Reals(3, 0.0, MAX)),
    may("intensity", Kind::Real(0.0, MAX)),
    must("type", Kind::TextOf(&["directional", "point", "spot"])),
    may("range", Kind::Above(0.0)),
    may("spot", Kind::Object(&SPOT)),
]);

static SPOT: Schema = plain(&[
    may("innerConeAngle", Kind::Real(0.0, std::f64::consts::FRAC_PI_2)),
    may("outerConeAngle", Kind::Real(0.0, std::f64::consts::FRAC_PI_2 + 1e-6)),
]);

static SAMPLER: Schema = plain(&[
    NAME,
    may("magFilter", Kind::WholeOf(&[9728, 9729])),
    may("minFilter", Kind::WholeOf(&[9728, 9729, 9984, 9985, 9986, 9987])),
    may("wrapS", Kind::WholeOf(&[33071, 33648, 10497])),
    may("wrapT", Kind::WholeOf(&[33071, 33648, 10497])),
]);

static SCENE: Schema = plain(&[NAME, may("nodes", Kind::Ids("nodes"))]);

static SKIN: Schema = plain(&[
    NAME,
    may("inverseBindMatrices", Kind::Id("accessors")),
    may("skeleton", Kind::Id("nodes")),
    must("joints", Kind::Ids("nodes")),
]);

static TEXTURE: Schema = Schema {
    fields: &[NAME, may("sampler", Kind::Id("samplers")), may("source", Kind::Id("images"))],
    extensions: &[("EXT_texture_webp", &TEXTURE_SOURCE), ("MSFT_texture_dds", &TEXTURE_SOURCE)],
};

static TEXTURE_SOURCE: Schema = plain(&[may("source", Kind::Id("images"))]);

/// Reports everything in the document that does not fit the tables.
pub fn check(root: &Value, report: &mut Report) {
    let mut check = Check { root, report, lenient: false, ignored: BTreeSet::new() };
    check.object(root, &ROOT, "");
    let ignored = std::mem::take(&mut check.ignored);
    check.declarations(&ignored);
    for name in ignored {
        report.warn("extensionsUsed", format!("ignored: {name}"));
    }
}

/// A JSON number without a fraction, however it is written.
pub fn whole(value: &Value) -> Option<u64> {
    value.as_u64().or_else(|| value.as_f64().filter(|f| f.fract() == 0.0 && (0.0..=9e15).contains(f)).map(|f| f as u64))
}

struct Check<'a> {
    root: &'a Value,
    report: &'a mut Report,
    /// Within what we do not read: faults do not refuse the file.
    lenient: bool,
    /// Extensions met that we do not read.
    ignored: BTreeSet<String>,
}

impl Check<'_> {
    fn fault(&mut self, place: &str, message: impl Into<String>) {
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
                None if field.required => self.fault(&place, "required, and missing"),
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
        let outer = self.lenient;
        self.lenient |= place == "animations";
        self.value(value, field.kind, place);
        self.lenient = outer;
    }

    fn value(&mut self, value: &Value, kind: Kind, place: &str) {
        match kind {
            Kind::Any => {}
            Kind::Bool => self.expect(value.is_boolean(), place, "expected true or false"),
            Kind::Text => self.expect(value.is_string(), place, "expected a string"),
            Kind::Texts => self.each(value, Kind::Text, place),
            Kind::Whole(min, max) => match whole(value) {
                Some(n) => self.expect((min..=max).contains(&n), place, format_args!("expected {min} to {max}, is {n}")),
                None => self.fault(place, format!("expected a whole number of at least {min}")),
            },
            Kind::Real(min, max) => self.real(value, place, |n| n >= min && n <= max, || in_words(min, max)),
            Kind::Above(min) => self.real(value, place, |n| n > min && n <= MAX, || format!("a number above {min}")),
            Kind::Reals(count, min, max) => {
                let length = value.as_array().map_or(0, Vec::len);
                if count > 0 && value.is_array() && length != count {
                    return self.fault(place, format!("expected {count} numbers, has {length}"));
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
            Some(n) => self.expect(fits(n), place, format_args!("expected {}, is {n}", expected())),
            None => self.fault(place, "expected a number"),
        }
    }

    fn each(&mut self, value: &Value, kind: Kind, place: &str) {
        let Some(array) = value.as_array() else { return self.fault(place, "expected an array") };
        if array.is_empty() {
            self.report.warn(place, "empty, which glTF does not allow: treated as absent");
        }
        for (i, value) in array.iter().enumerate() {
            self.value(value, kind, &format!("{place}[{i}]"));
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

    fn reference(&mut self, value: &Value, array: &'static str, place: &str) {
        let target = match array {
            "lights" => &self.root["extensions"]["KHR_lights_punctual"]["lights"],
            array => &self.root[array],
        };
        let length = target.as_array().map_or(0, Vec::len) as u64;
        match whole(value) {
            Some(id) => {
                self.expect(id < length, place, format_args!("{array}[{id}] does not exist, there are {length} {array}"))
            }
            None => self.fault(place, format!("expected an index into {array}")),
        }
    }

    fn extensions(&mut self, value: &Value, schema: &Schema, place: &str) {
        let Some(extensions) = value.as_object() else { return self.fault(place, "expected an object") };
        for (name, extension) in extensions {
            let place = join(place, name);
            if !declared(self.root, "extensionsUsed", name) {
                self.report.warn(&*place, "not declared in extensionsUsed");
            }
            if let Some((_, schema)) = schema.extensions.iter().find(|(n, _)| n == name) {
                self.object(extension, schema, &place);
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
        let texts = |key: &str| self.root[key].as_array().into_iter().flatten().filter_map(Value::as_str).enumerate();
        for (key, i, name) in ["extensionsUsed", "extensionsRequired"].iter().flat_map(|k| texts(k).map(|(i, n)| (*k, i, n)))
        {
            let place = format!("{key}[{i}]");
            let supported = SUPPORTED.contains(&name);
            if texts(key).any(|(j, n)| j < i && n == name) {
                self.report.warn(&*place, format!("{name} is listed twice"));
            }
            if key == "extensionsRequired" && !supported {
                self.report.unsupported(place, format!("this file requires {name}, which is not supported"));
            } else if key == "extensionsRequired" && !declared(self.root, "extensionsUsed", name) {
                self.report.warn(place, format!("{name} is not listed in extensionsUsed"));
            } else if key == "extensionsUsed" && !supported && !ignored.contains(name) {
                self.report.warn(place, format!("ignored: {name}"));
            }
        }
        if declared(self.root, "extensionsUsed", "KHR_mesh_quantization")
            && !declared(self.root, "extensionsRequired", "KHR_mesh_quantization")
        {
            self.report.warn("extensionsUsed", "KHR_mesh_quantization must be listed in extensionsRequired too");
        }
    }
}

/// Whether a root list of extensions holds the name.
pub fn declared(root: &Value, list: &str, name: &str) -> bool {
    root[list].as_array().is_some_and(|names| names.iter().any(|n| n == name))
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
