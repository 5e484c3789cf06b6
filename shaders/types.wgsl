// What the shaders read. Structs mirror those of the same purpose in systems/draw/records.rs (…Record), PackedLight
// that of systems/lights/record.rs; tests/scenes/shaders.rs compares every offset. Instances, lights, materials and
// lists of lights (systems/lights/lists.rs) are tables in one texture: record r lies r times its size behind the first
// texel of its table, four values in each, and its load_… function gathers it. (Why a texture: docs/architecture.md,
// "Tables in a texture".) Compilers leave out the texels whose values nothing uses.

struct View {
    clip_from_world: mat4x4f,
    clip_from_eye: mat4x4f,
    eye_from_clip: mat4x4f,
    eye: vec3f,
    parallel: u32,
    toward_eye: vec3f,
    exposure: f32,
    ambient: vec3f,
    picked_entity: u32,
    zenith: vec3f,
    // The texel of the tables that has the record of the view's first shadow layer.
    shadow_records: u32,
    horizon: vec3f,
    // Metres per metre from the eye that a level of detail may be off; 0 where meshes are drawn whole.
    level_error: f32,
    ground: vec3f,
    // Texels along a side of the shadow layers that the view reads.
    shadow_side: f32,
}

// systems/lights/selected.rs says how it is packed.
struct PackedInstance {
    world_from_object: array<vec4f, 3>,
    lights: array<u32, 3>,
    material: u32,
    residual: array<u32, 4>,
    last_side_and_dropped: u32,
    residual_unit: f32,
    reaching_or_list: u32,
    entity: u32,
}

struct Instance {
    world_from_object: array<vec4f, 3>,
    // Slots and weights, packed.
    chosen: vec3u,
    lights: array<u32, 3>,
    weights: array<f32, 3>,
    material: u32,
    entity: u32,
    residual_ambient: vec3f,
    residual_direction: vec3f,
    residual_sides: vec3f,
    // How many lights reach the object.
    reaching: u32,
    // What its lights may miss: a sum of scores.
    dropped: f32,
    // How many lights it has beyond the three, the first two of them packed as in `lights`, and the texel of the tables
    // that has the next four.
    listed: u32,
    first_listed: vec2u,
    list: u32,
}

struct Light {
    // Of a directional light the unit vector towards it.
    position: vec3f,
    kind: u32,
    color: vec3f,
    inverse_range_squared: f32,
    attenuation: vec3f,
    exponent_or_cone_slope: f32,
    direction: vec3f,
    versine_outer: f32,
    ambient: vec3f,
    // Counted from 1; 0: none.
    shadow_layer: u32,
}

// systems/lights/record.rs says how it is packed.
struct PackedLight {
    position: vec3f,
    // Its lowest bits are the shadow layer.
    inverse_range_squared: f32,
    words: vec4u,
    attenuation: vec3f,
    size: f32,
    ambient: vec3f,
    pad0: u32,
}

// Whether some light has or had an attenuation other than the inverse square, a cone, one with an exponent, or an
// ambient colour, on or off.
override LIGHTS_WITH_ATTENUATION: bool = true;
override LIGHTS_WITH_CONES: bool = true;
override LIGHTS_WITH_EXPONENTS: bool = true;
override LIGHTS_WITH_AMBIENT: bool = true;
override LAMPS_WITH_SHADOWS: bool = true;
override SUNS_WITH_SHADOWS: bool = true;
// Whether some light that casts shadows has a size.
override LIGHTS_WITH_SIZES: bool = true;

// Whether some object has more than three lights.
override LIGHT_LISTS: bool = true;

const NO_LIGHT = 0xffffffffu;

// A light's kind.
const LIGHT_POINT = 0u;
const LIGHT_SPOT_EXPONENT = 1u;
const LIGHT_SPOT_CONE = 2u;
const LIGHT_DIRECTIONAL = 3u;
const LIGHT_OFF = 4u;

const MAP_BASE = 0u;
const MAP_NORMAL = 1u;
const MAP_SPECULAR = 2u;
const MAP_METALLIC_ROUGHNESS = 3u;
const MAP_OCCLUSION = 4u;
const MAP_EMISSIVE = 5u;
const MAP_HEIGHT = 6u;
const MAP_HORIZON_0 = 7u;
const MAP_HORIZON_1 = 8u;
const MAP_OFFSET = 9u;
const MAP_ENVIRONMENT = 10u;

struct Material {
    base_factor: vec4f,
    specular_factor: vec3f,
    shininess: f32,
    // Of each map, in the class's texture arrays: a byte each.
    layers: vec3u,
    normal_scale: f32,
    emissive_factor: vec3f,
    alpha_cutoff: f32,
    metallic: f32,
    roughness: f32,
    occlusion_strength: f32,
    specular_strength: f32,
    glossiness: f32,
    height_scale_uv: f32,
    height_rest: f32,
    // Bit m: map m is placed by the second UV set.
    second_uvs: u32,
    emboss_step_texels: f32,
    self_shadow: f32,
    pad0: u32,
    pad1: u32,
    // Rows of a 2×2 matrix.
    offset_matrix: vec4f,
    // Columns of a 2×2 matrix per map.
    image_from_mesh_uv: array<vec4f, 11>,
    offsets: array<vec2f, 12>,
}

// The first texel of each table.
struct TableStarts {
    instances: u32,
    lights: u32,
    materials: u32,
    light_lists: u32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var tables: texture_storage_2d<rgba32uint, read>;
@group(0) @binding(2) var<uniform> starts: TableStarts;

// Texels in a row of the tables.
const TABLE_WIDTH = 4096u;

fn texel_of(index: u32) -> vec4u {
    return textureLoad(tables, vec2u(index % TABLE_WIDTH, index / TABLE_WIDTH));
}

fn floats_of(index: u32) -> vec4f {
    return bitcast<vec4f>(texel_of(index));
}

const INSTANCE_TEXELS = 6u;
// Set beside the slot of an object that is drawn at a coarser level than its mesh.
const COARSE = 0x80000000u;
// Of a page of a list of lights.
const LIST_TEXELS = 2u;
// Set where a word names a list.
const LISTED = 0x80000000u;

fn load_world_from_object(slot: u32) -> array<vec4f, 3> {
    let t = starts.instances + (slot & ~COARSE) * INSTANCE_TEXELS;
    return array<vec4f, 3>(floats_of(t), floats_of(t + 1u), floats_of(t + 2u));
}

fn load_packed_instance(slot: u32) -> PackedInstance {
    let t = starts.instances + (slot & ~COARSE) * INSTANCE_TEXELS;
    let chosen = texel_of(t + 3u);
    let residual = texel_of(t + 4u);
    let rest = texel_of(t + 5u);
    return PackedInstance(
        load_world_from_object(slot),
        array<u32, 3>(chosen.x, chosen.y, chosen.z),
        chosen.w,
        array<u32, 4>(residual.x, residual.y, residual.z, residual.w),
        rest.x,
        bitcast<f32>(rest.y),
        rest.z,
        rest.w,
    );
}

// The two halves of a word, each in two's complement.
fn halves(word: u32) -> vec2f {
    return vec2f(vec2i(i32(word << 16u), i32(word)) >> vec2u(16u));
}

// The weights in words of lights.
fn weights_of(packed: vec3u) -> vec3f {
    return vec3f(packed & vec3u(1023u)) / 1023.0;
}

fn load_instance(slot: u32) -> Instance {
    let packed = load_packed_instance(slot);
    let chosen = vec3u(packed.lights[0], packed.lights[1], packed.lights[2]);
    // Shifted with its sign: no light stays NO_LIGHT.
    let lights = bitcast<vec3u>(bitcast<vec3i>(chosen) >> vec3u(10u));
    let weights = weights_of(chosen);
    var reaching = packed.reaching_or_list;
    var listed = 0u;
    var first_listed = vec2u(0u);
    var list = 0u;
    if LIGHT_LISTS && (packed.reaching_or_list & LISTED) != 0u {
        list = starts.light_lists + (packed.reaching_or_list & ~LISTED) * LIST_TEXELS;
        let header = texel_of(list);
        reaching = header.x;
        listed = header.y;
        first_listed = header.zw;
        list++;
    }
    let unit = packed.residual_unit;
    let a = halves(packed.residual[0]) * unit;
    let b = halves(packed.residual[1]) * unit;
    let c = halves(packed.residual[2]) * unit;
    let d = halves(packed.residual[3]) * unit;
    let last = halves(packed.last_side_and_dropped).x * unit;
    return Instance(
        packed.world_from_object,
        chosen,
        array<u32, 3>(lights.x, lights.y, lights.z),
        array<f32, 3>(weights.x, weights.y, weights.z),
        packed.material,
        packed.entity,
        vec3f(a, b.x),
        vec3f(b.y, c),
        vec3f(d, last),
        reaching,
        bitcast<f32>(packed.last_side_and_dropped & 0xffff0000u),
        listed,
        first_listed,
        list,
    );
}

const LIGHT_TEXELS = 4u;
// Of `inverse_range_squared`.
const LAYER_BITS = 255u;

fn load_packed_light(slot: u32) -> PackedLight {
    let t = starts.lights + slot * LIGHT_TEXELS;
    let place = floats_of(t);
    let words = texel_of(t + 1u);
    var attenuation = vec3f(0.0, 0.0, 1.0);
    if LIGHTS_WITH_ATTENUATION {
        attenuation = floats_of(t + 2u).xyz;
    }
    var ambient = vec3f(0.0);
    if LIGHTS_WITH_AMBIENT {
        ambient = floats_of(t + 3u).xyz;
    }
    return PackedLight(place.xyz, place.w, words, attenuation, 0.0, ambient, 0u);
}

// From x and y on the octahedron |x| + |y| + |z| = 1.
fn from_octahedron(packed: vec2f) -> vec3f {
    let z = 1.0 - abs(packed.x) - abs(packed.y);
    let beyond = max(-z, 0.0);
    return normalize(vec3f(packed - select(vec2f(beyond), vec2f(-beyond), packed < vec2f(0.0)), z));
}

fn load_light(slot: u32) -> Light {
    let packed = load_packed_light(slot);
    let words = packed.words;
    // The bits of each channel to the upper end, and down again with their sign.
    let channels = vec3i(vec3u(words.x << 18u, words.x << 4u, words.y << 18u)) >> vec3u(18u);
    let scale = bitcast<f32>(((words.y >> 14u) & 255u) << 23u);
    let kind = words.x >> 28u;
    let range_and_layer = bitcast<u32>(packed.inverse_range_squared);
    var direction = vec3f(0.0);
    var versine_outer = 0.0;
    var exponent_or_cone_slope = 0.0;
    if LIGHTS_WITH_CONES {
        let upper_y = words.y & 0xffc00000u;
        let xy = vec2i(vec2u(words.z << 11u, upper_y | ((words.z >> 21u) << 11u))) >> vec2u(11u);
        direction = from_octahedron(vec2f(xy) / 1048575.0);
        versine_outer = bitcast<f32>(((words.w & 0xffffu) << 12u) + (97u << 23u));
        exponent_or_cone_slope = bitcast<f32>(((words.w >> 16u) << 13u) + (107u << 23u));
    }
    return Light(
        packed.position,
        kind,
        vec3f(channels) * scale,
        bitcast<f32>(range_and_layer & ~LAYER_BITS),
        packed.attenuation,
        exponent_or_cone_slope,
        direction,
        versine_outer,
        packed.ambient,
        range_and_layer & LAYER_BITS,
    );
}

const MATERIAL_TEXELS = 25u;

fn load_material(index: u32) -> Material {
    let t = starts.materials + index * MATERIAL_TEXELS;
    let specular = floats_of(t + 1u);
    let layers = texel_of(t + 2u);
    let emissive = floats_of(t + 3u);
    let factors = floats_of(t + 4u);
    let others = texel_of(t + 5u);
    let other_factors = bitcast<vec3f>(others.xyz);
    let bumps = floats_of(t + 6u);
    let offsets_0 = floats_of(t + 19u);
    let offsets_2 = floats_of(t + 20u);
    let offsets_4 = floats_of(t + 21u);
    let offsets_6 = floats_of(t + 22u);
    let offsets_8 = floats_of(t + 23u);
    let offsets_10 = floats_of(t + 24u);
    return Material(
        floats_of(t),
        specular.xyz,
        specular.w,
        layers.xyz,
        bitcast<f32>(layers.w),
        emissive.xyz,
        emissive.w,
        factors.x,
        factors.y,
        factors.z,
        factors.w,
        other_factors.x,
        other_factors.y,
        other_factors.z,
        others.w,
        bumps.x,
        bumps.y,
        0u,
        0u,
        floats_of(t + 7u),
        array<vec4f, 11>(
            floats_of(t + 8u),
            floats_of(t + 9u),
            floats_of(t + 10u),
            floats_of(t + 11u),
            floats_of(t + 12u),
            floats_of(t + 13u),
            floats_of(t + 14u),
            floats_of(t + 15u),
            floats_of(t + 16u),
            floats_of(t + 17u),
            floats_of(t + 18u),
        ),
        array<vec2f, 12>(
            offsets_0.xy,
            offsets_0.zw,
            offsets_2.xy,
            offsets_2.zw,
            offsets_4.xy,
            offsets_4.zw,
            offsets_6.xy,
            offsets_6.zw,
            offsets_8.xy,
            offsets_8.zw,
            offsets_10.xy,
            offsets_10.zw,
        ),
    );
}

// The layer of a map in its texture array.
fn layer_of(material: Material, map: u32) -> u32 {
    return (material.layers[map / 4u] >> (map % 4u * 8u)) & 255u;
}

const PI = 3.14159265;

// As the HDR target holds it: exposed before it is stored, since half floats end at 65504.
fn exposed(color: vec3f) -> vec3f {
    return min(color * view.exposure, vec3f(65504.0));
}

fn luminance(color: vec3f) -> f32 {
    return dot(color, vec3f(0.2126, 0.7152, 0.0722));
}
