// The forward pass: objects in batches, each pixel lit by its object's three lights.
//
// The overrides are set when a pipeline is made; see src/renderer/pipelines.rs.

override TECHNIQUE: u32 = 1u;
override SHADING: u32 = 0u;
override ALPHA: u32 = 0u;
override TRANSFORMED_UVS: bool = true;
override EMISSIVE: bool = true;
override VERTEX_COLORS: bool = true;
override LIGHTS: u32 = 0u;

const ALPHA_OPAQUE = 0u;
const ALPHA_MASK = 1u;
const ALPHA_BLEND = 2u;

const LIGHTS_SELECTED = 0u;
const LIGHTS_ALL = 1u;

@group(1) @binding(0) var base_maps: texture_2d_array<f32>;
@group(1) @binding(1) var normal_maps: texture_2d_array<f32>;
@group(1) @binding(2) var specular_maps: texture_2d_array<f32>;
@group(1) @binding(3) var metallic_roughness_maps: texture_2d_array<f32>;
@group(1) @binding(4) var occlusion_maps: texture_2d_array<f32>;
@group(1) @binding(5) var emissive_maps: texture_2d_array<f32>;
@group(1) @binding(6) var height_maps: texture_2d_array<f32>;
@group(1) @binding(7) var horizon_0_maps: texture_2d_array<f32>;
@group(1) @binding(8) var horizon_1_maps: texture_2d_array<f32>;
@group(1) @binding(9) var offset_maps: texture_2d_array<f32>;
@group(1) @binding(10) var environment_maps: texture_2d_array<f32>;
@group(1) @binding(11) var base_sampler: sampler;
@group(1) @binding(12) var normal_sampler: sampler;
@group(1) @binding(13) var specular_sampler: sampler;
@group(1) @binding(14) var metallic_roughness_sampler: sampler;
@group(1) @binding(15) var occlusion_sampler: sampler;
@group(1) @binding(16) var emissive_sampler: sampler;
@group(1) @binding(17) var height_sampler: sampler;
@group(1) @binding(18) var horizon_0_sampler: sampler;
@group(1) @binding(19) var horizon_1_sampler: sampler;
@group(1) @binding(20) var offset_sampler: sampler;
@group(1) @binding(21) var environment_sampler: sampler;

struct VertexIn {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) tangent: vec4f,
    // Both UV sets.
    @location(3) uvs: vec4f,
    @location(4) color: vec4f,
    // Of the instance.
    @location(5) slot: u32,
}

struct VertexOut {
    @builtin(position) clip_position: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) tangent: vec4f,
    @location(3) uvs: vec4f,
    @location(4) color: vec4f,
    @location(5) @interpolate(flat) slot: u32,
}

fn unit_or(v: vec3f, otherwise: vec3f) -> vec3f {
    let squared = dot(v, v);
    return select(otherwise, v * inverseSqrt(max(squared, 1e-38)), squared > 1e-38);
}

@vertex
fn vs_main(in: VertexIn) -> VertexOut {
    let rows = load_world_from_object(in.slot);
    let object = vec4f(in.position, 1.0);
    let position = vec3f(dot(rows[0], object), dot(rows[1], object), dot(rows[2], object));
    // Normals go by the cofactor matrix: det · inverse transpose, its columns cross products of the rows' columns.
    let x = vec3f(rows[0].x, rows[1].x, rows[2].x);
    let y = vec3f(rows[0].y, rows[1].y, rows[2].y);
    let z = vec3f(rows[0].z, rows[1].z, rows[2].z);
    let y_z = cross(y, z);
    // Not sign(): an object flattened to nothing in one direction still has a front.
    let handedness = select(1.0, -1.0, dot(x, y_z) < 0.0);
    let normal = handedness * (y_z * in.normal.x + cross(z, x) * in.normal.y + cross(x, y) * in.normal.z);
    let tangent = x * in.tangent.x + y * in.tangent.y + z * in.tangent.z;
    var out: VertexOut;
    out.clip_position = view.clip_from_world * vec4f(position, 1.0);
    out.position = position;
    out.normal = unit_or(normal, vec3f(0.0, 1.0, 0.0));
    out.tangent = vec4f(unit_or(tangent, vec3f(1.0, 0.0, 0.0)), in.tangent.w * handedness);
    out.uvs = in.uvs;
    out.color = in.color;
    out.slot = in.slot;
    return out;
}

// The mesh's UVs at a pixel with their change to the next pixel. Taken from the interpolated UVs before anything is
// read from a buffer: in the helper pixels at triangle edges some drivers read zeros from buffers, and a difference
// with those would choose the smallest mip level.
struct Uvs {
    at: vec4f,
    dx: vec4f,
    dy: vec4f,
}

struct ImageUv {
    at: vec2f,
    dx: vec2f,
    dy: vec2f,
}

fn image_uv(material: Material, map: u32, uvs: Uvs) -> ImageUv {
    if !TRANSFORMED_UVS {
        return ImageUv(uvs.at.xy, uvs.dx.xy, uvs.dy.xy);
    }
    let m = material.image_from_mesh_uv[map];
    let image_from_mesh = mat2x2f(m.xy, m.zw);
    let second = (material.second_uvs >> map & 1u) == 1u;
    return ImageUv(
        image_from_mesh * select(uvs.at.xy, uvs.at.zw, second) + material.offsets[map],
        image_from_mesh * select(uvs.dx.xy, uvs.dx.zw, second),
        image_from_mesh * select(uvs.dy.xy, uvs.dy.zw, second),
    );
}

fn sample(maps: texture_2d_array<f32>, map_sampler: sampler, material: Material, map: u32, uvs: Uvs) -> vec4f {
    let uv = image_uv(material, map, uvs);
    return textureSampleGrad(maps, map_sampler, uv.at, material.layers[map], uv.dx, uv.dy);
}

fn base_color(material: Material, uvs: Uvs, vertex_color: vec4f) -> vec4f {
    let texel = sample(base_maps, base_sampler, material, MAP_BASE, uvs);
    if VERTEX_COLORS {
        return texel * material.base_factor * vertex_color;
    }
    return texel * material.base_factor;
}

fn height(layer: u32, uv: vec2f, dx: vec2f, dy: vec2f) -> f32 {
    return textureSampleGrad(height_maps, height_sampler, uv, layer, dx, dy).r;
}

fn shading_normal(material: Material, in: VertexOut, uvs: Uvs, front: bool) -> vec3f {
    var normal = normalize(in.normal);
    if TECHNIQUE == TECHNIQUE_NORMAL {
        let texel = sample(normal_maps, normal_sampler, material, MAP_NORMAL, uvs).xyz;
        var frame = tangent_frame(in.normal, in.tangent);
        if TRANSFORMED_UVS {
            frame = turned_frame(frame, material.image_from_mesh_uv[MAP_NORMAL]);
        }
        normal = normal_mapped(frame, texel, material.normal_scale);
    } else if TECHNIQUE == TECHNIQUE_PERTURBED_NORMAL {
        let layer = material.layers[MAP_HEIGHT];
        let uv = image_uv(material, MAP_HEIGHT, uvs);
        let dp_dx = dpdx(in.position);
        let dp_dy = dpdy(in.position);
        // Heights are given in UV units; this many metres are in one.
        let area_uv = abs(uv.dx.x * uv.dy.y - uv.dx.y * uv.dy.x);
        let metres = sqrt(length(cross(dp_dx, dp_dy)) / max(area_uv, 1e-12));
        let scale = material.height_scale_uv * metres;
        let here = height(layer, uv.at, uv.dx, uv.dy);
        let dh_dx = scale * (height(layer, uv.at + uv.dx, uv.dx, uv.dy) - here);
        let dh_dy = scale * (height(layer, uv.at + uv.dy, uv.dx, uv.dy) - here);
        normal = perturbed_normal(in.normal, dp_dx, dp_dy, dh_dx, dh_dy);
    }
    return select(-normal, normal, front);
}

// The material's maps and factors at this pixel; colours only, the caller adds place and direction.
fn surface_at(material: Material, base: vec3f, uvs: Uvs) -> Surface {
    var surface: Surface;
    surface.diffuse = base;
    if SHADING == SHADING_UNLIT {
        return surface;
    }
    let texel = sample(specular_maps, specular_sampler, material, MAP_SPECULAR, uvs);
    let specular = texel.rgb * material.specular_factor;
    surface.specular = specular;
    surface.specular_90 = vec3f(1.0);
    surface.gloss = material.shininess;
    if SHADING == SHADING_SPECULAR_GLOSSINESS {
        // KHR_materials_pbrSpecularGlossiness.
        surface.diffuse = base * (1.0 - max(specular.r, max(specular.g, specular.b)));
        let roughness = 1.0 - saturate(texel.a * material.glossiness);
        surface.gloss = max(roughness * roughness, 1e-3);
    } else if SHADING == SHADING_METALLIC_ROUGHNESS {
        // glTF 2.0, appendix B.3.5, with KHR_materials_specular.
        let metal_rough = sample(metallic_roughness_maps, metallic_roughness_sampler, material, MAP_METALLIC_ROUGHNESS, uvs);
        let metallic = saturate(metal_rough.b * material.metallic);
        let roughness = saturate(metal_rough.g * material.roughness);
        let strength = texel.a * material.specular_strength;
        let dielectric = min(0.04 * specular, vec3f(1.0)) * strength;
        surface.diffuse = base * (1.0 - metallic);
        surface.specular = mix(dielectric, base, metallic);
        surface.specular_90 = mix(vec3f(strength), vec3f(1.0), metallic);
        surface.gloss = max(roughness * roughness, 1e-3);
    }
    return surface;
}

fn is_ggx() -> bool {
    return SHADING == SHADING_METALLIC_ROUGHNESS || SHADING == SHADING_SPECULAR_GLOSSINESS;
}

fn reflected(surface: Surface, light: u32) -> vec3f {
    let arriving = arriving(light, surface.position);
    var reflection: vec3f;
    if is_ggx() {
        reflection = ggx_reflection(surface, arriving.toward);
    } else {
        reflection = classic_reflection(surface, arriving.toward, SHADING == SHADING_BLINN);
    }
    return arriving.color * reflection + arriving.ambient * surface.diffuse;
}

// All light on the surface that comes from lights, the scene's ambient and the sky; not its own emission.
fn lit(surface: Surface, slot: u32, instance: Instance, occlusion: f32) -> vec3f {
    var color = surface.diffuse * view.ambient * occlusion;
    var around = vec3f(0.0);
    let mirror = reflect(-surface.toward_eye, surface.normal);
    if LIGHTS == LIGHTS_ALL {
        let first = reaching[slot];
        for (var i = 0u; i < instance.reaching; i++) {
            color += reflected(surface, reaching[first + i]);
        }
    } else {
        // A count that is not known before keeps compilers from unrolling: where no light reaches an object, nothing is
        // computed for any.
        let chosen = vec3u(instance.lights[0], instance.lights[1], instance.lights[2]);
        let weights = vec3f(instance.weights[0], instance.weights[1], instance.weights[2]);
        let count = dot(vec3u(1u), select(vec3u(1u), vec3u(0u), chosen == vec3u(NO_LIGHT)));
        for (var i = 0u; i < count; i++) {
            color += weights[i] * reflected(surface, chosen[i]);
        }
        let ambient = instance.remainder_ambient;
        let direction = instance.remainder_direction;
        let sides = instance.remainder_sides;
        color += surface.diffuse * remainder(ambient, direction, sides, surface.normal);
        if is_ggx() {
            // The duller the surface, the more of the lights its highlight finds.
            around = remainder(ambient, direction, sides, mirror) * surface.gloss;
        }
    }
    if is_ggx() {
        around += sky_blurred(mirror, sqrt(surface.gloss));
        color += mirrored_share(surface) * around * occlusion;
    }
    return color;
}

@fragment
fn fs_main(in: VertexOut, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let uvs = Uvs(in.uvs, dpdx(in.uvs), dpdy(in.uvs));
    let instance = load_instance(in.slot);
    let material = load_material(instance.material);
    let base = base_color(material, uvs, in.color);
    let normal = shading_normal(material, in, uvs, front);
    if ALPHA == ALPHA_MASK && base.a < material.alpha_cutoff {
        discard;
    }
    var surface = surface_at(material, base.rgb, uvs);
    surface.position = in.position;
    surface.normal = normal;
    surface.toward_eye = select(normalize(view.eye - in.position), view.toward_eye, view.parallel == 1u);
    var color = surface.diffuse;
    if DEBUG != 0u {
        color = debug_color(surface, base.rgb, instance, in.tangent.xyz);
    } else if SHADING != SHADING_UNLIT {
        var occlusion = 1.0;
        var emission = vec3f(0.0);
        if EMISSIVE {
            emission = sample(emissive_maps, emissive_sampler, material, MAP_EMISSIVE, uvs).rgb * material.emissive_factor;
        }
        if is_ggx() {
            let open = sample(occlusion_maps, occlusion_sampler, material, MAP_OCCLUSION, uvs).r;
            occlusion = 1.0 + material.occlusion_strength * (open - 1.0);
        } else {
            // The classic model's emission is one more light on the base colour.
            emission *= base.rgb;
        }
        color = lit(surface, in.slot, instance, occlusion) + emission;
    }
    if DEBUG == 0u {
        color = exposed(color);
    }
    return vec4f(color, select(1.0, base.a, ALPHA == ALPHA_BLEND));
}

struct Outputs {
    // Shading normal, world space; w 1.
    @location(0) normal: vec4f,
    // Entity index + 1; 0 where there is nothing.
    @location(1) id: u32,
}

@fragment
fn fs_outputs(in: VertexOut, @builtin(front_facing) front: bool) -> Outputs {
    let uvs = Uvs(in.uvs, dpdx(in.uvs), dpdy(in.uvs));
    let instance = load_instance(in.slot);
    let material = load_material(instance.material);
    let alpha = base_color(material, uvs, in.color).a;
    let normal = shading_normal(material, in, uvs, front);
    // A blended surface counts where it hides more than half of what is behind it.
    let cutoff = select(material.alpha_cutoff, 0.5, ALPHA == ALPHA_BLEND);
    if ALPHA != ALPHA_OPAQUE && alpha < cutoff {
        discard;
    }
    return Outputs(vec4f(normal, 1.0), instance.entity + 1u);
}
