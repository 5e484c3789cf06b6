// Depths of what casts shadows, as a light sees it in one face of its layer (src/renderer/shadows/shadow_layers.rs).

override TRANSFORMED_UVS: bool = true;
override VERTEX_COLORS: bool = true;

@group(1) @binding(0) var base_maps: texture_2d_array<f32>;
@group(1) @binding(9) var base_sampler: sampler;

// Rows that turn what goes out from the origin into clip space; they hold no place.
struct ShadowFace {
    // The light, or the middle of a level of a directional one.
    origin: vec3f,
    // Metres; 0: the projection is parallel.
    near: f32,
    right: vec3f,
    pad0: u32,
    up: vec3f,
    pad1: u32,
    toward: vec3f,
    pad2: u32,
}

@group(3) @binding(0) var<uniform> face: ShadowFace;

struct CasterIn {
    @location(0) position: vec3f,
    @location(3) uvs: vec4f,
    @location(4) color: vec4f,
    @location(5) slot: u32,
}

struct CasterOut {
    @builtin(position) clip_position: vec4f,
    @location(0) uvs: vec4f,
    @location(1) alpha: f32,
    @location(2) @interpolate(flat) slot: u32,
}

fn clip_position(slot: u32, position: vec3f) -> vec4f {
    let rows = load_world_from_object(slot);
    let turned = vec3f(dot(rows[0].xyz, position), dot(rows[1].xyz, position), dot(rows[2].xyz, position));
    let v = turned + (vec3f(rows[0].w, rows[1].w, rows[2].w) - face.origin);
    let along = dot(face.toward, v);
    let is_parallel = face.near == 0.0;
    // What lies before the near plane of a parallel projection casts, too: from that plane.
    let depth = select(face.near, min(0.5 + along, 1.0), is_parallel);
    return vec4f(dot(face.right, v), dot(face.up, v), depth, select(along, 1.0, is_parallel));
}

@vertex
fn vs_opaque(@location(0) position: vec3f, @location(5) slot: u32) -> @builtin(position) vec4f {
    return clip_position(slot, position);
}

@vertex
fn vs_mask(in: CasterIn) -> CasterOut {
    return CasterOut(clip_position(in.slot, in.position), in.uvs, in.color.a, in.slot);
}

@fragment
fn fs_mask(in: CasterOut) {
    let instance = load_packed_instance(in.slot);
    let material = load_material(instance.material);
    var uv = in.uvs.xy;
    if TRANSFORMED_UVS {
        let m = material.image_from_mesh_uv[MAP_BASE];
        let second = ((material.second_uvs >> MAP_BASE) & 1u) == 1u;
        uv = mat2x2f(m.xy, m.zw) * select(in.uvs.xy, in.uvs.zw, second) + material.offsets[MAP_BASE];
    }
    let texel = textureSample(base_maps, base_sampler, uv, layer_of(material, MAP_BASE));
    var alpha = texel.a * material.base_factor.a;
    if VERTEX_COLORS {
        alpha *= in.alpha;
    }
    if alpha < material.alpha_cutoff {
        discard;
    }
}

// A triangle over a face, with nothing in it: farther than all else.
@vertex
fn vs_empty(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    let corner = vec2f(f32(index & 1u), f32(index >> 1u));
    return vec4f(4.0 * corner - 1.0, 0.0, 1.0);
}
