// The tone curves, from linear colours, which are exposed already, to 0..1 linear.

const TONE_MAP_CLAMP = 0u;
const TONE_MAP_ACES = 1u;
const TONE_MAP_AGX = 2u;

override TONE_MAP: u32 = TONE_MAP_CLAMP;

// Narkowicz 2016, "ACES Filmic Tone Mapping Curve".
fn aces(x: vec3f) -> vec3f {
    return saturate((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14));
}

// Troy Sobotka's AgX in the compact form of Benjamin Wrensch ("Minimal AgX Implementation", 2023): into the AgX
// primaries, log2 between −12.47 and 4.03 EV, a sixth-order fit of the sigmoid, and back.
fn agx(color: vec3f) -> vec3f {
    let agx_from_linear = mat3x3f(
        0.842479062253094, 0.0423282422610123, 0.0423756549057051,
        0.0784335999999992, 0.878468636469772, 0.0784336,
        0.0792237451477643, 0.0791661274605434, 0.879142973793104,
    );
    let linear_from_agx = mat3x3f(
        1.19687900512017, -0.0528968517574562, -0.0529716355144438,
        -0.0980208811401368, 1.15190312990417, -0.0980434501171241,
        -0.0990297440797205, -0.0989611768448433, 1.15107367264116,
    );
    let low = -12.47393;
    let high = 4.026069;
    let x = saturate((log2(max(agx_from_linear * color, vec3f(1e-10))) - low) / (high - low));
    let x2 = x * x;
    let x4 = x2 * x2;
    let curve = 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232;
    return pow(saturate(linear_from_agx * curve), vec3f(2.2));
}

fn tone_mapped(linear: vec3f) -> vec3f {
    var color = max(linear, vec3f(0.0));
    if TONE_MAP == TONE_MAP_ACES {
        color = aces(color);
    } else if TONE_MAP == TONE_MAP_AGX {
        color = agx(color);
    }
    return saturate(color);
}
