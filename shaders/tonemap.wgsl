// From the HDR target to the screen. The target's format encodes to sRGB.

@group(0) @binding(0) var hdr: texture_2d<f32>;

@vertex
fn vs_tonemap(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn fs_tonemap(@builtin(position) position: vec4f) -> @location(0) vec4f {
    return vec4f(tone_mapped(textureLoad(hdr, vec2i(position.xy), 0).rgb), 1.0);
}
