// The sky: a gradient between zenith, horizon and ground. Drawn behind everything, and what metals mirror.

fn sky_radiance(direction: vec3f) -> vec3f {
    let up = mix(view.horizon, view.zenith, sqrt(clamp(direction.y, 0.0, 1.0)));
    return mix(up, view.ground, smoothstep(0.0, 0.15, -direction.y));
}

// What a rough surface mirrors: the gradient, blurred toward the mean of each half as roughness grows.
fn sky_blurred(direction: vec3f, roughness: f32) -> vec3f {
    let half_and_half = mix(view.ground, 0.5 * (view.zenith + view.horizon), 0.5 + 0.5 * direction.y);
    return mix(sky_radiance(direction), half_and_half, roughness);
}
