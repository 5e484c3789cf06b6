// Environment-mapped bump mapping ("perturbed UV"; the bump environment of Direct3D 6): an offset per texel moves the
// place where a picture of the surroundings is read.

// The surroundings in a direction: the material's picture all around, or the sky. Blur 0..1.
fn environment(material: Material, direction: vec3f, blur: f32) -> vec3f {
    if !ENVIRONMENT_MAP {
        return sky_mirrored(direction, blur);
    }
    // Equirectangular: −Z in the middle, +X to its right.
    let level = blur * f32(textureNumLevels(height_or_environment_maps) - 1u);
    // The poles do not continue on the other side: no row is blended with the one that a repeated image has there.
    let half_row = min(0.5 * exp2(ceil(level)) / f32(textureDimensions(height_or_environment_maps).y), 0.5);
    let down = clamp(acos(clamp(direction.y, -1.0, 1.0)) / PI, half_row, 1.0 - half_row);
    let uv = vec2f(atan2(direction.x, -direction.z) / (2.0 * PI) + 0.5, down);
    let layer = layer_of(material, MAP_ENVIRONMENT);
    return textureSampleLevel(height_or_environment_maps, height_or_environment_sampler, uv, layer, level).rgb;
}

// The look-up is a place on the disc that a mirroring ball shows to the eye: the part of the normal across the line of
// sight. The offset moves it there; what lies at the new place is in the direction returned.
fn shifted_mirror(surface: Surface, offset: vec3f) -> vec3f {
    let eye = surface.toward_eye;
    let place = surface.normal + offset;
    var across = place - eye * dot(place, eye);
    across *= min(1.0, 0.999 / max(length(across), 1e-6));
    let cosine = sqrt(1.0 - dot(across, across));
    return 2.0 * cosine * (across + eye * cosine) - eye;
}

// What lies behind the surface, read where the offset moves the pixel: by as much as the surface is thick, which is
// its height map's depth. Not what is really behind that place if something stands in front of it.
fn refracted(in: VertexOut, material: Material, offset: vec3f, dp_dx: vec3f, dp_dy: vec3f, uvs: Uvs) -> vec3f {
    let uv = image_uv(material, MAP_OFFSET, uvs);
    let width = image_width(uv, dp_dx, dp_dy, vec2f(textureDimensions(normal_or_offset_maps)));
    let thickness = material.height_scale_uv * width;
    let here = view.clip_from_eye * vec4f(in.position, 1.0);
    let there = view.clip_from_eye * vec4f(in.position + offset * thickness, 1.0);
    let size = vec2f(textureDimensions(scene_color));
    // Behind the eye there is nothing to read.
    let moved = select(vec2f(0.0), there.xy / there.w - here.xy / here.w, there.w > 0.0) * vec2f(0.5, -0.5) * size;
    let last = vec2i(size) - 1;
    let place = in.clip_position.xy + moved - 0.5;
    let corner = vec2i(floor(place));
    let part = place - floor(place);
    let zero = vec2i(0);
    let a = textureLoad(scene_color, clamp(corner, zero, last), 0).rgb;
    let b = textureLoad(scene_color, clamp(corner + vec2i(1, 0), zero, last), 0).rgb;
    let c = textureLoad(scene_color, clamp(corner + vec2i(0, 1), zero, last), 0).rgb;
    let d = textureLoad(scene_color, clamp(corner + vec2i(1, 1), zero, last), 0).rgb;
    return mix(mix(a, b, part.x), mix(c, d, part.x), part.y);
}
