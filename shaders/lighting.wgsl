// Light on one point of a surface. Light units: see systems/lights/components.rs, Light.

const SHADING_PHONG = 0u;
const SHADING_BLINN = 1u;
const SHADING_METALLIC_ROUGHNESS = 2u;
const SHADING_SPECULAR_GLOSSINESS = 3u;
const SHADING_UNLIT = 4u;

// A light as it arrives at a point.
struct Arriving {
    // Unit, from the point to the light.
    toward: vec3f,
    // Colour · intensity · attenuation · spot factor.
    color: vec3f,
    // The light's ambient colour, attenuated.
    ambient: vec3f,
    // What shadows go by: the light's place from the eye, the way it shines, its kind and its shadow layer.
    from_eye: vec3f,
    direction: vec3f,
    kind: u32,
    shadow_layer: u32,
}

// The window that takes a light to exactly 0 at its range: (max(1 − (d²/R²)², 0))².
fn range_window(distance_squared: f32, inverse_range_squared: f32) -> f32 {
    let x = distance_squared * inverse_range_squared;
    let w = max(1.0 - x * x, 0.0);
    return w * w;
}

// systems/lights/relevance.rs has the twin of this function.
// `eye` is the view's, which is read once for many lights: Mesa's software driver would read it for each.
fn arriving(slot: u32, position: vec3f, eye: vec3f) -> Arriving {
    let light = load_light(slot);
    let from_eye = light.position - eye;
    let offset = from_eye - position;
    let distance_squared = dot(offset, offset);
    let d = sqrt(distance_squared);
    let toward = offset / max(d, 1e-6);
    let k = light.attenuation;
    var attenuation = range_window(distance_squared, light.inverse_range_squared)
        / max(k.x + d * (k.y + d * k.z), 1e-4);
    if LIGHTS_WITH_CONES && light.kind != LIGHT_POINT {
        // 1 − the cosine of the angle from the axis: half the square of the way between the ends of two unit vectors.
        // The cosines of narrow cones lie too close to 1 to be told apart.
        let between = light.direction + toward;
        let versine = 0.5 * dot(between, between);
        if LIGHTS_WITH_EXPONENTS && light.kind == LIGHT_SPOT_EXPONENT {
            let profile = pow(max(1.0 - versine, 1e-6), light.exponent_or_cone_slope);
            attenuation *= select(0.0, profile, versine < light.versine_outer);
        } else {
            // KHR_lights_punctual, "Inner and Outer Cone Angles", with versines for its cosines.
            let s = saturate((light.versine_outer - versine) * light.exponent_or_cone_slope);
            attenuation *= s * s;
        }
    }
    // Chosen at the end: there is little to save by leaving early, and drivers on the processor take longer over
    // branches.
    let parallel = light.kind == LIGHT_DIRECTIONAL;
    attenuation = select(select(attenuation, 0.0, light.kind == LIGHT_OFF), 1.0, parallel);
    return Arriving(
        select(toward, light.position, parallel),
        light.color * attenuation,
        light.ambient * attenuation,
        from_eye,
        light.direction,
        light.kind,
        light.shadow_layer,
    );
}

// A surface point, for all shading models.
struct Surface {
    position: vec3f,
    normal: vec3f,
    // Unit, to the eye.
    toward_eye: vec3f,
    // Diffuse colour.
    diffuse: vec3f,
    // Phong, Blinn: reflectance; GGX: reflectance at normal incidence.
    specular: vec3f,
    // GGX: reflectance at grazing incidence.
    specular_90: vec3f,
    // Phong, Blinn: the exponent; GGX: roughness α = perceptual roughness squared.
    gloss: f32,
    // What specular antialiasing changes beside gloss. What the diffuse part is multiplied with, and the highlights of
    // Phong, Blinn and dot3; GGX: roughness α of the visibility.
    diffuse_scale: f32,
    highlight_scale: f32,
    visibility_gloss: f32,
}

// Phong's and Blinn's models: diffuse · max(n·l, 0) + specular · S, S = max(r·v, 0)^shininess or max(n·h, 0)^shininess,
// nothing where the light is behind the surface.
fn classic_reflection(surface: Surface, toward: vec3f, blinn: bool) -> vec3f {
    let n_l = dot(surface.normal, toward);
    if n_l <= 0.0 {
        return vec3f(0.0);
    }
    let reflected = 2.0 * n_l * surface.normal - toward;
    let halfway = normalize(toward + surface.toward_eye);
    let cosine = select(dot(reflected, surface.toward_eye), dot(surface.normal, halfway), blinn);
    let highlight = select(0.0, pow(max(cosine, 1e-10), surface.gloss), cosine > 0.0 || surface.gloss == 0.0);
    return surface.diffuse * (n_l * surface.diffuse_scale) + surface.specular * (highlight * surface.highlight_scale);
}

// glTF 2.0, appendix B.3: GGX distribution, height-correlated Smith visibility, Schlick's Fresnel. Times π, so that a
// light of intensity 1 means the same to every shading model; times n·l.
fn ggx_reflection(surface: Surface, toward: vec3f) -> vec3f {
    let n_l = saturate(dot(surface.normal, toward));
    if n_l <= 0.0 {
        return vec3f(0.0);
    }
    let halfway = normalize(toward + surface.toward_eye);
    let n_v = max(dot(surface.normal, surface.toward_eye), 1e-4);
    let n_h = saturate(dot(surface.normal, halfway));
    let v_h = saturate(dot(surface.toward_eye, halfway));
    let a2 = surface.gloss * surface.gloss;
    let f = n_h * n_h * (a2 - 1.0) + 1.0;
    let distribution_times_pi = a2 / (f * f);
    let v2 = surface.visibility_gloss * surface.visibility_gloss;
    let visibility = 0.5 / (n_l * sqrt(n_v * n_v * (1.0 - v2) + v2) + n_v * sqrt(n_l * n_l * (1.0 - v2) + v2));
    let fresnel = surface.specular + (surface.specular_90 - surface.specular) * pow(1.0 - v_h, 5.0);
    let diffuse = (1.0 - fresnel) * surface.diffuse * surface.diffuse_scale;
    return (diffuse + fresnel * visibility * distribution_times_pi) * n_l;
}

// Share of surrounding light that a GGX surface mirrors: Karis' fit for mobile ("Physically Based Shading on Mobile",
// 2014) to the split-sum environment BRDF.
fn mirrored_share(surface: Surface) -> vec3f {
    let roughness = sqrt(surface.gloss);
    let n_v = saturate(dot(surface.normal, surface.toward_eye));
    let r = roughness * vec4f(-1.0, -0.0275, -0.572, 0.022) + vec4f(1.0, 0.0425, 1.04, -0.04);
    let a = min(r.x * r.x, exp2(-9.28 * n_v)) * r.x + r.y;
    let ab = vec2f(-1.04, 1.04) * a + r.zw;
    return surface.specular * ab.x + surface.specular_90 * ab.y;
}

// What an object's three lights leave out, as it arrives at a surface: an ambient cube (McTaggart: "Half-Life 2 /
// Valve Source Shading", GDC 2004), exact where the normal is along an axis; its colour is the mean one.
fn residual(ambient: vec3f, direction: vec3f, sides: vec3f, normal: vec3f) -> vec3f {
    let arriving = 0.5 * dot(normal * normal, sides + sign(normal) * direction);
    return max(vec3f(0.0), ambient * (arriving / max(luminance(ambient), 1e-6)));
}
