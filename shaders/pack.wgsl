// What the passes of a batch have drawn, into arrays in a buffer, view after view: colours of three bytes, depths in
// metres, and what outputs say of each pixel's entity. A thread writes four pixels, so that all of them are whole
// words.

// `PackedBatch` of passes/pack.rs.
struct PackedBatch {
    // Pixels.
    width: u32,
    height: u32,
    // Threads of a view.
    quads: u32,
    // 1: pictures lie one below the other in a single layer.
    is_tall: u32,
    // The first words of arrays, or NOT_PACKED.
    color: u32,
    depth: u32,
    instance: u32,
    part: u32,
    class_: u32,
    depth_steps: u32,
}

// `PackedView` of passes/pack.rs.
struct PackedView {
    // z and w of (0, 0, depth, 1) in view space, each a factor of the depth and a summand.
    z: vec2<f32>,
    w: vec2<f32>,
    // Its place in the arrays.
    place: u32,
    // Rows of `labels`: the first, and how many.
    labels: u32,
    label_count: u32,
    unused: u32,
}

@group(0) @binding(0) var<uniform> batch: PackedBatch;
@group(0) @binding(1) var<storage, read> views: array<PackedView>;
// Instance, part and class by entity.
@group(0) @binding(2) var<storage, read> labels: array<vec4<u32>>;
// 8-bit sRGB, as it is stored.
@group(0) @binding(3) var pictures: texture_2d_array<f32>;
@group(0) @binding(4) var depths: texture_depth_2d_array;
@group(0) @binding(5) var ids: texture_2d_array<u32>;
@group(0) @binding(6) var<storage, read_write> arrays: array<u32>;
// Ascending depths, metres.
@group(0) @binding(7) var<storage, read> scale: array<f32>;

const NOT_PACKED: u32 = 0xffffffffu;
// Workgroups in a row of a dispatch.
const ROW: u32 = 32768u;
// Words of the colours of four pixels.
const COLOR_WORDS: u32 = 3u;
// Bits of a float.
const INFINITE: u32 = 0x7f800000u;

fn color(at: vec2<u32>, layer: u32) -> vec3<u32> {
    let tall = batch.is_tall == 1u;
    let place = select(at, vec2(at.x, at.y + layer * batch.height), tall);
    let texel = textureLoad(pictures, place, select(layer, 0u, tall), 0);
    return vec3<u32>(round(texel.rgb * 255.0));
}

fn metres(at: vec2<u32>, layer: u32, view: PackedView) -> u32 {
    let depth = textureLoad(depths, at, layer, 0);
    if depth == 0.0 {
        return INFINITE;
    }
    return bitcast<u32>(-(view.z.x * depth + view.z.y) / (view.w.x * depth + view.w.y));
}

// Steps of the scale that a depth has passed, plus 1; 255 where there is nothing.
fn depth_step(metres: u32) -> u32 {
    if metres >= INFINITE {
        return 255u;
    }
    // Positive numbers are in the order of their bits.
    var passed = 0u;
    var open = arrayLength(&scale);
    while open > 0u {
        let half = open / 2u;
        if bitcast<u32>(scale[passed + half]) <= metres {
            passed += half + 1u;
            open -= half + 1u;
        } else {
            open = half;
        }
    }
    return passed + 1u;
}

@compute @workgroup_size(64)
fn pack(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let quad = (group.y * ROW + group.x) * 64u + thread;
    if quad >= batch.quads {
        return;
    }
    let layer = group.z;
    let view = views[layer];
    var colors: array<vec3<u32>, 4>;
    var classes: u32;
    var steps: u32;
    let own = view.place * batch.quads + quad;
    for (var i = 0u; i < 4u; i++) {
        let pixel = quad * 4u + i;
        let at = vec2(pixel % batch.width, pixel / batch.width);
        // What fills up the last four stays as it is.
        if at.y >= batch.height {
            break;
        }
        let word = own * 4u + i;
        if batch.color != NOT_PACKED {
            colors[i] = color(at, layer);
        }
        if batch.depth != NOT_PACKED {
            let own_metres = metres(at, layer, view);
            arrays[batch.depth + word] = own_metres;
            if batch.depth_steps != NOT_PACKED {
                steps |= depth_step(own_metres) << (8u * i);
            }
        }
        if batch.instance == NOT_PACKED && batch.part == NOT_PACKED && batch.class_ == NOT_PACKED {
            continue;
        }
        let id = textureLoad(ids, at, layer, 0).x;
        var label: vec4<u32>;
        if id < view.label_count {
            label = labels[view.labels + id];
        }
        if batch.instance != NOT_PACKED {
            arrays[batch.instance + word] = label.x;
        }
        if batch.part != NOT_PACKED {
            arrays[batch.part + word] = label.y;
        }
        classes |= label.z << (8u * i);
    }
    if batch.color != NOT_PACKED {
        let first = batch.color + own * COLOR_WORDS;
        arrays[first] = colors[0].x | colors[0].y << 8u | colors[0].z << 16u | colors[1].x << 24u;
        arrays[first + 1u] = colors[1].y | colors[1].z << 8u | colors[2].x << 16u | colors[2].y << 24u;
        arrays[first + 2u] = colors[2].z | colors[3].x << 8u | colors[3].y << 16u | colors[3].z << 24u;
    }
    if batch.class_ != NOT_PACKED {
        arrays[batch.class_ + own] = classes;
    }
    if batch.depth_steps != NOT_PACKED {
        arrays[batch.depth_steps + own] = steps;
    }
}
