// The height map as a surface below (or about) the mesh's own: where a pixel lies in it, rays through it, its horizon.
//
// Directions are taken apart along the image: right (+u), up (−v) and out of the surface toward the side that is seen.
// A sheet that is seen from behind is the same sheet: its heights count the other way.

struct HeightField {
    // Where the pixel is, in the image's UV.
    at: vec2f,
    // Mip level.
    lod: f32,
    layer: u32,
    // World space, unit: image-right, image-up, out of the side that is seen.
    frame: Frame,
    // Image UV per metre toward right and up.
    uv_per_metre: vec2f,
    // Metres in a width of the image, by the area that it covers: texels are square.
    metres: f32,
    // Metres from black to white.
    depth: f32,
    // The height at which the mesh's surface lies.
    rest: f32,
    from_behind: bool,
}

// A place on the height field.
struct FieldPoint {
    // In the image's UV.
    uv: vec2f,
    height: f32,
}

// Rays slanted more than this (cosine to the normal) are followed as if they were not: without a bound they would
// cross the whole image.
const LEAST_COSINE = 0.08;
// Steps of a ray through the field, and of one toward a light.
const MOST_STEPS = 96.0;
const MOST_SHADOW_STEPS = 48.0;
// Half the angle in which a horizon takes a light away, radians.
const HORIZON_SOFTNESS = 0.04;

fn height_field(
    material: Material, map: u32, frame: Frame, uv: ImageUv, dp_dx: vec3f, dp_dy: vec3f, front: bool,
) -> HeightField {
    var field: HeightField;
    field.at = uv.at;
    field.layer = layer_of(material, MAP_HEIGHT);
    let size = vec2f(textureDimensions(height_or_environment_maps));
    let texels = max(length(uv.dx * size), length(uv.dy * size));
    field.lod = max(log2(max(texels, 1e-6)), 0.0);
    field.frame = frame;
    if TRANSFORMED_UVS {
        field.frame = turned_frame(frame, material.image_from_mesh_uv[map]);
    }
    // Columns of the surface's Jacobian, from screen-space derivatives.
    let determinant = uv.dx.x * uv.dy.y - uv.dx.y * uv.dy.x;
    let area = length(cross(dp_dx, dp_dy));
    if abs(determinant) > 1e-20 && area > 1e-20 {
        let along_u = length(dp_dx * uv.dy.y - dp_dy * uv.dx.y) / abs(determinant);
        let unit_area = area / abs(determinant);
        field.uv_per_metre = vec2f(1.0 / along_u, along_u / unit_area);
        let shape = select(size, vec2f(textureDimensions(horizon_0_maps)), map == MAP_HORIZON_0);
        field.metres = sqrt(unit_area * shape.x / shape.y);
    }
    field.depth = material.height_scale_uv * field.metres;
    field.rest = select(1.0 - material.height_rest, material.height_rest, front);
    field.from_behind = !front;
    field.frame.normal = select(-field.frame.normal, field.frame.normal, front);
    return field;
}

// A direction in world space as right, up, out.
fn along_image(field: HeightField, direction: vec3f) -> vec3f {
    let frame = field.frame;
    return vec3f(dot(direction, frame.tangent), dot(direction, frame.bitangent), dot(direction, frame.normal));
}

// The change of the image's UV over so many metres to the right and up.
fn uv_shift(field: HeightField, metres: vec2f) -> vec2f {
    return metres * field.uv_per_metre * vec2f(1.0, -1.0);
}

fn field_height(field: HeightField, uv: vec2f) -> f32 {
    let h = textureSampleLevel(height_or_environment_maps, height_or_environment_sampler, uv, field.layer, field.lod).r;
    return select(h, 1.0 - h, field.from_behind);
}

// Steps that go no further than a texel each.
fn steps_along(field: HeightField, shift: vec2f, most: f32) -> f32 {
    let texels = length(shift * vec2f(textureDimensions(height_or_environment_maps))) * exp2(-field.lod);
    return clamp(ceil(texels), 1.0, most);
}

// Parallax with offset limiting (Welsh: "Parallax Mapping with Offset Limiting", 2004): the UV moves toward the eye by
// the height here times the view vector's part along the surface, not divided by its part out of it.
fn parallax_point(field: HeightField, toward_eye: vec3f) -> FieldPoint {
    let v = along_image(field, toward_eye);
    let height = field_height(field, field.at);
    let shift = uv_shift(field, v.xy * (field.depth * (height - field.rest)));
    return FieldPoint(field.at + shift, height);
}

// Where the ray from the eye meets the height field first: steps of a texel, then regula falsi between the last two
// (Policarpo, Oliveira, Comba: "Real-Time Relief Mapping on Arbitrary Polygonal Surfaces", I3D 2005; Tatarchuk:
// "Dynamic Parallax Occlusion Mapping", I3D 2006).
fn relief_point(field: HeightField, toward_eye: vec3f) -> FieldPoint {
    let v = along_image(field, toward_eye);
    // Change of UV per unit of height along the ray.
    let slope = uv_shift(field, v.xy * (field.depth / max(v.z, LEAST_COSINE)));
    var above = 1.0;
    var over = 1.0 - field_height(field, field.at + (1.0 - field.rest) * slope);
    if over <= 0.0 {
        return FieldPoint(field.at + (1.0 - field.rest) * slope, 1.0);
    }
    let steps = steps_along(field, slope, MOST_STEPS);
    var below = 0.0;
    var under = 0.0;
    for (var i = 1.0; i <= steps; i += 1.0) {
        below = 1.0 - i / steps;
        under = below - field_height(field, field.at + (below - field.rest) * slope);
        if under <= 0.0 {
            break;
        }
        above = below;
        over = under;
    }
    var height = 0.0;
    for (var i = 0; i < 3; i++) {
        height = above - (above - below) * over / max(over - under, 1e-9);
        let distance = height - field_height(field, field.at + (height - field.rest) * slope);
        if distance > 0.0 {
            above = height;
            over = distance;
        } else {
            below = height;
            under = distance;
        }
    }
    // On a surface without a step the height there is the height of the ray; where it is flat, exactly.
    let there = field_height(field, field.at + (height - field.rest) * slope);
    height = select(height, there, abs(there - height) < 1e-3);
    return FieldPoint(field.at + (height - field.rest) * slope, height);
}

// Where a point of the field that the eye sees through `position` on the mesh lies, from the eye as that.
fn displaced(field: HeightField, position: vec3f, height: f32, toward_eye: vec3f) -> vec3f {
    let cosine = max(dot(toward_eye, field.frame.normal), LEAST_COSINE);
    return position + toward_eye * ((height - field.rest) * field.depth / cosine);
}

// How much of a light a horizon lets through. `horizon`: its slope (tangent of the elevation), `light`: the direction
// to the light as right, up, out. A flat field's horizon, 0, takes nothing from a light above it.
fn over_horizon(horizon: f32, light: vec3f) -> f32 {
    let elevation = atan2(light.z, length(light.xy));
    let edge = atan(horizon);
    return smoothstep(edge - HORIZON_SOFTNESS, edge + min(HORIZON_SOFTNESS, edge), elevation);
}

// The slope of the horizon from a point of the field toward a light, by a march: no further than where nothing can be
// as high as the light any more.
fn marched_horizon(field: HeightField, point: FieldPoint, light: vec3f) -> f32 {
    let flat_length = length(light.xy);
    let rise = (1.0 - point.height) * field.depth;
    if rise <= 0.0 || flat_length < 1e-4 {
        return 0.0;
    }
    let lowest = tan(max(atan2(light.z, flat_length) - HORIZON_SOFTNESS, HORIZON_SOFTNESS));
    let reach = rise / lowest;
    let shift = uv_shift(field, light.xy / flat_length * reach);
    let steps = steps_along(field, shift, MOST_SHADOW_STEPS);
    var steepest = 0.0;
    for (var i = 1.0; i <= steps; i += 1.0) {
        let part = i / steps;
        let higher = field_height(field, point.uv + part * shift) - point.height;
        steepest = max(steepest, higher / part);
    }
    return steepest * field.depth / reach;
}

// The same from the horizon maps (Sloan, Cohen: "Interactive Horizon Mapping", 2000): elevations in eight directions,
// between which the light's is interpolated. They were made for texels of equal sides; a stretched surface has other
// directions and slopes.
fn mapped_horizon(field: HeightField, elevations: array<vec4f, 2>, light: vec3f) -> f32 {
    let flat_length = length(light.xy);
    // In widths of the image.
    let size = vec2f(textureDimensions(horizon_0_maps));
    let across = light.xy * field.uv_per_metre * vec2f(1.0, size.y / size.x);
    let across_length = length(across);
    if field.from_behind || flat_length < 1e-4 || across_length <= 0.0 {
        return 0.0;
    }
    let eighth = fract(atan2(across.y, across.x) / (2.0 * PI) + 1.0) * 8.0;
    let first = u32(eighth) % 8u;
    let second = (first + 1u) % 8u;
    let elevation = mix(elevations[first / 4u][first % 4u], elevations[second / 4u][second % 4u], fract(eighth));
    return tan(min(elevation, 0.999) * 0.5 * PI) * field.metres * across_length / flat_length;
}
