// What can be looked at instead of the lit picture; chosen when a pipeline is made (override DEBUG, 0: none).

override DEBUG: u32 = 0u;

const DEBUG_BASE = 1u;
const DEBUG_NORMAL = 2u;
const DEBUG_TANGENT = 3u;
const DEBUG_LIGHT_COUNT = 4u;
const DEBUG_THREE_LIGHTS = 5u;

fn debug_color(surface: Surface, base: vec3f, slot: u32, tangent: vec3f) -> vec3f {
    if DEBUG == DEBUG_BASE {
        return base;
    } else if DEBUG == DEBUG_NORMAL {
        return surface.normal * 0.5 + 0.5;
    } else if DEBUG == DEBUG_TANGENT {
        return normalize(tangent) * 0.5 + 0.5;
    }
    let headlight = 0.25 + 0.75 * abs(dot(surface.normal, surface.toward_eye));
    if DEBUG == DEBUG_THREE_LIGHTS {
        // Red, green and blue: how much each of the three gives here.
        var given = vec3f(0.02);
        for (var i = 0u; i < 3u; i++) {
            let light = instances[slot].lights[i];
            if light != NO_LIGHT {
                let here = arriving(light, surface.position);
                let n_l = max(dot(surface.normal, here.toward), 0.0);
                given[i] += instances[slot].weights[i] * luminance(here.color) * n_l;
            }
        }
        let picked = select(0.5, 1.0, instances[slot].entity == view.picked_entity);
        return given * picked;
    }
    // Light count: how many reach the pixel, 0 blue to 8 and more red.
    var count = 0.0;
    for (var i = 0u; i < view.light_count; i++) {
        let here = arriving(i, surface.position);
        count += select(0.0, 1.0, luminance(abs(here.color)) > 1e-4);
    }
    let heat = saturate(count / 8.0);
    return headlight * saturate(vec3f(2.0 * heat, 2.0 - abs(4.0 * heat - 2.0), 1.5 - 3.0 * heat));
}
