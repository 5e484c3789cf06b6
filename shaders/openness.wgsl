// How much of the sky a surface sees, by direction: openness of corners that lie 2 m apart, in bricks of 5³. What is in
// them is said in systems/weather/openness/.

override OPENNESS: bool = false;

@group(0) @binding(6) var openness_table: texture_3d<u32>;
@group(0) @binding(7) var openness_sides: texture_3d<f32>;
@group(0) @binding(8) var openness_up: texture_3d<f32>;

const OPENNESS_SPACING = 2.0;
// Corners along a side of a brick, which share those between them.
const OPENNESS_CORNERS = 5u;
// Metres from a surface along its normal at which it is read.
const OPENNESS_OFFSET = 1.0;
// Albedo of what hides the sky.
const BOUNCE = 0.25;

// Toward +X, −X, +Z and −Z, and upward; of the surface that is shaded.
var<private> open_sides: vec4f;
var<private> open_up: f32;

// `position`: from the eye, along the world's axes.
fn find_openness(position: vec3f, normal: vec3f) {
    open_sides = vec4f(1.0);
    open_up = 1.0;
    if !OPENNESS {
        return;
    }
    let place = position + (view.eye - sky.openness_origin) + normal * OPENNESS_OFFSET;
    let at = place / (OPENNESS_SPACING * f32(OPENNESS_CORNERS - 1u));
    let brick = floor(at);
    if any(brick < vec3f(0.0)) || any(brick >= vec3f(textureDimensions(openness_table))) {
        return;
    }
    let number = textureLoad(openness_table, vec3u(brick), 0).x;
    if number == 0u {
        return;
    }
    let n = number - 1u;
    let bricks = sky.openness_bricks;
    let first = vec3u(n % bricks.x, n / bricks.x % bricks.y, n / (bricks.x * bricks.y)) * OPENNESS_CORNERS;
    let texel = vec3f(first) + (at - brick) * f32(OPENNESS_CORNERS - 1u) + 0.5;
    let uvw = texel / vec3f(bricks * OPENNESS_CORNERS);
    open_sides = textureSampleLevel(openness_sides, sky_sampler, uvw, 0.0);
    open_up = textureSampleLevel(openness_up, sky_sampler, uvw, 0.0).x;
}

// Of the upper half toward a direction; `below`: toward what is straight below.
fn openness(n: vec3f, below: f32) -> f32 {
    let sides = select(open_sides.xz, open_sides.yw, n.xz < vec2f(0.0));
    return dot(vec3f(sides, select(open_up, below, n.y < 0.0)), n.xzy * n.xzy);
}

// The light of sky and ground on a surface: what a white one shows. What hides the sky throws back a part of the light
// that comes from above. A gradient gives none: `ambient` stands for it.
fn sky_diffuse(n: vec3f) -> vec3f {
    if !ATMOSPHERE {
        return vec3f(0.0);
    }
    let below = 0.5 - 0.5 * n.y;
    let upper = upper_diffuse(n);
    let ground = sky.ground * below;
    if !OPENNESS {
        return upper + ground;
    }
    let open = openness(n, 0.0);
    return upper * open + open_up * (ground + BOUNCE * (1.0 - below) * (1.0 - open) * sky.up);
}

// What a surface mirrors of the sky, and of what hides it.
fn sky_mirrored(direction: vec3f, roughness: f32) -> vec3f {
    let radiance = sky_blurred(direction, roughness);
    if !OPENNESS {
        return radiance;
    }
    let open = openness(direction, open_up);
    return radiance * open + BOUNCE * (1.0 - open) * open_up * sky.up;
}
