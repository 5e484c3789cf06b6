//! The shape of a glTF 2.0 document: every object's properties with their types, ranges and references, as tables for
//! [`super::shape`] to walk. Written from the JSON schema of the glTF 2.0 specification and of the extensions named
//! here.

/// Type of a property's value.
#[derive(Clone, Copy)]
pub enum Kind {
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
    /// The attributes of a primitive, by name; their accessors.
    Attributes,
    IdMaps(&'static str),
    Object(&'static Schema),
    Objects(&'static Schema),
}

/// A property.
pub struct Field {
    pub name: &'static str,
    pub kind: Kind,
    pub required: bool,
}

/// The properties of one kind of object, and the extensions that we read there.
pub struct Schema {
    pub fields: &'static [Field],
    pub extensions: &'static [(&'static str, &'static Schema)],
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

/// The largest number that is read.
pub const MAX: f64 = f32::MAX as f64;
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

/// The document.
pub static ROOT: Schema = Schema {
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

static ANIMATION: Schema =
    plain(&[NAME, must("channels", Kind::Objects(&CHANNEL)), must("samplers", Kind::Objects(&ANIMATION_SAMPLER))]);

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
    must("attributes", Kind::Attributes),
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
        // Exporters write 1 rounded to 32 bits and more: within what they round.
        may("rotation", Kind::Reals(4, -1.0 - 1e-4, 1.0 + 1e-4)),
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
