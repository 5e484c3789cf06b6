// One triangle over the whole target, at infinity.

struct SkyVertex {
    @invariant @builtin(position) clip_position: vec4f,
    @location(0) ndc: vec2f,
}

@vertex
fn vs_sky(@builtin(vertex_index) index: u32) -> SkyVertex {
    let ndc = vec2f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0);
    return SkyVertex(vec4f(ndc, 0.0, 1.0), ndc);
}

@fragment
fn fs_sky(in: SkyVertex) -> @location(0) vec4f {
    let near = view.eye_from_clip * vec4f(in.ndc, 1.0, 1.0);
    let direction = select(near.xyz / near.w, -view.toward_eye, view.parallel == 1u);
    return vec4f(exposed(sky_radiance(normalize(direction))), 1.0);
}
