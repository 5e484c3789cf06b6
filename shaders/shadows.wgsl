// How much of a light is seen from a surface: by shadow maps, which shadow_pass.wgsl draws. Takes the place of
// unshadowed.wgsl.
//
// A light with a shadow layer has a square of an array texture. A spot fills it; a point light has six faces there, as
// src/renderer/shadows/lamp_layers.rs lays them out. Depths are reversed: near / distance along the face's axis. A
// directional light has several layers, its levels around the eye (src/renderer/shadows/sun_levels.rs); depths are
// linear there.
//
// There is no bias to set. 1 / distance is linear on a plane, so the depth of the receiver's own triangle at the middle
// of each texel is known exactly: each is compared with its own (Isidoro, "Shadow Mapping: GPU-based Tips and
// Techniques", GDC 2006, with the plane from the triangle's normal instead of derivatives).

@group(3) @binding(0) var shadow_maps: texture_depth_2d_array;
@group(3) @binding(1) var shadow_sampler: sampler;

// Texels around a face beyond its quarter turn, or around a spot's cone: filters read no neighbouring face.
const SHADOW_GUTTER: f32 = 2.0;
// Metres that a texel of a directional light's first level covers, and from the near plane to the far one.
const FIRST_TEXEL: f32 = 0.020833334;
const SUN_DEPTH: f32 = 2048.0;
// Of the way from the middle of a level to its sides: what is farther away has another level, and what is less of that
// has no other one.
const LEVEL_USED: f32 = 0.75;
const LEVEL_ALONE: f32 = 0.8;
// Half the side of a square that blurs as much as a disc of radius 1 does: of the same variance, √3/2.
const SQUARE: f32 = 0.8660254;
// Texels from a place to the side of the narrowest filter, which is bilinear, and of the widest.
const NARROWEST: f32 = 0.5;
const WIDEST: f32 = 5.5;
// Casters are looked for as far around as the penumbra of one reaches that stands so many metres before the sun, or
// half way to the lamp. For the sun's disc that is four gathers in the first two levels, and one beyond.
const LIKELY: f32 = 7.5;
// A plane's depth changes by no more than this many texels per texel.
const STEEPEST: f32 = 20.0;

// Of the triangle, towards the eye.
var<private> receiver_normal: vec3f;
// Metres that the triangle may lie below the mesh: at a coarse level of detail it would be in its own way.
var<private> receiver_error: f32;

// Where a point is in its layer.
struct ShadowPlace {
    // Texels.
    at: vec2f,
    depth: f32,
    // Of the receiver's plane: how depth changes from texel to texel.
    slope: vec2f,
    // A texel's width where the point is, as a difference in depth.
    texel: f32,
    // What a filter may read around, texels.
    low: vec2f,
    high: vec2f,
    // Texels from a place to the side of a filter as wide as a penumbra: of a caster that is nearer to the light by 1
    // of depth, 0 for a point; and of the widest that is looked for.
    spread: f32,
    reach: f32,
}

fn find_shadows(in: VertexOut, dp_dx: vec3f, dp_dy: vec3f) {
    let normal = unit_or(cross(dp_dx, dp_dy), in.normal);
    receiver_normal = select(normal, -normal, dot(normal, toward_eye(in.position)) < 0.0);
    let distance = select(length(in.position), 1.0, view.parallel == 1u);
    receiver_error = select(0.0, view.level_error * distance, (in.slot & COARSE) != 0u);
}

// Where a light's ray leaves the height field of a point that a technique has found in it: up to there its own shadows
// decide, from there on the map. Where nothing is displaced, the point itself. From the eye.
fn receiver(bump: Bump, toward: vec3f) -> vec3f {
    if is_relief() || is_parallax() {
        let rise = (1.0 - bump.point.height) * bump.field.depth;
        return bump.position + toward * (rise / max(dot(toward, bump.field.frame.normal), LEAST_COSINE));
    }
    return bump.position;
}

// `v`: from the light to the point. `n`: the plane's normal, `h`: their product, below 0.
fn place_in_faces(v: vec3f, n: vec3f, h: f32, near: f32, light_size: f32) -> ShadowPlace {
    let a = abs(v);
    let m = max(a.x, max(a.y, a.z));
    let is_x = a.x >= m;
    let is_y = a.y >= m && !is_x;
    let axis = select(select(v.z, v.y, is_y), v.x, is_x);
    let across = select(select(v.xy, v.xz, is_y), v.yz, is_x) / m;
    let leaning = select(select(n.xy, n.xz, is_y), n.yz, is_x);
    // +x 0, −x 1, +y 2, +z 3, −z 4; −y, below the light, is the large one.
    let is_below = is_y && axis < 0.0;
    let face = select(select(3.0, 2.0, is_y), 0.0, is_x) + select(0.0, 1.0, axis < 0.0 && !is_y);
    let third = view.shadow_side / 3.0;
    let small = vec2f(select(face - 3.0, 2.0, face < 3.0), select(2.0, face, face < 3.0)) * third;
    let corner = select(small, vec2f(0.0), is_below);
    let size = select(third, 2.0 * third, is_below);
    let scale = 0.5 * size - SHADOW_GUTTER;
    return ShadowPlace(
        corner + 0.5 * size + across * scale,
        near / m,
        leaning * (near / (h * scale)),
        near / (m * scale),
        corner + 1.0,
        corner + size - 1.0,
        light_size * scale / near,
        light_size * scale / m,
    );
}

// `q`: turns the world so that the spot shines along −Z. `scale`: texels of a slope of one.
fn place_in_cone(v: vec3f, n: vec3f, h: f32, near: f32, q: vec4f, scale: f32, size: f32) -> ShadowPlace {
    let along = turned(q, v);
    let leaning = turned(q, n).xy;
    let m = max(-along.z, 1e-4);
    return ShadowPlace(
        0.5 * view.shadow_side + along.xy * (scale / m),
        near / m,
        leaning * (near / (h * scale)),
        near / (m * scale),
        vec2f(1.0),
        vec2f(view.shadow_side - 1.0),
        size * scale / near,
        size * scale / m,
    );
}

fn turned(q: vec4f, v: vec3f) -> vec3f {
    let t = 2.0 * cross(q.xyz, v);
    return v + q.w * t + cross(q.xyz, t);
}

// What of texels is compared with what.
struct Plane {
    // Of the receiver at its place, and how it changes from texel to texel.
    depth: f32,
    slope: vec2f,
    layer: u32,
}

fn lit_share(place: ShadowPlace, layer: u32) -> f32 {
    let most = STEEPEST * place.texel;
    let slope = clamp(place.slope, vec2f(-most), vec2f(most));
    // Meshes are not planes between middles of texels, and rasterizers move them by up to a sixteenth. With so much
    // room light goes on behind a wall for less than a texel of the floor, and before it half is missing at the most.
    let plane = Plane(place.depth + 0.25 * place.texel + 0.4375 * (abs(slope.x) + abs(slope.y)), slope, layer);
    // Half the side of a square around the place. Texels count by the part of them that lies in it.
    var half = clamp(place.reach, NARROWEST, WIDEST);
    // Along a side, and those that are done. Whole numbers: the loop ends, whatever the place is.
    var gathers = gathers_along(half);
    var done = vec2u(0u);
    let widest = f32(gathers) - 0.5;
    var is_search = true;
    var is_open = false;
    var depths = 0.0;
    var lit = 0.0;
    // Casters are looked for, and then what is lit is added up once more, if that square is another one. Drivers on the
    // processor run the body of each loop at least once: this is one loop, and its end is asked for last.
    loop {
        let texels = texels_at(place, plane, ceil(place.at - half - 1.0) + 2.0 * vec2f(done));
        let weights = saturate(half + 0.5 - abs(texels.x)) * saturate(half + 0.5 - abs(texels.y));
        let dark_weights = select(vec4f(0.0), weights, in_the_way(texels, place));
        lit += dot(weights - dark_weights, vec4f(1.0));
        if !LIGHTS_WITH_SIZES {
            break;
        }
        depths += dot(dark_weights, texels.depths);
        is_open |= any(texels.plane >= texels.depths);
        done.x += 1u;
        done = select(done, vec2u(0u, done.y + 1u), done.x == gathers);
        let dark = 4.0 * half * half - lit;
        let nearer = depths / max(dark, 1e-3) - place.depth;
        let penumbra = clamp(place.spread * nearer, NARROWEST, widest);
        let is_whole = done.y == gathers;
        let is_again = is_whole && is_search && is_open && dark > 1e-3 && penumbra != half;
        is_search = is_search && !is_whole;
        if is_again {
            half = penumbra;
            gathers = gathers_along(half);
            done = vec2u(0u);
            lit = 0.0;
        }
        if is_whole && !is_again {
            break;
        }
    }
    return select(0.0, lit / (4.0 * half * half), is_open || !LIGHTS_WITH_SIZES);
}

// Gathers of two by two texels along a side of a square, wherever it lies among them.
fn gathers_along(half: f32) -> u32 {
    return u32(clamp(ceil(half + 0.5), 1.0, ceil(WIDEST + 0.5)));
}

// A square of four texels, from its upper left one, row by row.
struct Texels {
    depths: vec4f,
    // Depth of the receiver's plane there.
    plane: vec4f,
    // Of their middles, from the place.
    x: vec4f,
    y: vec4f,
}

fn texels_at(place: ShadowPlace, plane: Plane, first: vec2f) -> Texels {
    let middle = clamp(first + 1.0, place.low, place.high);
    let depths = textureGather(shadow_maps, shadow_sampler, middle / view.shadow_side, plane.layer).wzxy;
    let depth = plane.depth + dot(plane.slope, middle - 0.5 - place.at);
    let off = first + 0.5 - place.at;
    return Texels(
        depths,
        depth + vec4f(0.0, plane.slope.x, plane.slope.y, plane.slope.x + plane.slope.y),
        off.x + vec4f(0.0, 1.0, 0.0, 1.0),
        off.y + vec4f(0.0, 0.0, 1.0, 1.0),
    );
}

// Whether what casts there is nearer to the light than the receiver's plane, and within the cone that the light is seen
// in from the receiver.
fn in_the_way(texels: Texels, place: ShadowPlace) -> vec4<bool> {
    let reach = NARROWEST + 0.5 + place.spread * (texels.depths - place.depth);
    return select(
        vec4<bool>(false),
        max(abs(texels.x), abs(texels.y)) <= reach,
        texels.depths > texels.plane,
    );
}

// How much of a light is seen, as its record tells: of a lamp in its layer, of a directional light in one level or two.
// Drivers on the processor run both sides of a branch, so what they share is one loop, and its end is asked for last.
fn visibility(arriving: Arriving, bump: Bump, number: u32) -> f32 {
    if arriving.shadow_layer == 0u {
        return 1.0;
    }
    let record = texel_of(view.shadow_records + arriving.shadow_layer - 1u);
    let point = receiver(bump, arriving.toward);
    let is_sun = SUNS_WITH_SHADOWS && (!LAMPS_WITH_SHADOWS || arriving.kind == LIGHT_DIRECTIONAL);
    let surface = point - arriving.from_eye;
    // Its third is 0: there is the layer of a lamp.
    let q = vec4f(unpack2x16snorm(record.x), 0.0, unpack2x16snorm(record.y).y);
    let lamp_layer = record.y & 0xffffu;
    var is_turned_away = false;
    var place: ShadowPlace;
    if LAMPS_WITH_SHADOWS {
        is_turned_away = dot(receiver_normal, surface) >= 0.0;
        place = place_of_lamp(surface, q, record);
    }
    let sun_size = size_of(record.w >> 16u);
    if !SUNS_WITH_SHADOWS {
        return faded(lit_share(place, lamp_layer), is_turned_away, fade_of(record));
    }
    // In the light's frame, from the eye.
    let p = turned(q, point);
    let normal = turned(q, receiver_normal);
    let across = max(abs(p.x), abs(p.y)) / (view.shadow_side * (0.5 * FIRST_TEXEL * LEVEL_USED));
    var level = u32(max(ceil(log2(max(across, 1e-3))), 0.0));
    // What of the sum is still to be found.
    var rest = 1.0;
    var seen = 0.0;
    loop {
        var share = 1.0;
        var layer = lamp_layer;
        var is_known = true;
        if is_sun {
            let of_level = texel_of(view.shadow_records + (record.z & 0xffffu) + level);
            layer = of_level.w;
            // Nothing is known beyond the last level.
            is_known = level < (record.z >> 16u);
            let size = exp2(f32(level));
            place = place_in_level(p, normal, bitcast<vec3f>(of_level.xyz), size, sun_size);
            share = select(1.0, saturate((1.0 - across / size) / (1.0 - LEVEL_ALONE)), is_known);
        }
        seen += rest * share * select(1.0, lit_share(place, layer), is_known);
        rest -= rest * share;
        level++;
        // What is no number ends it, too.
        if !(rest > 0.0) {
            break;
        }
    }
    return faded(seen, select(is_turned_away, normal.z <= 0.0, is_sun), fade_of(record));
}

// A triangle that is turned away sees nothing of the light, whatever its bumps would mirror.
fn faded(seen: f32, is_turned_away: bool, fade: f32) -> f32 {
    return 1.0 + fade * (select(seen, 0.0, is_turned_away) - 1.0);
}

fn fade_of(record: vec4u) -> f32 {
    return f32(record.w & 0xffffu) / 65535.0;
}

// Of the square that takes the place of a light's disc, whose size is the lower half of a word, as the upper half of a
// float.
fn size_of(word: u32) -> f32 {
    return SQUARE * bitcast<f32>(word << 16u);
}

// `surface`: from the light.
fn place_of_lamp(surface: vec3f, q: vec4f, record: vec4u) -> ShadowPlace {
    let near = bitcast<f32>(record.w & 0xffff0000u);
    let scale = bitcast<f32>(record.z & 0xffff0000u);
    let size = size_of(record.z);
    // The caster may be off by half a texel more.
    let of_small_face = view.shadow_side / 6.0 - SHADOW_GUTTER;
    let texel = length(surface) / select(of_small_face, scale, scale > 0.0);
    let rise = select(0.0, receiver_error + 0.5 * texel, receiver_error > 0.0);
    let v = surface + receiver_normal * rise;
    // At the least a grazing plane: a point that is on the light's plane has depths of all sizes.
    let grazing = min(dot(receiver_normal, v), -1e-6);
    if LIGHTS_WITH_CONES && scale > 0.0 {
        return place_in_cone(v, receiver_normal, grazing, near, q, scale, size);
    }
    return place_in_faces(v, receiver_normal, grazing, near, size);
}

// `p`: from the eye, `eye`: from the level's middle, both in the light's frame, as is `normal`. `size`: in widths of
// the first level.
fn place_in_level(p: vec3f, normal: vec3f, eye: vec3f, size: f32, light_size: f32) -> ShadowPlace {
    let texel = FIRST_TEXEL * size;
    // The caster may be off by half a texel more.
    let rise = select(0.0, receiver_error + 0.5 * texel, receiver_error > 0.0);
    let v = p + eye + normal * rise;
    // How depth changes across the rays: at the least a grazing plane.
    let leaning = -normal.xy / max(normal.z, 1e-6);
    return ShadowPlace(
        0.5 * view.shadow_side + vec2f(v.x, -v.y) / texel,
        max(0.5 + v.z / SUN_DEPTH, 0.0),
        vec2f(leaning.x, -leaning.y) * (texel / SUN_DEPTH),
        texel / SUN_DEPTH,
        vec2f(1.0),
        vec2f(view.shadow_side - 1.0),
        light_size * SUN_DEPTH / texel,
        light_size * LIKELY / texel,
    );
}
