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
    let toward = normalize(direction);
    var color = sky_radiance(toward);
    if ATMOSPHERE {
        color += disc(toward, sky.sun, sky.sun_radiance.rgb) + disc(toward, sky.moon, sky.moon_radiance.rgb);
    }
    return vec4f(exposed(color), 1.0);
}

// The disc of sun or moon above the horizon, its edge as wide as a pixel.
fn disc(toward: vec3f, place: vec4f, radiance: vec3f) -> vec3f {
    let away = toward - place.xyz;
    let angle = length(away);
    let pixel = max(fwidth(angle), 1e-6);
    let inside = saturate((place.w - angle) / pixel + 0.5);
    return select(vec3f(0.0), radiance * inside, toward.y > 0.0);
}
