// The sky: drawn behind everything, what metals mirror, and light from all sides. It is a gradient between zenith,
// horizon and ground, or an atmosphere, of which there is a map.

override ATMOSPHERE: bool = false;

// In units of light of the world, as systems/draw/sky.rs makes them.
struct Sky {
    harmonics: array<vec4f, 9>,
    ground: vec3f,
    unit: f32,
    // Unit vectors toward the discs, and their radii, radians.
    sun: vec4f,
    sun_radiance: vec4f,
    moon: vec4f,
    moon_radiance: vec4f,
    // Diffuse light from above, of the sky alone.
    up: vec3f,
    pad0: u32,
    // World space of the first brick of openness, and the bricks along each axis of their textures.
    openness_origin: vec3f,
    // The grid of movers: its first cell's texel.
    movers_first: u32,
    openness_bricks: vec3u,
    // Metres along a side of a cell, X and Z of its corner, cells along both.
    movers_cell: f32,
    movers_origin: vec2f,
    movers_cells: vec2u,
}

@group(0) @binding(3) var<uniform> sky: Sky;
@group(0) @binding(4) var sky_maps: texture_2d_array<f32>;
@group(0) @binding(5) var sky_sampler: sampler;

// Layers of the map: the upper half, and the sphere, blurred from level to level.
const SKY_HEMISPHERE = 0u;
const SKY_SPHERE = 1u;
const SKY_LEVELS = 5u;

// Without the discs of sun and moon.
fn sky_radiance(direction: vec3f) -> vec3f {
    if ATMOSPHERE {
        let on = direction / dot(abs(direction), vec3f(1.0));
        let uv = 0.5 + 0.5 * vec2f(on.x + on.z, on.x - on.z);
        let upper = textureSampleLevel(sky_maps, sky_sampler, uv, SKY_HEMISPHERE, 0.0).rgb * sky.unit;
        return select(upper, sky.ground, direction.y < 0.0);
    }
    let up = mix(view.horizon, view.zenith, sqrt(clamp(direction.y, 0.0, 1.0)));
    return mix(up, view.ground, smoothstep(0.0, 0.15, -direction.y));
}

// What a rough surface mirrors: a blurred map, or the gradient, blurred toward the mean of each half as roughness grows.
fn sky_blurred(direction: vec3f, roughness: f32) -> vec3f {
    if ATMOSPHERE {
        let on = direction / dot(abs(direction), vec3f(1.0));
        let folded = (1.0 - abs(on.zx)) * select(vec2f(-1.0), vec2f(1.0), on.xz >= vec2f(0.0));
        let uv = 0.5 + 0.5 * select(on.xz, folded, on.y < 0.0);
        let level = roughness * f32(SKY_LEVELS - 1u);
        return textureSampleLevel(sky_maps, sky_sampler, uv, SKY_SPHERE, level).rgb * sky.unit;
    }
    let half_and_half = mix(view.ground, 0.5 * (view.zenith + view.horizon), 0.5 + 0.5 * direction.y);
    return mix(sky_radiance(direction), half_and_half, roughness);
}

// The light of both halves on a surface that sees all of it: what a white one shows.
fn whole_diffuse(n: vec3f) -> vec3f {
    let linear = sky.harmonics[1].rgb * n.y + sky.harmonics[2].rgb * n.z + sky.harmonics[3].rgb * n.x;
    let products = sky.harmonics[4].rgb * (n.x * n.y) + sky.harmonics[5].rgb * (n.y * n.z)
        + sky.harmonics[7].rgb * (n.x * n.z);
    let squares = sky.harmonics[6].rgb * (3.0 * n.z * n.z - 1.0) + sky.harmonics[8].rgb * (n.x * n.x - n.y * n.y);
    return max(sky.harmonics[0].rgb + linear + products + squares, vec3f(0.0));
}
