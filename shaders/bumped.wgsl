// What a technique makes of a pixel before it is lit: where maps are read, where the surface is, and its normal. The
// one place where techniques part; they meet again in forward.wgsl, in `reflected`.

// What a technique makes of a pixel before any light is added.
struct Bump {
    // Where maps are read.
    uvs: Uvs,
    // Of the surface, world space: where it is lit.
    position: vec3f,
    // Shading normal, toward the side that is seen.
    normal: vec3f,
    field: HeightField,
    // Of relief and parallax, else the pixel itself.
    point: FieldPoint,
    elevations: array<vec4f, 2>,
    // dot3: as the normal map has it, in tangent space; with the constant vector in world space.
    packed_normal: vec3f,
    // The frame of that tangent space.
    frame: Frame,
    // Specular antialiasing: the variance of the slopes that the normal map's texel is the mean of.
    slopes: f32,
    // perturbed_uv: how far the surface's offset goes, world space, along the surface.
    offset: vec3f,
    slot: u32,
}

// `dp_dx`, `dp_dy`: change of the position to the next pixel.
fn bumped(material: Material, in: VertexOut, uvs: Uvs, dp_dx: vec3f, dp_dy: vec3f, front: bool) -> Bump {
    var bump: Bump;
    bump.uvs = uvs;
    bump.position = in.position;
    bump.slot = in.slot;
    let side = select(-1.0, 1.0, front);
    var normal = normalize(in.normal);
    let frame = tangent_frame(in.normal, in.tangent);
    if is_emboss() || is_parallax() || is_relief() || has_mapped_horizon() {
        let map = select(MAP_HEIGHT, MAP_HORIZON_0, TECHNIQUE == TECHNIQUE_HORIZON);
        let uv = image_uv(material, map, uvs);
        bump.field = height_field(material, map, frame, uv, dp_dx, dp_dy, front);
        bump.point = FieldPoint(uv.at, bump.field.rest);
        if is_parallax() || is_relief() {
            let eye = toward_eye(in.position);
            if is_relief() {
                bump.point = relief_point(bump.field, eye);
            } else {
                bump.point = parallax_point(bump.field, eye);
            }
            bump.position = displaced(bump.field, in.position, bump.point.height, eye);
            bump.uvs.at = shifted(material, uvs.at, bump.point.uv - uv.at);
        }
        if has_mapped_horizon() {
            bump.elevations[0] = sample(horizon_0_maps, horizon_0_sampler, material, MAP_HORIZON_0, bump.uvs);
            bump.elevations[1] = sample(horizon_1_maps, horizon_1_sampler, material, MAP_HORIZON_1, bump.uvs);
        }
    }
    if TECHNIQUE == TECHNIQUE_PERTURBED_NORMAL {
        normal = perturbed(material, in.normal, image_uv(material, MAP_HEIGHT, uvs), dp_dx, dp_dy);
    } else if TECHNIQUE == TECHNIQUE_PERTURBED_UV {
        bump.offset = environment_offset(material, frame, uvs);
    } else if TECHNIQUE != TECHNIQUE_OFF && !is_emboss() {
        let texel = sample(normal_or_offset_maps, normal_or_offset_sampler, material, MAP_NORMAL, bump.uvs);
        bump.slopes = averaged_slopes(texel.a, material.normal_scale);
        var turned = frame;
        if TRANSFORMED_UVS {
            turned = turned_frame(frame, material.image_from_mesh_uv[MAP_NORMAL]);
        }
        normal = normal_mapped(turned, texel.xyz, material.normal_scale);
        if is_dot3() {
            let n = side * unpacked(texel.xyz) * vec3f(vec2f(material.normal_scale), 1.0);
            if TECHNIQUE == TECHNIQUE_DOT3 {
                bump.packed_normal = n;
                bump.frame = turned;
            } else {
                bump.packed_normal = turned.tangent * n.x + turned.bitangent * n.y + turned.normal * n.z;
            }
        }
    }
    bump.normal = side * normal;
    return bump;
}

// The mesh's UVs where the height map's are shifted by so much; the other set stays.
fn shifted(material: Material, at: vec4f, shift: vec2f) -> vec4f {
    if !TRANSFORMED_UVS {
        return vec4f(at.xy + shift, at.zw);
    }
    let m = material.image_from_mesh_uv[MAP_HEIGHT];
    let determinant = m.x * m.w - m.y * m.z;
    let of_mesh = mat2x2f(m.w, -m.y, -m.z, m.x) * shift / select(determinant, 1.0, determinant == 0.0);
    if ((material.second_uvs >> MAP_HEIGHT) & 1u) == 1u {
        return vec4f(at.xy, at.zw + of_mesh);
    }
    return vec4f(at.xy + of_mesh, at.zw);
}

fn height(layer: u32, uv: vec2f, dx: vec2f, dy: vec2f) -> f32 {
    return textureSampleGrad(height_or_environment_maps, height_or_environment_sampler, uv, layer, dx, dy).r;
}

// Metres in a width of the image, by the area that it covers; 0 on a mesh without UVs. `size`: its texels, which are
// square.
fn image_width(uv: ImageUv, dp_dx: vec3f, dp_dy: vec3f, size: vec2f) -> f32 {
    let area = length(cross(dp_dx, dp_dy));
    let area_uv = abs(uv.dx.x * uv.dy.y - uv.dx.y * uv.dy.x);
    return select(0.0, sqrt(area / area_uv * size.x / size.y), area_uv > 1e-20);
}

// The perturbed normal: heights half a pixel away on either side.
fn perturbed(material: Material, normal: vec3f, uv: ImageUv, dp_dx: vec3f, dp_dy: vec3f) -> vec3f {
    let layer = layer_of(material, MAP_HEIGHT);
    let size = vec2f(textureDimensions(height_or_environment_maps));
    let scale = material.height_scale_uv * image_width(uv, dp_dx, dp_dy, size);
    let dx = 0.5 * uv.dx;
    let dy = 0.5 * uv.dy;
    let across = height(layer, uv.at + dx, uv.dx, uv.dy) - height(layer, uv.at - dx, uv.dx, uv.dy);
    let down = height(layer, uv.at + dy, uv.dx, uv.dy) - height(layer, uv.at - dy, uv.dx, uv.dy);
    return perturbed_normal(normal, dp_dx, dp_dy, scale * across, scale * down);
}

// The offset map's texel through the material's matrix, along the surface in world space.
fn environment_offset(material: Material, frame: Frame, uvs: Uvs) -> vec3f {
    let texel = sample(normal_or_offset_maps, normal_or_offset_sampler, material, MAP_OFFSET, uvs).rg;
    // 128 is none, 1 and 255 are −1 and 1.
    let offset = (texel * 255.0 - 128.0) / 127.0;
    let m = material.offset_matrix;
    let shift = vec2f(dot(m.xy, offset), dot(m.zw, offset));
    var turned = frame;
    if TRANSFORMED_UVS {
        turned = turned_frame(frame, material.image_from_mesh_uv[MAP_OFFSET]);
    }
    return turned.tangent * shift.x + turned.bitangent * shift.y;
}
