// How much of the sky a surface sees, by direction: openness of corners that lie 2 m apart, in bricks of 5³. What is in
// them is said in systems/weather/openness/.

override OPENNESS: bool = false;

@group(0) @binding(6) var openness_table: texture_3d<u32>;
@group(0) @binding(7) var openness_sides: texture_3d<f32>;
@group(0) @binding(8) var openness_up: texture_3d<f32>;
// Rooms (systems/weather/openness/bricks.rs); lists of ellipsoids, two texels a cell, and three rows for each ellipsoid
// (systems/draw/sky_light/movers.rs).
@group(0) @binding(9) var movers: texture_2d<u32>;

const OPENNESS_SPACING: f32 = 2.0;
// Corners along a side of a brick, which share those between them.
const OPENNESS_CORNERS = 5u;
// Metres from a surface along its normal at which it is read.
const OPENNESS_OFFSET: f32 = 1.0;
// Albedo of what hides the sky.
const BOUNCE = 0.25;
// Metres within a room's walls at which its outermost corners lie.
const ROOM_MARGIN: f32 = 0.05;
// Texels in a row of the movers' table.
const MOVERS_WIDTH = 1024u;
// Metres from an ellipsoid at which it hides nothing any more.
const MOVERS_REACH: f32 = 6.0;

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
    let left = left_by_movers(position + view.eye, normal);
    open_sides *= left;
    open_up *= left;
    let place = position + (view.eye - sky.openness_origin) + normal * OPENNESS_OFFSET;
    let at = place / (OPENNESS_SPACING * f32(OPENNESS_CORNERS - 1u));
    let brick = floor(at);
    if any(brick < vec3f(0.0)) || any(brick >= vec3f(textureDimensions(openness_table))) {
        return;
    }
    let entry = textureLoad(openness_table, vec3u(brick), 0).xy;
    if entry.y != 0u && read_room(entry.y, position + view.eye, normal) {
        return;
    }
    if entry.x != 0u {
        read_brick(entry.x - 1u, (at - brick) * f32(OPENNESS_CORNERS - 1u));
    }
}

// At a place in a brick, counted in corners.
fn read_brick(number: u32, at: vec3f) {
    let bricks = sky.openness_bricks;
    let first = vec3u(number % bricks.x, number / bricks.x % bricks.y, number / (bricks.x * bricks.y));
    let uvw = (vec3f(first * OPENNESS_CORNERS) + at + 0.5) / vec3f(bricks * OPENNESS_CORNERS);
    open_sides *= textureSampleLevel(openness_sides, sky_sampler, uvw, 0.0);
    open_up *= textureSampleLevel(openness_up, sky_sampler, uvw, 0.0).x;
}

// Whether a surface lies in one of the rooms of a list, in world space; reads its corners then.
fn read_room(list: u32, place: vec3f, normal: vec3f) -> bool {
    var words = movers_texel(list);
    let count = words.x;
    words = vec4u(words.yzw, 0u);
    var left = 3u;
    var texel = list;
    for (var i = 0u; i < count; i++) {
        if left == 0u {
            texel++;
            words = movers_texel(texel);
            left = 4u;
        }
        let room = words.x * 3u;
        words = vec4u(words.yzw, 0u);
        left--;
        let low = movers_texel(room);
        let size = movers_texel(room + 2u);
        let extent = bitcast<vec3f>(size.xyz);
        let at = place - bitcast<vec3f>(low.xyz) + normal * ROOM_MARGIN;
        if all(at >= vec3f(-ROOM_MARGIN)) && all(at <= extent + ROOM_MARGIN) {
            let inner = clamp(at + normal * (OPENNESS_OFFSET - ROOM_MARGIN), vec3f(0.0), extent);
            let corner = inner * bitcast<vec3f>(movers_texel(room + 1u).xyz);
            let bricks = vec3u(size.w & 1023u, size.w >> 10u & 1023u, size.w >> 20u);
            let cells = f32(OPENNESS_CORNERS - 1u);
            let brick = min(vec3u(corner / cells), bricks - 1u);
            read_brick(low.w + (brick.z * bricks.y + brick.y) * bricks.x + brick.x, corner - vec3f(brick) * cells);
            return true;
        }
    }
    return false;
}

fn movers_texel(index: u32) -> vec4u {
    return textureLoad(movers, vec2u(index % MOVERS_WIDTH, index / MOVERS_WIDTH), 0);
}

// What movers leave of the light of a surface, `place` in world space: each takes the share of a sphere in the space in
// which it is one, and fades before it leaves the cell's list. Its own outside faces away from its middle.
fn left_by_movers(place: vec3f, normal: vec3f) -> f32 {
    let at = floor((place.xz - sky.movers_origin) / sky.movers_cell);
    if any(at < vec2f(0.0)) || any(at >= vec2f(sky.movers_cells)) {
        return 1.0;
    }
    let cell = sky.movers_first + (u32(at.y) * sky.movers_cells.x + u32(at.x)) * 2u;
    let first = sky.movers_first + sky.movers_cells.x * sky.movers_cells.y * 2u;
    var left = 1.0;
    var listed = movers_texel(cell);
    var number = 0u;
    loop {
        if listed.x == 0u {
            break;
        }
        let row = first + (listed.x - 1u) * 3u;
        let x = bitcast<vec4f>(movers_texel(row));
        let y = bitcast<vec4f>(movers_texel(row + 1u));
        let z = bitcast<vec4f>(movers_texel(row + 2u));
        let q = vec3f(dot(x.xyz, place) + x.w, dot(y.xyz, place) + y.w, dot(z.xyz, place) + z.w);
        // Squares of the half axes: a normal is turned by them into the sphere's space, a way out of it.
        let axes = 1.0 / vec3f(dot(x.xyz, x.xyz), dot(y.xyz, y.xyz), dot(z.xyz, z.xyz));
        let n = normalize(vec3f(dot(x.xyz, normal), dot(y.xyz, normal), dot(z.xyz, normal)) * axes);
        let squared = max(dot(q, q), 1.0);
        let radii = sqrt(squared);
        let way = x.xyz * (q.x * axes.x) + y.xyz * (q.y * axes.y) + z.xyz * (q.z * axes.z);
        let far = saturate(length(way) * (1.0 - 1.0 / radii) / MOVERS_REACH);
        let share = max(-dot(n, q) / radii, 0.0) / squared * (1.0 - far * far * far * far);
        left *= 1.0 - share;
        listed = vec4u(listed.yzw, 0u);
        number++;
        if number == 4u {
            listed = movers_texel(cell + 1u);
        }
    }
    return left;
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
    let whole = whole_diffuse(n);
    if !OPENNESS {
        return whole;
    }
    let ground = sky.ground * below;
    let open = openness(n, 0.0);
    return max(whole - ground, vec3f(0.0)) * open + open_up * (ground + BOUNCE * (1.0 - below) * (1.0 - open) * sky.up);
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
