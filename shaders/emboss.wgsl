// Emboss bump mapping (Blinn, "Simulation of Wrinkled Surfaces", 1978, gave the idea of differences of heights; Gold:
// "Emboss bump mapping", 1999): N·L of the bumped surface is that of the smooth one plus how much lower the height is a
// step toward the light.

// Directions that slant by less are read a smaller step away: a light behind the surface lights nothing.
const EMBOSS_FULL_COSINE = 0.125;

// UV a step away from the pixel toward a light, given as right, up, out. Nowhere else on a mesh without UVs.
fn emboss_uv(field: HeightField, step_texels: f32, light: vec3f) -> vec2f {
    let texels = select(0.0, step_texels, field.metres > 0.0);
    let step = texels * saturate(light.z / EMBOSS_FULL_COSINE) / vec2f(textureDimensions(height_or_environment_maps));
    return field.at + light.xy * step * vec2f(1.0, -1.0);
}

// The single-pass form: Fd + H(uv) − H(uv + s·l).
fn embossed(field: HeightField, step_texels: f32, toward: vec3f) -> f32 {
    let light = along_image(field, toward);
    let difference = field_height(field, field.at) - field_height(field, emboss_uv(field, step_texels, light));
    return max(max(light.z, 0.0) + difference, 0.0);
}

// The form in several passes, as hardware without programs did it, the sum in the target's alpha. For each light:
//   height     alpha = H / 2
//   shifted    alpha + (1 − H(toward the light)) / 2     a flat map: exactly 0.5, mid grey
//   diffuse    alpha + (Fd − 1) / 2
//   clamped    max(alpha, 0)
//   colored    color + 2 · alpha · base colour · light
// and last of all alpha = 1.
override EMBOSS_STEP: u32 = 0u;
override EMBOSS_LIGHT: u32 = 0u;

const EMBOSS_HEIGHT = 0u;
const EMBOSS_SHIFTED = 1u;
const EMBOSS_DIFFUSE = 2u;
const EMBOSS_CLAMPED = 3u;
const EMBOSS_COLORED = 4u;
const EMBOSS_OPAQUE = 5u;

@fragment
fn fs_emboss(in: VertexOut, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let uvs = Uvs(in.uvs, dpdx(in.uvs), dpdy(in.uvs));
    let dp_dx = dpdx(in.position);
    let dp_dy = dpdy(in.position);
    if EMBOSS_STEP == EMBOSS_CLAMPED {
        return vec4f(0.0);
    } else if EMBOSS_STEP == EMBOSS_OPAQUE {
        return vec4f(1.0);
    }
    let instance = load_instance(in.slot);
    let material = load_material(instance.material);
    let slot = instance.lights[EMBOSS_LIGHT];
    // Before any pixel leaves: its neighbours may need it to choose mip levels.
    var diffuse = vec3f(0.0);
    if EMBOSS_STEP == EMBOSS_COLORED {
        let base = base_color(material, uvs, in.color).rgb;
        diffuse = surface_at(material, base, uvs).diffuse;
    }
    if slot == NO_LIGHT {
        return vec4f(0.0);
    }
    let bump = bumped(material, in, uvs, dp_dx, dp_dy, front);
    let arriving = arriving(slot, in.position, view.eye);
    let light = along_image(bump.field, arriving.toward);
    if EMBOSS_STEP == EMBOSS_HEIGHT {
        return vec4f(0.5 * field_height(bump.field, bump.field.at));
    } else if EMBOSS_STEP == EMBOSS_SHIFTED {
        return vec4f(0.5 - 0.5 * field_height(bump.field, emboss_uv(bump.field, material.emboss_step_texels, light)));
    } else if EMBOSS_STEP == EMBOSS_DIFFUSE {
        return vec4f(0.5 * max(light.z, 0.0) - 0.5);
    }
    find_shadows(in, dp_dx, dp_dy);
    let color = arriving.color * visibility(arriving, bump, EMBOSS_LIGHT);
    return vec4f(exposed(2.0 * instance.weights[EMBOSS_LIGHT] * diffuse * color), 0.0);
}
