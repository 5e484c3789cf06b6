// The forward pass: objects in batches, each pixel lit by its object's lights.
//
// The overrides are set when a pipeline is made; see src/renderer/passes/pipelines.rs.

override SHADING: u32 = 0u;
override ALPHA: u32 = 0u;
override TRANSFORMED_UVS: bool = true;
override EMISSIVE: bool = true;
override ENVIRONMENT_MAP: bool = false;
override VERTEX_COLORS: bool = true;

const ALPHA_OPAQUE = 0u;
const ALPHA_MASK = 1u;
const ALPHA_BLEND = 2u;

// The maps that pixels of one technique read: `bound_maps` of src/renderer/resources/textures.rs has the same order.
// Perturbed UV reads neither normal nor height map; its own two are bound in their places.
@group(1) @binding(0) var base_maps: texture_2d_array<f32>;
@group(1) @binding(1) var normal_or_offset_maps: texture_2d_array<f32>;
@group(1) @binding(2) var specular_maps: texture_2d_array<f32>;
@group(1) @binding(3) var metallic_roughness_maps: texture_2d_array<f32>;
@group(1) @binding(4) var occlusion_maps: texture_2d_array<f32>;
@group(1) @binding(5) var emissive_maps: texture_2d_array<f32>;
@group(1) @binding(6) var height_or_environment_maps: texture_2d_array<f32>;
@group(1) @binding(7) var horizon_0_maps: texture_2d_array<f32>;
@group(1) @binding(8) var horizon_1_maps: texture_2d_array<f32>;
@group(1) @binding(9) var base_sampler: sampler;
@group(1) @binding(10) var normal_or_offset_sampler: sampler;
@group(1) @binding(11) var specular_sampler: sampler;
@group(1) @binding(12) var metallic_roughness_sampler: sampler;
@group(1) @binding(13) var occlusion_sampler: sampler;
@group(1) @binding(14) var emissive_sampler: sampler;
@group(1) @binding(15) var height_or_environment_sampler: sampler;
@group(1) @binding(16) var horizon_0_sampler: sampler;
@group(1) @binding(17) var horizon_1_sampler: sampler;

// The picture without blended objects, for those that refract it.
@group(2) @binding(0) var scene_color: texture_2d<f32>;

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
    @invariant @builtin(position) clip_position: vec4f,
    // From the eye, along the world's axes: far from the origin, differences from pixel to pixel would be lost in
    // rounding.
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

// A vertex from the eye, along the world's axes.
fn from_eye(rows: array<vec4f, 3>, position: vec3f) -> vec3f {
    let turned = vec3f(dot(rows[0].xyz, position), dot(rows[1].xyz, position), dot(rows[2].xyz, position));
    return turned + (vec3f(rows[0].w, rows[1].w, rows[2].w) - view.eye);
}

fn transformed(in: VertexIn) -> VertexOut {
    let rows = load_world_from_object(in.slot);
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
    out.position = from_eye(rows, in.position);
    out.clip_position = view.clip_from_eye * vec4f(out.position, 1.0);
    out.normal = unit_or(normal, vec3f(0.0, 1.0, 0.0));
    out.tangent = vec4f(unit_or(tangent, vec3f(1.0, 0.0, 0.0)), in.tangent.w * handedness);
    out.uvs = in.uvs;
    out.color = in.color;
    out.slot = in.slot;
    return out;
}

@vertex
fn vs_main(in: VertexIn) -> VertexOut {
    return transformed(in);
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
    let second = ((material.second_uvs >> map) & 1u) == 1u;
    return ImageUv(
        image_from_mesh * select(uvs.at.xy, uvs.at.zw, second) + material.offsets[map],
        image_from_mesh * select(uvs.dx.xy, uvs.dx.zw, second),
        image_from_mesh * select(uvs.dy.xy, uvs.dy.zw, second),
    );
}

// Whether the device's own differences of the UVs choose the mip level: they are those of `Uvs`, finer or coarser, and
// devices take longer over what they are handed. Not for UVs that are made of what was read from a buffer or a map, nor
// once pixels are discarded, whose neighbours need them.
fn has_plain_uvs() -> bool {
    return !TRANSFORMED_UVS && ALPHA != ALPHA_MASK && !is_parallax() && !is_relief();
}

fn sample(maps: texture_2d_array<f32>, map_sampler: sampler, material: Material, map: u32, uvs: Uvs) -> vec4f {
    let uv = image_uv(material, map, uvs);
    if has_plain_uvs() {
        return textureSample(maps, map_sampler, uv.at, layer_of(material, map));
    }
    return textureSampleGrad(maps, map_sampler, uv.at, layer_of(material, map), uv.dx, uv.dy);
}

fn base_color(material: Material, uvs: Uvs, vertex_color: vec4f) -> vec4f {
    let texel = sample(base_maps, base_sampler, material, MAP_BASE, uvs);
    if VERTEX_COLORS {
        return texel * material.base_factor * vertex_color;
    }
    return texel * material.base_factor;
}

// From a position as VertexOut has it.
fn toward_eye(position: vec3f) -> vec3f {
    return select(normalize(-position), view.toward_eye, view.parallel == 1u);
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
        let metal_rough = sample(
            metallic_roughness_maps, metallic_roughness_sampler, material, MAP_METALLIC_ROUGHNESS, uvs);
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

// What is left of a light where the surface shadows itself.
fn unshadowed(material_shadow: f32, bump: Bump, toward: vec3f) -> f32 {
    let light = along_image(bump.field, toward);
    var horizon = 0.0;
    if has_mapped_horizon() {
        horizon = mapped_horizon(bump.field, bump.elevations, light);
    } else {
        horizon = marched_horizon(bump.field, bump.point, light);
    }
    return 1.0 + material_shadow * (over_horizon(horizon, light) - 1.0);
}

// What the surface gives off of a light, whose number among the object's lights is `number`.
fn reflected(surface: Surface, bump: Bump, material: Material, number: u32, light: u32, eye: vec3f) -> vec3f {
    let arriving = arriving(light, surface.position, eye);
    let color = arriving.color * visibility(arriving, bump, number);
    let ambient = arriving.ambient * surface.diffuse;
    if TECHNIQUE == TECHNIQUE_EMBOSS_MULTIPASS && number < 3u {
        // The passes that follow add the rest, for three lights.
        return ambient;
    } else if is_emboss() {
        // No highlight: a difference of heights says nothing of the direction that a mirror would look in.
        let lit = embossed(bump.field, material.emboss_step_texels, arriving.toward);
        return color * surface.diffuse * lit + ambient;
    } else if is_dot3() {
        return color * dot3_reflection(surface, bump, number, light, arriving) + ambient;
    }
    var reflection: vec3f;
    if is_ggx() {
        reflection = ggx_reflection(surface, arriving.toward);
    } else {
        reflection = classic_reflection(surface, arriving.toward, SHADING == SHADING_BLINN);
    }
    var passed = 1.0;
    if has_mapped_horizon() || has_marched_horizon() {
        passed = unshadowed(material.self_shadow, bump, arriving.toward);
    }
    return color * reflection * passed + ambient;
}

// All light on the surface that comes from lights, the scene's ambient and the sky; not its own emission.
fn lit(surface: Surface, bump: Bump, material: Material, instance: Instance, occlusion: f32) -> vec3f {
    var color = surface.diffuse * (view.ambient + sky_diffuse(surface.normal)) * occlusion;
    var around = vec3f(0.0);
    let mirror = reflect(-surface.toward_eye, surface.normal);
    let eye = view.eye;
    // A count that is not known before keeps compilers from unrolling, so that an object with one light pays for one; it
    // is asked at the end of the loop: where it comes first, Mesa's software driver, which runs eight pixels in step,
    // runs the body once more for none of them.
    let lights = vec3u(instance.lights[0], instance.lights[1], instance.lights[2]);
    let count = dot(vec3u(1u), select(vec3u(1u), vec3u(0u), lights == vec3u(NO_LIGHT))) + instance.listed;
    if count > 0u {
        var number = 0u;
        if LIGHT_LISTS {
            // Words of lights, four at a time, or five at first.
            var words = vec4u(instance.chosen, instance.first_listed.x);
            var fifth = instance.first_listed.y;
            var list = instance.list;
            var end = 5u;
            loop {
                loop {
                    let weight = f32(words.x & 1023u) / 1023.0;
                    color += weight * reflected(surface, bump, material, number, words.x >> 10u, eye);
                    words = vec4u(words.yzw, fifth);
                    number++;
                    if number >= min(count, end) {
                        break;
                    }
                }
                if number >= count {
                    break;
                }
                words = texel_of(list);
                list++;
                end += 4u;
            }
        } else {
            var chosen = lights;
            var weights = vec3f(instance.weights[0], instance.weights[1], instance.weights[2]);
            loop {
                color += weights.x * reflected(surface, bump, material, number, chosen.x, eye);
                weights = vec3f(weights.yz, 0.0);
                chosen = vec3u(chosen.yz, NO_LIGHT);
                number++;
                if number >= count {
                    break;
                }
            }
        }
    }
    let ambient = instance.residual_ambient;
    let direction = instance.residual_direction;
    let sides = instance.residual_sides;
    color += surface.diffuse * residual(ambient, direction, sides, surface.normal);
    if is_ggx() {
        // The duller the surface, the more of the lights its highlight finds.
        around = residual(ambient, direction, sides, mirror) * surface.gloss;
    }
    if TECHNIQUE == TECHNIQUE_PERTURBED_UV {
        let blur = select(0.0, sqrt(surface.gloss), is_ggx());
        around += environment(material, shifted_mirror(surface, bump.offset), blur);
        color += select(surface.specular, mirrored_share(surface), is_ggx()) * around * occlusion;
    } else if is_ggx() && !is_emboss() {
        around += sky_mirrored(mirror, sqrt(surface.gloss));
        color += mirrored_share(surface) * around * occlusion;
    }
    return color;
}

struct Shaded {
    color: vec4f,
    // Of the surface, reversed.
    depth: f32,
    // Of the surface, world space.
    normal: vec3f,
    // Entity index + 1.
    id: u32,
}

// A pixel of an object. Discards what a mask leaves out.
fn shaded(in: VertexOut, front: bool) -> Shaded {
    let uvs = Uvs(in.uvs, dpdx(in.uvs), dpdy(in.uvs));
    let dp_dx = dpdx(in.position);
    let dp_dy = dpdy(in.position);
    var curved = 0.0;
    if SPECULAR_AA {
        curved = curved_slopes(in.normal);
    }
    let instance = load_instance(in.slot);
    let material = load_material(instance.material);
    let bump = bumped(material, in, uvs, dp_dx, dp_dy, front);
    let base = base_color(material, bump.uvs, in.color);
    if ALPHA == ALPHA_MASK && base.a < material.alpha_cutoff {
        discard;
    }
    var surface = surface_at(material, base.rgb, bump.uvs);
    surface.position = bump.position;
    surface.normal = bump.normal;
    surface.toward_eye = toward_eye(bump.position);
    surface.diffuse_scale = 1.0;
    surface.highlight_scale = 1.0;
    surface.visibility_gloss = surface.gloss;
    if SPECULAR_AA {
        surface = widened(surface, bump.slopes, curved);
    }
    find_shadows(in, dp_dx, dp_dy);
    find_openness(in.position, select(-in.normal, in.normal, front));
    var color = surface.diffuse;
    if DEBUG != 0u {
        color = debug_color(surface, bump, base.rgb, instance, in.tangent.xyz);
    } else if SHADING != SHADING_UNLIT {
        var occlusion = 1.0;
        var emission = vec3f(0.0);
        if EMISSIVE {
            let texel = sample(emissive_maps, emissive_sampler, material, MAP_EMISSIVE, bump.uvs).rgb;
            emission = texel * material.emissive_factor;
        }
        if is_ggx() {
            let open = sample(occlusion_maps, occlusion_sampler, material, MAP_OCCLUSION, bump.uvs).r;
            occlusion = 1.0 + material.occlusion_strength * (open - 1.0);
        } else {
            // The classic model's emission is one more light on the base colour.
            emission *= base.rgb;
        }
        color = lit(surface, bump, material, instance, occlusion) + emission;
    }
    if DEBUG == 0u {
        color = exposed(color);
    }
    var alpha = select(1.0, base.a, ALPHA == ALPHA_BLEND);
    if TECHNIQUE == TECHNIQUE_PERTURBED_UV && ALPHA == ALPHA_BLEND && DEBUG == 0u {
        color = mix(refracted(in, material, bump.offset, dp_dx, dp_dy, uvs), color, alpha);
        alpha = 1.0;
    }
    let id = instance.entity + 1u;
    return Shaded(vec4f(color, alpha), depth_of(bump.position), bump.normal, id);
}

fn depth_of(position: vec3f) -> f32 {
    let clip = view.clip_from_eye * vec4f(position, 1.0);
    // Behind the eye is nearest.
    return select(1.0, saturate(clip.z / clip.w), clip.w > 0.0);
}

@fragment
fn fs_main(in: VertexOut, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    return shaded(in, front).color;
}

struct ColorAndDepth {
    @location(0) color: vec4f,
    @builtin(frag_depth) depth: f32,
}

// For techniques that displace the surface's depth.
@fragment
fn fs_z_correct(in: VertexOut, @builtin(front_facing) front: bool) -> ColorAndDepth {
    let pixel = shaded(in, front);
    return ColorAndDepth(pixel.color, pixel.depth);
}

// For views of one sample per pixel, whose picture and outputs are drawn together.
struct ColorAndOutputs {
    @location(0) color: vec4f,
    @location(1) normal: vec4f,
    @location(2) id: u32,
}

fn color_and_outputs(pixel: Shaded) -> ColorAndOutputs {
    return ColorAndOutputs(pixel.color, vec4f(pixel.normal, 1.0), pixel.id);
}

@fragment
fn fs_main_with_outputs(in: VertexOut, @builtin(front_facing) front: bool) -> ColorAndOutputs {
    return color_and_outputs(shaded(in, front));
}

struct ColorOutputsAndDepth {
    @location(0) color: vec4f,
    @location(1) normal: vec4f,
    @location(2) id: u32,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn fs_z_correct_with_outputs(in: VertexOut, @builtin(front_facing) front: bool) -> ColorOutputsAndDepth {
    let pixel = shaded(in, front);
    return ColorOutputsAndDepth(pixel.color, vec4f(pixel.normal, 1.0), pixel.id, pixel.depth);
}

struct Outputs {
    // Shading normal, world space; w 1.
    @location(0) normal: vec4f,
    // Entity index + 1; 0 where there is nothing.
    @location(1) id: u32,
}

struct OutputsAndDepth {
    @location(0) normal: vec4f,
    @location(1) id: u32,
    @builtin(frag_depth) depth: f32,
}

fn outputs(in: VertexOut, front: bool) -> OutputsAndDepth {
    let uvs = Uvs(in.uvs, dpdx(in.uvs), dpdy(in.uvs));
    let dp_dx = dpdx(in.position);
    let dp_dy = dpdy(in.position);
    let instance = load_instance(in.slot);
    let material = load_material(instance.material);
    let bump = bumped(material, in, uvs, dp_dx, dp_dy, front);
    let alpha = base_color(material, bump.uvs, in.color).a;
    // A blended surface counts where it hides half or more of what is behind it.
    let cutoff = select(material.alpha_cutoff, 0.5, ALPHA == ALPHA_BLEND);
    if ALPHA != ALPHA_OPAQUE && alpha < cutoff {
        discard;
    }
    return OutputsAndDepth(vec4f(bump.normal, 1.0), instance.entity + 1u, depth_of(bump.position));
}

@fragment
fn fs_outputs(in: VertexOut, @builtin(front_facing) front: bool) -> Outputs {
    let pixel = outputs(in, front);
    return Outputs(pixel.normal, pixel.id);
}

@fragment
fn fs_z_correct_outputs(in: VertexOut, @builtin(front_facing) front: bool) -> OutputsAndDepth {
    return outputs(in, front);
}

// Depths and ids alone, of what is opaque and has no depths of its own: neither maps nor normals are needed.
struct PlacedVertex {
    @invariant @builtin(position) clip_position: vec4f,
    @location(0) @interpolate(flat) slot: u32,
}

@vertex
fn vs_ids(@location(0) position: vec3f, @location(5) slot: u32) -> PlacedVertex {
    let from_eye = from_eye(load_world_from_object(slot), position);
    return PlacedVertex(view.clip_from_eye * vec4f(from_eye, 1.0), slot);
}

@fragment
fn fs_ids(in: PlacedVertex) -> @location(1) u32 {
    return load_instance(in.slot).entity + 1u;
}
