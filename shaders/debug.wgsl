// What can be looked at instead of the lit picture; chosen when a pipeline is made (override DEBUG, 0: none).

override DEBUG: u32 = 0u;

const DEBUG_BASE = 1u;
const DEBUG_NORMAL = 2u;
const DEBUG_TANGENT = 3u;
const DEBUG_LIGHT_COUNT = 4u;
const DEBUG_THREE_LIGHTS = 5u;
const DEBUG_ERROR_BOUND = 6u;
const DEBUG_VISIBILITY = 7u;
const DEBUG_CELLS = 8u;
const DEBUG_OPENNESS = 9u;

// Colour of the heat maps, 0 blue, by green to 1 red; src/renderer/plan/settings.rs has its twin for the legend.
fn heat_color(heat: f32) -> vec3f {
    let h = saturate(heat);
    return saturate(vec3f(4.0 * h - 2.0, 2.0 - abs(4.0 * h - 2.0), 2.0 - 4.0 * h));
}

// Where there is nothing to count.
const HEAT_NONE = vec3f(0.2);

// What the colours stand for; the legend says the same. Of the number of lights: 1 blue, so many doublings on red.
const LIGHT_COUNT_DOUBLINGS: f32 = 6.0;
// Of the error bound: this power of ten blue, so many decades on red.
const ERROR_BOUND_FIRST_DECADE: f32 = -3.0;
const ERROR_BOUND_DECADES: f32 = 4.0;

fn debug_color(surface: Surface, bump: Bump, base: vec3f, instance: Instance, tangent: vec3f) -> vec3f {
    if DEBUG == DEBUG_BASE {
        return base;
    } else if DEBUG == DEBUG_NORMAL {
        return surface.normal * 0.5 + 0.5;
    } else if DEBUG == DEBUG_TANGENT {
        return normalize(tangent) * 0.5 + 0.5;
    } else if DEBUG == DEBUG_OPENNESS {
        return vec3f(openness(surface.normal, 0.0));
    }
    let headlight = 0.25 + 0.75 * abs(dot(surface.normal, surface.toward_eye));
    if DEBUG == DEBUG_CELLS {
        // Grey; cells.wgsl colours it.
        return vec3f(headlight);
    }
    if DEBUG == DEBUG_VISIBILITY {
        var seen = vec3f(1.0);
        for (var i = 0u; i < 3u; i++) {
            let light = instance.lights[i];
            if light != NO_LIGHT {
                seen[i] = visibility(arriving(light, surface.position, view.eye), bump, i);
            }
        }
        return headlight * seen;
    }
    if DEBUG == DEBUG_THREE_LIGHTS {
        // Red, green and blue: how much each of the three gives here.
        var given = vec3f(0.02);
        for (var i = 0u; i < 3u; i++) {
            let light = instance.lights[i];
            if light != NO_LIGHT {
                let here = arriving(light, surface.position, view.eye);
                let n_l = max(dot(surface.normal, here.toward), 0.0);
                given[i] += instance.weights[i] * luminance(here.color) * n_l;
            }
        }
        let picked = select(0.5, 1.0, instance.entity == view.picked_entity);
        return given * picked;
    }
    // Heat maps of what the selection knows of the object: the same wherever on it, whatever the number of lights.
    if DEBUG == DEBUG_LIGHT_COUNT {
        let count = f32(instance.reaching);
        let heat = log2(max(count, 1.0)) / LIGHT_COUNT_DOUBLINGS;
        return headlight * select(HEAT_NONE, heat_color(heat), count > 0.0);
    }
    // Error bound, as bright as the picture shows it.
    let bound = instance.dropped * view.exposure;
    let decades = log2(max(bound, 1e-9)) / log2(10.0);
    let heat = (decades - ERROR_BOUND_FIRST_DECADE) / ERROR_BOUND_DECADES;
    return headlight * select(HEAT_NONE, heat_color(heat), bound > 0.0);
}
