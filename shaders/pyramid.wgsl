// The depth pyramid: each texel of a level holds the farthest depth of the four below it (reversed depth: the
// smallest). Level 0 has a texel for 2×2 pixels. Sizes are rounded up to powers of two, so a texel of level L stands
// for exactly the pixels [x·2^(L+1), (x+1)·2^(L+1)); beyond the picture's edge its last pixels are repeated.

@group(0) @binding(0) var single: texture_depth_2d;
@group(0) @binding(1) var multisampled: texture_depth_multisampled_2d;
@group(0) @binding(2) var finer: texture_2d<f32>;
@group(0) @binding(3) var coarser: texture_storage_2d<r32float, write>;

fn farthest(depths: vec4f) -> f32 {
    return min(min(depths.x, depths.y), min(depths.z, depths.w));
}

fn single_depth(pixel: vec2u) -> f32 {
    return textureLoad(single, min(pixel, textureDimensions(single) - 1u), 0);
}

@compute @workgroup_size(8, 8)
fn from_single(@builtin(global_invocation_id) id: vec3u) {
    let p = id.xy * 2u;
    let depths = vec4f(
        single_depth(p),
        single_depth(p + vec2u(1u, 0u)),
        single_depth(p + vec2u(0u, 1u)),
        single_depth(p + 1u),
    );
    textureStore(coarser, id.xy, vec4f(farthest(depths)));
}

fn multisampled_depth(pixel: vec2u) -> f32 {
    let p = min(pixel, textureDimensions(multisampled) - 1u);
    var depth = textureLoad(multisampled, p, 0);
    for (var i = 1u; i < textureNumSamples(multisampled); i++) {
        depth = min(depth, textureLoad(multisampled, p, i));
    }
    return depth;
}

@compute @workgroup_size(8, 8)
fn from_multisampled(@builtin(global_invocation_id) id: vec3u) {
    let p = id.xy * 2u;
    let depths = vec4f(
        multisampled_depth(p),
        multisampled_depth(p + vec2u(1u, 0u)),
        multisampled_depth(p + vec2u(0u, 1u)),
        multisampled_depth(p + 1u),
    );
    textureStore(coarser, id.xy, vec4f(farthest(depths)));
}

@compute @workgroup_size(8, 8)
fn from_finer(@builtin(global_invocation_id) id: vec3u) {
    // A level may be one texel wide while it is still many high.
    let last = textureDimensions(finer) - 1u;
    let p = id.xy * 2u;
    let depths = vec4f(
        textureLoad(finer, min(p, last), 0).r,
        textureLoad(finer, min(p + vec2u(1u, 0u), last), 0).r,
        textureLoad(finer, min(p + vec2u(0u, 1u), last), 0).r,
        textureLoad(finer, min(p + 1u, last), 0).r,
    );
    textureStore(coarser, id.xy, vec4f(farthest(depths)));
}
