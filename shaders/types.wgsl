// What the shaders read. Each struct mirrors the one of the same purpose in systems/draw_list.rs (…Record);
// tests/shaders.rs compares every offset.

struct View {
    clip_from_world: mat4x4f,
    world_from_clip: mat4x4f,
    eye: vec3f,
    light_count: u32,
    toward_eye: vec3f,
    parallel: u32,
    ambient: vec3f,
    exposure: f32,
    zenith: vec3f,
    picked_entity: u32,
    horizon: vec3f,
    pad0: u32,
    ground: vec3f,
    pad1: u32,
}

struct Instance {
    world_from_object: array<vec4f, 3>,
    lights: array<u32, 3>,
    material: u32,
    weights: array<f32, 3>,
    entity: u32,
    remainder_ambient: vec3f,
    // How many lights reach the object.
    reaching: u32,
    remainder_direction: vec3f,
    // Sum of the scores of the lights that are not among the three.
    dropped: f32,
    remainder_sides: vec3f,
    pad0: u32,
}

struct Light {
    position: vec3f,
    kind: u32,
    direction: vec3f,
    inverse_range_squared: f32,
    color: vec3f,
    exponent: f32,
    attenuation: vec3f,
    cos_outer: f32,
    ambient: vec3f,
    cos_inner: f32,
}

const LIGHT_POINT = 0u;
const LIGHT_SPOT_EXPONENT = 1u;
const LIGHT_SPOT_CONE = 2u;
const LIGHT_DIRECTIONAL = 3u;
const LIGHT_OFF = 4u;
const NO_LIGHT = 0xffffffffu;

struct MapRef {
    image_from_mesh_uv: vec4f,
    offset: vec2f,
    layer: u32,
    uv_set: u32,
}

const MAP_BASE = 0u;
const MAP_NORMAL = 1u;
const MAP_SPECULAR = 2u;
const MAP_METALLIC_ROUGHNESS = 3u;
const MAP_OCCLUSION = 4u;
const MAP_EMISSIVE = 5u;
const MAP_HEIGHT = 6u;

struct Material {
    base_factor: vec4f,
    specular_factor: vec3f,
    shininess: f32,
    emissive_factor: vec3f,
    normal_scale: f32,
    metallic: f32,
    roughness: f32,
    occlusion_strength: f32,
    alpha_cutoff: f32,
    glossiness: f32,
    specular_strength: f32,
    height_scale_uv: f32,
    pad0: u32,
    maps: array<MapRef, 7>,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> instances: array<Instance>;
@group(0) @binding(2) var<storage, read> slots: array<u32>;
@group(0) @binding(3) var<storage, read> lights: array<Light>;
@group(0) @binding(4) var<storage, read> materials: array<Material>;
// For LIGHTS_ALL: reaching[slot] is where the list of the lights that reach the object in that slot begins.
@group(0) @binding(5) var<storage, read> reaching: array<u32>;

const PI = 3.14159265;

// As the HDR target holds it: exposed before it is stored, since half floats end at 65504.
fn exposed(color: vec3f) -> vec3f {
    return min(color * view.exposure, vec3f(65504.0));
}

fn luminance(color: vec3f) -> f32 {
    return dot(color, vec3f(0.2126, 0.7152, 0.0722));
}
