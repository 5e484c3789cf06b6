// The bump techniques: each turns the interpolated frame and the maps into the shading normal. A technique is chosen
// when a pipeline is made (override TECHNIQUE), so the others cost nothing.

const TECHNIQUE_OFF = 0u;
const TECHNIQUE_NORMAL = 1u;
const TECHNIQUE_PERTURBED_NORMAL = 2u;
const TECHNIQUE_EMBOSS = 3u;
const TECHNIQUE_EMBOSS_MULTIPASS = 4u;
const TECHNIQUE_DOT3 = 5u;
const TECHNIQUE_DOT3_CONSTANT = 6u;
const TECHNIQUE_PERTURBED_UV = 7u;
const TECHNIQUE_PARALLAX = 8u;
const TECHNIQUE_RELIEF = 9u;
const TECHNIQUE_HORIZON = 10u;
const TECHNIQUE_PARALLAX_HORIZON = 11u;
const TECHNIQUE_RELIEF_HORIZON = 12u;
const TECHNIQUE_Z_CORRECT_PARALLAX = 13u;
const TECHNIQUE_Z_CORRECT = 14u;
const TECHNIQUE_COMBINED = 15u;

override TECHNIQUE: u32 = 1u;

// What the techniques are made of.
fn is_parallax() -> bool {
    return TECHNIQUE == TECHNIQUE_PARALLAX
        || TECHNIQUE == TECHNIQUE_PARALLAX_HORIZON
        || TECHNIQUE == TECHNIQUE_Z_CORRECT_PARALLAX;
}

fn is_relief() -> bool {
    return TECHNIQUE == TECHNIQUE_RELIEF
        || TECHNIQUE == TECHNIQUE_RELIEF_HORIZON
        || TECHNIQUE == TECHNIQUE_Z_CORRECT
        || TECHNIQUE == TECHNIQUE_COMBINED;
}

// Shadows by the horizon maps.
fn has_mapped_horizon() -> bool {
    return TECHNIQUE == TECHNIQUE_HORIZON
        || TECHNIQUE == TECHNIQUE_PARALLAX_HORIZON
        || TECHNIQUE == TECHNIQUE_RELIEF_HORIZON
        || TECHNIQUE == TECHNIQUE_COMBINED;
}

// Shadows by a march toward each light.
fn has_marched_horizon() -> bool {
    return TECHNIQUE == TECHNIQUE_RELIEF || TECHNIQUE == TECHNIQUE_Z_CORRECT;
}

fn is_emboss() -> bool {
    return TECHNIQUE == TECHNIQUE_EMBOSS || TECHNIQUE == TECHNIQUE_EMBOSS_MULTIPASS;
}

fn is_dot3() -> bool {
    return TECHNIQUE == TECHNIQUE_DOT3 || TECHNIQUE == TECHNIQUE_DOT3_CONSTANT;
}

struct Frame {
    // World space, unit, orthogonal; bitangent toward image-up.
    tangent: vec3f,
    bitangent: vec3f,
    normal: vec3f,
}

// glTF 2.0, 3.7.2.1: B = cross(N, T) · w, after making T orthogonal to the interpolated N.
fn tangent_frame(normal: vec3f, tangent: vec4f) -> Frame {
    let n = normalize(normal);
    let t = normalize(tangent.xyz - n * dot(n, tangent.xyz));
    return Frame(t, cross(n, t) * tangent.w, n);
}

// The frame along the axes of the image where a UV transform turns or mirrors it. T lies along the mesh's +u and B
// along its −v, so the image's axes are the columns of the inverse of the transform, taken in that frame. Lengths do
// not count: a texture that repeats twice as often is as steep.
fn turned_frame(frame: Frame, image_from_mesh_uv: vec4f) -> Frame {
    let m = image_from_mesh_uv; // columns (m.x, m.y), (m.z, m.w)
    let determinant = m.x * m.w - m.z * m.y;
    if determinant == 0.0 {
        return frame;
    }
    let side = select(1.0, -1.0, determinant < 0.0);
    let t = side * (frame.tangent * m.w + frame.bitangent * m.y);
    let b = side * (frame.tangent * m.z + frame.bitangent * m.x);
    return Frame(normalize(t), normalize(b), frame.normal);
}

// A texel of the normal map as a unit vector: 2·rgb − 1, its xy scaled.
fn tangent_space_normal(texel: vec3f, scale: f32) -> vec3f {
    var n = texel * 2.0 - 1.0;
    n = vec3f(n.xy * scale, n.z);
    return normalize(n);
}

fn normal_mapped(frame: Frame, texel: vec3f, scale: f32) -> vec3f {
    let n = tangent_space_normal(texel, scale);
    return normalize(frame.tangent * n.x + frame.bitangent * n.y + frame.normal * n.z);
}

// Blinn 1978 in Mikkelsen's form ("Bump Mapping Unparametrized Surfaces on the GPU", 2010): the surface gradient of a
// height, from screen-space derivatives, so no tangents are needed. dp_*: position; dh_*: height in metres, per pixel.
fn perturbed_normal(normal: vec3f, dp_dx: vec3f, dp_dy: vec3f, dh_dx: f32, dh_dy: f32) -> vec3f {
    let n = normalize(normal);
    let r1 = cross(dp_dy, n);
    let r2 = cross(n, dp_dx);
    let determinant = dot(dp_dx, r1);
    let gradient = sign(determinant) * (dh_dx * r1 + dh_dy * r2);
    let bumped = abs(determinant) * n - gradient;
    return select(n, normalize(bumped), dot(bumped, bumped) > 0.0);
}
