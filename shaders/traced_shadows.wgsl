// How much of each light the surfaces of each pixel see, as rays found it: for measuring shadows. Takes the place of
// unshadowed.wgsl.

// src/renderer/shadows/traced.rs says how the words are laid out.
@group(3) @binding(0) var<storage, read> traced: array<u32>;

// Set in the second word of a surface that another one of the pixel follows.
const ANOTHER_SURFACE = 0x80000000u;

// The word with the first shares of the surface that is shaded; 0 where no ray met it.
var<private> light_shares: u32;

fn find_shadows(in: VertexOut, dp_dx: vec3f, dp_dy: vec3f) {
    let at = vec2u(in.clip_position.xy);
    var surface = traced[1u + at.y * traced[0] + at.x];
    light_shares = 0u;
    loop {
        if surface == 0u {
            break;
        }
        let shares = surface + 2u;
        if traced[surface] == (in.slot & ~COARSE) {
            light_shares = shares;
            break;
        }
        let words = traced[surface + 1u];
        surface = select(0u, shares + (words & ~ANOTHER_SURFACE), (words & ANOTHER_SURFACE) != 0u);
    }
}

fn visibility(arriving: Arriving, bump: Bump, number: u32) -> f32 {
    if light_shares == 0u {
        return 1.0;
    }
    return f32((traced[light_shares + number / 4u] >> (8u * (number % 4u))) & 255u) / 255.0;
}
