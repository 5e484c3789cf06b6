// The debug view of cells: what is drawn takes on the colours of the cells that it lies in, and the outlines of portals
// are drawn over it.

@group(1) @binding(0) var single: texture_depth_2d;
@group(1) @binding(1) var multisampled: texture_depth_multisampled_2d;
// First the picture's width and height, pixels. Then for each cell its colour with the number of its planes, and those:
// normal and offset, world space. A point p is within where normal · p + offset ≥ 0.
@group(1) @binding(2) var<storage, read> cells: array<vec4f>;

// Of outlines.
override OPACITY: f32 = 1.0;

// Of outlines, pixels.
const OUTLINE_HALF_WIDTH: f32 = 1.25;
// What lies this part of its distance before an outline does not hide it: the frame of the opening. Not in parallel
// projections.
const OUTLINE_AHEAD: f32 = 1.02;

@vertex
fn vs_tint(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

// What the colour at a place of the picture is multiplied by. Depth 0: the sky.
fn tint(pixel: vec2f, depth: f32) -> vec4f {
    let ndc = (pixel / cells[0].xy * 2.0 - 1.0) * vec2f(1.0, -1.0);
    let from_eye = view.eye_from_clip * vec4f(ndc, depth, 1.0);
    let position = view.eye + from_eye.xyz / from_eye.w;
    var next = 1u;
    while depth > 0.0 && next < arrayLength(&cells) {
        let cell = cells[next];
        let last = next + u32(cell.w);
        var inside = true;
        for (var i = next + 1u; i <= last; i++) {
            inside = inside && dot(cells[i].xyz, position) + cells[i].w >= 0.0;
        }
        if inside {
            return vec4f(cell.xyz, 1.0);
        }
        next = last + 1u;
    }
    return vec4f(1.0);
}

@fragment
fn fs_tint_single(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    return tint(pixel.xy, textureLoad(single, vec2u(pixel.xy), 0));
}

@fragment
fn fs_tint_multisampled(
    @builtin(position) pixel: vec4f,
    @builtin(sample_index) sample: u32,
) -> @location(0) vec4f {
    return tint(pixel.xy, textureLoad(multisampled, vec2u(pixel.xy), sample));
}

struct Edge {
    // World space.
    @location(0) start: vec3f,
    @location(1) end: vec3f,
    @location(2) color: vec3f,
}

struct Outline {
    @builtin(position) clip_position: vec4f,
    @location(0) color: vec3f,
}

// A corner of the rectangle around an edge.
@vertex
fn vs_outline(@builtin(vertex_index) index: u32, edge: Edge) -> Outline {
    var ends = array<vec4f, 2>(
        view.clip_from_eye * vec4f(edge.start - view.eye, 1.0),
        view.clip_from_eye * vec4f(edge.end - view.eye, 1.0),
    );
    // Beyond the near plane, where z is w: depth is reversed.
    let beyond = vec2f(ends[0].w - ends[0].z, ends[1].w - ends[1].z);
    if all(beyond < vec2f(0.0)) {
        return Outline(vec4f(0.0, 0.0, 0.0, 1.0), edge.color);
    }
    let cut = beyond.x / (beyond.x - beyond.y);
    let crossing = mix(ends[0], ends[1], cut);
    if beyond.x < 0.0 {
        ends[0] = crossing;
    } else if beyond.y < 0.0 {
        ends[1] = crossing;
    }
    let half_size = 0.5 * cells[0].xy;
    let pixels = array<vec2f, 2>(ends[0].xy / ends[0].w * half_size, ends[1].xy / ends[1].w * half_size);
    let way = pixels[1] - pixels[0];
    let along = way * inverseSqrt(max(dot(way, way), 1e-12)) * OUTLINE_HALF_WIDTH;
    let across = vec2f(-along.y, along.x);
    let corner = array<u32, 6>(0u, 1u, 2u, 2u, 1u, 3u)[index];
    let end = corner >> 1u;
    let moved = select(-along, along, end == 1u) + select(-across, across, (corner & 1u) == 1u);
    let clip = ends[end];
    let ndc = (pixels[end] + moved) / half_size;
    let ahead = select(OUTLINE_AHEAD, 1.0, view.parallel != 0u);
    return Outline(vec4f(ndc * clip.w, min(clip.z * ahead, clip.w), clip.w), edge.color);
}

@fragment
fn fs_outline(outline: Outline) -> @location(0) vec4f {
    return vec4f(outline.color, OPACITY);
}
